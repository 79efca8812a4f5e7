//! Tendons of a rod at rest: their lengths, what they bear at the base, and the tensions of those of given length.

use crate::body::History;
use crate::error::{Error, Result};
use crate::math::gauss::Rule;
use crate::math::se3::{halves, join};
use crate::rod::{Equilibrium, Problem, RodSection, Wrench};
use crate::scene::{Pull, Scene};
use crate::section::{Resultant, SectionLaw, Tendon, Tendons};
use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

/// A tendon in an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TendonRecord {
    /// Tension; 0 if slack.
    pub tension: f64,
    /// Length of the tendon's path from the base to the anchor.
    pub length: f64,
    /// True for a slack tendon: the given length exceeds the length of the path.
    pub slack: bool,
}

/// The tendons of a rod in equilibrium. Totals are what rod and tendons bear together.
#[derive(Debug, Clone, PartialEq)]
pub struct TendonsRecord {
    /// Each tendon.
    pub each: Vec<TendonRecord>,
    /// Couple and force in the rod alone at the base, in the world: what the clamp bears.
    pub base: [Vector3<f64>; 2],
    /// Couple and force in the rod alone at the sections of a shape, along the directors.
    pub along: Vec<Resultant>,
    /// Points of each tendon at the sections of a shape, up to its anchor.
    pub paths: Vec<Vec<Vector3<f64>>>,
}

/// Panels, and Gauss nodes in each, between two breaks of the law.
const PANELS: usize = 12;
const NODES: usize = 8;

impl TendonsRecord {
    /// The tendons of a rod of this length with these sections at places s/length in growing order.
    ///
    /// # Errors
    /// Those of the sections.
    pub fn of(
        law: &Tendons,
        length: f64,
        sections: impl Fn(&[f64]) -> Result<Vec<RodSection>>,
    ) -> Result<Self> {
        let breaks = law.breaks().into_iter().map(|s| s / length);
        let ends: Vec<f64> = [0.0].into_iter().chain(breaks).chain([1.0]).collect();
        let rule = Rule::new(NODES);
        let (mut at, mut weights) = (vec![0.0], vec![0.0]);
        for pair in ends.windows(2) {
            let width = (pair[1] - pair[0]) / PANELS as f64;
            for panel in 0..PANELS {
                let from = pair[0] + width * panel as f64;
                at.extend(rule.nodes.iter().map(|x| from + width * x));
                weights.extend(rule.weights.iter().map(|w| w * width * length));
            }
        }
        let sections = sections(&at)?;
        let mut lengths = vec![0.0; law.tendons().len()];
        for (section, weight) in sections.iter().zip(&weights) {
            let rates = law.rates(section.s, &section.strain);
            for (sum, rate) in lengths.iter_mut().zip(rates) {
                *sum += weight * rate;
            }
        }
        let each = law.tendons().iter().zip(&lengths);
        let each = each.map(|(tendon, length)| TendonRecord {
            tension: tendon.tension,
            length: *length,
            slack: false,
        });
        let base = sections
            .first()
            .ok_or_else(|| Error::domain("a rod without sections"))?;
        let (couple, force) = halves(&backbone(law, base));
        Ok(Self {
            each: each.collect(),
            base: [base.directors * couple, base.directors * force],
            along: Vec::new(),
            paths: Vec::new(),
        })
    }

    /// Sets what the rod alone bears at the sections of a shape of a rod of this length, and where the tendons run.
    #[must_use]
    pub fn along(mut self, law: &Tendons, length: f64, sections: &[RodSection]) -> Self {
        self.along = sections.iter().map(|at| backbone(law, at)).collect();
        let path = |tendon: &Tendon| {
            let at = sections.iter();
            let at =
                at.map_while(|at| Some(at.position + at.directors * tendon.place(at.s, length)?));
            at.collect()
        };
        self.paths = law.tendons().iter().map(path).collect();
        self
    }

