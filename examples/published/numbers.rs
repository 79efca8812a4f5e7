//! Every number, found the way a user would find it; the test suite reads this file too.

use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::Result;
use snaprod::rod::section::Linear;
use snaprod::rod::{End, Equilibrium, Problem, Rod, RodFamily};
use snaprod::solve::arclength::{Branch, Item, Options};
use snaprod::solve::special::{Kind, Special};
use std::f64::consts::PI;

/// A number and what it is compared with.
pub struct Number {
    case: &'static str,
    what: String,
    ours: f64,
    computed: f64,
    printed: Option<(f64, &'static str)>,
}

/// The distance to the number computed apart that is allowed; the worst is 1e-11.
pub const BAR: f64 = 1e-10;

impl Number {
    fn new(case: &'static str, what: impl Into<String>, ours: f64, computed: f64) -> Self {
        Self {
            case,
            what: what.into(),
            ours,
            computed,
            printed: None,
        }
    }

    fn printed(mut self, value: f64, source: &'static str) -> Self {
        self.printed = Some((value, source));
        self
    }

    /// Relative distance to the number computed apart, absolute where that is 0; infinite for NaN.
    pub fn distance(&self) -> f64 {
        relative(self.ours, self.computed)
    }
}

fn relative(ours: f64, other: f64) -> f64 {
    let gap = (ours - other).abs() / if other == 0.0 { 1.0 } else { other.abs() };
    if gap.is_nan() { f64::INFINITY } else { gap }
}

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            case,
            what,
            ours,
            computed,
            ..
        } = self;
        let distance = self.distance();
        write!(
            f,
            "| {case} | {what} | {ours:.12} | {computed:.12} | {distance:.0e} |"
        )?;
        match self.printed {
            Some((value, source)) => {
                write!(f, " {value} | {source} | {:.0e} |", relative(*ours, value))
            }
            None => write!(f, " | | |"),
        }
    }
}

/// All of them, in the order of the benchmarks.
///
/// # Errors
/// Those of the rods.
pub fn all() -> Result<Vec<Number>> {
    let data: Value = serde_json::from_str(include_str!("../../tests/data/rod_branch.json"))
        .expect("the reference data");
    let mut numbers = Vec::new();
    for case in [
        euler_loads,
        beyond_the_euler_load,
        clamped_columns,
        cantilevers,
        shearable_cantilever,
        princeton_beam,
        bend,
        shallow_snaps,
        turned_clamps,
        catapults,
        twisted_rods,
    ] {
        numbers.extend(case(&data)?);
    }
    Ok(numbers)
}

fn number(row: &Value, key: &str) -> f64 {
    row[key]
        .as_f64()
        .unwrap_or_else(|| panic!("no number {key} in {row}"))
}

fn rows(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().expect("a list").iter()
}

/// Unshearable, inextensible, EI = 1 in the plane of z and x, stiff out of it.
fn planar_rod(length: f64) -> Result<Rod> {
    Rod::new(length, Linear::diagonal([40.0, 1.0], 40.0)?)
}

fn solve(rod: Rod, end: End) -> Result<Equilibrium> {
    Problem::new(rod, end, 1e-12)?.solve(None)
}

fn loaded(rod: Rod, force: Vector3<f64>) -> Result<Equilibrium> {
    solve(rod, End::load(force, Vector3::zeros()))
}

/// Special points along the branch of `problem` from p = `from` on, with the
/// equilibria there: `count` of them at most.
fn specials(
    problem: impl Fn(f64) -> Result<Problem>,
    guess: Vector6<f64>,
    (from, to): (f64, f64),
    count: usize,
) -> Result<Vec<(Special<6>, Equilibrium)>> {
    let family = RodFamily::new(problem, false, to - from);
    let x = family.unknowns(&guess, from)?;
    let options = Options {
        initial_step: 0.05,
        max_step: 1.0,
        weight: 10.0 / (to - from).abs(),
        ..Options::between(from, to)
    };
    Branch::new(&family, x, from, options)?
        .filter_map(|item| match item {
            Item::Special(special) => Some(special),
            _ => None,
        })
        .take(count)
        .map(|special| {
            let at = family.equilibrium(&special.point.x, special.point.p, 0)?;
            Ok((special, at))
        })
        .collect()
}

