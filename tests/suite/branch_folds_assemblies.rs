//! Delay of assemblies and taut rods at the folds of their branches: comparison with single rods, closed forms, small
//! motions, and another chart.

use crate::assembly_branches::arch;
use crate::support::{limit_at_fold, near};
use nalgebra::{DVector, UnitQuaternion, Vector3};
use snaprod::rod::{BothEnds, Chart, EndConditions, Problem, Rod, RodFamily};
use snaprod::scene::Scene;
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options};
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{self, BranchRecord, Silent, branch, neglected_mass::FoldAtRest};
use std::f64::consts::FRAC_PI_2;

fn followed(text: &str) -> BranchRecord {
    branch(&Scene::parse(text).expect(text), &mut Silent).expect(text)
}

/// All folds, with their parameters.
fn folds(record: &BranchRecord) -> Vec<(f64, FoldAtRest)> {
    let all = record.branches.specials.iter();
    let all = all.filter(|at| at.kind == SpecialKind::Fold);
    let told = all.map(|at| (at.parameter, at.fold.clone()));
    told.map(|(p, fold)| (p, fold.unwrap_or_else(|| panic!("{:?}", record.remarks))))
        .collect()
}

/// The arch with rods of mass `rods` and a body of mass `crown` between them.
fn heavy_arch(rods: f64, crown: f64) -> String {
    arch()
        .replace(
            "length = 1.0\n",
            &format!("length = 1.0\nmass = {rods:e}\n"),
        )
        .replace(
            "mass = 1.0\ninertia = [0.1, 0.1, 0.1]",
            &format!(
                "mass = {crown:e}\ninertia = [{0:e}, {0:e}, {0:e}]",
                0.1 * crown
            ),
        )
}

