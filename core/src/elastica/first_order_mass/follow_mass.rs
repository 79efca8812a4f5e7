//! Light rod as felt by the body at its end: choice of chart, and the range in which its mass is followed.

use super::fold_ahead::{SoftestMode, fold_function};
use super::near_straight::sections;
use super::small_force::{LooseInertia, is_loose};
use super::{Adding, FoldNormalForm, OnEquilibria, ROUGH, RodInertia, TautInertia};
use crate::elastica::chart::Integrals;
use crate::elastica::curvature::TipDerivatives;
use crate::elastica::simd_sums;
use crate::manifold::{
    BendingLoad, DeflectionInertia, DeflectionState, EndInertia, FirstOrderInertia, ManifoldPoint,
};
use crate::math::frame::Frame;
use nalgebra::Vector2;

/// Planar elastica of small mass whose shapes stay equilibria.
///
/// The mass is followed on rods that are not pulled too hard, until 2 T_i before a fold, T_i = (M0)^(2/5)
/// (A B)^(-1/5). Within that time inertia delays the rod (theory 2.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightRod {
    /// Mass of the whole rod.
    pub mass: f64,
    /// Gravity, in the world.
    pub gravity: Vector2<f64>,
}

/// Load lam below which no fold is near: the least lam of a fold is 5.766 (`folds.rs`), and this leaves room for the
/// approach.
const UNFOLDED: f64 = 4.5;
/// Amplitude w at the clamp below which no fold is near: the first fold curve lies above 2.98 (`folds.rs`). For a taut
/// rod w is half the angle of the pull.
const PULLED_OUT: f64 = 2.0;
/// Times T_i before a fold within which the rod's mass is not followed, by the normal form.
const CLEAR: f64 = 2.0;
/// Sway of the softest shape, in radians, in the time left until a fold: below the first value the mass is no longer
/// followed, above the second it is again. Near folds these are 2 T_i and 3 T_i (theory 2.8, 2.9).
const SWAYS: [f64; 2] = [3.363_585_661, 5.583_629_155];
/// Scale of [`FirstOrderInertia::validity_margin`] near folds: multiples of the limit at which the room counts as
/// ample.
const AMPLE: f64 = 16.0;
/// Margin before a fold, from bounds alone, above which the integrals along the rod are not evaluated.
const FAR: f64 = 0.1;
/// Pulls lam above which a rod with an interior loop is not followed, and below which it is again.
const PULLED: [f64; 2] = [30.0, 20.0];
/// Ranges of |T| = |tan(gam/4)| in which a taut rod is followed, and followed again. Below, it is practically
/// straight and moves as a beam (theory 2.9). Above, its bend is a loop that has left the clamp.
const BENT: [[f64; 2]; 2] = [[1e-3, 21.0], [2e-3, 12.0]];
/// Bounds of |kap|: below the first a rod is practically straight and not followed, above the second it is again. A
/// practically straight rod holds its end along itself, and its sections swing sideways as 1/kap.
const STRAIGHT: [f64; 2] = [1e-3, 2e-3];

/// World vector in the axes of the clamp.
fn in_clamp_axes(vector: &Vector2<f64>, frame: Option<&Frame<2>>) -> Vector2<f64> {
    frame.map_or(*vector, |frame| frame.inward(vector))
}

impl LightRod {
    /// Inertia of the rod on a moving clamp.
    fn inertia_on_moving_clamp(
        &self,
        frame: &Frame<2>,
        rod: &impl OnEquilibria,
        v: &Vector2<f64>,
    ) -> Option<EndInertia<2>> {
        let carried = rod.moving_clamp_inertia(v, &self.gravity, frame)?;
        Some(carried.end_inertia(self.mass))
    }

    fn energies_of(
        &self,
        rod: &impl OnEquilibria,
        frame: Option<&Frame<2>>,
        v: &Vector2<f64>,
    ) -> Option<[f64; 2]> {
        if let Some(frame) = frame.filter(|frame| !frame.stands()) {
            let carried = rod.moving_clamp_inertia(v, &self.gravity, frame)?;
            let potential = -self.gravity.dot(&frame.place(&carried.centre));
            return Some([carried.kinetic, potential].map(|energy| energy * self.mass));
        }
        let added = rod.added_inertia(v, &in_clamp_axes(&self.gravity, frame))?;
        let kinetic = 0.5 * self.mass * v.dot(&(added.mass * v));
        let centre = frame.map_or(added.centre, |frame| frame.place(&added.centre));
        Some([kinetic, -self.mass * self.gravity.dot(&centre)])
    }
}

impl FirstOrderInertia<2> for LightRod {
    fn mass(&self) -> f64 {
        self.mass
    }

    fn gravity(&self) -> Vector2<f64> {
        self.gravity
    }

    fn end_inertia(
        &self,
        frame: Option<&Frame<2>>,
        [q, v]: [&Vector2<f64>; 2],
        point: &ManifoldPoint<2>,
        error: f64,
    ) -> Option<EndInertia<2>> {
        // The force is lam^2 (cos alpha, sin alpha).
        let lam = point.force.norm().sqrt();
        let (p, error) = (q[0], error / self.mass);
        let taut = TautInertia::at_load(p, lam).map(|rod| rod.to_part(error));
        let integrals = || Integrals::from_load_and_energy(p, q[1], lam, point.energy);
        let gravity = in_clamp_axes(&self.gravity, frame);
        let moving = frame.filter(|frame| !frame.stands());
        let slack = || RodInertia::with_integrals(p, integrals()).ok();
        let loose = is_loose(&point.force, point.pose.x, error);
        let (mass, push) = match (taut, moving) {
            (Some(rod), Some(frame)) => return self.inertia_on_moving_clamp(frame, &rod, v),
            (Some(rod), None) => rod.mass_and_force(v, &gravity)?,
            (None, Some(frame)) if loose => {
                return self.inertia_on_moving_clamp(frame, &LooseInertia::new(&slack()?)?, v);
            }
            (None, None) if loose => LooseInertia::new(&slack()?)?.mass_and_force(v, &gravity)?,
            (None, Some(frame)) => {
                return self.inertia_on_moving_clamp(frame, &slack()?.with_error(error), v);
            }
            (None, None) => simd_sums::wide(Adding {
                p,
                integrals: integrals(),
                error,
                v: *v,
                gravity,
            })?,
        };
        Some(EndInertia {
            mass: mass * self.mass,
            force: push * self.mass,
            pull: Vector2::zeros(),
            power: 0.0,
        })
    }

