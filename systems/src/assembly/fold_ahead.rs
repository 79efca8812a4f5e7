//! Approach of a light rod to a fold, before which its first-order inertia is switched off (theory 2.8, 2.9, 3.9).

use super::attachment::Joint;
use super::light_rod::{LightRodAt, swaying};
use super::rod_element::{EndKind, LinkEnd};
use crate::math::se3::{halves, join};
use crate::rod::{Rates, SpaceRodInertia, Wrench};
use nalgebra::{DMatrix, Matrix6, SVector, Vector3, Vector6};

/// Time to a fold, in inertial times T_i of its normal form, below which inertia is off (theory 2.8, 2.9).
const CLEAR: f64 = 2.0;
/// Phase t omega of the softest mode in the time left until the fold: inertia is switched off below the first value,
/// and on above the second. Near folds these are 2 T_i and 3 T_i.
const PHASE_BOUNDS: [f64; 2] = [3.363_585_661, 5.583_629_155];
/// Relative distance in the chart within which the normal form of a fold is trusted.
const NEAR: f64 = 0.25;
/// Scale of the margin ([`LightRodAt::room`]): 1 at about this many times the bound.
const MARGIN_SCALE: f64 = 16.0;
/// Margin beyond which the bound by the normal form suffices, without the phase of sway.
const CLEAR_MARGIN: f64 = 0.25;

/// Softest direction: the change of the chart that moves the end of a rod least, at a fold not at all. For a taut rod
/// only its force varies, since the attachment turns its end exactly.
struct Softest {
    /// Units of the end's components.
    scale: Matrix6<f64>,
    /// Least singular value sigma of J in these units, with its left and right singular vectors u, z.
    sigma: f64,
    u: Vector6<f64>,
    z: Vector6<f64>,
}

impl Softest {
    fn of(end: &LinkEnd, scale: Matrix6<f64>) -> Option<Self> {
        let from = if end.is_taut() { 3 } else { 0 };
        let size = 6 - from;
        let svd = DMatrix::from_column_slice(6, 6, (scale * end.jacobian).as_slice())
            .view((from, from), (size, size))
            .svd(true, true);
        let least = svd.singular_values.imin();
        let whole =
            |part: &[f64]| Vector6::from_fn(|i, _| if i < from { 0.0 } else { part[i - from] });
        let (u, z) = (svd.u?, svd.v_t?.transpose());
        Some(Self {
            scale,
            sigma: svd.singular_values[least],
            u: whole(u.column(least).as_slice()),
            z: whole(z.column(least).as_slice()),
        })
    }

    /// Scale s of the wrench ell that z makes on the end. Next to a fold ell = s u (by the law of reciprocity), dual
    /// to motions of the end. Away from folds ell and u need not be parallel, and s is the ratio of their sizes.
    fn wrench(&self, joint: Joint, end: &LinkEnd) -> f64 {
        let ell = end.resultants * self.z;
        let (couple, force) = (ell.fixed_rows::<3>(6), ell.fixed_rows::<3>(3));
        let against = (self.scale * self.u).fixed_rows::<3>(3).into_owned();
        match (&end.kind, joint) {
            (EndKind::Pinned { chord, .. }, _) => (chord.dot(&force) / chord.dot(&against)).abs(),
            (_, Joint::Weld) => {
                let dual = self.scale.map_diagonal(|unit| 1.0 / unit);
                let wrench = join(&couple.into_owned(), &force.into_owned());
                dual.component_mul(&wrench).norm()
            }
            (_, Joint::Ball) => force.norm() / against.norm(),
        }
    }
}

/// A fold ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FoldAhead {
    /// Distance in the chart.
    way: f64,
    /// Time until the fold; infinite if the rod moves away.
    ahead: f64,
    /// T_i, the inertial time scale of the fold.
    inertial: f64,
}

