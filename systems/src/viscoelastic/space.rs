//! Rods in space that bend, twist, shear and stretch.
//!
//! The directors d1, d2, d3 are the columns of R: R' = R \[u\]x, r' = R v, from R = 1, r = 0 at the clamp. A change
//! of the strains turns the sections by the world vector phi and moves them by dr, where
//! ```text
//! phi(s) = int_0^s R du,        dr(s) = int_0^s (R du x (r(s) - r) + R dv),
//! ```
//! Hence V = int Q^T e_t ds with Q^T e_t = (R u_t, R u_t x (r(1) - r) + R v_t). The local resultants Q w1 are
//! m_k = d_k . (m1 + (r(1) - r) x n1), n_k = d_k . n1.

mod distributed_load;
mod rotations;
mod stages8;
mod turning_load;

use super::grid::{Element, Grid};
use super::kinematics::{AtEnd, Borne, EndAndPowers, Kinematics, Local};
use super::loads_at_nodes::{LoadsAtNodes, TurningAtNode};
use super::material::Constant;
use crate::math::se3::{Turn, frame, identity, join, spin, unit};
use crate::math::small_matrices::{add_times, times};
use crate::section::Strain;
use nalgebra::{
    DMatrix, Isometry3, Matrix3, SMatrix, SVector, Translation3, Vector3, Vector4, Vector6,
};
use rotations::{Scratch, integrate, turn};
use stages8::{EndPose, Flowing, LANES, Lanes, Loading};

/// Rods in space.
///
/// Strains at a section: M = 3, (u1, u2, u3), inextensible and unshearable, v = (0, 0, 1); M = 4, (u1, u2, u3, v3),
/// unshearable; M = 6, (u1, u2, u3, v1, v2, v3).
/// End: D = 6, a body that turns with it, V = (angular velocity, velocity), w1 = (m1, n1); D = 3, an end free to turn,
/// V its velocity, w1 = n1, and m1 = 0. Both in the world frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Space<const M: usize, const D: usize>(());

impl<const M: usize, const D: usize> Default for Space<M, D> {
    fn default() -> Self {
        Self::new()
    }
}

/// Workspace for shapes.
#[derive(Debug, Default)]
pub struct Room {
    curvatures: Vec<Vector3<f64>>,
    turning: Scratch,
    lanes: Lanes,
}

/// A framed curve: sections at the nodes and at the end.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FramedCurve {
    turns: Vec<Turn>,
    directors: Vec<Matrix3<f64>>,
    positions: Vec<Vector3<f64>>,
    /// Tangents r' = R v.
    tangents: Vec<Vector3<f64>>,
    end: Isometry3<f64>,
    defect: f64,
}

impl FramedCurve {
    /// r at the nodes.
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// R = \[d1 d2 d3\] at the nodes, orthonormal to rounding.
    pub fn directors(&self) -> &[Matrix3<f64>] {
        &self.directors
    }

    /// r and R at s = 1.
    pub fn end(&self) -> &Isometry3<f64> {
        &self.end
    }

    fn arm(&self, i: usize) -> Vector3<f64> {
        self.end.translation.vector - self.positions[i]
    }
}

/// u of the strains at a section.
fn curvature<const M: usize>(strain: &Local<M>) -> Vector3<f64> {
    strain.fixed_rows::<3>(0).into_owned()
}

/// The tangent r' = R v of the centreline.
fn tangent<const M: usize>(directors: &Matrix3<f64>, strain: &Local<M>) -> Vector3<f64> {
    if M == 3 {
        directors.column(2).into_owned()
    } else {
        stretched(directors, strain)
    }
}

/// R dv for a change or a rate of the strains; 0 for rigid components of v.
fn stretched<const M: usize>(directors: &Matrix3<f64>, strain: &Local<M>) -> Vector3<f64> {
    free_v(M).fold(Vector3::zeros(), |sum, k| {
        sum + directors.column(k) * strain[k + M - 3]
    })
}

/// The components of v that can change; v_k is strain number k + M - 3.
fn free_v(strains: usize) -> std::ops::Range<usize> {
    6 - strains.min(6)..3
}

fn pose(position: Vector3<f64>, p: &Turn) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(position), unit(p))
}

/// (A_ij) for all i of a column j: the share of a value at node j in the integrals up to the nodes.
fn column(grid: &Grid, element: &Element, j: usize, out: &mut [f64]) {
    let nodes = element.nodes();
    let a = element.integrate().column(j - nodes.start);
    out[..nodes.start].fill(0.0);
    out[nodes.clone()].copy_from_slice(a.as_slice());
    out[nodes.end..].fill(grid.weights()[j]);
}

