//! The error type of the library, and the record of a computation that cannot go on.

mod checks;
mod message;

pub use checks::{AXES, RESULTANTS, STRAINS, marked_strains, named};
pub(crate) use checks::{check_finite, check_positive};
pub use message::{InUnits, Message, Quantity};

use std::error::Error as StdError;
use std::fmt;
use std::sync::Arc;

/// [`std::result::Result`] with the library's error as its default.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Error of a request that could not be carried out.
///
/// A run that ends early is not an error but an outcome (see [`Stuck`]). An error is an invalid request, or one
/// without an answer in double precision. Predicates tell the kind. `Display` gives the whole chain of causes,
/// outermost first; [`std::error::Error::source`] gives the next cause.
///
/// ```
/// # use snaprod_core as snaprod;
/// use std::error::Error as _;
///
/// let error = snaprod::Error::io("no such file").context("reading rod.toml");
/// assert!(error.is_io());
/// assert_eq!(error.to_string(), "reading rod.toml: no such file");
/// assert_eq!(error.source().unwrap().to_string(), "no such file");
/// ```
#[derive(Debug, Clone)]
pub struct Error {
    kind: ErrorKind,
    message: Message,
    source: Option<Arc<dyn StdError + Send + Sync>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ErrorKind {
    Domain,
    Unreachable,
    Ambiguous,
    NoConvergence,
    IllConditioned,
    Io,
}

impl Error {
    /// An argument outside its set.
    pub fn domain(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::Domain, message)
    }

    /// A pose that no equilibrium has.
    pub fn unreachable(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::Unreachable, message)
    }

    /// A request that several answers fit.
    pub fn ambiguous(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::Ambiguous, message)
    }

    /// An iteration without convergence to its tolerance.
    pub fn no_convergence(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::NoConvergence, message)
    }

    /// An answer that double precision cannot represent.
    pub fn ill_conditioned(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::IllConditioned, message)
    }

    /// A file that could not be read or written.
    pub fn io(message: impl Into<Message>) -> Self {
        Self::new(ErrorKind::Io, message)
    }

    fn new(kind: ErrorKind, message: impl Into<Message>) -> Self {
        Self {
            kind,
            message: message.into(),
            source: None,
        }
    }

    /// Wraps the error in another of the same kind with the operation in progress; this error becomes its source.
    #[must_use]
    pub fn context(self, doing: impl Into<Message>) -> Self {
        Self {
            kind: self.kind,
            message: doing.into(),
            source: Some(Arc::new(self)),
        }
    }

    /// Sets the source of the error.
    #[must_use]
    pub fn caused_by(mut self, source: impl StdError + Send + Sync + 'static) -> Self {
        self.source = Some(Arc::new(source));
        self
    }

    /// Converts the numbers of the error from units of the rod.
    #[must_use]
    pub fn in_units(&self, units: InUnits<'_>) -> Self {
        let source = self.source.as_ref();
        Self {
            kind: self.kind,
            message: self.message.in_units(units),
            source: source.map(|source| match source.downcast_ref::<Self>() {
                Some(error) => Arc::new(error.in_units(units)) as Arc<dyn StdError + Send + Sync>,
                None => source.clone(),
            }),
        }
    }

    /// Message of the whole chain of causes, with its numbers.
    fn chain_message(&self) -> Message {
        let source = self.source.as_deref();
        let said = match source.map(|source| (source.downcast_ref::<Self>(), source)) {
            None => return self.message.clone(),
            Some((Some(error), _)) => error.chain_message(),
            Some((None, other)) => other.to_string().into(),
        };
        self.message.clone().words(": ").then(said)
    }

    /// True if an argument is outside its set.
    pub fn is_domain(&self) -> bool {
        self.kind == ErrorKind::Domain
    }

    /// True if double precision cannot represent the answer.
    pub fn is_ill_conditioned(&self) -> bool {
        self.kind == ErrorKind::IllConditioned
    }

    /// True if no equilibrium has the requested pose.
    pub fn is_unreachable(&self) -> bool {
        self.kind == ErrorKind::Unreachable
    }

    /// True if several answers fit the request.
    pub fn is_ambiguous(&self) -> bool {
        self.kind == ErrorKind::Ambiguous
    }

    /// True if an iteration did not converge to its tolerance.
    pub fn is_no_convergence(&self) -> bool {
        self.kind == ErrorKind::NoConvergence
    }

    /// True if a file could not be read or written.
    pub fn is_io(&self) -> bool {
        self.kind == ErrorKind::Io
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.chain_message().fmt(f)
    }
}

