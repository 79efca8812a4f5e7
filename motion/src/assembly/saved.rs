//! Saved states of assemblies of light rods: bodies, charts and spins, with the sums of the ledger.

use super::{AssemblyPending, AssemblyRun};
use crate::locate::Timed;
use crate::saved_state::{SavedState, outside_step};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3, Vector6};
use snaprod_systems::assembly::{Assembly, BodyMotion, Configuration, Integrals, Spin};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::rod::Wrench;

/// Method of the states.
const METHOD: &str = "an assembly of light rods";
/// Numbers of a body: place, quaternion (w, x, y, z), twist.
const BODY: usize = 13;
/// Numbers of the spin of a rod: 1 if there is one, quaternion, rate.
const SPIN: usize = 6;
/// Largest distance of rod ends from their attachments in a saved state, in tolerances.
const CLOSE: f64 = 100.0;

impl AssemblyRun<'_> {
    /// The state at a time within the last step or at its end.
    ///
    /// # Errors
    /// A time outside the last step; a run among obstacles; a moment at which a rod is at its fold.
    pub fn save(&mut self, t: f64) -> Result<SavedState> {
        if self.contacts.is_some() {
            return Err(Error::domain(
                "the state of a motion with contacts cannot be saved yet: follow the run to its end, or leave the contacts out",
            ));
        }
        let is_now = t == self.solver.state().time();
        if is_now && matches!(self.pending, Some(AssemblyPending::Fold(..))) {
            return Err(Error::domain(
                "a rod is at its fold at this moment, and about to snap: step once more first",
            ));
        }
        let sample = if is_now {
            self.sample_now()
        } else {
            self.state_at(t).ok_or_else(|| outside_step(t))?
        };
        let (now, integrals) = (&sample.at.now, &sample.at.integrals);
        let bodies = now.bodies.iter().flat_map(numbers_of_body);
        let charts = now.charts.iter().flat_map(|q| q.iter().copied());
        let spins = (0..now.charts.len()).flat_map(|k| numbers_of_spin(now.spin(k)));
        Ok(SavedState::new(METHOD, t, &sample.ledger)
            .with("bodies", bodies)
            .with("charts", charts)
            .with("spins", spins)
            .with("work", [integrals.work])
            .with("drag", [integrals.drag])
            .with("snaps", [self.snaps as f64])
            .with("time_without_mass", [self.unfelt]))
    }

    /// Goes on from a saved state.
    ///
    /// # Errors
    /// The state of another method or of another assembly; rods that do not reach their attachments, as after a change
    /// of their laws; a run among obstacles.
    pub fn restore(&mut self, saved: &SavedState) -> Result<()> {
        saved.check(METHOD)?;
        if self.contacts.is_some() {
            return Err(Error::domain(
                "a motion with contacts does not go on from a saved state yet: leave the contacts out",
            ));
        }
        let links = self.assembly.links().len();
        let bodies = saved.sized("bodies", BODY * self.first.at.now.bodies.len())?;
        let charts = saved.sized("charts", 6 * links)?;
        let spins = saved.sized("spins", SPIN * links)?;
        let start = Configuration {
            bodies: bodies.chunks(BODY).map(body).collect(),
            charts: charts.chunks(6).map(Wrench::from_column_slice).collect(),
            spins: spins.chunks(SPIN).map(spin).collect(),
        };
        let [work] = saved.array("work")?;
        let [drag] = saved.array("drag")?;
        let begun = |work: f64| {
            let integrals = Integrals {
                time: saved.t,
                work,
                drag,
            };
            Self::begin(
                Assembly::clone(&self.assembly),
                &start,
                integrals,
                self.options,
            )
        };
        let mut run = begun(work)?;
        let apart = run.first.drift();
        if !(apart <= CLOSE * self.options.tolerance) {
            return Err(Error::domain(format!(
                "the ends of the rods are {apart:.1e} of their length away from their attachments: a change of loads along light rods, or of \
                 their laws, changes their equilibria; give the rods their mass, inertia = \"full\", or change the loads on bodies alone"
            )));
        }
        let change = saved.work_of_change(&run.first.ledger)?;
        if change != 0.0 {
            run = begun(work + change)?;
        }
        let ledger = saved.ledger()?;
        run.released = ledger.total() - run.first.ledger.total();
        let [snaps] = saved.array("snaps")?;
        run.snaps = snaps as u64;
        [run.unfelt] = saved.array("time_without_mass")?;
        run.extra = self.solver.cost() + self.extra;
        run.first = run.sample_now();
        *self = run;
        Ok(())
    }
}

fn numbers_of_body(at: &BodyMotion) -> [f64; BODY] {
    let (r, p) = (at.pose.translation.vector, at.pose.rotation);
    let place = [r.x, r.y, r.z, p.w, p.i, p.j, p.k];
    std::array::from_fn(|i| if i < 7 { place[i] } else { at.twist[i - 7] })
}

fn body(numbers: &[f64]) -> BodyMotion {
    BodyMotion {
        pose: Isometry3::from_parts(
            Vector3::from_column_slice(&numbers[..3]).into(),
            turn(&numbers[3..7]),
        ),
        twist: Vector6::from_column_slice(&numbers[7..]),
    }
}

fn numbers_of_spin(spin: Option<&Spin>) -> [f64; SPIN] {
    spin.map_or([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], |spin| {
        let p = spin.turn;
        [1.0, p.w, p.i, p.j, p.k, spin.rate]
    })
}

fn spin(numbers: &[f64]) -> Option<Spin> {
    (numbers[0] != 0.0).then(|| Spin {
        turn: turn(&numbers[1..5]),
        rate: numbers[5],
    })
}

/// The rotation of a quaternion (w, x, y, z) of length 1 to rounding.
fn turn(p: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(p[0], p[1], p[2], p[3]))
}
