//! All published numbers, computed through the public interface; the test suite reads this file too.

mod beams;
mod columns;
mod snaps;

use nalgebra::{Vector3, Vector6};
use serde_json::Value;
use snaprod::Result;
use snaprod::rod::{
    BranchEquilibrium, EndConditions, Equilibrium, Problem, Rod, RodFamily, RodSection, Statical,
};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Item, Options};
use snaprod::solve::special_points::Special;

/// A computed number with the values for comparison.
pub struct Number {
    case: &'static str,
    what: String,
    ours: f64,
    computed: f64,
    printed: Option<(f64, &'static str)>,
}

/// Largest accepted distance from the independent value; the worst is 1e-11.
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

    /// Relative distance from the independent value, absolute if that is 0; infinite for NaN.
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

/// All numbers, in the order of the benchmarks.
///
/// # Errors
///
/// A failed computation of a rod.
pub fn all() -> Result<Vec<Number>> {
    let data: Value = serde_json::from_str(include_str!("../../../tests/data/rod_branch.json"))
        .expect("the reference data");
    let mut numbers = Vec::new();
    for case in [
        columns::euler_loads,
        columns::beyond_the_euler_load,
        columns::clamped_columns,
        beams::cantilevers,
        beams::shearable_cantilever,
        beams::princeton_beam,
        beams::bend,
        snaps::shallow_snaps,
        snaps::turned_clamps,
        snaps::catapults,
        snaps::twisted_rods,
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

fn solve(rod: Rod, end: EndConditions) -> Result<Equilibrium> {
    Problem::new(rod, end, 1e-12)?.solve(None)
}

fn loaded(rod: Rod, force: Vector3<f64>) -> Result<Equilibrium> {
    solve(rod, EndConditions::load(force, Vector3::zeros()))
}

/// Special points along the branch of `problem` from p = `from` on, with their equilibria: at most `count`.
fn specials(
    problem: impl Fn(f64) -> Result<Problem>,
    guess: Vector6<f64>,
    (from, to): (f64, f64),
    count: usize,
) -> Result<Vec<(Special, BranchEquilibrium)>> {
    let family = RodFamily::new(problem, false, to - from);
    let x = family.unknowns(&guess, from)?;
    let options = Options {
        initial_step: 0.05,
        max_step: 1.0,
        weight: 10.0 / (to - from).abs(),
        ..Options::between(from, to)
    };
    Continuation::new(&family, x, from, options)?
        .filter_map(|item| match item {
            Item::Special(special) => Some(special),
            _ => None,
        })
        .take(count)
        .map(|special| {
            let at = family.state(&special.point.x, special.point.p)?;
            Ok((special, at))
        })
        .collect()
}

/// Stable states at growing p, continued from the state found at the first p.
fn stable_states(
    problem: impl Fn(f64) -> Result<Problem>,
    values: &[f64],
) -> Result<Vec<BranchEquilibrium>> {
    let [from, to] = [values[0], values[values.len() - 1]];
    let first = problem(from)?.solve(None)?;
    let family = RodFamily::new(problem, false, to - from);
    let options = Options {
        at: values.to_vec(),
        max_step: 1.0,
        ..Options::between(from, to)
    };
    let trace =
        Continuation::new(&family, family.unknowns(&first.base, from)?, from, options)?.trace();
    values
        .iter()
        .map(|value| {
            let point = trace.points.iter().find(|point| point.p == *value);
            let point = point.unwrap_or_else(|| panic!("nothing at {value}: {}", trace.stop));
            assert_eq!(point.index, Some(0), "at {value}");
            family.state(&point.x, point.p)
        })
        .collect()
}

/// The angle between the end's d3 and z.
fn tilt(end: &RodSection) -> f64 {
    let d3 = end.directors.column(2).into_owned();
    d3.xy().norm().atan2(d3.z)
}
