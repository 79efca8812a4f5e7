//! Gauss collocation of frame and couple on one interval of a taut rod, under a given force.
//!
//! With f the slope and D the inverse of Butcher's matrix the stages y_i of an interval of length h from y_0 satisfy
//! ```text
//! sum_j D_ij (y_j - y_0) = h f(y_i),      y_1 = y_0 + sum_i d_i (y_i - y_0),   d = D^T b.
//! ```
//! In this form no stage slopes, which may be of the size of lam h, are summed: it holds for any lam h.

use super::super::distributed_load::ScaledLoad;
use super::super::scaled_law::{Response, ScaledLaw};
use super::landing::LayerStep;
use crate::error::Result;
use crate::math::gauss::Rule;
use crate::math::se3::{Turn, exponential, frame, product, spin};
use nalgebra::{DMatrix, Matrix3, Vector3, Vector6};
use std::sync::OnceLock;

/// Number of stages. Even, so that R(z) of the method has no real pole, which a growing mode could meet.
pub(super) const STAGES: usize = 8;
/// Frame and couple of a section, in the directors of the clamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::rod) struct FrameAndCouple {
    pub turn: Turn,
    pub m: Vector3<f64>,
}

impl FrameAndCouple {
    pub(super) fn varied(&self, phi: &Vector3<f64>, m: &Vector3<f64>) -> Self {
        Self {
            turn: product(&exponential(phi), &self.turn),
            m: self.m + m,
        }
    }
}

/// The Gauss method with [`STAGES`] stages.
pub(super) struct Scheme {
    pub nodes: [f64; STAGES],
    pub weights: [f64; STAGES],
    /// Butcher's A.
    pub integrate: [[f64; STAGES]; STAGES],
    /// D = A^-1, and its row sums.
    pub differentiate: [[f64; STAGES]; STAGES],
    pub rows: [f64; STAGES],
    /// d, and 1 - sum d.
    pub end: [f64; STAGES],
    pub start: f64,
    /// The last Legendre coefficients of a function at the nodes.
    modes: [[f64; STAGES]; 3],
}

impl Scheme {
    pub fn get() -> &'static Self {
        static SCHEME: OnceLock<Scheme> = OnceLock::new();
        SCHEME.get_or_init(|| {
            let rule = Rule::new(STAGES);
            let (integrate, modes) = rule.matrices();
            let table =
                |m: &DMatrix<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
            let inverse = integrate
                .clone()
                .try_inverse()
                .expect("Butcher's matrix of Gauss' method is regular");
            let differentiate: [[f64; STAGES]; STAGES] = table(&inverse);
            let end: [f64; STAGES] = std::array::from_fn(|j| {
                (0..STAGES)
                    .map(|i| rule.weights[i] * differentiate[i][j])
                    .sum()
            });
            Self {
                nodes: std::array::from_fn(|i| rule.nodes[i]),
                weights: std::array::from_fn(|i| rule.weights[i]),
                integrate: table(&integrate),
                rows: differentiate.map(|row| row.iter().sum()),
                differentiate,
                start: 1.0 - end.iter().sum::<f64>(),
                end,
                modes: std::array::from_fn(|k| std::array::from_fn(|j| modes[(STAGES - 3 + k, j)])),
            }
        })
    }

    /// Values at `x` in [0, 1] of the polynomial through the start and the stages, as weights of these.
    pub fn interpolate(&self, x: f64) -> [f64; STAGES + 1] {
        let at: [f64; STAGES + 1] =
            std::array::from_fn(|i| if i == 0 { 0.0 } else { self.nodes[i - 1] });
        std::array::from_fn(|i| {
            let others = (0..=STAGES).filter(|j| *j != i);
            others.map(|j| (x - at[j]) / (at[i] - at[j])).product()
        })
    }
}

