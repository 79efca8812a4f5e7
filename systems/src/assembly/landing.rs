//! Where a rod settles that has lost its equilibrium, while its ends are held (theory 2.6, 3.3).
//!
//! A rod with a little friction falls along the fast layer. In it every strain relaxes towards what the present wrench asks,
//! ```text
//! e_T = e^(Q w1) - e,     int Q^T e_T = -2 (pose of the end - where it is held),
//! ```
//! with e^ the inverse law. For linear laws that is the flow under a viscosity proportional to the stiffness; for any convex
//! energy it falls, since (dW/de - Q w1).(e^ - e) <= 0 and w1 does no work; the resultants of a load along the
//! rod are with those of w1, and its potential with the energy. The last term brings the end back after the
//! finite push with which the flow begins: the fold itself is a rest point, which is left quadratically slowly and to one
//! side only. A rod between two ball joints is held by the length of its chord alone: w1 is a force N r^ along it, without a couple at
//! either end, and of the condition only the part along r^ is left, one equation for N. The turn of the base about that of the chord and
//! the spin about it, which nothing feels, are not in the strains. Taut rods fall by the same law in implicit steps
//! ([`crate::rod::Rod::taut_fallen`]).

use super::{Joint, Link, LinkEnd};
use crate::creep::grid::Grid;
use crate::creep::kinematics::{AtEnd, Kinematics, Local};
use crate::creep::reduced::solve;
use crate::creep::space::{Curve, Space};
use crate::error::{Error, Result};
use crate::manifold::fold_kernel;
use crate::math::se3::joined;
use crate::rod::Wrench;
use crate::section::{Measures, SectionLaw, Strain, measured};
use crate::solve::dop853::Dop853;
use nalgebra::{DMatrix, DVector, Isometry3, SMatrix, Vector3};
use std::sync::Arc;

/// How far from neutral, in lengths of the rod, a rod may be taken to be at its fold.
const NEUTRAL: f64 = 1e-4;
/// Nodes on every element of the rod: enough to tell where the layer leads, which the chart then makes exact.
const NODES: usize = 32;
/// Largest change of a strain (in 1/L) in the push off the fold. The way from there takes a time of one over it; one that is
/// not small against the way to the landing is tried again smaller.
const PUSHES: [f64; 3] = [0.3, 0.03, 0.003];
/// Change of the chart by which strains are differentiated.
const ASIDE: f64 = 1e-4;
/// Tolerance of the flow, which need not be accurate: its end is polished in the chart.
const TOLERANCE: f64 = 1e-7;
/// Strain rates below this are rest.
const REST: f64 = 1e-6;
/// The flow stands on the wrong side once it is back at this part of the push.
const BACK: f64 = 0.5;
/// Steps of the flow at most.
const MOST_STEPS: usize = 5_000;
/// Newton steps of the polish at most.
const POLISH: usize = 30;
/// Tolerance of the search for other landings, which the chart then makes exact.
const SEARCH: f64 = 1e-9;
/// Wrenches that the resultants feel by less than this part of what they feel most are left out.
const FELT: f64 = 1e-12;
/// A landing nearer to another or to its fold than this, relative to 1 + the chart, is that again.
const TWIN: f64 = 1e-4;

/// The layer of one rod, in its own units and in the directors of its base.
struct Layer<const D: usize> {
    law: Arc<dyn SectionLaw>,
    grid: Grid,
    held: Isometry3<f64>,
    /// Only how far the end is from the base is held.
    by_chord: bool,
    /// The wrench on the end where it was last found.
    wrench: AtEnd<D>,
    /// The load along the rod at the nodes.
    load: Option<Vec<Vector3<f64>>>,
}

