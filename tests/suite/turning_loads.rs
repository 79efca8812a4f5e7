//! Loads on rods of full mass in motion that turn with the sections, couples along rods, and loads at one place.

use crate::heavy_assemblies::{given, link, weld};
use crate::support::replaced;
use nalgebra::{DVector, Isometry3, Vector3, Vector4};
use snaprod::assembly::{Attachment, BodyMotion};
use snaprod::full_mass::assembly::HeavyAssembly;
use snaprod::full_mass::elements::{ElementAssembly, Mesh};
use snaprod::rod::{DistributedLoad, LoadsWithoutPotential};
use snaprod::scene::Scene;
use snaprod::solve::system::{Linearised, System};
use snaprod::study::Silent;
use snaprod::study::run::{Prepared, samples};

/// Columns of the names at a time.
fn at(text: &str, t: f64, names: &[&str]) -> Vec<f64> {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}"));
    let table = samples(&prepared, &[0.0, t], &mut Silent).unwrap_or_else(|why| panic!("{why}"));
    let csv = table.csv();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let last = rows.last().expect("a row");
    let column = |name: &&str| {
        let own = rows[0].iter().position(|column| column == name);
        last[own.unwrap_or_else(|| panic!("{name} in {:?}", rows[0]))]
            .parse()
            .expect("a number")
    };
    names.iter().map(column).collect()
}

/// A rod in flight spins with a thrust along its tangent.
const THRUST: &str = r#"
[rod]
model = "cosserat"
length = 1.0
mass = 1.0
inertia = "full"
section = { bending = [50.0, 50.0], torsion = 50.0, shear = [5e4, 5e4], axial = 5e4 }
section_inertia = [1e-3, 1e-3, 2e-3]

[clamp]
free = true

[[load]]
from = 0.0
to = 1.0
force = [0.0, 0.0, 0.6]
follows = true

[start]
rest = "straight"
velocity = [-1.0, 0.0, 0.0]
angular_velocity = [0.0, 2.0, 0.0]

[run]
duration = 2.0
tolerance = 1e-4
"#;

/// Catches a thrust that does not turn with the rod, that does no work, or that acts twice. The middle of a straight
/// rod that spins at the rate w moves by F/w (t - sin wt/w) and F/w^2 (1 - cos wt).
#[test]
fn a_spinning_rod_is_driven_by_its_thrust() {
    let names = ["x", "y", "z", "base_x", "base_y", "base_z", "work"];
    let found = at(THRUST, 2.0, &names);
    let middle = |k: usize| 0.5 * (found[k] + found[k + 3]);
    let (t, w, force) = (2.0_f64, 2.0_f64, 0.6);
    let (sin, cos) = (w * t).sin_cos();
    let wanted = [
        force / w * (t - sin / w),
        0.0,
        0.5 + force / (w * w) * (1.0 - cos),
    ];
    for (k, wanted) in wanted.into_iter().enumerate() {
        assert!((middle(k) - wanted).abs() < 5e-4, "{k}: {found:?}");
    }
    // The work is the kinetic energy of the middle: the spin stays.
    let speed = force / w * (2.0 - 2.0 * cos).sqrt();
    assert!((found[6] - 0.5 * speed * speed).abs() < 5e-4, "{found:?}");
}

/// A rod on a clamp under loads along parts of the rod.
const LOADED: &str = r#"
[rod]
model = "cosserat"
length = 1.0
mass = 1.0
inertia = "full"
damping = { proportional = 0.05 }
section = { bending = [1.0, 1.3], torsion = 0.8, shear = [40.0, 50.0], axial = 90.0 }
section_inertia = [1e-3, 1e-3, 2e-3]

[clamp]
rotation = { axis = [0.6, 0.8, 0.0], angle = 0.7 }

[[load]]
from = 0.4
to = 1.0
force = [0.8, 0.3, -0.4]
follows = true

[[load]]
from = 0.0
to = 0.6
couple = [0.5, 0.3, 0.6]

[[load]]
from = 0.2
to = 0.9
couple = [0.3, -0.4, 0.35]
follows = true

[start]
rest = "straight"

[run]
duration = 0.6
tolerance = 1e-5
"#;

const END: [&str; 4] = ["x", "y", "z", "work"];

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(
        0.0,
        |most: f64, x| if x > most || x.is_nan() { x } else { most },
    )
}

/// Catches a load that elements and strains at nodes see in other frames, at other places or of another size.
#[test]
fn elements_carry_the_loads_of_the_strains_at_nodes() {
    let coarse = at(LOADED, 0.6, &END);
    let fine = replaced(LOADED, &[("tolerance = 1e-5", "tolerance = 1e-7")]);
    let off = apart(&coarse, &at(&fine, 0.6, &END));
    assert!(off < 5e-5, "{off:e}");
    // Each load matters, and a dead one would lead elsewhere.
    let dead = replaced(LOADED, &[("follows = true", "follows = false")]);
    let moved = apart(&coarse, &at(&dead, 0.6, &END));
    assert!(moved > 1e-2, "{moved:e}");
}

