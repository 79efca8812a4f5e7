//! Loads that turn with a rod, beside dead ones, and rest strains that are driven: rods at rest, against integration
//! from the free end and closed forms.

use crate::support::assert_close;
use nalgebra::{Vector3, Vector6};
use snaprod::scene::Scene;
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{BranchRecord, EquilibriumRecord, Silent, assembly, branch, equilibrium};

fn scene(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn solved(text: &str) -> EquilibriumRecord {
    equilibrium(&scene(text)).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

fn followed(text: &str) -> BranchRecord {
    branch(&scene(text), &mut Silent).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

const ROD: &str = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n";

/// (theta, x, z, curvature) at the base of a cantilever under loads along its directors alone, of length and stiffness
/// 1: from the free end, where all is known, by RK4. The end is at the origin along z; p = p0 + p1 s along d1, t along
/// d3, and the force (q1, q3) on the end.
fn from_the_free_end([p0, p1, t]: [f64; 3], [q1, q3]: [f64; 2]) -> [f64; 4] {
    // y = (theta, x, z, curvature, n1, n3).
    let slope = |s: f64, y: &Vector6<f64>| {
        let (sin, cos) = y[0].sin_cos();
        let (k, n1, n3) = (y[3], y[4], y[5]);
        Vector6::new(k, sin, cos, -n1, -k * n3 - (p0 + p1 * s), k * n1 - t)
    };
    const STEPS: usize = 1000;
    let h = -1.0 / STEPS as f64;
    let mut y = Vector6::new(0.0, 0.0, 0.0, 0.0, q1, q3);
    for step in 0..STEPS {
        let s = 1.0 + h * step as f64;
        let a = slope(s, &y);
        let b = slope(s + 0.5 * h, &(y + a * (0.5 * h)));
        let c = slope(s + 0.5 * h, &(y + b * (0.5 * h)));
        let d = slope(s + h, &(y + c * h));
        y += (a + (b + c) * 2.0 + d) * (h / 6.0);
    }
    [y[0], y[1], y[2], y[3]]
}

/// Catches a load that does not turn with the rod, one that is missing from the tangent, and an index where there is
/// none.
#[test]
fn pressure_and_thrust_turn_with_the_rod() {
    for (along, end) in [
        ([20.0, 0.0, 0.0], [0.0, 0.0]),
        ([8.0, 2.0, -3.0], [1.0, -2.0]),
    ] {
        let [p0, p1, t] = along;
        let found = solved(&format!(
            "{ROD}[loads]\nfollower = {{ polynomial = [[{p0}, 0.0, {t}], [{p1}, 0.0, 0.0]] }}\n\
             [end]\nfollower_force = [{}, 0.0, {}]\n",
            end[0], end[1]
        ));
        let [theta, x, z, curvature] = from_the_free_end(along, end);
        // The base turned back to the origin along z.
        let (sin, cos) = theta.sin_cos();
        let place = Vector3::new(-(x * cos - z * sin), 0.0, -(x * sin + z * cos));
        let off = (found.found.end.position - place).norm();
        assert!(off < 1e-9, "{along:?}: off by {off:e}");
        assert_close(found.found.base[1], curvature, 1e-9, 1.0, "base couple");
        let d3 = found.found.end.directors.column(2);
        assert!((d3 - Vector3::new(-theta.sin(), 0.0, theta.cos())).norm() < 1e-9);
        assert!(!found.indexed && found.summary()["index"].is_null());
    }
}

/// Catches a dead load that turns with the end, or a follower load that keeps its direction in the world.
#[test]
fn dead_and_following_loads_meet_at_one_end() {
    let (force, couple) = (Vector3::new(0.5, -2.0, -0.6), Vector3::new(0.5, 1.0, 0.8));
    let found = solved(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.3], torsion = 0.8 }\n\
         [end]\nforce = [0.5, -2.0, -0.6]\nfollower_couple = [0.5, 1.0, 0.8]\n",
    );
    let end = &found.found.end;
    let (m, n) = snaprod::math::se3::halves(&found.found.base);
    assert!((end.couple - end.directors * couple).norm() < 1e-9);
    assert!((end.force - force).norm() + (n - force).norm() < 1e-9);
    assert!((m - end.couple - end.position.cross(&force)).norm() < 1e-9);
    // Collocation of another code.
    let place = Vector3::new(0.33442622281501, -0.48348175679339, 0.74503253508368);
    assert!((end.position - place).norm() < 1e-9);
}

/// Catches a branch point of a load without potential that is missed or false: a circular arch between clamps under
/// pressure buckles at k^2 - 1, k tan(a) cot(k a) = 1 (known).
#[test]
fn a_clamped_arch_buckles_under_pressure() {
    let a = std::f64::consts::FRAC_PI_3;
    let length = 2.0 * a;
    let (sin, cos) = length.sin_cos();
    let found = followed(&format!(
        "[rod]\nmodel = \"cosserat\"\nlength = {length}\nrest = {{ curvature = [0.0, 1.0] }}\n\
         section = {{ bending = [1e3, 1.0], torsion = 1e3 }}\n\
         [loads]\nfollower = [1.0, 0.0, 0.0]\nload = 0.0\n\
         [end]\nposition = [{}, 0.0, {sin}]\nrotation = {{ axis = [0.0, 1.0, 0.0], angle = {length} }}\n\
         [continue]\nparameter = \"loads.load\"\nto = 22.0\n",
        1.0 - cos
    ));
    let residual = |k: f64| k * a.tan() / (k * a).tan() - 1.0;
    let (mut low, mut high) = (4.3_f64, 4.45_f64);
    assert!(residual(low) > 0.0 && residual(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if residual(middle) > 0.0 {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    let specials = &found.branches.specials;
    assert_eq!(specials.len(), 1, "{specials:?}");
    let critical = found.branches.points.reals("parameter");
    let at = critical.iter().map(|p| (p - (low * low - 1.0)).abs());
    assert!(at.fold(f64::INFINITY, f64::min) < 1e-8, "critical pressure");
}

/// Catches a drive that is not a rest strain: a cantilever takes it without energy, and between a clamp and a ball
/// joint a uniform drive is a couple at the joint.
#[test]
fn driven_rest_strains_bend_rods() {
    let drive =
        "drive = { curvature = [0.0, { polynomial = [0.0, 0.0, 1.0] }], amplitude = 3.0 }\n";
    let found = solved(&format!("{ROD}{drive}[end]\n"));
    // theta = s^3: Simpson's rule for the end.
    const PARTS: usize = 2000;
    let weight = |i: usize| {
        if i == 0 || i == PARTS {
            1.0
        } else {
            2.0 + 2.0 * (i % 2) as f64
        }
    };
    let sum = |f: fn(f64) -> f64| {
        let at = |i: usize| weight(i) * f((i as f64 / PARTS as f64).powi(3));
        (0..=PARTS).map(at).sum::<f64>() / (3 * PARTS) as f64
    };
    let place = Vector3::new(sum(f64::sin), 0.0, sum(f64::cos));
    assert!((found.found.end.position - place).norm() < 1e-9);
    assert!(found.found.end.energy.abs() < 1e-20);

    let held = "position = [0.2, 0.0, 0.85]\n";
    let driven = "drive = { curvature = [0.0, 1.0], amplitude = 0.7 }\n";
    let driven = solved(&format!("{ROD}{driven}[end]\n{held}"));
    let pushed = solved(&format!("{ROD}[end]\n{held}couple = [0.0, 0.7, 0.0]\n"));
    let middle = |found: &EquilibriumRecord| found.sections[100].position;
    assert!((middle(&driven) - middle(&pushed)).norm() < 1e-8);
}

/// Parameters of the branch points of the first branch.
fn branch_points(found: &BranchRecord) -> Vec<f64> {
    let specials = found.branches.specials.iter();
    let own = specials.filter(|at| at.kind == SpecialKind::BranchPoint && at.curve == 0);
    own.map(|at| at.parameter).collect()
}

/// Catches a load that turns with a rod of an assembly and is missing from the tangent or the balance: circular arches
/// of radius and stiffness 1 between hinges buckle at (pi/a)^2 - 1, a the half opening (known). An arch may begin at
/// either hinge, or be joined of two at a node.
#[test]
fn pinned_arches_buckle_under_pressure() {
    for (degrees, parts) in [(90.0_f64, 1), (180.0, 1), (90.0, 2)] {
        let whole = degrees.to_radians();
        let critical = (2.0 * std::f64::consts::PI / whole).powi(2) - 1.0;
        let each = whole / f64::from(parts);
        let at = |angle: f64| format!("position = [{}, 0.0, {}]", 1.0 - angle.cos(), angle.sin());
        let turn = |angle: f64| format!("rotation = {{ axis = [0.0, 1.0, 0.0], angle = {angle} }}");
        let rod = |name: &str, from: String, to: String| {
            format!(
                "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = {each}\n\
                 section = {{ bending = [1.0, 1.0], torsion = 1.0 }}\nrest = {{ curvature = [0.0, 1.0] }}\n\
                 from = {{ {from} }}\nto = {{ {to} }}\n"
            )
        };
        let [base, end] =
            [0.0, whole].map(|angle| format!("{}, {}, joint = \"ball\"", at(angle), turn(angle)));
        let node = || "body = \"node\"".to_owned();
        let (rods, names) = match parts {
            1 => (rod("a", base, end), vec!["a"]),
            _ => {
                let first = rod("a", base, node());
                let second = rod("b", node(), end);
                let node = format!(
                    "[[body]]\nname = \"node\"\nguess = {{ {}, {} }}\n",
                    at(each),
                    turn(each)
                );
                (first + &second + &node, vec!["a", "b"])
            }
        };
        let loads: Vec<String> = names
            .iter()
            .map(|name| {
                format!(
                    "[[load]]\nrod = \"{name}\"\nfrom = 0.0\nto = {each}\nforce = [1.0, 0.0, 0.0]\nfollows = true\n"
                )
            })
            .collect();
        let pressed = |factor: f64| {
            let loads = loads
                .iter()
                .map(|load| format!("{load}factor = {factor}\n"));
            format!(
                "plane = [0.0, 1.0, 0.0]\n{rods}{}",
                loads.collect::<String>()
            )
        };
        if parts == 1 {
            let found = followed(&format!(
                "{}[continue]\nparameter = \"load.0.factor\"\nto = {}\n",
                pressed(0.0),
                1.2 * critical
            ));
            let points = branch_points(&found);
            assert_eq!(points.len(), 1, "{degrees}: {:?}", found.branches.specials);
            assert_close(points[0], critical, 1e-9, 0.0, "critical pressure");
        } else {
            // Below its critical pressure the circle stays a circle.
            let circle = assembly::equilibrium(&scene(&pressed(0.5 * critical))).unwrap();
            assert!(!circle.indexed && circle.summary()["index"].is_null());
            let apart = circle.bodies[0].1.translation.vector
                - Vector3::new(1.0 - each.cos(), 0.0, each.sin());
            assert!(apart.norm() < 1e-9, "{apart}");
            assert_close(circle.energy, 0.0, 1e-12, 1.0, "energy");
        }
    }
}

/// Catches the derivatives by the turn of a base under dead and following loads: a cantilever of two rods that a node
/// joins, under both kinds of force and couple along it and on its end, is the cantilever of one rod. The second case
/// begins the second rod at its free end.
#[test]
fn loads_turn_with_the_rods_of_an_assembly() {
    let section = "section = { bending = [1.0, 1.3], torsion = 0.8 }\n";
    let alone = solved(&format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\n{section}[end]\n\
         force = [0.3, -0.4, 0.2]\nfollower_force = [0.5, 0.0, -1.0]\n\
         [[load]]\nfrom = 0.0\nto = 0.5\nforce = [3.0, 1.0, -1.0]\ncouple = [0.2, 0.1, 0.3]\nfollows = true\n\
         [[load]]\nfrom = 0.5\nto = 1.0\nforce = [2.0, -1.5, 1.0]\ncouple = [0.1, -0.2, 0.2]\nfollows = true\n\
         [[load]]\nfrom = 0.5\nto = 1.0\nforce = [-1.0, 0.5, -2.0]\ncouple = [0.3, 0.1, -0.2]\n\
         [[load]]\ns = 0.7\nforce = [0.4, -0.3, 0.2]\nfollows = true\n"
    ));
    let rods = [
        // The second rod from the node to the tip, and from the tip to the node: its directors turn by pi about d1.
        (
            "from = { body = \"node\" }\nto = { body = \"tip\" }",
            [2.0, -1.5, 1.0],
            [0.1, -0.2, 0.2],
            0.2,
            [0.4, -0.3, 0.2],
        ),
        (
            "from = { body = \"tip\", rotation = { axis = [1, 0, 0], angle_degrees = 180 } }\n\
             to = { body = \"node\", rotation = { axis = [1, 0, 0], angle_degrees = 180 } }",
            [2.0, 1.5, -1.0],
            [0.1, 0.2, -0.2],
            0.3,
            [0.4, 0.3, -0.2],
        ),
    ];
    for (ends, force, couple, s, single) in rods {
        let both = scene(&format!(
            "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 0.5\n{section}\
             from = {{ position = [0.0, 0.0, 0.0] }}\nto = {{ body = \"node\" }}\n\
             [[rod]]\nname = \"b\"\nmodel = \"cosserat\"\nlength = 0.5\n{section}{ends}\n\
             [[body]]\nname = \"node\"\n[[body]]\nname = \"tip\"\n\
             [[load]]\non = \"tip\"\nforce = [0.3, -0.4, 0.2]\n\
             [[load]]\non = \"tip\"\nforce = [0.5, 0.0, -1.0]\nfollows = true\n\
             [[load]]\nrod = \"a\"\nfrom = 0.0\nto = 0.5\nforce = [3.0, 1.0, -1.0]\ncouple = [0.2, 0.1, 0.3]\nfollows = true\n\
             [[load]]\nrod = \"b\"\nfrom = 0.0\nto = 0.5\nforce = {force:?}\ncouple = {couple:?}\nfollows = true\n\
             [[load]]\nrod = \"b\"\nfrom = 0.0\nto = 0.5\nforce = [-1.0, 0.5, -2.0]\ncouple = [0.3, 0.1, -0.2]\n\
             [[load]]\nrod = \"b\"\ns = {s}\nforce = {single:?}\nfollows = true\n"
        ));
        let found = assembly::equilibrium(&both).unwrap_or_else(|why| panic!("{why}"));
        let tip = &found.bodies[1].1;
        let off = (tip.translation.vector - alone.found.end.position).norm();
        assert!(off < 1e-8, "{ends}: off by {off:e}");
        let directors = tip.rotation.to_rotation_matrix();
        let turned = (directors.matrix() - alone.found.end.directors).norm();
        assert!(turned < 1e-8, "{ends}: turned by {turned:e}");
        let off = (found.rods[0].1 - alone.found.base).norm();
        assert!(off < 1e-7, "{ends}: base wrench off by {off:e}");
    }
}

/// Catches a critical pressure, an oval or an energy of the ring that is off: half a ring between guides in one
/// diameter. Critical pressures are n^2 - 1 (known); the oval at 3.5 and its numbers are those of a collocation of a
/// quarter by another code.
#[test]
fn a_ring_buckles_to_an_oval_under_pressure() {
    let text = include_str!("../../scenes/ring.toml");
    let alone = text.replace("switch = true", "switch = false");
    let found = followed(&alone.replace("to = 4.5", "to = 9.0"));
    let points = branch_points(&found);
    for (n, at) in [(2.0, 0), (3.0, 1)] {
        assert_close(points[at], n * n - 1.0, 1e-9, 0.0, "critical pressure");
    }
    let found = followed(text);
    let table = &found.branches.points;
    let [p, x, energy] = ["parameter", "x", "energy"].map(|name| table.reals(name));
    let (long, short) = (1.3085581436737, 0.49523512344667);
    let bending = 5.6880512621612;
    // The rest curvature 1 takes 2 pi from the energy of a straight one, and adds pi.
    let half = 0.5 * (bending - std::f64::consts::PI);
    let ovals: Vec<usize> = (0..p.len())
        .filter(|k| (p[*k] - 3.5).abs() < 1e-12 && energy[*k] > 0.1)
        .collect();
    assert_eq!(ovals.len(), 2, "{:?}", found.branches.curves);
    let mut axes: Vec<f64> = ovals.iter().map(|k| 0.5 * x[*k]).collect();
    axes.sort_by(f64::total_cmp);
    assert_close(axes[0], short, 1e-9, 0.0, "short half axis");
    assert_close(axes[1], long, 1e-9, 0.0, "long half axis");
    for k in ovals {
        assert_close(energy[k], half, 1e-9, 0.0, "energy");
    }
}

/// Catches a couple that a falling rod does not feel, or feels twice: a heavy planar rod with a dead couple at its end
/// falls to the equilibrium to which a path in the plane leads, and falls where no path does.
#[test]
fn a_heavy_planar_rod_falls_under_a_couple_at_its_end() {
    let rod = |weight: f64, path: &str| {
        solved(&format!(
            "{ROD}[clamp]\nrotation = {{ axis = [0, 1, 0], angle_degrees = 90 }}\n\
             [end]\ncouple = [0.0, -5.0, 0.0]\n[loads]\ndistributed = [0.0, 0.0, -{weight}]\n{path}"
        ))
    };
    let (fallen, led) = (rod(200.0, ""), rod(200.0, "[solve]\npath = \"planar\"\n"));
    let off = (fallen.found.end.position - led.found.end.position).norm();
    assert!(off < 1e-8, "off by {off:e}");
    assert_close(
        fallen.found.base[1],
        led.found.base[1],
        1e-7,
        0.0,
        "base couple",
    );
    let heavy = rod(3000.0, "");
    let end = &heavy.found.end;
    assert!(
        (end.couple - Vector3::new(0.0, -5.0, 0.0)).norm() < 1e-6,
        "{}",
        end.couple
    );
    // The couple lifts the end of the rod from the vertical.
    assert!(
        end.position.x > 0.01 && end.position.z < -0.9,
        "{}",
        end.position
    );
}
