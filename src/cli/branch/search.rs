//! Branches that do not meet those known, by deflation.

use super::follow::{Study, TYPICAL};
use nalgebra::SVector;
use serde_json::{Value, json};
use snaprod::rod::Statical;
use snaprod::scene::Continue;
use snaprod::solve::deflation::{self, further};

/// Values of the parameter at which further equilibria are sought.
const VALUES: usize = 5;

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
    values.sort_by(|a, b| (a - wanted.from).abs().total_cmp(&(b - wanted.from).abs()));
    values
}

/// Searches, follows what is found, and reports.
pub fn search<F: Statical<N>, const N: usize>(study: &mut Study<'_, F, N>) -> Value {
    let values = values(study.wanted);
    let parameter = study.wanted.parameter;
    let mut found = 0;
    let mut evaluations = 0;
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
            let known = study.known(p);
            let options = deflation::Options::default();
            let search = match further(study.family, p, &known, &[guess], &options) {
                Ok(search) => search,
                Err(e) => {
                    study
                        .remarks
                        .push(format!("deflation at {parameter} = {p}: {e}"));
                    continue 'values;
                }
            };
            evaluations += search.evaluations;
            for (k, solution) in search.solutions.iter().enumerate() {
                // One found with it may lie on its branch.
                if study.knows(p, &solution.x) {
                    continue;
                }
                if study.full(search.solutions.len() - k, "equilibria found by deflation") {
                    break 'values;
                }
                let origin = format!("deflation at {parameter} = {p}");
                match study.through(origin, solution.x, p, true) {
                    Ok(()) => found += 1,
                    Err(e) => study
                        .remarks
                        .push(format!("deflation at {parameter} = {p}: {e}")),
                }
            }
        }
    }
    study.remarks.push(format!(
        "deflation found {found} further {}: sought at {} values of {parameter} from the equilibria known there and from wrenches \
         of {TYPICAL} B/L and B/L^2 along each unknown; what was not found may still be there",
        if found == 1 { "branch" } else { "branches" },
        values.len(),
    ));
    json!({ "found": found, "values": values, "evaluations": evaluations })
}
