//! Taut rods under a distributed load (theory 3.6, 3.8): comparison with the base wrench where it is accurate, and
//! with work and energy beyond.

use crate::first_order_taut::{FREE, light, random, rates};
use nalgebra::{DMatrix, Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, AttachedTo, Attachment, Body, BodyMotion, Configuration, Integrals, Joint, Link,
    RodChart,
};
use snaprod::body::RigidBody;
use snaprod::math::se3::{halves, join};
use snaprod::rod::{DistributedLoad, Rod, Spring, TautLoad, Tip};
use snaprod::section::Linear;

/// Energy, and the wrenches on both bodies one after the other.
type Told = (f64, Vec<f64>);

/// A rod between two bodies under a distributed load, their poses, and its chart: pulled by lam^2 in its middle, its
/// end turned aside.
struct Case {
    link: Link,
    bodies: [Isometry3<f64>; 2],
    q: Vector6<f64>,
}

impl Case {
    fn new(trial: usize, lam: f64, random: &mut impl FnMut() -> f64) -> Self {
        let plain = Linear::diagonal([1.0, 1.3], 0.8).unwrap();
        let bent = plain.with_rest([random(), random()], random()).unwrap();
        // Sheared and stretched by a few percent.
        let stiff = 20.0 * lam * lam;
        let sheared = plain.with_shear([stiff, 0.8 * stiff]).unwrap();
        let law = [bent, sheared.with_axial(1.2 * stiff).unwrap()][trial % 2];
        let joint = [Joint::Weld, Joint::Ball][trial / 2 % 2];
        let a = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.3, 0.1, 0.2));
        let b = Isometry3::new(Vector3::new(0.1, 0.05, -0.02), Vector3::new(0.1, -0.4, 0.2));
        let [from, to] = [Attachment::body(0, a), Attachment::body(1, b)];
        // A fifth of the pull: uniform, growing, with a kink.
        let most = 0.2 * lam * lam;
        let mut force = || Vector3::new(random(), random(), random()) * most;
        let load = match trial % 3 {
            0 => DistributedLoad::constant(force()),
            1 => DistributedLoad::polynomial(vec![force(), force()]),
            _ => DistributedLoad::table(&[(0.0, force()), (0.4, force()), (1.0, force())]),
        };
        let load = load.unwrap();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.7));
        let base = Isometry3::from_parts(Vector3::new(0.2, 0.1, 0.3).into(), turn);
        let rod = Rod::new(1.3, law).unwrap();
        let link = Link::new(rod, from, to, joint).with_distributed(load);
        let link = link.unwrap();
        let place = base * a;
        let seen = link.with_base_rotation(&place.rotation).into_owned();
        let pull = Vector3::new(0.6 * random(), 0.6 * random(), 1.0).normalize();
        let wrench = join(&Vector3::zeros(), &(pull * (lam * lam)));
        let borne = seen.distributed().unwrap();
        let back = place.rotation.inverse();
        let borne = borne.mapped(|f| back * f);
        let n = wrench.component_mul(&link.units());
        let ahead = halves(&n).1 - borne.total(1.3);
        let across = Rotation3::rotation_between(&Vector3::z(), &ahead).unwrap();
        let aside = Rotation3::from_scaled_axis(Vector3::new(random(), random(), random()) * 0.6);
        let tip = match joint {
            Joint::Weld => Tip::Turned(*(aside * across).matrix()),
            _ => FREE,
        };
        let load = TautLoad {
            along: &borne,
            turns: false,
        };
        let found = seen
            .rod()
            .taut_beside(&n, &tip, &Spring::NONE, Some(load), None, 1e-14);
        let found = found.unwrap();
        Self {
            q: found.base.component_div(&link.units()),
            bodies: [base, place * found.end.pose() * b.inverse()],
            link,
        }
    }

    fn charted(&self, chart: RodChart) -> Assembly {
        let mut link = self.link.clone();
        link.set_chart(chart);
        // With spherical inertia the mass matrix is independent of orientation: the stiffness is that of the wrenches
        // alone, at rest or not.
        let ball = |mass: f64| Body::rigid(RigidBody::new(mass, Matrix3::identity()).unwrap());
        let bodies = vec![ball(1.0), ball(2.0)];
        Assembly::new(bodies, vec![link]).unwrap()
    }
}