/// Integrals along an interval: centreline, energy, error estimate.
pub(super) struct IntervalIntegrals {
    /// r(1) - r(0).
    pub way: Vector3<f64>,
    pub energy: f64,
    /// Work int f.(r - r(0)) ds of the load along the interval.
    pub work: f64,
    /// Estimated error of frame and couple over kappa at the end of the interval.
    pub error: f64,
    /// Turn of the sections along the interval, in radians.
    pub turn: f64,
}

/// Slopes and compliance of the rod at a stage.
pub(super) struct Slope {
    pub turn: Turn,
    /// R u of the strains, and r' = R v.
    u: Vector3<f64>,
    pub r: Vector3<f64>,
    /// The force n(s).
    pub n: Vector3<f64>,
    energy: f64,
    /// R C R^T by blocks: uu, uv, vu, vv.
    pub e: [Matrix3<f64>; 4],
}

/// A rod under a given force, with its units and loads.
#[derive(Clone, Copy)]
pub(super) struct RodUnderForce<'a> {
    pub law: &'a ScaledLaw,
    /// Force n(0) at the base; n is constant if the rod bears no load.
    pub n: Vector3<f64>,
    /// Load along the rod.
    pub weight: Option<&'a ScaledLoad>,
    /// The unit of couples: sqrt|n|.
    pub kappa: f64,
    /// Implicit step of the fast layer, if one is being taken.
    pub creeping: Option<&'a LayerStep>,
    pub symmetry: Symmetry,
}

/// Symmetries of a rod that are known before the solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::rod) struct Symmetry {
    /// Normal of the plane of a planar rod; `None` for a rod in space.
    pub plane: Option<Vector3<f64>>,
    /// True if a turn of the rod about the axis of the clamp is neutral under a given force. The index then counts one
    /// eigenvalue as 0, whatever its rounded value is.
    pub turns: bool,
}

impl<'a> RodUnderForce<'a> {
    pub(super) fn new(law: &'a ScaledLaw, weight: Option<&'a ScaledLoad>, n: Vector3<f64>) -> Self {
        let mut pulled = Self {
            law,
            n,
            weight,
            kappa: 1.0,
            creeping: None,
            symmetry: Symmetry::default(),
        };
        let most = n.norm().max(pulled.force(1.0).norm());
        pulled.kappa = most.sqrt().max(1.0);
        pulled
    }

    /// This rod under another force n(0), with the unit of couples of the new force.
    pub(super) fn with_force_and_unit(&self, n: Vector3<f64>) -> Self {
        Self {
            symmetry: self.symmetry,
            ..Self::new(self.law, self.weight, n)
        }
    }

    /// This rod under another force n(0), with the same unit of couples.
    pub(super) fn with_force(&self, n: &Vector3<f64>) -> Self {
        Self { n: *n, ..*self }
    }

    /// n(s) = n(0) - int_0^s f.
    pub(super) fn force(&self, s: f64) -> Vector3<f64> {
        match self.weight {
            None => self.n,
            Some(weight) => self.n - weight.integral_to(s),
        }
    }

    /// The force of the load at a node.
    pub(super) fn jump(&self, s: f64) -> Vector3<f64> {
        self.weight
            .map_or_else(Vector3::zeros, |weight| weight.jump_at(s))
    }
}

