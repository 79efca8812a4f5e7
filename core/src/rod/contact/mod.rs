//! Rods at rest that touch obstacles at points, without friction.
//!
//! A touch at s_i lets the force along the rod fall by R nu, with R >= 0 and nu the obstacle's unit normal. Frame,
//! couple and centreline are continuous. The unknowns are the base wrench, and for each touch its reaction R_i and its
//! place s_i; the equations are the end condition, gap = 0 and nu.d3 = 0. At the free end the place is known, and
//! gap = 0 remains.
//!
//! A point touch needs a section that does not shear: a rod that shears has a kink there. Rods that can shear, and
//! loads that turn with the rod, are refused.
//!
//! ```
//! # use snaprod_core as snaprod;
//! use nalgebra::Vector3;
//! use snaprod::contact::Obstacle;
//! use snaprod::rod::contact::{ContactOptions, ContactProblem, Surface};
//! use snaprod::rod::{EndConditions, Problem, Rod};
//! use snaprod::section::Linear;
//!
//! // A cantilever along z, whose end is pressed towards -x; a peg lies below its middle.
//! let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 1.0)?)?;
//! let load = EndConditions::load(Vector3::new(-3.0, 0.0, 0.0), Vector3::zeros());
//! let peg = Obstacle::cylinder(Vector3::new(-0.1, 0.0, 0.5), Vector3::y(), 0.05, false)?;
//! let problem = Problem::new(rod, load, 1e-12)?;
//! let among = ContactProblem::new(problem, vec![Surface::new(peg, 0.01)?], ContactOptions::default())?;
//! let found = among.solve(None)?;
//! assert_eq!(found.touches.len(), 1);
//! assert!(found.touches[0].reaction > 0.0 && found.min_gap > -1e-10);
//! # Ok::<(), snaprod::Error>(())
//! ```

mod active_set;
mod branch;
mod capstan;
mod closest_points;
mod equations;
mod index;
mod lying;
mod sheet;
mod taylor_piece;
mod touched_rod;

pub use branch::{ContactBranch, ContactBranchPoint, ContactEvent, ContactEventKind, ContactStop};
pub use capstan::{Capstan, CapstanSide, CapstanSlip};
pub use sheet::{Bound, ElasticaAmong, Room, SheetSection, TouchedSheet};

use super::distributed_load::ScaledLoad;
use super::ivp::Wrench;
use super::planar::Plane;
use super::problem::Problem;
use super::solution_path::Path;
use super::{Rod, RodSection};
use crate::error::{Error, Result};
use crate::math::se3::join;
use crate::obstacle::{Feature, Gap, Obstacle};
use closest_points::TouchedSteps;
use nalgebra::{DMatrix, Vector3};
use touched_rod::LoadedRod;

/// An obstacle as the centreline of a rod sees it: farther out by half of the rod's contact diameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    obstacle: Obstacle,
    offset: f64,
}

impl Surface {
    /// An obstacle whose surface the centreline approaches to within `offset`, half of the rod's contact diameter.
    ///
    /// Boxes, polygons and segments have edges without a normal: they need an offset > 0.
    ///
    /// # Errors
    /// An offset that is not finite or < 0, or 0 on a sharp obstacle.
    pub fn new(obstacle: Obstacle, offset: f64) -> Result<Self> {
        if !(offset >= 0.0 && offset.is_finite()) {
            return Err(Error::domain(format!(
                "the offset of an obstacle = {offset} must be finite and >= 0: half of the rod's contact diameter"
            )));
        }
        let is_sharp = match &obstacle {
            Obstacle::Cuboid { .. } | Obstacle::Prism { .. } => true,
            Obstacle::Capsule { radius, .. } => *radius == 0.0,
            _ => false,
        };
        if is_sharp && offset == 0.0 {
            return Err(Error::domain(
                "the offset of a box, a polygon or a segment without radius = 0 must be > 0: a sharp edge has no normal; \
                 give half of the rod's contact diameter",
            ));
        }
        Ok(Self { obstacle, offset })
    }