/// Replaces f_j by sum_i weight_i A_ij f_i, about weight_j times the integral of f beyond node j.
fn beyond<const K: usize>(grid: &Grid, f: &mut [SVector<f64, K>]) {
    for (f, weight) in f.iter_mut().zip(grid.weights()) {
        *f *= *weight;
    }
    let mut later = SVector::<f64, K>::zeros();
    let mut sums = Vec::new();
    for element in grid.elements().iter().rev() {
        let values = &mut f[element.nodes()];
        sums.clear();
        for (column, weight) in element
            .integrate()
            .column_iter()
            .zip(&grid.weights()[element.nodes()])
        {
            let inside = column
                .iter()
                .zip(&*values)
                .fold(SVector::zeros(), |sum, (a, f)| sum + f * *a);
            sums.push(inside + later * *weight);
        }
        later = values.iter().fold(later, |sum, f| sum + f);
        values.copy_from_slice(&sums);
    }
}

impl<const M: usize, const D: usize> Space<M, D> {
    /// Kinematics with M strains and D end velocities; other M and D do not compile.
    pub fn new() -> Self {
        const {
            assert!(matches!(M, 3 | 4 | 6), "3, 4 or 6 strains");
            assert!(matches!(D, 3 | 6), "an end with 3 or 6 velocities");
        }
        Self(())
    }

    /// Indices among u1 .. v3 of the strains that can change.
    pub fn places() -> [usize; M] {
        std::array::from_fn(|a| if M == 4 && a == 3 { 5 } else { a })
    }

    /// All six strains; the rigid ones are those of v = (0, 0, 1).
    pub fn strain(&self, active: &Local<M>) -> Strain {
        let mut strain = Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        for (place, e) in Self::places().into_iter().zip(active) {
            strain[place] = *e;
        }
        strain
    }

    /// The section at `s` in [0, 1] of the curve of these strains, as accurate as the nodes resolve it.
    pub fn section_at(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        strains: &[Local<M>],
        s: f64,
    ) -> Isometry3<f64> {
        // Position and rotation are integrated from their rates along the rod. They agree with the clamp and with the
        // end exactly as the quadrature of the nodes does.
        let changes: Vec<SVector<f64, 7>> = curve
            .turns
            .iter()
            .zip(&curve.tangents)
            .zip(strains)
            .map(|((p, tangent), strain)| {
                let mut change = SVector::<f64, 7>::zeros();
                change.fixed_rows_mut::<3>(0).copy_from(tangent);
                change
                    .fixed_rows_mut::<4>(3)
                    .copy_from(&spin(p, &curvature(strain)));
                change
            })
            .collect();
        let sums = grid.integral_at(&changes, s);
        pose(
            sums.fixed_rows::<3>(0).into_owned(),
            &(sums.fixed_rows::<4>(3) + identity()),
        )
    }

    /// Derivatives along the rod of spin and velocity at the nodes, R u_t and omega x R v + R v_t, from strain rates.
    pub fn rates_along(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        strains: &[Local<M>],
        rates: &[Local<M>],
    ) -> [Vec<Vector3<f64>>; 2] {
        let directors = &curve.directors;
        let bends = directors.iter().zip(rates);
        let bends: Vec<Vector3<f64>> = bends.map(|(r, rate)| r * curvature(rate)).collect();
        let mut spins = vec![Vector3::zeros(); grid.len()];
        grid.integrate(&bends, &mut spins);
        let nodes = directors.iter().zip(strains.iter().zip(rates));
        let faster = nodes.zip(&spins).map(|((r, (strain, rate)), spin)| {
            spin.cross(&tangent(r, strain)) + stretched(r, rate)
        });
        let faster = faster.collect();
        [bends, faster]
    }

    /// (m1, n1) of an end wrench.
    fn wrench(w: &AtEnd<D>) -> (Vector3<f64>, Vector3<f64>) {
        let n = w.fixed_rows::<3>(D - 3).into_owned();
        if D == 6 {
            (w.fixed_rows::<3>(0).into_owned(), n)
        } else {
            (Vector3::zeros(), n)
        }
    }
}

impl<const M: usize, const D: usize> Kinematics<M, D> for Space<M, D> {
    type Shape = FramedCurve;
    type Room = Room;
    type Pose = Isometry3<f64>;
    const PLACE: usize = if D == 6 { 7 } else { 3 };

