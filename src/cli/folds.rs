//! `snaprod folds`.

use super::files::{exact, print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::{Value, json};
use snaprod::elastica::{FoldPoint, fold_curve};

#[derive(Args)]
pub struct FoldsArgs {
    /// How many fold curves.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=20))]
    pub count: u8,
    /// Print one JSON object instead of CSV.
    #[arg(long)]
    pub json: bool,
}

/// The range of |p| that is printed, and the spacing of points in arclength over (p, lambda).
const P_RANGE: (f64, f64) = (0.01, 8.0);
const SPACING: f64 = 0.05;

/// Prints the fold curves from p = -8 to 8: the half p < 0 is the mirror image y -> -y.
pub fn folds(args: &FoldsArgs) -> Result<Ending, Refusal> {
    let mut curves = Vec::new();
    for number in 1..=usize::from(args.count) {
        curves.push(fold_curve(number, P_RANGE.0, P_RANGE.1, SPACING)?);
    }
    if args.json {
        let list: Vec<Value> = curves
            .iter()
            .map(|half| json!({ "number": half[0].number, "points": rows(half).map(|r| r.json()).collect::<Vec<_>>() }))
            .collect();
        print_json(json!({ "folds": list }));
        return Ok(Ending::Done);
    }
    let mut text = "number,p,kappa,lam,x,y,alpha,elastic,cusp\n".to_owned();
    for half in &curves {
        for row in rows(half) {
            text.push_str(&row.csv());
        }
    }
    print(&text);
    Ok(Ending::Done)
}

/// A fold point or its mirror image.
struct Row<'a> {
    point: &'a FoldPoint,
    /// 1, or -1 for the mirror image.
    side: f64,
}

fn rows(half: &[FoldPoint]) -> impl Iterator<Item = Row<'_>> {
    let mirrored = half.iter().rev().map(|point| Row { point, side: -1.0 });
    mirrored.chain(half.iter().map(|point| Row { point, side: 1.0 }))
}

impl Row<'_> {
    fn csv(&self) -> String {
        let (e, side) = (&self.point.equilibrium, self.side);
        format!(
            "{},{},{},{},{},{},{},{},{}\n",
            self.point.number,
            exact(side * e.p),
            exact(side * e.kappa),
            exact(e.lambda),
            exact(e.x),
            exact(side * e.y),
            exact(side * e.alpha),
            exact(e.energy),
            if self.point.cusp { "cusp" } else { "" }
        )
    }

    fn json(&self) -> Value {
        let (e, side) = (&self.point.equilibrium, self.side);
        json!({
            "p": side * e.p,
            "kappa": side * e.kappa,
            "lam": e.lambda,
            "x": e.x,
            "y": side * e.y,
            "alpha": side * e.alpha,
            "elastic": e.energy,
            "cusp": self.point.cusp,
        })
    }
}