/// Catches a wrong length of the critical direction of bodies and rods, and a wrong mass or friction of rods that move
/// at both ends. The arch with a massless crown is twice its half, whose end slides in a groove under half the load.
#[test]
fn an_arch_leaves_its_folds_as_its_half_does() {
    let whole = folds(&followed(&format!(
        "{}[continue]\nparameter = \"body.crown.force.z\"\nfrom = 20.0\nto = -60.0\npoints = 400\n",
        heavy_arch(0.7, 1e-10)
    )));
    let half = folds(&followed(&format!(
        "clamp = {{ position = [-0.8, 0.0, 0.0], rotation = {{ axis = [0, 1, 0], angle = {} }} }}
[rod]
model = \"cosserat\"
length = 1.0
mass = 0.7
section = {{ bending = [6.0, 1.0], torsion = 4.0 }}
[end]
position = [0.0, 0.0, \"free\"]
rotation = {{ axis = [0, 1, 0], angle = {FRAC_PI_2} }}
force = [0, 0, 10.0]
[continue]
parameter = \"end.force.z\"
from = 10.0
to = -30.0
points = 400
",
        FRAC_PI_2 - 0.9
    )));
    assert_eq!((whole.len(), half.len()), (2, 2));
    for ((load, whole), (half_load, half)) in whole.iter().zip(&half) {
        near(*load, 2.0 * half_load, 1e-8);
        // Half the rate of the arch.
        near(
            whole.inertial_delay,
            half.inertial_delay * 2.0_f64.powf(0.2),
            1e-6,
        );
        near(
            whole.viscous_delay,
            half.viscous_delay * 2.0_f64.powf(1.0 / 3.0),
            1e-6,
        );
        near(
            whole.form.friction / whole.form.mass,
            half.form.friction / half.form.mass,
            1e-6,
        );
    }
}

/// Catches bars between ball joints whose mass or friction is left out, and a spin about their chord with momentum;
/// also an omitted mass of the body. Four elastic bars, as a flat pyramid, have their fold in closed form. With tip
/// height z, length L, half span b: P = 4 EA (1/L - 1) z, fold at L^3 = b^2, B = 6 EA b^2 z/L^5. For z moved by 1:
/// M0 = body + 4 (m/3 + j (b/L^2)^2), D0 = 4 EA (z/L)^2.
#[test]
fn a_pyramid_of_bars_has_its_closed_form() {
    let (b, stiffness, mass, rotary, tip) = (0.96_f64, 20.0, 0.3, 0.004, 0.5);
    let feet = [("e", b, 0.0), ("w", -b, 0.0), ("n", 0.0, b), ("s", 0.0, -b)];
    let bars = feet.map(|(name, x, y)| {
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = 1.0\nmass = {mass}\nsection_inertia = [{rotary}, {rotary}, 0.05]
section = {{ bending = [50.0, 50.0], torsion = 10.0, axial = {stiffness:?} }}
from = {{ position = [{x}, {y}, 0.0], joint = \"ball\" }}\nto = {{ body = \"tip\", joint = \"ball\" }}\n"
        )
    });
    let text = format!(
        "{}[[body]]\nname = \"tip\"\nmass = {tip}\nforce = [0.0, 0.0, 0.0]\nguess = {{ position = [0.0, 0.0, 0.28] }}
[continue]\nparameter = \"body.tip.force.z\"\nfrom = 0.0\nto = -2.0\npoints = 200\nback = true\n",
        bars.concat()
    );
    let found = folds(&followed(&text));
    let (load, fold) = &found[0];
    let length = b.powf(2.0 / 3.0);
    let z = (length * length - b * b).sqrt();
    near(-load, 4.0 * stiffness * (1.0 / length - 1.0) * z, 1e-9);
    let bend = 6.0 * stiffness * b * b * z / length.powi(5);
    let inertia = tip + 4.0 * (mass / 3.0 + rotary * (b / (length * length)).powi(2));
    let friction = 4.0 * stiffness * (z / length).powi(2);
    // A is the displacement of the tip.
    let unit = fold.form.drive;
    near(fold.form.bend, bend * unit.powi(3), 1e-8);
    near(fold.form.mass, inertia * unit.powi(2), 1e-7);
    near(fold.form.friction, friction * unit.powi(2), 1e-7);
}

/// Catches a load that turns with its body, treated as a load with a potential. Near the fold an eigenvalue of the
/// small motions of the bodies on light rods has -s^2 = 2 sqrt(A B d)/M0. A, B and M0 are projections on the left null
/// vector, which differs from the critical motion.
#[test]
fn loads_that_turn_with_bodies_have_their_own_fold() {
    let text = heavy_arch(1e-9, 1.0).replace(
        "force = [0.0, 0.0, 20.0]",
        "force = { direction = [0.05, 0.0, -1.0], constant = 12.0, follower = true }",
    );
    let along = |more: &str| {
        format!(
            "{text}[continue]\nparameter = \"rod.right.from.position.z\"\nfrom = 0.0\nto = 1.2\nback = true\npoints = 400\n{more}"
        )
    };
    let (at, fold) = folds(&followed(&along("")))[0].clone();
    let squares = [1e-3, 2.5e-4, 6.25e-5].map(|d| {
        let stop = at - d;
        let record = followed(&along(&format!("at = [{stop:e}]")));
        let table = &record.branches.points;
        let column = |name: &str| table.reals(name);
        let row = (0..table.rows()).find(|i| (column("parameter")[*i] - stop).abs() < 1e-12);
        let row = row.expect("a point at the stop");
        let of = |names: [&str; 3]| names.map(|name| column(name)[row]);
        let place = of(["crown.x", "crown.y", "crown.z"]);
        let turn = of(["crown.qx", "crown.qy", "crown.qz"]);
        let here = format!(
            "{text}guess = {{ position = {place:?}, quaternion = [{:?}, {:?}, {:?}, {:?}] }}\n",
            column("crown.qw")[row],
            turn[0],
            turn[1],
            turn[2]
        );
        let right = here.rfind("from = { position = [0.8, 0.0, 0.0]").unwrap();
        let (before, after) = here.split_at(right);
        let after = after.replacen("[0.8, 0.0, 0.0]", &format!("[0.8, 0.0, {stop:?}]"), 1);
        let scene = Scene::parse(&[before, &after].concat()).unwrap();
        let motions = study::modes(&scene).unwrap().motions;
        let slowest = motions.eigenvalues.unwrap();
        let slowest = slowest.iter().min_by(|a, b| a.norm().total_cmp(&b.norm()));
        let square = -(slowest.unwrap() * slowest.unwrap());
        assert!(square.im.abs() < 1e-6 * square.re.abs(), "{square}");
        square.re / d.sqrt()
    });
    let form = &fold.form;
    let expected = 2.0 * (form.drive * form.bend).sqrt() / form.mass;
    near(limit_at_fold(squares), expected, 1e-4);
}

/// Catches a fold in the chart of taut rods with other numbers than by the base wrench, which is accurate there: lam
/// is between 6 and 12.
#[test]
fn taut_rods_fold_alike_in_both_charts() {
    let law = Linear::diagonal([1.1, 1.0], 0.75)
        .and_then(|law| law.with_rest([0.1, -0.05], 0.0))
        .unwrap();
    let rod = Rod::new(1.0, law).unwrap();
    let problem = |angle: f64| {
        let place = Vector3::new(0.0, 0.0, 0.95);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        Problem::new(rod.clone(), EndConditions::pose(place, turn), 1e-13)
    };
    let first = problem(0.0).unwrap();
    let start = first.solve(None).unwrap();
    let chart = BothEnds::new(&first, None);
    let both = RodFamily::in_chart(problem, false, 20.0, chart.clone());
    let base = RodFamily::new(problem, false, 20.0);
    let x = both.unknowns(&start.base, 0.0).unwrap();
    let options = Options {
        max_step: 0.6,
        ..Options::between(0.0, 20.0)
    };
    let trace = Continuation::new(&both, x, 0.0, options).unwrap().trace();
    let folds = trace
        .specials
        .iter()
        .filter(|at| at.kind == SpecialKind::Fold);
    for at in folds.map(|at| &at.point).take(2) {
        let here = problem(at.p).unwrap();
        let wrench = |far: f64| chart.wrench(&here, &(&at.x + &at.tangent_x * far)).unwrap();
        let rate = (wrench(1e-4) - wrench(-1e-4)) / 2e-4;
        let b = wrench(0.0);
        let unit = 1.0 / rate.norm();
        let z: DVector<f64> = &at.tangent_x * unit;
        let h = 1e-3;
        let end = |far: f64| chart.end(&here, &(&at.x + &z * far)).unwrap();
        let (after, before) = (end(h), end(-h));
        let moved = [
            (after.force - before.force) / rod.units().1,
            after.position - before.position,
        ];
        let found = both
            .fold_in_chart(&at.x, &z, at.p, &moved.map(|by| by / (2.0 * h)))
            .unwrap();
        let expected = base.fold(&b, &(rate * unit), at.p).unwrap();
        assert_eq!(expected.against, rate * unit);
        near(found[0].abs(), expected.drive.abs(), 1e-6);
        near(found[1].abs(), expected.bend.abs(), 1e-6);
    }
}

/// Catches a comparison of 0 with 0 in a chart that knows no factor of an equation, as that of base wrenches.
#[test]
fn a_chart_that_knows_no_factor_is_refused_as_such() {
    let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.2], 0.75).unwrap()).unwrap();
    let conditions = EndConditions::pose(Vector3::new(0.0, 0.0, 0.95), UnitQuaternion::identity());
    let problem = |_: f64| Problem::new(rod.clone(), conditions, 1e-10);
    let base = RodFamily::new(problem, false, 1.0);
    let (x, z) = (DVector::from_element(6, 0.1), DVector::from_element(6, 1.0));
    let refused = base.fold_in_chart(&x, &z, 0.0, &[Vector3::x(), Vector3::y()]);
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("knows no factor"), "{message}");
}

/// Catches a refused load that turns with the end, and one treated as another load. A strip bears its weight in its
/// plane: about an axis across the plane a follower couple equals a dead couple.
#[test]
fn couples_that_turn_with_the_end_fold_as_those_that_do_not() {
    let found = [false, true].map(|follower| {
        let text = format!(
            "loads = {{ distributed = [0.0, 0.0, -60.0] }}
[rod]\nmodel = \"cosserat\"\nlength = 1.0\nmass = 1.0\nsection = {{ bending = [40.0, 1.0], torsion = 40.0 }}
[end]\ncouple = [0.0, 6.0, 0.0]\nfollower = {follower}
[continue]\nparameter = \"end.couple.y\"\nfrom = 6.0\nto = -12.0\nback = true\npoints = 400\n"
        );
        let all = folds(&followed(&text));
        all[0].clone()
    });
    let [(at, dead), (other, turning)] = &found;
    near(*other, *at, 1e-8);
    near(turning.inertial_delay, dead.inertial_delay, 1e-6);
    near(turning.viscous_delay, dead.viscous_delay, 1e-6);
    near(
        turning.form.friction / turning.form.mass,
        dead.form.friction / dead.form.mass,
        1e-6,
    );
}
