//! The motion of the body in an exact reduction.

use super::balance::{Balance, State};
use super::{HELD, Reduction};
use crate::error::{Error, Result};
use crate::math::se3::turned;
use crate::motion::Ledger;
use crate::section::{Resultant, Strain};
use crate::solve::integrator::{Integrator, Method, Work};
use crate::solve::system::System;
use nalgebra::{DMatrix, DVector, Isometry3, Vector6};
use std::cell::RefCell;

/// Time, dissipated energy and work come first in the integrated vector; then the moving strains, their rates, and what
/// each branch remembers of them.
const FIRST: usize = 3;

/// Steps between two samples, after which something must be wrong.
const MOST_STEPS: u64 = 1_000_000;

/// A motion of a [`Reduction`] as it goes on.
pub struct ReducedRun<'a> {
    motion: Motion<'a>,
    integrator: Integrator,
    defect: f64,
}

/// The reduction as a system of ordinary differential equations.
struct Motion<'a> {
    reduction: &'a Reduction,
    /// What a law said where it could last not be evaluated.
    fault: RefCell<Option<Error>>,
}

/// The motion at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedSample {
    /// The time.
    pub time: f64,
    /// The strains, the same at all s.
    pub strain: Strain,
    /// Their rates.
    pub rate: Strain,
    /// The strains z of the Maxwell branches.
    pub branches: Vec<Strain>,
    /// The end's pose in the world frame.
    pub pose: Isometry3<f64>,
    /// (omega(1), r_t(1)) in the world frame; omega as the end's directors turn.
    pub velocity: Vector6<f64>,
    /// Resultants along the directors of the end.
    pub resultants: Resultant,
    /// The end wrench w1 = (m(1), n(1)) on the rod, in the world frame; the body feels -w1.
    pub wrench: Vector6<f64>,
    /// Energies.
    pub ledger: Ledger,
    /// Energy that the rod dissipates per time, and, of length 1, per length and time.
    pub friction: f64,
    /// Largest relative defect so far of what makes the reduction exact, at the ends of the steps.
    pub defect: f64,
}

impl Reduction {
    /// Starts a motion, to be integrated to `tolerance` per step (absolute for values below 1, relative above).
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-2]; a law that cannot be evaluated at the start.
    pub fn run(&self, tolerance: f64) -> Result<ReducedRun<'_>> {
        if !(1e-14..=1e-2).contains(&tolerance) {
            return Err(Error::domain(format!(
                "tolerance = {tolerance} must lie in [1e-14, 1e-2]"
            )));
        }
        let (_, balance) = self.derivative(&self.pack(&self.start))?;
        let motion = Motion {
            reduction: self,
            fault: RefCell::new(None),
        };
        let integrator = Integrator::new(
            &motion,
            self.pack(&self.start),
            tolerance,
            Method::Auto,
            None,
        )
        .ok_or_else(|| Error::domain("the laws cannot be evaluated at the start"))?;
        Ok(ReducedRun {
            motion,
            integrator,
            defect: balance.defect().0,
        })
    }

    fn pack(&self, at: &State) -> DVector<f64> {
        let fields = [&at.strain, &at.rate].into_iter().chain(&at.branches);
        let moving = fields.flat_map(|field| self.slots.iter().map(|k| field[k]));
        let values: Vec<f64> = [at.time, 0.0, 0.0].into_iter().chain(moving).collect();
        DVector::from_vec(values)
    }

    fn unpack(&self, packed: &DVector<f64>) -> State {
        let mut at = self.start.clone();
        at.time = packed[0];
        let mut rest = packed.iter().skip(FIRST);
        for field in [&mut at.strain, &mut at.rate]
            .into_iter()
            .chain(&mut at.branches)
        {
            for (k, value) in self.slots.iter().zip(&mut rest) {
                field[k] = *value;
            }
        }
        at
    }

    fn derivative(&self, packed: &DVector<f64>) -> Result<(DVector<f64>, Balance)> {
        let at = self.unpack(packed);
        let balance = self.balance(&at)?;
        let mut slope = self.pack(&self.slope(&at, &balance));
        slope[1] = balance.dissipation;
        slope[2] = balance.power;
        Ok((slope, balance))
    }

    fn sample(&self, packed: &DVector<f64>, defect: f64) -> Result<ReducedSample> {
        let at = self.unpack(packed);
        let balance = self.balance(&at)?;
        Ok(ReducedSample {
            time: at.time,
            wrench: turned(&balance.pose.rotation, &balance.resultants),
            pose: balance.pose,
            velocity: balance.velocity,
            resultants: balance.resultants,
            ledger: Ledger {
                kinetic: self
                    .carried
                    .kinetic(at.time, &balance.pose, &balance.velocity),
                elastic: balance.stored,
                potential: self.carried.potential(at.time, &balance.pose),
                dissipated: packed[1],
                work: packed[2],
            },
            friction: balance.friction,
            defect,
            strain: at.strain,
            rate: at.rate,
            branches: at.branches,
        })
    }
}

