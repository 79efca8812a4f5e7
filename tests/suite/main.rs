//! The integration tests, one binary.
mod arrows;
mod elastica;
mod inversion;
mod support;
