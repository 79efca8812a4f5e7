//! Extreme scenes: units, tolerances, positions and loads at the ends of their ranges, and the effect of the last bit.

use crate::stress_scenes::judged;
use crate::support::worst;
use nalgebra::{Vector2, Vector6};
use snaprod::elastica::{Elastica, Equilibrium, equilibria_at, fold_at};
use snaprod::manifold::EquilibriumManifold;
use snaprod::math::elliptic::complete;
use snaprod::rod::Rod;
use snaprod::scene::Scene;
use snaprod::section::Linear;
use snaprod::study::run::Fields;
use snaprod::study::{Silent, Table, dispatch};
use std::time::Duration;

/// Units of a scene: length, stiffness and mass, each a power of two, and the resulting time.
#[derive(Clone, Copy)]
struct Units([i32; 3]);

impl Units {
    fn of(self, powers: [i32; 3]) -> f64 {
        let sum: i32 = self
            .0
            .iter()
            .zip(powers)
            .map(|(unit, power)| unit * power)
            .sum();
        2f64.powi(sum / 2)
    }

    /// A number of dimension length^a stiffness^b mass^c as TOML, the powers being doubled: a time has 3/2, -1/2, 1/2.
    fn say(self, number: f64, powers: [i32; 3]) -> String {
        format!("{:e}", number * self.of(powers))
    }
}

const LENGTH: [i32; 3] = [2, 0, 0];
const STIFFNESS: [i32; 3] = [0, 2, 0];
const MASS: [i32; 3] = [0, 0, 2];
const TIME: [i32; 3] = [3, -1, 1];
const SPEED: [i32; 3] = [-1, 1, -1];
const ACCELERATION: [i32; 3] = [-4, 2, -2];
const FORCE: [i32; 3] = [-4, 2, 0];
const ENERGY: [i32; 3] = [-2, 2, 0];
const INERTIA: [i32; 3] = [4, 0, 2];

/// A motion of every kind, including snaps, friction and mass, in the given units.
fn motions(u: Units, tolerance: &str) -> Vec<(&'static str, String)> {
    let [length, stiffness, mass] = [LENGTH, STIFFNESS, MASS].map(|unit| u.say(1.0, unit));
    let plane = format!(
        "[rod]\nmodel = \"elastica\"\nlength = {length}\nbending_stiffness = {stiffness}\n"
    );
    let flow = u.say(0.05, TIME);
    let section = format!(
        "section = {{ bending = [{stiffness}, {}], torsion = {}, axial = {} }}\n",
        u.say(1.3, STIFFNESS),
        u.say(0.7, STIFFNESS),
        u.say(900.0, FORCE)
    );
    let space = format!("[rod]\nmodel = \"cosserat\"\nlength = {length}\n{section}");
    let body = format!("[body]\nmass = {mass}\n");
    let weld = {
        let arm = u.say(0.02, INERTIA);
        format!("{body}inertia = [{arm}, {arm}, {}]\n", u.say(0.03, INERTIA))
    };
    let heavy = format!("mass = {}\ninertia = \"full\"\n", u.say(0.1, MASS));
    let friction = format!("damping = {{ proportional = {flow} }}\n");
    let bent = format!(
        "rest = {{ curvature = [{}, 0.0], twist = 0.0 }}\n",
        u.say(0.6, [-2, 0, 0])
    );
    let run = |t: f64| {
        let duration = u.say(t, TIME);
        format!("[run]\nduration = {duration}\ntolerance = {tolerance}\nsamples = 21\n")
    };
    let speed = |v: [f64; 3]| v.map(|v| u.say(v, SPEED));
    let [vx, vy, vz] = speed([0.3, -0.5, 0.2]);
    let pull = u.say(-2.0, ACCELERATION);
    let start = format!("[start]\nlambda = 6.3\nkappa = 0.6\nvelocity = [0.0, {vy}]\n");
    let arc = "[start]\nlambda = 2.0\nkappa = 0.7\n";
    let thrown = format!(
        "[start]\nvelocity = [{vx}, {vy}, {vz}]\n[loads]\ngravity = [{pull}, 0.0, {pull}]\n"
    );
    let pair = {
        let turned = "quaternion = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]";
        let back = "quaternion = [0.7071067811865476, 0.0, -0.7071067811865476, 0.0]";
        let rod = |name: &str, place: f64, turn: &str| {
            let place = u.say(place, LENGTH);
            format!(
                "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = {length}\n{section}from = {{ position = [{place}, 0.0, 0.0], {turn} }}\n\
                 to = {{ body = \"m\", joint = \"ball\" }}\n"
            )
        };
        format!(
            "{}{}[[body]]\nname = \"m\"\nmass = {mass}\nguess = {{ position = [{}, 0.0, {}] }}\nvelocity = [{vx}, {vy}, {vz}]\n",
            rod("left", 0.0, turned),
            rod("right", 1.8, back),
            u.say(0.9, LENGTH),
            u.say(0.3, LENGTH)
        )
    };
    let bar = format!(
        "[rod]\nmodel = \"bar\"\nlength = {}\narea = {}\ndensity = {}\nlaw = {{ mooney = [{}, {}] }}\ncells = 12\n\
         [loads]\nforce = {{ block = {{ size = {}, until = {} }} }}\n",
        u.say(3.0, LENGTH),
        u.say(0.03, [4, 0, 0]),
        u.say(0.4, [-6, 0, 2]),
        u.say(24.0, [-8, 2, 0]),
        u.say(1.5, [-8, 2, 0]),
        u.say(0.2, FORCE),
        u.say(0.1, TIME),
    );
    vec![
        ("a snap", format!("{plane}{body}{start}{}", run(0.05))),
        ("creep", format!("{plane}{friction}{body}{arc}{}", run(0.3))),
        (
            "a heavy strip",
            format!("{plane}{heavy}{friction}{body}{arc}{}", run(0.2)),
        ),
        ("space", format!("{space}{bent}{weld}{thrown}{}", run(0.2))),
        (
            "creep in space",
            format!("{space}{bent}{friction}{weld}{thrown}{}", run(0.2)),
        ),
        (
            "a heavy rod",
            format!("{space}{bent}{heavy}{friction}{weld}{thrown}{}", run(0.1)),
        ),
        ("a pair", format!("{pair}{}", run(0.2))),
        (
            "a bar",
            format!(
                "{bar}[run]\nduration = {}\nsamples = 11\n",
                u.say(0.3, TIME)
            ),
        ),
    ]
}