    /// Potential of the given tensions, sum of tension times length.
    pub fn potential(&self) -> f64 {
        self.each.iter().map(|one| one.tension * one.length).sum()
    }
}

/// Couple and force in the rod alone at a section, along the directors.
fn backbone(law: &Tendons, section: &RodSection) -> Resultant {
    let back = section.directors.transpose();
    let total = join(&(back * section.couple), &(back * section.force));
    total - law.pull(section.s, &section.strain)
}

/// A scene with the tensions of its tendons, and the equilibrium.
pub struct Pulled {
    /// The scene with every tension known.
    pub scene: Scene,
    /// The equilibrium problem of the scene.
    pub problem: Problem,
    /// The equilibrium; its index counts the given lengths as held.
    pub found: Equilibrium,
    /// Lengths and loads of the tendons; `None` without tendons.
    pub tendons: Option<TendonsRecord>,
}

/// Equilibrium of a scene under tendons of known tension.
fn pulled(scene: Scene, guess: Option<&Wrench>) -> Result<Pulled> {
    let problem = scene.problem()?;
    let found = problem.solve(guess)?;
    Pulled::at(scene, problem, found)
}

impl Pulled {
    /// The lengths and loads of the tendons in an equilibrium.
    ///
    /// # Errors
    /// Those of the sections of the rod.
    pub fn at(scene: Scene, problem: Problem, found: Equilibrium) -> Result<Self> {
        let law = scene.rod.tendon_law()?;
        let tendons = law.map(|law| {
            TendonsRecord::of(&law, scene.rod.length, |at| {
                problem.sections(&found.base, at)
            })
        });
        Ok(Self {
            tendons: tendons.transpose()?,
            scene,
            problem,
            found,
        })
    }
}

/// Most Newton steps for the tensions, and most halvings of one.
const STEPS: usize = 60;
const HALVINGS: usize = 12;
/// Step of the differences by a tension, relative to it or to B/L^2.
const ASIDE: f64 = 1e-4;
/// Distance of a path from the given length, relative to that of the rod: rounding, and what the solver leaves.
const CLOSE: f64 = 1e-14;
const LEFT: f64 = 1e-9;

/// The equilibrium of a scene, with the tensions of the tendons whose length is given.
///
/// A tension is the multiplier of its length: Newton on the lengths of the taut tendons, whose set changes on the way.
///
/// # Errors
/// As [`Problem::solve`]; lengths that no tensions give.
pub fn equilibrium_with_tendons(scene: &Scene) -> Result<Pulled> {
    let given = scene.rod.tendons.iter().enumerate();
    let wanted: Vec<(usize, f64)> = given
        .filter_map(|(k, tendon)| match tendon.pull {
            Pull::Length(length) => Some((k, length)),
            Pull::Tension(_) => None,
        })
        .collect();
    if wanted.is_empty() {
        return pulled(scene.clone(), scene.guess().as_ref());
    }
    TensionSearch { scene, wanted }.solve()
}

/// Search for the tensions of tendons of given length.
struct TensionSearch<'a> {
    scene: &'a Scene,
    /// Place among the tendons, and length.
    wanted: Vec<(usize, f64)>,
}

