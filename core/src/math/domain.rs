//! The typed error of the kernels: which argument of which function left its set.

use std::fmt;

/// An argument outside the set where the function has a finite value.
///
/// Small and `Copy`, so that a kernel costs nothing more for being checked; it converts into the
/// library's [`crate::Error`], where [`crate::Error::is_domain`] is true of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomainError {
    /// The function that was called.
    pub function: &'static str,
    /// The name of the argument it refused.
    pub argument: &'static str,
    /// The value it was given (may be NaN).
    pub value: f64,
    /// The set it may lie in, in words.
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
