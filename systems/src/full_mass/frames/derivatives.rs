//! Derivatives of poses, velocities and accelerations of the sections by the strains and their rates.

use super::{Accelerations, BASE, Flow, Sections, Shape, Triple, cross, last_rows};
use crate::full_mass::section_rotations::{NodeRotation, Quads, Spun};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Rotations and displacements of the sections per change of the strains.
#[derive(Debug, Clone)]
pub struct PoseDerivatives {
    /// Rotations phi.
    pub phi: Triple,
    /// Displacements dr.
    pub r: Triple,
    /// d tau, at the nodes.
    tau: Triple,
    /// In space: eta of [`Spins`](crate::full_mass::section_rotations::Spins).
    eta: Option<Quads>,
}

/// Velocities and accelerations per change of strains and rates; those of omega and r_t per rate are
/// [`PoseDerivatives`].
#[derive(Debug, Clone)]
pub struct RateDerivatives {
    /// d omega and d r_t by the strains.
    pub velocity: [Triple; 2],
    /// d omega_t and d r_tt by the strains.
    pub by_strain: [Triple; 2],
    /// d omega_t and d r_tt by the rates.
    pub by_rate: [Triple; 2],
}

impl Sections {
    /// Columns of the strains u, each of which rotates a single node.
    fn own(&self, shape: &Shape) -> Vec<NodeRotation> {
        let count = self.active.len();
        let nodes = shape.directors[..self.grid.len()].iter().enumerate();
        let own = nodes.flat_map(|(node, directors)| {
            let bends = self.active.iter().enumerate().filter(|(_, k)| **k < 3);
            bends.map(move |(a, k)| NodeRotation {
                column: node * count + a,
                node,
                axis: directors.column(*k).into_owned(),
            })
        });
        own.collect()
    }

    /// Index of the first column of the base's rotations, if there are any.
    fn base(&self, columns: usize) -> Option<usize> {
        (columns > self.size()).then_some(self.size())
    }

    /// J: rotations and displacements of the sections; if `free`, with six more columns for those of the base.
    pub fn turned(&self, shape: &Shape, free: bool) -> PoseDerivatives {
        let n = self.grid.len();
        let columns = self.size() + if free { BASE } else { 0 };
        let own = self.own(shape);
        let eta = shape.spins.as_ref();
        let eta = eta.map(|spins| spins.turned(&own, self.base(columns), columns));
        let phi = match &eta {
            Some(eta) => [1, 2, 3].map(|k| &eta[k] * 2.0),
            None => {
                let mut phi = blank(n + 1, columns);
                for NodeRotation { column, node, axis } in own {
                    for (phi, along) in phi.iter_mut().zip(axis.iter()) {
                        phi.column_mut(column)
                            .axpy(*along, &self.up.column(node), 0.0);
                    }
                }
                if let Some(base) = self.base(columns) {
                    for (k, phi) in phi.iter_mut().enumerate() {
                        phi.column_mut(base + k).fill(1.0);
                    }
                }
                phi
            }
        };
        let mut tau = self.local(&phi, |j| -cross(&shape.tangents[j]));
        self.add_stretch(&mut tau, |j, k| shape.directors[j].column(k).into_owned());
        let mut r = self.up_all(&tau);
        if free {
            for (k, r) in r.iter_mut().enumerate() {
                r.column_mut(self.size() + 3 + k).fill(1.0);
            }
        }
        PoseDerivatives { r, phi, tau, eta }
    }

    /// Product of each node's 3 x 3 matrix with the vectors of `x` at the node.
    fn local(&self, x: &Triple, matrix: impl Fn(usize) -> Matrix3<f64>) -> Triple {
        let mut out = blank(self.grid.len(), x[0].ncols());
        self.add_local(&mut out, x, matrix);
        out
    }

    fn add_local(&self, out: &mut Triple, x: &Triple, matrix: impl Fn(usize) -> Matrix3<f64>) {
        let matrices: Vec<_> = (0..self.grid.len()).map(matrix).collect();
        add_products(out, &matrices, x);
    }

