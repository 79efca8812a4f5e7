//! First-order mass of rods between two ball joints, with spin about their chords (theory 3.9).

use crate::first_order_space::{block, light, momentum, options};
use crate::pins::{CHORD, bent_against_its_rest_shape};
use nalgebra::{DVector, Isometry3, Quaternion, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, Attachment, Body, BodyMotion, Configuration, Integrals, Link, Spin,
};
use snaprod::body::PointMass;
use snaprod::math::gauss::Rule;
use snaprod::math::se3::join;
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion};
use snaprod::rod::{Rod, SectionMass};
use snaprod::section::Linear;
use snaprod::solve::integrator::Method;

fn straight(bending: [f64; 2], axial: f64) -> Rod {
    let law = Linear::diagonal(bending, 0.8).unwrap();
    let law = law.rigid([true, true, false]).unwrap();
    Rod::new(1.0, law.with_axial(axial).unwrap()).unwrap()
}

fn between(rod: Rod, [a, b]: [Isometry3<f64>; 2]) -> Link {
    Link::pinned(rod, Attachment::body(0, a), Attachment::body(1, b))
}

/// Catches a wrong inertia of a straight bar. For any turn and stretch its velocity is linear between its ends, so the
/// bar adds m/6 [2 1; 1 2] to the masses of its ends, and no force.
#[test]
fn a_straight_bar_adds_a_third_and_a_sixth_of_its_mass() {
    let (masses, mass, stretch, axial) = ([1.3, 0.4], 0.3, 0.05, 300.0);
    let here = Isometry3::identity();
    let link = between(straight([1.0, 1.6], axial), [here; 2]);
    let along = Vector3::new(0.3, -0.5, 0.8).normalize();
    let v = [Vector3::new(0.4, -0.2, 0.7), Vector3::new(-0.5, 0.9, 0.3)];
    let places = [Vector3::zeros(), along * (1.0 + stretch)];
    let mut n = Vector6::zeros();
    n[5] = stretch * axial / link.units()[5];
    let now = Configuration {
        bodies: (places.iter().zip(v))
            .map(|(place, v)| BodyMotion {
                pose: Isometry3::translation(place.x, place.y, place.z),
                twist: join(&Vector3::zeros(), &v),
            })
            .collect(),
        charts: vec![n],
        spins: Vec::new(),
    };
    let points = masses.map(|m| Body::point(PointMass::new(m).unwrap()));
    let assembly = Assembly::new(points.into(), vec![link]).unwrap();
    let mut assembly = assembly.with_light_rods(light(mass, [0.0; 3])).unwrap();
    assembly.set_inertia(0, true);
    let state = assembly.state(&now, &Integrals::default());
    let mut slope = DVector::zeros(state.len());
    assembly
        .write_slope(&state, None, 1e-13, &mut slope, |_, _| {})
        .unwrap();
    let at = assembly.evaluated(&state, 1e-13).unwrap();
    let kinetic = mass / 6.0 * (v[0].dot(&v[0]) + v[0].dot(&v[1]) + v[1].dot(&v[1]));
    let found = assembly.rod_kinetic(&at, 1e-13);
    assert!((found / kinetic - 1.0).abs() < 1e-11, "{found} {kinetic}");
    let [_, slots] = assembly.slots();
    let [a, b] = [0, 3].map(|k| Vector3::from_fn(|i, _| slope[slots[k + i]]));
    let pull = along * (stretch * axial);
    let left = a * (masses[0] + mass / 3.0) + b * (mass / 6.0) - pull;
    let right = b * (masses[1] + mass / 3.0) + a * (mass / 6.0) + pull;
    assert!(left.norm().max(right.norm()) < 1e-9, "{left} {right}");
}

/// A round rod that has buckled between two free bodies, and spins.
fn buckled() -> (Assembly, Configuration) {
    let a = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.3, 0.1, 0.2));
    let b = Isometry3::new(Vector3::new(0.1, 0.05, -0.02), Vector3::new(0.1, -0.4, 0.2));
    let link = between(straight([1.0, 1.0], 400.0), [a, b]);
    let (alpha, azimuth, chord) = (0.9_f64, 0.7_f64, 0.79);
    let n = -10.9
        * Vector3::new(
            alpha.sin() * azimuth.cos(),
            alpha.sin() * azimuth.sin(),
            alpha.cos(),
        );
    let held = Isometry3::translation(0.0, 0.0, chord);
    let q = link
        .polished(&join(&Vector3::zeros(), &n), &held, 1e-13)
        .unwrap();
    let carriers = [(1.0, [0.1, -0.05, 0.07]), (2.0, [-0.1, 0.0, 0.2])];
    let carriers = carriers.map(|(mass, offset)| block(mass, offset));
    let assembly = Assembly::new(carriers.into(), vec![link]).unwrap();
    let light = light(0.2, [2e-3, 2e-3, 4e-3]);
    let assembly = assembly.with_light_rods(light).unwrap();
    let way = Vector3::new(0.2, 0.9, -0.4).normalize() * chord;
    let end = Isometry3::from_parts((a.translation.vector + way).into(), b.rotation);
    let mut now = Configuration {
        bodies: assembly.at_rest(&[Isometry3::identity(), end * b.inverse()]),
        charts: vec![q],
        spins: Vec::new(),
    };
    now.bodies[0].twist = Vector6::new(0.3, -0.5, 0.8, 0.2, 0.3, -0.1);
    now.bodies[1].twist = Vector6::new(-0.6, -0.2, 0.4, -0.2, 0.1, 0.3);
    now = assembly.complete_spins(&now, 1e-12).unwrap();
    let spin = now.spins[0].as_mut().unwrap();
    *spin = Spin {
        rate: spin.rate + 1.7,
        ..*spin
    };
    (assembly, now)
}

