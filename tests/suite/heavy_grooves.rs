//! Bodies of single rods with mass in grooves: comparison with closed forms of beams, the rod as an assembly, the
//! light rod, and the energy.

use crate::support::replaced;
use nalgebra::Vector3;
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table, modes};

/// A rod with mass, its clamp turned, a body with an offset in a circular groove.
const SLIDER: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.8, axial = 90.0 }
damping = { proportional = 0.02 }
mass = 0.2
inertia = "full"
section_inertia = [1e-3, 1e-3, 2e-3]
[clamp]
position = [0.1, 0.2, -0.1]
quaternion = [0.5, 0.1, 0.7, -0.5]
[body]
mass = 1.0
inertia = [0.03, 0.02, 0.04]
offset = [0.02, -0.03, 0.1]
groove = { circle = { centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 } }
[loads]
gravity = [0.3, -0.7, 0.2]
[start]
settled = true
[run]
duration = 0.2
tolerance = 1e-8
samples = 5
"#;

fn ran(text: &str) -> (RunRecord, Vec<Table>) {
    let scene = Scene::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    (record, tables)
}

/// The rows of columns of a table.
fn rows(table: &Table, names: &[&str]) -> Vec<Vec<f64>> {
    let columns: Vec<Vec<f64>> = names
        .iter()
        .map(|name| table.reals(name).to_vec())
        .collect();
    (0..columns[0].len())
        .map(|i| columns.iter().map(|column| column[i]).collect())
        .collect()
}

/// A settled body of a single rod stays in place: forces of rod, weight and groove balance, and the groove force is
/// normal to the groove. Catches an equilibrium without the rod's weight, a groove relative to the wrong frame, a
/// force in the wrong frame.
#[test]
fn settled_bodies_stay() {
    let (record, tables) = ran(SLIDER);
    assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    let names = ["x", "y", "z", "fx", "fy", "fz", "gx", "gy", "gz"];
    let all = rows(&tables[0], &names);
    let (first, last) = (&all[0], &all[4]);
    for (a, b) in first.iter().zip(last) {
        assert!((a - b).abs() < 1e-7 * (1.0 + a.abs()), "{first:?} {last:?}");
    }
    let [r, rod, groove] = [0, 3, 6].map(|i| Vector3::from_column_slice(&first[i..i + 3]));
    let weight = Vector3::new(0.3, -0.7, 0.2);
    let left = rod + groove + weight;
    assert!(left.amax() < 1e-9, "{left}");
    let (centre, axis) = (Vector3::new(0.5, 0.1, 0.9), Vector3::new(0.3, 1.0, 0.2));
    let arm = r - centre;
    assert!((arm.norm() - 0.5).abs() < 1e-12 && arm.dot(&axis).abs() < 1e-12);
    let along = axis.cross(&arm).normalize().dot(&groove);
    assert!(along.abs() < 1e-10, "{along:e}");
    assert!(groove.norm() > 0.1, "the groove bears: {groove}");
}

