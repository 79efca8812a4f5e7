//! Random scenes over all models, and the invariants of their outcomes. `examples/stress.rs` runs any number, the
//! suite a few.

use snaprod::scene::Scene;
use snaprod::study::run::Fields;
use snaprod::study::{Hooks, Table, Values, branch, dispatch};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Numbers that follow from a seed alone (splitmix64).
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5eed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Ten to a power in this range.
    fn decades(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.within(low, high))
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.next() % all.len() as u64) as usize]
    }

    pub fn chance(&mut self, part: f64) -> bool {
        self.within(0.0, 1.0) < part
    }

    fn list(&mut self, size: f64, count: usize) -> String {
        let parts: Vec<String> = (0..count)
            .map(|_| format!("{:e}", size * self.within(-1.0, 1.0)))
            .collect();
        format!("[{}]", parts.join(", "))
    }
}

/// Units of a scene: length, stiffness, mass, time.
struct Scales {
    length: f64,
    stiffness: f64,
    mass: f64,
    time: f64,
}

impl Scales {
    /// Mostly laboratory scales, at times of 12 decades each.
    fn new(dice: &mut Dice) -> Self {
        let wide = if dice.chance(0.2) { 6.0 } else { 1.0 };
        let [length, stiffness, mass] = [0; 3].map(|_| dice.decades(-wide, wide));
        let time = (mass * length.powi(3) / stiffness).sqrt();
        Self {
            length,
            stiffness,
            mass,
            time,
        }
    }

    fn force(&self) -> f64 {
        self.stiffness / self.length.powi(2)
    }

    fn speed(&self) -> f64 {
        self.length / self.time
    }
}

/// The scene of a seed as TOML.
pub fn scene(seed: u64) -> String {
    let dice = &mut Dice::new(seed);
    let k = Scales::new(dice);
    let text = match dice.next() % 10 {
        0..=2 => planar(dice, &k),
        3..=5 => spatial(dice, &k),
        6 | 7 => pair(dice, &k),
        8 => bar(dice),
        _ => at_rest(dice, &k),
    };
    if dice.chance(0.12) {
        spoilt(dice, &text)
    } else {
        text
    }
}

/// Inner properties of a rod besides stiffness.
#[derive(Clone, Copy, PartialEq)]
enum Inner {
    /// Nothing, or a mass that is left out or taken to first order.
    Light,
    /// Friction, and perhaps branches that relax.
    Creeping,
    /// All of its mass, and perhaps friction.
    Heavy,
}

/// Friction and mass of the rod; relaxing stiffnesses of a rod in space are in proportion to its own.
fn inner(dice: &mut Dice, k: &Scales, which: Inner, flat: bool) -> String {
    let mut text = String::new();
    let friction = k.time * dice.decades(-4.0, 1.0);
    if which == Inner::Creeping || which == Inner::Heavy && dice.chance(0.5) {
        let _ = writeln!(text, "damping = {{ proportional = {friction:e} }}");
    }
    if which == Inner::Creeping && dice.chance(0.4) {
        let (part, time) = (dice.decades(-2.0, 0.5), k.time * dice.decades(-1.0, 1.0));
        let stiffness = if flat {
            format!("{:e}", part * k.stiffness)
        } else {
            format!("{{ proportional = {part:e} }}")
        };
        let _ = writeln!(
            text,
            "relaxation = [{{ stiffness = {stiffness}, time = {time:e} }}]"
        );
    }
    let mass = k.mass * dice.decades(-5.0, -0.5);
    match which {
        Inner::Heavy => {
            let _ = writeln!(text, "mass = {mass:e}\ninertia = \"full\"");
        }
        Inner::Light if dice.chance(0.4) => {
            let inertia = dice.one_of(&["none", "first-order"]);
            let _ = writeln!(text, "mass = {mass:e}\ninertia = \"{inertia}\"");
        }
        Inner::Light | Inner::Creeping => {}
    }
    text
}

fn end_of(dice: &mut Dice, k: &Scales, which: Inner) -> String {
    let (duration, tolerance) = (k.time * dice.decades(-2.0, 1.3), dice.decades(-11.0, -4.0));
    let landing = if which == Inner::Light && dice.chance(0.3) {
        "landing = \"lowest\"\n"
    } else {
        ""
    };
    format!("[run]\nduration = {duration:e}\ntolerance = {tolerance:e}\nsamples = 41\n{landing}")
}