/// Catches a chart of a round rod that turns within the rod's curve although the spin is measured about the chord, and
/// implicit steps without the spin: energy and momenta are constant with both kinds of steps, and both lead to the
/// same end.
#[test]
fn a_round_rod_that_has_buckled_spins_between_free_bodies() {
    let ends = [(Method::Explicit, 1e-10), (Method::Implicit, 1e-7)].map(|(method, bound)| {
        let (assembly, now) = buckled();
        let tolerance = if method == Method::Explicit {
            1e-11
        } else {
            1e-9
        };
        let options = options(0.1).with_method(method);
        let options = options.with_tolerance(tolerance).unwrap();
        let mut run = AssemblyRun::new(assembly.clone(), &now, options).unwrap();
        let first = run.now().ledger();
        let before = momentum(&assembly, &now);
        while run.advance().is_some() {}
        let last = run.now().ledger();
        assert!((last.rod_kinetic / first.rod_kinetic - 1.0).abs() > 0.05);
        let error = last.total() - first.total();
        assert!(error.abs() < bound, "{method:?}: {error:e}");
        let now = run.now().configuration().unwrap().clone();
        let change = momentum(&assembly, &now) - before;
        assert!(change.amax() < bound, "{method:?}: {change:e}");
        now
    });
    let [a, b] = ends.map(|now| (now.bodies[1].pose.translation.vector, now.spins[0].unwrap()));
    assert!((a.0 - b.0).norm() < 1e-7, "{} {}", a.0, b.0);
    assert!(a.1.turn.angle_to(&b.1.turn) < 1e-6 && (a.1.rate - b.1.rate).abs() < 1e-6);
}

/// Catches a fold found too late, and rod energy lost unrecorded where the mass is switched off before a fold, or on
/// again after the landing: the ledger is closed at every event.
#[test]
fn the_mass_is_given_up_before_a_snap_and_taken_up_after_it() {
    let (link, chart) = bent_against_its_rest_shape();
    let mass = Body::point(PointMass::new(1.0).unwrap());
    let assembly = Assembly::new(vec![mass], vec![link]).unwrap();
    let light = light(1e-4, [1e-8, 2e-8, 3e-8]);
    let assembly = assembly.with_light_rods(light).unwrap();
    let velocity = Vector3::new(0.3, 0.2, 1.0);
    let place = BodyMotion {
        pose: Isometry3::translation(0.0, 0.0, CHORD),
        twist: join(&Vector3::zeros(), &velocity),
    };
    let now = Configuration {
        bodies: vec![place],
        charts: vec![chart],
        spins: Vec::new(),
    };
    let mut run = AssemblyRun::new(assembly.clone(), &now, options(0.06)).unwrap();
    let total = run.now().ledger().total();
    let (mut snaps, mut felt) = (0, vec![run.now().ledger().rod_kinetic > 0.0]);
    while let Some(event) = run.advance() {
        snaps += usize::from(matches!(event, Event::Snap(_)));
        let ledger = run.now().ledger();
        felt.push(ledger.rod_kinetic > 0.0);
        let opened = (ledger.total() - total).abs();
        assert!(opened < 1e-9, "{event:?}: {opened:e}");
    }
    felt.dedup();
    assert_eq!((snaps, felt), (1, vec![true, false, true]));
    // The moment of switching must not depend on the ends of steps.
    let [unfelt, coarser] = [1e-10, 1e-7].map(|tolerance| {
        let options = options(0.06).with_tolerance(tolerance).unwrap();
        let mut run = AssemblyRun::new(assembly.clone(), &now, options).unwrap();
        while run.advance().is_some() {}
        run.time_without_mass()
    });
    assert!((coarser / unfelt - 1.0).abs() < 1e-4, "{coarser} {unfelt}");
}