/// Columns of a trajectory, with their dimensions.
const COLUMNS: [(&str, [i32; 3]); 12] = [
    ("t", TIME),
    ("x", LENGTH),
    ("y", LENGTH),
    ("z", LENGTH),
    ("vx", SPEED),
    ("vy", SPEED),
    ("vz", SPEED),
    ("kinetic", ENERGY),
    ("elastic", ENERGY),
    ("potential", ENERGY),
    ("dissipated", ENERGY),
    ("total", ENERGY),
];

/// A column of a trajectory without its unit.
type Track = (String, Vec<f64>);

/// The columns of a motion without their units, including those of named bodies, and the outcome.
fn moved(text: &str, u: Units) -> (Vec<Track>, String) {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    let found = dispatch::motion(&scene, Fields::None, &mut tables, &mut Silent)
        .unwrap_or_else(|why| panic!("{why}\n{text}"));
    let tracks = tables[0].columns.iter().filter_map(|column| {
        let plain = column.name.rsplit('.').next()?;
        let (_, powers) = COLUMNS.iter().find(|(name, _)| *name == plain)?;
        let numbers = tables[0].reals(&column.name).iter();
        Some((
            column.name.to_string(),
            numbers.map(|x| x / u.of(*powers)).collect(),
        ))
    });
    (tracks.collect(), found.summary["outcome"].to_string())
}

/// The greatest difference of two motions over the greatest number of its column.
fn apart(one: &[Track], other: &[Track]) -> f64 {
    assert!(one.len() == other.len() && one.len() > 3);
    let mut most = 0.0_f64;
    for ((name, a), (_, b)) in one.iter().zip(other) {
        assert_eq!(a.len(), b.len(), "{name}");
        let largest = a.iter().fold(1e-3_f64, |most, x| most.max(x.abs()));
        for (x, y) in a.iter().zip(b) {
            assert!((x - y).is_finite(), "{name}: {x} {y}");
            most = most.max((x - y).abs() / largest);
        }
    }
    most
}

/// A derived number, and the relative size of the input changes for its slope: small compared with the distance from a
/// fold.
struct Question {
    name: &'static str,
    at: Vec<f64>,
    stride: f64,
    answer: Answer,
}

