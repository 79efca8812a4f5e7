//! Loads that turn with light rods in motion, couples along them, and laws in time of rods with friction.

use crate::support::{replaced, worst};
use nalgebra::{DMatrix, SVector, Vector3};
use snaprod::error::Result;
use snaprod::rod::{DistributedLoad, LoadsWithoutPotential};
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table, modes};
use snaprod::viscoelastic::grid::Grid;
use snaprod::viscoelastic::kinematics::Kinematics;
use snaprod::viscoelastic::loads_at_nodes::LoadsAtNodes;
use snaprod::viscoelastic::space::Space;

fn ran(text: &str) -> Table {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}"));
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::default(), &mut tables, &mut Silent).expect(text);
    assert_eq!(record.reason(), None, "{text}");
    tables.remove(0)
}

fn last(table: &Table, names: &[&str]) -> Vec<f64> {
    let last = |name: &&str| *table.reals(name).last().expect("a row");
    names.iter().map(last).collect()
}

/// Largest change of the total energy, work and losses counted.
fn opened(table: &Table) -> f64 {
    let total = table.reals("total");
    worst(total.iter().map(|x| (x - total[0]).abs()))
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    worst(a.iter().zip(b).map(|(a, b)| (a - b).abs()))
}

/// A planar rod with a point mass under loads that turn with it: along a part, at a station, at its end.
const PLANAR: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
position = [0.75, 0.6]
sheet = { mode = 0, sign = "+" }
velocity = [-0.4, 0.1]
[loads]
gravity = [-0.3, 1.6]
[[load]]
from = 0.2
to = 0.7
force = [0.4, 1.1]
follows = true
[[load]]
s = 0.5
force = [-0.3, 0.6]
follows = true
[[load]]
on = "end"
force = [-1.5, 0.2]
follows = true
[run]
duration = 0.8
tolerance = 1e-10
samples = 5
"#;

/// Catches a load that does not turn with its section, acts at a wrong place or along a wrong director, and a power
/// that is not that of the load: the ledger is then open. Numbers: tools/ref_turning_motion.py.
#[test]
fn a_planar_rod_moves_under_loads_that_turn_with_it() {
    let table = ran(PLANAR);
    let found = last(&table, &["x", "y", "vx", "vy"]);
    let wanted = [
        0.712943589326,
        0.619320025019,
        0.302058187332,
        -0.092041245724,
    ];
    assert!(apart(&found, &wanted) < 1e-8, "{found:?}");
    assert!(opened(&table) < 1e-9, "{:?}", table.reals("total"));
    assert!(last(&table, &["work"])[0].abs() > 1e-3);
    // The scene as it is written beside a run is read again.
    let scene = Scene::parse(PLANAR).unwrap_or_else(|faults| panic!("{faults}"));
    let written = toml::to_string(&scene).expect("a scene");
    let again = Scene::parse(&written).unwrap_or_else(|faults| panic!("{faults}\n{written}"));
    assert_eq!(again.rod.loads, scene.rod.loads);
}

/// Two rods in a chain with bodies, under loads of every kind; the base of the first moves.
const CHAIN: &str = r#"
[[rod]]
name = "a"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.8, shear = "rigid", axial = 40.0 }
from = { position = [0.0, 0.0, 0.0], motion = { translate = { direction = [0.3, 0.5, 0.1], amplitude = 0.2, frequency = 0.3 }, turn = { axis = [1.0, 1.0, 0.0], amplitude = 0.3, frequency = 0.2 } } }
to = { body = "A" }
[[rod]]
name = "b"
model = "cosserat"
length = 0.8
section = { bending = [0.7, 0.7], torsion = 0.5, shear = [30.0, 25.0], axial = 40.0 }
from = { body = "A" }
to = { body = "B" }
[[body]]
name = "A"
mass = 1.0
inertia = [0.1, 0.12, 0.15]
[[body]]
name = "B"
mass = 0.5
inertia = [0.04, 0.05, 0.06]
angular_velocity = [0.3, -0.2, 0.5]
[loads]
gravity = [0.3, 0.0, -0.6]
[[load]]
rod = "a"
from = 0.2
to = 0.9
force = [0.7, 0.3, 0.1]
couple = [0.1, 0.2, -0.2]
follows = true
[[load]]
rod = "b"
from = 0.1
to = 0.8
force = [0.9, -0.5, -0.3]
follows = true
[[load]]
rod = "b"
s = 0.3
couple = [0.1, 0.3, 0.2]
[[load]]
rod = "b"
s = 0.5
force = [0.1, 0.3, 0.2]
[run]
duration = 1.0
tolerance = 1e-9
samples = 5
method = "explicit"
"#;

