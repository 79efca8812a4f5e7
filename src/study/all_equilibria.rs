//! All equilibria of a scene of statics that starts, deflation and symmetries find.

use super::assembly::{self, AssemblyEquilibriumRecord};
use super::branch::guesses;
use super::equilibrium::{self, EquilibriumRecord};
use super::record::{Cell, Column, Table};
use super::tendons::Pulled;
use super::{Hooks, branch::SAME_EQUILIBRIUM};
use crate::assembly::{Assembly, AssemblyFamily, BodyMotion, Configuration};
use crate::error::{Error, Message, Quantity, Result};
use crate::math::se3::join;
use crate::rod::Finding;
use crate::scene::{AssemblySetup, Scene, Units};
use crate::solve::deflation::{self, find_further};
use nalgebra::{DVector, Isometry3, Vector3};
use serde_json::{Value, json};
use std::collections::VecDeque;

/// Largest number of equilibria of an assembly that are looked for.
const MOST: usize = 24;
/// Distance from the image of an equilibrium, relative to 1 + the unknowns, within which another is that image.
const IMAGE: f64 = 1e-4;

/// All equilibria found, the stable ones first, each kind by energy.
#[derive(Debug, Clone)]
pub struct AllEquilibriaRecord {
    /// The units of every quantity.
    pub units: Units,
    /// The equilibria; their numbers count from 1.
    pub states: Vec<StateRecord>,
    /// True if the loads have a potential: only then the index decides stability.
    pub conservative: bool,
    /// False for loads on rods without a potential: indices have no meaning.
    pub indexed: bool,
    /// Sentence on the proven completeness of the list.
    pub proven: String,
    /// Phrase on the range of the search for further equilibria.
    pub sought: String,
    /// True if the caller interrupted the search; the record has what was found before.
    pub interrupted: bool,
}

/// One equilibrium of the list.
#[derive(Debug, Clone)]
pub struct StateRecord {
    /// Stored energy and potential of the dead loads.
    pub energy: f64,
    /// Index in space.
    pub index: usize,
    /// Index within the plane of the data, if the equilibrium lies in it.
    pub index_in_plane: Option<usize>,
    /// The search that found the equilibrium, in words.
    pub how: &'static str,
    /// True if it is one of a continuous family: a motion costs nothing.
    pub neutral: bool,
    /// The equilibrium with its shape.
    pub kind: StateKind,
}

/// The equilibrium of one rod or of an assembly.
#[derive(Debug, Clone)]
pub enum StateKind {
    /// One rod.
    Rod(Box<EquilibriumRecord>),
    /// Rods and bodies.
    Assembly(Box<AssemblyEquilibriumRecord>),
}

/// Lists the equilibria of a scene of statics; of a planar elastica every one with lambda < `lambda_max`.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::{Silent, all_equilibria};
/// // A strip between clamps pushed together: the bow to either side, and the unstable double bow.
/// let strip = Scene::parse(
///     r#"
///     [rod]
///     model = "cosserat"
///     length = 1.0
///     section = { bending = [1.0, 20.0], torsion = 2.0 }
///     [end]
///     position = [0.0, 0.0, 0.9]
///     rotation = { axis = [0, 0, 1], angle = 0.0 }
///     "#,
/// )?;
/// let record = all_equilibria(&strip, 14.0, &mut Silent)?;
/// let stable = record.states.iter().filter(|state| state.index == 0);
/// assert_eq!(stable.count(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A scene of motion of one rod; no equilibrium found.
pub fn all_equilibria(
    scene: &Scene,
    lambda_max: f64,
    hooks: &mut dyn Hooks,
) -> Result<AllEquilibriaRecord> {
    let mut record = if scene.is_assembly() {
        of_assembly(scene, hooks).map_err(|e| scene.in_own_units(e))?
    } else {
        scene.end()?;
        of_rod(scene, lambda_max, hooks)?
    };
    record.states.sort_by(|a, b| {
        let key = |state: &StateRecord| state.index > 0;
        key(a).cmp(&key(b)).then(a.energy.total_cmp(&b.energy))
    });
    Ok(record)
}

fn of_rod(scene: &Scene, lambda_max: f64, hooks: &mut dyn Hooks) -> Result<AllEquilibriaRecord> {
    let problem = scene.problem()?;
    let mut interrupted = false;
    let all = problem.all_equilibria(scene.guess().as_ref(), lambda_max, &mut || {
        interrupted |= hooks.interrupted();
        interrupted
    })?;
    let conservative = problem.is_conservative();
    let mut states = Vec::new();
    for listed in all.found {
        let found = listed.equilibrium;
        let pulled = Pulled::at(scene.clone(), listed.problem, found.clone())?;
        states.push(StateRecord {
            energy: found.end.energy + found.potential + problem.potential_of_end(&found.end),
            index: found.index,
            index_in_plane: listed.index_in_plane,
            how: words(listed.finding),
            neutral: listed.neutral,
            kind: StateKind::Rod(Box::new(equilibrium::described(pulled)?)),
        });
    }
    let couple = all.largest_wrench * problem.rod().reference_stiffness() / scene.rod.length;
    let units = |of| (1.0, scene.units.symbol(of));
    let sought = Message::from("base wrenches up to a couple of ")
        .number(couple, Quantity::Couple)
        .words(" or a force of ")
        .number(couple / scene.rod.length, Quantity::Force)
        .in_units(&units)
        .to_string();
    let proven = match all.complete_below {
        Some(lambda) => format!(
            "within its plane the list is complete below lambda = {lambda} (lambda = sqrt(|force| L^2/B)); out of the plane nothing is proven"
        ),
        None => "nothing is proven: there may be more".to_owned(),
    };
    Ok(AllEquilibriaRecord {
        units: scene.units,
        states,
        conservative,
        indexed: !problem.is_mixed(),
        proven,
        sought,
        interrupted,
    })
}