    /// Adds the local effect of a change of a strain at its own node: `part` of u or of v.
    fn add_own(&self, out: &mut Triple, of_v: bool, part: impl Fn(usize, usize) -> Vector3<f64>) {
        let count = self.active.len();
        for j in 0..self.grid.len() {
            for (a, k) in self.active.iter().enumerate() {
                if (*k >= 3) == of_v {
                    let v = part(j, *k % 3);
                    for (out, v) in out.iter_mut().zip(v.iter()) {
                        out[(j, j * count + a)] += v;
                    }
                }
            }
        }
    }

    fn add_stretch(&self, out: &mut Triple, part: impl Fn(usize, usize) -> Vector3<f64>) {
        self.add_own(out, true, part);
    }

    /// Derivatives of velocities and accelerations.
    pub fn carried(
        &self,
        shape: &Shape,
        flow: &Flow,
        change: &Accelerations,
        turned: &PoseDerivatives,
    ) -> RateDerivatives {
        let (tau, bend, slide) = (&shape.tangents, &flow.bends, &flow.stretches);
        let spin = &flow.spins;
        let [d_omega, d_alpha, alpha_by_rate] = match (&shape.spins, &turned.eta) {
            (Some(spins), Some(eta)) => {
                let spun = Spun {
                    bends: bend,
                    faster: &change.bends,
                    y: &flow.turning,
                    z: &change.turning,
                    base: flow.base,
                };
                spins.carried(eta, &self.own(shape), self.base(eta[0].ncols()), &spun)
            }
            _ => self.carried_in_plane(shape, flow, change, turned),
        };
        let mut grown = self.local(&d_omega, |j| -cross(&tau[j]));
        self.add_local(&mut grown, &turned.tau, |j| cross(&spin[j]));
        self.add_local(&mut grown, &turned.phi, |j| -cross(&slide[j]));
        let d_velocity = self.up_all(&grown);

        // Change of r_tt per change of omega.
        let by_spin = |j: usize| {
            -cross(&spin[j].cross(&tau[j]))
                - cross(&spin[j]) * cross(&tau[j])
                - cross(&slide[j]) * 2.0
        };
        let mut grown = self.local(&d_alpha, |j| -cross(&tau[j]));
        self.add_local(&mut grown, &turned.tau, |j| {
            cross(&change.spins[j]) + cross(&spin[j]) * cross(&spin[j])
        });
        self.add_local(&mut grown, &d_omega, by_spin);
        self.add_local(&mut grown, &turned.phi, |j| {
            -cross(&spin[j]) * cross(&slide[j]) * 2.0 - cross(&change.stretches[j])
        });
        let d_acceleration = self.up_all(&grown);

        let mut grown = self.local(&alpha_by_rate, |j| -cross(&tau[j]));
        self.add_local(&mut grown, &turned.phi, by_spin);
        self.add_stretch(&mut grown, |j, k| {
            spin[j].cross(&shape.directors[j].column(k)) * 2.0
        });
        RateDerivatives {
            velocity: [d_omega, d_velocity],
            by_strain: [d_alpha, d_acceleration],
            by_rate: [alpha_by_rate, self.up_all(&grown)],
        }
    }

    /// Derivatives of omega and omega_t by the strains, and of omega_t by the rates, if A gives all rotations.
    fn carried_in_plane(
        &self,
        shape: &Shape,
        flow: &Flow,
        change: &Accelerations,
        turned: &PoseDerivatives,
    ) -> [Triple; 3] {
        let (bend, spin) = (&flow.bends, &flow.spins);
        let d_omega = self.up_all(&self.local(&turned.phi, |j| -cross(&bend[j])));
        let mut turning = self.local(&turned.phi, |j| {
            -cross(&change.bends[j]) - cross(&spin[j]) * cross(&bend[j])
        });
        self.add_local(&mut turning, &d_omega, |j| -cross(&bend[j]));
        let d_alpha = self.up_all(&turning);
        let mut turning = self.local(&turned.phi, |j| -cross(&bend[j]));
        self.add_own(&mut turning, false, |j, k| {
            spin[j].cross(&shape.directors[j].column(k))
        });
        [d_omega, d_alpha, self.up_all(&turning)]
    }

