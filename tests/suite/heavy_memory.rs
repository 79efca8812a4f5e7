//! Rods with mass and Maxwell branches: comparison with the closed form of a beam, the light rod with the same
//! branches, stiffer or more viscous rods, equivalent scenes, and the energy.

use crate::support::replaced;
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table, modes};

/// A bent planar rod with Maxwell branches relaxed in the straight shape, released under its weight.
const PLANE: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
damping = 0.02
relaxation = [{ stiffness = 0.7, time = 0.15 }, { stiffness = 0.3, time = 1.5 }]
mass = 0.2
inertia = "full"
[body]
mass = 1.0
[loads]
gravity = [0.0, -0.4]
[start]
curvature = [0.9, -0.9]
relaxed = false
[run]
duration = 0.4
tolerance = 1e-9
samples = 5
"#;

/// The planar rod in space, bent in a plane across e1, its body on a ball joint.
const SPACE: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.8 }
damping = { proportional = 0.02 }
relaxation = [{ stiffness = { proportional = 0.7 }, time = 0.15 }, { stiffness = { proportional = 0.3 }, time = 1.5 }]
mass = 0.2
inertia = "full"
section_inertia = [1e-9, 1e-9, 2e-9]
[body]
mass = 1.0
joint = "ball"
[loads]
gravity = [0.0, 0.4, 0.0]
[start]
strain = { u1 = [0.9, -0.9] }
relaxed = false
[run]
duration = 0.4
tolerance = 1e-9
samples = 5
"#;

fn ran(text: &str) -> (RunRecord, Table) {
    let scene = Scene::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    (record, tables.swap_remove(0))
}

/// Final value of a column.
fn last(table: &Table, name: &str) -> f64 {
    *table.reals(name).last().unwrap()
}

/// Final end position of a planar run.
fn end(text: &str) -> [f64; 2] {
    let (_, table) = ran(text);
    ["x", "y"].map(|name| last(&table, name))
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Catches a branch missing in small motions, a modulus or time in other units, an omitted creeping motion. A straight
/// clamped rod with a heavy end is in small motions a beam of modulus E(s) = 1 + eta s + E tau s/(1 + tau s). Let k
/// satisfy 1 + cosh k cos k + k/eps (cos k sinh k - sin k cosh k) = 0. The eigenvalues are then the roots of eps s^2 +
/// k^4 E(s) = 0.
#[test]
fn small_motions_are_those_of_a_beam_with_memory() {
    let straight = replaced(
        PLANE,
        &[
            ("gravity = [0.0, -0.4]", "gravity = [0.0, 0.0]"),
            ("curvature = [0.9, -0.9]\nrelaxed = false", "settled = true"),
            (", { stiffness = 0.3, time = 1.5 }", ""),
        ],
    );
    let (eta, modulus, tau, eps) = (0.02, 0.7, 0.15, 0.2);
    let found = modes::modes(&Scene::parse(&straight).unwrap()).unwrap();
    let found = found.motions.eigenvalues.unwrap();
    let held = |k: f64| {
        let free = 1.0 + k.cosh() * k.cos();
        free + k / eps * (k.cos() * k.sinh() - k.sin() * k.cosh())
    };
    for (from, to) in [(0.5, 2.0), (3.5, 4.5), (6.5, 7.5)] {
        let k = bisected(held, from, to);
        let stiffness = k.powi(4);
        // Characteristic equation: eps tau s^3 + (eps + k^4 eta tau) s^2 + k^4 (eta + tau + E tau) s + k^4 = 0.
        // The residual is taken at the program's s.
        let c = [
            stiffness,
            stiffness * (eta + tau + modulus * tau),
            eps + stiffness * eta * tau,
            eps * tau,
        ];
        let mut told = 0;
        for s in &found {
            let terms = [
                *s * 0.0 + c[0],
                *s * c[1],
                *s * *s * c[2],
                *s * *s * *s * c[3],
            ];
            let left = terms.iter().sum::<nalgebra::Complex<f64>>().norm();
            let size = terms.iter().map(|term| term.norm()).fold(0.0, f64::max);
            told += usize::from(left < 1e-7 * size);
        }
        let root = bisected(
            |s| c[0] + s * (c[1] + s * (c[2] + s * c[3])),
            -1.0 / tau,
            0.0,
        );
        let nearest = found.iter().map(|s| (*s - root).norm());
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-7 * root.abs(), "{root} {found:?}");
        assert!(told >= 2, "k = {k}: {found:?}");
    }
}