fn words(finding: Finding) -> &'static str {
    match finding {
        Finding::Solution => "the answer of snaprod equilibrium",
        Finding::ClosedForm => "the complete list of the elastica",
        Finding::Start => "a path from another start",
        Finding::Deflation => "deflation",
        Finding::Symmetry => "the image of another under a symmetry",
    }
}

fn of_assembly(scene: &Scene, hooks: &mut dyn Hooks) -> Result<AllEquilibriaRecord> {
    let setup = AssemblySetup::new(scene)?;
    let first = setup.equilibrium()?;
    let assembly = &setup.assembly;
    let tolerance = setup.equilibrium_tolerance();
    let family = AssemblyFamily::new(
        |_| Ok(assembly.clone()),
        &first.now,
        0.0,
        false,
        1.0,
        0.01 * tolerance,
    )?;
    let x = family.unknowns(&first.now, 0.0)?;
    let carriers = assembly.carriers().iter();
    let freedoms: Vec<usize> = carriers.map(|carrier| carrier.freedoms()).collect();
    let guesses = guesses(&freedoms, assembly.links().len(), &assembly.out_of_plane());
    let mut known = vec![x];
    let mut found = vec![(first, words(Finding::Solution))];
    let bound = 2.0 * guesses.iter().map(|x| x.norm()).fold(0.0, f64::max);
    let mut interrupted = false;
    // Images of the equilibria found come before other guesses.
    let guesses = guesses.into_iter().map(|guess| (guess, Finding::Deflation));
    let mut guesses: VecDeque<_> = guesses.collect();
    let images_of = |now: &Configuration| -> Result<Vec<(DVector<f64>, Finding)>> {
        let images = images(assembly, now).into_iter();
        images
            .map(|image| Ok((family.unknowns(&image, 0.0)?, Finding::Symmetry)))
            .collect()
    };
    for image in images_of(&found[0].0.now)? {
        guesses.push_front(image);
    }
    while let Some((guess, how)) = guesses.pop_front() {
        interrupted |= hooks.interrupted();
        if interrupted || found.len() >= MOST {
            break;
        }
        let options = deflation::Options::default();
        let Ok(search) = find_further(&family, 0.0, &known, std::slice::from_ref(&guess), &options)
        else {
            continue;
        };
        for solution in search.solutions {
            // The image of an equilibrium is one itself only under a symmetry of the data.
            let moved = (&solution.x - &guess).norm();
            let how = match how {
                Finding::Symmetry if moved > IMAGE * (1.0 + guess.norm()) => Finding::Deflation,
                how => how,
            };
            let same = |x: &DVector<f64>| {
                (x - &solution.x).norm() <= SAME_EQUILIBRIUM * (1.0 + solution.x.norm())
            };
            if !(solution.x.norm() <= bound) || known.iter().any(same) {
                continue;
            }
            let now = family.state(&solution.x, 0.0)?.now;
            known.push(solution.x);
            if let Ok(state) = assembly.equilibrium(Some(&now), tolerance) {
                let again =
                    |energy: f64| (energy - state.energy).abs() <= 1e-9 * (1e-3 + energy.abs());
                // The same places under charts that differ by whole turns.
                let is_twin = found.iter().any(|(other, _)| {
                    let pairs = other.now.bodies.iter().zip(&state.now.bodies);
                    again(other.energy)
                        && pairs.clone().all(|(a, b)| {
                            (a.pose.translation.vector - b.pose.translation.vector).norm() < 1e-6
                                && a.pose.rotation.angle_to(&b.pose.rotation) < 1e-6
                        })
                });
                if !is_twin {
                    for image in images_of(&state.now)? {
                        guesses.push_front(image);
                    }
                    found.push((state, words(how)));
                }
            }
        }
    }
    let states = found.into_iter().map(|(state, how)| {
        let record = assembly::described(scene, &setup, state)?;
        Ok(StateRecord {
            energy: record.energy,
            index: record.index,
            index_in_plane: None,
            how,
            neutral: !record.zero_modes.is_empty(),
            kind: StateKind::Assembly(Box::new(record)),
        })
    });
    Ok(AllEquilibriaRecord {
        units: scene.units,
        states: states.collect::<Result<_>>()?,
        conservative: assembly.is_conservative(0.0),
        indexed: !assembly.has_turning(),
        proven: "nothing is proven: there may be more".to_owned(),
        sought: format!(
            "turns and displacements of the bodies and base wrenches of the rods up to {bound:.0} all together (in radians, mean lengths of the rods, \
             B/L and B/L^2)"
        ),
        interrupted,
    })
}