/// Catches a load that is missing, or relative to a base that did not turn. Affected are the rod from both ends, its
/// variations, their second derivative, its potential and its index. Positions, wrenches, energy, stiffness, index,
/// and accelerations with and without the mass of the rod agree with the base wrench, also with a spring beside the
/// end.
#[test]
fn loaded_rods_are_taut_as_their_base_wrench_says() {
    let mut random = random();
    for trial in 0..12 {
        let lam = [6.0, 7.0, 8.0][trial % 3];
        let case = Case::new(trial, lam, &mut random);
        let joint = case.link.joint();
        let told = [
            RodChart::BaseWrench,
            RodChart::Taut { spring: 0.0 },
            RodChart::Taut { spring: 9.0 },
        ]
        .map(|chart| {
            let mut assembly = case.charted(chart);
            let mut now = Configuration {
                bodies: assembly.at_rest(&case.bodies),
                charts: vec![case.q],
                spins: Vec::new(),
            };
            let points = assembly
                .points(0.0, &now.bodies, &now.charts, 1e-13)
                .unwrap();
            let point = &points[0];
            let [base, tip] = point.wrenches();
            let energy = point.end.energy + point.potential();
            let stiffness = assembly
                .stiffness(0.0, &now.bodies, &points)
                .unwrap()
                .matrix;
            let link = assembly.links()[0]
                .with_base_rotation(&point.base.pose.rotation)
                .into_owned();
            let index = link.index(&case.q, &point.held(), 1e-12).unwrap();
            let at: Vec<f64> = [0.2, 0.5, 0.9].map(|x| x * 1.3).to_vec();
            let shape = link.shape(&case.q, &point.held(), &at, 1e-13).unwrap();
            let shape: Vec<_> = shape
                .iter()
                .map(|at| (at.position, at.couple, at.force))
                .collect();
            now.bodies[0].twist = Vector6::new(0.3, -0.5, 0.8, 0.2, 0.3, -0.1);
            now.bodies[1].twist = Vector6::new(-0.6, -0.2, 0.4, -0.2, 0.1, 0.3);
            let moving = assembly
                .points(0.0, &now.bodies, &now.charts, 1e-13)
                .unwrap();
            let spin = halves(&moving[0].end_twist(&assembly.links()[0])).0;
            let state = assembly.state(&now, &Integrals::default());
            let alone = rates(&assembly, &state);
            let rods = light(0.7, [1e-3, 2e-3, 3e-3], true);
            assembly = assembly.with_light_rods(rods).unwrap();
            let at = assembly.evaluated(&state, 1e-13).unwrap();
            let weighed = assembly.weighed(0, &at, 1e-13).unwrap();
            let apart = point.gap().norm();
            let mut slope = state.clone();
            let moved = assembly.write_slope(&state, None, 1e-13, &mut slope, |_, _| ());
            moved.unwrap();
            // The forces have equal derivatives; the couple at the base of a taut chart is a dependent quantity.
            let chart = slope.as_slice()[assembly.chart_slots(0)][3..].to_vec();
            let with = slope.rows(0, assembly.chart_slots(0).start).into_owned();
            (
                (base, tip, energy, apart),
                stiffness,
                index,
                shape,
                (alone, with, chart, spin),
                weighed,
            )
        });
        let [from_base, taut, beside] = told;
        let lost = 1e-15 * (2.0 * lam).exp();
        for (other, spring) in [(&taut, 0.0), (&beside, 9.0)] {
            let close = |what: &str, off: f64, bound: f64| {
                let case = format!("{trial}, {joint:?}, {lam}, spring {spring}");
                assert!(off < bound, "{case}: {what} off by {off:.1e}");
            };
            let ((base, tip, energy, _), (its_base, its_tip, its_energy, apart)) =
                (&from_base.0, &other.0);
            let scale = lam * lam;
            close("gap", *apart, 1e-9 + lost);
            close("base", (base - its_base).amax() / scale, 1e-9 + lost);
            close("tip", (tip - its_tip).amax() / scale, 1e-9 + lost);
            close("energy", (energy - its_energy).abs() / scale, 1e-9 + lost);
            assert_eq!(from_base.2, other.2, "{trial}: index");
            for (a, b) in from_base.3.iter().zip(&other.3) {
                close("place", (a.0 - b.0).amax(), 1e-9 + lost);
                close("couple", (a.1 - b.1).amax() / lam, 1e-9 + lost);
                close("force", (a.2 - b.2).amax() / scale, 1e-9 + lost);
            }
            let (one, its) = (&from_base.4, &other.4);
            let size = (&one.1 - &one.0).amax();
            close(
                "accelerations",
                (&one.0 - &its.0).amax() / scale,
                1e-8 + lost,
            );
            close(
                "with the mass",
                (&one.1 - &its.1).amax() / size,
                1e-8 + 10.0 * lost,
            );
            let chart = one.2.iter().zip(&its.2).map(|(a, b)| (a - b).abs());
            let force = one.2.iter().map(|x| x.abs()).fold(0.0, f64::max);
            close(
                "rate",
                chart.fold(0.0, f64::max) / force,
                1e-8 + 10.0 * lost,
            );
            close(
                "spin of the end",
                (one.3 - its.3).amax(),
                1e-8 + 10.0 * lost,
            );
            close(
                "kinetic",
                (from_base.5.kinetic / other.5.kinetic - 1.0).abs(),
                1e-8 + lost,
            );
            close(
                "momenta",
                (from_base.5.momentum - other.5.momentum).amax(),
                1e-8 + lost,
            );
            if spring == 0.0 {
                let size = from_base.1.amax();
                close(
                    "stiffness",
                    (&from_base.1 - &other.1).amax() / size,
                    1e-8 + lost,
                );
            }
        }
    }
}