fn bisected(f: impl Fn(f64) -> f64, mut from: f64, mut to: f64) -> f64 {
    assert!(f(from) * f(to) < 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (from + to);
        if f(from) * f(middle) > 0.0 {
            from = middle
        } else {
            to = middle
        }
    }
    0.5 * (from + to)
}

/// The sum of energies is constant: body and rod, springs, losses of dashpots and friction; in the plane, in space,
/// and with the body in a groove, where the rod runs as an assembly. Catches a spring without energy, a wrong loss of
/// the dashpots, dashpots that do not follow.
#[test]
fn energy_is_kept_with_memory() {
    let grooved = replaced(
        SPACE,
        &[
            (
                "joint = \"ball\"",
                "inertia = [0.03, 0.02, 0.04]\ngroove = { circle = { centre = [0.5, 0.1, 0.9], axis = [0.3, 1.0, 0.2], radius = 0.5 } }",
            ),
            ("torsion = 0.8", "torsion = 0.8, axial = 90.0"),
            ("1e-9, 1e-9, 2e-9", "1e-3, 1e-3, 2e-3"),
            ("strain = { u1 = [0.9, -0.9] }", "settled = true"),
            ("duration = 0.4", "duration = 0.1"),
        ],
    );
    for text in [PLANE, SPACE, &grooved] {
        let (record, table) = ran(text);
        let error = &record.summary()["energy_error"]["absolute"];
        assert!(error.as_f64().unwrap().abs() < 1e-8, "{error}");
        assert!(last(&table, "dissipated") > 1e-3);
    }
}

/// The planar rod in space, with its softer axis across the plane, moves as in the plane. Catches branches of other
/// strains.
#[test]
fn a_planar_motion_in_space_remembers_alike() {
    let (_, table) = ran(SPACE);
    let space = ["z", "y"].map(|name| last(&table, name));
    let plane = end(PLANE);
    assert!(
        apart([space[0], -space[1]], plane) < 1e-7,
        "{space:?} {plane:?}"
    );
}

/// The rod of an assembly of one rod and one body moves, rings down and loses energy as the single rod. Catches a
/// branch omitted by an assembly, or assigned to another rod.
#[test]
fn the_rod_of_an_assembly_remembers_alike() {
    let kicked = replaced(
        SPACE,
        &[
            (
                "strain = { u1 = [0.9, -0.9] }\nrelaxed = false",
                "settled = true\nvelocity = [0.8, 0.5, 0.0]",
            ),
            ("1e-9, 1e-9, 2e-9", "1e-3, 1e-3, 2e-3"),
            ("gravity = [0.0, 0.4, 0.0]", "gravity = [0.0, 0.0, 0.0]"),
            (
                "torsion = 0.8 }\n",
                "torsion = 0.8 }\nrest = { curvature = [0.6, 0.2], twist = 0.5 }\n",
            ),
        ],
    );
    let several = replaced(
        &kicked,
        &[
            (
                "[rod]\n",
                "[[rod]]\nname = \"r\"\nfrom = { position = [0.0, 0.0, 0.0] }\nto = { body = \"b\", joint = \"ball\" }\n",
            ),
            (
                "[body]\n",
                "[[body]]\nname = \"b\"\nvelocity = [0.8, 0.5, 0.0]\n",
            ),
            ("joint = \"ball\"\n[loads]", "[loads]"),
            ("[start]\nsettled = true\nvelocity = [0.8, 0.5, 0.0]\n", ""),
        ],
    );
    let (_, single) = ran(&kicked);
    let scene = Scene::parse(&several).unwrap_or_else(|why| panic!("{why}\n{several}"));
    let prepared = Prepared::new(&scene).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    for (name, other) in [
        ("x", "b.x"),
        ("y", "b.y"),
        ("z", "b.z"),
        ("elastic", "elastic"),
        ("dissipated", "dissipated"),
    ] {
        let (a, b) = (last(&single, name), last(&tables[0], other));
        assert!((a - b).abs() < 1e-7 * (1.0 + a.abs()), "{name}: {a} {b}");
    }
    let all = [&kicked, &several].map(|text| {
        let found = modes::modes(&Scene::parse(text).unwrap()).unwrap();
        found.motions.eigenvalues.unwrap()
    });
    assert_eq!(all[0].len(), all[1].len());
    let pairs = all[0].iter().zip(&all[1]);
    let swinging: Vec<_> = pairs.filter(|(a, _)| a.im > 0.0).collect();
    assert!(!swinging.is_empty(), "{:?}", all[0]);
    for (a, b) in swinging {
        assert!((a - b).norm() < 1e-6 * a.norm(), "{a} {b}");
    }
}