/// Catches a power that leaves out the turn or the velocity of a rod's base, and a derivative of wrenches that implicit
/// steps have wrong.
#[test]
fn the_ledger_of_a_chain_under_turning_loads_closes() {
    let names = ["A.x", "A.y", "A.z", "B.x", "B.y", "B.z", "B.vx", "B.wz"];
    let explicit = ran(CHAIN);
    assert!(opened(&explicit) < 1e-8, "{:?}", explicit.reals("total"));
    assert!(last(&explicit, &["work"])[0].abs() > 1e-2);
    let implicit = ran(&replaced(CHAIN, &[("\"explicit\"", "\"implicit\"")]));
    assert!(opened(&implicit) < 1e-8, "{:?}", implicit.reals("total"));
    let [a, b] = [&explicit, &implicit].map(|table| last(table, &names));
    assert!(apart(&a, &b) < 1e-8, "{a:?} {b:?}");
}

/// Catches modes that leave a turning load out. A thrust P acts along the end of a rod that bears a point mass. The
/// stiffness across is B/L^3 k^3/(sin k - k cos k) with k^2 = P L^2/B.
#[test]
fn a_thrust_along_the_end_changes_the_frequency() {
    let text = |thrust: f64| {
        format!(
            "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n\
             [start]\nsettled = true\n[[load]]\non = \"end\"\nfollows = true\nforce = [{}, 1e-9]\n[run]\nduration = 1.0\n",
            -thrust
        )
    };
    for thrust in [2.0_f64, 10.0] {
        let scene = Scene::parse(&text(thrust)).unwrap_or_else(|faults| panic!("{faults}"));
        let found = modes(&scene).unwrap_or_else(|why| panic!("{why}"));
        let all = found.motions.eigenvalues.expect("eigenvalues");
        let k = thrust.sqrt();
        let wanted = (k.powi(3) / (k.sin() - k * k.cos())).sqrt();
        let off = all.iter().map(|s| (s.im - wanted).abs());
        let near = off.fold(f64::INFINITY, f64::min);
        assert!(near < 1e-6 * wanted, "{thrust}: {wanted} {all:?}");
    }
}

/// Catches a shape that leaves the loads along the rod out: a station at the end of the rod is then not at the body.
#[test]
fn stations_lie_on_the_rod_under_its_loads() {
    let text = format!("{PLANAR}[[station]]\nname = \"tip\"\ns = 1.0\n");
    let table = ran(&replaced(&text, &[("duration = 0.8", "duration = 0.1")]));
    let [body, tip] = [["x", "y"], ["tip.x", "tip.y"]].map(|names| last(&table, &names));
    assert!(apart(&body, &tip) < 1e-9, "{body:?} {tip:?}");
    let [body, tip] = [["vx", "vy"], ["tip.vx", "tip.vy"]].map(|names| last(&table, &names));
    assert!(apart(&body, &tip) < 1e-6, "{body:?} {tip:?}");
}

/// A rod with friction and a body, under loads that turn with the sections of the rod.
const RUBBED: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.8, shear = "rigid", axial = 40.0 }
damping = { proportional = 0.02 }
[body]
mass = 1.0
inertia = [0.1, 0.12, 0.15]
[start]
settled = true
velocity = [0.2, -0.3, 0.1]
angular_velocity = [0.3, 0.2, 0.5]
[loads]
gravity = [0.3, 0.0, -0.6]
[[load]]
from = 0.2
to = 0.9
force = [0.7, 0.3, 0.1]
couple = [0.1, 0.2, -0.2]
follows = true
[[load]]
from = 0.0
to = 0.3
couple = [0.3, 0.9, 0.6]
[run]
duration = 1.0
tolerance = 1e-8
samples = 5
"#;

