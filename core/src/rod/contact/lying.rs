//! Stretches on which a rod lies along an obstacle, in a plane.
//!
//! The rod follows the surface: t' = -k nu, with k = t.H t the curvature of the surface along the rod. So the couple is
//! that of a section with this curvature, constant on a uniform rod, and the force is a tension T along the tangent:
//!
//! ```text
//! T' = -f.t,   pressure p = k T - f.nu >= 0.
//! ```
//!
//! At its ends the rod touches with relative curvature zero, and a point reaction Q >= 0 may act there. Before the
//! stretch the force across the rod is Q_a; behind it Q_b is an unknown. A stretch may also begin at a clamp that lies
//! on the surface, or go on to the end of the rod.
//!
//! With a = t.rho(s_a) the way of the material along the surface, the section just beyond s_b varies by
//!
//! ```text
//! phi = omega a,  rho = t a,  dm = -Q_b (t x nu) ds_b,
//! dn = (dT_a + a k int f.nu - Q_b k (a + ds_b)) t - (k T a + p ds_b + dQ_b) nu,
//! dT_a = t.dn - k Q_a (a + ds_a).
//! ```

use super::super::distributed_load::ScaledLoad;
use super::super::ivp::Wrench;
use super::super::scaled_law::ScaledLaw;
use super::touched_rod::{Moving, TouchedSection, Varied};
use crate::error::{Error, Result};
use crate::math::gauss::Rule;
use crate::math::se3::join;
use crate::obstacle::Gap;
use nalgebra::{Matrix3xX, Rotation3, RowDVector, Vector3};

/// Nodes of the Gauss rule for loads along an arc.
const NODES: usize = 16;
/// Couples and strains of the stretch that differ by less are equal.
const SAME: f64 = 1e-9;

/// A stretch that lies on a surface; lengths, forces and couples in the units of the rod.
#[derive(Debug, Clone)]
pub(super) struct Lying {
    pub(super) from: f64,
    pub(super) to: f64,
    /// The section at the start, with the force on the stretch: a tension.
    pub(super) start: TouchedSection,
    /// Normal and curvature of the surface along the rod, at the start.
    normal: Vector3<f64>,
    curvature: f64,
    /// Energy of the rod up to the start, and per length of the stretch.
    energy_before: f64,
    energy: f64,
}

/// Couple about the plane's normal of a section with the curvature of the surface, and the section's energy per length.
///
/// # Errors
/// A rod that stretches, or whose section or rest curvature varies between `from` and `to`.
fn lying_couple(
    law: &ScaledLaw,
    (from, to): (f64, f64),
    normal: &Vector3<f64>,
    wanted: f64,
) -> Result<(f64, f64)> {
    let strains =
        |s: f64, m: f64, n: f64| law.inverse(s, &join(&(normal * m), &(Vector3::z() * n)));
    let at = |s: f64| -> Result<(f64, f64)> {
        let mut m = 0.0;
        for _ in 0..30 {
            let found = strains(s, m, 0.0)?;
            let about = |strain: Vector3<f64>| strain.dot(normal);
            let miss = about(found.strain.fixed_rows::<3>(0).into_owned()) - wanted;
            let by = &*found.compliance * &join(normal, &Vector3::zeros());
            let slope = about(by.fixed_rows::<3>(0).into_owned());
            let step = miss / slope;
            if !step.is_finite() {
                break;
            }
            m -= step;
            if step.abs() <= 1e-14 * (1.0 + m.abs()) {
                return Ok((m, strains(s, m, 0.0)?.energy));
            }
        }
        Err(Error::no_convergence(
            "no couple bends the rod along the obstacle; its flexure may be rigid",
        ))
    };
    let (m, energy) = at(from)?;
    for s in [0.5 * (from + to), to] {
        if !((at(s)?.0 - m).abs() <= SAME * (1.0 + m.abs())) {
            return Err(Error::domain(
                "the section or the unloaded shape varies where the rod lies along an obstacle; such rods lie on obstacles at points only",
            ));
        }
    }
    if !((strains(from, m, 1.0)?.strain[5] - strains(from, m, 0.0)?.strain[5]).abs() <= SAME) {
        return Err(Error::domain(
            "a rod that stretches cannot lie along an obstacle here: the axial stiffness must be \"rigid\"",
        ));
    }
    Ok((m, energy))
}