/// The states at growing p, followed from the one found at the first.
fn stable_states(
    problem: impl Fn(f64) -> Result<Problem>,
    values: &[f64],
) -> Result<Vec<Equilibrium>> {
    let [from, to] = [values[0], values[values.len() - 1]];
    let first = problem(from)?.solve(None)?;
    let family = RodFamily::new(problem, false, to - from);
    let options = Options {
        at: values.to_vec(),
        max_step: 1.0,
        ..Options::between(from, to)
    };
    let trace = Branch::new(&family, family.unknowns(&first.base, from)?, from, options)?.trace();
    values
        .iter()
        .map(|value| {
            let point = trace.points.iter().find(|point| point.p == *value);
            let point = point.unwrap_or_else(|| panic!("nothing at {value}: {}", trace.stop));
            assert_eq!(point.index, Some(0), "at {value}");
            family.equilibrium(&point.x, point.p, 0)
        })
        .collect()
}

/// B1: the loads at which the straight rod's branch is crossed by others.
fn euler_loads(data: &Value) -> Result<Vec<Number>> {
    let source = "Timoshenko & Gere 1961";
    let free = End::load(Vector3::zeros(), Vector3::zeros());
    // The end may slide along z under the load.
    let pinned = End {
        position: [Some(0.0), Some(0.0), None],
        ..free
    };
    let clamped = End {
        orientation: Some(UnitQuaternion::identity()),
        ..pinned
    };
    let mut numbers = Vec::new();
    for (key, length, end, printed) in [
        ("clamped_free", 1.0, free, 2.467),
        // A pinned rod is twice a clamped-free one of half the length.
        ("pinned", 0.5, free, 9.8696),
        ("clamped_pinned", 1.0, pinned, 20.19),
        ("clamped_clamped", 1.0, clamped, 39.48),
    ] {
        let computed: Vec<f64> = rows(&data["B1"]["outputs"][key])
            .map(|x| x.as_f64().expect("a load"))
            .collect();
        let problem = |load: f64| {
            let force = -load * Vector3::z();
            Problem::new(planar_rod(length)?, End { force, ..end }, 1e-12)
        };
        let last = computed[computed.len() - 1];
        let found = specials(problem, Vector6::zeros(), (0.0, 1.1 * last), computed.len())?;
        assert_eq!(found.len(), computed.len(), "{key}");
        for (i, ((special, _), want)) in found.iter().zip(&computed).enumerate() {
            assert_eq!(special.kind, Kind::BranchPoint, "{key}");
            assert_eq!(special.index, (Some(i), Some(i + 1)), "{key}");
            let what = format!("{}, load {}", key.replace('_', "-"), i + 1);
            let row = Number::new("B1", what, special.point.p, *want);
            numbers.push(if i == 0 {
                row.printed(printed, source)
            } else {
                row
            });
        }
    }
    Ok(numbers)
}

/// B2: the cantilever beyond its Euler load, and the pinned elastica whose ends meet, as two halves.
fn beyond_the_euler_load(data: &Value) -> Result<Vec<Number>> {
    let source = "Timoshenko & Gere 1961";
    let euler = 0.25 * PI * PI;
    let printed = [
        [0.970, 0.220],
        [0.741, 0.593],
        [0.349, 0.792],
        [-0.107, 0.750],
        [-0.577, 0.421],
    ];
    let loads: Vec<f64> = rows(&data["B2"]["outputs"])
        .map(|row| number(row, "load") * euler)
        .collect();
    let pressed = |load: f64| {
        let end = End::load(-load * Vector3::z(), Vector3::zeros());
        Problem::new(planar_rod(1.0)?, end, 1e-12)
    };
    let states = stable_states(pressed, &loads)?;
    let mut numbers = Vec::new();
    for ((row, [x, y]), found) in rows(&data["B2"]["outputs"]).zip(printed).zip(states) {
        let tip = tilt(&found).to_degrees();
        let position = found.end.position;
        let degrees = number(row, "tip_deg");
        numbers.extend([
            Number::new(
                "B2",
                format!("P/Pcr = {:.6}: end slope, deg", number(row, "load")),
                tip,
                degrees,
            ),
            Number::new("B2", "x", position.z, number(row, "x")).printed(x, source),
            Number::new("B2", "y", position.x.abs(), number(row, "y")).printed(y, source),
        ]);
    }
    let meet = End {
        position: [None, None, Some(0.0)],
        ..End::load(Vector3::zeros(), Vector3::zeros())
    };
    let found = Problem::new(planar_rod(1.0)?, meet, 1e-12)?
        .solve(Some(&Vector6::new(0.0, 4.3, 0.0, 0.0, 0.0, -5.5)))?;
    numbers.push(Number::new(
        "B2",
        "pinned, ends meet: P/P_E",
        -found.end.force.z / euler,
        number(&data["B2"]["ends_meet"], "load"),
    ));
    numbers.push(Number::new(
        "B2",
        "its modulus k",
        (0.5 * tilt(&found)).sin(),
        number(&data["B2"]["ends_meet"], "k"),
    ));
    Ok(numbers)
}

