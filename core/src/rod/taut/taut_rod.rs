//! Taut rods in the world and in the user's units.

use super::interval::{FrameAndCouple, RodUnderForce};
use super::turning_base::Turning;
use super::{Derivatives, Fallen, Shape, Solved, Spring, Tip, solve_taut_rod};
use crate::error::Result;
use crate::math::se3::{frame, halves, join};
use crate::rod::distributed_load::ScaledLoad;
use crate::rod::{DistributedLoad, Rod, RodSection, Wrench};
use nalgebra::{Matrix3, Vector3, Vector6};

/// A rod under a given force with its end held as a [`Tip`] says, accurate at any pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Taut {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end.
    pub end: RodSection,
    /// Potential -int f.r ds of the load along the rod.
    pub potential: f64,
    /// Derivatives by the given force at fixed [`Tip`].
    pub by_force: Derivatives,
    /// Derivatives by the turn of the tip, or by the couple on it, at fixed force.
    pub by_tip: Derivatives,
    /// Derivatives by a turn of the clamp, in its frame, at fixed force and [`Tip`] along its directors. They arise
    /// from the load along the rod, which does not turn along. None if not asked for.
    pub by_turn: Option<Derivatives>,
    /// Sign of the determinant of the boundary-value problem; it changes where the rod under this force is neutral.
    pub sign: f64,
    /// Estimated error of the directors, and of couples over sqrt(F B).
    pub error: f64,
    /// Newton steps.
    pub iterations: usize,
    /// End data in the directors of the clamp and units of the rod.
    pub(super) tip: Tip,
    pub(super) spring: Spring,
    /// Place of the end, and its derivative by the given force.
    place: Vector3<f64>,
    give: Matrix3<f64>,
    pub(super) shape: Shape,
    /// Load along the rod.
    pub(super) weight: Option<ScaledLoad>,
}

/// Dead load along a taut rod.
#[derive(Debug, Clone, Copy)]
pub struct TautLoad<'a> {
    /// The load.
    pub along: &'a DistributedLoad,
    /// True if the solution is to have [`Taut::by_turn`], the response of the load to a turn of the clamp.
    pub turns: bool,
}

/// Given data of a taut rod, in the directors of the clamp and in units of the rod.
struct TautData {
    m: Vector3<f64>,
    n: Vector3<f64>,
    tip: Tip,
    spring: Spring,
    weight: Option<ScaledLoad>,
}

impl Taut {
    /// Intervals of the mesh along the rod.
    pub fn intervals(&self) -> usize {
        self.shape.intervals()
    }

    /// Total force on rod and spring, as in [`Taut::spring`].
    fn total_force(&self) -> Vector3<f64> {
        let stretch = self.place - self.spring.at;
        self.shape.n + stretch * self.spring.stiffness
    }
}

impl Rod {
    /// Equilibrium under the force n(0) of `base` with its end held as `tip` says, both in the world. The couple of
    /// `base`, and `start`, select among several equilibria. Frame and couple are accurate to `tolerance`.
    ///
    /// Under a pull the base wrench alone does not determine the end beyond sqrt(F L^2/B) of about 16 ([`Rod::end`]);
    /// force and tip do.
    ///
    /// # Errors
    /// A section law that refuses a resultant on the way; no equilibrium found; one that is neutral under this force.
    pub fn taut(
        &self,
        base: &Wrench,
        tip: &Tip,
        start: Option<&Taut>,
        tolerance: f64,
    ) -> Result<Taut> {
        self.taut_beside(base, tip, &Spring::NONE, None, start, tolerance)
    }

    /// Equilibrium of a rod that bears the force of `base` together with a spring beside its end, and a dead load
    /// along it if given. [`Taut::base`] has the force on the rod alone; derivatives by the force are by the total.
    ///
    /// # Errors
    /// As [`Rod::taut`].
    pub fn taut_beside(
        &self,
        base: &Wrench,
        tip: &Tip,
        spring: &Spring,
        load: Option<TautLoad<'_>>,
        start: Option<&Taut>,
        tolerance: f64,
    ) -> Result<Taut> {
        let TautData {
            m,
            n,
            tip,
            spring,
            weight,
        } = self.taut_data(base, tip, spring, load);
        let found = solve_taut_rod(
            &RodUnderForce::new(&self.law, weight.as_ref(), n),
            &m,
            &tip,
            &spring,
            start.map(|start| &start.shape),
            tolerance,
        )?;
        let turned = match &weight {
            Some(weight) if load.is_some_and(|load| load.turns) => {
                let turning = Turning::new(&self.law, weight, &found.shape, &tip, &spring);
                Some(turning?.derivatives())
            }
            _ => None,
        };
        self.outward_taut(found, tip, spring, weight, turned)
    }

