//! Interface of continuation to a mechanical system: a single rod or an assembly.

use crate::error::Result;
use crate::rod::RodSection;
use crate::scene::{Continue, Parameter, ScalarField, Scene};
use crate::solve::arclength::Point;
use crate::solve::parametrised_problem::Family;
use crate::study::Column;
use crate::study::neglected_mass::{FoldAtRest, MassEffect};
use nalgebra::DVector;

/// Equilibrium at a point of a branch, as a row of the table shows it.
pub struct BranchState {
    /// The cells of [`Subject::columns`].
    pub numbers: Vec<f64>,
    /// Estimated residual of the equilibrium equations, in the column after the index.
    pub left_over: f64,
    /// True if the equilibrium has left the domain of the unknowns, so that the branch needs another chart.
    pub left: bool,
}

/// A scene as a function of one of its numbers.
pub struct VariedScene<'a> {
    /// The scene at a value of the number.
    pub at: Box<dyn Fn(f64) -> Result<Scene> + 'a>,
    /// True if the rods, or the loads along them, depend on the number.
    pub changes_rods: bool,
    /// Tolerance of the equilibria.
    pub tolerance: f64,
}

impl VariedScene<'_> {
    /// The scene as a function of a parameter.
    pub fn over(scene: &Scene, parameter: Parameter) -> Self {
        let tolerance = scene.solve.tolerance;
        // No parameter of a branch changes the rods of an assembly.
        let changes_rods = parameter.changes_rod() && scene.assembly().is_none();
        let scene = scene.clone();
        Self {
            at: Box::new(move |p| Ok(scene.with(&parameter, p))),
            changes_rods,
            tolerance,
        }
    }
}

impl<'a> VariedScene<'a> {
    /// The scene at the value `p` of a parameter as a function of a field, with equilibria of this tolerance.
    pub fn by(field: &'a ScalarField, (parameter, p): (Parameter, f64), tolerance: f64) -> Self {
        Self {
            at: Box::new(move |value| {
                let mut scene = field.scene(value)?.with(&parameter, p);
                scene.solve.tolerance = tolerance;
                Ok(scene)
            }),
            changes_rods: true,
            tolerance,
        }
    }
}

/// Meaning of the index column.
pub const INDEX: &str =
    "Morse index, bodies being free: 0 is stable where the loads have a potential";

/// Class of loads that decides the meaning of the Morse index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadClass {
    /// Loads with a potential: the index decides stability.
    Conservative,
    /// Loads without a potential: the index is computed for the same loads kept dead.
    WithoutPotential,
    /// Follower loads, turning with their bodies: no index.
    Followed,
}

impl LoadClass {
    /// Class of loads with a potential (`conservative`) or turning with bodies (`followed`).
    pub fn new(conservative: bool, followed: bool) -> Self {
        match (conservative, followed) {
            (_, true) => Self::Followed,
            (false, false) => Self::WithoutPotential,
            (true, false) => Self::Conservative,
        }
    }

    /// Warning about the meaning of the index, if any.
    pub fn remark(self) -> Option<&'static str> {
        match self {
            Self::Conservative => None,
            Self::WithoutPotential => Some(
                "the loads have no potential, as a couple whose end is free to turn: the index is that of the same loads kept dead and does not decide \
                 stability, which may be lost by growing oscillations as well",
            ),
            Self::Followed => Some(
                "follower loads have no potential: equilibria have no index, and stability may be lost by growing oscillations: \
                 run `snaprod modes` on the scene as a motion of bodies",
            ),
        }
    }
}

/// An equilibrium as one of a subject whose equations hold for every change of the scene.
pub struct GeneralPoint<'a> {
    pub subject: Box<dyn Subject + 'a>,
    pub x: DVector<f64>,
}

/// A rod or an assembly whose branches are followed, all in the same unknowns.
pub trait Subject {
    /// Equilibria of scenes that differ in one number. Difference steps in the number may be proportional to `span`.
    fn family<'s>(&'s self, scenes: VariedScene<'s>, span: f64) -> Box<dyn Family + 's>;

    /// The equilibrium `x` of a scene in equations that hold for every change of the scene; `None` if those of this
    /// subject do. Fields by which derivatives are asked may leave a chart.
    ///
    /// # Errors
    /// Those of the scene and of its rods.
    fn in_general(&self, _scene: &Scene, _x: &DVector<f64>) -> Result<Option<GeneralPoint<'_>>> {
        Ok(None)
    }

    /// Tightest tolerance of a scene that still refines the integration along the rods.
    fn finest(&self) -> f64;

    /// The equilibrium of a scene at these unknowns; `error` is the estimated distance from the branch.
    ///
    /// # Errors
    /// Those of the scene and of its rods.
    fn state(&self, scene: &Scene, x: &DVector<f64>, error: f64) -> Result<BranchState>;

    /// Effect of the mass of the rods at the equilibrium `x`; `None` if no mass is known, or if all of it is
    /// followed.
    fn mass(&self, scene: &Scene, x: &DVector<f64>) -> Option<MassEffect>;

    /// Normal form of the dynamics at a fold of the branch; `None` if no mass is known.
    ///
    /// # Errors
    /// A fold without a normal form, or whose normal form is not found.
    fn fold(&self, scene: &Scene, wanted: &Continue, at: &Point) -> Result<Option<FoldAtRest>>;

    /// Motions of the equilibrium at `x` that cost nothing, by a symmetry of the scene, in words.
    ///
    /// # Errors
    /// Those of the scene.
    fn zero_modes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<String>>;

    /// True if the unknowns keep the rod in a plane, while the index counts unstable directions of space.
    fn is_planar(&self) -> bool {
        false
    }

    /// Columns before the index column, and the column after it.
    fn columns(&self) -> (Vec<Column>, Column);

    /// Index column.
    fn index(&self) -> Column;

    /// Number of equilibria shown in a record.
    fn shown(&self) -> usize;

    /// Class of the loads of a scene, which decides the meaning of the index.
    ///
    /// # Errors
    /// Those of the scene and of its rods.
    fn loads(&self, scene: &Scene) -> Result<LoadClass>;

    /// Sections of every rod.
    ///
    /// # Errors
    /// As [`Subject::state`].
    fn shapes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<Vec<RodSection>>>;

    /// Start guesses of deflation, beside the known equilibria.
    fn guesses(&self) -> Vec<DVector<f64>>;

    /// Size of the wrench for unknowns of this norm.
    fn wrench_size(&self, size: f64) -> f64 {
        size
    }

    /// Description of the set searched by deflation, for unknowns up to the given norm.
    fn search_description(&self, size: f64) -> String;

    /// Reason why an end of the range is unreachable on every branch, if known.
    fn out_of_reach(&self, _wanted: &Continue) -> Option<String> {
        None
    }

    /// Name of the setting that selects the equilibrium at the start of a branch.
    fn start(&self) -> &'static str;
}
