//! Branches of assemblies: switching, fold curves, deflation, both ways.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use snaprod::rod::{EndConditions, Problem, Rod, RodFamily};
use snaprod::scene::Scene;
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options};
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{self, BranchRecord, Silent};
use std::f64::consts::{FRAC_PI_2, PI};

/// A deck welded to two parallel columns that are clamped on the ground, inextensible and unshearable. A force -P
/// along z on the deck is the only load. The columns sway along x together, and the deck turns with them.
const PORTAL: &str = r#"
[[rod]]
name = "left"
model = "cosserat"
length = 1.0
section = { bending = [20.0, 1.0], torsion = 20.0 }
from = { position = [0.0, -0.5, 0.0] }
to = { body = "deck", position = [0.0, -0.5, 0.0] }
[[rod]]
name = "right"
model = "cosserat"
length = 1.0
section = { bending = [20.0, 1.0], torsion = 20.0 }
from = { position = [0.0, 0.5, 0.0] }
to = { body = "deck", position = [0.0, 0.5, 0.0] }
[[body]]
name = "deck"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
force = [0.0, 0.0, -1.0]
"#;

/// Half span of an arch of two straight halves, and the angle of the clamps.
const SPAN: f64 = 0.8;
const RISE: f64 = 0.9;

/// The arch, with a body where the halves meet.
pub fn arch() -> String {
    let turned = |angle: f64, from_right: bool| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2 - angle);
        let around = if from_right {
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI)
        } else {
            UnitQuaternion::identity()
        };
        let q = (around * turn).into_inner();
        format!("[{:?}, {:?}, {:?}, {:?}]", q.w, q.i, q.j, q.k)
    };
    let half = |name: &str, x: f64, from_right: bool| {
        let (foot, crown) = (turned(RISE, from_right), turned(0.0, from_right));
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [6.0, 1.0], torsion = 4.0 }}\n\
             from = {{ position = [{x:?}, 0.0, 0.0], quaternion = {foot} }}\nto = {{ body = \"crown\", quaternion = {crown} }}\n"
        )
    };
    let halves = [half("left", -SPAN, false), half("right", SPAN, true)].concat();
    format!(
        "{halves}[[body]]\nname = \"crown\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nforce = [0.0, 0.0, 20.0]\n"
    )
}

fn followed(scene: &str, how: &str) -> BranchRecord {
    let text = format!("{scene}[continue]\n{how}\n");
    let scene = Scene::parse(&text).expect(&text);
    study::branch(&scene, &mut Silent).expect(how)
}

/// Rows of a branch at a value of the parameter.
fn rows_at(record: &BranchRecord, number: i64, p: f64) -> Vec<usize> {
    let ps = record.branches.points.reals("parameter");
    let numbers = record.branches.numbers();
    (0..ps.len())
        .filter(|&i| ps[i] == p && numbers[i] == Some(number))
        .collect()
}