/// The angle between the end's d3 and z.
fn tilt(found: &Equilibrium) -> f64 {
    let d3 = found.end.directors.column(2).into_owned();
    d3.xy().norm().atan2(d3.z)
}

/// B3: clamped ends moved together.
fn clamped_columns(data: &Value) -> Result<Vec<Number>> {
    let shortenings: Vec<f64> = rows(&data["B3"]["outputs"])
        .map(|row| number(row, "s"))
        .collect();
    let problem = |s: f64| {
        let end = End::pose(Vector3::z() * (1.0 - s), UnitQuaternion::identity());
        Problem::new(planar_rod(1.0)?, end, 1e-12)
    };
    let states = stable_states(problem, &shortenings)?;
    let mut numbers = Vec::new();
    for (row, found) in rows(&data["B3"]["outputs"]).zip(states) {
        let s = number(row, "s");
        let middle = &problem(s)?.shape(&found.base, 3)?[1].position;
        numbers.extend([
            Number::new(
                "B3",
                format!("shortening {s}: P"),
                -found.end.force.z,
                number(row, "load"),
            ),
            Number::new(
                "B3",
                "deflection of the middle",
                middle.x.abs(),
                number(row, "deflection"),
            ),
        ]);
    }
    Ok(numbers)
}

/// B4: cantilevers under a transverse load, and under a couple that closes them.
fn cantilevers(data: &Value) -> Result<Vec<Number>> {
    let source = "Mattiasson 1981";
    let printed = [
        [0.06636, 0.00265, 0.09964],
        [0.30172, 0.05643, 0.46135],
        [0.60325, 0.25442, 0.98602],
        [0.81061, 0.55500, 1.43029],
    ];
    let mut numbers = Vec::new();
    for (row, [w, u, angle]) in rows(&data["B4"]["outputs"]).zip(printed) {
        let load = number(row, "P");
        let found = loaded(planar_rod(1.0)?, load * Vector3::x())?;
        let position = found.end.position;
        numbers.extend([
            Number::new("B4", format!("P = {load}: w"), position.x, number(row, "w"))
                .printed(w, source),
            Number::new("B4", "u", 1.0 - position.z, number(row, "u")).printed(u, source),
            Number::new("B4", "end angle", tilt(&found), number(row, "angle"))
                .printed(angle, source),
        ]);
    }
    let circle = End::load(Vector3::zeros(), 2.0 * PI * Vector3::y());
    let gap = solve(planar_rod(1.0)?, circle)?.end.position.norm();
    numbers.push(Number::new("B4", "M = 2 pi: gap of the circle", gap, 0.0));
    Ok(numbers)
}

/// B5: shear and stretch.
fn shearable_cantilever(data: &Value) -> Result<Vec<Number>> {
    let source = "Nachbagauer 2011 in Exudyn, 1024 elements";
    let input = |key: &str| number(&data["B5"]["inputs"], key);
    let output = |key: &str| number(&data["B5"]["outputs"], key);
    let law = Linear::diagonal([input("EI"); 2], input("EI"))?
        .with_shear([input("GA"); 2])?
        .with_axial(input("EA"))?;
    let found = loaded(Rod::new(input("L"), law)?, input("F") * Vector3::x())?;
    let position = found.end.position;
    Ok(vec![
        Number::new("B5", "u_x", input("L") - position.z, output("ux")).printed(0.15097102, source),
        Number::new("B5", "u_y", position.x, output("uy")).printed(0.71056836, source),
    ])
}

