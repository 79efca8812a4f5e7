//! Search by deflation for branches that are disconnected from the known ones.

use super::follow::{Study, TYPICAL_WRENCH};
use super::record::DeflationRecord;
use crate::math::small_sort::sort_few;
use crate::scene::Continue;
use crate::solve::deflation::{self, find_further};

/// Number of parameter values at which further equilibria are sought.
const VALUES: usize = 5;
/// Largest number of branches followed by the search.
const MOST: usize = 8;

/// Parameter values evenly over the range.
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
    // Sorted by distance from the start of the branch.
    sort_few(&mut values, |value| (value - wanted.from).abs());
    values
}

/// Searches for further equilibria, follows their branches, and reports.
pub fn search(study: &mut Study<'_>) -> DeflationRecord {
    let values = values(study.wanted);
    let parameter = &study.wanted.name;
    // Rods have equilibria of any order, at ever larger wrenches: bound the search.
    let bound = 2.0 * study.size().max(TYPICAL_WRENCH);
    let (mut found, mut evaluations) = (0, 0);
    'values: for &p in &values {
        let mut guesses = study.known(p);
        guesses.extend(study.subject.guesses());
        for guess in guesses {
            if study.watch.stops(p) {
                break 'values;
            }
            let options = deflation::Options::default();
            let known = study.known(p);
            let search = match find_further(study.family, p, &known, &[guess], &options) {
                Ok(search) => search,
                Err(e) => {
                    let remark = format!("deflation at {parameter} = {p}: {e}");
                    study.remarks.push(remark);
                    continue 'values;
                }
            };
            evaluations += search.evaluations;
            for solution in &search.solutions {
                // The branch of a solution found before may contain this one.
                if !(solution.x.norm() <= bound) || study.knows(p, &solution.x) {
                    continue;
                }
                let origin = format!("deflation at {parameter} = {p}");
                // A start on a known branch makes no second curve.
                let before = study.curves.len();
                match study.follow_both_ways(origin, solution.x.clone(), p, true) {
                    Ok(()) => found += study.curves.len() - before,
                    Err(e) => study
                        .lost
                        .push(format!("deflation at {parameter} = {p}: {e}")),
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
        "deflation found {found} further {branches}{limit}, sought at {} values of {parameter} among {}; \
         there may be more",
        values.len(),
        study.subject.search_description(bound)
    ));
    DeflationRecord {
        found,
        values,
        largest_wrench: study.subject.wrench_size(bound),
        evaluations,
    }
}
