//! Average over one turn of a body that shakes along a nearly straight rod (theory 2.3).
//!
//! The end has the height y. Under the pull N the rod stores y^2 (k/2 - N c), with the stiffness k(N) across it and
//! 1 - x = c(N) y^2. Under the load f along the rod a body of mass 1 shakes in the potential y^2 psi between two pulls:
//! ```text
//! psi = k/2 + (f - N) c,   dpsi/dN = (f - N) c',   E = y^2 e,   period = y int sqrt(2) dc/sqrt(e - psi)
//! ```
//! The inner pull lies near -20.19, where the rod buckles with its end on the axis, and the outer one grows as e^2.
//! The integrals therefore run over x = ln(N + 20.19), by a Gauss rule that absorbs both turning points.

use super::beam::{BUCKLED, Beam, MOST_HELD};
use super::straight_chart;
use crate::manifold::{ShakingTurn, Sign};
use crate::solve::roots::chandrupatla;
use nalgebra::Vector2;
use std::f64::consts::{PI, SQRT_2};

/// Least excess of e over the minimum of psi, relative to 1 + the minimum, for averaging: weaker shaking loses digits
/// of e - psi.
const STRONG: f64 = 1e-6;
/// Quadrature points: a constant, and their growth with ln(N + 20.19) over the turn.
const POINTS: [f64; 2] = [40.0, 4.0];
/// Steps of ln(N + 20.19) in search of a turning point, at most.
const STEPS: usize = 200;

/// Potential psi of a beam under its pull and the load `load`.
fn level(beam: &Beam, load: f64) -> f64 {
    beam.stored + load * beam.shortening
}

/// Turn with the inner turning point q; `None` if the pull at q is not below `load`, or if the shaking is weak. Also
/// `None` for a `load` of [`MOST_HELD`] or less.
pub(super) fn shaking_turn(side: Sign, q: &Vector2<f64>, load: f64) -> Option<ShakingTurn> {
    let rod = straight_chart::point(side, q)?;
    let height = rod.pose[1] * side.value();
    let inward = straight_chart::inward(side, q)?;
    let pull = -rod.force[0];
    if !(load > MOST_HELD && height > 0.0 && pull < load) {
        return None;
    }
    let energy = (rod.energy + load * inward) / (height * height);
    let rest = Beam::new(load - BUCKLED);
    let least = level(&rest, load);
    if !(energy - least > STRONG * (1.0 + least.abs()) && energy < f64::INFINITY) {
        return None;
    }
    let beyond = |x: f64| level(&Beam::new(x.exp()), load) - energy;
    let middle = (load - BUCKLED).ln();
    let [inner, outer] = [-1.0, 1.0].map(|way| find_zero(&beyond, middle, way));
    let (inner, outer) = (inner?, outer?);
    let (half, centre) = (0.5 * (outer - inner), 0.5 * (outer + inner));
    let points = (POINTS[0] + POINTS[1] * (outer - inner)).ceil();
    let (mut time, mut sums) = (0.0, [0.0; 3]);
    for i in 0..points as usize {
        let angle = (i as f64 + 0.5) * PI / points;
        let x = centre + half * angle.cos();
        let beam = Beam::new(x.exp());
        let left = energy - level(&beam, load);
        if !(left > 0.0) {
            continue;
        }
        let weight = -beam.softening * x.exp() * half * angle.sin() / left.sqrt();
        time += weight;
        for (sum, value) in sums.iter_mut().zip([beam.stiffness, beam.shortening, left]) {
            *sum += weight * value;
        }
    }
    let [stiffness, shortening, left] = sums.map(|sum| sum / time);
    let at_inner = Beam::new(inner.exp());
    Some(ShakingTurn {
        period: SQRT_2 * height * time * PI / points,
        height: height * side.value(),
        stiffness,
        shortening,
        kinetic: 2.0 * left,
        inner_pull: inner.exp() + BUCKLED,
        inner_stiffness: at_inner.stiffness,
        inner_shortening: at_inner.shortening,
    })
}

