//! Rest shapes through points: against a helix in closed form, through a scene, and what is refused.

use crate::support::assert_close;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};
use snaprod::rod::{Rod, RodSection};
use snaprod::scene::{FaultKind, Scene};
use snaprod::section::{Centreline, Linear, Rest, Varying};
use snaprod::study::equilibrium;
use std::f64::consts::TAU;

const RADIUS: f64 = 0.3;
const PITCH: f64 = 0.4;
const TURNS: f64 = 1.5;

/// Points of a helix, closer together in some places than in others.
fn helix(count: usize) -> Vec<Vector3<f64>> {
    let place = |k: usize| {
        let x = k as f64 / (count - 1) as f64;
        let x = x + 0.3 * (TAU * x).sin() / TAU;
        let angle = TAU * TURNS * x;
        Vector3::new(
            RADIUS * angle.cos(),
            RADIUS * angle.sin(),
            PITCH * TURNS * x,
        )
    };
    (0..count).map(place).collect()
}

/// Sections of the unloaded rod with a rest shape, laid where its points are.
fn unloaded(curve: &Centreline, rest: Rest, count: usize) -> Vec<RodSection> {
    let law = Linear::diagonal([1.0, 2.0], 0.7).unwrap();
    let law = Varying::from_linear(law, rest, curve.length).unwrap();
    let [normal, tangent] = [curve.normal, curve.tangent].map(Vector3::from);
    let axes = Matrix3::from_columns(&[normal, tangent.cross(&normal), tangent]);
    let turn = Rotation3::from_matrix_unchecked(axes);
    let rod = Rod::new(curve.length, law).unwrap();
    let rod = rod.with_clamp(
        curve.position.into(),
        UnitQuaternion::from_rotation_matrix(&turn),
    );
    let places: Vec<f64> = (0..count)
        .map(|k| curve.length * k as f64 / (count - 1) as f64)
        .collect();
    rod.shape(&Vector6::zeros(), &places, 1e-12).unwrap()
}

/// Catches a spline that loses its order on uneven points, strains that are not those of the spline, and a length or a
/// distance that is wrong: the order is 6, and the unloaded rod ends at the last point.
#[test]
fn a_helix_comes_back_with_order_six() {
    let off = [24, 48].map(|count| {
        let points = helix(count);
        let (curve, rest) = Centreline::new(&points, None, Some(-Vector3::x()), 0.0).unwrap();
        assert!(curve.distance < 1e-14, "{curve:?}");
        let sections = unloaded(&curve, rest, 120);
        let end = sections[119].position - points[count - 1];
        assert!(end.norm() < 1e-9, "{end}");
        let aside = sections
            .iter()
            .map(|at| (at.position.xy().norm() - RADIUS).abs());
        let length = TAU * TURNS * RADIUS.hypot(PITCH / TAU);
        assert_close(curve.length, length, 2e-5, 1.0, "length");
        aside.fold(0.0, f64::max)
    });
    let order = (off[0] / off[1]).log2();
    assert!((5.2..7.0).contains(&order), "{off:?}: {order}");
    assert!(off[1] < 3e-6, "{off:?}");
}

/// Catches directors that turn about the tangent, or a twist of the wrong sign: with the twist of the helix's own
/// directors the flexures are constant.
#[test]
fn the_twist_of_a_helix_makes_its_flexures_constant() {
    let points = helix(80);
    let turn = RADIUS.hypot(PITCH / TAU);
    let twist = PITCH / TAU / turn / turn;
    let (curve, rest) = Centreline::new(&points, None, Some(-Vector3::x()), twist).unwrap();
    for part in [0.2, 0.5, 0.8] {
        let [u1, u2] = [0, 1].map(|k| rest.curvature[k].at(part * curve.length, curve.length));
        assert_close(u1.unwrap(), 0.0, 1e-4, 1.0, "u1");
        assert_close(u2.unwrap(), RADIUS / turn / turn, 1e-4, 1.0, "u2");
    }
}

/// Catches noise that is followed, and a distance that is not the largest: 2001 points off by at most 1e-3.
#[test]
fn few_pieces_leave_noise_out() {
    let mut points = helix(2001);
    for (k, point) in points.iter_mut().enumerate() {
        point.z += 1e-3 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0);
    }
    let (curve, rest) = Centreline::new(&points, Some(12), None, 0.0).unwrap();
    assert_eq!((curve.points, curve.pieces), (2001, 12));
    assert!((0.8e-3..1.2e-3).contains(&curve.distance), "{curve:?}");
    for at in unloaded(&curve, rest, 60) {
        assert!((at.position.xy().norm() - RADIUS).abs() < 3e-4, "{at:?}");
    }
}

