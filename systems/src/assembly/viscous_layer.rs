//! Fast layer of a rod after the loss of equilibrium: a flow of the strains (see [`super::landing`]).

use crate::math::se3::join;
use crate::rod::{Fallen, Wrench};
use crate::section::SectionLaw;
use crate::solve::dop853::Dop853;
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::kinematics::{AtEnd, Kinematics, Local};
use crate::viscoelastic::reduced::solve;
use crate::viscoelastic::space::{FramedCurve, Space};
use nalgebra::{DMatrix, DVector, Isometry3, Rotation3, SMatrix, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Tolerance of the flow. Low accuracy suffices: the end of the flow is polished in the chart.
const TOLERANCE: f64 = 1e-7;
/// Strain rate below which the flow is at rest.
const REST: f64 = 1e-6;
/// Distance from the start, in lengths of the push, below which the flow has fallen back.
const BACK: f64 = 0.5;
/// Largest number of steps of the flow.
pub(super) const MOST_STEPS: usize = 5_000;
/// Relative singular value below which a wrench direction hardly changes the resultants and is left out.
const FELT: f64 = 1e-12;
/// Gap of the end, in rod lengths and radians, beyond which a shape is not shown: the push has moved the end.
const SHOWN: f64 = 0.02;

/// The layer of one rod, in the units of the rod and the directors of the base.
pub(super) struct RodLayer<const D: usize> {
    pub law: Arc<dyn SectionLaw>,
    pub grid: Grid,
    pub held: Isometry3<f64>,
    /// True if only the distance of the end from the base is held.
    pub by_chord: bool,
    /// Wrench on the end at the last evaluation.
    pub wrench: AtEnd<D>,
    /// Load along the rod at the nodes.
    pub load: Option<Vec<Vector3<f64>>>,
}

pub(super) fn split(strains: &DVector<f64>) -> Vec<Local<6>> {
    strains
        .as_slice()
        .chunks_exact(6)
        .map(Local::from_column_slice)
        .collect()
}

impl<const D: usize> RodLayer<D> {
    /// Twist from the held pose of the end to its present pose.
    pub(super) fn off(&self, end: &Isometry3<f64>) -> AtEnd<D> {
        let turn = (end.rotation * self.held.rotation.inverse()).scaled_axis();
        let all = join(
            &turn,
            &(end.translation.vector - self.held.translation.vector),
        );
        all.fixed_rows::<D>(6 - D).into_owned()
    }

    /// Direction of the chord, if only the chord's length is held.
    fn chord(&self, end: &Isometry3<f64>) -> Option<AtEnd<D>> {
        let mut along = AtEnd::<D>::zeros();
        along
            .fixed_rows_mut::<3>(D - 3)
            .copy_from(&end.translation.vector);
        self.by_chord.then(|| along / along.norm())
    }

    /// Excess of the chord over its held length.
    fn stretched(&self, end: &Isometry3<f64>) -> f64 {
        end.translation.vector.norm() - self.held.translation.vector.norm()
    }

    /// Fits the end wrench to the resultants of the strains `e` by least squares, leaving out resultants of rigid
    /// strains.
    pub fn fit(&mut self, e: &DVector<f64>) -> Option<()> {
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
            for k in (0..6).filter(|k| rigid[*k]) {
                transfer.row_mut(k).fill(0.0);
                left[k] = 0.0;
            }
            normal += transfer.tr_mul(&transfer) * *weight;
            sum += transfer.tr_mul(&left) * *weight;
        }
        // The resultants of a straight inextensible rod do not determine its axial force.
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

    /// Resultants of the load along the rod at its nodes.
    pub(super) fn borne(&self, curve: &FramedCurve, nodes: usize) -> Vec<Local<6>> {
        match &self.load {
            Some(load) => {
                Space::<6, D>::new()
                    .borne(&self.grid, curve, load)
                    .resultants
            }
            None => vec![Local::zeros(); nodes],
        }
    }

    /// Wrench of the load along the rod about its base.
    pub(super) fn load_about_base(&self, curve: &FramedCurve) -> Wrench {
        let loads = self.load.iter().flatten();
        let nodes = loads.zip(curve.positions()).zip(self.grid.weights());
        nodes.fold(Wrench::zeros(), |sum, ((f, r), weight)| {
            sum + join(&(r.cross(f) * *weight), &(f * *weight))
        })
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

    /// Rest point of the flow from `start` + `push`; `seen` receives the strains after each step. None if the flow
    /// falls back to `start`, or does not settle.
    pub fn flow(
        &mut self,
        start: &DVector<f64>,
        push: &DVector<f64>,
        seen: &mut dyn FnMut(&DVector<f64>),
    ) -> Option<DVector<f64>> {
        fall_from(|y, out| self.rates(y, out), start, push, seen)
    }

    /// Energy and shape of the strains `e` in units of the rod, rotated so that a held chord has its held direction.
    /// None while the end is away from its attachment.
    pub fn shape(&self, e: &DVector<f64>) -> Option<Fallen> {
        let strains = split(e);
        let curve = Space::<6, D>::new().shape(&self.grid, &strains)?;
        let end = curve.end();
        let off = if self.by_chord {
            self.stretched(end).abs()
        } else {
            self.off(end).norm()
        };
        if off > SHOWN {
            return None;
        }
        let turn = if self.by_chord {
            UnitQuaternion::rotation_between(
                &end.translation.vector,
                &self.held.translation.vector,
            )?
        } else {
            UnitQuaternion::identity()
        };
        let nodes = self.grid.nodes().iter().zip(self.grid.weights());
        let energy = nodes.zip(&strains).try_fold(0.0, |sum, ((s, weight), e)| {
            Some(sum + weight * self.law.energy(*s, e).ok()?)
        })?;
        let inner = curve.positions().iter().zip(curve.directors());
        let inner = inner.map(|(r, directors)| {
            let directors = Rotation3::from_matrix_unchecked(*directors);
            Isometry3::from_parts(
                (*r).into(),
                UnitQuaternion::from_rotation_matrix(&directors),
            )
        });
        let sections = std::iter::once(Isometry3::identity())
            .chain(inner)
            .chain([*end]);
        Some((energy, sections.map(|at| turn * at).collect()))
    }
}

/// Rest point of the flow with these `rates` from `start` + `push`; `seen` receives the state after each step. None if
/// the flow falls back to `start`, or does not settle.
pub(super) fn fall_from(
    mut rates: impl FnMut(&DVector<f64>, &mut DVector<f64>) -> Option<()>,
    start: &DVector<f64>,
    push: &DVector<f64>,
    seen: &mut dyn FnMut(&DVector<f64>),
) -> Option<DVector<f64>> {
    let state = start + push;
    let size = push.norm();
    let mut slope = state.clone();
    rates(&state, &mut slope)?;
    let mut solver = Dop853::new(state, slope.clone(), 0.1, TOLERANCE);
    let mut step = solver.blank();
    for _ in 0..MOST_STEPS {
        let taken = solver.step_into(&mut rates, 10.0, &mut step);
        taken.ok()?;
        seen(solver.state());
        let away = (solver.state() - start).norm();
        if away < BACK * size {
            return None;
        }
        if solver.slope().amax() < REST && away > 2.0 * size {
            let last = solver.state().clone();
            rates(&last, &mut slope)?;
            return Some(last);
        }
    }
    None
}