    /// [`Rod::taut_beside`] of a rod whose section law, load or end condition differs little from that of `known`: its
    /// base wrench, and place and couple of its end, to first order in the difference. All else is as in `known`.
    ///
    /// # Errors
    /// A section law that refuses a resultant; a rod that is neutral under its force.
    pub fn taut_to_first_order(
        &self,
        base: &Wrench,
        tip: &Tip,
        spring: &Spring,
        load: Option<TautLoad<'_>>,
        known: &Taut,
    ) -> Result<Taut> {
        let given = self.taut_data(base, tip, spring, load);
        let pulled = RodUnderForce::new(&self.law, given.weight.as_ref(), given.n);
        let (shape, place) = pulled.corrected_once(&known.shape, &given.tip, &given.spring)?;
        let (couple, force) = self.units();
        let turn = *self.clamp.rotation.to_rotation_matrix().matrix();
        let mut found = known.clone();
        found.base = join(
            &(turn * shape.nodes[0].m * couple),
            &(turn * shape.n * force),
        );
        let last = shape.nodes[shape.nodes.len() - 1];
        found.end.couple = turn * last.m * couple;
        found.end.directors = turn * frame(&last.turn);
        found.end.position = self.clamp.translation.vector + turn * place * self.length;
        found.end.force = turn * pulled.with_force(&shape.n).force(1.0) * force;
        Ok(found)
    }

    /// Data of a taut rod in the directors of the clamp and in units of the rod.
    fn taut_data(
        &self,
        base: &Wrench,
        tip: &Tip,
        spring: &Spring,
        load: Option<TautLoad<'_>>,
    ) -> TautData {
        let (couple, force) = self.units();
        let turn = *self.clamp.rotation.to_rotation_matrix().matrix();
        let (m, n) = halves(&self.inward(base));
        TautData {
            m,
            n,
            tip: match tip {
                Tip::Turned(directors) => Tip::Turned(turn.tr_mul(directors)),
                Tip::Loaded { couple: on, arm } => Tip::Loaded {
                    couple: turn.tr_mul(on) / couple,
                    arm: arm / self.length,
                },
            },
            spring: Spring {
                stiffness: spring.stiffness * self.length / force,
                at: turn.tr_mul(&(spring.at - self.clamp.translation.vector)) / self.length,
            },
            weight: load.map(|load| ScaledLoad::new(load.along, self)),
        }
    }

    /// Conversion of a solution from the rod's units into the world and the user's units.
    fn outward_taut(
        &self,
        found: Solved,
        tip: Tip,
        spring: Spring,
        weight: Option<ScaledLoad>,
        turned: Option<Derivatives>,
    ) -> Result<Taut> {
        let (couple, force) = self.units();
        let pulled = RodUnderForce::new(&self.law, weight.as_ref(), found.shape.n);
        let turn = *self.clamp.rotation.to_rotation_matrix().matrix();
        let place = |m: &Matrix3<f64>, unit: f64| turn * m * turn.transpose() * unit;
        let out = |by: &Derivatives, unit: f64| Derivatives {
            base_couple: place(&by.base_couple, couple / unit),
            couple: place(&by.couple, couple / unit),
            turn: place(&by.turn, 1.0 / unit),
            position: place(&by.position, self.length / unit),
        };
        let by_tip = match tip {
            Tip::Turned(_) => 1.0,
            Tip::Loaded { .. } => couple,
        };
        let last = found.shape.at(1.0);
        let n = pulled.force(1.0);
        let end = self.outward_section(1.0, &last, &found.position, found.energy, &n)?;
        let potential = (weight.as_ref()).map_or(0.0, |weight| weight.potential(found.work));
        Ok(Taut {
            base: join(
                &(turn * found.base_couple * couple),
                &(turn * found.shape.n * force),
            ),
            end,
            potential: potential * couple,
            by_force: out(&found.by_force, force),
            by_tip: out(&found.by_tip, by_tip),
            by_turn: turned.map(|by| out(&by, 1.0)),
            sign: found.sign,
            error: found.error,
            iterations: found.iterations,
            tip,
            spring,
            place: found.position,
            give: found.by_force.position,
            shape: found.shape,
            weight,
        })
    }

