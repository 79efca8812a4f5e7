//! Reference data and comparisons: a NaN, a wrong sign or a missing file fails.

use nalgebra::allocator::Allocator;
use nalgebra::{
    DefaultAllocator, Dim, Matrix3, Matrix6, OMatrix, Quaternion, Rotation3, UnitQuaternion,
    Vector3, Vector6,
};
use serde_json::Value;
use snaprod::motion::{Motion, Snap};
use snaprod::rod::{Fallen, Rod};
#[cfg(feature = "scene")]
use snaprod::scene::{Fault, FaultKind};
use snaprod::section::{Linear, Varying};
#[cfg(feature = "cli")]
use snaprod::study::{ModesRecord, modes};
use std::path::Path;

/// Directory of the repository: benchmarks, a nested package, read the data of the tests, too.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut above = package.ancestors();
    (above.find(|directory| directory.join("tests/data").is_dir()))
        .expect("the directory tests/data")
}

/// Reads a JSON file of tests/data; missing or broken data fail.
pub fn json(name: &str) -> Value {
    let path = root().join("tests/data").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The rows under `key`, at least `least` of them.
pub fn rows<'a>(data: &'a Value, key: &str, least: usize) -> &'a [Value] {
    let rows = data[key]
        .as_array()
        .unwrap_or_else(|| panic!("no list {key}"));
    assert!(rows.len() >= least, "{key}: only {} rows", rows.len());
    rows
}

/// A number written as a number or as a decimal string.
pub fn number(row: &Value, key: &str) -> f64 {
    let value = &row[key];
    value
        .as_f64()
        .or_else(|| value.as_str().and_then(|s| s.parse().ok()))
        .unwrap_or_else(|| panic!("no number {key} in {row}"))
}

/// |got - want| <= tolerance max(|want|, floor): false for NaN.
pub fn close(got: f64, want: f64, tolerance: f64, floor: f64) -> bool {
    (got - want).abs() <= tolerance * want.abs().max(floor)
}

/// Asserts [`close`] with a message.
#[track_caller]
pub fn assert_close(got: f64, want: f64, tolerance: f64, floor: f64, what: &str) {
    assert!(
        close(got, want, tolerance, floor),
        "{what}: got {got:e}, want {want:e}, off by {:e}",
        got - want
    );
}

/// The largest of these errors; NaN is infinite.
pub fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, |most: f64, off| {
        if off.is_nan() {
            f64::INFINITY
        } else {
            most.max(off)
        }
    })
}

/// A list of numbers, or of lists of numbers in a row.
pub fn list(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(parts) => parts.iter().flat_map(list).collect(),
        other => vec![
            other
                .as_f64()
                .unwrap_or_else(|| panic!("no number: {other}")),
        ],
    }
}

/// A vector of three.
pub fn vector3(row: &Value, key: &str) -> Vector3<f64> {
    Vector3::from_row_slice(&list(&row[key]))
}

/// The base wrench (m(0), n) of a row.
pub fn base_wrench(row: &Value) -> Vector6<f64> {
    let (m, n) = (vector3(row, "base_couple"), vector3(row, "base_force"));
    Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
}