    /// d(J^T f)/dq at constant couples and forces; with six more rows, the wrench on the base, if that is free.
    pub fn geometric(
        &self,
        shape: &Shape,
        turned: &PoseDerivatives,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> DMatrix<f64> {
        let [arms, beyond] = self.borne(shape, couples, forces);
        let n = self.grid.len();
        let pressed = self.local(&turned.tau, |j| -cross(&beyond[j]));
        let mut bent = None;
        let by_u = match (&shape.spins, &turned.eta) {
            (Some(spins), Some(eta)) => {
                let (own, base) = (self.own(shape), self.base(eta[0].ncols()));
                let gathered = spins.gathered(&arms);
                bent = Some((spins.bent(eta, &own, base, &arms, &gathered), own));
                spins.gathered_all(&pressed)
            }
            _ => {
                let inner = self.up.rows(0, n);
                let moments = self.down(&arms);
                let mut by_u = pressed.each_ref().map(|f| inner.tr_mul(f));
                self.add_local(&mut by_u, &turned.phi, |j| cross(&moments[j]));
                by_u
            }
        };
        let by_v = self.local(&turned.phi, |j| cross(&beyond[j]));
        let count = self.active.len();
        let columns = turned.phi[0].ncols();
        let mut out = DMatrix::zeros(columns, columns);
        if columns > self.size() {
            for (i, force) in forces.iter().enumerate() {
                let arm = |column: usize| {
                    Vector3::from_fn(|k, _| {
                        let moved = if column == self.size() + 3 + k {
                            1.0
                        } else {
                            0.0
                        };
                        turned.r[k][(i, column)] - moved
                    })
                };
                for column in 0..columns {
                    let mut couple = out.fixed_view_mut::<3, 1>(self.size(), column);
                    couple += arm(column).cross(force);
                }
            }
        }
        if let Some((bent, own)) = bent {
            for (row, own) in bent.row_iter().zip(own) {
                out.row_mut(own.column).copy_from(&row);
            }
        }
        for column in 0..columns {
            for (j, directors) in shape.directors[..n].iter().enumerate() {
                for (a, k) in self.active.iter().enumerate() {
                    let x = if *k < 3 { &by_u } else { &by_v };
                    let d = directors.column(*k % 3);
                    out[(j * count + a, column)] +=
                        d.x * x[0][(j, column)] + d.y * x[1][(j, column)] + d.z * x[2][(j, column)];
                }
            }
        }
        out
    }
}

impl PoseDerivatives {
    /// Twists of the end, six rows.
    pub fn end(&self) -> DMatrix<f64> {
        last_rows([&self.phi, &self.r])
    }
}

impl RateDerivatives {
    /// Derivatives of the acceleration of the end by strains and by rates, six rows each.
    pub fn end(&self) -> [DMatrix<f64>; 2] {
        [&self.by_strain, &self.by_rate].map(|by| last_rows(by.each_ref()))
    }
}

/// Adds to `out` the product of each node's matrix with the vectors of `x` at the node, column by column.
///
/// The loops are a function of their own, so that the compiler makes them once and not once a caller.
#[inline(never)]
fn add_products(out: &mut Triple, matrices: &[Matrix3<f64>], x: &Triple) {
    let [ox, oy, oz] = out;
    for column in 0..x[0].ncols() {
        let [x, y, z] = x.each_ref().map(|x| x.column(column));
        let mut ox = ox.column_mut(column);
        let mut oy = oy.column_mut(column);
        let mut oz = oz.column_mut(column);
        for (j, m) in matrices.iter().enumerate() {
            let v = m * Vector3::new(x[j], y[j], z[j]);
            ox[j] += v.x;
            oy[j] += v.y;
            oz[j] += v.z;
        }
    }
}

#[inline(never)]
fn blank(rows: usize, columns: usize) -> Triple {
    std::array::from_fn(|_| DMatrix::zeros(rows, columns))
}