fn loads(dice: &mut Dice, k: &Scales, axes: usize) -> String {
    let mut text = String::from("[loads]\n");
    if dice.chance(0.5) {
        let size = k.force() / k.mass * dice.decades(-1.0, 1.3);
        let gravity = dice.list(size, axes);
        let _ = writeln!(text, "gravity = {gravity}");
    }
    if dice.chance(0.3) {
        let size = k.force() * dice.decades(-1.0, 1.3);
        let dead = dice.list(size, axes);
        let _ = writeln!(text, "dead = {dead}");
    }
    if dice.chance(0.3) {
        let _ = writeln!(
            text,
            "drag = {:e}",
            k.mass / k.time * dice.decades(-2.0, 1.0)
        );
    }
    text
}

fn planar(dice: &mut Dice, k: &Scales) -> String {
    let which = dice.one_of(&[Inner::Light, Inner::Light, Inner::Creeping, Inner::Heavy]);
    let inner = inner(dice, k, which, true);
    let start = match dice.next() % 4 {
        0 => format!(
            "lambda = {}\np = {}",
            dice.within(0.05, 14.0),
            dice.within(-3.0, 3.0)
        ),
        1 => "rest = \"straight\"".to_owned(),
        _ => format!(
            "lambda = {}\nkappa = {}",
            dice.within(0.05, 8.0),
            dice.within(-0.99, 0.99)
        ),
    };
    let size = dice.decades(-1.0, 1.0) * k.speed();
    let velocity = if start.starts_with("rest") {
        format!("[0.0, {:e}]", size)
    } else {
        dice.list(size, 2)
    };
    format!(
        "[rod]\nmodel = \"elastica\"\nlength = {:e}\nbending_stiffness = {:e}\n{inner}[body]\nmass = {:e}\n[start]\n{start}\nvelocity = {velocity}\n{}{}",
        k.length,
        k.stiffness,
        k.mass,
        loads(dice, k, 2),
        end_of(dice, k, which),
    )
}

/// Stiffnesses of a section.
fn section(dice: &mut Dice, k: &Scales) -> String {
    let b = k.stiffness;
    let mut text = format!(
        "bending = [{:e}, {:e}], torsion = {:e}",
        b,
        b * dice.decades(-0.5, 1.0),
        b * dice.decades(-0.5, 0.5)
    );
    if dice.chance(0.6) {
        let axial = k.force() * dice.decades(1.5, 4.5);
        let _ = write!(text, ", axial = {axial:e}");
        if dice.chance(0.5) {
            let _ = write!(
                text,
                ", shear = [{axial:e}, {:e}]",
                axial * dice.decades(-0.3, 0.3)
            );
        }
    }
    format!("{{ {text} }}")
}

fn extent(dice: &mut Dice, k: &Scales) -> String {
    let arm = k.mass * k.length.powi(2) * dice.decades(-4.0, 0.0);
    format!(
        "inertia = [{arm:e}, {:e}, {:e}]",
        arm * dice.within(0.8, 1.2),
        arm * dice.within(0.8, 1.2)
    )
}

fn spatial(dice: &mut Dice, k: &Scales) -> String {
    let which = dice.one_of(&[Inner::Light, Inner::Light, Inner::Creeping, Inner::Heavy]);
    let inner = inner(dice, k, which, false);
    let (section, extent) = (section(dice, k), extent(dice, k));
    let bend = dice.list(1.5 / k.length, 2);
    let start = if dice.chance(0.4) {
        "settled = true\n"
    } else {
        ""
    };
    let body = if dice.chance(0.5) {
        format!("joint = \"weld\"\n{extent}")
    } else {
        "joint = \"ball\"".to_owned()
    };
    let velocity = dice.decades(-1.0, 0.7) * k.speed();
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = {:e}\nsection = {section}\nrest = {{ curvature = {bend}, twist = 0.0 }}\n{inner}[body]\nmass = {:e}\n{body}\n[start]\n{start}velocity = {}\n{}{}",
        k.length,
        k.mass,
        dice.list(velocity, 3),
        loads(dice, k, 3),
        end_of(dice, k, which),
    )
}

