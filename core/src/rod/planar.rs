//! Planar rods: section law, clamp and end condition keep the rod in one plane of the directors.
//!
//! The state is then an angle and two coordinates, the wrench a couple about the plane's normal and two forces: three
//! unknowns instead of six, and rotations by one angle only. With n = (n_t, n_s) in the clamp's frame,
//!
//! ```text
//! m = m(0) - (x n_s - y n_t),   theta' = u,   (x, y)' = Rot(theta) (v_t, v_s),   (u, v_t, v_s) = e(m, Rot(-theta) n).
//! ```
//!
//! Under a load f along the rod n is the local n(s), and m is reduced by w, w' = x f_s - y f_t (see
//! [`super::distributed_load`]).

use super::chart::{Chart, as_array, dynamic, dynamic_matrix};
use super::distributed_load::ScaledLoad;
use super::ivp::{Passage, Wrench, first_step, over_pieces};
use super::problem::Problem;
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::math::se3::{halves, rotation_vector};
use crate::math::small_sort::sort_few;
use nalgebra::{
    DMatrix, DVector, Matrix2x3, Matrix3, Matrix6x3, SVector, Vector2, Vector3, Vector6,
};
use std::f64::consts::TAU;

/// Components out of the plane below this part of the whole are rounding.
const ROUNDING: f64 = 1e-14;
/// Out-of-plane part up to which a guess counts as planar; a guess may be a wrench read off some output.
const OUTSIDE: f64 = 1e-6;

/// A plane through the clamp that holds the unloaded rod and every equilibrium sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal in the frame of the clamp, and of every section, since sections turn about the normal only.
    normal: Vector3<f64>,
    /// Unit vector in the plane across d3: (d3, side, normal) is right-handed.
    side: Vector3<f64>,
}

impl Plane {
    fn with_normal(normal: Vector3<f64>) -> Self {
        Self {
            normal,
            side: normal.cross(&Vector3::z()),
        }
    }

    /// (along d3, across) of a vector.
    pub(super) fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(v.z, self.side.dot(v))
    }

    /// The unit normal, in the clamp's frame.
    pub(super) fn normal(&self) -> Vector3<f64> {
        self.normal
    }

    /// Basis of the strains (u, v_t, v_s) in the six, and of the resultants likewise.
    fn basis(&self) -> Matrix6x3<f64> {
        let (a, s) = (self.normal, self.side);
        Matrix6x3::from_columns(&[
            Vector6::new(a.x, a.y, a.z, 0.0, 0.0, 0.0),
            Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            Vector6::new(0.0, 0.0, 0.0, s.x, s.y, s.z),
        ])
    }

    /// A force of the plane in the clamp's frame.
    pub(super) fn lift(&self, f: Vector2<f64>) -> Vector3<f64> {
        Vector3::z() * f.x + self.side * f.y
    }

    /// A base wrench (couple, force along d3, force across) in space.
    pub(super) fn wrench(&self, x: &Vector3<f64>) -> Wrench {
        let m = self.normal * x[0];
        let n = self.lift(Vector2::new(x[1], x[2]));
        Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
    }

    /// The part of a base wrench in the plane; true if nothing is left out.
    pub(super) fn in_plane_part(&self, b: &Wrench) -> (Vector3<f64>, bool) {
        let (m, n) = halves(b);
        let f = self.flat(&n);
        let x = Vector3::new(self.normal.dot(&m), f.x, f.y);
        let whole = (self.wrench(&x) - b).norm() <= 1e-9 * (1.0 + b.norm());
        (x, whole)
    }
}