/// Catches work of loads on a rod with friction that is not theirs, and loads that differ from those on an elastic rod:
/// the motion comes to that of the elastic rod as the friction vanishes, in proportion to it.
#[test]
fn a_rod_with_friction_bears_loads_that_turn_with_it() {
    let names = ["x", "y", "z", "vx", "vy", "vz"];
    let table = ran(RUBBED);
    assert!(opened(&table) < 1e-7, "{:?}", table.reals("total"));
    assert!(last(&table, &["work"])[0].abs() > 1e-3);
    let elastic = ran(&replaced(
        RUBBED,
        &[("damping = { proportional = 0.02 }\n", "")],
    ));
    let elastic = last(&elastic, &names);
    let off = [2e-4, 1e-4].map(|friction| {
        let text = replaced(RUBBED, &[("0.02", &format!("{friction:e}"))]);
        apart(&last(&ran(&text), &names), &elastic)
    });
    assert!(off[1] < 1e-3, "{off:?}");
    assert!((off[0] / off[1] - 2.0).abs() < 0.05, "{off:?}");
}

/// Catches a wrong term of the derivatives that implicit steps need, against differences of order 4.
#[test]
fn resultants_of_turning_loads_have_exact_derivatives() -> Result<()> {
    let grid = Grid::new(&[0.4], &[9, 10]);
    let space = Space::<6, 6>::new();
    let load = |a: f64| {
        DistributedLoad::polynomial(vec![Vector3::new(a, 1.0, -0.5), Vector3::new(0.3, -a, 0.7)])
    };
    let loads = LoadsWithoutPotential {
        follower_force: load(0.8)?,
        couple: load(-0.4)?,
        follower_couple: load(0.2)?,
    };
    let nodes = LoadsAtNodes::new(None, Some(&loads), grid.nodes())
        .expect("a load")
        .turning;
    let strains: Vec<SVector<f64, 6>> = grid
        .nodes()
        .iter()
        .map(|s| SVector::from([0.5 + s, -0.4 * s, 0.8, 0.1 * s, -0.05, 1.0 + 0.1 * s * s]))
        .collect();
    let resultants = |strains: &[SVector<f64, 6>]| {
        let shape = space.shape(&grid, strains).expect("a shape");
        space.turned(&grid, &shape, &nodes)
    };
    let n = 6 * grid.len();
    let mut exact = DMatrix::zeros(n, n);
    let shape = space.shape(&grid, &strains).expect("a shape");
    space.turned_stiffness(&grid, &shape, &nodes, &mut exact);
    // A smooth change of the strains: the exact derivatives are those of smooth strains.
    let change: Vec<SVector<f64, 6>> = grid
        .nodes()
        .iter()
        .map(|s| SVector::from([s.cos(), 0.3 - s, s * s, 0.2, 0.5 * s, -0.4]))
        .collect();
    let at = |h: f64| {
        let moved = strains.iter().zip(&change).map(|(e, de)| e + de * h);
        resultants(&moved.collect::<Vec<_>>())
    };
    let h = 1e-3;
    let [far_back, back, ahead, far] = [-2.0 * h, -h, h, 2.0 * h].map(at);
    for i in 0..grid.len() {
        let by_difference = (8.0 * (ahead[i] - back[i]) - (far[i] - far_back[i])) / (12.0 * h);
        let mut by = SVector::<f64, 6>::zeros();
        for (j, de) in change.iter().enumerate() {
            by += exact.fixed_view::<6, 6>(6 * i, 6 * j) * de;
        }
        assert!(
            (by - by_difference).norm() < 1e-8,
            "{i}: {by} {by_difference}"
        );
    }
    Ok(())
}

/// A muscle that curls a rod with friction, without weight and with next to no mass at its end.
const CURL: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.5], torsion = 0.8 }
damping = { proportional = 0.3 }
[rod.drive]
curvature = [1.0, 0.0]
amplitude = { ramp = { to = 6.283185307179586, until = 2.0 } }
[body]
mass = 1e-9
joint = "ball"
[start]
rest = "straight"
[run]
duration = 1.0
tolerance = 1e-8
samples = 5
"#;