impl TensionSearch<'_> {
    fn at(&self, tensions: &DVector<f64>, guess: Option<&Wrench>) -> Result<Pulled> {
        let mut scene = self.scene.clone();
        for ((k, _), tension) in self.wanted.iter().zip(tensions) {
            scene.rod.tendons[*k].pull = Pull::Tension(History::Constant(*tension));
        }
        pulled(scene, guess)
    }

    /// Path minus given length of each tendon.
    fn excess(&self, state: &Pulled) -> DVector<f64> {
        let each = state.tendons.iter().flat_map(|tendons| &tendons.each);
        let paths: Vec<f64> = each.map(|tendon| tendon.length).collect();
        let excess = self.wanted.iter().map(|(k, length)| paths[*k] - length);
        DVector::from_iterator(self.wanted.len(), excess)
    }

    fn solve(&self) -> Result<Pulled> {
        let scene = self.scene;
        let size = scene.rod.length;
        let mut tensions = DVector::zeros(self.wanted.len());
        let mut state = self.at(&tensions, scene.guess().as_ref())?;
        let unit = state.problem.rod().units().1;
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let excess = self.excess(&state);
            let taut: Vec<usize> = (0..tensions.len())
                .filter(|k| tensions[*k] > 0.0 || excess[*k] > CLOSE * size)
                .collect();
            let left = taut
                .iter()
                .fold(0.0_f64, |most, k| most.max(excess[*k].abs()));
            let slope = self.slope(&state, (&tensions, &excess), &taut, unit)?;
            if left <= CLOSE * size || (left <= LEFT * size && !(left < 0.5 * before)) {
                return self.finished(state, &tensions, &slope);
            }
            before = left;
            let off = DVector::from_iterator(taut.len(), taut.iter().map(|k| -excess[*k]));
            let Some(step) = slope.lu().solve(&off) else {
                break;
            };
            let mut part = 1.0;
            let next = (0..HALVINGS).find_map(|_| {
                let mut next = tensions.clone();
                for (k, by) in taut.iter().zip(&step) {
                    next[*k] = (next[*k] + part * by).max(0.0);
                }
                part *= 0.5;
                let state = self.at(&next, Some(&state.found.base)).ok()?;
                Some((next, state))
            });
            let Some(next) = next else { break };
            (tensions, state) = next;
        }
        Err(Error::no_convergence(
            "no tensions give the tendons their lengths near the unpulled rod: a length may be out of reach; give another length, or tension",
        ))
    }

    /// Derivatives of the lengths of taut tendons by their tensions, by differences.
    fn slope(
        &self,
        state: &Pulled,
        (tensions, excess): (&DVector<f64>, &DVector<f64>),
        taut: &[usize],
        unit: f64,
    ) -> Result<DMatrix<f64>> {
        let mut slope = DMatrix::zeros(taut.len(), taut.len());
        for (j, k) in taut.iter().enumerate() {
            let by = ASIDE * tensions[*k].max(unit);
            let mut aside = tensions.clone();
            aside[*k] += by;
            let there = self.excess(&self.at(&aside, Some(&state.found.base))?);
            for (i, other) in taut.iter().enumerate() {
                slope[(i, j)] = (there[*other] - excess[*other]) / by;
            }
        }
        Ok(slope)
    }

    /// The state with its index under given lengths and its slack tendons.
    ///
    /// A length that is held takes a direction of falling energy away where the length grows with its tension
    /// (Haynsworth: index of the bordered second variation).
    fn finished(
        &self,
        state: Pulled,
        tensions: &DVector<f64>,
        slope: &DMatrix<f64>,
    ) -> Result<Pulled> {
        // The search of the last state began at the one before: the record is that of a search from the start.
        let anew = self.at(tensions, self.scene.guess().as_ref());
        let near = |anew: &Pulled| {
            let (a, b) = (&anew.found.base, &state.found.base);
            (a - b).norm() <= 1e-6 * (1e-300 + a.norm().max(b.norm())) + 1e-9
        };
        let mut state = match anew {
            Ok(anew) if near(&anew) => anew,
            _ => state,
        };
        // Without a taut tendon the matrix is empty and has no eigenvalues.
        let growing = if slope.is_empty() {
            0
        } else {
            let symmetric = 0.5 * (slope + slope.transpose());
            let all = symmetric.symmetric_eigenvalues();
            all.iter().filter(|x| **x > 0.0).count()
        };
        state.found.index = state.found.index.saturating_sub(growing);
        for (k, _) in &self.wanted {
            if let Some(record) = state.tendons.as_mut().map(|tendons| &mut tendons.each[*k]) {
                record.slack = record.tension == 0.0;
            }
        }
        Ok(state)
    }
}
