//! The energy ledger: kinetic (of body and rod) + elastic + potential + dissipated - work = constant.

use super::sheet::Phase;
use super::state::State;
use snaprod_systems::body::PointMass;
use snaprod_systems::manifold::ManifoldPoint;

/// The terms of the ledger at one moment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ledger {
    /// Kinetic energy of the body.
    pub kinetic: f64,
    /// Kinetic energy of the rod; 0 without mass.
    pub rod_kinetic: f64,
    /// Energy stored in the rod.
    pub elastic: f64,
    /// Potential of gravity and dead loads, zero at the clamp.
    pub potential: f64,
    /// Energy lost in snaps, to friction in the rod and to drag, so far.
    pub dissipated: f64,
    /// Work of the time-dependent forces and of the clamp, so far.
    pub work: f64,
}

impl Ledger {
    /// The ledger of a state on the manifold; `snapped` is the energy released in the snaps so far.
    pub fn new<const N: usize>(
        body: &PointMass<N>,
        at: &ManifoldPoint<N>,
        phase: &Phase<N>,
        snapped: f64,
    ) -> Self {
        Self {
            kinetic: body.kinetic(phase.t, &at.pose, &phase.v),
            rod_kinetic: 0.0,
            elastic: at.energy,
            potential: body.potential(phase.t, &at.pose),
            dissipated: snapped + phase.drag_loss,
            work: phase.work,
        }
    }

    /// Linear interpolation to `next`, at `x` in [0, 1].
    pub fn between(&self, next: &Self, x: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * x;
        Self {
            kinetic: mix(self.kinetic, next.kinetic),
            rod_kinetic: mix(self.rod_kinetic, next.rod_kinetic),
            elastic: mix(self.elastic, next.elastic),
            potential: mix(self.potential, next.potential),
            dissipated: mix(self.dissipated, next.dissipated),
            work: mix(self.work, next.work),
        }
    }

    /// The ledger in other units: one unit of energy becomes `energy`.
    pub fn scaled(&self, energy: f64) -> Self {
        Self {
            kinetic: self.kinetic * energy,
            rod_kinetic: self.rod_kinetic * energy,
            elastic: self.elastic * energy,
            potential: self.potential * energy,
            dissipated: self.dissipated * energy,
            work: self.work * energy,
        }
    }

    /// Change of each term since `before`.
    pub fn less(&self, before: &Self) -> Self {
        Self {
            kinetic: self.kinetic - before.kinetic,
            rod_kinetic: self.rod_kinetic - before.rod_kinetic,
            elastic: self.elastic - before.elastic,
            potential: self.potential - before.potential,
            dissipated: self.dissipated - before.dissipated,
            work: self.work - before.work,
        }
    }

    /// The conserved sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.rod_kinetic + self.elastic + self.potential + self.dissipated
            - self.work
    }

    /// The largest term, by which an error of the total is judged.
    pub fn largest(&self) -> f64 {
        [
            self.kinetic,
            self.rod_kinetic,
            self.elastic,
            self.potential,
            self.dissipated,
            self.work,
        ]
        .into_iter()
        .fold(0.0, |most, term| most.max(term.abs()))
    }
}

/// Closure of the energy ledger over all states that were measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LedgerClosure {
    /// The initial total.
    total: f64,
    /// Largest term so far.
    pub largest: f64,
    /// Largest change of the total so far.
    pub error: f64,
    /// Largest distance of rod ends from their attachments, in radians and lengths of the rod; 0 if the pose
    /// of the end is no state variable.
    pub drift: f64,
}

/// Number of tolerances by which the ledger of a sound run may be open.
const ALLOWED: f64 = 1e3;
/// Largest relative error of a ledger, whatever the tolerance: beyond it the motion is another one.
const LARGEST_OPEN_PART: f64 = 0.1;
/// Smallest tolerance of the ledger: smaller errors drown in rounding.
const FINEST: f64 = 1e-13;
/// Error relative to the largest term beyond which no energy of the motion can be trusted.
const OPEN: f64 = 1e-3;
/// Number of tolerances by which energies may be off at coarse tolerances.
const COARSE: f64 = 10.0;
/// Energy, in the units of the rod, up to which a rod at rest has rounding.
const REST: f64 = 1e-29;

impl LedgerClosure {
    /// A ledger with the initial total `total` and no measurements yet.
    pub fn new(total: f64) -> Self {
        Self {
            total,
            largest: 0.0,
            error: 0.0,
            drift: 0.0,
        }
    }

    /// Adds the ledger of one state, and the drift of rod ends from their attachments.
    pub fn measure(&mut self, state: &dyn State) {
        self.look(&state.ledger());
        self.drift = self.drift.max(state.drift());
    }

    /// Adds one ledger.
    pub fn look(&mut self, ledger: &Ledger) {
        self.largest = self.largest.max(ledger.largest());
        let error = (ledger.total() - self.total).abs();
        // NaN counts as an infinite error.
        self.error = if error >= 0.0 {
            self.error.max(error)
        } else {
            f64::INFINITY
        };
    }

    /// The error relative to the largest term.
    pub fn relative(&self) -> f64 {
        self.error / self.largest.max(f64::MIN_POSITIVE)
    }

    /// The closure in other units: one unit of energy becomes `energy`.
    pub fn scaled(&self, energy: f64) -> Self {
        Self {
            total: self.total * energy,
            largest: self.largest * energy,
            error: self.error * energy,
            drift: self.drift,
        }
    }

    /// True if no energy of the motion can be trusted: the error is not small against the energies. An
    /// example is a motion so small that errors within the tolerance, which is relative to 1 + size, are of
    /// the size of its energies. At a coarse tolerance energies are as coarse. `energy`: the unit of energy.
    pub fn is_open(&self, energy: f64, tolerance: f64) -> bool {
        let allowed = OPEN.max(COARSE * tolerance);
        self.error > allowed * self.largest && self.largest > REST * energy
    }

    /// False if the run cannot be trusted. With E the largest term, in the units of the rod, EI/L, the error
    /// is then beyond 1000 tolerances of E + sqrt(E), or beyond a tenth of that.
    ///
    /// Steps are controlled relative to 1 + size, in rod units. So an error of one tolerance in velocities and
    /// strains becomes an error in the energy: sqrt(2 E) tolerances for small E (x dx with x^2/2 = E), E tolerances
    /// for large E. A sound run may gather such errors step by step, whatever the size of its energies.
    pub fn is_closed(&self, tolerance: f64) -> bool {
        self.within((ALLOWED * tolerance.max(FINEST)).min(LARGEST_OPEN_PART))
    }

    /// True if the energy error is so large that the motion is no longer the one that began: its snaps mean nothing.
    pub fn is_lost(&self) -> bool {
        !self.within(LARGEST_OPEN_PART)
    }

    fn within(&self, part: f64) -> bool {
        self.error <= part * (self.largest + self.largest.sqrt())
    }
}