/// Straight rods with mass along z, stacked between two grounds, with bodies between them.
fn column(rods: usize, own: &str) -> String {
    let site = |k: usize| match k {
        k if k == rods => format!("{{ position = [0.0, 0.0, {k}.0] }}"),
        0 => "{}".to_owned(),
        k => format!("{{ body = \"b{k}\" }}"),
    };
    let each = (0..rods).map(|k| {
        format!(
            "[[rod]]\nname = \"r{k}\"\nmodel = \"cosserat\"\nlength = 1.0\nmass = 0.15\ninertia = \"full\"\n\
             section_inertia = [1e-3, 1e-3, 2e-3]\nfrom = {}\nto = {}\n{own}",
            site(k),
            site(k + 1)
        )
    });
    let bodies = (1..rods)
        .map(|k| format!("[[body]]\nname = \"b{k}\"\nmass = 1.0\ninertia = [0.05, 0.07, 0.04]\n"));
    let all: String = each.chain(bodies).collect();
    format!("{all}[run]\nduration = 0.1\n")
}

/// Two straight rods whose friction and memory are in proportion to their stiffness: every undamped vibration gives
/// s^2 + omega^2 (1 + eta s + E tau s/(1 + tau s)) = 0, all three roots. Catches a branch on the rows of another rod,
/// and the multiple eigenvalues of unloaded dashpots, on which the eigenvalue search stalls.
#[test]
fn rods_of_an_assembly_ring_down_with_their_memory() {
    let (eta, modulus, tau) = (0.02, 0.7, 0.15);
    let own = format!(
        "damping = {{ proportional = {eta} }}\nrelaxation = [{{ stiffness = {{ proportional = {modulus} }}, time = {tau} }}]\n\
         section = {{ bending = [1.0, 1.3], torsion = 0.8, axial = 90.0 }}\n"
    );
    let found = modes::modes(&Scene::parse(&column(2, &own)).unwrap()).unwrap();
    let motions = found.motions;
    let eigenvalues = motions.eigenvalues.unwrap();
    // Self-stress of the loop relaxes at this rate, without motion.
    let still = |s: &nalgebra::Complex<f64>| (s * tau + 1.0).norm() < 1e-9;
    assert!(!eigenvalues.iter().any(still), "{eigenvalues:?}");
    for mode in &motions.modes[..4] {
        let square = mode.angular_frequency.powi(2);
        let cubic = |s: nalgebra::Complex<f64>| {
            let terms = [
                s * s * (1.0 + s * tau),
                (1.0 + s * tau) * (1.0 + s * eta) * square,
                s * (modulus * tau * square),
            ];
            let size = terms.iter().map(|term| term.norm()).fold(0.0, f64::max);
            terms.iter().sum::<nalgebra::Complex<f64>>().norm() / size
        };
        let roots = eigenvalues.iter().filter(|s| cubic(**s) < 1e-8);
        let turns = roots.map(|s| if s.im > 0.0 { 2 } else { 1 });
        assert_eq!(turns.sum::<usize>(), 3, "{square}: {eigenvalues:?}");
    }
}