/// Catches rod inertia with a constrained spin in small motions. A point on a crooked rod to the ground vibrates along
/// the chord. Its frequency falls by the kinetic energy of the sections per change of the chord, less the part removed
/// by a spin about it.
#[test]
fn small_motions_leave_the_spin_to_itself() {
    let (mass, body) = (0.01, 1.3);
    let law = Linear::diagonal([1.0, 1.6], 0.8).unwrap();
    let law = law.with_axial(60.0).unwrap();
    let rod = Rod::new(1.0, law.with_rest([0.9, -0.5], 1.1).unwrap()).unwrap();
    let here = Isometry3::identity();
    let link = Link::pinned(rod, Attachment::ground(here), Attachment::body(0, here));
    let unloaded = link
        .end(&Vector6::zeros(), 1e-13)
        .unwrap()
        .pose
        .translation
        .vector;
    let rule = Rule::new(16);
    let places: Vec<f64> = rule.nodes.iter().copied().chain([1.0]).collect();
    // The sections with their chord along z, for a given extension.
    let at = |longer: f64| -> Vec<Vector3<f64>> {
        let held = Isometry3::from(unloaded * (1.0 + longer));
        let q = link.polished(&Vector6::zeros(), &held, 1e-13).unwrap();
        let sections = link.shape(&q, &held, &places, 1e-13).unwrap();
        let chord = sections[places.len() - 1].position.normalize();
        let turn = Quaternion::from_parts(1.0 + chord.z, chord.cross(&Vector3::z()));
        let turn = UnitQuaternion::from_quaternion(turn);
        sections
            .iter()
            .map(|section| turn * section.position)
            .collect()
    };
    let h = 1e-3;
    let [near, far] = [h, 2.0 * h].map(|h| [at(h), at(-h)]);
    let step = 12.0 * h * unloaded.norm();
    let (mut energy, mut moment, mut about) = (0.0, 0.0, 0.0);
    for (k, (weight, r)) in rule.weights.iter().zip(at(0.0)).enumerate() {
        let rate = ((near[0][k] - near[1][k]) * 8.0 - (far[0][k] - far[1][k])) / step;
        energy += weight * rate.norm_squared();
        moment += weight * r.cross(&rate).z;
        about += weight * r.xy().norm_squared();
    }
    let expected = -0.5 * mass / body * (energy - moment * moment / about);
    let point = Body::point(PointMass::new(body).unwrap());
    let assembly = Assembly::new(vec![point], vec![link]).unwrap();
    let place = Isometry3::translation(unloaded.x, unloaded.y, unloaded.z);
    let now = Configuration {
        bodies: assembly.at_rest(&[place]),
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let modes = assembly.modes(&now, 1e-12).unwrap();
    let sections = SectionMass {
        mass,
        rotary: Vector3::zeros(),
    };
    let shift = modes.shift_by_rods(&assembly, &now, &[Some(sections)], 1e-12);
    assert!(
        moment * moment / about > 1e-3 * energy,
        "{moment} {about} {energy}"
    );
    assert!(
        (shift.unwrap() / expected - 1.0).abs() < 1e-7,
        "{shift:?} {expected}"
    );
}

/// Catches a start with a spurious spin. Bodies set in motion by blows move the rod between them with the least energy
/// compatible with their velocities, about its chord too (Kelvin). Any other spin rate has more energy, equally on
/// both sides.
#[test]
fn a_rod_between_moving_bodies_begins_with_the_least_energy() {
    let law = Linear::diagonal([1.0, 1.6], 0.8).unwrap();
    let law = law.with_axial(60.0).unwrap();
    let rod = Rod::new(1.0, law.with_rest([1.2, -0.5], 0.4).unwrap()).unwrap();
    let a = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.3, 0.1, 0.2));
    let b = Isometry3::new(Vector3::new(0.1, 0.05, -0.02), Vector3::new(0.1, -0.4, 0.2));
    let link = between(rod, [a, b]);
    let end = link.end(&Vector6::zeros(), 1e-13).unwrap().pose;
    let way = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.9)) * end;
    let way = a.translation.vector + way.translation.vector;
    let far = Isometry3::from_parts(way.into(), b.rotation) * b.inverse();
    let carriers = [(1.0, [0.1, -0.05, 0.07]), (2.0, [-0.1, 0.0, 0.2])];
    let carriers = carriers.map(|(mass, offset)| block(mass, offset));
    let assembly = Assembly::new(carriers.into(), vec![link]).unwrap();
    let light = light(0.2, [2e-3, 3e-3, 4e-3]);
    let mut assembly = assembly.with_light_rods(light).unwrap();
    assembly.set_inertia(0, true);
    let mut now = Configuration {
        bodies: assembly.at_rest(&[Isometry3::identity(), far]),
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    now.bodies[0].twist = Vector6::new(0.3, -0.5, 0.8, 0.2, 0.3, -0.1);
    now.bodies[1].twist = Vector6::new(-0.6, -0.2, 0.4, -0.2, 0.1, 0.3);
    let now = assembly.complete_spins(&now, 1e-13).unwrap();
    let energy = |more: f64| {
        let mut now = now.clone();
        let spin = now.spins[0].as_mut().unwrap();
        spin.rate += more;
        let state = assembly.state(&now, &Integrals::default());
        assembly.rod_kinetic(&assembly.evaluated(&state, 1e-13).unwrap(), 1e-13)
    };
    let [behind, least, ahead] = [-0.5, 0.0, 0.5].map(energy);
    let bend = 0.5 * (ahead + behind) - least;
    assert!(bend > 0.0, "{behind} {least} {ahead}");
    let slope = 0.5 * (ahead - behind);
    assert!(slope.abs() < 1e-6 * bend, "{slope:e} of {bend:e}");
}