/// Zero of a function of x, which is negative at `from`, in the direction `way`.
fn find_zero(beyond: &impl Fn(f64) -> f64, from: f64, way: f64) -> Option<f64> {
    let (mut near, mut at_near) = (from, beyond(from));
    for _ in 0..STEPS {
        let far = near + way;
        let at_far = beyond(far);
        if at_far >= 0.0 {
            return chandrupatla(beyond, (near, at_near), (far, at_far), 0.0);
        }
        (near, at_near) = (far, at_far);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 - x, stored energy and cross force over the height, of the rod under a pull with its end at this height.
    /// From the chart, not from the beam.
    fn bent(pull: f64, height: f64) -> [f64; 3] {
        let q = straight_chart::point_of_deflection(Sign::Plus, pull, height);
        let at = straight_chart::point(Sign::Plus, &q).unwrap();
        let inward = straight_chart::inward(Sign::Plus, &q).unwrap();
        [inward, at.energy, -at.force[1] / height]
    }

    /// Catches a wrong period or average. Reference: integrals over the distance 1 - x, of energies and forces from
    /// the chart.
    #[test]
    fn turns_are_those_of_the_chart() {
        let height = 1e-8;
        for (inner, load) in [(-15.0, 0.0), (-6.0, 3.0), (-12.0, -5.0)] {
            let [near, stored, _] = bent(inner, height);
            let energy = stored + load * near;
            let beyond = |pull: f64| {
                let [inward, stored, _] = bent(pull, height);
                (stored + load * inward) / energy - 1.0
            };
            let ends = [load + 1.0, 1e6].map(|pull| (pull, beyond(pull)));
            let outer = chandrupatla(beyond, ends[0], ends[1], 0.0).unwrap();
            let [far, ..] = bent(outer, height);
            let points = 400;
            let (mut time, mut sums) = (0.0, [0.0; 2]);
            for i in 0..points {
                let angle = (f64::from(i) + 0.5) * PI / f64::from(points);
                let place = 0.5 * (near + far) + 0.5 * (near - far) * angle.cos();
                let off = |pull: f64| bent(pull, height)[0] / place - 1.0;
                let ends = [inner, outer].map(|pull| (pull, off(pull)));
                let pull = chandrupatla(off, ends[0], ends[1], 0.0).unwrap();
                let [inward, stored, stiffness] = bent(pull, height);
                let left = energy - stored - load * inward;
                let weight = 0.5 * (near - far) * angle.sin() / left.sqrt();
                time += weight;
                sums[0] += weight * stiffness;
                sums[1] += weight * inward / (height * height);
            }
            let period = SQRT_2 * time * PI / f64::from(points);
            let q = straight_chart::point_of_deflection(Sign::Plus, inner, height);
            let turn = shaking_turn(Sign::Plus, &q, load).unwrap();
            let found = [turn.period, turn.stiffness, turn.shortening];
            let wanted = [period, sums[0] / time, sums[1] / time];
            for (found, wanted) in found.iter().zip(wanted) {
                let off = found / wanted - 1.0;
                assert!(off.abs() < 1e-9, "{inner}, {load}: {off:e}");
            }
        }
    }

    /// Catches digits lost where the end is almost on the axis: there the body bounces off a wall and falls under a
    /// constant push.
    #[test]
    fn on_the_axis_the_body_bounces_like_a_ball() {
        for load in [0.0, 7.0, -4.0] {
            let q = straight_chart::point_of_deflection(Sign::Plus, BUCKLED + 1e-6, 1e-15);
            let turn = shaking_turn(Sign::Plus, &q, load).unwrap();
            let push = load - BUCKLED;
            let fall = straight_chart::inward(Sign::Plus, &q).unwrap();
            let off = turn.period / (8.0 * fall / push).sqrt() - 1.0;
            assert!(off.abs() < 1e-5, "{load}: {off:e}");
            assert!((1.5 * turn.shortening / turn.inner_shortening - 1.0).abs() < 1e-5);
        }
    }
}