/// Images of a configuration under reflections and half turns about the directors of the first attachment on the
/// ground: equilibria if the assembly has these symmetries, else guesses.
fn images(assembly: &Assembly, now: &Configuration) -> Vec<Configuration> {
    let ends = assembly.links().iter();
    let mut ends = ends.flat_map(|link| [link.from(), link.to()]);
    let Some(ground) = ends.find(|end| end.carried_by().is_none()) else {
        return Vec::new();
    };
    let ground = ground.at(0.0, &now.bodies).pose;
    // The signs of (d1, d2, d3).
    let signs = (1..8).map(|k| Vector3::from_fn(|i, _| if k >> i & 1 == 1 { -1.0 } else { 1.0 }));
    let image = |sign: Vector3<f64>| {
        let turned = sign * sign.product();
        let reflected = |pose: &Isometry3<f64>| {
            let seen = ground.inverse() * pose;
            let turn = seen.rotation.scaled_axis().component_mul(&turned);
            let place = seen.translation.vector.component_mul(&sign);
            ground * Isometry3::new(place, turn)
        };
        let wrench = join(&turned, &sign);
        Configuration {
            bodies: now
                .bodies
                .iter()
                .map(|body| BodyMotion::at_rest(reflected(&body.pose)))
                .collect(),
            charts: now
                .charts
                .iter()
                .map(|q| q.component_mul(&wrench))
                .collect(),
            spins: now.spins.clone(),
        }
    };
    signs.map(image).collect()
}

impl StateRecord {
    /// The shape, a row for each section.
    ///
    /// # Errors
    /// None that is known of.
    pub fn shape(&self) -> Result<Table> {
        match &self.kind {
            StateKind::Rod(record) => record.shape(),
            StateKind::Assembly(record) => record.shape(),
        }
    }

    /// The numbers of the equilibrium, as `snaprod equilibrium` has them.
    fn equilibrium(&self) -> Value {
        match &self.kind {
            StateKind::Rod(record) => record.summary(),
            StateKind::Assembly(record) => record.summary(),
        }
    }
}

impl AllEquilibriaRecord {
    /// JSON form without the shapes.
    pub fn summary(&self) -> Value {
        let one = |(k, state): (usize, &StateRecord)| {
            json!({
                "number": k + 1,
                "energy": state.energy,
                "index": self.indexed.then_some(state.index),
                "index_in_plane": state.index_in_plane,
                "stable": self.conservative.then_some(state.index == 0),
                "neutral": state.neutral,
                "how": state.how,
                "equilibrium": state.equilibrium(),
            })
        };
        json!({
            "equilibria": self.states.iter().enumerate().map(one).collect::<Vec<_>>(),
            "conservative": self.conservative,
            "proven": self.proven,
            "sought": self.sought,
            "interrupted": self.interrupted,
        })
    }

    /// A row for each equilibrium.
    ///
    /// # Errors
    /// None that is known of.
    pub fn table(&self) -> Result<Table> {
        let energy = "stored energy, with the potential of the dead loads";
        let columns = vec![
            Column::integers(
                "number",
                "its number, from 1: the stable ones first, by energy",
            ),
            Column::reals("energy", self.units.energy(), energy),
            Column::integers("index", "Morse index in space"),
            Column::integers("index_in_plane", "Morse index within the plane of the data"),
            Column::words("neutral", "\"neutral\" for one of a continuous family"),
            Column::words("how", "the search that found it"),
        ];
        let mut table = Table::new("equilibria", columns);
        for (k, state) in self.states.iter().enumerate() {
            table.push(&[
                (k + 1).into(),
                state.energy.into(),
                self.indexed.then_some(state.index).into(),
                state.index_in_plane.into(),
                if state.neutral { "neutral" } else { "" }.into(),
                state.how.into(),
            ])?;
        }
        Ok(table)
    }

    /// The shapes of all equilibria: the rows of [`StateRecord::shape`], with the number first.
    ///
    /// # Errors
    /// No equilibrium.
    pub fn shapes(&self) -> Result<Table> {
        let mut shapes: Option<Table> = None;
        for (k, state) in self.states.iter().enumerate() {
            let shape = state.shape()?;
            let table = shapes.get_or_insert_with(|| {
                let number = Column::integers("number", "the number of the equilibrium");
                let mut bare = Table::new("shapes", vec![number]);
                bare.columns
                    .extend(shape.columns.iter().map(Column::without_rows));
                bare
            });
            for row in 0..shape.rows() {
                let cells = shape.columns.iter().map(|column| column.cell(row));
                let cells: Vec<Cell> = std::iter::once((k + 1).into()).chain(cells).collect();
                table.push(&cells)?;
            }
        }
        shapes.ok_or_else(|| Error::domain("there is no equilibrium"))
    }
}