impl Problem {
    /// The plane in which the rod stays, and that contains the base wrench `guess` if given; or the reason why there
    /// is none.
    pub(super) fn plane(&self, guess: Option<&Wrench>) -> std::result::Result<Plane, String> {
        if self.arm != Vector3::zeros() {
            return Err("the force acts beside the end".to_owned());
        }
        if self.is_mixed() {
            return Err("a load turns with the rod, or a couple acts on it".to_owned());
        }
        let law = &self.rod.law;
        let [about_first, about_second] = law.planar_about();
        let weight = self.weight.iter();
        let mut inside: Vec<Vector3<f64>> = weight
            .flat_map(|weight| weight.directions().copied())
            .collect();
        let mut along = vec![self.couple];
        if self.end.follower {
            inside.push(Vector3::from(self.targets));
        } else {
            for held in [true, false] {
                let part = |i: usize| {
                    let chosen = self.end.position[i].is_some() == held;
                    self.axes[i] * if chosen { self.targets[i] } else { 0.0 }
                };
                inside.push((0..3).map(part).sum());
            }
        }
        if let Some(rotation) = &self.orientation {
            along.push(rotation_vector(rotation));
        }
        let mut normals = Vec::new();
        let compliance = law.flexures();
        for (k, is_planar) in [about_first, about_second].into_iter().enumerate() {
            if is_planar {
                normals.push((compliance[k], Vector3::ith(k, 1.0)));
            }
        }
        // Of two planes, prefer the one in which the rod is more flexible.
        sort_few(&mut normals, |each| -each.0);
        let mut normals: Vec<Vector3<f64>> = normals.into_iter().map(|(_, n)| n).collect();
        if let Some(flexure) = law.is_isotropic() {
            // Any plane through d3 is valid: take that of the data.
            let given = (inside.iter().map(|v| Vector3::z().cross(v)))
                .chain(along.iter().copied())
                .chain(guess.map(|b| halves(b).0))
                .chain([flexure])
                .find(|v| v.norm() > 0.0);
            normals.extend(given.map(|v| v.normalize()));
        }
        if normals.is_empty() {
            return Err(
                "the section law couples bending in one plane with the rest (or is not known not to)"
                    .to_owned(),
            );
        }
        let fits = |a: &Vector3<f64>| {
            let isotropic = law.is_isotropic();
            let small = |out: f64, whole: f64| out.abs() <= ROUNDING * whole;
            let across = |v: &Vector3<f64>| small((v - a * a.dot(v)).norm(), v.norm());
            small(a.z, 1.0)
                && inside.iter().all(|v| small(a.dot(v), v.norm()))
                && along.iter().all(across)
                && isotropic.is_none_or(|flexure| across(&flexure))
                && self.world_fits(a)
        };
        let fitting: Vec<Plane> = normals
            .into_iter()
            .filter(fits)
            .map(Plane::with_normal)
            .collect();
        let Some(&first) = fitting.first() else {
            return Err(
                "the loads or the held pose lead out of every plane of symmetry".to_owned(),
            );
        };
        let Some(guess) = guess else {
            return Ok(first);
        };
        let within = |plane: &Plane| {
            let (x, _) = plane.in_plane_part(guess);
            (plane.wrench(&x) - guess).norm() <= OUTSIDE * (1.0 + guess.norm())
        };
        fitting
            .into_iter()
            .find(within)
            .ok_or_else(|| "the wrench of [start] leads out of every plane of symmetry".to_owned())
    }

    /// True if the world components of the end condition lie in the plane, except for one across it.
    fn world_fits(&self, normal: &Vector3<f64>) -> bool {
        let held = self.end.position.iter().flatten().count();
        let mixed = !self.end.follower && held != 0 && held != 3;
        !mixed || (self.axes.iter()).any(|axis| (axis.dot(normal).abs() - 1.0).abs() <= ROUNDING)
    }
}

/// The rod's end in its plane at trial unknowns.
#[derive(Debug, Clone, Copy)]
pub struct FlatTrial {
    /// Couple and force at the end.
    m: f64,
    n: Vector2<f64>,
    theta: f64,
    r: Vector2<f64>,
    d_theta: SVector<f64, 3>,
    d_r: Matrix2x3<f64>,
    d_w: SVector<f64, 3>,
}