/// K(k) and E(k) by the arithmetic-geometric mean.
fn complete(k: f64) -> (f64, f64) {
    let (mut a, mut b, mut c) = (1.0, (1.0 - k * k).sqrt(), k);
    let (mut sum, mut power) = (0.5 * c * c, 1.0);
    while c.abs() > 1e-16 {
        (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
        sum += power * c * c;
        power *= 2.0;
    }
    let whole = PI / (2.0 * a);
    (whole, whole * (1.0 - sum))
}

/// Closed form: each column bears P/2, sways at P/2 = pi^2 B/(4 L^2), and is then the elastica: lam L = K(k), lam^2 =
/// P/(2B), sway 2k/lam, height L (2E/K - 1). Catches a branch point of an assembly that is not seen, a switch that
/// misses one side, and rows of another branch.
#[test]
fn a_deck_on_two_columns_sways_either_way() {
    let record = followed(
        PORTAL,
        "parameter = \"body.deck.force.z\"\nfrom = -1.0\nto = -8.0\nswitch = true\nat = [-5.5, -7.0]",
    );
    assert!(record.is_complete(), "{:?}", record.branches.curves);
    let specials = &record.branches.specials;
    let first = &specials[0];
    assert_eq!(first.kind, SpecialKind::BranchPoint, "{specials:?}");
    let off = (first.parameter + 0.5 * PI * PI).abs();
    assert!(off <= 1e-8 && off <= first.precision + 1e-11, "{off:e}");
    assert_eq!(first.index, [Some(0), Some(1)]);
    assert_eq!(
        record.branches.curves.len(),
        3,
        "{:?}",
        record.branches.curves
    );
    let table = &record.branches.points;
    for load in [5.5, 7.0_f64] {
        let lambda = (0.5 * load).sqrt();
        let (mut low, mut high) = (0.0, 1.0 - 1e-9);
        for _ in 0..60 {
            let k: f64 = 0.5 * (low + high);
            *(if complete(k).0 < lambda {
                &mut low
            } else {
                &mut high
            }) = k;
        }
        let (k, (whole, second)) = (low, complete(low));
        let mut sides = [1, 2].map(|number| {
            let rows = rows_at(&record, number, -load);
            assert_eq!(rows.len(), 1, "branch {number} at {load}");
            let at = |name: &str| table.reals(name)[rows[0]];
            assert!((at("deck.z") - (2.0 * second / whole - 1.0)).abs() < 1e-8);
            assert_eq!(table.integers("index")[rows[0]], Some(0));
            at("deck.x")
        });
        sides.sort_by(f64::total_cmp);
        let sway = 2.0 * k / lambda;
        assert!(
            (sides[0] + sway).abs() < 1e-8 && (sides[1] - sway).abs() < 1e-8,
            "{sides:?}, not {sway}"
        );
    }
}

/// Folds of one half of the arch as a single rod with a sliding end, the clamp at distance `span`.
fn folds_of_half(span: f64) -> Vec<f64> {
    let clamp = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2 - RISE);
    let rod = Rod::new(1.0, Linear::diagonal([6.0, 1.0], 4.0).unwrap())
        .unwrap()
        .with_clamp(Translation3::new(-span, 0.0, 0.0).vector, clamp);
    let slider = |load: f64| {
        let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
        let end = EndConditions {
            position: [Some(0.0), Some(0.0), None],
            force: Vector3::new(0.0, 0.0, 0.5 * load),
            ..EndConditions::pose(Vector3::zeros(), level)
        };
        Problem::new(rod.clone(), end, 1e-12)
    };
    let family = RodFamily::new(slider, false, 80.0);
    let base = slider(20.0).unwrap().solve(None).unwrap().base;
    let x = family.unknowns(&base, 20.0).unwrap();
    let options = Options {
        max_step: 1.0,
        weight: 0.125,
        ..Options::between(20.0, -60.0)
    };
    let trace = Continuation::new(&family, x, 20.0, options)
        .unwrap()
        .trace();
    let folds = trace
        .specials
        .iter()
        .filter(|at| at.kind == SpecialKind::Fold);
    folds.map(|at| at.point.p).collect()
}

/// Catches fold curves of assemblies off their folds. Moving one support of the arch gives the folds of its half with
/// the support moved half as far.
#[test]
fn fold_curves_of_an_arch_whose_support_moves() {
    let record = followed(
        &arch(),
        "parameter = \"body.crown.force.z\"\nfrom = 20.0\nto = -60.0\npoints = 400\n\
         second = { parameter = \"rod.right.from.position.x\", from = 0.76, to = 0.84 }",
    );
    let folds = record.fold_curves.as_ref().expect("fold curves");
    assert!(record.is_complete(), "{:?}", folds.curves.curves);
    assert_eq!(folds.curves.curves.len(), 2);
    let table = &folds.curves.points;
    let (ps, qs) = (table.reals("parameter"), table.reals("second"));
    let numbers = folds.curves.numbers();
    for number in 0..2 {
        let own: Vec<usize> = (0..ps.len())
            .filter(|&i| numbers[i] == Some(number))
            .collect();
        let ends = [own[0], own[own.len() - 1]].map(|i| qs[i]);
        assert_eq!(ends, [0.76, 0.84]);
        for i in [own[0], own[own.len() / 3], own[own.len() - 1]] {
            let halved = folds_of_half(SPAN + 0.5 * (qs[i] - SPAN));
            assert_eq!(halved.len(), 2);
            let off = halved.iter().map(|p| (p - ps[i]).abs());
            let off = off.fold(f64::INFINITY, f64::min);
            assert!(off < 1e-8, "fold curve {number} at {}: {off:e} off", qs[i]);
        }
    }
}

/// Catches a deflated search that finds nothing, or a known equilibrium. From the upright arch the search must find
/// the arch pushed through, under loads that both bear. The same equilibrium lies on the branch through both limit
/// points.
#[test]
#[ignore = "second tier: 10 s"]
fn deflation_finds_the_arch_pushed_through() {
    let whole = followed(
        &arch(),
        "parameter = \"body.crown.force.z\"\nfrom = 20.0\nto = -60.0\npoints = 400\nat = [-4.0]",
    );
    let low = |record: &BranchRecord, number: i64| {
        let heights = record.branches.points.reals("crown.z");
        let rows = rows_at(record, number, -4.0);
        let lowest = rows.iter().map(|&i| heights[i]);
        lowest.fold(f64::INFINITY, f64::min)
    };
    let wanted = low(&whole, 0);
    assert!(wanted < 0.0, "{wanted}");
    let record = followed(
        &arch(),
        "parameter = \"body.crown.force.z\"\nfrom = -2.0\nto = -6.0\ndeflate = true\nat = [-4.0]",
    );
    let search = record.deflation.as_ref().expect("a search");
    assert!(search.found >= 1, "{:?}", record.remarks);
    let others = 1..record.branches.curves.len() as i64;
    let nearest = others
        .map(|number| (low(&record, number) - wanted).abs())
        .fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-8, "{nearest:e} off");
}

