//! Properties of the scene reader and of the kernels for arbitrary input. `fuzz/` generates inputs with a fuzzer; the
//! suite uses the inputs kept in `fuzz/seeds/`.

use nalgebra::{Vector2, Vector6};
use snaprod::elastica::{
    DraggedRod, Elastica, EndStiffness, Equilibrium, equilibria_at, equilibrium_under_load,
    fold_at, folds, held_modes,
};
use snaprod::manifold::{EquilibriumManifold, invert_near};
use snaprod::math::{elliptic, jacobi};
use snaprod::rod::Rod;
use snaprod::scene::{Faults, Scene};
use snaprod::section::Linear;

/// `Err` with a description if a required property fails.
pub type Held = Result<(), String>;

/// A scene; lines that begin with `--set ` are overrides. The scene is read, or every fault has its place and message.
pub fn reader(input: &[u8]) -> Held {
    let Ok(text) = std::str::from_utf8(input) else {
        return match Scene::from_bytes(input) {
            Err(faults) => told(&faults, input.len() + 1),
            Ok(_) => Err("bytes that are no text were read".to_owned()),
        };
    };
    let (set, lines): (Vec<&str>, Vec<&str>) = text
        .split('\n')
        .partition(|line| line.starts_with("--set "));
    let set: Vec<&str> = set.iter().map(|line| &line["--set ".len()..]).collect();
    match Scene::parse_with(&lines.join("\n"), &set) {
        Ok(_) => Ok(()),
        Err(faults) => told(&faults, lines.len()),
    }
}

/// Every fault has a place and a message.
fn told(faults: &Faults, lines: usize) -> Held {
    if faults.as_slice().is_empty() {
        return Err("refused without a fault".to_owned());
    }
    for fault in faults.as_slice() {
        let placed = match fault.set {
            Some(_) => (fault.line, fault.column) == (0, 0),
            None => (1..=lines).contains(&fault.line) && fault.column >= 1,
        };
        if !placed || fault.to_string().len() < 10 {
            return Err(format!("a fault without place or words: {fault:?}"));
        }
    }
    Ok(())
}

/// Evaluates the kernel named in the line at the arguments, missing ones being 0. The results must be finite, or an
/// error with a message.
pub fn kernel(line: &str) -> Held {
    let mut words = line.split_whitespace();
    let Some(name) = words.next() else {
        return Ok(());
    };
    let mut x = [0.0; 6];
    for (x, word) in x.iter_mut().zip(words) {
        *x = word.parse().unwrap_or(f64::NAN);
    }
    match values(name, x) {
        Ok(values) => match values.iter().find(|x| !x.is_finite()) {
            Some(bad) => Err(format!("{line}: {bad} among {values:?}")),
            None => Ok(()),
        },
        Err(why) if why.to_string().len() < 10 => {
            Err(format!("{line}: an error without words: {why}"))
        }
        Err(_) => Ok(()),
    }
}

fn values(
    name: &str,
    [a, b, c, d, e, f]: [f64; 6],
) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let q = Vector2::new(a, b);
    Ok(match name {
        "rf" => vec![elliptic::carlson_rf(a, b, c)?],
        "rd" => vec![elliptic::carlson_rd(a, b, c)?],
        "complete" => {
            let all = elliptic::complete(a)?;
            vec![all.k, all.e, all.b, all.k_kc, all.e_kc]
        }
        "incomplete" => {
            let all = elliptic::incomplete(a, b)?;
            vec![all.f, all.e, all.b, all.f_phi, all.e_phi]
        }
        "jacobi" => {
            let j = jacobi::jacobi(a, b)?;
            let off = (j.sn.hypot(j.cn) - 1.0).abs()
                + (j.dn.hypot((1.0 - b * b).max(0.0).sqrt() * j.sn) - 1.0).abs();
            vec![j.am, ensured(off < 1e-14, off)?]
        }
        "chart" => of_shape(&Equilibrium::new(a, b)?)?,
        "load" => of_shape(&Equilibrium::from_lambda_p(a, b)?)?,
        "kappa" => of_shape(&Equilibrium::from_lambda_kappa(a, b)?)?,
        "stiffness" => EndStiffness::at(a, b)?.matrix.as_slice().to_vec(),
        "held" => held_modes(a, b, 2)?
            .iter()
            .flat_map(|mode| [mode.stiffness, mode.friction])
            .collect(),
        "index" => vec![folds::index(a, b)? as f64],
        "fold" => of_shape(&fold_at(a as usize, b)?.equilibrium)?,
        "settled" => match equilibrium_under_load(&q)? {
            Some(shape) => of_shape(&shape)?,
            None => Vec::new(),
        },
        "equilibria" => {
            let mut all = Vec::new();
            for found in equilibria_at(a, b, c)? {
                let off = (found.equilibrium.x - a).hypot(found.equilibrium.y - b);
                all.push(ensured(off < 1e-12 && found.residual < 1e-12, off)?);
                all.extend(of_shape(&found.equilibrium)?);
            }
            all
        }
        "invert" => {
            let found = invert_near(&Elastica, &q, &Vector2::new(c, d), 1e-13)?;
            let there = Elastica
                .point(&found.q)
                .ok_or("an answer outside the chart")?;
            let off = (there.pose - q).norm();
            vec![ensured(off < 1e-12, off)?]
        }
        "dragged" => {
            let mut rod = DraggedRod::new(q)?;
            let snaps = rod.drag_to(&Vector2::new(c, d))?;
            let off = (rod.place() - Vector2::new(c, d)).norm();
            let released = snaps.iter().map(|snap| snap.released);
            released.chain([ensured(off < 1e-12, off)?]).collect()
        }
        "rod" => {
            let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.4], 0.8)?)?;
            let end = rod.end(&Vector6::new(a, b, c, d, e, f), 1e-8)?;
            let place = end
                .section
                .position
                .iter()
                .chain(end.section.directors.iter());
            place.chain(end.tangent.iter()).copied().collect()
        }
        _ => Vec::new(),
    })
}

fn of_shape(shape: &Equilibrium) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let middle = shape.section(0.5)?;
    Ok(vec![
        shape.p,
        shape.w,
        shape.lambda,
        shape.alpha,
        shape.theta1,
        shape.x,
        shape.y,
        shape.energy,
        shape.force[0],
        shape.force[1],
        middle.theta,
        middle.curvature,
        middle.x,
        middle.y,
        folds::index(shape.p, shape.w)? as f64,
    ])
}

/// The error `off`, or NaN if the condition fails.
fn ensured(holds: bool, off: f64) -> Result<f64, Box<dyn std::error::Error>> {
    Ok(if holds { off } else { f64::NAN })
}
