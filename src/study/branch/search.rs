//! Branches that do not meet those known, by deflation.

use super::follow::{Study, TYPICAL};
use super::record::DeflationRecord;
use crate::error::{Message, Quantity};
use crate::math::order::sort_few;
use crate::scene::{Continue, Scene};
use crate::solve::deflation::{self, further};
use nalgebra::SVector;

/// Values of the parameter at which further equilibria are sought.
const VALUES: usize = 5;
/// Branches that are followed.
const MOST: usize = 8;

/// A size of base wrenches, in the units of the rod, as a couple and a force of the scene.
fn largest(scene: &Scene, size: f64) -> String {
    let stiffness = scene.cosserat_rod().map(|rod| rod.reference_stiffness());
    let couple = size * stiffness.unwrap_or(f64::NAN) / scene.rod.length;
    let force = couple / scene.rod.length;
    let units = |of| (1.0, scene.units.symbol(of));
    Message::from("a couple of ")
        .number(couple, Quantity::Couple)
        .words(" or a force of ")
        .number(force, Quantity::Force)
        .in_units(&units)
        .to_string()
}

/// Evenly over the range.
pub fn values(wanted: &Continue) -> Vec<f64> {
    let (low, high) = wanted.range();
    let last = VALUES - 1;
    let mut values: Vec<f64> = (1..last)
        .map(|k| low + (high - low) * k as f64 / last as f64)
        .collect();
    values.extend([low, high]);
    if !values.contains(&wanted.from) {
        values.push(wanted.from);
    }
    // From where the scene begins outwards.
    sort_few(&mut values, |value| (value - wanted.from).abs());
    values
}

/// Searches, follows what is found, and reports.
pub fn search<const N: usize>(study: &mut Study<'_, N>) -> DeflationRecord {
    let values = values(study.wanted);
    let parameter = study.wanted.parameter;
    // Rods have equilibria of any order, at ever larger wrenches.
    let bound = 2.0 * study.size().max(TYPICAL);
    let (mut found, mut evaluations) = (0, 0);
    'values: for &p in &values {
        let mut guesses = study.known(p);
        // Along each unknown, both ways.
        for k in 0..N {
            for way in [1.0, -1.0] {
                let mut guess = SVector::zeros();
                guess[k] = way * TYPICAL;
                guesses.push(guess);
            }
        }
        for guess in guesses {
            if study.watch.stops(p) {
                break 'values;
            }
            let options = deflation::Options::default();
            let known = study.known(p);
            let search = match further(study.family, p, &known, &[guess], &options) {
                Ok(search) => search,
                Err(e) => {
                    let remark = format!("deflation at {parameter} = {p}: {e}");
                    study.remarks.push(remark);
                    continue 'values;
                }
            };
            evaluations += search.evaluations;
            for solution in &search.solutions {
                // One found with it may lie on its branch.
                if !(solution.x.norm() <= bound) || study.knows(p, &solution.x) {
                    continue;
                }
                let origin = format!("deflation at {parameter} = {p}");
                match study.through(origin, solution.x, p, true) {
                    Ok(()) => found += 1,
                    Err(e) => {
                        let remark = format!("deflation at {parameter} = {p}: {e}");
                        study.remarks.push(remark);
                    }
                }
                if found == MOST {
                    break 'values;
                }
            }
        }
    }
    let limit = match found {
        MOST => format!(", at most {MOST}"),
        _ => String::new(),
    };
    let branches = if found == 1 { "branch" } else { "branches" };
    study.remarks.push(format!(
        "deflation found {found} further {branches}{limit}, sought at {} values of {parameter} among base wrenches up to {}; \
         there may be more",
        values.len(),
        largest(study.scene, bound)
    ));
    DeflationRecord {
        found,
        values,
        largest_wrench: bound,
        evaluations,
    }
}
