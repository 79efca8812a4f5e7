//! What branches are followed of: a rod, or an assembly.

use crate::error::Result;
use crate::rod::RodSection;
use crate::scene::{Continue, Parameter, Scene};
use crate::solve::arclength::Point;
use crate::solve::parametrised_problem::Family;
use crate::study::Column;
use crate::study::neglected_mass::{FoldAtRest, SmallMass};
use nalgebra::DVector;

/// The equilibrium at a point of a branch, as its row shows it.
pub struct State {
    /// The cells of [`Subject::columns`].
    pub numbers: Vec<f64>,
    /// How far it is from solving its equations, in the column after the index.
    pub left_over: f64,
    /// True if it has left what the unknowns are good for, so that its branch is to be followed in others.
    pub left: bool,
}

/// What the column of the index says.
pub const INDEX: &str =
    "Morse index, bodies being free: 0 is stable where the loads have a potential";

/// What loads are to the index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Loads {
    /// They have a potential: the index decides stability.
    Conservative,
    /// They have none: the index is that of the same loads kept dead.
    WithoutPotential,
    /// They turn with what carries them: there is no index.
    Followed,
}

impl Loads {
    /// By what a problem says of its loads.
    pub fn new(conservative: bool, followed: bool) -> Self {
        match (conservative, followed) {
            (_, true) => Self::Followed,
            (false, false) => Self::WithoutPotential,
            (true, false) => Self::Conservative,
        }
    }

    /// What is to be said of the index.
    pub fn remark(self) -> Option<&'static str> {
        match self {
            Self::Conservative => None,
            Self::WithoutPotential => Some(
                "the loads have no potential, as a couple whose end is free to turn: the index is that of the same loads kept dead and does not decide \
                 stability, which may be lost by growing oscillations as well",
            ),
            Self::Followed => Some(
                "loads turn with what carries them and have no potential: equilibria have no index, and stability may be lost by growing oscillations, \
                 which `snaprod modes` shows of bodies",
            ),
        }
    }
}

/// A rod or an assembly whose branches are followed, all in the same unknowns.
pub trait Subject {
    /// The equilibria of a scene over one of its parameters. Derivatives by the parameter may be taken by steps in proportion to
    /// `span`.
    fn family(&self, scene: &Scene, parameter: Parameter, span: f64) -> Box<dyn Family + '_>;

    /// The tightest tolerance of a scene that makes the integration along the rods finer.
    fn finest(&self) -> f64;

    /// The equilibrium of a scene at these unknowns; `error` is the estimated distance from the branch.
    ///
    /// # Errors
    /// Those of the scene and of its rods.
    fn state(&self, scene: &Scene, x: &DVector<f64>, error: f64) -> Result<State>;

    /// What the mass of the rods changes there; None where no mass is known, or all of it is to be followed.
    fn mass(&self, scene: &Scene, x: &DVector<f64>) -> Option<SmallMass>;

    /// The normal form of a fold of the branch; None where no mass is known.
    ///
    /// # Errors
    /// A fold that has none, or of which it is not found.
    fn fold(&self, task: (&Scene, &Continue), at: &Point) -> Result<Option<FoldAtRest>>;

    /// The columns before and after that of the index.
    fn columns(&self) -> (Vec<Column>, Column);

    /// What the index says, as a column.
    fn index(&self) -> Column;

    /// How many equilibria a record shows.
    fn shown(&self) -> usize;

    /// What the loads do in a scene, by which it is told what the index says.
    ///
    /// # Errors
    /// Those of the scene and of its rods.
    fn loads(&self, scene: &Scene) -> Result<Loads>;

    /// The sections of every rod.
    ///
    /// # Errors
    /// As [`Subject::state`].
    fn shapes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<Vec<RodSection>>>;

    /// Where deflation begins, beside the equilibria that are known.
    fn guesses(&self) -> Vec<DVector<f64>>;

    /// How large wrenches are whose unknowns are of this size.
    fn reach(&self, size: f64) -> f64 {
        size
    }

    /// Among what deflation searches, for unknowns up to this size.
    fn sought(&self, size: f64) -> String;

    /// Why an end of the range is out of reach, whatever the branch, if that is known.
    fn out_of_reach(&self, _wanted: &Continue) -> Option<String> {
        None
    }

    /// What tells one equilibrium from another at the start of a branch.
    fn start(&self) -> &'static str;
}