    fn deflection_inertia(
        &self,
        frame: Option<&Frame<2>>,
        at: &DeflectionState,
    ) -> Option<DeflectionInertia> {
        let (m, y, speed) = (self.mass, at.height, at.speed);
        let standing = Frame::<2>::at_rest();
        let frame = frame.unwrap_or(&standing);
        let gravity = frame.inward(&self.gravity);
        let mut felt = DeflectionInertia {
            mass: 0.0,
            force: 0.0,
            pull: 0.0,
            power: 0.0,
            bending: BendingLoad {
                by_rise: 0.0,
                rest: 0.0,
                inertia: 0.0,
            },
            energies: [0.0; 2],
        };
        for section in sections(at.pull)? {
            let share = m * section.weight;
            let turning = section.by_pull * at.tightening;
            let place = Vector2::new(section.s - section.shortening * y * y, section.across * y);
            // Derivative of the section's place by the deflection, its velocity, and its acceleration less gravity at
            // zero acceleration of the end.
            let by = Vector2::new(-2.0 * section.shortening * y, section.across);
            let v = by * speed + Vector2::new(0.0, turning * y);
            let swept = frame.acceleration_at_constant_velocity(&place, &v) - gravity
                + Vector2::new(-2.0 * section.shortening * speed, 2.0 * turning) * speed;
            let carried = frame.velocity_of_fixed_point(&place);
            felt.mass += share * by.norm_squared();
            felt.force -= share * by.dot(&swept);
            felt.pull += share * by.dot(&carried);
            felt.power += share * swept.dot(&carried);
            felt.bending.by_rise += share * section.by_pull * section.across;
            felt.bending.rest += share * section.by_pull * swept[1];
            felt.bending.inertia += share * section.by_pull * section.by_pull;
            felt.energies[0] += 0.5 * share * (v + carried).norm_squared();
            felt.energies[1] -= share * self.gravity.dot(&frame.place(&place));
        }
        Some(felt)
    }

    fn energies(
        &self,
        frame: Option<&Frame<2>>,
        [q, v]: [&Vector2<f64>; 2],
        error: f64,
    ) -> Option<[f64; 2]> {
        let error = error / self.mass;
        if let Some(rod) = TautInertia::new(q[0], q[1]) {
            return self.energies_of(&rod.to_part(error), frame, v);
        }
        let rod = RodInertia::new(q[0], q[1]).ok()?;
        let force = rod.turn().column(0) * rod.integrals.lam.powi(2);
        if is_loose(&force, rod.place().x, error) {
            return self.energies_of(&LooseInertia::new(&rod)?, frame, v);
        }
        self.energies_of(&rod.with_error(error), frame, v)
    }

    fn validity_margin(&self, q: &Vector2<f64>, v: &Vector2<f64>, followed: bool) -> f64 {
        let bound = usize::from(!followed);
        if let Some(rod) = TautInertia::new(q[0], q[1]) {
            let ([least, most], bend) = (BENT[bound], rod.bend());
            // A taut rod is at no fold before its bend is a loop (theory 2.9).
            if bend < most {
                return bend / least - 1.0;
            }
        }
        let Ok(rod) = RodInertia::new(q[0], q[1]) else {
            return -1.0;
        };
        let (i, bent) = (&rod.integrals, STRAIGHT[bound]);
        let bend = (i.kap.abs() / bent).max((1.0 - rod.place().x) / (bent * bent));
        let free = (bend - 1.0).min(1.0 - i.lam / PULLED[bound]);
        if !(free > 0.0) || i.lam < UNFOLDED || q[1] < PULLED_OUT {
            return free;
        }
        let Some((_, rate)) = rod.chart_rate(v) else {
            return -1.0;
        };
        // At a fold this function vanishes as the square root of the time left.
        let (fold, gradient) = fold_function(&TipDerivatives::new(&rod.point()), i);
        let falls = gradient.dot(&rate);
        if fold * falls >= 0.0 {
            return free;
        }
        let left = -0.5 * fold / falls;
        // The sway of the rod in the time left is regular. The normal form assumes a straight run into the fold; it may
        // give more time, on another scale. Near a fold the two agree. Where the drive vanishes for a moment neither is
        // bounded, so the normal form counts only while the mass is followed.
        let clear = |fold: &FoldNormalForm| {
            let inertial = CLEAR * fold.inertial(self.mass);
            (left.max(fold.time_ahead()) / inertial - 1.0) / AMPLE
        };
        // Most folds are far away; a bound without integrals shows this.
        if followed {
            let far = clear(&FoldNormalForm::ahead_of(&rod, v).0);
            if far > FAR {
                return free.min(far);
            }
        }
        let rod = rod.with_error(ROUGH);
        let sways = SoftestMode::of(&rod).sways(&rod, self.mass, left);
        let mut room = (sways / SWAYS[bound] - 1.0) / AMPLE;
        if followed {
            room = room.max(clear(&FoldNormalForm::of(&rod, v)));
        }
        free.min(room)
    }
}