impl Lying {
    /// The stretch from `from` to `to` on a surface whose gap at the section `here` is `gap`. The plane has the normal
    /// `plane`, in the clamp's frame and in that of every section. Only the tension of the force is taken.
    ///
    /// # Errors
    /// As [`lying_couple`]; a force at a single place of the stretch.
    pub(super) fn new(
        (law, load): (&ScaledLaw, &ScaledLoad),
        (from, to): (f64, f64),
        (here, energy_before): (&TouchedSection, f64),
        gap: &Gap,
        plane: &Vector3<f64>,
    ) -> Result<Self> {
        let side = here.tangent().dot(&plane.cross(&gap.normal)).signum();
        let tangent = plane.cross(&gap.normal) * side;
        let own = here.tangent();
        let angle = plane.dot(&own.cross(&tangent)).atan2(own.dot(&tangent));
        let aligned = Rotation3::new(plane * angle);
        let curvature = tangent.dot(&(gap.hessian * tangent));
        let turn = tangent.cross(&gap.normal) * -curvature;
        let (m, energy) = lying_couple(law, (from, to), plane, turn.dot(plane))?;
        let forced = |s: &f64| *s > from && *s < to && load.jump_at(*s) != Vector3::zeros();
        if load.breaks().iter().any(forced) {
            return Err(Error::domain(
                "a force at a single place acts where the rod lies along an obstacle; spread the force over a part of the rod",
            ));
        }
        Ok(Self {
            from,
            to,
            start: TouchedSection {
                rotation: aligned.matrix() * here.rotation,
                m: plane * m,
                n: tangent * tangent.dot(&here.n),
                turn,
                stretch: 1.0,
                ..*here
            },
            normal: gap.normal,
            curvature,
            energy_before,
            energy,
        })
    }

    /// Turn from the start over an arc.
    fn turned(&self, arc: f64) -> Rotation3<f64> {
        Rotation3::new(self.start.turn * arc)
    }

    /// The normal of the surface at s.
    pub(super) fn normal(&self, s: f64) -> Vector3<f64> {
        self.turned(s - self.from) * self.normal
    }

    /// int f.v ds from the start to s, with v a direction that turns with the arc.
    fn taken(&self, load: &ScaledLoad, s: f64, v: &Vector3<f64>) -> f64 {
        if self.curvature == 0.0 {
            return v.dot(&(load.integral_to(s) - load.integral_to(self.from)));
        }
        let rule = Rule::new(NODES);
        let length = s - self.from;
        let nodes = rule.nodes.iter().zip(&rule.weights);
        nodes
            .map(|(x, w)| {
                w * length
                    * (self.turned(x * length) * v).dot(&load.density(self.from + x * length))
            })
            .sum()
    }

    /// The tension at s.
    fn tension(&self, load: &ScaledLoad, s: f64) -> f64 {
        let tangent = self.start.tangent();
        self.start.n.dot(&tangent) - self.taken(load, s, &tangent)
    }

    /// The pressure of the surface on the rod, per length, at s.
    pub(super) fn pressure(&self, load: &ScaledLoad, s: f64) -> f64 {
        self.curvature * self.tension(load, s) - load.density(s).dot(&self.normal(s))
    }

    /// The section at s.
    pub(super) fn section(&self, load: &ScaledLoad, s: f64) -> TouchedSection {
        let arc = s - self.from;
        let turn = self.turned(arc);
        let (tangent, k) = (self.start.tangent(), self.curvature);
        let way = if k == 0.0 {
            tangent * arc
        } else {
            let (sine, cosine) = (k * arc).sin_cos();
            tangent * (sine / k) - self.normal * ((1.0 - cosine) / k)
        };
        TouchedSection {
            r: self.start.r + way,
            rotation: turn.matrix() * self.start.rotation,
            n: turn * tangent * self.tension(load, s),
            ..self.start
        }
    }

    /// The section at s as a state of the integration, with the constants (m_c, n_c) of a free rod through the section.
    pub(super) fn state<const K: usize>(&self, load: &ScaledLoad, s: f64) -> (Moving<K>, Wrench) {
        let here = self.section(load, s);
        let energy = self.energy_before + self.energy * (s - self.from);
        let state = Moving::at_section(s, &here.rotation, &here.r, energy);
        let constants = join(
            &(here.m + here.r.cross(&here.n)),
            &(here.n + load.integral_to(s)),
        );
        (state, constants)
    }

    /// Work int f.r ds of the load on the stretch.
    pub(super) fn work(&self, load: &ScaledLoad) -> f64 {
        let rule = Rule::new(NODES);
        let length = self.to - self.from;
        let nodes = rule.nodes.iter().zip(&rule.weights);
        nodes
            .map(|(x, w)| {
                let s = self.from + x * length;
                w * length * load.density(s).dot(&self.section(load, s).r)
            })
            .sum()
    }

    /// Total of the pressure.
    pub(super) fn pressed(&self, load: &ScaledLoad) -> f64 {
        let rule = Rule::new(NODES);
        let length = self.to - self.from;
        let nodes = rule.nodes.iter().zip(&rule.weights);
        nodes
            .map(|(x, w)| w * length * self.pressure(load, self.from + x * length))
            .sum()
    }