impl RodUnderForce<'_> {
    /// The strains under resultants along the directors.
    pub(super) fn inverse(&self, s: f64, local: &Vector6<f64>) -> Result<Response<'_>> {
        let inverse = self.law.inverse(s, local)?;
        Ok(match self.creeping {
            Some(step) => step.modify_response(s, inverse),
            None => inverse,
        })
    }

    fn slope(&self, s: f64, at: &FrameAndCouple) -> Result<Slope> {
        let turn = frame(&at.turn);
        let force = self.force(s);
        let (m, n) = (turn.tr_mul(&at.m), turn.tr_mul(&force));
        let local = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
        let inverse = self.inverse(s, &local)?;
        let (u, v) = (
            inverse.strain.fixed_rows::<3>(0).into_owned(),
            inverse.strain.fixed_rows::<3>(3).into_owned(),
        );
        let c = inverse.compliance.matrix();
        let block = |i: usize, j: usize| turn * c.fixed_view::<3, 3>(i, j) * turn.transpose();
        Ok(Slope {
            turn: spin(&at.turn, &u),
            u: turn * u,
            r: turn * v,
            n: force,
            energy: inverse.energy,
            e: [block(0, 0), block(0, 3), block(3, 0), block(3, 3)],
        })
    }

    pub(super) fn slopes(
        &self,
        from: f64,
        to: f64,
        stages: &[FrameAndCouple; STAGES],
    ) -> Result<[Slope; STAGES]> {
        let scheme = Scheme::get();
        let mut found = Vec::with_capacity(STAGES);
        for (x, at) in scheme.nodes.iter().zip(stages) {
            found.push(self.slope(from + x * (to - from), at)?);
        }
        let found: std::result::Result<[Slope; STAGES], _> = found.try_into();
        Ok(found.unwrap_or_else(|_| unreachable!("as many slopes as stages")))
    }

    /// Centreline and energy along an interval, and an estimate of its error.
    ///
    /// The error of the slope is the first Legendre mode beyond those of the stages, extrapolated from the last ones.
    /// Its effect at the node is the mode times the same mode of Green's function, which is no less than that of
    /// exp(z x), z = lam h.
    pub fn integrate_interval(
        &self,
        from: f64,
        to: f64,
        stages: &[FrameAndCouple; STAGES],
    ) -> Result<IntervalIntegrals> {
        let (scheme, h) = (Scheme::get(), to - from);
        let slopes = self.slopes(from, to, stages)?;
        let (mut way, mut energy, mut work) = (Vector3::zeros(), 0.0, 0.0);
        let mut modes = [Vector6::<f64>::zeros(); 3];
        let (mut rate, mut turn) = (0.0_f64, 0.0_f64);
        for (j, slope) in slopes.iter().enumerate() {
            let weight = h * scheme.weights[j];
            way += slope.r * weight;
            energy += slope.energy * weight;
            if let Some(load) = self.weight {
                let parts = slopes.iter().zip(&scheme.integrate[j]);
                let place = parts.fold(Vector3::zeros(), |sum, (at, a)| sum + at.r * (h * a));
                work += weight * load.density(from + scheme.nodes[j] * h).dot(&place);
            }
            let couple = slope.n.cross(&slope.r) / self.kappa;
            for (mode, by) in modes.iter_mut().zip(&scheme.modes) {
                for i in 0..3 {
                    mode[i] += h * by[j] * slope.u[i];
                    mode[3 + i] += h * by[j] * couple[i];
                }
            }
            let growth = (slope.e[0].norm() * slope.n.norm()).sqrt();
            rate = rate.max(growth + slope.u.norm());
            turn = turn.max(h * slope.u.norm());
        }
        let [a, b, c] = modes.map(|mode| mode.amax());
        // Modes of one parity may vanish: compare over two steps back and over one, and use the slower decay.
        let ratio = |later: f64, earlier: f64| {
            if later <= 1e-17 {
                0.0
            } else {
                (later / earlier).min(1.0)
            }
        };
        let tail = (c * ratio(b.max(c), a.max(b))).max(b * ratio(c, a));
        let z = h * rate;
        let green = (1..=STAGES).fold(1.0, |product, k| product * 0.5 * z / (2.0 * k as f64 - 1.0));
        Ok(IntervalIntegrals {
            way,
            energy,
            work,
            error: tail * green.min(1.0),
            turn,
        })
    }
}

/// Adds a part of a change to a node.
pub(super) fn correct(node: &mut FrameAndCouple, change: &Vector6<f64>, part: f64, kappa: f64) {
    let phi = change.fixed_rows::<3>(0) * part;
    let m = change.fixed_rows::<3>(3) * (part * kappa);
    *node = node.varied(&phi, &m);
}