/// A body that slides and turns, from an equilibrium and from strains: the ledger closes, the columns are those of a
/// single rod and agree with the scene written as an assembly. Catches frames, units and starts that differ.
#[test]
fn a_single_rod_is_an_assembly_of_one() {
    let sliding = replaced(
        SLIDER,
        &[
            (
                "settled = true",
                "settled = true\nvelocity = VELOCITY\nangular_velocity = [0.3, -0.2, 0.4]",
            ),
            ("0.5, 0.1, 0.7, -0.5", "1.0, 0.0, 0.0, 0.0"),
            ("[0.1, 0.2, -0.1]", "[0.0, 0.0, 0.0]"),
        ],
    );
    let at_rest = replaced(
        &sliding,
        &[
            ("VELOCITY", "[0.0, 0.0, 0.0]"),
            ("duration = 0.2", "duration = 0.01"),
        ],
    );
    let (_, tables) = ran(&at_rest);
    let start = rows(&tables[0], &["x", "y", "z"]).swap_remove(0);
    let arm = Vector3::from_column_slice(&start) - Vector3::new(0.5, 0.1, 0.9);
    let along = Vector3::new(0.3, 1.0, 0.2).cross(&arm).normalize() * 0.4;
    let velocity = format!("{:?}", along.as_slice());
    let (record, tables) = ran(&replaced(&sliding, &[("VELOCITY", &velocity)]));
    assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    let closing = &record.branches[0].closing;
    assert!(closing.relative() < 1e-8, "{:e}", closing.relative());

    let several = format!(
        "[[rod]]\nname = \"r\"\nmodel = \"cosserat\"\nlength = 1.0\ndamping = {{ proportional = 0.02 }}\nmass = 0.2\ninertia = \"full\"\n\
         section_inertia = [1e-3, 1e-3, 2e-3]\nfrom = {{ position = [0.0, 0.0, 0.0] }}\nto = {{ body = \"b\" }}\n\
         [rod.section]\nbending = [1.0, 1.3]\ntorsion = 0.8\naxial = 90.0\n\
         [[body]]\nname = \"b\"\nmass = 1.0\ninertia = [0.03, 0.02, 0.04]\noffset = [0.02, -0.03, 0.1]\nvelocity = {velocity}\n\
         angular_velocity = [0.3, -0.2, 0.4]\n\
         groove = {{ circle = {{ centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 }} }}\n\
         [loads]\ngravity = [0.3, -0.7, 0.2]\n[run]\nduration = 0.2\ntolerance = 1e-8\nsamples = 5\n"
    );
    let leaving = replaced(&several, &[(&velocity, "[0.1, 0.1, 0.1]")]);
    let refused = Prepared::new(&Scene::parse(&leaving).unwrap());
    let told = refused.and_then(|prepared| prepared.motion().map(drop));
    let told = told.unwrap_err().to_string();
    assert!(told.starts_with("body \"b\" starts"), "{told}");
    let scene = Scene::parse(&several).unwrap();
    let prepared = Prepared::new(&scene).unwrap();
    let mut others: Vec<Table> = Vec::new();
    run(&prepared, Fields::None, &mut others, &mut Silent).unwrap();
    let names = [
        "x",
        "y",
        "z",
        "kinetic",
        "rod_kinetic",
        "elastic",
        "potential",
        "dissipated",
    ];
    let bodies = [
        "b.x",
        "b.y",
        "b.z",
        "kinetic",
        "rod_kinetic",
        "elastic",
        "potential",
        "dissipated",
    ];
    let (one, other) = (rows(&tables[0], &names), rows(&others[0], &bodies));
    for (a, b) in one.iter().flatten().zip(other.iter().flatten()) {
        assert!((a - b).abs() < 1e-8, "{one:?}\n{other:?}");
    }
    let moved = one[4][2] - one[0][2];
    assert!(moved > 0.01 && one[0][4] > 1e-3, "{one:?}");

    // Strains and their rates lead the end along a straight groove: twisting alone moves nothing, stretching goes
    // along it.
    let line = replaced(
        SLIDER,
        &[
            (
                "settled = true",
                "strain = { v3 = [1.0, 0.02] }\nstrain_rate = { v3 = [0.3], u3 = [0.0, 0.5] }",
            ),
            (
                "circle = { centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 }",
                "line = { direction = [0.0, 0.0, 1.0] }",
            ),
            ("0.5, 0.1, 0.7, -0.5", "1.0, 0.0, 0.0, 0.0"),
            ("[0.1, 0.2, -0.1]", "[0.0, 0.0, 0.0]"),
        ],
    );
    let (record, tables) = ran(&line);
    assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    let all = rows(&tables[0], &["x", "y", "z", "vz", "wz"]);
    let first = &all[0];
    assert!(first[0].abs() + first[1].abs() < 1e-12, "{all:?}");
    for (found, wanted) in first[2..].iter().zip([1.01, 0.3, 0.25]) {
        assert!((found - wanted).abs() < 1e-10, "{all:?}");
    }
    assert!(record.branches[0].closing.relative() < 1e-8);
}

/// The limit of a rod without mass is the elastic rod in the groove, with an error of the order of the mass.
#[test]
fn light_rods_are_the_limit() {
    let light = replaced(
        SLIDER,
        &[
            ("damping = { proportional = 0.02 }\n", ""),
            (
                "inertia = \"full\"\nsection_inertia = [1e-3, 1e-3, 2e-3]\n",
                "inertia = \"none\"\n",
            ),
            ("mass = 0.2\n", "mass = 1e-9\n"),
        ],
    );
    let spun = |text: &str| {
        replaced(
            text,
            &[(
                "settled = true",
                "settled = true\nangular_velocity = [0.9, -0.6, 1.2]",
            )],
        )
    };
    let place = |text: &str| {
        let (record, tables) = ran(&spun(text));
        assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
        Vector3::from_column_slice(&rows(&tables[0], &["x", "y", "z"])[4])
    };
    let limit = place(&light);
    let errors = [0.02, 0.01].map(|mass: f64| {
        let given = [
            ("mass = 0.2\n", format!("mass = {mass}\n")),
            (
                "proportional = 0.02",
                format!("proportional = {}", 0.02 * mass),
            ),
            ("1e-3, 1e-3, 2e-3", "1e-5, 1e-5, 2e-5".to_owned()),
        ];
        let given = given.each_ref().map(|(from, to)| (*from, to.as_str()));
        (place(&replaced(SLIDER, &given)) - limit).norm()
    });
    let order = (errors[0] / errors[1]).log2();
    assert!((0.85..1.15).contains(&order), "{errors:?}");
}