    /// The collocation problem of the rod under the force `n`, with the load along it.
    pub(super) fn under_force<'a>(&'a self, found: &'a Taut, n: Vector3<f64>) -> RodUnderForce<'a> {
        RodUnderForce::new(&self.law, found.weight.as_ref(), n)
    }

    /// Rod at rest after a taut rod leaves its fold `found` towards `beside`, rods a little to both sides of the
    /// fold. The end is held in place. The flow is the fast layer of a viscosity in proportion to the stiffness; of
    /// two ways down the lower one is taken. With `shown`, the shapes on the way are returned too, in the directors
    /// of the clamp.
    ///
    /// # Errors
    /// A flow that does not settle.
    pub fn taut_fallen(
        &self,
        found: &Taut,
        beside: [&Taut; 2],
        tolerance: f64,
        shown: bool,
    ) -> Result<(Vec<Fallen>, Taut)> {
        let pulled = self.under_force(found, found.shape.n);
        let beside = beside.map(|taut| &taut.shape);
        let (mut way, rested, spring) = pulled.land_from_fold(
            &found.shape,
            beside,
            &found.tip,
            found.place,
            tolerance,
            shown,
        )?;
        for (energy, sections) in &mut way {
            *energy *= self.units().0;
            for at in sections {
                at.translation.vector *= self.length;
            }
        }
        let load = found.weight.clone();
        Ok((
            way,
            self.outward_taut(rested, found.tip, spring, load, None)?,
        ))
    }

    pub(in crate::rod) fn outward_section(
        &self,
        s: f64,
        at: &FrameAndCouple,
        position: &Vector3<f64>,
        energy: f64,
        n: &Vector3<f64>,
    ) -> Result<RodSection> {
        let (couple, force) = self.units();
        let turn = *self.clamp.rotation.to_rotation_matrix().matrix();
        let directors = frame(&at.turn);
        let local = join(&directors.tr_mul(&at.m), &directors.tr_mul(n));
        let e = self.law.inverse(s, &local)?.strain;
        let l = self.length;
        Ok(RodSection {
            s: s * l,
            position: self.clamp.translation.vector + turn * position * l,
            directors: turn * directors,
            couple: turn * at.m * couple,
            force: turn * n * force,
            strain: Vector6::new(e[0] / l, e[1] / l, e[2] / l, e[3], e[4], e[5]),
            energy: energy * couple,
        })
    }

    /// Sections of a taut rod at the arclengths `at`, in growing order in [0, L].
    ///
    /// # Errors
    /// As [`Rod::taut`].
    pub fn taut_shape(&self, found: &Taut, at: &[f64], tolerance: f64) -> Result<Vec<RodSection>> {
        let pulled = self.under_force(found, found.total_force());
        // Between its nodes a mesh has half the order: it is halved until the polynomials are as accurate.
        let places: Vec<f64> = at.iter().map(|s| s / self.length).collect();
        let sections =
            pulled.sections(&found.shape, &found.tip, &found.spring, &places, tolerance)?;
        let sections = sections.iter().zip(&places);
        sections
            .map(|((section, r, energy), s)| {
                let (s, pulled) = (s.clamp(0.0, 1.0), pulled.with_force(&found.shape.n));
                self.outward_section(s, section, r, *energy, &pulled.force(s))
            })
            .collect()
    }

    /// Morse index of a taut rod, its place held and its end as its [`Tip`] says; 0 is stable.
    ///
    /// # Errors
    /// A rod that is neutral under its force.
    pub fn taut_index(&self, found: &Taut) -> Result<usize> {
        let axes = [0, 1, 2].map(|i| Vector3::ith(i, 1.0));
        self.taut_index_along(found, &axes)
    }

    /// Morse index of a taut rod with the place of its end held along the world axes `axes` alone.
    pub(in crate::rod) fn taut_index_along(
        &self,
        found: &Taut,
        axes: &[Vector3<f64>],
    ) -> Result<usize> {
        let pulled = self.under_force(found, found.shape.n);
        pulled.index(
            &found.shape,
            &found.tip,
            &found.spring.alone(&found.give)?,
            axes,
            None,
        )
    }
}
