//! Common interface to the steps of all methods, for the location of events inside steps.

use super::cost::Cost;
use super::dop853::{Dense, Dop853, Step, StepTooSmall};
use super::gauss::{Gauss, GaussStep, Reversible};
use super::lobatto::{LobattoStep, Slopes};
use super::radau7::RadauStep;

/// An integration in progress, by one of two methods.
#[derive(Debug, Clone)]
pub enum Stepper<Y> {
    /// DOP853: as long as the error of each step allows.
    Explicit(Box<Dop853<Y>>),
    /// Gauss collocation: steps of one length, which keep the structure of a reversible motion.
    Symmetric(Box<Gauss<Y>>),
}

/// One accepted step, in the variable of its method: that of the right-hand side, or sigma of [`super::gauss`].
// Boxing would cost an allocation at every step.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)]
pub enum AcceptedStep<Y> {
    /// Of DOP853.
    Explicit(Step<Y>),
    /// Of Gauss collocation.
    Symmetric(GaussStep<Y>),
    /// Of Lobatto collocation.
    Collocated(LobattoStep<Y>),
    /// Of Radau IIA.
    Implicit(RadauStep<Y>),
}

/// Interpolant of a step.
// Boxing would cost an allocation at every step.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)]
pub enum StepInterpolant<Y> {
    /// The interpolant of DOP853, of order 7.
    Explicit(Dense<Y>),
    /// The polynomial of the step itself.
    Symmetric(GaussStep<Y>),
    /// The polynomials of the halves of the step.
    Collocated([LobattoStep<Y>; 2]),
    /// The polynomial of the step itself.
    Implicit(RadauStep<Y>),
}

impl<Y: Reversible> Stepper<Y> {
    /// Starts at `state` with its `slope`; `h` is a first guess. None if the motion has no pace at the start, which
    /// symmetric steps need for their length.
    pub fn new(symmetric: bool, state: Y, slope: Y, h: f64, tolerance: f64) -> Option<Self> {
        Some(if !symmetric {
            Self::Explicit(Box::new(Dop853::new(state, slope, h, tolerance)))
        } else {
            Self::Symmetric(Box::new(Gauss::new(state, slope, h, tolerance)?))
        })
    }

    /// True for symmetric steps.
    pub fn is_symmetric(&self) -> bool {
        matches!(self, Self::Symmetric(_))
    }

    /// Starts anew at another state with a step of about `h`; symmetric steps keep their length.
    pub fn restart(&mut self, state: Y, slope: Y, h: f64) -> Option<()> {
        match self {
            Self::Explicit(solver) => {
                solver.restart(state, slope, h);
                Some(())
            }
            Self::Symmetric(solver) => solver.restart(state, slope),
        }
    }

    /// Cost counters.
    pub fn cost(&self) -> Cost {
        match self {
            Self::Explicit(solver) => solver.cost(),
            Self::Symmetric(solver) => solver.cost(),
        }
    }

    /// Cost counters, to be increased by the caller for evaluations made outside the steps.
    pub fn cost_mut(&mut self) -> &mut Cost {
        match self {
            Self::Explicit(solver) => solver.cost_mut(),
            Self::Symmetric(solver) => solver.cost_mut(),
        }
    }

    /// The current state.
    pub fn state(&self) -> &Y {
        match self {
            Self::Explicit(solver) => solver.state(),
            Self::Symmetric(solver) => solver.state(),
        }
    }

    /// The slope at the current state, in the method's variable.
    pub fn slope(&self) -> &Y {
        match self {
            Self::Explicit(solver) => solver.slope(),
            Self::Symmetric(solver) => solver.slope(),
        }
    }

    /// Length of the next trial step.
    pub fn next_step(&self) -> f64 {
        match self {
            Self::Explicit(solver) => solver.next_step(),
            Self::Symmetric(solver) => solver.next_step(),
        }
    }

    /// Takes one step of at most `h_max`; `f` writes the slope of the right-hand side into its second argument.
    ///
    /// # Errors
    /// [`StepTooSmall`] if no step of a size worth taking is accepted.
    pub fn step(
        &mut self,
        f: impl FnMut(&Y, &mut Y) -> Option<()>,
        h_max: f64,
    ) -> Result<AcceptedStep<Y>, StepTooSmall> {
        match self {
            Self::Explicit(solver) => {
                let mut step = solver.blank();
                solver.step_into(f, h_max, &mut step)?;
                Ok(AcceptedStep::Explicit(step))
            }
            Self::Symmetric(solver) => Ok(AcceptedStep::Symmetric(solver.step(f, h_max)?)),
        }
    }

