//! Typed domain error of the kernels: function, argument, value, allowed set.

use std::fmt;

/// An argument outside the set where the function has a finite value.
///
/// Small and `Copy`, so that a checked kernel costs nothing more. Converts into the library's [`crate::Error`], for
/// which [`crate::Error::is_domain`] is then true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomainError {
    /// Name of the function called.
    pub function: &'static str,
    /// Name of the argument refused.
    pub argument: &'static str,
    /// Value of the argument (may be NaN).
    pub value: f64,
    /// Allowed set, in words.
    pub allowed: &'static str,
}

impl fmt::Display for DomainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            function,
            argument,
            value,
            allowed,
        } = self;
        write!(
            f,
            "{function}: {argument} = {value:e} is outside its set: {allowed}"
        )
    }
}

impl std::error::Error for DomainError {}

impl From<DomainError> for crate::Error {
    fn from(fault: DomainError) -> Self {
        Self::domain(fault.to_string())
    }
}
