//! Landing of a rod that has lost its equilibrium, with its ends held (theory 2.6, 3.3).
//!
//! A rod with a little friction falls along the fast layer. In it every strain relaxes towards that of the present
//! wrench,
//! ```text
//! e_T = e^(Q w1) - e,     int Q^T e_T = -2 (pose of the end - where it is held),
//! ```
//! with e^ the inverse law. For linear laws that is the flow under a viscosity proportional to the stiffness. For any
//! convex energy the energy falls, since (dW/de - Q w1).(e^ - e) <= 0 and w1 does no work. The resultants of a load
//! along the rod are added to those of w1, and its potential to the energy. The last term brings the end back after
//! the finite push with which the flow begins: the fold itself is a rest point, which is left quadratically slowly
//! and to one side only. A rod between two ball joints is held by the length of its chord alone. There w1 is a force
//! N r^ along it, without a couple at either end, and only the part of the condition along r^ is left, one equation
//! for N. The turn of the base about that of the chord and the spin about it have no effect and are not in the
//! strains. Taut rods fall by the same law in implicit steps ([`crate::rod::Rod::taut_fallen`]).

use super::attachment::Joint;
use super::rod_element::{Link, LinkEnd};
use super::viscous_layer::{MOST_STEPS, RodLayer, split};
use crate::error::{Error, Message, Quantity, Result};
use crate::manifold::{energy_allows_landing, fold_kernel};
use crate::math::se3::{halves, join};
use crate::rod::{Fallen, Wrench};
use crate::section::{Measures, Strain, law_in_units};
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::kinematics::{AtEnd, Kinematics};
use crate::viscoelastic::space::Space;
use nalgebra::{DVector, Isometry3, Vector3};
use std::sync::Arc;

/// Singular value of the Jacobian, in rod lengths, up to which a direction is neutral: there paths of equilibria cross.
const NEUTRAL: f64 = 1e-4;
/// Nodes on each element of the rod: enough to identify the landing, which the chart then makes exact.
const NODES: usize = 32;
/// Largest strain change (in 1/L) in the push off the fold, tried in order. The flow from there takes a time of order
/// 1/push. A push that is not small against the way to the landing is retried smaller.
const PUSHES: [f64; 3] = [0.3, 0.03, 0.003];
/// Chart step of the differences that give the strains' derivatives.
const ASIDE: f64 = 1e-4;
/// Largest number of Newton steps of the polish.
const POLISH: usize = 30;
/// Tolerance of the search for other landings, which the chart then makes exact.
const SEARCH: f64 = 1e-9;
/// Relative distance, over 1 + |chart|, below which two chart points are the same equilibrium.
const TWIN: f64 = 1e-4;
/// Relative error of energies, as a multiple of the tolerance of the integration along the rod.
const ENERGY_ERROR: f64 = 10.0;

/// Stable equilibrium that a rod with held ends can reach from a fold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landing {
    /// The chart point.
    pub chart: Wrench,
    /// True if the fast layer leads to this landing; None if the layer did not settle.
    pub reached: Option<bool>,
}

/// True if two chart points are the same equilibrium.
fn is_twin(a: &Wrench, b: &Wrench) -> bool {
    (a - b).norm() <= TWIN * (1.0 + a.norm())
}