/// A scene whose rest shape is `centreline`, with further lines in [rod].
fn scene(centreline: &str, more: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\n{more}section = {{ bending = [1.0, 1.0], torsion = 0.8 }}\n\
         rest = {{ centreline = {centreline} }}\n[clamp]\nposition = [0.3, 0.0, 0.0]\n[end]\n"
    )
}

/// Rows of an array of points.
fn listed(points: &[Vector3<f64>]) -> String {
    let rows = points
        .iter()
        .map(|p| format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z));
    format!("[{}]", rows.collect::<Vec<_>>().join(", "))
}

/// Catches a form of the field that is read differently, a fit that the record does not tell, and a length that is not
/// the curve's.
#[test]
fn scenes_take_points_from_files_and_rows() {
    let points = helix(30);
    let path = std::env::temp_dir().join(format!("snaprod-curve-{}.csv", std::process::id()));
    let rows = points
        .iter()
        .map(|p| format!("{:?};{:?};{:?}\n", p.z, p.x, p.y));
    std::fs::write(&path, "z;x;y\n".to_owned() + &rows.collect::<String>()).unwrap();
    let named = format!("{:?}", path.to_str().unwrap());
    let inline = listed(&points);
    let forms = [
        named.clone(),
        inline.clone(),
        format!("{{ file = {named}, normal = [0.0, 0.0, 1.0] }}"),
        format!("{{ points = {inline} }}"),
    ];
    let span = (points[29] - points[0]).norm();
    for form in &forms {
        let text = scene(form, "");
        let read = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
        let found = equilibrium(&read).unwrap();
        let end = found.found.end.position - Vector3::new(0.3, 0.0, 0.0);
        assert_close(end.norm(), span, 1e-9, 1.0, form);
        let summary = found.summary();
        let told = &summary["centreline"];
        assert_eq!(told["points"], 30);
        assert!(told["distance"].as_f64().unwrap() < 1e-14, "{told}");
        assert_close(
            told["length"].as_f64().unwrap(),
            found.length,
            1e-14,
            1.0,
            "length",
        );
    }
    std::fs::remove_file(&path).unwrap();
    // A length near that of the curve scales the shape.
    let whole = Scene::parse(&scene(&inline, "")).unwrap().rod.length;
    let longer = scene(&inline, &format!("length = {:?}\n", whole * 1.01));
    let found = equilibrium(&Scene::parse(&longer).unwrap()).unwrap();
    let end = found.found.end.position - Vector3::new(0.3, 0.0, 0.0);
    assert_close(end.norm(), span * 1.01, 1e-9, 1.0, "scaled");
}

/// Catches points that are accepted and give no curve, and messages that do not say what is wrong.
#[test]
fn bad_points_are_told() {
    let points = helix(12);
    let mut twice = points.clone();
    twice[5] = twice[4];
    // A trefoil with few points in its wide parts: the fit grew with each round.
    let trefoil = |t: f64| {
        let (square, cube) = (t * t, t * t * t);
        Vector3::new(
            cube - 3.0 * t,
            square * square - 4.0 * square,
            0.2 * (square * cube - 6.0 * t),
        )
    };
    let loose: Vec<Vector3<f64>> = (0..26)
        .map(|i| trefoil(-2.0 + 4.0 * i as f64 / 25.0))
        .collect();
    let directory = std::env::temp_dir();
    let path = directory.join(format!("snaprod-bad-curve-{}.csv", std::process::id()));
    std::fs::write(&path, "0 0 0\n0 0 1\n0 nan 2\n0 0 3\n").unwrap();
    let file = format!("{:?}", path.to_str().unwrap());
    let cases = [
        (listed(&points[..3]), "", "3 points"),
        (listed(&twice), "", "points 5 and 6 are at one place"),
        (
            file,
            "",
            "line 3: \"nan\" in column \"y\" is no finite number",
        ),
        ("\"nowhere.csv\"".to_owned(), "", "cannot be read"),
        (listed(&loose), "", "swings out between the points"),
        (listed(&points), "length = 1.0\n", "two percent"),
        (
            format!("{{ points = {}, pieces = 9 }}", listed(&points)),
            "",
            "1 to 7 pieces",
        ),
        (
            "{ normal = [0.0, 0.0, 1.0] }".to_owned(),
            "",
            "centreline.file",
        ),
    ];
    for (form, more, words) in &cases {
        let text = scene(form, more);
        let faults = Scene::parse(&text).expect_err(form);
        let told = faults.to_string();
        assert!(told.contains(words), "{told}: {words}");
        assert!(
            faults
                .as_slice()
                .iter()
                .all(|fault| fault.kind != FaultKind::Syntax),
            "{told}"
        );
    }
    std::fs::remove_file(&path).unwrap();
}