    /// The obstacle.
    pub fn obstacle(&self) -> &Obstacle {
        &self.obstacle
    }

    /// Half of the rod's contact diameter.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The gap between the obstacle and a rod whose centreline is at `x`.
    pub fn gap(&self, x: &Vector3<f64>) -> Gap {
        self.obstacle.gap(x).less(self.offset)
    }
}

/// Limits of a search for an equilibrium with touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactOptions {
    /// Most touches at once, from 1 to 16.
    pub max_touches: usize,
    /// The largest step of a continuation from the free rod, as a part of the whole way.
    pub step: f64,
}

impl Default for ContactOptions {
    fn default() -> Self {
        Self {
            max_touches: 8,
            step: 0.25,
        }
    }
}

/// A guessed touch: number of the surface, place and reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuessedTouch {
    /// Number of the surface.
    pub surface: usize,
    /// Arclength from the clamp; None for a touch of the free end.
    pub s: Option<f64>,
    /// Reaction R on the rod along the normal. For a line: the reaction at the line's end.
    pub reaction: f64,
    /// Length of the rod that lies on the surface; 0 for a point.
    pub length: f64,
}

impl From<&TouchPoint> for GuessedTouch {
    fn from(touch: &TouchPoint) -> Self {
        Self {
            surface: touch.surface,
            s: (!touch.at_end).then_some(touch.s),
            reaction: touch.line.map_or(touch.reaction, |line| line.at_end),
            length: touch.line.map_or(0.0, |line| line.length),
        }
    }
}

/// A guess of an equilibrium: a base wrench (m(0), n(0)) in the world, and touches.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactGuess {
    /// Base wrench in the world.
    pub base: Wrench,
    /// The touches, in any order.
    pub touches: Vec<GuessedTouch>,
}

/// A point at which the rod touches a surface, in the world and in the user's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchPoint {
    /// Number of the surface.
    pub surface: usize,
    /// Arclength from the clamp.
    pub s: f64,
    /// True if the free end touches.
    pub at_end: bool,
    /// Reaction R >= 0 on the rod. For a line: the sum of both end reactions and of the pressure.
    pub reaction: f64,
    /// The stretch of the rod that lies on the surface, from `s` on; None for a point.
    pub line: Option<TouchLine>,
    /// Place of the centreline.
    pub position: Vector3<f64>,
    /// The unit normal from the obstacle outwards: the direction of R.
    pub normal: Vector3<f64>,
    /// Relative curvature h'' of the gap along the rod, > 0 at a point touch; 0 where line contact begins.
    pub relative_curvature: f64,
    /// The nearest part of the obstacle.
    pub feature: Feature,
}

/// A stretch of the rod that lies on a surface; forces in the user's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchLine {
    /// Length of the stretch.
    pub length: f64,
    /// Reactions >= 0 at the start and at the end of the stretch. At a clamp that lies on the surface, and at the end
    /// of the rod, the reaction there belongs to the support and is 0 here.
    pub at_start: f64,
    /// Reaction at the end.
    pub at_end: f64,
    /// Integral of the pressure over the stretch.
    pub pressed: f64,
}

/// A rod at rest that touches obstacles.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactEquilibrium {
    /// Base wrench (m(0), n(0)) in the world.
    pub base: Wrench,
    /// The section at the end, with the force beyond a touch of the end.
    pub end: RodSection,
    /// The touches, in the order of their places.
    pub touches: Vec<TouchPoint>,
    /// The least gap along the rod apart from its clamp and from its touches; infinite without surfaces.
    pub min_gap: f64,
    /// Potential -int f.r ds of the load along the rod, in the world; 0 without one.
    pub potential: f64,
    /// Morse index with the touches of R > 0 held; 0 is stable. In the plane if the problem is solved there. None where
    /// the rod lies along a surface: the index is not computed then.
    pub index: Option<usize>,
    /// Morse index with touches of reaction 0 set free; equal to `index` without such touches.
    pub index_released: Option<usize>,
    /// Number of neutral modes; they count as stable.
    pub neutral: usize,
    /// Derivatives dG_i/dR_j of the gaps of point touches by their reactions, at held end condition, by user's units.
    pub compliance: DMatrix<f64>,
    /// Norm of the residual, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
    /// Way on which the equilibrium was found.
    pub way: Way,
}