impl Link {
    /// Chart point at which the rod comes to rest after leaving its fold `q` with its ends held. Accurate to
    /// `tolerance`, which is also that of the integration along the rod.
    ///
    /// # Errors
    /// No simple fold; a flow that does not settle.
    pub fn settle(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<Wrench> {
        Ok(self.fallen(q, held, tolerance, false, false)?.1)
    }

    /// True if a rod falls from its branch point `q`, where paths of equilibria cross, for every push: no stable path
    /// begins there.
    pub fn falls(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> bool {
        self.fallen(q, held, tolerance, false, true).is_ok()
    }

    /// Shapes during the fall, relative to the base, one after each step of the layer, and the landing. Shapes whose
    /// end is not yet back at its attachment after the push off the fold are left out.
    ///
    /// # Errors
    /// As [`Link::settle`].
    pub fn fall(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<(Vec<Fallen>, Wrench)> {
        self.fallen(q, held, tolerance, true, false)
    }

    fn fallen(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
        shown: bool,
        crosses: bool,
    ) -> Result<(Vec<Fallen>, Wrench)> {
        let end = self.held(q, held, tolerance)?;
        let kernel = fold_kernel(&end.jacobian)?;
        if end.is_taut() {
            let (shapes, landed) = self.fallen_taut(q, &kernel, held, tolerance, shown)?;
            let landing = self.held(&landed, held, tolerance)?;
            self.check_fall(q, &end, landing.whole_energy(), tolerance)?;
            return Ok((shapes, landed));
        }
        match self.joint() {
            Joint::Weld => self.settled::<6>(q, &end, &kernel, tolerance, shown, crosses),
            Joint::Ball => self.settled::<3>(q, &end, &kernel, tolerance, shown, crosses),
        }
    }

    /// Checks that the energy `landed` of a landing does not exceed that at the fold `q`, whose end is `end`.
    ///
    /// # Errors
    /// A landing that gains energy.
    fn check_fall(&self, q: &Wrench, end: &LinkEnd, landed: f64, tolerance: f64) -> Result<()> {
        let fold = end.whole_energy();
        if energy_allows_landing(fold, landed, ENERGY_ERROR * tolerance) {
            return Ok(());
        }
        Err(Error::no_convergence(
            Message::from("the rod that left its fold under ")
                .then(self.told_wrench(q))
                .words(" at its base came to rest with more energy than it had there, by ")
                .size(landed - fold, Quantity::Couple)
                .words(": lower the tolerance"),
        ))
    }

    /// Possible landings of the rod from its fold `q` with its ends held: those of [`Link::stable_beside`] with no
    /// more energy than the fold, the lowest first.
    ///
    /// # Errors
    /// A fold that cannot be evaluated.
    pub fn landings(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<Landing>> {
        let fold = self.held(q, held, tolerance)?.whole_energy();
        let settled = self.settle(q, held, tolerance).ok();
        let mut stable = self.stable(q, settled, held, tolerance)?;
        stable.retain(|(energy, _)| energy_allows_landing(fold, *energy, ENERGY_ERROR * tolerance));
        let landing = |(_, chart): (f64, Wrench)| Landing {
            chart,
            reached: settled.map(|settled| is_twin(&settled, &chart)),
        };
        Ok(stable.into_iter().map(landing).collect())
    }

    /// Stable equilibria found with the end at `held`, except the chart point `q` itself: charts by energy, the
    /// lowest first, whether or not the rod can get there. The list includes that of [`Link::settle`]; it need not be
    /// complete ([`crate::rod::Problem::others`]).
    ///
    /// # Errors
    /// A chart point that cannot be evaluated.
    pub fn stable_beside(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<Wrench>> {
        let settled = self.settle(q, held, tolerance).ok();
        let stable = self.stable(q, settled, held, tolerance)?;
        Ok(stable.into_iter().map(|(_, q)| q).collect())
    }

    /// Stable equilibria beside `q`, with their energies; `settled` is the end of the fast layer.
    fn stable(
        &self,
        q: &Wrench,
        settled: Option<Wrench>,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<(f64, Wrench)>> {
        // The fold is a double root.
        let mut known = vec![*q; 2];
        known.extend(settled);
        let found = self.others(&known, held, SEARCH.max(tolerance))?;
        let mut stable: Vec<(f64, Wrench)> = Vec::new();
        for found in settled.into_iter().chain(found) {
            let Ok(at) = self.polished(&found, held, tolerance) else {
                continue;
            };
            let is_new = !is_twin(&at, q) && !stable.iter().any(|(_, other)| is_twin(&at, other));
            if is_new
                && self
                    .index(&at, held, tolerance)
                    .is_ok_and(|index| index == 0)
            {
                stable.push((self.held(&at, held, tolerance)?.whole_energy(), at));
            }
        }
        stable.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(stable)
    }

    /// Equilibrium near these strains, in units of 1/L and given at points in [0, 1], with the end at `held` relative
    /// to the base. The search starts from the end wrench that best fits the resultants along the rod.
    ///
    /// # Errors
    /// Strains outside the section law or without a shape; no equilibrium near by.
    pub fn nearest(
        &self,
        strains: &dyn Fn(&[f64]) -> Vec<Strain>,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Wrench> {
        match self.joint() {
            Joint::Weld => self.fitted(self.layer::<6>(held), strains, tolerance),
            Joint::Ball => self.fitted(self.layer::<3>(held), strains, tolerance),
        }
    }

    fn fitted<const D: usize>(
        &self,
        mut layer: RodLayer<D>,
        strains: &dyn Fn(&[f64]) -> Vec<Strain>,
        tolerance: f64,
    ) -> Result<Wrench> {
        let strains = strains(layer.grid.nodes());
        let all = strains.iter().flat_map(|e| e.iter().copied());
        let strains = DVector::from_iterator(6 * strains.len(), all);
        layer.fit(&strains).ok_or_else(|| {
            Error::domain("the strains lie outside the section law, or give no shape of the rod")
        })?;
        self.charted(&layer, &strains, tolerance)
    }

    /// The layer of the rod with its end at `held` relative to the base, with wrench 0.
    pub(super) fn layer<const D: usize>(&self, held: &Isometry3<f64>) -> RodLayer<D> {
        let length = self.rod.length();
        let units = Measures {
            length,
            stiffness: self.rod.reference_stiffness(),
            time: 1.0,
        };
        let law = law_in_units(self.rod.law().clone(), units);
        let mut breaks = law.breaks();
        breaks.extend(self.borne().iter().flat_map(|load| load.breaks()));
        breaks.retain(|s| *s > 0.0 && *s < 1.0);
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|a, b| *a - *b < 1e-12);
        let grid = Grid::new(&breaks, &vec![NODES; breaks.len() + 1]);
        let mut held = *held;
        held.translation.vector /= length;
        let force = self.units()[3];
        let load = self.borne().map(|load| {
            let at = grid.nodes().iter();
            at.map(|s| load.density(*s) * (length / force)).collect()
        });
        RodLayer {
            law,
            grid,
            held,
            by_chord: self.is_pinned(),
            wrench: AtEnd::zeros(),
            load,
        }
    }

    /// Charts of equilibria besides those known.
    fn others(
        &self,
        known: &[Wrench],
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<Wrench>> {
        if self.is_pinned() {
            return Ok(self.other_spans(known, held, tolerance));
        }
        let units = self.units();
        let known: Vec<Wrench> = known.iter().map(|q| q.component_mul(&units)).collect();
        let found = self.held_at(held, tolerance)?.others(&known);
        Ok(found
            .iter()
            .map(|base| base.component_div(&units))
            .collect())
    }

    /// Falls from the equilibrium `q`, with end `end`, in the direction `kernel` of the chart or against it;
    /// optionally with the shapes on the way. At a crossing of paths of equilibria (branch points of rods between two
    /// ball joints) there is one push.
    fn settled<const D: usize>(
        &self,
        q: &Wrench,
        end: &LinkEnd,
        kernel: &Wrench,
        tolerance: f64,
        shown: bool,
        crosses: bool,
    ) -> Result<(Vec<Fallen>, Wrench)> {
        let scale = self.units();
        let wrench = join(&(end.couple / scale[0]), &(end.tip_force() / scale[3]));
        let mut layer = self.layer::<D>(&end.pose);
        layer.wrench = wrench.fixed_rows::<D>(6 - D).into_owned();
        let here = self.strains(&layer.grid, q, &end.pose, tolerance)?;
        let beside = [1.0, -1.0].map(|side| {
            self.strains(
                &layer.grid,
                &(q + kernel * (side * ASIDE)),
                &end.pose,
                tolerance,
            )
        });
        let [ahead, behind] = beside;
        let push = ahead? - behind?;
        let push = &push / push.amax();
        let start = layer.wrench;
        let mut found: Option<(f64, Vec<DVector<f64>>, Wrench)> = None;
        let mut lost = None;
        // At a crossing a rod that does not fall at once follows another path, along which it falls ever more slowly.
        let crossing = crosses || self.crossing(end, NEUTRAL).is_some();
        let pushes = if crossing { &PUSHES[..1] } else { &PUSHES[..] };
        for &size in pushes {
            for side in [size, -size] {
                layer.wrench = start;
                let mut way = Vec::new();
                let mut seen = |e: &DVector<f64>| way.extend(shown.then(|| e.clone()));
                let Some(strains) = layer.flow(&here, &(&push * side), &mut seen) else {
                    continue;
                };
                let landed = self
                    .charted(&layer, &strains, tolerance)
                    .and_then(|landed| {
                        let energy = self.held(&landed, &end.pose, tolerance)?.whole_energy();
                        self.check_fall(q, end, energy, tolerance)?;
                        Ok((energy, landed))
                    });
                match landed {
                    Ok((energy, q)) => {
                        if found.as_ref().is_none_or(|(lowest, ..)| energy < *lowest) {
                            found = Some((energy, way, q));
                        }
                    }
                    // The other side may land.
                    Err(why) => lost = Some(why),
                }
            }
            if found.is_some() {
                break;
            }
        }
        let found = found.map(|(_, way, q)| {
            let (length, energy) = (self.rod.length(), scale[0]);
            let outward = |(stored, mut sections): Fallen| {
                let places = sections.iter_mut().map(|at| &mut at.translation.vector);
                places.for_each(|place| *place *= length);
                (stored * energy, sections)
            };
            let shapes = way.iter().filter_map(|e| layer.shape(e));
            (shapes.map(outward).collect(), q)
        });
        found.ok_or_else(|| {
            if let Some(why) = lost {
                return why;
            }
            if crossing {
                return Error::domain(
                    "a rod that is straight, or symmetric, can buckle to either side alike here, as a column does at Euler's load: a small rest \
                     curvature tells it to which",
                );
            }
            Error::no_convergence(
                Message::from("the rod that left its fold under ")
                    .then(self.told_wrench(q))
                    .words(format!(
                        " at its base does not come to rest within {MOST_STEPS} steps of the fast layer; give the rod friction, or its mass in full"
                    )),
            )
        })
    }

    /// [`Link::fall`] for a taut rod.
    fn fallen_taut(
        &self,
        q: &Wrench,
        kernel: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
        shown: bool,
    ) -> Result<(Vec<Fallen>, Wrench)> {
        let here = self.solve_taut(q, held, tolerance)?;
        let aside = kernel * (ASIDE / kernel.fixed_rows::<3>(3).norm());
        let [ahead, behind] = [1.0, -1.0].map(|side| {
            let beside = self.with_chart_by_pull();
            beside.solve_taut(&(q + aside * side), held, tolerance)
        });
        let beside = [&*ahead?, &*behind?];
        let (shapes, rested) = self.rod.taut_fallen(&here, beside, tolerance, shown)?;
        let q = rested.base.component_div(&self.units());
        self.last_taut.keep(&Arc::new(rested));
        Ok((shapes, q))
    }

    /// Strains at the nodes, in units of 1/L, one after the other.
    pub(super) fn strains(
        &self,
        grid: &Grid,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<DVector<f64>> {
        let length = self.rod.length();
        let places: Vec<f64> = grid.nodes().iter().map(|s| s * length).collect();
        let sections = self.shape(q, held, &places, tolerance)?;
        let values = sections.iter().flat_map(|at| {
            let e = at.strain;
            [
                e[0] * length,
                e[1] * length,
                e[2] * length,
                e[3],
                e[4],
                e[5],
            ]
        });
        Ok(DVector::from_iterator(6 * grid.len(), values))
    }

    /// Chart point of the equilibrium near `strains`, with the end exactly at its attachment.
    fn charted<const D: usize>(
        &self,
        layer: &RodLayer<D>,
        strains: &DVector<f64>,
        tolerance: f64,
    ) -> Result<Wrench> {
        let curve = Space::<6, D>::new().shape(&layer.grid, &split(strains));
        let end = curve
            .ok_or_else(|| Error::no_convergence("the layer ended in strains without a shape"))?;
        let w = layer.wrench;
        let n = w.fixed_rows::<3>(D - 3).into_owned();
        let m = if D == 6 {
            w.fixed_rows::<3>(0).into_owned()
        } else {
            Vector3::zeros()
        };
        let mut start = join(&(m + end.end().translation.vector.cross(&n)), &n);
        start += layer.load_about_base(&end);
        let mut held = layer.held;
        held.translation.vector *= self.rod.length();
        self.polished(&start, &held, tolerance)
    }

    /// Newton's method in the chart from `q` to the equilibrium with the end at `held`, relative to the base.
    ///
    /// # Errors
    /// No convergence.
    pub fn polished(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<Wrench> {
        let link = self.with_chart_by_pull();
        let apart = |q: &Wrench| -> Result<_> {
            let end = link.held(q, held, tolerance)?;
            let gap = end.gap(held);
            let size = (self.gap_scale(&end) * gap).norm();
            Ok((end, gap, size))
        };
        let mut q = *q;
        let (mut end, mut gap, mut size) = apart(&q)?;
        for _ in 0..POLISH {
            let change = end.jacobian.full_piv_lu().solve(&gap);
            let Some(change) = change else { break };
            let mut part = 1.0;
            loop {
                let trial = q + change * part;
                if let Ok((there, left, smaller)) = apart(&trial)
                    && smaller < size
                {
                    (q, end, gap, size) = (trial, there, left, smaller);
                    break;
                }
                part *= 0.5;
                // Halving without gain: rounding is reached.
                if part < 1e-4 {
                    let floor = (1e3 * tolerance).max(1e-12);
                    return if size <= floor {
                        Ok(q)
                    } else {
                        Err(self.unpolished(&q, size))
                    };
                }
            }
            if size < 0.1 * tolerance {
                return Ok(q);
            }
        }
        Err(self.unpolished(&q, size))
    }
}

impl Link {
    /// Sizes of a base wrench, for messages.
    pub(super) fn told_wrench(&self, q: &Wrench) -> Message {
        let (m, n) = halves(&q.component_mul(&self.units()));
        Message::from("a couple of ")
            .size(m.norm(), Quantity::Couple)
            .words(" and a force of ")
            .size(n.norm(), Quantity::Force)
    }

    fn unpolished(&self, q: &Wrench, size: f64) -> Error {
        Error::no_convergence(
            Message::from("no equilibrium of the rod was found near ")
                .then(self.told_wrench(q))
                .words(format!(
                    " at its base: its end stays {size:.1e} rod lengths or radians off; take a smaller tolerance"
                )),
        )
    }
}
