//! Runs in space under a change of units: every number of a scene and of its output has its dimension.

use crate::cli_motion::{run, scene};
use crate::program::Place;

/// A scene in units of length `l`, mass `m` and time `t`: each number of the plain scene times its dimension.
struct Measures {
    l: f64,
    m: f64,
    t: f64,
}

impl Measures {
    fn of(&self, value: f64, [l, m, t]: [i32; 3]) -> f64 {
        value * self.l.powi(l) * self.m.powi(m) * self.t.powi(t)
    }

    fn list<const N: usize>(&self, values: [f64; N], dimension: [i32; 3]) -> String {
        format!("{:?}", values.map(|x| self.of(x, dimension)))
    }
}

/// Dimensions as powers of length, mass, time.
const LENGTH: [i32; 3] = [1, 0, 0];
const CURVATURE: [i32; 3] = [-1, 0, 0];
const VELOCITY: [i32; 3] = [1, 0, -1];
const RATE: [i32; 3] = [0, 0, -1];
const TIME: [i32; 3] = [0, 0, 1];
const ACCELERATION: [i32; 3] = [1, 0, -2];
const FORCE: [i32; 3] = [1, 1, -2];
/// Couple and energy.
const COUPLE: [i32; 3] = [2, 1, -2];
const FLEXURAL: [i32; 3] = [3, 1, -2];

fn dimension_of(column: &str) -> [i32; 3] {
    match column {
        "t" => TIME,
        "x" | "y" | "z" => LENGTH,
        "qw" | "qx" | "qy" | "qz" => [0; 3],
        "vx" | "vy" | "vz" => VELOCITY,
        "wx" | "wy" | "wz" => RATE,
        "fx" | "fy" | "fz" => FORCE,
        _ => COUPLE,
    }
}

/// Viscosities, branches, inertia, every load, a start with memory.
fn laden(u: &Measures) -> String {
    let [viscous, axial] = [FLEXURAL, FORCE].map(|[l, m, t]| [l, m, t + 1]);
    let v = |x: f64, d: [i32; 3]| u.of(x, d);
    let six = |f: [f64; 3], n: [f64; 3], flexural: [i32; 3], shear: [i32; 3]| {
        let flexure = f.map(|x| v(x, flexural));
        let shear = n.map(|x| v(x, shear));
        format!("{:?}", [flexure, shear].concat())
    };
    scene(
        &format!(
            "length = {:?}\ndamping = {}\nrelaxation = [{{ stiffness = {}, time = {:?} }}, {{ stiffness = {{ proportional = 0.3 }}, time = {:?} }}]\n\
             [rod.section]\nbending = {}\ntorsion = {:?}\nshear = {}\naxial = {:?}\n[rod.rest]\ncurvature = {}\ntwist = {:?}",
            v(1.0, LENGTH),
            six([0.05, 0.06, 0.04], [2.0, 3.0, 4.0], viscous, axial),
            six([0.2, 0.1, 0.3], [1.0, 2.0, 3.0], FLEXURAL, FORCE),
            v(0.4, TIME),
            v(2.0, TIME),
            u.list([1.0, 1.0], FLEXURAL),
            v(0.7, FLEXURAL),
            u.list([50.0, 40.0], FORCE),
            v(90.0, FORCE),
            u.list([0.3, -0.2], CURVATURE),
            v(0.4, CURVATURE),
        ),
        &format!(
            "mass = {:?}\noffset = {}\ninertia = {}",
            v(1.0, [0, 1, 0]),
            u.list([0.0, 0.05, 0.1], LENGTH),
            u.list([0.02, 0.03, 0.04], [2, 1, 0]),
        ),
        &format!(
            "strain = {{ u1 = {}, v3 = [1.02] }}\nrelaxed = {{ u2 = {}, v1 = [0.01] }}\nvelocity = {}\nangular_velocity = {}",
            u.list([0.5, -0.4], CURVATURE),
            u.list([0.3], CURVATURE),
            u.list([0.3, 0.1, -0.2], VELOCITY),
            u.list([0.2, -0.3, 0.5], RATE),
        ),
        &format!(
            "[clamp]\nposition = {}\nrotation = {{ axis = [0.6, 0.0, 0.8], angle = 0.7 }}\n\
             [loads]\ngravity = {}\ndead = {}\ncouple = {}\ndrag = {:?}\nforce = {{ direction = [1.0, 2.0, 2.0], amplitude = {:?}, frequency = {:?} }}",
            u.list([0.2, 0.3, -0.1], LENGTH),
            u.list([0.1, 0.0, -0.5], ACCELERATION),
            u.list([0.0, 0.2, 0.1], FORCE),
            u.list([0.1, -0.2, 0.3], COUPLE),
            v(0.2, [0, 1, -1]),
            v(0.6, FORCE),
            v(1.5, RATE),
        ),
        &format!("duration = {:?}\nsamples = 7", v(0.4, TIME)),
    )
}

