//! Bounces: rods pulled straight reverse the motion of bodies (theory 2.8).

use super::{AssemblyRun, AssemblySample};
use crate::event::Bounce;
use crate::locate::Timed;
use nalgebra::DVector;
use snaprod_systems::assembly::Tether;
use snaprod_systems::manifold::TAUT;
use snaprod_systems::math::se3::halves;
use snaprod_systems::solve::roots::chandrupatla;

/// Least part of the pull that must decelerate the bodies at a turning point for a bounce; the rest bears
/// loads, or holds a swing.
const THROWN: f64 = 0.5;
/// Half-width of the difference that gives the deceleration at a turning point, as a part of the step.
const BESIDE: f64 = 1e-3;

impl AssemblyRun<'_> {
    /// After a step: keeps the state at its end if a rod is taut, and finds the bounces within the step.
    pub(super) fn look_back(&mut self, from: f64) {
        let mut links = self.assembly.links().iter();
        let taut = links.any(|link| link.chart().is_taut());
        self.seen = None;
        if taut {
            self.seen = self.describe(&self.assembly, &self.solver.state().0);
            self.extra.evaluations += 1;
        }
        if !taut && self.parting.is_empty() {
            return;
        }
        let seen = self.seen.as_ref();
        let now: Vec<Option<bool>> = (0..self.watch.len())
            .map(|k| Some(seen?.tether(k)?.parting > 0.0))
            .collect();
        let before = std::mem::replace(&mut self.parting, now);
        let turned = |k: &usize| {
            let before = before.get(*k).copied().flatten();
            before != Some(false) && self.parting[*k] != Some(true)
        };
        let turned: Vec<usize> = (0..self.parting.len()).filter(turned).collect();
        if self.parting.iter().all(Option::is_none) {
            self.parting.clear();
        }
        let mut found: Vec<Bounce> = turned
            .into_iter()
            .filter_map(|k| self.bounce(k, from))
            .collect();
        found.sort_by(|a, b| a.t.total_cmp(&b.t));
        self.bounces.extend(found);
    }

    /// The bounce of rod `k` within the last step, which began at `from`; None without one.
    fn bounce(&mut self, k: usize, from: f64) -> Option<Bounce> {
        let to = self.solver.state().time();
        let tolerance = self.options.tolerance * (to - from);
        let mut parting = |t: f64| Some(self.tether_at(k, t)?.1.parting);
        let ends = [(from, parting(from)?), (to, parting(to)?)];
        if !(ends[0].1 > 0.0 && ends[1].1 <= 0.0) {
            return None;
        }
        let rate = |t| parting(t).unwrap_or(f64::NAN);
        let t = chandrupatla(rate, ends[0], ends[1], tolerance)?;
        let (at, tether) = self.tether_at(k, t)?;
        let mass = at.resistance(k, &tether)?;
        // n.r' changes by the tension times the acceleration of the distance: the pull turns with the
        // direction of the chord.
        let beside = BESIDE * (to - from);
        let (a, b) = ((t - beside).max(from), (t + beside).min(to));
        let rates = [a, b].map(|t| Some(self.tether_at(k, t)?.1.parting));
        let slowing = (rates[0]? - rates[1]?) / (b - a);
        let thrown = slowing * mass >= THROWN * tether.tension.powi(2);
        if !(tether.lambda > TAUT && mass.is_finite() && thrown) {
            return None;
        }
        let point = &at.at.points[k];
        let dynamic = |v: &[f64]| DVector::from_column_slice(v);
        Some(Bounce {
            rod: k,
            t,
            pose: dynamic(point.end.pose.translation.vector.as_slice()),
            velocity: dynamic(halves(&point.relative_twist()).1.as_slice()),
            tension: tether.tension,
            lambda: tether.lambda,
            elastic: tether.tension * tether.slack,
            mass,
        })
    }

    fn tether_at(&mut self, k: usize, t: f64) -> Option<(AssemblySample, Tether)> {
        let at = self.state_at(t)?;
        let tether = at.tether(k)?;
        self.extra.evaluations += 1;
        Some((at, tether))
    }
}