/// State along s: arclength, angle, two coordinates, energy; with [`VARIED`] the derivatives of angle and coordinates
/// by the three unknowns. Under a load along the rod w follows, with its derivatives if the others are present.
pub(super) type Flat<const D: usize> = SVector<f64, D>;
const BARE: usize = 5;
pub(super) const VARIED: usize = 14;
const HEAVY: usize = BARE + 1;
pub(super) const HEAVY_VARIED: usize = VARIED + 4;

const fn is_varied(size: usize) -> bool {
    size >= VARIED
}

const fn is_heavy(size: usize) -> bool {
    size == HEAVY || size == HEAVY_VARIED
}

/// Index of w in the state.
const fn place_of_w(size: usize) -> usize {
    if is_varied(size) { VARIED } else { BARE }
}

/// A section law in a plane.
pub(super) struct FlatLaw<'a> {
    law: &'a ScaledLaw,
    basis: Matrix6x3<f64>,
    hoisted: Option<(Vector3<f64>, Matrix3<f64>)>,
    weight: Option<&'a ScaledLoad>,
    plane: Plane,
}

impl<'a> FlatLaw<'a> {
    pub(super) fn new(problem: &'a Problem, plane: &Plane) -> Self {
        let law = &problem.rod.law;
        let basis = plane.basis();
        let hoisted = law.uniform().map(|linear| {
            let compliance = linear.compliance.matrix();
            (
                basis.tr_mul(&linear.rest),
                basis.tr_mul(&(compliance * basis)),
            )
        });
        Self {
            law,
            basis,
            hoisted,
            weight: problem.weight.as_ref(),
            plane: *plane,
        }
    }

    /// Strains, energy and compliance.
    fn inverse(&self, s: f64, w: &Vector3<f64>) -> Result<(Vector3<f64>, f64, Matrix3<f64>)> {
        if let Some((rest, compliance)) = &self.hoisted {
            let change = compliance * w;
            return Ok((rest + change, 0.5 * w.dot(&change), *compliance));
        }
        let response = self.law.inverse(s, &(self.basis * w))?;
        Ok((
            self.basis.tr_mul(&response.strain),
            response.energy,
            (self
                .basis
                .tr_mul(&(response.compliance.matrix() * self.basis))),
        ))
    }

    /// Steps over a break at `s`, with the force there.
    pub(super) fn cross<const D: usize>(&self, at: &mut Flat<D>, s: f64) {
        let Some(weight) = self.weight.filter(|_| is_heavy(D)) else {
            return;
        };
        let f = self.plane.flat(&weight.jump_at(s));
        let w = place_of_w(D);
        at[w] += at[2] * f.y - at[3] * f.x;
        if is_varied(D) {
            for k in 0..3 {
                at[w + 1 + k] += at[8 + k] * f.y - at[11 + k] * f.x;
            }
        }
    }

