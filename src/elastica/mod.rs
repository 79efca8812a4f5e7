//! The planar elastica with a point mass at its free end, in closed form.
pub mod chart;