/// Catches a load at one place that acts elsewhere, in part or twice: a force that follows, a couple and a dead force,
/// against the same spread over a short part.
#[test]
fn loads_at_one_place_are_those_on_a_short_part() {
    let place = |spot: &str, factor: f64| {
        let load = |more: &str| format!("[[load]]\n{spot}\nfactor = {factor}\n{more}\n");
        let loads = [
            load("force = [0.5, 0.2, -0.3]\nfollows = true"),
            load("couple = [0.2, 0.1, 0.3]"),
            load("force = [-0.1, 0.3, 0.2]"),
        ];
        let (before, after) = LOADED.split_once("[[load]]").expect("loads");
        let (_, start) = after.split_once("[start]").expect("a start");
        format!("{before}{}[start]{start}", loads.concat())
    };
    let one = at(&place("s = 0.6", 1.0), 0.6, &END);
    // A part of the width h differs by terms of h: the load moves with the strains that it makes within the part.
    let wide = at(&place("from = 0.59\nto = 0.61", 50.0), 0.6, &END);
    let narrow = at(&place("from = 0.595\nto = 0.605", 100.0), 0.6, &END);
    let limit: Vec<f64> = (narrow.iter().zip(&wide))
        .map(|(narrow, wide)| 2.0 * narrow - wide)
        .collect();
    let off = apart(&one, &limit);
    assert!(off < 1e-5 && apart(&one, &wide) > 1e-4, "{off:e}");
    let fine = replaced(
        &place("s = 0.6", 1.0),
        &[("tolerance = 1e-5", "tolerance = 1e-7")],
    );
    let scene = Scene::parse(&fine).unwrap_or_else(|faults| panic!("{faults}"));
    let refused =
        Prepared::new(&scene).and_then(|prepared| samples(&prepared, &[0.1], &mut Silent));
    let why = refused.map(drop).expect_err("a refusal").to_string();
    assert!(
        why.contains("at one place") && why.contains("tolerance"),
        "{why}"
    );
}

/// Catches a wrong derivative of loads that turn, at free nodes, on a lever and on the ground. The matrix of a rod with
/// loads less that without is compared with differences.
#[test]
fn the_matrix_has_the_loads_that_turn() {
    let constant =
        |x: f64, y: f64, z: f64| DistributedLoad::constant(Vector3::new(x, y, z)).unwrap();
    let place = DistributedLoad::at_place(0.5, Vector3::new(0.4, -0.7, 0.9)).unwrap();
    let loads = LoadsWithoutPotential {
        follower_force: constant(0.6, -0.8, 1.1).plus(&place).unwrap(),
        couple: constant(0.3, 0.5, -0.4),
        follower_couple: constant(-0.7, 0.2, 0.6),
    };
    let model = |loaded: bool| {
        let mut rod = given(
            0.4,
            0.0,
            1.0,
            Vector3::new(0.3, -0.2, -1.0),
            &[0, 1, 2, 3, 4, 5],
        );
        rod.turning = loaded.then(|| loads.clone());
        let ground = Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::new(0.3, -0.2, 0.5));
        let links = vec![link(rod, 6, weld(Attachment::ground(ground)), None)];
        let assembly = HeavyAssembly::new(Vec::new(), links).unwrap();
        let mesh = Mesh {
            elements: vec![if loaded { vec![1, 1] } else { vec![2] }],
            degree: 3,
        };
        ElementAssembly::new(&assembly, mesh).unwrap()
    };
    let [with, without] = [true, false].map(model);
    let straight = |s: &f64| BodyMotion::at_rest(Isometry3::translation(0.1, 0.0, 0.2 + *s));
    let rod: Vec<_> = with.places(0).iter().map(straight).collect();
    let mut y = with.state(&[], &[rod]);
    let (time, sites) = (with.time(), with.sites());
    assert_eq!(time, without.time());
    for i in 0..time {
        y[i] += 0.05 * (1.7 * i as f64 + 0.4).sin();
    }
    let mut x = DVector::from_fn(y.len(), |i, _| (0.9 * i as f64 + 0.2).sin());
    for i in 0..sites {
        let p: Vector4<f64> = y.fixed_rows::<4>(7 * i + 3).normalize();
        y.fixed_rows_mut::<4>(7 * i + 3).copy_from(&p);
        let d: Vector4<f64> = x.fixed_rows::<4>(7 * i + 3).into_owned();
        x.fixed_rows_mut::<4>(7 * i + 3)
            .copy_from(&(d - p * p.dot(&d)));
    }
    x.rows_mut(time, y.len() - time).fill(0.0);
    let slope = |model: &ElementAssembly, h: f64| {
        let mut out = DVector::zeros(y.len());
        System::slope(model, &(&y + &x * h), &mut out).unwrap();
        out
    };
    let step = 1e-6;
    let difference = |h: f64| slope(&with, h) - slope(&without, h);
    let wanted = (difference(step) - difference(-step)) / (2.0 * step);
    let product = |model: &ElementAssembly| System::linearised(model, &y).unwrap().times(&x);
    let found = product(&with) - product(&without);
    let speeds = 7 * sites..time;
    let rows = |v: &DVector<f64>| v.rows(speeds.start, speeds.len()).into_owned();
    let (found, wanted) = (rows(&found), rows(&wanted));
    let (off, size) = ((found - &wanted).amax(), wanted.amax());
    assert!(size > 1.0 && off < 1e-4 * size, "{off:e} of {size:e}");
}
