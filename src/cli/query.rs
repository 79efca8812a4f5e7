//! `snaprod elastica` and `snaprod equilibria`.

use super::files::{number, print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::{Value, json};
use snaprod::elastica::{
    Elastica, Equilibrium, Found, PlanarSection, equilibria_at, fold_distance,
};
use snaprod::manifold::{EquilibriumManifold, Sheet, Sign};
use std::fmt::Write;

#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct ElasticaArgs {
    /// lambda = sqrt(|force|) > 0.
    #[arg(long, requires = "modulus", conflicts_with_all = ["mode", "sign", "k", "beta"])]
    pub lambda: Option<f64>,
    /// kappa = sin((theta(1) - alpha)/2), in (-1, 1).
    #[arg(long, group = "modulus", requires = "lambda")]
    pub kappa: Option<f64>,
    /// p, kappa = tanh p: for taut and looped rods.
    #[arg(long, group = "modulus", requires = "lambda")]
    pub p: Option<f64>,
    /// Mode j of the sheet S_j^+-.
    #[arg(long, requires_all = ["sign", "k", "beta"])]
    pub mode: Option<u32>,
    /// Sign of the sheet, + or -.
    #[arg(long, requires = "mode", value_parser = ["+", "-"], allow_hyphen_values = true)]
    pub sign: Option<String>,
    /// The paper's k, in [0, 1).
    #[arg(long, requires = "mode")]
    pub k: Option<f64>,
    /// The paper's beta, in [-pi/2, pi/2].
    #[arg(long, requires = "mode")]
    pub beta: Option<f64>,
    /// Arclengths, in [0, 1], at which to describe the shape.
    #[arg(long, value_delimiter = ',', num_args = 1..)]
    pub s: Vec<f64>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct EquilibriaArgs {
    /// End position x,y (length 1).
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_point)]
    pub at: [f64; 2],
    /// Only equilibria with lambda below this, at most 60.
    #[arg(long, default_value_t = 14.0)]
    pub lambda_max: f64,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<_> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.as_slice() {
        [Ok(x), Ok(y)] => Ok([*x, *y]),
        _ => Err("write two numbers with a comma between them, as in 0.5,-0.2".to_owned()),
    }
}

/// Describes one equilibrium.
pub fn elastica(args: &ElasticaArgs) -> Result<Ending, Refusal> {
    let e = asked(args)?;
    let index = Elastica.index(&nalgebra::Vector2::new(e.p, e.w))?;
    // Not resolved beyond |p| = 345: the fold is hundreds away there.
    let distance = fold_distance(&e).ok();
    let sections: Vec<PlanarSection> = args
        .s
        .iter()
        .map(|&s| e.section(s))
        .collect::<Result<_, _>>()?;
    if args.json {
        let mut object = describe(&e);
        let more = json!({
            "x": e.x,
            "y": e.y,
            "one_minus_x": e.one_minus_x,
            "energy": e.energy,
            "force": e.force,
            "index": index,
            "stable": index == 0,
            "fold_distance": distance,
            "sections": sections.iter().map(section_json).collect::<Vec<_>>(),
        });
        merge(&mut object, more);
        print_json(object);
        return Ok(Ending::Done);
    }
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    line(
        "sheet",
        format!(
            "{} (mode {}, sign {})",
            e.sheet,
            e.sheet.mode,
            e.sheet.sign.as_str()
        ),
    );
    line("lambda", number(e.lambda));
    line(
        "kappa",
        format!(
            "{}   (p = {}, kappa' = {})",
            number(e.kappa),
            number(e.p),
            number(e.kappa_c)
        ),
    );
    line("w", number(e.w));
    line("k, beta", pair(e.k, e.beta));
    line("alpha", number(e.alpha));
    line("theta(1)", number(e.theta1));
    line(
        "x, y",
        format!("{}   (1 - x = {})", pair(e.x, e.y), number(e.one_minus_x)),
    );
    line("energy", number(e.energy));
    line("force on mass", pair(e.force[0], e.force[1]));
    line(
        "index",
        format!(
            "{index} ({})",
            if index == 0 { "stable" } else { "unstable" }
        ),
    );
    line(
        "fold distance",
        match distance {
            Some(distance) => format!(
                "{} in lambda, to the first fold at this kappa",
                number(distance)
            ),
            None => "beyond what doubles resolve: hundreds in lambda".to_owned(),
        },
    );
    if !sections.is_empty() {
        line("s", "theta, theta', x, y".to_owned());
        for s in &sections {
            line(
                &number(s.s),
                format!("{}, {}", pair(s.theta, s.curvature), pair(s.x, s.y)),
            );
        }
    }
    print(&text);
    Ok(Ending::Done)
}