/// A body between two stretched or compressed rods.
fn pair(dice: &mut Dice, k: &Scales) -> String {
    let apart = k.length * dice.within(1.6, 2.02);
    let joint = dice.one_of(&["weld", "ball"]);
    let turned = "quaternion = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]";
    let to = match joint {
        "weld" => format!("{{ body = \"m\", {turned} }}"),
        _ => "{ body = \"m\", joint = \"ball\" }".to_owned(),
    };
    let mut text = String::new();
    let which = dice.one_of(&[Inner::Light, Inner::Heavy]);
    let inner = inner(dice, k, which, false);
    let section = section(dice, k);
    let back = "quaternion = [0.7071067811865476, 0.0, -0.7071067811865476, 0.0]";
    let (second, second_to) = match joint {
        "weld" => (back, format!("{{ body = \"m\", {back} }}")),
        _ => (back, to.clone()),
    };
    for (name, place, turn, to) in [
        ("left", 0.0, turned, &to),
        ("right", apart, second, &second_to),
    ] {
        let _ = writeln!(
            text,
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = {:e}\nsection = {section}\n{inner}from = {{ position = [{place:e}, 0.0, 0.0], {turn} }}\nto = {to}",
            k.length
        );
    }
    let velocity = dice.decades(-1.0, 0.5) * k.speed();
    let extent = match joint {
        "weld" => extent(dice, k),
        _ => String::new(),
    };
    let pull = k.force() / k.mass * dice.decades(-1.0, 1.0);
    let loads = if dice.chance(0.5) {
        format!("[loads]\ngravity = {}\n", dice.list(pull, 3))
    } else {
        String::new()
    };
    format!(
        "{text}[[body]]\nname = \"m\"\nmass = {:e}\n{extent}\nguess = {{ position = [{:e}, 0.0, {:e}] }}\nvelocity = {}\n{loads}{}",
        k.mass,
        0.5 * apart,
        k.length * dice.within(0.0, 0.5),
        dice.list(velocity, 3),
        end_of(dice, k, which),
    )
}

fn bar(dice: &mut Dice) -> String {
    let law = match dice.next() % 3 {
        0 => format!(
            "{{ mooney = [{}, {}] }}",
            dice.within(10.0, 40.0),
            dice.within(0.0, 10.0)
        ),
        1 => format!("{{ neo_hookean = {} }}", dice.within(10.0, 40.0)),
        _ => format!("{{ linear = {} }}", dice.within(50.0, 200.0)),
    };
    format!(
        "[rod]\nmodel = \"bar\"\nlength = 3.0\narea = 0.03\ndensity = 1e-4\nlaw = {law}\ncells = {}\n[loads]\nforce = {{ block = {{ size = {}, until = 0.002 }} }}\n[run]\nduration = {}\nsamples = 21\n",
        dice.one_of(&[10, 40, 100]),
        dice.within(-3.0, 4.0),
        dice.within(1e-4, 6e-3),
    )
}

fn at_rest(dice: &mut Dice, k: &Scales) -> String {
    let section = section(dice, k);
    let force = k.force() * dice.decades(-1.0, 1.7);
    let end = match dice.next() % 3 {
        0 => format!(
            "force = {}\ncouple = {}",
            dice.list(force, 3),
            dice.list(force * k.length, 3)
        ),
        1 => format!("force = {}\nfollower = true", dice.list(force, 3)),
        _ => format!("position = {}", dice.list(0.57 * k.length, 3)),
    };
    let parameter = if end.starts_with("force") {
        "end.force.x"
    } else {
        "end.position.x"
    };
    let follow = if dice.chance(0.5) {
        format!(
            "[continue]\nparameter = \"{parameter}\"\nto = {:e}\npoints = 60\n",
            if parameter == "end.force.x" {
                force
            } else {
                0.3 * k.length
            } * dice.within(-1.0, 1.0)
        )
    } else {
        String::new()
    };
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = {:e}\nsection = {section}\n[end]\n{end}\n{follow}",
        k.length
    )
}

/// The scene with one of its numbers replaced by an absurd one.
fn spoilt(dice: &mut Dice, text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let numbered: Vec<usize> = (0..lines.len())
        .filter(|k| {
            lines[*k]
                .rsplit_once("= ")
                .is_some_and(|(_, v)| v.parse::<f64>().is_ok())
        })
        .collect();
    if numbered.is_empty() {
        return text.to_owned();
    }
    let at = dice.one_of(&numbered);
    let value = dice.one_of(&[
        "0.0", "-1.0", "1e300", "1e-300", "nan", "inf", "1e-16", "1e16", "\"x\"",
    ]);
    let spoilt = |(k, line): (usize, &&str)| match line.rsplit_once("= ") {
        Some((name, _)) if k == at => format!("{name}= {value}"),
        _ => (*line).to_owned(),
    };
    lines
        .iter()
        .enumerate()
        .map(spoilt)
        .collect::<Vec<_>>()
        .join("\n")
}

/// Hooks that interrupt early.
struct Hurried(Instant);

impl Hooks for Hurried {
    fn interrupted(&mut self) -> bool {
        Instant::now() > self.0
    }
}

/// Outcome of a scene: its class, or the description of a violation.
pub type Judged = Result<String, String>;