/// B6: bending about both axes with torsion.
fn princeton_beam(data: &Value) -> Result<Vec<Number>> {
    let input = |key: &str| number(&data["B6"]["inputs"], key);
    let law = Linear::diagonal([input("weak"), input("strong")], input("GJ"))?
        .with_shear([input("GA"); 2])?
        .with_axial(input("EA"))?;
    let mut numbers = Vec::new();
    for row in rows(&data["B6"]["outputs"]) {
        let (load, degrees) = (number(row, "P"), number(row, "beta_deg"));
        // Bending about the weak axis alone: no rounding of cos 90 degrees.
        let across = if degrees == 90.0 {
            0.0
        } else {
            degrees.to_radians().cos()
        };
        let force = load * Vector3::new(across, degrees.to_radians().sin(), 0.0);
        let found = loaded(Rod::new(input("L"), law)?, force)?;
        let position = found.end.position;
        let mut pair = [
            Number::new(
                "B6",
                format!("{load} N at {degrees} deg: -u_y"),
                position.x,
                number(row, "minus_uy"),
            ),
            Number::new("B6", "u_z", position.y, number(row, "uz")),
        ];
        if (load, degrees) == (8.896, 45.0) {
            let [u_y, u_z] = pair;
            pair = [
                u_y.printed(0.00883723, "ANSYS"),
                u_z.printed(0.10898794, "ANSYS"),
            ];
        }
        numbers.extend(pair);
    }
    Ok(numbers)
}

/// B7: an arc of 45 degrees bent out of its plane.
fn bend(data: &Value) -> Result<Vec<Number>> {
    let ei = 1e7 / 12.0;
    // d3 along the world's x, d1 along y, d2 along z.
    let directors = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let clamp = UnitQuaternion::from_matrix(&directors);
    let mut numbers = Vec::new();
    for row in rows(&data["B7"]["outputs"]) {
        let name = row["law"].as_str().expect("a law");
        let torsion = if name.contains("8.3333e5") {
            8.3333e5
        } else {
            ei
        };
        let mut law = Linear::diagonal([ei, ei], torsion)?.with_rest([0.0, 0.01], 0.0)?;
        if !name.contains("unshearable") {
            law = law.with_shear([5e6; 2])?.with_axial(1e7)?;
        }
        let rod = Rod::new(25.0 * PI, law)?.with_clamp(Vector3::zeros(), clamp);
        let load = number(row, "F");
        let found = loaded(rod, load * Vector3::z())?;
        let printed = match (name, load) {
            ("GJ = 8.3333e5", 300.0) => Some([58.84, 22.33, 40.08]),
            ("GJ = 8.3333e5", 600.0) => Some([47.23, 15.79, 53.37]),
            ("GJ = 1e7/12", 600.0) => Some([47.2, 15.9, 53.4]),
            _ => None,
        };
        let source = if torsion == ei {
            "Bathe & Bolourchi 1979"
        } else {
            "Simo & Vu-Quoc 1986, 8 elements"
        };
        for (i, want) in rows(&row["tip"]).enumerate() {
            let what = match i {
                0 => format!("F = {load}, {name}: x"),
                1 => "y".into(),
                _ => "z".into(),
            };
            let want = want.as_f64().expect("a place");
            let row = Number::new("B7", what, found.end.position[i], want);
            numbers.push(match printed {
                Some(tip) => row.printed(tip[i], source),
                None => row,
            });
        }
    }
    Ok(numbers)
}

/// How the far end is held when one clamp is turned.
#[derive(Clone, Copy, PartialEq)]
enum Far {
    Clamped,
    Hinged,
    /// Clamped and turned the other way.
    Turned,
}

