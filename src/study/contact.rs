//! Rods at rest that touch the obstacles of a scene.

use super::outline::outline;
use super::record::{Cell, Column, Table};
use super::tendons::{Pulled, TendonsRecord};
use crate::error::Result;
use crate::rod::contact::{
    ContactEquilibrium, ContactGuess, ContactOptions, ContactProblem, Surface, TouchPoint, Way,
};
use crate::rod::{ChosenPath, Equilibrium, Path, Problem, Route};
use crate::scene::{Obstacle, Scene, Units};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// A place where the rod touches an obstacle.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRecord {
    /// Name of the obstacle.
    pub obstacle: String,
    /// Place, reaction and normal.
    pub touch: TouchPoint,
}

/// The contacts of a rod at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactsRecord {
    /// Each contact, in the order of the places along the rod.
    pub each: Vec<ContactRecord>,
    /// The obstacles of the scene.
    pub obstacles: Vec<Obstacle>,
    /// Least gap between rod and obstacles apart from the contacts; infinite if every place touches.
    pub min_gap: f64,
    /// Morse index with contacts of reaction 0 set free; None where the rod lies along an obstacle.
    pub index_released: Option<usize>,
    /// Number of neutral modes, counted as stable.
    pub neutral: usize,
}

impl Scene {
    /// The problem of a scene of statics with its obstacles.
    ///
    /// # Errors
    /// As [`Scene::problem`] and [`ContactProblem::new`].
    pub fn contact_problem(&self) -> Result<ContactProblem> {
        let offset = 0.5 * self.rod.thickness().unwrap_or(0.0);
        let surface = |obstacle: &Obstacle| Surface::new(obstacle.in_units(1.0)?, offset);
        let surfaces = self.obstacles.iter().map(surface);
        let surfaces = surfaces.collect::<Result<Vec<Surface>>>()?;
        let problem = self.problem_of_rod_alone()?;
        ContactProblem::new(problem, surfaces, ContactOptions::default())
    }
}

/// The equilibrium of a scene with obstacles, and its contacts.
///
/// # Errors
/// Those of the scene and of [`ContactProblem::solve`].
pub(super) fn touched(scene: &Scene) -> Result<(Pulled, ContactProblem, ContactEquilibrium)> {
    let among = scene.contact_problem()?;
    let guess = scene.guess().map(|base| ContactGuess {
        base,
        touches: Vec::new(),
    });
    let at = among.solve(guess.as_ref())?;
    let found = described(&among, &at, guess.is_some());
    let law = scene.rod.tendon_law()?;
    let tendons = law
        .map(|law| TendonsRecord::of(&law, scene.rod.length, |places| among.sections(&at, places)));
    let pulled = Pulled {
        scene: scene.clone(),
        problem: Problem::clone(among.problem()),
        found,
        tendons: tendons.transpose()?,
    };
    Ok((pulled, among, at))
}

/// An equilibrium with contacts as one of the rod alone.
fn described(among: &ContactProblem, at: &ContactEquilibrium, guessed: bool) -> Equilibrium {
    let way = match at.way {
        Way::Direct | Way::Given => "nothing stood between the rod and its contacts",
        Way::Loads => "the loads grew with the obstacles in their places",
        Way::Obstacles => "the obstacles were brought to their places beside the loaded rod",
    };
    Equilibrium {
        base: at.base,
        end: at.end.clone(),
        potential: at.potential,
        index: at.index.unwrap_or(0),
        residual: at.residual,
        route: Route {
            from_guess: guessed,
            steps: 0,
            imperfect: false,
            iterations: 0,
            evaluations: 0,
            damping: 1.0,
        },
        taken: ChosenPath {
            path: if among.is_planar() {
                Path::Planar
            } else {
                Path::Spatial
            },
            why: way.to_owned(),
        },
    }
}

impl ContactsRecord {
    /// The contacts of an equilibrium of a scene.
    pub(super) fn new(scene: &Scene, at: &ContactEquilibrium) -> Self {
        let each = at.touches.iter().map(|touch| ContactRecord {
            obstacle: scene.obstacles[touch.surface].name.clone(),
            touch: *touch,
        });
        Self {
            each: each.collect(),
            obstacles: scene.obstacles.clone(),
            min_gap: at.min_gap,
            index_released: at.index_released,
            neutral: at.neutral,
        }
    }

    /// JSON form.
    pub(super) fn json(&self) -> Value {
        let each = self.each.iter().map(|contact| {
            let touch = &contact.touch;
            json!({
                "obstacle": contact.obstacle,
                "s": touch.s,
                "at_end": touch.at_end,
                "reaction": touch.reaction,
                "position": touch.position.as_slice(),
                "normal": touch.normal.as_slice(),
                "relative_curvature": touch.relative_curvature,
                "line": touch.line.map(|line| json!({
                    "length": line.length,
                    "reaction_at_start": line.at_start,
                    "reaction_at_end": line.at_end,
                    "pressure_total": line.pressed,
                })),
            })
        });
        json!({
            "each": each.collect::<Vec<_>>(),
            "normal_total": self.normal_total(),
            "min_gap": self.min_gap.is_finite().then_some(self.min_gap),
            "index_released": self.index_released,
            "neutral": self.neutral,
        })
    }

    /// Lines on the obstacles near these points, for figures.
    pub fn outlines(&self, points: &[Vector3<f64>]) -> Vec<Vec<[f64; 3]>> {
        let obstacles = self.obstacles.iter();
        obstacles.flat_map(|each| outline(each, points)).collect()
    }

    /// Sum of the reactions.
    pub fn normal_total(&self) -> f64 {
        self.each.iter().map(|contact| contact.touch.reaction).sum()
    }

    /// The table `contacts`: a row for each contact.
    ///
    /// # Errors
    /// None that is known of.
    pub fn table(&self, units: Units) -> Result<Table> {
        let real = |name: &'static str, unit: &'static str, meaning: &'static str| {
            Column::reals(name, unit, meaning)
        };
        let mut columns = vec![
            Column::words("obstacle", "name of the obstacle"),
            Column::words("kind", "point or line"),
            real("s", units.length(), "arclength of the unloaded rod"),
            real(
                "s_to",
                units.length(),
                "arclength of the end of a line; that of a point",
            ),
        ];
        for name in ["x", "y", "z"] {
            columns.push(real(name, units.length(), "place of the centreline"));
        }
        for name in ["nx", "ny", "nz"] {
            columns.push(real(name, "", "unit normal from the obstacle outwards"));
        }
        columns.push(real(
            "normal",
            units.force(),
            "reaction along the normal, on the rod; of a line the sum of its end reactions and its pressure",
        ));
        let mut table = Table::new("contacts", columns);
        for contact in &self.each {
            let touch = &contact.touch;
            let length = touch.line.map_or(0.0, |line| line.length);
            let numbers = [touch.s, touch.s + length]
                .into_iter()
                .chain(touch.position.iter().copied())
                .chain(touch.normal.iter().copied())
                .chain([touch.reaction]);
            let kind = if touch.line.is_some() {
                "line"
            } else {
                "point"
            };
            let row: Vec<Cell> = [Cell::from(contact.obstacle.clone()), kind.to_owned().into()]
                .into_iter()
                .chain(numbers.map(Cell::Real))
                .collect();
            table.push(&row)?;
        }
        Ok(table)
    }
}
