//! Search for all equilibria under one end condition: from every start, and by deflation.

use super::chart::{AnyChart, Spatial, dynamic};
use super::ivp::Wrench;
use super::path_to_target::{Search, budgeted_equations, options};
use super::problem::Problem;
use super::solution_path::{ChosenPath, Path, ProblemChart};
use super::starts::PathStart;
use crate::error::Result;
use crate::solve::deflation::{self, find_further};
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::DVector;

/// Couples and forces, in B/L and B/L^2, at which deflation begins: those of a strongly bent rod.
const TYPICAL: f64 = 10.0;
/// Distance, relative to 1 + their wrench, below which two equilibria are one. At a fold, where two meet, they are
/// known only to the root of the tolerance.
const SAME: f64 = 1e-4;
/// Most Newton steps of one search by deflation.
const PATIENCE: usize = 40;

/// A held rod as a family with one member.
struct Member<'a> {
    problem: &'a Problem,
    search: Search,
}

impl Family for Member<'_> {
    fn size(&self) -> usize {
        6
    }

    fn linearised(&self, x: &DVector<f64>, _: f64) -> Result<Linearised> {
        let (residual, jacobian) = budgeted_equations(&Spatial, &self.search, self.problem, x)?;
        Ok(Linearised {
            residual,
            jacobian,
            slope: DVector::zeros(6),
        })
    }
}

impl Problem {
    /// Base wrenches, in the world frame, of the equilibria found under this end condition besides those at `known`.
    /// The search begins from every start of [`Problem::solve`], in a plane and in closed form where the data allow
    /// it. Deflation then continues from all of these and from rods bent every way. Only the closed form guarantees
    /// that none in its plane is missing.
    pub fn others(&self, known: &[Wrench]) -> Vec<Wrench> {
        let mut all: Vec<Wrench> = known.iter().map(|base| self.rod.inward(base)).collect();
        match self.choose_chart(None) {
            Ok((ProblemChart::ClosedForm(chart), taken)) => {
                self.gather(&chart, &mut self.closed_starts(&chart), &taken, &mut all);
            }
            Ok((ProblemChart::Planar(plane), taken)) => {
                self.gather(&plane, &mut self.planar_starts(&plane), &taken, &mut all);
            }
            _ => {}
        }
        let taken = ChosenPath::new(Path::Spatial, "all equilibria are looked for".to_owned());
        self.gather(&Spatial, &mut self.starts(), &taken, &mut all);
        self.deflate(&mut all);
        let found = all.split_off(known.len()).into_iter();
        found.map(|b| self.rod.outward_wrench(&b)).collect()
    }

    /// Adds the equilibria reached from the starts.
    fn gather(
        &self,
        chart: &dyn AnyChart,
        starts: &mut dyn Iterator<Item = PathStart>,
        taken: &ChosenPath,
        all: &mut Vec<Wrench>,
    ) {
        let search = Search::new();
        for start in starts {
            if search.is_over() {
                break;
            }
            if let Ok(found) = self.walk(chart, &search, start, taken) {
                let b = self.rod.inward(&found.base);
                if !all.iter().any(|known| is_same(known, &b)) {
                    all.push(b);
                }
            }
        }
    }

    /// Adds the equilibria found by deflation, up to wrenches of twice the known size: rods have equilibria of any
    /// order.
    fn deflate(&self, all: &mut Vec<Wrench>) {
        let bound = 2.0 * all.iter().map(|b| b.norm()).fold(TYPICAL, f64::max);
        let mut guesses: Vec<DVector<f64>> = all.iter().map(|b| dynamic(*b)).collect();
        let known = guesses.clone();
        for k in 0..6 {
            guesses.extend([TYPICAL, -TYPICAL].map(|size| dynamic(Wrench::ith(k, size))));
        }
        let member = Member {
            problem: self,
            search: Search::new(),
        };
        let asked = deflation::Options {
            newton: options(self.correction(), PATIENCE),
            separation: SAME,
            ..deflation::Options::default()
        };
        if let Ok(search) = find_further(&member, 0.0, &known, &guesses, &asked) {
            let found = search.solutions.iter();
            let found = found.filter_map(|solution| Spatial.wrench(self, &solution.x).ok());
            all.extend(found.filter(|b| b.norm() <= bound));
        }
    }
}

/// True if two wrenches belong to one equilibrium.
fn is_same(a: &Wrench, b: &Wrench) -> bool {
    (a - b).norm() <= SAME * (1.0 + b.norm())
}