/// One clamp turned by the angle p, the ends a distance 1 - s apart, the rod bent away from the turn at first: the special
/// points up to the fold.
fn turning(s: f64, far: Far, count: usize) -> Result<Vec<(Special<6>, Equilibrium)>> {
    let end = Vector3::z() * (1.0 - s);
    let problem = move |a: f64| {
        let turn = |a: f64| UnitQuaternion::from_scaled_axis(Vector3::y() * a);
        let rod = planar_rod(1.0)?.with_clamp(Vector3::zeros(), turn(a));
        let end = match far {
            Far::Clamped => End::pose(end, UnitQuaternion::identity()),
            Far::Hinged => End::ball(end),
            Far::Turned => End::pose(end, turn(-a)),
        };
        Problem::new(rod, end, 1e-13)
    };
    // Buckled away from the turn: load, couple and force across to second order in the bending.
    let (load, couple, across) = match far {
        Far::Hinged => (-20.19, -8.987, -8.987),
        _ => (-4.0 * PI * PI, -4.0 * PI, 0.0),
    };
    let root = s.sqrt();
    let guess = Vector6::new(
        0.0,
        couple * root,
        0.0,
        across * root,
        0.0,
        load * (1.0 + 0.5 * s),
    );
    let base = problem(0.0)?.solve(Some(&guess))?.base;
    specials(problem, base, (0.0, 2.6 * s.sqrt()), count)
}

/// The value at s = 0 of a polynomial through samples at s, s/2, s/4, ... (Neville).
fn extrapolated(samples: &[f64]) -> f64 {
    let mut row = samples.to_vec();
    let mut factor = 1.0;
    while row.len() > 1 {
        factor *= 2.0;
        row = row
            .windows(2)
            .map(|pair| (factor * pair[1] - pair[0]) / (factor - 1.0))
            .collect();
    }
    row[0]
}

/// B9: the same for vanishing shortening, by extrapolation in s.
fn shallow_snaps(data: &Value) -> Result<Vec<Number>> {
    let outputs = &data["B9"]["outputs"];
    let mut numbers = Vec::new();
    for (key, what, far, count) in [
        ("clamped", "far end clamped flat", Far::Clamped, 1),
        ("hinged", "far end hinged", Far::Hinged, 1),
        ("symmetric", "both clamps turned", Far::Turned, 2),
    ] {
        let mut all = Vec::new();
        for i in 0..5 {
            let s = 0.02 * 0.5_f64.powi(i);
            let found = turning(s, far, count)?;
            assert_eq!(found.len(), count, "{key}");
            assert_eq!(found[count - 1].0.kind, Kind::Fold, "{key}");
            all.push(
                found
                    .iter()
                    .map(|(special, at)| [special.point.p / s.sqrt(), -at.end.force.z])
                    .collect::<Vec<_>>(),
            );
        }
        let limit = |which: usize, part: usize| {
            extrapolated(&all.iter().map(|at| at[which][part]).collect::<Vec<_>>())
        };
        let fold = Number::new(
            "B9",
            format!("{what}: fold, mu"),
            limit(count - 1, 0),
            number(&outputs[key], "fold_mu"),
        );
        numbers.push(if key == "clamped" {
            fold.printed(1.78, "Gomez, Moulton & Vella 2017")
        } else {
            fold
        });
        numbers.push(Number::new(
            "B9",
            "P",
            limit(count - 1, 1),
            number(&outputs[key], "fold_P"),
        ));
        if count == 2 {
            let pitchfork = &outputs["symmetric_pitchfork"];
            numbers.push(Number::new(
                "B9",
                "pitchfork before it, mu",
                limit(0, 0),
                number(pitchfork, "mu"),
            ));
            numbers.push(Number::new("B9", "P", limit(0, 1), number(pitchfork, "P")));
        }
    }
    Ok(numbers)
}

