//! From a scene to what the library runs: body, start and options, in units of the rod.

use super::{Landing, Place, Scales, Scene, Sheet, SheetName};
use crate::body::{Body, TimeForce};
use crate::dynamics::{LandingRule, Run, RunOptions};
use crate::elastica::{Elastica, Equilibrium, Found, equilibria_at};
use crate::error::{Error, Result};
use nalgebra::Vector2;

/// A scene made ready to run: length, stiffness and mass are 1.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The mass and its loads.
    pub body: Body<2>,
    /// The equilibrium it starts from.
    pub start: Equilibrium,
    /// Velocity at the start.
    pub velocity: Vector2<f64>,
    /// What to run.
    pub options: RunOptions,
    /// The way back to the scene's units.
    pub scales: Scales,
}

/// Loads up to which the equilibria of a start position are searched.
const START_LAMBDA: f64 = 20.0;

impl Setup {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// A start position with no equilibrium as asked for, or with several: the message lists them.
    pub fn new(scene: &Scene) -> Result<Self> {
        let plain = scene.dimensionless();
        let mut body = Body::new(1.0)?
            .with_gravity(plain.gravity.into())?
            .with_dead_force(plain.dead.into())?
            .with_drag(plain.drag)?;
        for force in &plain.forces {
            body = body.with_force(TimeForce::Harmonic {
                amplitude: Vector2::from(force.direction) * force.amplitude,
                angular_frequency: force.angular_frequency,
                phase: force.phase,
            });
        }
        let mut options = RunOptions::new(plain.duration)?
            .with_tolerance(scene.run.tolerance)?
            .with_landing(match scene.run.landing {
                Landing::Viscous => LandingRule::Viscous,
                Landing::Lowest => LandingRule::Lowest,
                Landing::All => LandingRule::All,
                Landing::Named(sheet) => LandingRule::Named(sheet),
            });
        options.max_steps = scene.run.max_steps as u64;
        options.max_snaps = scene.run.max_snaps as u64;
        Ok(Self {
            body,
            start: start(&plain.place)?,
            velocity: plain.velocity.into(),
            options,
            scales: Scales::of(scene),
        })
    }

    /// The run.
    ///
    /// # Errors
    /// A degenerate start from which no sheet can be followed.
    pub fn run(&self) -> Result<Run<'_, Elastica, 2>> {
        let q = Vector2::new(self.start.p, self.start.w);
        Run::new(&Elastica, &self.body, q, self.velocity, self.options)
    }
}

fn start(place: &Place) -> Result<Equilibrium> {
    match place {
        Place::Kappa { lambda, kappa } => Equilibrium::from_lambda_kappa(*lambda, *kappa),
        Place::P { lambda, p } => Equilibrium::from_lambda_p(*lambda, *p),
        Place::Position { position, sheet } => at_position(*position, sheet),
    }
    .map_err(|e| e.context("[start]"))
}

fn at_position([x, y]: [f64; 2], sheet: &Sheet) -> Result<Equilibrium> {
    let wanted: Vec<Found> = match sheet {
        Sheet::Named(name) => equilibria_at(x, y, START_LAMBDA)?
            .into_iter()
            .filter(|f| f.equilibrium.sheet == name.sheet)
            .collect(),
        Sheet::Stable | Sheet::Lowest => equilibria_at(x, y, START_LAMBDA)?
            .into_iter()
            .filter(Found::stable)
            .collect(),
    };
    let lowest = |a: &&Found, b: &&Found| a.equilibrium.energy.total_cmp(&b.equilibrium.energy);
    let chosen = match (sheet, wanted.as_slice()) {
        (_, []) => None,
        (_, [one]) => Some(one),
        (Sheet::Lowest, many) => many.iter().min_by(lowest),
        (
            Sheet::Named(SheetName {
                near: Some(near), ..
            }),
            many,
        ) => many.iter().min_by(|a, b| {
            let distance = |f: &Found| (f.equilibrium.lambda - near).abs();
            distance(a).total_cmp(&distance(b))
        }),
        (Sheet::Stable, many) => {
            return Err(Error::ambiguous(format!(
                "position = [{x}, {y}] (in units of the length) is shared by {} stable equilibria: {}; \
                 write sheet = \"lowest\", or name one: sheet = {{ mode = .., sign = \"..\" }}",
                many.len(),
                list(many)
            )));
        }
        (Sheet::Named(_), many) => {
            return Err(Error::ambiguous(format!(
                "position = [{x}, {y}] (in units of the length) is shared by {} equilibria of that name: {}; \
                 add near = LAMBDA to choose one",
                many.len(),
                list(many)
            )));
        }
    };
    chosen.map(|f| f.equilibrium).ok_or_else(|| {
        let all = equilibria_at(x, y, START_LAMBDA).unwrap_or_default();
        Error::unreachable(format!(
            "no equilibrium at position = [{x}, {y}] (in units of the length) is as [start] sheet asks; there are, with lambda < {START_LAMBDA}: {}",
            if all.is_empty() { "none (a taut rod: give lambda and p instead)".to_owned() } else { list(&all) }
        ))
    })
}

/// One line that names equilibria.
fn list(found: &[Found]) -> String {
    let one = |f: &Found| {
        let e = &f.equilibrium;
        format!(
            "mode {} sign {} (lambda {:.6}, kappa {:.6}, energy {:.6}, index {})",
            e.sheet.mode,
            e.sheet.sign.as_str(),
            e.lambda,
            e.kappa,
            e.energy,
            f.index
        )
    };
    found.iter().map(one).collect::<Vec<_>>().join("; ")
}
