//! The integration tests, one binary.
mod elastica;
mod inversion;
mod support;