type Answer = Box<dyn Fn(&[f64]) -> f64>;

impl Question {
    fn new(
        name: &'static str,
        at: &[f64],
        stride: f64,
        answer: impl Fn(&[f64]) -> f64 + 'static,
    ) -> Self {
        Self {
            name,
            at: at.to_vec(),
            stride,
            answer: Box::new(answer),
        }
    }

    /// Condition number (relative change of the answer over that of the inputs): by differences, and by changes in the
    /// last bits.
    fn condition(&self) -> (f64, f64) {
        let answer = (self.answer)(&self.at);
        let moved = |k: usize, by: f64| {
            let mut at = self.at.clone();
            at[k] *= 1.0 + by;
            let taken = at[k] / self.at[k] - 1.0;
            ((self.answer)(&at) - answer) / answer / taken
        };
        let (mut slope, mut bits) = (0.0_f64, 0.0_f64);
        for k in 0..self.at.len() {
            slope += 0.5 * (moved(k, self.stride) + moved(k, -self.stride)).abs();
            for last in [-2.0, -1.0, 1.0, 2.0] {
                let off = moved(k, last * f64::EPSILON).abs();
                assert!(off.is_finite(), "{}", self.name);
                bits = bits.max(off * f64::abs(last));
            }
        }
        (slope, bits)
    }
}

/// A column of a motion at its end, from one of the start's velocities.
fn of_motion(name: &'static str, speed: &'static str, column: &'static str) -> Question {
    let home = Units([0; 3]);
    let mut all = motions(home, "1e-11").into_iter();
    let (_, text) = all.find(|(of, _)| *of == name).unwrap();
    Question::new(name, &[speed.parse().unwrap()], 1e-6, move |x| {
        let (tracks, _) = moved(&text.replace(speed, &format!("{:e}", x[0])), home);
        let track = tracks.iter().find(|(of, _)| of == column).unwrap();
        *track.1.last().unwrap()
    })
}

fn questions() -> Vec<Question> {
    let nearest = |load: f64| {
        move |x: &[f64]| {
            let all = equilibria_at(x[0], x[1], 14.0).unwrap().into_iter();
            let loads = all.map(|found| found.equilibrium.lambda);
            loads
                .min_by(|a, b| (a - load).abs().total_cmp(&(b - load).abs()))
                .unwrap()
        }
    };
    let beside = |name, off: f64| {
        let fold = fold_at(1, -1.2).unwrap().equilibrium;
        let q = Vector2::new(fold.p, fold.w - off);
        let pose = Elastica.point(&q).unwrap().pose;
        Question::new(
            name,
            pose.as_slice(),
            1e-3 * off * off,
            nearest(Equilibrium::new(q.x, q.y).unwrap().lambda),
        )
    };
    let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 0.7).unwrap()).unwrap();
    let pulled = |name, load: f64| {
        let rod = rod.clone();
        Question::new(name, &[1e-3, load * load], 1e-7, move |x| {
            let base = Vector6::new(0.0, x[0], 0.0, 0.0, 0.0, x[1]);
            rod.end(&base, 1e-13).unwrap().section.position.x
        })
    };
    vec![
        Question::new("K at kc = 1e-3", &[1e-3], 1e-6, |x| {
            complete(x[0]).unwrap().k
        }),
        Question::new(
            "load of a rod held at (0.5, -0.35)",
            &[0.5, -0.35],
            1e-7,
            nearest(2.0),
        ),
        beside("the same, 1e-2 in the chart from a fold", 1e-2),
        beside("the same, 1e-4 from it", 1e-4),
        Question::new(
            "the same at (1 - 1e-6, 1e-3)",
            &[1.0 - 1e-6, 1e-3],
            1e-9,
            nearest(1.0),
        ),
        pulled(
            "end of a rod pulled with lambda = 2, from its base wrench",
            2.0,
        ),
        pulled("the same with lambda = 12", 12.0),
        of_motion("a snap", "-5e-1", "x"),
        of_motion("creep in space", "3e-1", "x"),
        of_motion("space", "3e-1", "x"),
        of_motion("a pair", "3e-1", "m.x"),
    ]
}

