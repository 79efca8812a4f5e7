//! Response of a taut rod with a dead load along it to a turn of its base (theory 3.8).
//!
//! Without a load the rod turns rigidly with its base. A load is fixed in the world: seen from a base that turns by
//! psi it turns by -psi. At a given n(0) along the directors of the base the force along the rod changes by
//! ```text
//! dn(s) = psi x int_0^s f = psi x (n(0) - n(s)),
//! ```
//! which enters the right-hand sides of the variations ([`super::condensed`]). The end data, seen from the base, are
//! unchanged.

use super::chain::REST;
use super::condensed::{Condensed, IntervalVariations, Residual};
use super::first_order_mass::{Columns, LinearResponses, LinearisedRod, Rates, neutral_error};
use super::interval::{RodUnderForce, STAGES};
use super::{Derivatives, Shape, Spring, Tip};
use crate::error::Result;
use crate::rod::distributed_load::ScaledLoad;
use crate::rod::scaled_law::ScaledLaw;
use nalgebra::{Matrix3, Vector3};

/// Derivatives of a section by a turn of the base, in the frame of the base: columns are about the axes of the base.
#[derive(Debug, Clone, Copy)]
pub(super) struct ByTurn {
    pub turn: Matrix3<f64>,
    pub couple: Matrix3<f64>,
    pub place: Matrix3<f64>,
    /// d(place)/ds.
    pub slope: Matrix3<f64>,
}

impl ByTurn {
    const NONE: Self = {
        let none = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self {
            turn: none,
            couple: none,
            place: none,
            slope: none,
        }
    };
}

/// Response to a turn of the base, at the stages of the intervals.
pub(super) struct Turning {
    pub stages: Vec<[ByTurn; STAGES]>,
    /// Derivatives of the couple at the base, and of the force n(0).
    base_couple: Matrix3<f64>,
    pub force: Matrix3<f64>,
    /// Derivatives of turn, couple and place of the end.
    end: [Matrix3<f64>; 3],
}

impl IntervalVariations {
    /// Residual from the load of this interval as the base turns about `axis`, `base` being n(0).
    fn load_turned(&self, axis: &Vector3<f64>, base: &Vector3<f64>) -> Residual {
        let mut left = Residual::NONE;
        for (i, slope) in self.slopes.iter().enumerate() {
            let force = axis.cross(&(base - slope.n)) * self.h;
            let [turned, bent] = self.by_force[i].map(|by| by * force);
            (left.turned[i], left.bent[i]) = (turned, bent);
            left.moved[i] = slope.e[3] * force;
        }
        left
    }
}

impl Turning {
    /// Response of the rod whose end is held as `tip` says beside `spring`.
    ///
    /// # Errors
    /// A law that refuses; a rod that is neutral under these end data.
    pub fn new(
        law: &ScaledLaw,
        weight: &ScaledLoad,
        shape: &Shape,
        tip: &Tip,
        spring: &Spring,
    ) -> Result<Self> {
        let pulled = RodUnderForce::new(law, Some(weight), shape.force());
        let (hold, _) = Rates::Force.force_equation(tip, spring, pulled.kappa * pulled.kappa);
        let swept = LinearisedRod::new(&pulled, shape, tip, hold)?.ok_or_else(neutral_error)?;
        let condensed = swept.condense().ok_or_else(neutral_error)?;
        Ok(Self::of(&swept, condensed).ok_or_else(neutral_error)?.0)
    }

    /// Response of a linearised rod, with the condensed intervals returned; None if the rod is singular.
    pub fn of(
        swept: &LinearisedRod<'_>,
        mut condensed: Vec<Condensed>,
    ) -> Option<(Self, Vec<Condensed>)> {
        let zero = Matrix3::zeros();
        let mut found = Self {
            stages: vec![[ByTurn::NONE; STAGES]; condensed.len()],
            base_couple: zero,
            force: zero,
            end: [zero; 3],
        };
        let kappa = swept.pulled.kappa;
        for i in 0..3 {
            let axis = Vector3::ith(i, 1.0);
            let left = swept.intervals.iter();
            let left: Vec<Residual> = left
                .map(|by| by.load_turned(&axis, &swept.pulled.n))
                .collect();
            let intervals = condensed.into_iter().zip(&swept.intervals).zip(&left);
            let intervals =
                intervals.map(|((condensed, by), left)| condensed.with_residual(by, left));
            let answered = swept.responses(intervals.collect())?;
            let place = found.set_column(i, swept, &answered, &left);
            let (first, last) = (answered.nodes[0], answered.nodes[answered.nodes.len() - 1]);
            let couple =
                |node: &super::chain::Answers| node.fixed_rows::<3>(3).column(REST) * kappa;
            found.base_couple.set_column(i, &couple(&first));
            found.force.set_column(i, &answered.force.column(REST));
            found.end[0].set_column(i, &last.fixed_rows::<3>(0).column(REST));
            found.end[1].set_column(i, &couple(&last));
            found.end[2].set_column(i, &place);
            condensed = answered.condensed;
        }
        Some((found, condensed))
    }

    /// Sets column `i` at the stages; returns the column of the place of the end.
    fn set_column(
        &mut self,
        i: usize,
        swept: &LinearisedRod<'_>,
        answered: &LinearResponses,
        left: &[Residual],
    ) -> Vector3<f64> {
        let mut place = Columns::zeros();
        for (k, left) in left.iter().enumerate() {
            let (stages, reached) = swept.stages(k, answered, left, &place);
            for (by, varied) in self.stages[k].iter_mut().zip(&stages) {
                by.turn.set_column(i, &varied.turn.column(REST));
                by.couple.set_column(i, &varied.couple.column(REST));
                by.place.set_column(i, &varied.place.column(REST));
                by.slope.set_column(i, &varied.slope.column(REST));
            }
            place = reached;
        }
        place.column(REST).into_owned()
    }

    /// Derivatives of both ends.
    pub fn derivatives(&self) -> Derivatives {
        let [turn, couple, position] = self.end;
        Derivatives {
            base_couple: self.base_couple,
            couple,
            turn,
            position,
        }
    }
}