    pub(super) fn slope<const D: usize>(&self, x: &Vector3<f64>, at: &Flat<D>) -> Result<Flat<D>> {
        let (sin, cos) = at[1].sin_cos();
        let (mut nt, mut ns) = (x[1], x[2]);
        let (mut m, mut f) = (x[0], Vector2::zeros());
        let w = place_of_w(D);
        if is_heavy(D)
            && let Some(weight) = self.weight
        {
            let gone = self.plane.flat(&weight.integral_to(at[0]));
            (nt, ns) = (nt - gone.x, ns - gone.y);
            f = self.plane.flat(&weight.density(at[0]));
            m -= at[w];
        }
        m -= at[2] * ns - at[3] * nt;
        let (ft, fs) = (cos * nt + sin * ns, cos * ns - sin * nt);
        let (e, energy, c) = self.inverse(at[0], &Vector3::new(m, ft, fs))?;
        let mut slope = Flat::<D>::zeros();
        slope[0] = 1.0;
        slope[1] = e[0];
        slope[2] = cos * e[1] - sin * e[2];
        slope[3] = sin * e[1] + cos * e[2];
        slope[4] = energy;
        if is_heavy(D) {
            slope[w] = at[2] * f.y - at[3] * f.x;
        }
        if is_varied(D) {
            for k in 0..3 {
                let (turn, dx, dy) = (at[5 + k], at[8 + k], at[11 + k]);
                let unit = |i: usize| if i == k { 1.0 } else { 0.0 };
                let (dt, ds) = (unit(1), unit(2));
                let mut dm = unit(0) - (dx * ns - dy * nt) - (at[2] * ds - at[3] * dt);
                if is_heavy(D) {
                    dm -= at[w + 1 + k];
                    slope[w + 1 + k] = dx * f.y - dy * f.x;
                }
                let force = Vector3::new(
                    dm,
                    cos * dt + sin * ds + turn * fs,
                    cos * ds - sin * dt - turn * ft,
                );
                let de = c * force;
                slope[5 + k] = de[0];
                slope[8 + k] = cos * de[1] - sin * de[2] - turn * slope[3];
                slope[11 + k] = sin * de[1] + cos * de[2] + turn * slope[2];
            }
        }
        Ok(slope)
    }

    fn end<const D: usize>(&self, x: &Vector3<f64>, b: &Wrench, tolerance: f64) -> Result<Flat<D>> {
        let mut refusal = None;
        let flow = |at: &Flat<D>, slope: &mut Flat<D>| match self.slope(x, at) {
            Ok(there) => {
                *slope = there;
                there.iter().all(|v| v.is_finite()).then_some(())
            }
            Err(why) => {
                refusal = Some(why);
                None
            }
        };
        let first = first_step(self.law, b, tolerance)?;
        let start = Flat::<D>::zeros();
        let found = over_pieces(
            self.law,
            start,
            Passage {
                place: |at| &mut at[0],
                cross: |at: &mut Flat<D>, s| self.cross(at, s),
            },
            first,
            tolerance,
            flow,
            |_, _| (),
        );
        found.map(|(end, _)| end).map_err(|s| {
            let why = refusal.unwrap_or_else(|| {
                Error::no_convergence(format!(
                    "the integration along the rod cannot go on; the base wrench is too large: {}",
                    self.law.wrench_text(b)
                ))
            });
            why.context(format!("at s = {s:.6} of the length"))
        })
    }
}

impl Plane {
    fn at<const D: usize>(&self, problem: &Problem, x: &Vector3<f64>) -> Result<FlatTrial> {
        let law = FlatLaw::new(problem, self);
        let end: Flat<D> = law.end(x, &self.wrench(x), problem.tolerance)?;
        let row = |i: usize| {
            if is_varied(D) {
                [end[i], end[i + 1], end[i + 2]]
            } else {
                [0.0; 3]
            }
        };
        let (mut n, mut m) = (Vector2::new(x[1], x[2]), x[0]);
        let mut d_w = [0.0; 3];
        let r = Vector2::new(end[2], end[3]);
        if is_heavy(D)
            && let Some(weight) = law.weight
        {
            n -= self.flat(&weight.total());
            m -= end[place_of_w(D)];
            if is_varied(D) {
                d_w = row(VARIED + 1);
            }
        }
        Ok(FlatTrial {
            m: m - r.perp(&n),
            n,
            theta: end[1],
            r,
            d_theta: row(5).into(),
            d_r: Matrix2x3::from_row_slice(&[row(8), row(11)].concat()),
            d_w: d_w.into(),
        })
    }