/// Catches a length, time or force of fixed size instead of one in the scene's units. Masses and stiffnesses over 40
/// decades are powers of two, which cause no rounding, so the motion is the same to the last bit.
#[test]
fn masses_and_stiffnesses_over_forty_decades_are_units() {
    let home = Units([0; 3]);
    let far = [
        Units([0, 0, 68]),
        Units([0, -68, 0]),
        Units([8, 68, -68]),
        Units([-8, -68, 68]),
    ];
    let told = far.map(|u| motions(u, "1e-8"));
    for (k, (name, text)) in motions(home, "1e-8").into_iter().enumerate() {
        let want = moved(&text, home);
        // A rod with mass takes a third of a second.
        let often = if name == "a heavy rod" { 1 } else { far.len() };
        for (u, told) in far.into_iter().zip(&told).take(often) {
            let found = moved(&told[k].1, u);
            assert_eq!(found.1, want.1, "{name} in {:?}", u.0);
            assert_eq!(apart(&want.0, &found.0), 0.0, "{name} in {:?}", u.0);
        }
    }
}

/// Catches steps that stall or explode in number at the finest admissible tolerance, and a finest tolerance without
/// gain in accuracy.
#[test]
fn the_finest_tolerances_are_kept() {
    let home = Units([0; 3]);
    for (name, finest) in [
        ("a snap", "1e-14"),
        ("creep", "1e-13"),
        ("space", "1e-13"),
        ("creep in space", "1e-13"),
        ("a pair", "1e-13"),
    ] {
        let [coarse, fine] = ["1e-10", finest].map(|tolerance| {
            let mut all = motions(home, tolerance).into_iter();
            moved(&all.find(|(of, _)| *of == name).unwrap().1, home)
        });
        assert_eq!(fine.1, "\"end_of_time\"", "{name}");
        let off = apart(&fine.0, &coarse.0);
        assert!(off < 1e-9, "{name}: {off:e}");
        let total = &fine.0.iter().find(|(of, _)| of == "total").unwrap().1;
        let open = worst(total.iter().map(|x| (x - total[0]).abs()));
        assert!(open < 1e-11 * total[0].abs().max(1.0), "{name}: {open:e}");
    }
}

/// Catches starts at the ends of the chart, with loads of a million, that panic, give NaN or infinite numbers, or are
/// refused without a message: the end on an axis, on the clamp, at the largest distance below full reach, and rods
/// taut or straight to the last bit.
#[test]
fn starts_at_the_ends_of_the_chart_end_in_a_stated_outcome() {
    let places = [
        (
            "position = [0.9999999999999999, 0.0]\nsheet = \"lowest\"",
            "end_of_time",
        ),
        (
            "position = [0.9999999999999999, 1e-17]\nsheet = \"lowest\"",
            "end_of_time",
        ),
        (
            "position = [0.0, 0.9999999999999999]\nsheet = \"lowest\"",
            "refused",
        ),
        ("position = [0.5, 0.0]\nsheet = \"lowest\"", "end_of_time"),
        ("position = [0.0, 0.5]\nsheet = \"lowest\"", "end_of_time"),
        ("position = [0.0, 0.0]\nsheet = \"lowest\"", "end_of_time"),
        (
            "position = [1e-300, -1e-300]\nsheet = \"lowest\"",
            "end_of_time",
        ),
        ("lambda = 300.0\np = 300.0", "end_of_time"),
        ("lambda = 20.0\nkappa = 0.9999999999999999", "end_of_time"),
        ("lambda = 2.0\nkappa = 1e-12", "end_of_time"),
    ];
    for (start, wanted) in places {
        for acts in [
            "velocity = [0.0, -1.0]\n",
            "velocity = [0.0, -1.0]\n[loads]\ngravity = [0.0, -1e6]\n",
        ] {
            let text = format!(
                "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n[start]\n{start}\n{acts}\
                 [run]\nduration = 0.003\nsamples = 11\n"
            );
            let word = judged(&text, Duration::from_secs(20))
                .unwrap_or_else(|why| panic!("{why}: {text}"));
            assert!(word.starts_with(wanted), "{word}: {text}");
        }
    }
}

/// Catches loss of digits: inputs that differ in their last bits give answers that differ by the condition number,
/// plus the few bits of a computation of many steps.
#[test]
fn the_last_bit_moves_results_by_their_condition() {
    for question in questions() {
        let (condition, bits) = question.condition();
        assert!(
            bits < 100.0 * (1.0 + condition),
            "{}: {bits:e} {condition:e}",
            question.name
        );
    }
}