/// Checks loads beyond sqrt(n L^2/B) of ten, where the base wrench is inaccurate. The wrenches on both ends are minus
/// the derivatives of stored energy and potential by the pose of either end. The stiffness is the derivative of the
/// wrenches, by differences.
#[test]
#[ignore = "second tier: 3 s"]
fn loaded_taut_rods_give_back_their_work() {
    let mut random = random();
    for trial in 0..8 {
        let lam = [20.0, 60.0][trial / 4];
        let case = Case::new(trial, lam, &mut random);
        let assembly = case.charted(RodChart::default());
        let moved = |twist: &[f64]| -> Told {
            let places: Vec<_> = (0..2)
                .map(|k| {
                    let [turn, way] = [0, 3]
                        .map(|i| Vector3::from_column_slice(&twist[6 * k + i..6 * k + i + 3]));
                    let Isometry3 {
                        rotation,
                        translation,
                    } = case.bodies[k];
                    let place = translation.vector + way;
                    Isometry3::from_parts(
                        place.into(),
                        UnitQuaternion::from_scaled_axis(turn) * rotation,
                    )
                })
                .collect();
            let bodies = assembly.at_rest(&places);
            let link = &assembly.links()[0];
            let ends = [link.from(), link.to()].map(|site| site_of(site, &bodies));
            let seen = link.with_base_rotation(&ends[0].rotation).into_owned();
            let q = seen
                .polished(&case.q, &ends[0].inv_mul(&ends[1]), 1e-13)
                .unwrap();
            let points = assembly.points(0.0, &bodies, &[q], 1e-13).unwrap();
            assert!(points[0].end.is_taut());
            let energy = points[0].end.energy + points[0].potential();
            let wrenches = assembly.wrenches(&bodies, &points);
            (
                energy,
                wrenches.iter().flat_map(|w| w.iter().copied()).collect(),
            )
        };
        let (_, wrenches) = moved(&[0.0; 12]);
        let bodies = assembly.at_rest(&case.bodies);
        let points = assembly.points(0.0, &bodies, &[case.q], 1e-13).unwrap();
        let stiffness = assembly.stiffness(0.0, &bodies, &points).unwrap().matrix;
        // Near full reach, displacements of the order of 1/lam change the forces by their own size.
        let step = 2e-3 / (lam * lam);
        let mut by = DMatrix::zeros(12, 12);
        let mut work = [0.0; 12];
        for i in 0..12 {
            let at = |part: f64| {
                let mut twist = [0.0; 12];
                twist[i] = part * step;
                moved(&twist)
            };
            let [near, back, far, behind] = [1.0, -1.0, 2.0, -2.0].map(at);
            let slope = |f: &dyn Fn(&Told) -> f64| {
                (8.0 * (f(&near) - f(&back)) - (f(&far) - f(&behind))) / (12.0 * step)
            };
            work[i] = slope(&|at| at.0);
            for k in 0..12 {
                by[(k, i)] = -slope(&|at| at.1[k]);
            }
        }
        let size = wrenches.iter().map(|x| x.abs()).fold(0.0, f64::max);
        for i in 0..12 {
            let off = (work[i] + wrenches[i]).abs() / size;
            assert!(off < 1e-7, "{trial}, {lam}: wrench {i} off by {off:.1e}");
        }
        let off = (&by - &stiffness).amax() / by.amax();
        assert!(off < 1e-6, "{trial}, {lam}: stiffness off by {off:.1e}");
    }
}

fn site_of(site: &Attachment, bodies: &[BodyMotion]) -> Isometry3<f64> {
    match site.on {
        AttachedTo::Body(body) => bodies[body].pose * site.place,
        _ => site.place,
    }
}