impl System for Motion<'_> {
    type Linearised = DMatrix<f64>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        match self.reduction.derivative(y) {
            Ok((slope, _)) => {
                out.copy_from(&slope);
                Some(())
            }
            Err(e) => {
                *self.fault.borrow_mut() = Some(e);
                None
            }
        }
    }

    /// By differences: few columns. Those of dissipation and work, too: they follow stiff rates, and an iteration that does
    /// not know it takes them for diverging.
    fn linearised(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        let (here, _) = self.reduction.derivative(y).ok()?;
        let mut jacobian = DMatrix::zeros(y.len(), y.len());
        for j in 0..y.len() {
            let step = f64::EPSILON.sqrt() * (1.0 + y[j].abs());
            let column = [step, -step].into_iter().find_map(|step| {
                let mut moved = y.clone();
                moved[j] += step;
                let (there, _) = self.reduction.derivative(&moved).ok()?;
                Some((there - &here) / step)
            })?;
            jacobian.set_column(j, &column);
        }
        Some(jacobian)
    }

    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let ends = from.iter().zip(to.iter());
        let terms = error
            .iter()
            .zip(ends)
            .map(|(e, (a, b))| (e / (1.0 + a.abs().max(b.abs()))).powi(2));
        terms.sum::<f64>() / error.len() as f64
    }
}

impl ReducedRun<'_> {
    /// Goes on to the time `until` and samples the motion there. The time now gives a sample without a step.
    ///
    /// # Errors
    /// A time before the last one, or not finite; no step that stays in the domain of the laws; a million steps; a motion
    /// that has left the kind it was recognised as.
    pub fn sample_at(&mut self, until: f64) -> Result<ReducedSample> {
        let now = self.integrator.state()[0];
        if !(now <= until && until < f64::INFINITY) {
            return Err(Error::domain(format!(
                "a sample at t = {until} is asked for: it must be finite, and not before t = {now}"
            )));
        }
        let most = self.work().steps + MOST_STEPS;
        loop {
            let now = self.integrator.state()[0];
            // A remainder of roundoff is no step.
            if until - now <= 4.0 * f64::EPSILON * until.abs().max(now.abs()) {
                break;
            }
            if self.work().steps >= most {
                return Err(Error::no_convergence(format!(
                    "more than {MOST_STEPS} steps before t = {until}, now t = {now}: use a coarser tolerance, or samples \
                     that are closer in time"
                )));
            }
            // A break that rounding has left ahead is behind.
            let next = self
                .motion
                .reduction
                .carried
                .next_break(now + 1e-14 * until);
            self.advance(until.min(next) - now)?;
        }
        self.motion
            .reduction
            .sample(self.integrator.state(), self.defect)
    }

    fn advance(&mut self, most: f64) -> Result<()> {
        self.motion.fault.take();
        let taken = self.integrator.step(&self.motion, most);
        let time = self.integrator.state()[0];
        taken.map_err(|_| {
            let doing = format!("no step can be taken at t = {time}");
            match self.motion.fault.take() {
                Some(e) => e.context(doing),
                None => Error::no_convergence(doing),
            }
        })?;
        let reduction = self.motion.reduction;
        let at = reduction.unpack(self.integrator.state());
        let (defect, why) = reduction.balance(&at)?.defect();
        self.defect = self.defect.max(defect);
        if !(self.defect <= HELD) {
            return Err(Error::domain(format!(
                "at t = {time} the motion is no longer {}: {why} (relative defect {defect:.1e}); solve the full rod instead",
                reduction.kind
            )));
        }
        Ok(())
    }

    /// What the integration cost so far.
    pub fn work(&self) -> Work {
        self.integrator.work()
    }
}