/// Catches a law of a wrong time, and a work of the drive that is not the integral of W_t. With nothing at its end the
/// curvature u follows the muscle's a t by u' = (a t - u)/tau: u = a (t - tau (1 - exp(-t/tau))).
#[test]
fn a_muscle_curls_a_rod_with_friction() {
    let table = ran(CURL);
    let (a, tau, t) = (std::f64::consts::PI, 0.3_f64, 1.0_f64);
    let decayed = (-t / tau).exp();
    let lag = a * tau * (1.0 - decayed);
    let u = a * t - lag;
    let found = last(&table, &["x", "y", "z", "work", "dissipated", "elastic"]);
    // Bending about d1 = x turns the tangent from z to -y.
    let wanted = [0.0, -(1.0 - u.cos()) / u, u.sin() / u];
    assert!(apart(&found[..3], &wanted) < 1e-6, "{found:?} {wanted:?}");
    // W_t = -(u - a t) a, and the loss tau u'^2 with u' = lag/tau.
    let work = a * a * tau * (t - tau * (1.0 - decayed));
    let loss =
        a * a * tau * (t - 2.0 * tau * (1.0 - decayed) + 0.5 * tau * (1.0 - decayed * decayed));
    let energies = [work, loss, 0.5 * lag * lag];
    assert!(
        apart(&found[3..], &energies) < 1e-6,
        "{found:?} {energies:?}"
    );
    assert!(opened(&table) < 1e-7);
}

/// A tension that swings on a rod with friction. Catches a power of the law that the ledger of implicit or explicit
/// steps counts twice or not at all. Catches a motion that is not near the motion of the elastic rod.
#[test]
fn a_tension_in_time_pulls_a_rod_with_friction() {
    let text = |damping: &str, method: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.5], torsion = 0.8 }}\n{damping}\n\
             [[rod.tendon]]\noffset = [0.03, 0.05]\ntension = {{ mean = 1.5, amplitude = 1.5, frequency = 1.1 }}\n\
             [body]\nmass = 1.0\ninertia = [0.02, 0.02, 0.02]\n[loads]\ngravity = [0.0, 0.3, -0.6]\n\
             [start]\nsettled = true\n[run]\nduration = 0.4\ntolerance = 1e-8\nsamples = 5\nmethod = \"{method}\"\n"
        )
    };
    let names = ["x", "y", "z"];
    let ends = ["explicit", "implicit"].map(|method| {
        let table = ran(&text("damping = { proportional = 0.01 }", method));
        assert!(
            opened(&table) < 1e-7,
            "{method}: {:?}",
            table.reals("total")
        );
        last(&table, &names)
    });
    assert!(apart(&ends[0], &ends[1]) < 1e-7, "{ends:?}");
    let elastic = last(&ran(&text("", "auto")), &names);
    let off = [2e-4, 1e-4].map(|friction| {
        let damping = format!("damping = {{ proportional = {friction:e} }}");
        apart(&last(&ran(&text(&damping, "auto")), &names), &elastic)
    });
    assert!(
        off[1] < 1e-3 && (off[0] / off[1] - 2.0).abs() < 0.1,
        "{off:?}"
    );
}

/// Catches a refusal without a way out: what light rods do not bear is named.
#[test]
fn what_no_motion_follows_is_refused_by_name() {
    let fault = |text: &str| Scene::parse(text).expect_err(text).to_string();
    let heavy = "bending_stiffness = 1.0\nmass = 0.1\ninertia = \"full\"";
    let heavy = fault(&replaced(PLANAR, &[("bending_stiffness = 1.0", heavy)]));
    assert!(heavy.contains("write model = \"cosserat\""), "{heavy}");
    let first = "mass = 0.01\ninertia = \"first-order\"";
    let first = fault(&replaced(
        RUBBED,
        &[("damping = { proportional = 0.02 }", first)],
    ));
    assert!(first.contains("turns with the rod"), "{first}");
}
