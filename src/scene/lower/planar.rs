//! An elastic rod in a plane, and the initial equilibrium of planar rods.

use super::clamp::{self, ClampFrame};
use super::loads::point_mass;
use super::obstacles::Obstacles;
use super::{ModelKind, MotionModel};
use crate::body::{Frame, PointMass};
use crate::elastica::{
    Elastica, Equilibrium, LightRod, equilibria_at, equilibrium_under_load,
    equilibrium_under_load_and_weight,
};
use crate::error::{Error, Result};
use crate::manifold::Multivalued;
use crate::math::small_sort::sort_few;
use crate::motion::{Motion, Options, on_elastica};
use crate::scene::{Dimensionless, InitialShape, Scene, Sheet, SheetName};
use nalgebra::{Isometry3, Vector2};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// An elastic rod in a plane: a point on a sheet.
#[derive(Debug, Clone)]
pub struct ElasticPlane {
    /// The mass and its loads.
    pub body: PointMass<2>,
    /// Equilibrium at the start; `None`: the straight rod.
    pub start: Option<Equilibrium>,
    /// Velocity at the start.
    pub velocity: Vector2<f64>,
    /// Obstacles that the body hits.
    obstacles: Option<Obstacles>,
    /// Context of messages about the start.
    words: String,
}

/// Values of lambda up to which the search at a start position finds every equilibrium, for a named sheet and for
/// stable equilibria. At larger lambda only the stable ones are few, and all of them are found.
const NAMED_LAMBDA: f64 = 60.0;
const STABLE_LAMBDA: f64 = 14.0;
/// Number of equilibria listed in a message.
const MAX_LISTED: usize = 8;

impl ElasticPlane {
    /// Finds the start.
    ///
    /// # Errors
    /// A scene with damping; a start position with no matching equilibrium, or with several: the message lists them.
    pub fn new(scene: &Scene) -> Result<Self> {
        if scene.rod.damping.is_some() {
            return Err(Error::domain(
                "rod.damping: a viscoelastic rod has strains of its own, and no elastic run; leave it out",
            ));
        }
        let plain = scene.dimensionless()?;
        let mut start = start(scene, &plain)?;
        let scales = scene.scales()?;
        let mut body = body(&plain)?;
        if scene.rod.is_light() {
            let rod = light_rod(scene, &plain)?;
            if matches!(plain.start.place, InitialShape::Settled { .. }) {
                let frame = body
                    .support()
                    .map(|support| support.standing_at(0.0).at(0.0));
                start = equilibrium_under_load_and_weight(&rod, frame.as_ref(), &body.load(0.0))
                    .map_err(|e| e.context("[start]"))?;
            }
            body = body.with_rod(Arc::new(rod));
        }
        let about = match start {
            None => "[start] rest = \"straight\"",
            Some(_) => "[start]",
        };
        let seen = ClampFrame(clamp::planar(&plain.clamp)?);
        let (velocity, words) = seen.velocity(&end(start.as_ref()), &plain, about, &scales);
        Ok(Self {
            body,
            start,
            velocity,
            obstacles: Obstacles::of_point_mass(scene)?,
            words,
        })
    }
}

impl MotionModel for ElasticPlane {
    fn kind(&self) -> ModelKind {
        ModelKind::Sheet
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let from = self.start.as_ref();
        let chart = from.map(|start| Vector2::new(start.p, start.w));
        let obstacles = self.obstacles.as_ref().map(Obstacles::among);
        on_elastica(&self.body, chart, self.velocity, obstacles, options).map_err(|e| match from {
            None => e.context(self.words.as_str()),
            Some(_) => e,
        })
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        clamp::frame(&self.body, t)
    }

    fn is_driven(&self) -> bool {
        self.body.is_driven()
    }

    fn is_heavy(&self) -> bool {
        self.body.rod().is_some()
    }

    fn load(&self) -> Option<Vector2<f64>> {
        load_on_fixed_clamp(&self.body)
    }
}

/// Loads at t = 0 on a body with a clamp at rest; `None` for a moving clamp.
pub(super) fn load_on_fixed_clamp(body: &PointMass<2>) -> Option<Vector2<f64>> {
    let stands = body.support().is_none_or(|support| support.is_fixed());
    stands.then(|| body.load(0.0))
}

/// A planar rod with first-order inertia.
fn light_rod(scene: &Scene, plain: &Dimensionless) -> Result<LightRod> {
    Ok(LightRod {
        mass: scene.rod.known_mass_over_unit(&scene.scales()?)?,
        gravity: in_plane(plain.loads.gravity),
    })
}

/// Position of the end of the rod; `None` is the straight rod.
fn end(start: Option<&Equilibrium>) -> Vector2<f64> {
    start.map_or(Vector2::x(), |at| Vector2::new(at.x, at.y))
}

/// The mass and its loads.
pub(super) fn body(plain: &Dimensionless) -> Result<PointMass<2>> {
    let world = Isometry3::identity();
    point_mass(
        1.0,
        &plain.loads,
        in_plane,
        &world,
        clamp::planar(&plain.clamp)?,
    )
}

/// The planar part (x, y) of a vector.
pub(super) fn in_plane([x, y, _]: [f64; 3]) -> Vector2<f64> {
    Vector2::new(x, y)
}

