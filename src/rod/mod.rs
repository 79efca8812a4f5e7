//! Cosserat rods in space (AMV Secs. 2, 4).

pub mod section;