/// Way on which an equilibrium was found. The state at rest may depend on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the free rod, or the guess, at once: neither enters an obstacle. A free rod may lie beyond an obstacle that
    /// the unloaded rod could not pass.
    Direct,
    /// The loads grew from zero with the obstacles in their places.
    Loads,
    /// The obstacles were put back to where the rod at the start would enter them.
    Obstacles,
    /// A path of the caller's.
    Given,
}

/// A touch in the units of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScaledTouch {
    surface: usize,
    /// Place in (0, 1), 1 at the end; of a line its start, 0 at the clamp.
    s: f64,
    at_end: bool,
    /// Reaction. For a line: the reaction at the line's end, 0 if the line goes on to the end of the rod.
    reaction: f64,
    /// The rod lies along the surface from the place on.
    line: Option<Line>,
}

/// A stretch of the rod that lies on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    length: f64,
    /// The stretch begins at the clamp.
    from_clamp: bool,
    /// The stretch goes on to the end of the rod.
    to_end: bool,
}

impl Line {
    /// The stretch of a given length from s on. A stretch from s = 0 begins at the clamp.
    fn over(s: f64, length: f64) -> Self {
        Self {
            length,
            from_clamp: s == 0.0,
            to_end: s + length > 1.0 - 1e-9,
        }
    }
}

impl ScaledTouch {
    /// The unknowns: reaction unless a line goes on to the end of the rod; place unless the clamp or the end holds it;
    /// length of a line that does not go on to the end.
    fn has(&self) -> [bool; 3] {
        match self.line {
            None => [true, !self.at_end, false],
            Some(line) => [!line.to_end, !line.from_clamp, !line.to_end],
        }
    }

    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        self.has().iter().filter(|has| **has).count()
    }

    /// Number of equations: gap, slope and relative curvature are zero where they are not so by themselves. Where a
    /// line begins at the clamp, the couple is that of the surface's curvature, and the force is along the rod.
    fn equations(&self) -> usize {
        match self.line {
            None => self.unknowns(),
            Some(line) if line.from_clamp => 2,
            Some(_) => 3,
        }
    }

    /// This point as a line of a small length about it; `before` is the force across the rod before the touch.
    fn as_line(&self, before: f64, length: f64) -> Self {
        Self {
            s: self.s - 0.5 * length,
            reaction: (self.reaction - before).max(0.0),
            line: Some(Line {
                length,
                from_clamp: false,
                to_end: false,
            }),
            ..*self
        }
    }

    /// This touch of the end as a line of a small length up to the end.
    fn as_line_to_end(&self, length: f64) -> Self {
        Self {
            s: 1.0 - length,
            at_end: false,
            reaction: 0.0,
            line: Some(Line {
                length,
                from_clamp: false,
                to_end: true,
            }),
            ..*self
        }
    }

    /// The end of a line; the place of a point.
    fn to(&self) -> f64 {
        match self.line {
            None => self.s,
            Some(Line { to_end: true, .. }) => 1.0,
            Some(line) => self.s + line.length,
        }
    }

    /// True if the rod lies on the surface up to its end.
    fn goes_on_to_end(&self) -> bool {
        self.line.is_some_and(|line| line.to_end)
    }
}

/// A problem of a rod among obstacles.
#[derive(Debug, Clone)]
pub struct ContactProblem {
    problem: Problem,
    surfaces: Vec<Surface>,
    options: ContactOptions,
    /// By how much all surfaces are moved inwards: the parameter of a continuation, in the user's units.
    withdrawn: f64,
    /// The plane that holds the rod, if the problem is solved in a plane.
    plane: Option<Plane>,
    load: ScaledLoad,
}