/// Equilibrium at the start; `None` is the straight rod.
pub(super) fn start(scene: &Scene, plain: &Dimensionless) -> Result<Option<Equilibrium>> {
    match &plain.start.place {
        InitialShape::Kappa { lambda, kappa } => Equilibrium::from_lambda_kappa(*lambda, *kappa).map(Some),
        InitialShape::P { lambda, p } => Equilibrium::from_lambda_p(*lambda, *p).map(Some),
        InitialShape::Position { position, sheet } => {
            let at = ClampFrame(clamp::planar(&plain.clamp)?).place(*position);
            at_position(scene, at.into(), sheet).map(Some)
        }
        InitialShape::Rest { .. } => match plain.start.imperfection {
            0.0 => Ok(None),
            // A thrust along the clamp at the verge of buckling: alpha = 0 and theta(1) = 2 asin kappa.
            angle => Equilibrium::new((0.5 * angle).sin().atanh(), FRAC_PI_2).map(Some),
        },
        InitialShape::Settled { .. } => equilibrium_under_load(&body(plain)?.load(0.0)),
        _ => Err(Error::domain(
            "curvature is the start of a rod with damping; an elastic rod starts from an equilibrium",
        )),
    }
    .map_err(|e| e.context("[start]"))
}

/// An equilibrium at the start position.
struct StartCandidate {
    equilibrium: Equilibrium,
    index: usize,
    /// True if stable; false on a fold, where two equilibria coincide.
    stable: bool,
}

/// All equilibria with lambda below `bound`, and the stable ones above, by rising lambda.
fn candidates([x, y]: [f64; 2], bound: f64) -> Result<Vec<StartCandidate>> {
    let mut found: Vec<StartCandidate> = equilibria_at(x, y, bound)?
        .iter()
        .map(|f| StartCandidate {
            equilibrium: f.equilibrium,
            index: f.index,
            stable: f.stable(),
        })
        .collect();
    for q in Elastica.stable_at(&Vector2::new(x, y))? {
        let equilibrium = Equilibrium::new(q[0], q[1])?;
        if equilibrium.lambda >= bound {
            found.push(StartCandidate {
                equilibrium,
                index: 0,
                stable: true,
            });
        }
    }
    sort_few(&mut found, |each| each.equilibrium.lambda);
    Ok(found)
}

fn at_position(scene: &Scene, position: [f64; 2], sheet: &Sheet) -> Result<Equilibrium> {
    let wanted = match sheet {
        Sheet::Named(name) => {
            let mut found = candidates(position, NAMED_LAMBDA)?;
            found.retain(|c| c.equilibrium.sheet == name.sheet);
            found
        }
        Sheet::Stable | Sheet::Lowest => {
            let mut found = candidates(position, STABLE_LAMBDA)?;
            found.retain(|c| c.stable);
            found
        }
    };
    let by = |measure: &dyn Fn(&Equilibrium) -> f64| {
        let order = |a: &&StartCandidate, b: &&StartCandidate| {
            measure(&a.equilibrium).total_cmp(&measure(&b.equilibrium))
        };
        wanted.iter().min_by(order)
    };
    let asked = position_text(scene);
    let chosen = match (sheet, wanted.as_slice()) {
        (_, []) => None,
        (_, [one]) => Some(one),
        (Sheet::Lowest, _) => by(&|e| e.energy),
        (
            Sheet::Named(SheetName {
                near: Some(near), ..
            }),
            _,
        ) => by(&|e| (e.lambda - near).abs()),
        (Sheet::Stable, many) => {
            return Err(Error::ambiguous(format!(
                "{asked} is shared by {} stable equilibria: {}; \
                 write sheet = \"lowest\", or name one: sheet = {{ mode = .., sign = \"..\" }}",
                many.len(),
                list(scene, many)
            )));
        }
        (Sheet::Named(_), many) => {
            return Err(Error::ambiguous(format!(
                "{asked} is shared by {} equilibria of that name: {}; add near = LAMBDA to choose one",
                many.len(),
                list(scene, many)
            )));
        }
    };
    match chosen {
        Some(chosen) => Ok(chosen.equilibrium),
        None => {
            let all = candidates(position, NAMED_LAMBDA)?;
            Err(Error::unreachable(format!(
                "no equilibrium at {asked} is as [start] sheet asks; there are, with lambda < {NAMED_LAMBDA}: {}",
                list(scene, &all)
            )))
        }
    }
}

/// The start position in the scene's numbers, for messages.
fn position_text(scene: &Scene) -> String {
    let InitialShape::Position {
        position: [x, y, _],
        ..
    } = &scene.start.place
    else {
        return String::new();
    };
    let unit = scene.units.length();
    let space = if unit.is_empty() { "" } else { " " };
    format!("position = [{x:?}, {y:?}]{space}{unit}")
}

/// List of equilibria on one line, with energies in the scene's units.
fn list(scene: &Scene, found: &[StartCandidate]) -> String {
    let scale = scene.scales().map_or(f64::NAN, |scales| scales.energy);
    let unit = scene.units.energy();
    let space = if unit.is_empty() { "" } else { " " };
    let one = |c: &StartCandidate| {
        let e = &c.equilibrium;
        format!(
            "mode {} sign {} (lambda {:.6}, kappa {:.6}, energy {:.6}{space}{unit}, index {})",
            e.sheet.mode,
            e.sheet.sign.as_str(),
            e.lambda,
            e.kappa,
            e.energy * scale,
            c.index
        )
    };
    let mut texts: Vec<String> = found.iter().take(MAX_LISTED).map(one).collect();
    match found.len().saturating_sub(MAX_LISTED) {
        0 if found.is_empty() => texts.push("none".to_owned()),
        0 => {}
        more => texts.push(format!("and {more} more of higher lambda")),
    }
    texts.join("; ")
}
