//! The one error of the library: opaque, with predicates and a chain of context.

use std::fmt;

/// A specialised result.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a request could not be carried out.
///
/// A run that ends early is not an error but an outcome; an error is a broken request, or numbers
/// that the mathematics cannot serve. Ask with the predicates; print with `Display`, which gives
/// the whole chain, outermost first.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    kind: Kind,
    message: String,
    context: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Domain,
    Unreachable,
    Ambiguous,
    NoConvergence,
    IllConditioned,
    Io,
}

impl Error {
    /// An argument outside its set.
    pub(crate) fn domain(message: impl Into<String>) -> Self {
        Self::new(Kind::Domain, message)
    }

    /// A pose that no equilibrium has.
    pub(crate) fn unreachable(message: impl Into<String>) -> Self {
        Self::new(Kind::Unreachable, message)
    }

    /// A request that several answers fit.
    #[cfg_attr(not(feature = "scene"), allow(dead_code))]
    pub(crate) fn ambiguous(message: impl Into<String>) -> Self {
        Self::new(Kind::Ambiguous, message)
    }

    /// An iteration that did not reach its tolerance.
    pub(crate) fn no_convergence(message: impl Into<String>) -> Self {
        Self::new(Kind::NoConvergence, message)
    }

    /// An answer that double precision does not hold.
    pub(crate) fn ill_conditioned(message: impl Into<String>) -> Self {
        Self::new(Kind::IllConditioned, message)
    }

    /// A file that could not be read or written.
    pub fn io(message: impl Into<String>) -> Self {
        Self::new(Kind::Io, message)
    }

    fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self {
            kind,
            message: message.into(),
            context: Vec::new(),
        }
    }

    /// Adds what was being done when this happened.
    #[must_use]
    pub fn context(mut self, doing: impl Into<String>) -> Self {
        self.context.push(doing.into());
        self
    }

    /// True if an argument was outside its set.
    pub fn is_domain(&self) -> bool {
        self.kind == Kind::Domain
    }

    /// True if double precision does not hold the answer.
    pub fn is_ill_conditioned(&self) -> bool {
        self.kind == Kind::IllConditioned
    }

    /// True if no equilibrium has the pose that was asked for.
    pub fn is_unreachable(&self) -> bool {
        self.kind == Kind::Unreachable
    }

    /// True if several answers fit the request.
    pub fn is_ambiguous(&self) -> bool {
        self.kind == Kind::Ambiguous
    }

    /// True if an iteration did not reach its tolerance.
    pub fn is_no_convergence(&self) -> bool {
        self.kind == Kind::NoConvergence
    }

    /// True if a file could not be read or written.
    pub fn is_io(&self) -> bool {
        self.kind == Kind::Io
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for doing in self.context.iter().rev() {
            write!(f, "{doing}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}