/// Three rods of six strains have too many coordinates for refinement, so the grid is compared with a coarser one.
/// Catches a change reported as infinite. Two bodies twist on the rods, in phase or in antiphase: 2 k cot k - J
/// omega^2/GJ = +-k/sin k.
#[test]
fn many_rods_are_held_against_a_coarser_grid() {
    let own =
        "section = { bending = [1.0, 1.6], torsion = 0.9, shear = [40.0, 50.0], axial = 90.0 }\n";
    let found = modes::modes(&Scene::parse(&column(3, own)).unwrap()).unwrap();
    assert!(found.remarks.is_empty(), "{:?}", found.remarks);
    let motions = found.motions;
    assert!(motions.change < 1e-6, "{}", motions.change);
    let (stiffness, body, rod) = (0.9, 0.04, 2e-3_f64);
    let speed = (stiffness / rod).sqrt();
    for sign in [1.0, -1.0] {
        let twist = |omega: f64| {
            let k = omega / speed;
            2.0 * k / k.tan() - body * omega * omega / stiffness - sign * k / k.sin()
        };
        let wanted = bisected(twist, 1.0, 12.0);
        let all = motions.modes.iter().map(|mode| mode.angular_frequency);
        let off = all
            .map(|omega| (omega / wanted - 1.0).abs())
            .fold(f64::INFINITY, f64::min);
        assert!(off < 1e-9, "{wanted}: {off:e}");
    }
}

/// Limit of vanishing mass: the rod tends to the light one with the same branches, with an error of first power of the
/// mass. Catches wrong initial dashpots, or a resultant of a branch that differs from the light rod's.
#[test]
fn the_light_rod_with_memory_is_the_limit() {
    let light = PLANE.replace("mass = 0.2\ninertia = \"full\"\n", "");
    let calm = |text: &str| replaced(text, &[("gravity = [0.0, -0.4]", "dead = [0.0, -0.4]")]);
    let limit = end(&calm(&light));
    let errors = [0.01, 0.005, 0.0025].map(|mass: f64| {
        let mass = format!("mass = {mass}\ninertia");
        apart(
            end(&calm(&replaced(PLANE, &[("mass = 0.2\ninertia", &mass)]))),
            limit,
        )
    });
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((0.8..1.2).contains(&order), "{errors:?}");
    }
}

/// Very fast dashpots have no effect; very slow ones give springs (1 + E) about the relaxed shape, with errors of the
/// first power of tau and of 1/tau. Catches an interchanged time, a spring without its rest.
#[test]
fn fast_branches_rub_and_slow_ones_are_springs() {
    let both = "relaxation = [{ stiffness = 0.7, time = 0.15 }, { stiffness = 0.3, time = 1.5 }]\n";
    let one = |time: f64| {
        let branch = format!("relaxation = [{{ stiffness = 0.7, time = {time:e} }}]\n");
        end(&replaced(
            PLANE,
            &[
                (both, &branch),
                ("relaxed = false", "relaxed = true"),
                ("curvature = [0.9, -0.9]", "curvature = [0.0]"),
            ],
        ))
    };
    let plain = |stiffness: &str| {
        let stiffness = format!("bending_stiffness = {stiffness}");
        end(&replaced(
            PLANE,
            &[
                (both, ""),
                ("bending_stiffness = 1.0", &stiffness),
                ("relaxed = false\n", ""),
                ("curvature = [0.9, -0.9]", "curvature = [0.0]"),
            ],
        ))
    };
    for (times, other) in [([1e3, 2e3], plain("1.7")), ([2e-4, 1e-4], plain("1.0"))] {
        let errors = times.map(|time| apart(one(time), other));
        let order = (errors[0] / errors[1]).log2();
        assert!((0.9..1.1).contains(&order), "{times:?}: {errors:?}");
    }
}