    fn reshape(
        &self,
        grid: &Grid,
        strains: &[Local<M>],
        curve: &mut FramedCurve,
        room: &mut Room,
    ) -> Option<()> {
        let n = grid.len();
        let finite = strains.iter().all(|e| e.iter().all(|e| e.is_finite()));
        if strains.len() != n || !finite {
            return None;
        }
        let (u, p) = (&mut room.curvatures, &mut curve.turns);
        u.clear();
        u.extend(strains.iter().map(curvature));
        p.resize(n, Vector4::zeros());
        room.turning.fit(n);
        let (mut at, mut defect) = (identity(), 0.0_f64);
        for element in grid.elements() {
            let nodes = element.nodes();
            let (u, p) = (&u[nodes.clone()], &mut p[nodes]);
            let off;
            (at, off) = turn(grid, element, &at, u, p, &mut room.turning);
            defect = defect.max(off);
        }
        curve.directors.clear();
        curve.directors.extend(p.iter().map(frame));
        curve.tangents.clear();
        let sections = curve.directors.iter().zip(strains);
        curve.tangents.extend(sections.map(|(d, e)| tangent(d, e)));
        curve.positions.resize(n, Vector3::zeros());
        let mut end = Vector3::zeros();
        for element in grid.elements() {
            let nodes = element.nodes();
            let tangents = &curve.tangents[nodes.clone()];
            let out = &mut curve.positions[nodes.clone()];
            integrate(element.integrate(), tangents, out);
            for r in out {
                *r += end;
            }
            for (tangent, weight) in tangents.iter().zip(&grid.weights()[nodes]) {
                end += tangent * *weight;
            }
        }
        curve.end = pose(end, &at);
        curve.defect = defect;
        // Finite strains may overflow.
        let finite = end.norm().is_finite() && at.norm().is_finite();
        finite.then_some(())
    }

    fn pose(&self, curve: &FramedCurve) -> Isometry3<f64> {
        curve.end
    }

    fn place(end: &Isometry3<f64>, out: &mut [f64]) {
        let (turn, position) = out.split_at_mut(Self::PLACE - 3);
        if let [w, x, y, z] = turn {
            let rotation = end.rotation.quaternion();
            (*w, *x, *y, *z) = (rotation.w, rotation.i, rotation.j, rotation.k);
        }
        position.copy_from_slice(end.translation.vector.as_slice());
    }

    fn loaded(
        &self,
        grid: &Grid,
        law: Option<&Constant<M>>,
        states: &[(&[f64], AtEnd<D>)],
        out: &mut [&mut [f64]],
        ends: &mut [Option<EndAndPowers<Isometry3<f64>>>],
        room: &mut Room,
    ) -> bool {
        let law = law.map(|law| Flowing {
            stiffness: law.stiffness.as_slice(),
            rest: law.rest.as_slice(),
            fluidity: law.fluidity.as_slice(),
        });
        let places = states.chunks(LANES).zip(ends.chunks_mut(LANES));
        for ((states, ends), out) in places.zip(out.chunks_mut(LANES)) {
            // Unused lanes repeat the first state.
            let mut lanes = [states[0].0; LANES];
            let mut wrenches = [[0.0; 6]; LANES];
            for (k, (state, w)) in states.iter().enumerate() {
                let (m, n) = Self::wrench(w);
                lanes[k] = state;
                wrenches[k] = [m.x, m.y, m.z, n.x, n.y, n.z];
            }
            let mut reached = [EndPose::default(); LANES];
            let loading = Loading {
                grid,
                places: &Self::places(),
                states: &lanes,
                wrenches: &wrenches,
                law,
                out,
                ends: &mut reached,
                lanes: &mut room.lanes,
            };
            if !loading.evaluate() {
                return false;
            }
            for (end, there) in ends.iter_mut().zip(reached) {
                *end = Some(EndAndPowers {
                    pose: pose(there.place.into(), &there.turn.into()),
                    dissipated: there.dissipated,
                    driven: 0.0,
                });
            }
        }
        true
    }

    fn axis(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        strains: &[Local<M>],
        places: &[f64],
    ) -> Vec<[Vector3<f64>; 2]> {
        let there = grid.at_each(strains, places);
        let place = |(s, strain): (&f64, &Local<M>)| {
            let pose = self.section_at(grid, curve, strains, *s);
            let stretch = self.strain(strain).fixed_rows::<3>(3).into_owned();
            [pose.translation.vector, pose.rotation * stretch]
        };
        places.iter().zip(&there).map(place).collect()
    }