fn pair(a: f64, b: f64) -> String {
    format!("{}, {}", number(a), number(b))
}

fn asked(args: &ElasticaArgs) -> Result<Equilibrium, Refusal> {
    let e = match (args.lambda, args.kappa, args.p) {
        (Some(lambda), Some(kappa), _) => Equilibrium::from_lambda_kappa(lambda, kappa)?,
        (Some(lambda), None, Some(p)) => Equilibrium::from_lambda_p(lambda, p)?,
        _ => match (args.mode, args.sign.as_deref(), args.k, args.beta) {
            (Some(mode), Some(sign), Some(k), Some(beta)) => {
                let sign = if sign == "-" { Sign::Minus } else { Sign::Plus };
                Equilibrium::from_sheet(Sheet { mode, sign }, k, beta)?
            }
            _ => {
                return Err(Refusal(
                    "give --lambda with --kappa or --p, or --mode, --sign, --k and --beta"
                        .to_owned(),
                ));
            }
        },
    };
    if e.kappa == 0.0 {
        return Err(Refusal(
            "kappa = 0 is the straight rod, whatever lambda: its end is at (1, 0), its energy 0"
                .to_owned(),
        ));
    }
    Ok(e)
}

fn section_json(s: &PlanarSection) -> Value {
    json!({ "s": s.s, "theta": s.theta, "curvature": s.curvature, "x": s.x, "y": s.y })
}

/// The labels of an equilibrium.
pub fn describe(e: &Equilibrium) -> Value {
    json!({
        "lam": e.lambda,
        "p": e.p,
        "w": e.w,
        "kappa": e.kappa,
        "mode": e.sheet.mode,
        "sign": e.sheet.sign.as_str(),
        "k": e.k,
        "beta": e.beta,
        "alpha": e.alpha,
        "theta1": e.theta1,
    })
}

/// Adds the entries of `more` to the object `to`.
pub fn merge(to: &mut Value, more: Value) {
    if let (Value::Object(to), Value::Object(more)) = (to, more) {
        to.extend(more);
    }
}

/// Lists all equilibria at a point.
pub fn equilibria(args: &EquilibriaArgs) -> Result<Ending, Refusal> {
    let [x, y] = args.at;
    if args.at == [1.0, 0.0] {
        let note = "the rod is straight, under any load along itself: the force is not determined by the position";
        if args.json {
            print_json(
                json!({ "at": args.at, "lambda_max": args.lambda_max, "equilibria": [], "note": note }),
            );
        } else {
            print(&format!("at (1, 0) {note}\n"));
        }
        return Ok(Ending::Done);
    }
    let found = equilibria_at(x, y, args.lambda_max)?;
    if args.json {
        let list: Vec<Value> = found.iter().map(found_json).collect();
        print_json(json!({ "at": args.at, "lambda_max": args.lambda_max, "equilibria": list }));
        return Ok(Ending::Done);
    }
    let mut text = format!(
        "{} with the end at ({}) and lambda < {}\n",
        match found.len() {
            0 => "no equilibrium".to_owned(),
            1 => "one equilibrium".to_owned(),
            n => format!("{n} equilibria"),
        },
        pair(x, y),
        number(args.lambda_max)
    );
    if found.is_empty() {
        text.push_str("a rod that is nearly taut needs more: try --lambda-max 60, or elastica with --lambda and --p\n");
    } else {
        let _ = writeln!(
            text,
            "{:>6} {:>14} {:>14} {:>12} {:>12} {:>14} {:>5}",
            "sheet", "lambda", "p", "alpha", "theta(1)", "energy", "index"
        );
    }
    for f in &found {
        let e = &f.equilibrium;
        let _ = writeln!(
            text,
            "{:>6} {:>14.9} {:>14.9} {:>12.8} {:>12.8} {:>14.9} {:>5}{}",
            e.sheet.to_string(),
            e.lambda,
            e.p,
            e.alpha,
            e.theta1,
            e.energy,
            f.index,
            if f.degenerate {
                "  on a fold: two in one"
            } else if f.stable() {
                "  stable"
            } else {
                ""
            }
        );
    }
    print(&text);
    Ok(Ending::Done)
}

fn found_json(f: &Found) -> Value {
    let mut object = describe(&f.equilibrium);
    let more = json!({
        "elastic": f.equilibrium.energy,
        "force": f.equilibrium.force,
        "index": f.index,
        "stable": f.stable(),
        "degenerate": f.degenerate,
        "residual": f.residual,
    });
    merge(&mut object, more);
    object
}