/// Runs a scene for a limited time and returns the outcome; an error for unreported energy changes, or a NaN or
/// infinite number.
pub fn judged(text: &str, patience: Duration) -> Judged {
    let scene = match Scene::parse(text) {
        Ok(scene) => scene,
        Err(faults) => {
            let said = faults.to_string();
            return if said.len() > 10 {
                Ok("refused: scene".to_owned())
            } else {
                Err(format!("a fault without words: {said:?}"))
            };
        }
    };
    let mut hooks = Hurried(Instant::now() + patience);
    let refused = |e: snaprod::Error| match e.to_string() {
        said if said.len() > 10 && !said.contains("NaN, NaN") => {
            Ok(format!("refused: {}", class(&said)))
        }
        said => Err(format!("an error without words: {said:?}")),
    };
    if text.contains("[continue]") {
        return match branch(&scene, &mut hooks) {
            Err(e) => refused(e),
            Ok(record) => finite(std::slice::from_ref(&record.branches.points), &["p"])
                .map(|()| "a branch".to_owned()),
        };
    }
    if text.contains("[end]") {
        return match dispatch::rest(&scene, &snaprod::study::FirstOrder::default()) {
            Err(e) => refused(e),
            Ok((_, shape)) => {
                finite(&[shape], &["s", "x", "y", "z"]).map(|()| "an equilibrium".to_owned())
            }
        };
    }
    let mut tables: Vec<Table> = Vec::new();
    let found = match dispatch::motion(&scene, Fields::None, &mut tables, &mut hooks) {
        Err(e) => return refused(e),
        Ok(found) => found,
    };
    finite(
        &tables,
        &["t", "x", "y", "vx", "vy", "kinetic", "elastic", "total"],
    )?;
    let outcome = found.summary["outcome"].as_str().unwrap_or("?").to_owned();
    let small = |said: &String| said.contains("too small for run.tolerance");
    if found.reason.is_none() && found.warning.as_ref().is_some_and(small) {
        return Ok("below the tolerance".to_owned());
    }
    if found.reason.is_none() && !text.contains("\"bar\"") {
        let tolerance = number(text, "tolerance = ").unwrap_or(1e-8);
        let stiffness = number(text, "bending_stiffness = ").or(number(text, "bending = ["));
        let unit = stiffness
            .zip(number(text, "length = "))
            .map_or(0.0, |(b, l)| b / l);
        for table in &tables {
            closed(table, tolerance, unit)?;
        }
    }
    Ok(outcome)
}

/// Class of an error: the first words.
fn class(said: &str) -> String {
    let words = said
        .split_whitespace()
        .filter(|word| !word.contains(|c: char| c.is_ascii_digit()));
    words.take(6).collect::<Vec<_>>().join(" ")
}

fn finite(tables: &[Table], names: &[&str]) -> Result<(), String> {
    for table in tables {
        for column in table
            .columns
            .iter()
            .filter(|column| names.contains(&&*column.name))
        {
            if let Values::Reals(list) = &column.values
                && let Some(row) = list.iter().position(|x| !x.is_finite())
            {
                return Err(format!(
                    "{} of row {row} of {} is {}",
                    column.name, table.name, list[row]
                ));
            }
        }
        let times = table.reals("t");
        if let Some(row) =
            (1..times.len()).find(|k| times[*k] < times[k - 1] - 1e-12 * times[k - 1].abs())
        {
            return Err(format!("time runs back in row {row} of {}", table.name));
        }
    }
    Ok(())
}

/// The first number behind `key`.
fn number(text: &str, key: &str) -> Option<f64> {
    let (_, rest) = text.split_once(key)?;
    rest.split([',', ']', '\n']).next()?.parse().ok()
}

/// Checks the ledger of a run that ended normally. Shapes are known to within the tolerance, in units of the rod. An
/// energy E is known to within the tolerance times its square root times that of the rod's `unit`, B/L. The latter
/// matters for E below 1e-10 B/L or so.
fn closed(table: &Table, tolerance: f64, unit: f64) -> Result<(), String> {
    let total = table.reals("total");
    let terms = [
        "kinetic",
        "rod_kinetic",
        "elastic",
        "potential",
        "dissipated",
        "work",
    ]
    .map(|name| table.reals(name));
    let largest = terms
        .iter()
        .flat_map(|term| term.iter())
        .fold(0.0, |most, x| f64::max(most, x.abs()));
    let Some(first) = total.first() else {
        return Ok(());
    };
    let off = total
        .iter()
        .fold(0.0, |most, x| f64::max(most, (x - first).abs()));
    let resolved = tolerance * (unit * largest).sqrt();
    if off <= ((1e5 * tolerance).max(1e-9) * largest).max(resolved) {
        Ok(())
    } else {
        Err(format!(
            "the ledger opens by {:e} of its largest term",
            off / largest
        ))
    }
}