    fn transfer(&self, curve: &FramedCurve, i: usize) -> SMatrix<f64, M, D> {
        let across = curve.directors[i].transpose();
        let mut q = SMatrix::<f64, M, D>::zeros();
        if D == 6 {
            q.fixed_view_mut::<3, 3>(0, 0).copy_from(&across);
        }
        q.fixed_view_mut::<3, 3>(0, D - 3)
            .copy_from(&times(&across, &curve.arm(i).cross_matrix()));
        for k in free_v(M) {
            q.fixed_view_mut::<1, 3>(k + M - 3, D - 3)
                .copy_from(&across.row(k));
        }
        q
    }

    /// For changes that the nodes resolve the accuracy is that of the curve. For a change at one node alone the error
    /// is 0.4 |w|/n^2 of the loads at its neighbours. Cost: some 100 operations for a block.
    ///
    /// Let x = r(1) - r and phi_i = sum_j A_ij R_j du_j. With dr(1) - dr_i = sum_j (weight_j - A_ij)
    /// (R_j du_j x x_j + R_j dv_j) + A_ij R_j du_j x x_i:
    /// ```text
    /// dm_i = R_i^T (M_i x phi_i + (dr(1) - dr_i) x n1),   dn_i = R_i^T (n1 x phi_i),   M_i = m1 + x_i x n1.
    /// ```
    fn load_stiffness(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        w: &AtEnd<D>,
        out: &mut DMatrix<f64>,
    ) {
        let n = grid.len();
        let (m1, n1) = Self::wrench(w);
        let (m1_cross, n1_cross) = (m1.cross_matrix(), n1.cross_matrix());
        // Factors of the row: R^T, and the part of dm with A_ij R_j du_j alone.
        let rows: Vec<[Matrix3<f64>; 2]> = (0..n)
            .map(|i| {
                let across = curve.directors[i].transpose();
                let mut own = m1_cross;
                add_times(&mut own, &curve.arm(i).cross_matrix(), &n1_cross);
                [across, times(&across, &own)]
            })
            .collect();
        let mut up_to = vec![0.0; n];
        for element in grid.elements() {
            for j in element.nodes() {
                column(grid, element, j, &mut up_to);
                let weight = grid.weights()[j];
                let directors = &curve.directors[j];
                let forced = times(&n1_cross, directors);
                let arm = times(&n1_cross, &curve.arm(j).cross_matrix());
                let lever = times(&arm, directors);
                for k in 0..3 {
                    let (d, f, l) = (directors.column(k), forced.column(k), lever.column(k));
                    let mut target = out.column_mut(M * j + k);
                    let blocks = target.as_mut_slice().chunks_exact_mut(M);
                    for ((block, [across, own]), a) in blocks.zip(&rows).zip(&up_to) {
                        let mut dm = times(own, &(d * *a));
                        add_times(&mut dm, across, &(l * (weight - a)));
                        for (entry, dm) in block.iter_mut().zip(dm.iter()) {
                            *entry += dm;
                        }
                        if M > 3 {
                            let dn = times(across, &(f * *a));
                            for k in free_v(M) {
                                block[k + M - 3] += dn[k];
                            }
                        }
                    }
                }
                for k in free_v(M) {
                    let f = forced.column(k);
                    let mut target = out.column_mut(M * j + k + M - 3);
                    let blocks = target.as_mut_slice().chunks_exact_mut(M);
                    for ((block, [across, _]), a) in blocks.zip(&rows).zip(&up_to) {
                        let dm = times(across, &(f * (a - weight)));
                        for (entry, dm) in block.iter_mut().zip(dm.iter()) {
                            *entry += dm;
                        }
                    }
                }
            }
        }
    }

    fn resultants(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        w: &AtEnd<D>,
        loads: Option<&LoadsAtNodes>,
    ) -> Vec<Vector6<f64>> {
        let (couple, n) = Self::wrench(w);
        let beyond = loads.map(|loads| {
            let mut beyond = distributed_load::resultants(grid, curve, &loads.dead);
            if !loads.turning.is_empty() {
                let turned = turning_load::resultants(grid, curve, &loads.turning);
                for (sum, more) in beyond.iter_mut().zip(turned) {
                    sum[0] += more[0];
                    sum[1] += more[1];
                }
            }
            beyond
        });
        let node = |(i, directors): (usize, &Matrix3<f64>)| {
            let mut here = [couple + curve.arm(i).cross(&n), n];
            if let Some(beyond) = &beyond {
                here[0] += beyond[i][0];
                here[1] += beyond[i][1];
            }
            join(&directors.tr_mul(&here[0]), &directors.tr_mul(&here[1]))
        };
        curve.directors.iter().enumerate().map(node).collect()
    }