/// Frequencies of a straight clamped rod whose body slides across it. In the plane of the groove they are those of a
/// beam with a body at its end, across it those of a beam with a pinned end. Catches modes that ignore a groove.
#[test]
fn frequencies_are_those_of_beams() {
    let text = replaced(
        SLIDER,
        &[
            (
                "circle = { centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 }",
                "line = { point = [0.0, 0.0, 1.0], direction = [1.0, 0.0, 0.0] }",
            ),
            ("0.5, 0.1, 0.7, -0.5", "1.0, 0.0, 0.0, 0.0"),
            ("[0.1, 0.2, -0.1]", "[0.0, 0.0, 0.0]"),
            ("offset = [0.02, -0.03, 0.1]\n", ""),
            ("gravity = [0.3, -0.7, 0.2]", "gravity = [0.0, 0.0, 0.0]"),
        ],
    );
    let record = modes(&Scene::parse(&text).unwrap()).unwrap();
    assert!(record.of_start && record.motions.stable);
    let found: Vec<f64> = record
        .motions
        .modes
        .iter()
        .map(|mode| mode.angular_frequency)
        .collect();
    let (density, rotary) = (0.2, 1e-3);
    // w along d1 turns the section about d2, whose stiffness is 1.3, the body by 0.02; w along d2 about d1.
    let free = beam(1.3, density, rotary, |w, omega| {
        [
            1.3 * w[3] + omega * omega * (rotary * w[1] + w[0]),
            1.3 * w[2] - omega * omega * 0.02 * w[1],
        ]
    });
    let pinned = beam(1.0, density, rotary, |w, omega| {
        [w[0], w[2] - omega * omega * 0.03 * w[1]]
    });
    for wanted in free.iter().take(2).chain(pinned.iter().take(2)) {
        let off = found
            .iter()
            .map(|omega| (omega / wanted - 1.0).abs())
            .fold(f64::INFINITY, f64::min);
        assert!(off < 1e-8, "{wanted} is off by {off:e} in {found:?}");
    }
    let eigenvalues = record.motions.eigenvalues.unwrap();
    // The remaining eigenvalues belong to overdamped vibrations, beyond the eight.
    for s in eigenvalues.iter().filter(|s| s.im > 0.0) {
        let left = found.iter().map(|omega| {
            let left = s * s + s * (0.02 * omega * omega) + omega * omega;
            left.norm() / (omega * omega)
        });
        let left = left.fold(f64::INFINITY, f64::min);
        assert!(left < 1e-7, "{s} leaves {left:e}");
    }
}

/// The first frequencies of a clamped beam of length 1 with two conditions at its end on (w, w', w'', w'''). The beam
/// equation is EI w'''' + omega^2 (J w'' - rho w) = 0.
fn beam(
    stiffness: f64,
    density: f64,
    rotary: f64,
    end: impl Fn(&[f64; 4], f64) -> [f64; 2],
) -> Vec<f64> {
    let determinant = |omega: f64| {
        let (turn, mass) = (omega * omega * rotary, omega * omega * density);
        let root = (turn * turn + 4.0 * stiffness * mass).sqrt();
        let a = ((root - turn) / (2.0 * stiffness)).sqrt();
        let b = ((root + turn) / (2.0 * stiffness)).sqrt();
        let (c, s, cos, sin) = (a.cosh(), a.sinh(), b.cos(), b.sin());
        let u = [
            c - cos,
            a * s + b * sin,
            a * a * c + b * b * cos,
            a * a * a * s - b * b * b * sin,
        ];
        let v = [
            s / a - sin / b,
            c - cos,
            a * s + b * sin,
            a * a * c + b * b * cos,
        ];
        let ([p, q], [r, t]) = (end(&u, omega), end(&v, omega));
        p * t - q * r
    };
    let mut found = Vec::new();
    let step = 0.05;
    let mut x = 0.5 * step;
    while found.len() < 2 {
        let (mut low, mut high) = (x, x + step);
        if determinant(low) * determinant(high) < 0.0 {
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if determinant(low) * determinant(middle) <= 0.0 {
                    high = middle
                } else {
                    low = middle
                }
            }
            found.push(0.5 * (low + high));
        }
        x += step;
    }
    found
}

/// Catches accepted starts beside a groove, and a run that leaves an open one.
#[test]
fn grooves_are_kept_to() {
    let line = replaced(
        SLIDER,
        &[
            (
                "circle = { centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 }",
                "spline = [[0.0, 0.0, 0.9], [0.0, 0.0, 1.0], [0.0, 0.0, 1.05]]",
            ),
            ("0.5, 0.1, 0.7, -0.5", "1.0, 0.0, 0.0, 0.0"),
            ("[0.1, 0.2, -0.1]", "[0.0, 0.0, 0.0]"),
            (
                "settled = true",
                "strain = {}\nstrain_rate = { v3 = [0.8] }",
            ),
        ],
    );
    let (record, tables) = ran(&line);
    assert_eq!(record.outcome(), "groove_end");
    let last = rows(&tables[0], &["z"]).pop().unwrap();
    assert!((last[0] - 1.05).abs() < 1e-9, "{last:?}");
    let beside = replaced(&line, &[("strain = {}", "strain = { u1 = [0.01] }")]);
    let scene = Scene::parse(&beside).unwrap();
    let told = Prepared::new(&scene).and_then(|prepared| prepared.motion().map(drop));
    let told = told.unwrap_err().to_string();
    assert!(
        told.contains("the body starts") && told.contains("beside its groove"),
        "{told}"
    );
}