    /// The variations just beyond the stretch. `before` are those at its start, `reaction` is Q_b, and `moves` are the
    /// variations of s_a, s_b and Q_b by columns. `n` is the force before the start.
    pub(super) fn carry(
        &self,
        load: &ScaledLoad,
        before: &Varied,
        n: &Vector3<f64>,
        reaction: f64,
        moves: &[RowDVector<f64>; 3],
    ) -> Varied {
        let [at_start, at_end, push] = moves;
        let (tangent, k) = (self.start.tangent(), self.curvature);
        let along = tangent.transpose() * &before.rho;
        let along = RowDVector::from_iterator(along.ncols(), along.iter().copied());
        let tension = tangent.transpose() * &before.dn;
        let tension = RowDVector::from_iterator(along.ncols(), tension.iter().copied());
        let tension = tension - (&along + at_start) * (k * self.normal.dot(n));
        let end = self.section(load, self.to);
        let (t, nu) = (end.tangent(), self.normal(self.to));
        let taken = self.taken(load, self.to, &self.normal);
        let moved = &along + at_end;
        let by_t = tension + &along * (k * taken) - &moved * (reaction * k);
        let pull = end.n.dot(&t);
        let by_nu = &along * (-k * pull) - at_end * self.pressure(load, self.to) - push;
        let columns = |v: Vector3<f64>, by: &RowDVector<f64>| -> Matrix3xX<f64> { v * by };
        let dn = columns(t, &by_t) + columns(nu, &by_nu);
        let rho = columns(t, &along);
        let force = end.n - nu * reaction;
        let dm = columns(t.cross(&nu) * -reaction, at_end) - force.cross_matrix() * &rho
            + end.r.cross_matrix() * &dn;
        Varied {
            phi: columns(self.start.turn, &along),
            rho,
            dm,
            dn,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ContactOptions, ContactProblem, Surface};
    use crate::obstacle::Obstacle;
    use crate::rod::{DistributedLoad, EndConditions, Problem, Rod};
    use crate::section::Linear;
    use nalgebra::{UnitQuaternion, Vector3};

    fn rod(length: f64, down: f64) -> Rod {
        let turn =
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * std::f64::consts::PI + down);
        let law = Linear::diagonal([1.0, 1.0], 1.0).expect("a law");
        Rod::new(length, law)
            .expect("a rod")
            .with_clamp(Vector3::zeros(), turn)
    }

    fn among(problem: Problem, obstacle: Obstacle) -> ContactProblem {
        let surface = Surface::new(obstacle, 0.0).expect("a surface");
        ContactProblem::new(problem, vec![surface], ContactOptions::default()).expect("a problem")
    }

    /// Catches a wrong derivative of a stretch that lies on a surface: Newton's method would converge slowly, and the
    /// tangents of branches would be wrong. Kinds: between two free parts on a cylinder, under an oblique weight; from
    /// the clamp; up to the free end.
    #[test]
    fn derivatives_of_lying_stretches_are_those_of_differences() {
        let pull = EndConditions::load(Vector3::new(0.5, 0.0, -6.0), Vector3::zeros());
        let weight = DistributedLoad::constant(Vector3::new(0.3, 0.0, -0.7)).expect("a load");
        let drum = Obstacle::cylinder(Vector3::new(1.0, 0.0, -0.85), Vector3::y(), 0.8, false);
        let drum = among(
            Problem::new(rod(3.0, 0.0), pull, 1e-13)
                .expect("a problem")
                .with_distributed(&weight),
            drum.expect("a cylinder"),
        );
        let raised = EndConditions {
            position: [None, Some(0.0), Some(0.7)],
            ..EndConditions::load(Vector3::new(0.4, 0.0, 0.0), Vector3::zeros())
        };
        let floor =
            |h: f64| Obstacle::plane(Vector3::new(0.0, 0.0, -h), Vector3::z()).expect("a plane");
        let raised = Problem::new(rod(5.0, 0.0), raised, 1e-13).expect("a problem");
        let raised = among(raised.with_distributed(&weight), floor(0.0));
        let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        let pressed = Problem::new(rod(1.0, 1.0), free, 1e-13).expect("a problem");
        let pressed = among(pressed, floor(0.25));
        for (name, problem) in [("drum", drum), ("raised", raised), ("pressed", pressed)] {
            let found = problem.solve(None).expect(name);
            assert!(
                found.touches.iter().any(|touch| touch.line.is_some()),
                "{name}: no line"
            );
            let guess = super::super::ContactGuess {
                base: found.base,
                touches: found.touches.iter().map(Into::into).collect(),
            };
            let at = problem.inward(&guess).expect("a guess");
            let x = problem.unknowns(&at);
            let jacobian = problem.balanced(&at).expect("derivatives").jacobian;
            let h = 1e-5;
            for j in 0..x.len() {
                let residual = |step: f64| {
                    let mut moved = x.clone();
                    moved[j] += step;
                    let at = problem.touching(&moved, &at.touches).expect("a trial");
                    problem.balanced(&at).expect("a trial").residual
                };
                let difference = (residual(h) - residual(-h)) / (2.0 * h);
                let error = (&difference - jacobian.column(j)).norm();
                assert!(
                    error < 1e-7 * (1.0 + difference.norm()),
                    "{name}, column {j}: {error:e} of {}",
                    difference.norm()
                );
            }
        }
    }
}