impl Link {
    /// The chart point at which the rod comes to rest that leaves its fold `q` while its ends are held; found to
    /// `tolerance`, that of the integration along the rod.
    ///
    /// # Errors
    /// No simple fold; a flow that does not settle.
    pub fn settle(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<Wrench> {
        let end = self.held(q, held, tolerance)?;
        let kernel = fold_kernel(&end.jacobian)?;
        if end.slack.is_some() {
            return self.settled_taut(q, &kernel, held, tolerance);
        }
        match self.joint {
            Joint::Weld => self.settled::<6>(q, &end, &kernel, tolerance),
            Joint::Ball | Joint::Pins => self.settled::<3>(q, &end, &kernel, tolerance),
        }
    }

    /// The stable equilibria that are found of the rod that leaves its fold `q` while its ends are held: charts by energy, the
    /// lowest first. That of [`Link::settle`] is among them; whether they are all, nothing tells ([`crate::rod::Problem::others`]).
    ///
    /// # Errors
    /// A fold that cannot be evaluated.
    pub fn stable_beside(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<Wrench>> {
        let settled = self.settle(q, held, tolerance).ok();
        // The fold is a double root.
        let mut known = vec![*q; 2];
        known.extend(settled);
        let found = self.others(&known, held, SEARCH.max(tolerance))?;
        let mut stable: Vec<(f64, Wrench)> = Vec::new();
        for found in settled.into_iter().chain(found) {
            let Ok(at) = self.polished(&found, held, tolerance) else {
                continue;
            };
            let is_twin = |other: &Wrench| (at - other).norm() <= TWIN * (1.0 + at.norm());
            let is_new = !is_twin(q) && !stable.iter().any(|(_, other)| is_twin(other));
            if is_new
                && self
                    .index(&at, held, tolerance)
                    .is_ok_and(|index| index == 0)
            {
                stable.push((self.held(&at, held, tolerance)?.whole_energy(), at));
            }
        }
        stable.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(stable.into_iter().map(|(_, q)| q).collect())
    }

    /// The equilibrium of the rod near these strains, in units of 1/L and given at places in [0, 1], with its end at `held` seen from the base: from the
    /// wrench on the end that leaves least of the resultants along the rod.
    ///
    /// # Errors
    /// Strains outside the section law or without a shape; no equilibrium near by.
    pub fn nearest(
        &self,
        strains: &dyn Fn(&[f64]) -> Vec<Strain>,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Wrench> {
        match self.joint {
            Joint::Weld => self.fitted(self.layer::<6>(held), strains, tolerance),
            Joint::Ball | Joint::Pins => self.fitted(self.layer::<3>(held), strains, tolerance),
        }
    }

    fn fitted<const D: usize>(
        &self,
        mut layer: Layer<D>,
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

    /// The layer of the rod with its end at `held` seen from the base, under no wrench yet.
    fn layer<const D: usize>(&self, held: &Isometry3<f64>) -> Layer<D> {
        let length = self.rod.length();
        let units = Measures {
            length,
            stiffness: self.rod.reference_stiffness(),
            time: 1.0,
        };
        let law = measured(self.rod.law().clone(), units);
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
        Layer {
            law,
            grid,
            held,
            by_chord: self.joint == Joint::Pins,
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
        if self.joint == Joint::Pins {
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

    /// The rod leaves its equilibrium `q`, its end at `end`, in the direction `kernel` of the chart, or against it.
    fn settled<const D: usize>(
        &self,
        q: &Wrench,
        end: &LinkEnd,
        kernel: &Wrench,
        tolerance: f64,
    ) -> Result<Wrench> {
        let scale = self.units();
        let wrench = joined(&(end.couple / scale[0]), &(end.tip_force() / scale[3]));
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
        let mut found: Option<(f64, Wrench)> = None;
        // Where paths cross a rod that does not fall at once follows another path, along which it falls ever more slowly.
        let crossing = self.crossing(end, NEUTRAL).is_some();
        let pushes = if crossing { &PUSHES[..1] } else { &PUSHES[..] };
        for &size in pushes {
            for side in [size, -size] {
                layer.wrench = start;
                let Some(strains) = layer.flow(&here, &(&push * side)) else {
                    continue;
                };
                let q = self.charted(&layer, &strains, tolerance)?;
                let energy = self.held(&q, &end.pose, tolerance)?.whole_energy();
                if found.as_ref().is_none_or(|(lowest, _)| energy < *lowest) {
                    found = Some((energy, q));
                }
            }
            if found.is_some() {
                break;
            }
        }
        found.map(|(_, q)| q).ok_or_else(|| {
            if crossing {
                return Error::domain(
                    "a rod between two ball joints can buckle to either side alike here, as a straight column does at Euler's load: a small \
                     rest curvature tells it to which",
                );
            }
            Error::no_convergence(format!(
                "the rod that left its fold at the base wrench {:?} (units B/L, B/L^2) does not come to rest within {MOST_STEPS} \
                 steps of the fast layer",
                q.as_slice()
            ))
        })
    }

    /// The same of a taut rod.
    fn settled_taut(
        &self,
        q: &Wrench,
        kernel: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Wrench> {
        let here = self.pulled(q, held, tolerance)?;
        let aside = kernel * (ASIDE / kernel.fixed_rows::<3>(3).norm());
        let [ahead, behind] = [1.0, -1.0].map(|side| {
            let beside = self.sought();
            beside.pulled(&(q + aside * side), held, tolerance)
        });
        let rested = self
            .rod
            .taut_fallen(&here, [&*ahead?, &*behind?], tolerance)?;
        let q = rested.base.component_div(&self.units());
        self.warm.keep(&Arc::new(rested));
        Ok(q)
    }

    /// The strains at the nodes, in units of 1/L, one after the other.
    fn strains(
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

    /// The chart point of the equilibrium near `strains`, with the end exactly where it is held.
    fn charted<const D: usize>(
        &self,
        layer: &Layer<D>,
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
        let mut start = joined(&(m + end.end().translation.vector.cross(&n)), &n);
        if let Some(load) = &layer.load {
            // What the load adds: its force, and its couple about the base.
            let nodes = load.iter().zip(end.positions()).zip(layer.grid.weights());
            start += nodes.fold(Wrench::zeros(), |sum, ((f, r), weight)| {
                sum + joined(&(r.cross(f) * *weight), &(f * *weight))
            });
        }
        let mut held = layer.held;
        held.translation.vector *= self.rod.length();
        self.polished(&start, &held, tolerance)
    }

    /// Newton's method in the chart from `q` to the equilibrium with the end at `held`, seen from the base.
    ///
    /// # Errors
    /// No convergence.
    pub fn polished(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<Wrench> {
        let link = self.sought();
        let apart = |q: &Wrench| -> Result<_> {
            let end = link.held(q, held, tolerance)?;
            let gap = end.gap(held, self.joint);
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
                        Err(unpolished(&q, size))
                    };
                }
            }
            if size < 0.1 * tolerance {
                return Ok(q);
            }
        }
        Err(unpolished(&q, size))
    }
}

fn unpolished(q: &Wrench, size: f64) -> Error {
    Error::no_convergence(format!(
        "no equilibrium of the rod found near the base wrench {:?} (units B/L, B/L^2): its end stays {size:.1e} off",
        q.as_slice()
    ))
}

fn split(strains: &DVector<f64>) -> Vec<Local<6>> {
    strains
        .as_slice()
        .chunks_exact(6)
        .map(Local::from_column_slice)
        .collect()
}

impl<const D: usize> Layer<D> {
    /// The twist that leads from where the end is held to where it is.
    fn off(&self, end: &Isometry3<f64>) -> AtEnd<D> {
        let turn = (end.rotation * self.held.rotation.inverse()).scaled_axis();
        let all = joined(
            &turn,
            &(end.translation.vector - self.held.translation.vector),
        );
        all.fixed_rows::<D>(6 - D).into_owned()
    }

    /// The direction of the chord, if that is all that is held.
    fn chord(&self, end: &Isometry3<f64>) -> Option<AtEnd<D>> {
        let mut along = AtEnd::<D>::zeros();
        along
            .fixed_rows_mut::<3>(D - 3)
            .copy_from(&end.translation.vector);
        self.by_chord.then(|| along / along.norm())
    }

    /// By how much the chord is longer than it is held.
    fn stretched(&self, end: &Isometry3<f64>) -> f64 {
        end.translation.vector.norm() - self.held.translation.vector.norm()
    }

    /// Takes the wrench for which the resultants of the strains `e` differ least from those of an equilibrium, those of strains that cannot change left out.
    fn fit(&mut self, e: &DVector<f64>) -> Option<()> {
        let space = Space::<6, D>::new();
        let strains = split(e);
        let curve = space.shape(&self.grid, &strains)?;
        let borne = self.borne(&curve, strains.len());
        let rigid = self.law.rigid();
        let mut normal = SMatrix::<f64, D, D>::zeros();
        let mut sum = AtEnd::<D>::zeros();
        let nodes = self.grid.nodes().iter().zip(self.grid.weights());
        for (i, (s, weight)) in nodes.enumerate() {
            let mut transfer = space.transfer(&curve, i);
            let mut left = self.law.free(*s, &strains[i]).ok()?.resultants - borne[i];
            for k in (0..3).filter(|k| rigid[*k]) {
                transfer.row_mut(3 + k).fill(0.0);
                left[3 + k] = 0.0;
            }
            normal += transfer.tr_mul(&transfer) * *weight;
            sum += transfer.tr_mul(&left) * *weight;
        }
        // A straight rod that cannot stretch does not feel a pull.
        let normal = DMatrix::from_column_slice(D, D, normal.as_slice());
        let sum = DVector::from_column_slice(sum.as_slice());
        let svd = normal.svd(true, true);
        let found = svd.solve(&sum, FELT * svd.singular_values.amax()).ok()?;
        self.wrench = AtEnd::from_column_slice(found.as_slice());
        if let Some(along) = self.chord(curve.end()) {
            self.wrench = along * along.dot(&self.wrench);
        }
        Some(())
    }

    /// The resultants of the load along the rod at its nodes.
    fn borne(&self, curve: &Curve, nodes: usize) -> Vec<Local<6>> {
        match &self.load {
            Some(load) => {
                Space::<6, D>::new()
                    .borne(&self.grid, curve, load)
                    .resultants
            }
            None => vec![Local::zeros(); nodes],
        }
    }

    /// Rates of the strains `e`; None where a law refuses.
    fn rates(&mut self, e: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let space = Space::<6, D>::new();
        let strains = split(e);
        let curve = space.shape(&self.grid, &strains)?;
        let mut off = self.off(curve.end());
        let chord = self.chord(curve.end());
        if let Some(along) = &chord {
            off = along * self.stretched(curve.end());
            self.wrench = along * along.dot(&self.wrench);
        }
        let borne = self.borne(&curve, strains.len());
        let nodes = self
            .grid
            .nodes()
            .iter()
            .zip(self.grid.weights())
            .zip(&strains)
            .enumerate();
        let linear = self.law.uniform_linear().is_some();
        for round in 0..20 {
            let mut missing: AtEnd<D> = off * 2.0;
            let mut give = SMatrix::<f64, D, D>::zeros();
            for (i, ((s, weight), e)) in nodes.clone() {
                let transfer = space.transfer(&curve, i);
                let resultants = transfer * self.wrench + borne[i];
                let asked = self.law.inverse(*s, &resultants).ok()?;
                let rate = asked.strain - e;
                out.fixed_rows_mut::<6>(6 * i).copy_from(&rate);
                missing += transfer.tr_mul(&rate) * *weight;
                give += transfer.tr_mul(&(asked.compliance.matrix() * transfer)) * *weight;
            }
            if let Some(along) = &chord {
                missing = along * along.dot(&missing);
            }
            if round > 0 && (linear || missing.norm() < 1e-9) {
                return out.iter().all(|x| x.is_finite()).then_some(());
            }
            self.wrench -= match &chord {
                None => solve(&give, &missing)?,
                Some(along) => missing / along.dot(&(give * along)),
            };
        }
        None
    }

    /// Where the flow from `start` + `push` comes to rest; None if it falls back to `start`, or does not settle.
    fn flow(&mut self, start: &DVector<f64>, push: &DVector<f64>) -> Option<DVector<f64>> {
        let state = start + push;
        let size = push.norm();
        let mut slope = state.clone();
        self.rates(&state, &mut slope)?;
        let mut solver = Dop853::new(state, slope.clone(), 0.1, TOLERANCE);
        let mut step = solver.blank();
        for _ in 0..MOST_STEPS {
            let taken = solver.step_into(|y, out| self.rates(y, out), 10.0, &mut step);
            taken.ok()?;
            let away = (solver.state() - start).norm();
            if away < BACK * size {
                return None;
            }
            if solver.slope().amax() < REST && away > 2.0 * size {
                let last = solver.state().clone();
                self.rates(&last, &mut slope)?;
                return Some(last);
            }
        }
        None
    }
}