impl ContactProblem {
    /// A rod with its end condition and its loads along the rod, and the surfaces that it may touch.
    ///
    /// [`Problem::with_path`] decides between plane and space: `Auto` takes the plane if the data are planar and the
    /// surfaces symmetric about the plane. In the plane the index counts variations within the plane only.
    ///
    /// # Errors
    /// A rod that shears; loads that turn with the rod; the plane asked for where the data are not planar; a clamp or a
    /// held end inside an obstacle; options outside their sets.
    pub fn new(problem: Problem, surfaces: Vec<Surface>, options: ContactOptions) -> Result<Self> {
        if problem.is_followed() {
            return Err(Error::domain(
                "a rod that touches obstacles bears no follower loads here: leave out the loads that turn with the rod, or the obstacles",
            ));
        }
        if touched_rod::shears(&problem.rod.law)? {
            return Err(Error::domain(
                "a rod that can shear has a kink where an obstacle touches it at a point; give the section rigid shear \
                 (law.shear = \"rigid\") or use a barrier",
            ));
        }
        if !(options.step > 0.0 && options.step <= 1.0) {
            return Err(Error::domain(format!(
                "the largest step of the contact search = {} must be in (0, 1]",
                options.step
            )));
        }
        if !(1..=MOST_TOUCHES).contains(&options.max_touches) {
            return Err(Error::domain(format!(
                "max_touches = {} must be from 1 to {MOST_TOUCHES}",
                options.max_touches
            )));
        }
        let clamp = problem.rod.clamp.translation.vector;
        let [x, y, z] = problem.end.position;
        let end = x.zip(y).zip(z).map(|((x, y), z)| Vector3::new(x, y, z));
        let held = [Some(("clamp", clamp)), end.map(|end| ("held end", end))];
        for (what, place) in held.into_iter().flatten() {
            for (k, surface) in surfaces.iter().enumerate() {
                let gap = surface.gap(&place).value;
                if !(gap >= -HELD_DEPTH * problem.rod.length) {
                    return Err(Error::domain(format!(
                        "the {what} lies inside obstacle {}, by {:.6e} at ({:.6}, {:.6}, {:.6}); move the obstacle or the {what}",
                        k + 1,
                        -gap,
                        place.x,
                        place.y,
                        place.z
                    )));
                }
            }
        }
        let load = problem.weight.clone().unwrap_or_else(ScaledLoad::nothing);
        let mut this = Self {
            problem,
            surfaces,
            options,
            withdrawn: 0.0,
            plane: None,
            load,
        };
        if this.problem.path != Path::Spatial {
            let found = this.find_plane();
            if let (Err(why), Path::Planar | Path::ClosedForm) = (&found, this.problem.path) {
                return Err(Error::domain(format!(
                    "solve.path = \"{}\" does not hold here: {why}; use \"auto\"",
                    this.problem.path.as_str()
                )));
            }
            this.plane = found.ok();
        }
        Ok(this)
    }

    /// A plane of symmetry of the rod's problem and of all surfaces, or the reason why there is none. Where the data of
    /// the rod leave a choice, the planes of constant z and those that hold a surface's normal are tried first.
    fn find_plane(&self) -> std::result::Result<Plane, String> {
        let normals = (self.surfaces.iter().enumerate()).map(|(k, _)| {
            let middle = Vector3::z() * 0.5;
            self.gap(k, &middle).normal.cross(&Vector3::z())
        });
        let likely = [self.problem.axes[2]].into_iter().chain(normals);
        let guesses = likely.map(|normal| join(&normal, &Vector3::zeros()));
        let mut why = String::new();
        for guess in guesses.map(Some).chain([None]) {
            match self.problem.plane(guess.as_ref()) {
                Ok(plane) if self.is_symmetric_about(&plane) => return Ok(plane),
                Ok(_) => {
                    "an obstacle is not symmetric about the plane of the rod".clone_into(&mut why)
                }
                Err(other) => why = other,
            }
        }
        Err(why)
    }