/// An unshearable rod, its power law of friction, and a start from an equilibrium; the end is free to turn.
fn thinning(u: &Measures) -> String {
    let v = |x: f64, d: [i32; 3]| u.of(x, d);
    let [l, m, t] = CURVATURE;
    scene(
        &format!(
            "length = {:?}\ndamping = {{ proportional = {:?}, exponent = 0.5, rate = {:?} }}\n[rod.section]\n\
             bending = {}\ntorsion = {:?}\naxial = {:?}",
            v(1.0, LENGTH),
            v(0.05, TIME),
            v(0.5, [l, m, t - 1]),
            u.list([1.0, 1.0], FLEXURAL),
            v(0.7, FLEXURAL),
            v(90.0, FORCE),
        ),
        &format!("mass = {:?}\njoint = \"ball\"", v(1.0, [0, 1, 0])),
        &format!(
            "equilibrium = {{ force = {} }}",
            u.list([0.8, 0.3, -0.4], FORCE)
        ),
        &format!(
            "[loads]\ngravity = {}",
            u.list([0.1, 0.0, -0.5], ACCELERATION)
        ),
        &format!("duration = {:?}\nsamples = 5", v(0.4, TIME)),
    )
}

/// Friction with a barrier; a twisting and stretching rod, which is reduced.
fn stretching(u: &Measures) -> String {
    let v = |x: f64, d: [i32; 3]| u.of(x, d);
    scene(
        &format!(
            "length = {:?}\ndamping = {{ proportional = {:?}, barrier = {{ strength = {:?}, half_widths = {} }} }}\n\
             relaxation = [{{ stiffness = {{ proportional = 0.5 }}, time = {:?} }}]\n\
             [rod.section]\nbending = {}\ntorsion = {:?}\nshear = {}\naxial = {:?}",
            v(1.0, LENGTH),
            v(0.05, TIME),
            v(0.5, [1, 1, -1]),
            u.list([0.1, 0.2], LENGTH),
            v(0.3, TIME),
            u.list([1.0, 1.0], FLEXURAL),
            v(0.7, FLEXURAL),
            u.list([50.0, 40.0], FORCE),
            v(90.0, FORCE),
        ),
        &format!(
            "mass = {:?}\ninertia = {}",
            v(1.0, [0, 1, 0]),
            u.list([0.02, 0.03, 0.04], [2, 1, 0])
        ),
        &format!(
            "strain = {{ u3 = {}, v3 = [1.1] }}\nvelocity = {}",
            u.list([0.4], CURVATURE),
            u.list([0.0, 0.0, -0.3], VELOCITY)
        ),
        "",
        &format!("duration = {:?}\nsamples = 5", v(0.4, TIME)),
    )
}

/// Catches any number of a scene, or of its output, that is scaled by the wrong power of length, stiffness, mass or
/// time.
#[test]
fn units_only_scale_a_motion() {
    let one = Measures {
        l: 1.0,
        m: 1.0,
        t: 1.0,
    };
    let other = Measures {
        l: 0.3,
        m: 0.02,
        t: 7.0,
    };
    for (name, text) in [
        ("laden", laden as fn(&Measures) -> String),
        ("thinning", thinning),
        ("stretching", stretching),
    ] {
        let place = Place::new(name);
        let (plain, plain_summary) = run(&place, &text(&one));
        let (scaled, summary) = run(&place, &text(&other));
        assert!(scaled.rows.len() == plain.rows.len() && plain.rows.len() >= 5);
        for column in &plain.columns {
            let unit = other.of(1.0, dimension_of(column));
            let expected: Vec<f64> = plain.column(column).iter().map(|x| x * unit).collect();
            let size = unit * 1e-9;
            let found = scaled.column(column);
            for (a, b) in found.iter().zip(&expected) {
                assert!(
                    (a - b).abs() <= size * (1.0 + b.abs() / unit),
                    "{name} {column}: {a} {b}"
                );
            }
        }
        let (plain, scaled) = (&plain_summary["reduction"], &summary["reduction"]);
        assert_eq!(plain.is_null(), name != "stretching");
        if !plain.is_null() {
            assert_eq!(plain["kind"], "twisting");
            let entries = [
                ("stiffness", [2, 1, -2]),
                ("dashpot", [2, 1, -1]),
                ("mass", [2, 1, 0]),
            ];
            for (key, angular) in entries {
                for (i, per) in [0, 2].into_iter().enumerate() {
                    let unit = other.of(1.0, [angular[0] - per, angular[1], angular[2]]);
                    let [a, b] = [scaled, plain].map(|of| of[key][i][i].as_f64().unwrap());
                    assert!((a - b * unit).abs() < 1e-12 * (b * unit), "{key} {i}");
                }
            }
        }
    }
}