/// B10: a clamp turned to the fold.
fn turned_clamps(data: &Value) -> Result<Vec<Number>> {
    let mut numbers = Vec::new();
    for row in rows(&data["B10"]["outputs"]) {
        let name = row["far_end"].as_str().expect("a name");
        let far = if name == "hinged" {
            Far::Hinged
        } else {
            Far::Clamped
        };
        let s = number(row, "s");
        let found = turning(s, far, 1)?;
        let [(fold, _)] = &found[..] else {
            panic!("no fold: {row}")
        };
        assert_eq!(fold.kind, Kind::Fold);
        numbers.push(Number::new(
            "B10",
            format!("far end {name}, s = {s}: fold at a, rad"),
            fold.point.p,
            number(row, "a"),
        ));
    }
    Ok(numbers)
}

/// B11: the clamp of a loaded column is turned until it snaps back.
fn catapults(data: &Value) -> Result<Vec<Number>> {
    let mut numbers = Vec::new();
    for row in rows(&data["B11"]["outputs"]) {
        let ratio = number(row, "P_over_Pcr");
        let load = End::load(-ratio * 0.25 * PI * PI * Vector3::z(), Vector3::zeros());
        let problem = |phi: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * phi);
            Problem::new(
                planar_rod(1.0)?.with_clamp(Vector3::zeros(), turn),
                load,
                1e-12,
            )
        };
        let buckled = problem(0.0)?.solve(None)?;
        // The clamp turns away from the side the rod leans to.
        let side = -buckled.end.position.x.signum();
        let problem = |phi: f64| problem(side * phi);
        let found = specials(problem, buckled.base, (0.0, PI), 1)?;
        let [(fold, at)] = &found[..] else {
            panic!("no fold: {row}")
        };
        assert_eq!(fold.kind, Kind::Fold);
        numbers.extend([
            Number::new(
                "B11",
                format!("P/Pcr = {ratio}: snap-back at, deg"),
                fold.point.p.to_degrees(),
                number(row, "phi_deg"),
            ),
            Number::new(
                "B11",
                "end slope there, deg",
                tilt(at).to_degrees(),
                number(row, "tip_deg"),
            ),
        ]);
    }
    Ok(numbers)
}

/// B13: a straight rod wound up between clamps, and a ring.
fn twisted_rods(data: &Value) -> Result<Vec<Number>> {
    let torsion = 0.7;
    let mut numbers = Vec::new();
    for row in rows(&data["greenhill"]["rows"]) {
        let tension = number(row, "tension");
        let problem = |couple: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (couple / torsion));
            let end = End {
                position: [Some(0.0), Some(0.0), None],
                force: tension * Vector3::z(),
                ..End::pose(Vector3::zeros(), turn)
            };
            Problem::new(
                Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion)?)?,
                end,
                1e-12,
            )
        };
        let guess = Vector6::new(0.0, 0.0, 0.5, 0.0, 0.0, tension);
        let found = specials(problem, guess, (0.5, 13.0), 1)?;
        let [(first, _)] = &found[..] else {
            panic!("no instability: {row}")
        };
        assert_eq!(first.index, (Some(0), Some(2)));
        numbers.push(Number::new(
            "B13",
            format!("end tension {tension}: couple"),
            first.point.p,
            number(row, "critical_couple"),
        ));
    }
    numbers.push(Number::new(
        "B13",
        "ring: twisting couple",
        michells_couple(torsion)?,
        2.0 * PI * 3.0_f64.sqrt(),
    ));
    Ok(numbers)
}

/// The couple at which a twisted ring, cut and clamped, becomes unstable: by bisection on the index.
fn michells_couple(torsion: f64) -> Result<f64> {
    // The plane of the ring may turn about the clamp's d3, which counts as one or none: what matters is the jump.
    let index = |couple: f64| {
        let base = Vector6::new(0.0, 2.0 * PI, couple, 0.0, 2.0 * PI * couple, 0.0);
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion)?)?;
        let end = rod.end(&base, 1e-12)?.section;
        assert!(end.position.norm() < 1e-11, "the ring does not close");
        let directors = UnitQuaternion::from_matrix(&end.directors);
        Problem::new(rod, End::pose(end.position, directors), 1e-12)?.index_at(&base)
    };
    let (mut low, mut high) = (9.0, 12.0);
    assert!(index(high)? >= 2 && index(low)? < 2, "no jump by two");
    while high - low > 1e-11 {
        let middle = 0.5 * (low + high);
        if index(middle)? < 2 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}
