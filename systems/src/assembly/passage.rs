//! The fold that a rod of small mass nears, before which its mass is given up (theory 2.8, 3.9).

use super::inertia::swaying;
use super::{Joint, LightRod, Link, LinkEnd, LinkPoint};
use crate::math::se3::{halves, joined};
use crate::rod::{Rates, Wrench};
use nalgebra::{DMatrix, Matrix6, SVector, Vector3, Vector6};

/// Times T_i before a fold within which a rod is not followed, and beyond which it is again (theory 2.8, 2.9).
const CLEAR: [f64; 2] = [2.0, 3.0];
/// A fold is looked for within this part of the chart, where the rod's normal form tells of it.
const NEAR: f64 = 0.25;

/// A fold ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passage {
    /// How far in the chart.
    pub way: f64,
    /// The time until it; infinite if the rod moves away from it.
    pub ahead: f64,
    /// T_i, the time in which inertia lets the rod go.
    pub inertial: f64,
}

/// The least singular value of J in the units of `scale`, and its left and right singular vectors; of a taut rod those of its force.
fn least(end: &LinkEnd, scale: &Matrix6<f64>) -> Option<(f64, Vector6<f64>, Vector6<f64>)> {
    let from = if end.taut.is_some() { 3 } else { 0 };
    let size = 6 - from;
    let svd = DMatrix::from_column_slice(6, 6, (scale * end.jacobian).as_slice())
        .view((from, from), (size, size))
        .svd(true, true);
    let least = svd.singular_values.imin();
    let whole = |part: &[f64]| Vector6::from_fn(|i, _| if i < from { 0.0 } else { part[i - from] });
    let (u, z) = (svd.u?, svd.v_t?.transpose());
    Some((
        svd.singular_values[least],
        whole(u.column(least).as_slice()),
        whole(z.column(least).as_slice()),
    ))
}

impl Link {
    /// True if the mass of the rod should be followed here: no fold is so near that it cannot stay on its equilibria. `followed` tells whether it is
    /// now.
    pub(super) fn holds(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        followed: bool,
        tolerance: f64,
    ) -> bool {
        let rod = (q, point);
        let Some(fold) = self.passage(light, rod, tolerance) else {
            return false;
        };
        let clear = CLEAR[usize::from(!followed)] * fold.inertial;
        fold.way > NEAR * q.norm()
            || !(fold.ahead <= clear)
            || (self.left(light, rod, tolerance)).is_some_and(|left| left > clear)
    }