    fn borne(&self, grid: &Grid, curve: &FramedCurve, force: &[Vector3<f64>]) -> Borne<M> {
        distributed_load::borne(grid, curve, force)
    }

    fn borne_stiffness(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        force: &[Vector3<f64>],
        out: &mut DMatrix<f64>,
    ) {
        distributed_load::add_stiffness::<M>(grid, curve, force, out);
    }

    fn turned(&self, grid: &Grid, curve: &FramedCurve, loads: &[TurningAtNode]) -> Vec<Local<M>> {
        distributed_load::local(curve, &turning_load::resultants(grid, curve, loads))
    }

    fn turned_stiffness(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        loads: &[TurningAtNode],
        out: &mut DMatrix<f64>,
    ) {
        turning_load::add_stiffness::<M>(grid, curve, loads, out);
    }

    /// Let a = R u_t, b = R v_t, x = r(1) - r, and C, P the sums of weight_i A_ij times a and a x r - b. The columns
    /// of a strain at node j are
    /// ```text
    /// d omega/du = -[C] R,
    /// d r_t/du = (C r(1)^T - r C^T - (C . x) + [P] - weight [int a] [x]) R,   d r_t/dv = (weight [int a] - [C]) R.
    /// ```
    fn convection(
        &self,
        grid: &Grid,
        curve: &FramedCurve,
        rates: &[Local<M>],
        out: &mut DMatrix<f64>,
    ) {
        let mut sums: Vec<SVector<f64, 6>> = Vec::with_capacity(grid.len());
        let mut total = Vector3::zeros();
        for (i, (directors, rate)) in curve.directors.iter().zip(rates).enumerate() {
            let a = times(directors, &curvature(rate));
            let p = a.cross(&curve.positions[i]) - stretched(directors, rate);
            total += a * grid.weights()[i];
            sums.push(SVector::from([a.x, a.y, a.z, p.x, p.y, p.z]));
        }
        beyond(grid, &mut sums);
        let end = curve.end.translation.vector;
        for (j, sums) in sums.iter().enumerate() {
            let c: Vector3<f64> = sums.fixed_rows::<3>(0).into_owned();
            let p: Vector3<f64> = sums.fixed_rows::<3>(3).into_owned();
            let (r, x) = (curve.positions[j], curve.arm(j));
            let directors = &curve.directors[j];
            let all = (total * grid.weights()[j]).cross_matrix();
            let c_cross = c.cross_matrix();
            let mut by_u = p.cross_matrix() - Matrix3::from_diagonal_element(c.dot(&x));
            add_times(&mut by_u, &c, &end.transpose());
            add_times(&mut by_u, &-r, &c.transpose());
            add_times(&mut by_u, &-all, &x.cross_matrix());
            out.fixed_view_mut::<3, 3>(D - 3, M * j)
                .copy_from(&times(&by_u, directors));
            if D == 6 {
                out.fixed_view_mut::<3, 3>(0, M * j)
                    .copy_from(&times(&-c_cross, directors));
            }
            for k in free_v(M) {
                let at = M * j + k + M - 3;
                out.column_mut(at).fill(0.0);
                out.fixed_view_mut::<3, 1>(D - 3, at)
                    .copy_from(&((all - c_cross) * directors.column(k)));
            }
        }
    }

    /// The larger of two estimates: the rotation error by |p| of the quaternions, and the position error by the next
    /// coefficients of r' if they fall like the last. The pose of the end is more accurate, about the square of this.
    fn defect(&self, grid: &Grid, curve: &FramedCurve) -> f64 {
        grid.elements()
            .iter()
            .fold(curve.defect, |defect, element| {
                let n = element.nodes().len();
                let coefficients = element.coefficients(&curve.tangents[element.nodes()]);
                let size = |k: usize| coefficients[k].norm().max(coefficients[k + 1].norm());
                let (before, last) = (size(n - 4), size(n - 2));
                let next = if last < before {
                    last * last / before
                } else {
                    last
                };
                defect.max(next * (element.to() - element.from()) / (2 * n + 1) as f64)
            })
    }
}