/// Catches a backward branch in the wrong order or missing: both directions together have the points of two branches,
/// one each way.
#[test]
fn an_arch_is_followed_both_ways() {
    let how = |more: &str| format!("parameter = \"body.crown.force.z\"\nfrom = 5.0\n{more}");
    let both = followed(&arch(), &how("to = -10.0\nboth = true"));
    assert!(both.is_complete(), "{:?}", both.branches.curves);
    let table = &both.branches.points;
    let ps = table.reals("parameter");
    let along = table.reals("arclength");
    assert_eq!((ps[0], ps[ps.len() - 1]), (20.0, -10.0));
    assert!(along.windows(2).all(|pair| pair[0] < pair[1]));
    for (to, row) in [(20.0, 0), (-10.0, ps.len() - 1)] {
        let one = followed(&arch(), &how(&format!("to = {to:?}")));
        let heights = one.branches.points.reals("crown.z");
        let gap = heights[heights.len() - 1] - table.reals("crown.z")[row];
        assert!(gap.abs() < 1e-8, "{gap:e} at {to}");
    }
}

/// A shallow truss: a point mass on three springs between ball joints.
fn shallow_truss() -> String {
    let spring = |name: &str, length: f64, axial: f64, from: [f64; 3]| {
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = {length:?}\n\
             section = {{ bending = [1.0, 1.0], torsion = 1.0, axial = {axial:?}, shear = [100.0, 100.0] }}\n\
             from = {{ position = {from:?}, joint = \"ball\" }}\nto = {{ body = \"P\", joint = \"ball\" }}\n"
        )
    };
    [
        &spring("a", 1.0, 50.0, [-0.98, 0.0, 0.0]),
        &spring("b", 1.1, 70.0, [1.05, 0.0, 0.0]),
        &spring("c", 2.0, 10.0, [0.0, 2.0, 0.2]),
        "[[body]]\nname = \"P\"\nmass = 1.3\nforce = [0.0, 0.0, 0.0]\nguess = { position = [0.0, 0.0, 0.22] }\n",
    ]
    .concat()
}

/// Catches a branch that leaves its range behind a fold, reported as without equilibrium at its target: followed
/// beyond the range, the branch reaches the target.
#[test]
fn a_branch_that_leaves_its_range_tells_how_it_goes_on() {
    let how = "parameter = \"body.P.force.z\"\nto = -3.0";
    let one = followed(&shallow_truss(), how);
    assert!(!one.is_complete());
    let told = one.branches.curves[0].ends.join("; ");
    for words in [
        "left its range at the other end",
        "both = true",
        "not followed",
    ] {
        assert!(told.contains(words), "{told}");
    }
    assert!(!told.contains("no equilibrium"), "{told}");
    let both = followed(&shallow_truss(), &format!("{how}\nboth = true"));
    assert!(both.is_complete(), "{:?}", both.branches.curves);
    assert_eq!(rows_at(&both, 0, -3.0).len(), 1);
}

/// Catches a useless advice to raise the number of points: the target of the far clamp, 1.3, is out of reach of a
/// strip of length 1.1.
#[test]
fn a_place_beyond_the_rods_is_told() {
    let turn = "rotation = { axis = [0, 1, 0], angle = 1.5707963267948966 }";
    let scene = format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 0.6\nsection = {{ bending = [30.0, 1.0], torsion = 20.0 }}\n\
         from = {{ {turn} }}\nto = {{ body = \"M\", {turn} }}\n\
         [[rod]]\nname = \"b\"\nmodel = \"cosserat\"\nlength = 0.5\nsection = {{ bending = [30.0, 1.3], torsion = 20.0 }}\n\
         from = {{ body = \"M\", {turn} }}\nto = {{ position = [1.0, 0.0, 0.05], {turn} }}\n\
         [[body]]\nname = \"M\"\nmass = 1.0\ninertia = [0.05, 0.05, 0.05]\nforce = [0.0, 0.0, 10.0]\n\
         guess = {{ position = [0.53791573, 0.0, 0.22726886] }}\n"
    );
    let told = |to: f64| {
        let how = format!("parameter = \"rod.b.to.position.x\"\nto = {to:?}\npoints = 12");
        followed(&scene, &how).branches.curves[0].ends.join("; ")
    };
    let beyond = told(1.3);
    for words in ["12 points", "= 1.3 is out of reach", "too short"] {
        assert!(beyond.contains(words), "{beyond}");
    }
    assert!(!beyond.contains("raise points"), "{beyond}");
    let within = told(1.09);
    assert!(!within.contains("out of reach"), "{within}");
}