    /// The time until the fold by how fast the least singular value of J falls as the rod moves now, for it falls to 0 as the root of the time that is left:
    /// sigma' = u . D^2[z, q']. The normal form takes the rod to run straight along z, which far from folds it does not. Infinite if sigma grows; None where J is singular.
    fn left(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<f64> {
        let scale = self.gap_scale(&point.end);
        let (sigma, u, z) = least(&point.end, &scale)?;
        let mut rate = self.regular(&point.end)?.solve(&(scale * point.drive()))?;
        if point.end.taut.is_some() {
            // What turns the end, and what pulls at it and at the spring beside it.
            let (spin, velocity) = halves(&point.relative_twist());
            let pulled = halves(&rate).1 + velocity * (self.spring() / self.rod().length());
            rate = joined(&spin, &pulled);
        }
        // D^2 of a pair by those of sum and difference, which are best told apart where both are of one size.
        let size = rate.norm();
        let still = SVector::zeros();
        let bent = |along: Wrench| {
            let motion = swaying(&point.charted(q, &still, &along));
            let inertia = self.inertia(
                &light.sections,
                (q, point),
                (&motion, Rates::Force),
                tolerance,
            )?;
            // Between two ball joints the base turns with the chart, so that its wrench is accelerated where the chart is not.
            let by = |b: Vector3<f64>, rate: Vector3<f64>| {
                motion.spin.cross(&(rate * 2.0 + motion.spin.cross(&b)))
            };
            let ((m, n), (m_t, n_t)) = (halves(q), halves(&along));
            let turned = point.end.jacobian * joined(&by(m, m_t), &by(n, n_t));
            Some(u.dot(&(scale * (self.second(&point.end, &inertia) + turned))))
        };
        let falls = -0.25 * size * (bent(z + rate / size)? - bent(z - rate / size)?);
        Some(if falls > 0.0 {
            0.5 * sigma / falls
        } else {
            f64::INFINITY
        })
    }

    /// The fold that the rod nears, by its normal form: with z and u the null vectors of J, scaled to u . J z = sigma, and (by the law of
    /// reciprocity) the wrench that z makes on the end, ell = s u, the fold lies sigma/(2 B) away along z, B = |u . D^2[z, z]|/2, and is reached
    /// after sigma^2/(4 A B), A = |u . drive|. Of a taut rod J is that of its force alone: the attachment turns its end exactly. The chord of
    /// a rod between two ball joints stands meanwhile. None where that cannot be told.
    pub(super) fn passage(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<Passage> {
        let scale = self.gap_scale(&point.end);
        let (sigma, u, z) = least(&point.end, &scale)?;
        let along = point.charted(q, &SVector::zeros(), &z);
        let (rod, motion) = ((q, point), swaying(&along));
        let inertia = self.inertia(&light.sections, rod, (&motion, Rates::Force), tolerance)?;
        let bend = u.dot(&(scale * self.second(&point.end, &inertia)));
        let drive = u.dot(&(scale * point.drive()));
        let away = bend * drive >= 0.0;
        let (drive, bend) = (drive.abs(), 0.5 * bend.abs());
        // ell against u, where both are dual to velocities.
        let ell = point.end.resultants * z;
        let given = scale * u;
        let of = |rows: usize, column: usize| {
            let ell = ell.rows(rows, 3);
            let u = given.rows(column, 3);
            (ell.dot(&u), u.norm_squared())
        };
        let (force, couple) = (of(3, 3), of(6, 0));
        let (work, size) = match self.joint() {
            Joint::Weld => (force.0 + couple.0, force.1 + couple.1),
            Joint::Ball => force,
            Joint::Pins => {
                let chord = point.end.along();
                let by = chord.dot(&ell.fixed_rows::<3>(3));
                (by, chord.dot(&given.fixed_rows::<3>(3)))
            }
        };
        let stiffness = (work / size).abs();
        let mass = along.dot(&(inertia.matrix * along));
        let ahead = sigma * sigma / (4.0 * drive * bend);
        Some(Passage {
            way: sigma / (2.0 * bend),
            ahead: if away { f64::INFINITY } else { ahead },
            inertial: mass.powf(0.4) * (stiffness * stiffness * drive * bend).powf(-0.2),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Assembly, Attachment, Carrier, Configuration, Integrals, Place, Seen};
    use super::*;
    use crate::body::Body;
    use crate::elastica::{self, Equilibrium};
    use crate::math::se3::joined;
    use crate::rod::{Rod, SectionMass};
    use crate::section::Linear;
    use nalgebra::{Isometry3, UnitQuaternion, Vector2};

    /// Catches a wrong scale of the null vectors, a wrong stiffness or a wrong mass, by the base wrench or from both ends: at the fold of the reference snap
    /// (theory 2.6) the planar rod has its normal form in closed form, and both are right up to the distance from it.
    #[test]
    fn folds_ahead_are_those_of_the_plane() {
        const EPS: f64 = 1e-3;
        let (fold, start) = ([0.639_250_507, 6.556_218_856], [0.7, 6.3]);
        let v = Vector2::new(0.0, -0.5);
        for (off, seen) in [1e-2, 1e-3]
            .map(|off| [Seen::FromBase, Seen::Taut].map(|seen| (off, seen)))
            .concat()
        {
            let [p, lam] = [0, 1].map(|k| fold[k] + off * (start[k] - fold[k]));
            let at = Equilibrium::from_lambda_p(lam, p).unwrap();
            let expected = elastica::Passage::new(at.p, at.w, &v).unwrap();
            let rod = Rod::new(1.0, Linear::diagonal([1.0; 2], 1.0).unwrap()).unwrap();
            let here = Isometry3::identity();
            let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
            let mut link = Link::new(rod, from, to, Joint::Ball);
            link.seen_as(seen);
            link.beside_spring(1.0);
            let body = Carrier::point(Body::new(1.0).unwrap());
            let light = LightRod {
                sections: SectionMass {
                    mass: EPS,
                    rotary: Vector3::zeros(),
                },
                followed: true,
            };
            let assembly = Assembly::new(vec![body], vec![link]).unwrap();
            let end = Vector3::new(at.y, 0.0, at.x);
            let force = Vector3::new(at.alpha.sin(), 0.0, at.alpha.cos()) * -lam * lam;
            let mut place = Place::at_rest(Isometry3::translation(end.x, end.y, end.z));
            place.twist = joined(&Vector3::zeros(), &Vector3::new(v.y, 0.0, v.x));
            let now = Configuration {
                bodies: vec![place],
                charts: vec![joined(&end.cross(&force), &force)],
                spins: Vec::new(),
            };
            let state = assembly.state(&now, &Integrals::default());
            let at = assembly.evaluated(&state, 1e-12).unwrap();
            let rod = (&at.now.charts[0], &at.points[0]);
            let found = assembly.links[0].passage(&light, rod, 1e-12).unwrap();
            let near = |found: f64, expected: f64| {
                let error = (found / expected - 1.0).abs();
                assert!(error < 10.0 * off, "{found} {expected}");
            };
            near(found.inertial, expected.inertial(EPS));
            near(found.ahead, expected.time_ahead());
        }
    }

    /// Catches a rate of sigma that leaves out what moves a rod apart from its null vector, the turn of its end, or the spring beside it: it is that of sigma itself, by differences along the motion.
    #[test]
    fn the_time_left_is_that_of_sigma() {
        let law = Linear::diagonal([1.1, 1.0], 0.75)
            .and_then(|law| law.with_axial(50.0))
            .and_then(|law| law.with_rest([0.1, -0.05], 0.2));
        let rod = Rod::new(1.3, law.unwrap()).unwrap();
        let light = LightRod {
            sections: SectionMass {
                mass: 1e-3,
                rotary: Vector3::new(2e-6, 1e-6, 3e-6),
            },
            followed: true,
        };
        let here = Isometry3::identity();
        let (mut nearing, mut leaving) = (0, 0);
        for (joint, seen, spring) in [
            (Joint::Weld, Seen::FromBase, 0.0),
            (Joint::Weld, Seen::Taut, 0.0),
            (Joint::Weld, Seen::Taut, 7.0),
            (Joint::Ball, Seen::FromBase, 0.0),
            (Joint::Ball, Seen::Taut, 7.0),
            (Joint::Pins, Seen::FromBase, 0.0),
        ] {
            let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
            let mut link = Link::new(rod.clone(), from, to, joint);
            let mut q = Vector6::new(1.0, -2.0, 0.6, 1.5, 0.4, 3.0);
            let held = link.end(&q, 1e-13).unwrap().pose;
            if joint != Joint::Weld {
                q = link.settle(&q, &held, 1e-13).unwrap();
            }
            link.seen_as(seen);
            link.beside_spring(spring);
            for way in [1.0, -1.0] {
                let twist = Vector6::new(0.3, -0.4, 0.5, 0.7, -0.2, 0.6) * way;
                let at = |dt: f64, q: Wrench| {
                    let turn = UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(0) * dt);
                    let place = held.translation.vector + twist.fixed_rows::<3>(3) * dt;
                    let pose = Isometry3::from_parts(place.into(), turn * held.rotation);
                    let mut body = Place::at_rest(pose);
                    body.twist = twist;
                    link.point(0.0, &[body], &q, 1e-13).unwrap()
                };
                let point = at(0.0, q);
                let scale = link.gap_scale(&point.end);
                let rate = link.regular(&point.end).unwrap();
                let rate = rate.solve(&(scale * point.drive())).unwrap();
                let step = 1e-5;
                let sigma = |dt: f64| least(&at(dt, q + rate * dt).end, &scale).unwrap().0;
                let falls = (sigma(-step) - sigma(step)) / (2.0 * step);
                let left = link.left(&light, (&q, &point), 1e-13).unwrap();
                if falls > 0.0 {
                    let error = left / (0.5 * sigma(0.0) / falls) - 1.0;
                    assert!(error.abs() < 1e-6, "{joint:?} {seen:?}: {error:.1e}");
                    nearing += 1;
                } else {
                    assert_eq!(left, f64::INFINITY, "{joint:?} {seen:?}");
                    leaving += 1;
                }
            }
        }
        assert_eq!((nearing, leaving), (6, 6));
    }
}