/// A rotation [w, x, y, z].
pub fn quaternion(row: &Value, key: &str) -> UnitQuaternion<f64> {
    let q = list(&row[key]);
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

/// True if the section of a row varies along its rod.
pub fn tapers(row: &Value) -> bool {
    number(&row["section"], "taper") != 0.0
}

/// The rod of a row of tests/data/rod_*.json: w = (1 - taper s) K (e - rest).
pub fn rod(row: &Value) -> Rod {
    let section = &row["section"];
    let rest = list(&section["rest"]);
    let mut stiffness = Matrix6::from_row_slice(&list(&section["stiffness"]));
    let mut rigid = [false; 3];
    for i in list(&section["rigid"]) {
        let i = i as usize;
        rigid[i - 3] = true;
        stiffness[(i, i)] = 1.0;
    }
    let law = move |part: f64| {
        Linear::full(stiffness * part)?
            .rigid(rigid)?
            .with_rest([rest[0], rest[1]], rest[2])
    };
    let length = number(row, "length");
    let taper = number(section, "taper");
    let rod = if taper == 0.0 {
        Rod::new(length, law(1.0).expect("a law"))
    } else {
        Rod::new(length, Varying::by(move |s| law(1.0 - taper * s)))
    };
    rod.expect("a rod")
}

/// Checks the shapes of the fall in the last snap of `run`: they begin at the fold and end at the landing, lose energy
/// monotonically, and have their ends in place.
pub fn falls(run: &dyn Motion<'_>, snap: &Snap, energy: f64) -> Vec<Fallen> {
    const SECTIONS: usize = 201;
    let shapes = run.fall(snap).expect("a layer");
    assert!(shapes.len() > 20, "{} shapes", shapes.len());
    for pair in shapes.windows(2) {
        let gained = pair[1].0 - pair[0].0;
        assert!(gained < 1e-4 * energy, "{gained:e} won");
    }
    let [first, last] = [&shapes[0], &shapes[shapes.len() - 1]];
    assert!(
        (first.0 - snap.from.elastic).abs() < 0.03 * energy,
        "{} at the fold",
        first.0
    );
    assert!(
        (last.0 - snap.to.elastic).abs() < 1e-3 * energy,
        "{} where it lands",
        last.0
    );
    let before = run.before_snap().expect("a state before the snap");
    let sides = [before.sections(SECTIONS), run.now().sections(SECTIONS)];
    for ((_, shape), (side, bound)) in [first, last].into_iter().zip(sides.iter().zip([0.1, 1e-3]))
    {
        let rod = &side[..];
        // A taut rod near a fold may have no shape; after landing the rod has one.
        if rod.is_empty() && std::ptr::eq(side, &sides[0]) {
            continue;
        }
        let base = rod[0].1;
        let clamp = base.rotation * shape[0].rotation.inverse();
        let ends = [&shape[0], &shape[shape.len() - 1]]
            .map(|at| base.translation.vector + clamp * at.translation.vector);
        for (end, (_, given)) in ends.iter().zip([rod[0], rod[rod.len() - 1]]) {
            let off = (end - given.translation.vector).norm();
            assert!(off < 0.03, "an end is {off:e} off");
        }
        // Every section lies on the rod's current shape.
        for at in shape {
            let place = base.translation.vector + clamp * at.translation.vector;
            let near = rod
                .iter()
                .map(|(_, s)| (s.translation.vector - place).norm());
            let near = near.fold(f64::INFINITY, f64::min);
            assert!(
                near < bound + 0.6 / SECTIONS as f64,
                "a section is {near:e} beside the rod"
            );
        }
    }
    shapes
}

/// The number at a path into a JSON value, `/end/x`.
#[cfg(feature = "scene")]
pub fn number_at(value: &Value, path: &str) -> f64 {
    let found = value.pointer(path).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{path} of {value:#}"))
}

/// Asserts a relative error below the given bound.
#[cfg(feature = "scene")]
#[track_caller]
pub fn near(found: f64, expected: f64, tolerance: f64) {
    let error = (found / expected - 1.0).abs();
    assert!(error < tolerance, "{found}, not {expected}: {error:.1e}");
}

/// Limit at the fold of values at the distances d, d/4, d/16, by extrapolation up to the third power of sqrt(d).
#[cfg(feature = "scene")]
pub fn limit_at_fold(of: [f64; 3]) -> f64 {
    let [a, b] = [2.0 * of[1] - of[0], 2.0 * of[2] - of[1]];
    (4.0 * b - a) / 3.0
}

/// Reference data of rods with mass by tools/ref_mass*.py.
pub fn mass_data(name: &str) -> Value {
    json(&format!("mass/{name}_given.json"))
}

/// A number, possibly written as a string.
pub fn decimal(value: &Value) -> f64 {
    match value {
        Value::String(word) => word.parse().unwrap(),
        value => value.as_f64().unwrap(),
    }
}

/// d1 across the plane, d3 along +x.
pub fn laid() -> UnitQuaternion<f64> {
    let axes = Matrix3::from_columns(&[Vector3::z(), -Vector3::y(), Vector3::x()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// A scene of the directory scenes, as text.
#[cfg(feature = "scene")]
pub fn text_of(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap()
}

/// The text with replacements, each of which must match.
#[cfg(feature = "scene")]
pub fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// Asserts that a scene has one fault only, with the given words.
#[cfg(feature = "scene")]
#[track_caller]
pub fn one_fault(
    found: &[Fault],
    text: &str,
    (line, field, kind, words): (usize, &str, FaultKind, &str),
) {
    let [found] = found else {
        panic!("{found:#?}\n{text}")
    };
    let seen = (found.line, found.field.as_str(), found.kind);
    assert_eq!(seen, (line, field, kind), "{found}\n{text}");
    assert!(found.to_string().contains(words), "{found}: {words}");
}

/// The small motions of a scene.
#[cfg(feature = "cli")]
pub fn modes_of(text: &str) -> ModesRecord {
    let scene = snaprod::scene::Scene::parse(text);
    let scene = scene.unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    modes(&scene).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

/// The angular frequencies of its modes.
#[cfg(feature = "cli")]
pub fn frequencies(record: &ModesRecord) -> Vec<f64> {
    let modes = record.motions.modes.iter();
    modes.map(|mode| mode.angular_frequency).collect()
}

/// The scene of the reference, word by word.
#[cfg(feature = "scene")]
pub const SAMPLE: &str = r#"[rod]
model = "cosserat"
length = 1.0
[rod.section]                       # or: stiffness = 6x6, rows and columns in the order u1 u2 u3 v1 v2 v3; or shape and material
bending = [1.0, 1.5]
torsion = 0.7
shear = [100.0, 120.0]              # "rigid" for unshearable
axial = 300.0                       # "rigid" for inextensible
[rod.rest]                          # intrinsic strains, optional
curvature = [0.0, 0.0]
twist = 0.0
[clamp]                             # optional: position, quaternion = [w, x, y, z]; default: the directors are the world axes, the rod points along z (d3)
[end]                               # a load: n(1), m(1) applied to the rod, world frame (follower = true: director frame); or position / pose to be held
force = [1.0, -2.0, 0.5]
couple = [0.3, 0.2, -0.8]
"#;

/// The exponential of a matrix: series of a fraction of the matrix, squared repeatedly.
pub fn exponential<D: Dim>(matrix: &OMatrix<f64, D, D>) -> OMatrix<f64, D, D>
where
    DefaultAllocator: Allocator<D, D>,
{
    let halvings = (matrix.norm().log2().ceil() as i32 + 2).max(0);
    let part = matrix / 2f64.powi(halvings);
    let (rows, columns) = matrix.shape_generic();
    let one = OMatrix::identity_generic(rows, columns);
    let mut sum = one.clone();
    for k in (1..=16).rev() {
        sum = &one + &part * sum / f64::from(k);
    }
    (0..halvings).fold(sum, |root, _| &root * &root)
}