    /// The two components of the end condition: direction, target, and whether it is a position.
    pub(super) fn conditions(&self, problem: &Problem) -> [(Vector2<f64>, f64, bool); 2] {
        let held = problem.end.position.iter().flatten().count();
        if held == 0 || held == 3 {
            let whole: Vector3<f64> = (0..3).map(|i| problem.axes[i] * problem.targets[i]).sum();
            let target = self.flat(&whole);
            return [
                (Vector2::x(), target.x, held == 3),
                (Vector2::y(), target.y, held == 3),
            ];
        }
        let across = (0..3)
            .max_by(|i, j| {
                let size = |i: &usize| problem.axes[*i].dot(&self.normal).abs();
                size(i).total_cmp(&size(j))
            })
            .unwrap_or(0);
        [(across + 1) % 3, (across + 2) % 3].map(|i| {
            let held = problem.end.position[i].is_some();
            (self.flat(&problem.axes[i]), problem.targets[i], held)
        })
    }
}

impl Chart for Plane {
    type Trial = FlatTrial;

    fn size(&self) -> usize {
        3
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<FlatTrial> {
        match problem.weight {
            None => self.at::<VARIED>(problem, &as_array(x)?),
            Some(_) => self.at::<HEAVY_VARIED>(problem, &as_array(x)?),
        }
    }

    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<FlatTrial> {
        match problem.weight {
            None => self.at::<BARE>(problem, &as_array(x)?),
            Some(_) => self.at::<HEAVY>(problem, &as_array(x)?),
        }
    }

    fn residual(&self, problem: &Problem, trial: &FlatTrial) -> DVector<f64> {
        let (m, n) = (trial.m, trial.n);
        let couple = self.normal.dot(&problem.couple);
        if problem.end.follower {
            let (sin, cos) = trial.theta.sin_cos();
            let target = self.flat(&Vector3::from(problem.targets));
            let forward = cos * n.x + sin * n.y - target.x;
            let across = cos * n.y - sin * n.x - target.y;
            return DVector::from_column_slice(&[m - couple, forward, across]);
        }
        let first = match &problem.orientation {
            Some(target) => {
                let turn = self.flat(&(target * Vector3::z()));
                let by = trial.theta - turn.y.atan2(turn.x);
                by - TAU * (by / TAU).round()
            }
            None => m - couple,
        };
        let [a, b] = self.conditions(problem).map(|(direction, target, held)| {
            direction.dot(if held { &trial.r } else { &n }) - target
        });
        DVector::from_column_slice(&[first, a, b])
    }

    fn equations(&self, problem: &Problem, trial: &FlatTrial) -> (DVector<f64>, DMatrix<f64>) {
        let n = trial.n;
        let d_n = Matrix2x3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        // m(1) = m(0) - (x n_s - y n_t) - w(1).
        let lever = n.y * trial.d_r.row(0) - n.x * trial.d_r.row(1) + trial.r.x * d_n.row(1)
            - trial.r.y * d_n.row(0);
        let mut d_m = Vector3::x().transpose() - lever;
        if problem.weight.is_some() {
            d_m -= trial.d_w.transpose();
        }
        let mut matrix = Matrix3::zeros();
        if problem.end.follower {
            let (sin, cos) = trial.theta.sin_cos();
            let (along, across) = (cos * n.x + sin * n.y, cos * n.y - sin * n.x);
            let turn = trial.d_theta.transpose();
            matrix.set_row(0, &d_m);
            matrix.set_row(1, &(cos * d_n.row(0) + sin * d_n.row(1) + across * turn));
            matrix.set_row(2, &(cos * d_n.row(1) - sin * d_n.row(0) - along * turn));
        } else {
            let first = match problem.orientation {
                Some(_) => trial.d_theta.transpose(),
                None => d_m,
            };
            matrix.set_row(0, &first);
            for (i, (direction, _, held)) in self.conditions(problem).into_iter().enumerate() {
                let d = if held { &trial.d_r } else { &d_n };
                matrix.set_row(1 + i, &(direction.transpose() * d));
            }
        }
        (self.residual(problem, trial), dynamic_matrix(matrix))
    }

    fn wrench(&self, _: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        Ok(Plane::wrench(self, &as_array(x)?))
    }

    fn unknowns(&self, _: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        Ok(dynamic(self.in_plane_part(b).0))
    }
}
