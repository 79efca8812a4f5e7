//! The motion of the body in an exact reduction.

use super::balance::{BRANCHES, Balance, State, turned};
use super::{HELD, Reduction};
use crate::dynamics::Ledger;
use crate::error::{Error, Result};
use crate::rod::section::{Resultant, Strain};
use crate::solve::dop853::{Dop853, Step, Work};
use nalgebra::{Isometry3, SVector, Vector6};

/// Time, dissipated energy, work; then for three strains: values, rates, memory of each branch.
const SIZE: usize = 9 + 3 * BRANCHES;
type Packed = SVector<f64, SIZE>;

/// Steps between two samples, after which an explicit method has met a stiff motion.
const MOST_STEPS: u64 = 1_000_000;

/// A motion of a [`Reduction`] as it goes on.
#[derive(Debug, Clone)]
pub struct ReducedRun<'a> {
    reduction: &'a Reduction,
    integration: Dop853<Packed>,
    step: Step<Packed>,
    defect: f64,
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
        let state = self.pack(&self.start);
        let (slope, balance) = self.derivative(&state)?;
        let first = 1e-3 / (1.0 + slope.amax());
        let integration = Dop853::new(state, slope, first, tolerance);
        Ok(ReducedRun {
            reduction: self,
            step: integration.blank(),
            integration,
            defect: balance.defect().0,
        })
    }

    fn pack(&self, at: &State) -> Packed {
        let mut packed = Packed::zeros();
        packed[0] = at.time;
        for (i, k) in self.slots.iter().enumerate() {
            packed[3 + i] = at.strain[k];
            packed[6 + i] = at.rate[k];
            for (b, z) in at.branches.iter().enumerate() {
                packed[9 + 3 * b + i] = z[k];
            }
        }
        packed
    }

    fn unpack(&self, packed: &Packed) -> State {
        let mut at = self.start.clone();
        at.time = packed[0];
        for (i, k) in self.slots.iter().enumerate() {
            at.strain[k] = packed[3 + i];
            at.rate[k] = packed[6 + i];
            for (b, z) in at.branches.iter_mut().enumerate() {
                z[k] = packed[9 + 3 * b + i];
            }
        }
        at
    }

    fn derivative(&self, packed: &Packed) -> Result<(Packed, Balance)> {
        let at = self.unpack(packed);
        let balance = self.balance(&at)?;
        let mut slope = Packed::zeros();
        slope[0] = 1.0;
        slope[1] = balance.dissipation;
        slope[2] = balance.power;
        for (i, k) in self.slots.iter().enumerate() {
            slope[3 + i] = at.rate[k];
            slope[6 + i] = balance.acceleration[k];
            for (b, (branch, z)) in self.section.branches.iter().zip(&at.branches).enumerate() {
                slope[9 + 3 * b + i] = (at.strain[k] - z[k]) / branch.time;
            }
        }
        Ok((slope, balance))
    }

    fn sample(&self, packed: &Packed, defect: f64) -> Result<ReducedSample> {
        let at = self.unpack(packed);
        let balance = self.balance(&at)?;
        Ok(ReducedSample {
            time: at.time,
            wrench: turned(&balance.pose.rotation, &balance.resultants),
            pose: balance.pose,
            velocity: balance.velocity,
            resultants: balance.resultants,
            ledger: Ledger {
                kinetic: self.carried.kinetic(&balance.pose, &balance.velocity),
                elastic: balance.stored,
                potential: self.carried.potential(&balance.pose),
                dissipated: packed[1],
                work: packed[2],
            },
            defect,
            strain: at.strain,
            rate: at.rate,
            branches: at.branches,
        })
    }
}

impl ReducedRun<'_> {
    /// Goes on to the time `until` and samples the motion there. The time now gives a sample without a step.
    ///
    /// # Errors
    /// A time before the last one, or not finite; no step that stays in the domain of the laws; a million steps (a stiff
    /// motion: solve the full rod, whose integrator is implicit); a motion that has left the kind it was recognised as.
    pub fn sample_at(&mut self, until: f64) -> Result<ReducedSample> {
        let now = self.integration.state()[0];
        if !(now <= until && until < f64::INFINITY) {
            return Err(Error::domain(format!(
                "a sample at t = {until} is asked for: it must be finite, and not before t = {now}"
            )));
        }
        let most = self.work().steps + MOST_STEPS;
        loop {
            let now = self.integration.state()[0];
            // A remainder of roundoff is no step.
            if until - now <= 4.0 * f64::EPSILON * until.abs().max(now.abs()) {
                break;
            }
            if self.work().steps >= most {
                return Err(Error::no_convergence(format!(
                    "more than {MOST_STEPS} steps before t = {until}: the motion is stiff; solve the full rod instead"
                )));
            }
            self.advance(until - now)?;
        }
        self.reduction.sample(self.integration.state(), self.defect)
    }

    fn advance(&mut self, most: f64) -> Result<()> {
        let reduction = self.reduction;
        let mut fault = None;
        let mut defect = 0.0;
        let taken = self.integration.step_into(
            |at, slope| match reduction.derivative(at) {
                Ok((value, balance)) => {
                    *slope = value;
                    // The last evaluation of a step is at its end.
                    defect = balance.defect().0;
                    Some(())
                }
                Err(e) => {
                    fault = Some(e);
                    None
                }
            },
            most,
            &mut self.step,
        );
        let time = self.integration.state()[0];
        taken.map_err(|_| {
            let doing = format!("no step can be taken at t = {time}");
            match fault {
                Some(e) => e.context(doing),
                None => Error::no_convergence(doing),
            }
        })?;
        self.defect = self.defect.max(defect);
        if !(self.defect <= HELD) {
            return Err(Error::domain(format!(
                "at t = {time} the motion is no longer {}, by a relative defect of {:.1e}: solve the full rod instead",
                reduction.kind, self.defect
            )));
        }
        Ok(())
    }

    /// What the integration cost so far.
    pub fn work(&self) -> Work {
        self.integration.work()
    }
}