    /// Moves the state back inside the last step; `slope` is one of the step's slopes.
    pub fn rewind(&mut self, state: Y, slope: Y) {
        match self {
            Self::Explicit(solver) => solver.rewind(state, slope),
            Self::Symmetric(solver) => solver.rewind(state, slope),
        }
    }

    /// Announces another motion, as after a snap: symmetric steps are fitted anew.
    pub fn refit(&mut self) {
        if let Self::Symmetric(solver) = self {
            solver.refit();
        }
    }
}

impl<Y: Reversible> AcceptedStep<Y> {
    /// State at the start.
    pub fn from(&self) -> &Y {
        match self {
            Self::Explicit(step) => &step.from,
            Self::Symmetric(step) => &step.from,
            Self::Collocated(step) => &step.from,
            Self::Implicit(step) => &step.from,
        }
    }

    /// State at the end.
    pub fn to(&self) -> &Y {
        match self {
            Self::Explicit(step) => &step.to,
            Self::Symmetric(step) => &step.to,
            Self::Collocated(step) => &step.to,
            Self::Implicit(step) => &step.to,
        }
    }

    /// State at the end, to be corrected to rounding.
    pub fn to_mut(&mut self) -> &mut Y {
        match self {
            Self::Explicit(step) => &mut step.to,
            Self::Symmetric(step) => &mut step.to,
            Self::Collocated(step) => &mut step.to,
            Self::Implicit(step) => &mut step.to,
        }
    }

    /// Length.
    pub fn h(&self) -> f64 {
        match self {
            Self::Explicit(step) => step.h,
            Self::Symmetric(step) => step.h,
            Self::Collocated(step) => step.h,
            Self::Implicit(step) => step.h,
        }
    }

    /// Slopes at the stages of the step, first the start and last the end.
    pub fn stage_slopes(&self) -> &[Y] {
        match self {
            Self::Explicit(step) => step.stage_slopes(),
            Self::Symmetric(step) => step.stage_slopes(),
            Self::Collocated(step) => step.stage_slopes(),
            Self::Implicit(step) => step.stage_slopes(),
        }
    }

    /// The slope at the start.
    pub fn start_slope(&self) -> &Y {
        &self.stage_slopes()[0]
    }

    /// The slope at the end.
    pub fn end_slope(&self) -> &Y {
        match self {
            Self::Explicit(step) => step.end_slope(),
            Self::Symmetric(step) => step.end_slope(),
            Self::Collocated(step) => step.end_slope(),
            Self::Implicit(step) => step.end_slope(),
        }
    }

    /// This step with another length, at the same accuracy; for implicit steps a part of its polynomial.
    pub fn redo(&self, f: &mut impl Slopes<Y>, h: f64, cost: &mut Cost) -> Option<Self> {
        Some(match self {
            Self::Explicit(step) => Self::Explicit(step.redo(|at| f.slope(at), h, cost)?),
            Self::Symmetric(step) => {
                let f = |at: &Y, slope: &mut Y| {
                    *slope = f.slope(at)?;
                    Some(())
                };
                Self::Symmetric(step.redo(f, h, cost)?)
            }
            Self::Collocated(step) => Self::Collocated(step.redo(f.eightwise()?, h, cost)?),
            Self::Implicit(step) => {
                cost.evaluations += 1;
                Self::Implicit(step.part(|at| f.slope(at), h)?)
            }
        })
    }

    /// Interpolant of the step, for the location of events.
    pub fn interpolant(
        &mut self,
        f: &mut impl Slopes<Y>,
        cost: &mut Cost,
    ) -> Option<StepInterpolant<Y>> {
        Some(match self {
            Self::Explicit(step) => StepInterpolant::Explicit(step.dense(|at| f.slope(at), cost)?),
            Self::Symmetric(step) => StepInterpolant::Symmetric(step.clone()),
            Self::Collocated(step) => {
                cost.samples += 1;
                StepInterpolant::Collocated(step.halves(f.eightwise()?, cost)?)
            }
            Self::Implicit(step) => StepInterpolant::Implicit(step.clone()),
        })
    }
}

impl<Y: Reversible> StepInterpolant<Y> {
    /// The state at the fraction `x` in [0, 1] of the step.
    pub fn at(&self, x: f64) -> Y {
        match self {
            Self::Explicit(dense) => dense.at(x),
            Self::Symmetric(step) => step.at(x),
            Self::Collocated([first, _]) if x < 0.5 => first.at(2.0 * x),
            Self::Collocated([_, second]) => second.at(2.0 * x - 1.0),
            Self::Implicit(step) => step.at(x),
        }
    }
}