impl StdError for Error {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        self.source
            .as_deref()
            .map(|e| e as &(dyn StdError + 'static))
    }
}

/// Equality of kind and text.
impl PartialEq for Error {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.to_string() == other.to_string()
    }
}

/// A motion or a continuation that cannot go on: place, cause, remedy.
#[derive(Debug, Clone, PartialEq)]
pub struct Stuck {
    /// Time of a motion, or parameter of a continuation, in the units of the computation.
    pub at: f64,
    /// Cause of the stop.
    pub cause: Cause,
    /// Remedy, as an imperative: "raise the tolerance".
    pub remedy: String,
}

/// Cause of a computation that cannot go on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Cause {
    /// No step longer than rounding meets the tolerance.
    StepCollapsed {
        /// The next trial step.
        next: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// Too many steps are left: steps get shorter and shorter.
    TooSlow {
        /// Steps left at the present pace.
        steps: f64,
    },
    /// The strains are at the edge of the section's domain.
    EdgeOfDomain,
    /// The strains vary too sharply along the rod for the finest grid.
    Unresolved {
        /// Most nodes on an element.
        most: usize,
        /// Size of the last coefficients of the strains, relative to 1 + strain.
        tail: f64,
    },
    /// The energy ledger does not close.
    Ledger {
        /// Change of the total, relative to its largest term.
        relative: f64,
    },
    /// A part of the computation failed.
    Failed(Error),
}

impl Stuck {
    /// The record with its remedy.
    pub fn new(at: f64, cause: Cause, remedy: impl Into<String>) -> Self {
        Self {
            at,
            cause,
            remedy: remedy.into(),
        }
    }

    /// Cause and remedy, without the place, whose name and unit the caller knows.
    pub fn message(&self) -> Message {
        self.cause.message().words(format!("; {}", self.remedy))
    }
}

/// [`Stuck::message`] in units of the rod.
impl fmt::Display for Stuck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.message().fmt(f)
    }
}

impl Cause {
    /// Description of the cause.
    fn message(&self) -> Message {
        let text = match self {
            Self::StepCollapsed { next, tolerance } => {
                return Message::from("the step size collapsed (next step ")
                    .size(*next, Quantity::Time)
                    .words(format!(", tolerance {tolerance:.1e})"));
            }
            Self::TooSlow { steps } => {
                format!("steps have become so short that the rest would take {steps:.1e} of them")
            }
            Self::EdgeOfDomain => {
                "the strains stand at the edge of what the section admits".to_owned()
            }
            Self::Unresolved { most, tail } => format!(
                "the strains would need more than {most} nodes on an element (their last coefficients are {tail:.1e}, relative to 1 + strain)"
            ),
            Self::Ledger { relative } => {
                format!("the energy ledger does not close (relative error {relative:.1e})")
            }
            Self::Failed(error) => return error.chain_message(),
        };
        text.into()
    }
}

/// The description in units of the rod.
impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.message().fmt(f)
    }
}

impl StdError for Stuck {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        match &self.cause {
            Cause::Failed(error) => Some(error),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a context that hides its cause from `source`, or loses its kind, and a lost error of the operating
    /// system.
    #[test]
    fn chain_of_causes_is_walked_by_source() {
        let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
        let error = Error::io("cannot open a.toml")
            .caused_by(missing)
            .context("the scene");
        assert!(error.is_io() && !error.is_domain());
        let opened = error.source().unwrap();
        let system = opened.source().unwrap();
        let kind = system.downcast_ref::<std::io::Error>().unwrap().kind();
        assert_eq!(kind, std::io::ErrorKind::NotFound);
        assert_eq!(
            error.to_string(),
            format!("the scene: cannot open a.toml: {system}")
        );
        assert!(system.source().is_none());
    }
}