    /// This problem in the plane of another one, or in space if the other one is solved there. Data with several planes
    /// of symmetry leave the choice of the plane open, and equilibria of one branch need one plane.
    ///
    /// # Errors
    /// Data that are not planar, or surfaces that are not symmetric about the plane.
    pub fn in_plane_of(mut self, other: &Self) -> Result<Self> {
        let Some(plane) = other.plane else {
            self.plane = None;
            return Ok(self);
        };
        let guess = join(&plane.normal(), &Vector3::zeros());
        let own = self.problem.plane(Some(&guess));
        let same = own.is_ok_and(|own| own.normal().cross(&plane.normal()).norm() < 1e-9);
        if !(same && self.is_symmetric_about(&plane)) {
            return Err(Error::domain(
                "the data leave the plane in which the branch begins; use solve.path = \"spatial\"",
            ));
        }
        self.plane = Some(plane);
        Ok(self)
    }

    /// The problem of the rod without the surfaces.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The surfaces.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// True if the problem is solved in a plane, and the index counts variations within the plane.
    pub fn is_planar(&self) -> bool {
        self.plane.is_some()
    }

    fn rod(&self) -> &Rod {
        &self.problem.rod
    }

    fn loaded(&self) -> LoadedRod<'_> {
        LoadedRod {
            law: &self.rod().law,
            load: &self.load,
            tolerance: self.problem.tolerance,
        }
    }

    /// The gap of a surface at a place in the clamp's frame and the units of the rod.
    fn gap(&self, surface: usize, r: &Vector3<f64>) -> Gap {
        let rod = self.rod();
        let turn = rod.clamp.rotation.to_rotation_matrix();
        let x = rod.clamp.translation.vector + turn * r * rod.length;
        let gap = self.surfaces[surface]
            .gap(&x)
            .less(-self.withdrawn)
            .turned(&turn.inverse());
        Gap {
            value: gap.value / rod.length,
            hessian: gap.hessian * rod.length,
            ..gap
        }
    }

    /// True if every surface is symmetric about the plane, as far as normals at some of its points tell.
    fn is_symmetric_about(&self, plane: &Plane) -> bool {
        let places = (0..25).map(|i| {
            let (i, j) = (f64::from(i % 5), f64::from(i / 5));
            plane.lift(nalgebra::Vector2::new(0.53 * i - 1.1, 0.47 * j - 0.9))
        });
        let mut pairs = places.flat_map(|r| (0..self.surfaces.len()).map(move |k| (k, r)));
        pairs.all(|(k, r)| self.gap(k, &r).normal.dot(&plane.normal()).abs() < 1e-9)
    }

    /// Sections at places s/L in [0, 1], in growing order; at a touch the force is that before the touch.
    ///
    /// # Errors
    /// A wrench that the rod cannot follow.
    pub fn sections(&self, found: &ContactEquilibrium, at: &[f64]) -> Result<Vec<RodSection>> {
        let shape = self.shape(found)?;
        at.iter()
            .map(|s| {
                let (state, b) = shape.state(*s)?;
                self.rod().outward(&state, &b, &self.load)
            })
            .collect()
    }

    /// The rod in the shape of an equilibrium.
    fn shape(&self, found: &ContactEquilibrium) -> Result<TouchedSteps<'_>> {
        let b = self.rod().inward(&found.base);
        let unit = self.rod().units().1;
        let touches: Vec<ScaledTouch> = (found.touches.iter())
            .map(|touch| {
                let s = touch.s / self.rod().length;
                let line = touch
                    .line
                    .map(|line| Line::over(s, line.length / self.rod().length));
                ScaledTouch {
                    surface: touch.surface,
                    s,
                    at_end: touch.at_end,
                    reaction: touch.line.map_or(touch.reaction, |line| line.at_end) / unit,
                    line,
                }
            })
            .collect();
        self.shape_of(&b, &touches)
    }
}

/// Depth of the clamp, or of a held end, below a surface that is rounding, in lengths of the rod.
const HELD_DEPTH: f64 = 1e-12;
/// Largest number of touches in options: sets of touches are tried one by one.
const MOST_TOUCHES: usize = 16;
