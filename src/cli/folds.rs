//! `snaprod folds`: fold curves of the elastica.

use super::files::{print, print_json};
use super::signals::Signals;
use super::{Ending, Refusal};
use clap::Args;
use serde_json::{Value, json};
use snaprod::study;

#[derive(Args)]
pub struct FoldsArgs {
    /// Number of fold curves.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=20))]
    pub count: u8,
    /// Print one JSON object instead of CSV.
    #[arg(long)]
    pub json: bool,
}

/// Prints each fold curve for p in [-8, 8]; the half p < 0 is the mirror image y -> -y.
pub fn folds(args: &FoldsArgs) -> Result<Ending, Refusal> {
    let table = study::folds(args.count.into(), &mut Signals::watched())?;
    let numbers = table.integers("number");
    let count = numbers.last().copied().flatten().unwrap_or(0);
    let ending = if count < args.count.into() {
        Ending::Short
    } else {
        Ending::Done
    };
    if !args.json {
        print(&table.csv());
        return Ok(ending);
    }
    let point = |row: usize| {
        let mut object = json!({ "cusp": table.words("cusp")[row] == "cusp" });
        for name in ["p", "kappa", "lam", "x", "y", "alpha", "elastic"] {
            object[name] = table.reals(name)[row].into();
        }
        object
    };
    let curve = |number: i64| {
        let own = (0..numbers.len()).filter(|row| numbers[*row] == Some(number));
        json!({ "number": number, "points": own.map(point).collect::<Vec<_>>() })
    };
    let list: Vec<Value> = (1..=count).map(curve).collect();
    print_json(json!({ "folds": list }));
    Ok(ending)
}