impl LightRodAt<'_> {
    /// Event function of the inertia near a fold: positive where the inertia should be on, falling steadily to 0 at
    /// the switch. `followed` tells whether it is on now. None if unknown.
    pub fn room(&self, followed: bool) -> Option<f64> {
        let end = &self.point.end;
        let soft = Softest::of(end, self.link.gap_scale(end))?;
        let meanwhile = || -> Option<(f64, f64)> {
            let (left, sways) = self.sways(&soft)?;
            Some((
                left,
                (sways / PHASE_BOUNDS[usize::from(!followed)] - 1.0) / MARGIN_SCALE,
            ))
        };
        let fold = self.passage(&soft)?;
        let far = fold.way / (NEAR * self.q.norm()) - 1.0;
        // The phase of sway is a regular measure. The normal form, which assumes that the rod runs straight into the
        // fold, may allow more time, on another scale: the two agree near a fold. Where the drive vanishes for a
        // moment neither has a bound, so the normal form alone does not switch the inertia on.
        if !followed {
            return Some(meanwhile().map_or(far, |(_, regular)| far.max(regular)));
        }
        let clear = |time: f64| (time / (CLEAR * fold.inertial) - 1.0) / MARGIN_SCALE;
        let room = far.max(clear(fold.ahead));
        if room > CLEAR_MARGIN {
            return Some(room);
        }
        Some(meanwhile().map_or(room, |(left, regular)| room.max(clear(left)).max(regular)))
    }

    /// Time left until the fold, and phase of the softest mode in that time: t omega, omega^2 = s sigma/M0.
    fn sways(&self, soft: &Softest) -> Option<(f64, f64)> {
        let (left, inertia) = self.time_to_fold(soft)?;
        let along = self.point.base_motion(self.q, &SVector::zeros(), &soft.z);
        let mass = along.dot(&(inertia.matrix * along));
        let stiffness = soft.wrench(self.link.joint(), &self.point.end) * soft.sigma;
        Some((left, left * (stiffness / mass).sqrt()))
    }

    /// Fold ahead, by its normal form. The null vectors z and u of J are scaled to u . J z = sigma, and z makes the
    /// wrench ell = s u on the end. The fold lies sigma/(2 B) away along z, B = |u . D^2\[z, z\]|/2. It is reached
    /// after sigma^2/(4 A B), A = |u . drive|. The chord of a rod between two ball joints is taken as fixed
    /// meanwhile. None if unknown.
    fn passage(&self, soft: &Softest) -> Option<FoldAhead> {
        let point = self.point;
        let Softest { scale, sigma, u, z } = soft;
        let along = point.base_motion(self.q, &SVector::zeros(), z);
        let inertia = self.inertia(&swaying(&along), Rates::Force)?;
        let bend = u.dot(&(scale * self.constraint_curvature(&inertia)));
        let drive = u.dot(&(scale * point.drive()));
        let away = bend * drive >= 0.0;
        let (drive, bend) = (drive.abs(), 0.5 * bend.abs());
        let ahead = sigma * sigma / (4.0 * drive * bend);
        let (s, mass) = (
            soft.wrench(self.link.joint(), &point.end),
            along.dot(&(inertia.matrix * along)),
        );
        Some(FoldAhead {
            way: sigma / (2.0 * bend),
            ahead: if away { f64::INFINITY } else { ahead },
            inertial: mass.powf(0.4) * (s * s * drive * bend).powf(-0.2),
        })
    }

    /// Time until the fold from the present rate sigma' = u . D^2[z, q'], since sigma falls to 0 as the root of the
    /// time left; infinite if sigma grows. Also returns the inertia of the rod. None where J is singular.
    fn time_to_fold(
        &self,
        Softest { scale, sigma, u, z }: &Softest,
    ) -> Option<(f64, SpaceRodInertia)> {
        let Self { link, q, point, .. } = *self;
        let mut rate = link.regular(&point.end)?.solve(&(scale * point.drive()))?;
        if point.end.is_taut() {
            // Turn of the end, and the force by the motion of the end and of the spring beside it.
            let (spin, velocity) = halves(&point.relative_twist());
            let pulled = halves(&rate).1 + velocity * (link.chart().spring() / link.rod().length());
            rate = join(&spin, &pulled);
        }
        // D^2 of a pair from those of sum and difference, most accurate if both vectors have one size.
        let size = rate.norm().max(f64::MIN_POSITIVE);
        let still = SVector::zeros();
        let bent = |along: Wrench| {
            let motion = swaying(&point.base_motion(q, &still, &along));
            let inertia = self.inertia(&motion, Rates::Force)?;
            // Between two ball joints the base turns with the chart, so that the base wrench accelerates where the
            // chart does not.
            let by = |b: Vector3<f64>, rate: Vector3<f64>| {
                motion.spin.cross(&(rate * 2.0 + motion.spin.cross(&b)))
            };
            let ((m, n), (m_t, n_t)) = (halves(q), halves(&along));
            let turned = point.end.jacobian * join(&by(m, m_t), &by(n, n_t));
            let bent = u.dot(&(scale * (self.constraint_curvature(&inertia) + turned)));
            Some((bent, inertia))
        };
        let ((sum, inertia), (difference, _)) = (bent(z + rate / size)?, bent(z - rate / size)?);
        let falls = -0.25 * size * (sum - difference);
        let left = if falls > 0.0 {
            0.5 * sigma / falls
        } else {
            f64::INFINITY
        };
        Some((left, inertia))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{
        Assembly, Attachment, Body, BodyMotion, Configuration, Integrals, Link, RodChart,
    };
    use super::*;
    use crate::body::PointMass;
    use crate::elastica::{self, Equilibrium};
    use crate::math::se3::join;
    use crate::rod::{Rod, SectionMass};
    use crate::section::Linear;
    use nalgebra::{Isometry3, UnitQuaternion, Vector2};

    /// Catches a wrong scale of the null vectors, a wrong stiffness, mass or time left, in base-wrench chart and for
    /// taut rods. Next to the fold of the reference snap (theory 2.6) the normal form of the planar rod has a closed
    /// form. By that the phase is sqrt(2) (t/T_i)^(5/4) radians in the time t, with a relative error of the size of
    /// the distance to the fold.
    #[test]
    fn folds_ahead_are_those_of_the_plane() {
        const EPS: f64 = 1e-3;
        let (fold, start) = ([0.639_250_507, 6.556_218_856], [0.7, 6.3]);
        let v = Vector2::new(0.0, -0.5);
        for (off, chart) in [1e-2, 1e-3]
            .map(|off| {
                [RodChart::BaseWrench, RodChart::Taut { spring: 1.0 }].map(|chart| (off, chart))
            })
            .concat()
        {
            let [p, lam] = [0, 1].map(|k| fold[k] + off * (start[k] - fold[k]));
            let at = Equilibrium::from_lambda_p(lam, p).unwrap();
            let expected = elastica::FoldNormalForm::new(at.p, at.w, &v).unwrap();
            let rod = Rod::new(1.0, Linear::diagonal([1.0; 2], 1.0).unwrap()).unwrap();
            let here = Isometry3::identity();
            let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
            let mut link = Link::new(rod, from, to, Joint::Ball);
            link.set_chart(chart);
            let body = Body::point(PointMass::new(1.0).unwrap());
            let sections = SectionMass {
                mass: EPS,
                rotary: Vector3::zeros(),
            };
            let assembly = Assembly::new(vec![body], vec![link]).unwrap();
            let end = Vector3::new(at.y, 0.0, at.x);
            let force = Vector3::new(at.alpha.sin(), 0.0, at.alpha.cos()) * -lam * lam;
            let mut place = BodyMotion::at_rest(Isometry3::translation(end.x, end.y, end.z));
            place.twist = join(&Vector3::zeros(), &Vector3::new(v.y, 0.0, v.x));
            let now = Configuration {
                bodies: vec![place],
                charts: vec![join(&end.cross(&force), &force)],
                spins: Vec::new(),
            };
            let state = assembly.state(&now, &Integrals::default());
            let at = assembly.evaluated(&state, 1e-12).unwrap();
            let rod = LightRodAt {
                link: &assembly.links[0],
                sections: &sections,
                q: &at.now.charts[0],
                point: &at.points[0],
                tolerance: 1e-12,
            };
            let end = &rod.point.end;
            let soft = Softest::of(end, rod.link.gap_scale(end)).unwrap();
            let found = rod.passage(&soft).unwrap();
            let (_, sways) = rod.sways(&soft).unwrap();
            let near = |found: f64, expected: f64| {
                let error = (found / expected - 1.0).abs();
                assert!(error < 10.0 * off, "{found} {expected}");
            };
            let (ahead, inertial) = (expected.time_ahead(), expected.inertial(EPS));
            near(found.inertial, inertial);
            near(found.ahead, ahead);
            near(sways, (ahead / inertial).powf(1.25) * 2f64.sqrt());
        }
    }

    /// Catches a rate of sigma that leaves out the motion of a rod apart from its null vector, the turn of its end,
    /// or the spring beside it: it must equal finite differences of sigma along the motion.
    #[test]
    fn the_time_left_is_that_of_sigma() {
        let law = Linear::diagonal([1.1, 1.0], 0.75)
            .and_then(|law| law.with_axial(50.0))
            .and_then(|law| law.with_rest([0.1, -0.05], 0.2));
        let rod = Rod::new(1.3, law.unwrap()).unwrap();
        let sections = SectionMass {
            mass: 1e-3,
            rotary: Vector3::new(2e-6, 1e-6, 3e-6),
        };
        let here = Isometry3::identity();
        let (mut nearing, mut leaving) = (0, 0);
        for (joints, chart) in [
            ([Joint::Weld, Joint::Weld], RodChart::BaseWrench),
            ([Joint::Weld, Joint::Weld], RodChart::Taut { spring: 0.0 }),
            ([Joint::Weld, Joint::Weld], RodChart::Taut { spring: 7.0 }),
            ([Joint::Weld, Joint::Ball], RodChart::BaseWrench),
            ([Joint::Weld, Joint::Ball], RodChart::Taut { spring: 7.0 }),
            ([Joint::Ball, Joint::Ball], RodChart::BaseWrench),
        ] {
            let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
            let mut link = Link::new(rod.clone(), from, to, Joint::Weld);
            link.joints = joints;
            let mut q = Vector6::new(1.0, -2.0, 0.6, 1.5, 0.4, 3.0);
            let held = link.end(&q, 1e-13).unwrap().pose;
            if joints[1].turns() {
                q = link.settle(&q, &held, 1e-13).unwrap();
            }
            link.set_chart(chart);
            for way in [1.0, -1.0] {
                let twist = Vector6::new(0.3, -0.4, 0.5, 0.7, -0.2, 0.6) * way;
                let at = |dt: f64, q: Wrench| {
                    let turn = UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(0) * dt);
                    let place = held.translation.vector + twist.fixed_rows::<3>(3) * dt;
                    let pose = Isometry3::from_parts(place.into(), turn * held.rotation);
                    let mut body = BodyMotion::at_rest(pose);
                    body.twist = twist;
                    link.point(0.0, &[body], &q, 1e-13).unwrap()
                };
                let point = at(0.0, q);
                let scale = link.gap_scale(&point.end);
                let rate = link.regular(&point.end).unwrap();
                let rate = rate.solve(&(scale * point.drive())).unwrap();
                let step = 1e-5;
                let soft = |end: &LinkEnd| Softest::of(end, scale).unwrap();
                let sigma = |dt: f64| soft(&at(dt, q + rate * dt).end).sigma;
                let falls = (sigma(-step) - sigma(step)) / (2.0 * step);
                let soft = soft(&point.end);
                let rod = LightRodAt {
                    link: &link,
                    sections: &sections,
                    q: &q,
                    point: &point,
                    tolerance: 1e-13,
                };
                let (left, _) = rod.time_to_fold(&soft).unwrap();
                if falls > 0.0 {
                    let error = left / (0.5 * sigma(0.0) / falls) - 1.0;
                    assert!(error.abs() < 1e-6, "{joints:?} {chart:?}: {error:.1e}");
                    nearing += 1;
                } else {
                    assert_eq!(left, f64::INFINITY, "{joints:?} {chart:?}");
                    leaving += 1;
                }
            }
        }
        assert_eq!((nearing, leaving), (6, 6));
    }
}
