//! First-order inertia of a taut rod that stays in equilibrium while its attachments move (theory 3.9).
//!
//! In a frame that moves with the base and does not turn, all fields are those of the collocated rod. Turn omega,
//! couple m_t, force n_t and place r_t are its variations by the end data, and a turn of the base is a rigid
//! rotation. At constant velocities of the attachments their rates solve the same linear equations, with the terms of
//! second order in the velocities on the right,
//! ```text
//! omega_t' = (..) + q_u,       m_tt' = (..) + n x q_r + 2 n_t x r_t',       r_tt' = (..) + q_r,
//! ```
//! (..) the variation by (omega_t, m_tt, n_tt) and q_u, q_r the part of [`SectionRates::second`] from the velocities
//! alone. The base wrench is not used. The stages of the collocation are the nodes of all integrals: as further
//! components of the same differential equation these have the order of its nodes.

use super::chain::{Answers, ChainSolution, ForceEquation, Forces, REST, chain, interval_change};
use super::condensed::{ColumnBlock, Condensed, IntervalVariations, Residual};
use super::interval::{RodUnderForce, STAGES, Scheme};
use super::turning_base::Turning;
use super::{Shape, Spring, Taut, Tip};
use crate::error::{Error, Result};
use crate::math::se3::frame;
use crate::rod::Rod;
use crate::rod::first_order_mass::{
    InertiaIntegrals, MovingSection, RodRates, Second, SectionMass, SectionRates, SpaceRodInertia,
    Tangent,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Rates that move a taut rod besides those of its base; they replace the rates of the base wrench in [`RodRates`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rates {
    /// (spin, velocity) of its end seen from its base, in lengths of the rod; the spin is ignored if the end bears a
    /// couple.
    End,
    /// (spin of its end, rate of the total force on end and spring, in B/L^2), with the base at rest.
    Force,
}

/// Columns by the force or the place, by the turn (or couple) of the end, and 1.
pub(super) type Columns = SMatrix<f64, 3, 7>;

/// Variations at a stage.
pub(super) struct StageVariations {
    pub turn: Columns,
    pub couple: Columns,
    pub place: Columns,
    /// d(place)/ds.
    pub slope: Columns,
}

/// The linearised rod: variations of all intervals, and the equation of the force.
pub(super) struct LinearisedRod<'a> {
    pub pulled: &'a RodUnderForce<'a>,
    shape: &'a Shape,
    tip: &'a Tip,
    hold: ForceEquation,
    pub intervals: Vec<IntervalVariations>,
}

/// Solution for the right-hand sides of all intervals.
pub(super) struct LinearResponses {
    pub condensed: Vec<Condensed>,
    pub nodes: Vec<Answers>,
    pub force: Forces,
}

impl<'a> LinearisedRod<'a> {
    /// The variations at a shape; None if a stage is singular.
    pub fn new(
        pulled: &'a RodUnderForce<'a>,
        shape: &'a Shape,
        tip: &'a Tip,
        hold: ForceEquation,
    ) -> Result<Option<Self>> {
        let mut intervals = Vec::with_capacity(shape.stages.len());
        for (k, stages) in shape.stages.iter().enumerate() {
            let Some(found) = pulled.variations(shape.places[k], shape.places[k + 1], stages)?
            else {
                return Ok(None);
            };
            intervals.push(found);
        }
        Ok(Some(Self {
            pulled,
            shape,
            tip,
            hold,
            intervals,
        }))
    }

    /// The intervals with their stages eliminated; None if one is singular.
    pub fn condense(&self) -> Option<Vec<Condensed>> {
        self.intervals
            .iter()
            .map(IntervalVariations::condense)
            .collect()
    }

    /// Responses to unit rates of the end data, and to the residuals of the intervals; None if the rod is singular.
    pub fn responses(&self, condensed: Vec<Condensed>) -> Option<LinearResponses> {
        let last = &self.shape.nodes[self.shape.nodes.len() - 1];
        let mut end = self.pulled.at_end(last, self.tip);
        end.right.column_mut(REST).fill(0.0);
        let ChainSolution { nodes, force, .. } = chain(&condensed, &end, &self.hold, false)?;
        Some(LinearResponses {
            condensed,
            nodes,
            force,
        })
    }

    /// Variations at the stages of interval `k` and of the place at its end; `start` is that at its start.
    pub fn stages(
        &self,
        k: usize,
        answered: &LinearResponses,
        left: &Residual,
        start: &Columns,
    ) -> ([StageVariations; STAGES], Columns) {
        let (scheme, by, condensed) = (Scheme::get(), &self.intervals[k], &answered.condensed[k]);
        let of = |block: &ColumnBlock| interval_change(block, &answered.nodes[k], &answered.force);
        let slopes: [Columns; STAGES] = std::array::from_fn(|i| {
            let mut slope = of(&by.way_slope(i, condensed));
            let mut rest = slope.fixed_columns_mut::<1>(REST);
            rest += left.moved[i] / by.h;
            slope
        });
        let passed = |weights: &[f64; STAGES]| {
            let parts = slopes.iter().zip(weights);
            parts.fold(*start, |sum, (slope, weight)| sum + slope * (by.h * weight))
        };
        let stages = std::array::from_fn(|i| StageVariations {
            turn: of(&condensed.turns[i]),
            couple: of(&condensed.couples[i]) * self.pulled.kappa,
            place: passed(&scheme.integrate[i]),
            slope: slopes[i],
        });
        (stages, passed(&scheme.weights))
    }
}

/// A rod in motion: linear responses and rates.
struct Motion<'a> {
    swept: LinearisedRod<'a>,
    sections: SectionRates<'a>,
    /// Rates of the columns, and the spin of the base.
    rates: SVector<f64, 7>,
    spin: Vector3<f64>,
    /// The columns by the rates of the end data.
    columns: SMatrix<f64, 7, 6>,
    /// Response of a load along the rod to turns of the base.
    turning: Option<Turning>,
}

impl Motion<'_> {
    /// Stage `i` of interval `k`, at `r`, and the rate of r'.
    fn stage_motion(
        &self,
        k: usize,
        i: usize,
        r: Vector3<f64>,
        varied: &StageVariations,
        force: &Forces,
    ) -> (MovingSection, Vector3<f64>) {
        let (spin, rates) = (&self.spin, &self.rates);
        let at = &self.swept.shape.stages[k][i];
        let along = &self.swept.intervals[k].slopes[i];
        let mut moving = MovingSection {
            turn: frame(&at.turn),
            r,
            omega: spin + varied.turn * rates,
            v: spin.cross(&r) + varied.place * rates,
            m: at.m,
            n: along.n,
            m_t: spin.cross(&at.m) + varied.couple * rates,
            n_t: spin.cross(&self.swept.pulled.n) + force * rates,
        };
        let mut slope = spin.cross(&along.r) + varied.slope * rates;
        if let Some(turning) = &self.turning {
            let by = &turning.stages[k][i];
            moving.omega += by.turn * spin;
            moving.v += by.place * spin;
            moving.m_t += by.couple * spin;
            moving.n_t += turning.force * spin;
            slope += by.slope * spin;
        }
        (moving, slope)
    }

    /// Places of the stages of interval `k` and of the interval's end; `start` is the place of the first node.
    fn places(&self, k: usize, start: Vector3<f64>) -> ([Vector3<f64>; STAGES], Vector3<f64>) {
        let (scheme, by) = (Scheme::get(), &self.swept.intervals[k]);
        let passed = |weights: &[f64; STAGES]| {
            let parts = by.slopes.iter().zip(weights);
            parts.fold(start, |sum, (slope, weight)| {
                sum + slope.r * (by.h * weight)
            })
        };
        let stages = std::array::from_fn(|i| passed(&scheme.integrate[i]));
        (stages, passed(&scheme.weights))
    }

    /// Terms of second order in the velocities; None if the law refuses.
    fn quadratic(&self, first: &LinearResponses) -> Option<Vec<Residual>> {
        let (scheme, kappa) = (Scheme::get(), self.swept.pulled.kappa);
        let zero = Vector3::zeros();
        let mut all = Vec::with_capacity(self.swept.intervals.len());
        for (k, by) in self.swept.intervals.iter().enumerate() {
            let mut left = Residual::NONE;
            // The terms do not depend on places or on their rates.
            let (stages, _) = self.swept.stages(k, first, &left, &Columns::zeros());
            for (i, varied) in stages.iter().enumerate() {
                let (at, slope) = self.stage_motion(k, i, zero, varied, &first.force);
                let s = self.swept.shape.places[k] + scheme.nodes[i] * by.h;
                let [turned, moved] = self.sections.second(s, &at, &zero, &zero)?;
                let bent = at.n.cross(&moved) + at.n_t.cross(&slope) * 2.0;
                left.turned[i] = turned * by.h;
                left.moved[i] = moved * by.h;
                left.bent[i] = bent * (by.h / kappa);
            }
            all.push(left);
        }
        Some(all)
    }

    /// The inertia, in the rod's units: sums, second derivatives of the end and of its couple. With `turns`, the
    /// response of a load along the rod to turns of the base is included. None if the law refuses.
    fn inertia(
        &mut self,
        rotary: &Vector3<f64>,
        turns: bool,
    ) -> Result<Option<(InertiaIntegrals<9>, Second, Vector3<f64>)>> {
        let mut condensed = self.swept.condense().ok_or_else(neutral_error)?;
        if turns {
            let found = Turning::of(&self.swept, condensed).ok_or_else(neutral_error)?;
            condensed = found.1;
            self.turning = Some(found.0);
        }
        let swept = &self.swept;
        let first = swept.responses(condensed).ok_or_else(neutral_error)?;
        let Some(left) = self.quadratic(&first) else {
            return Ok(None);
        };
        let condensed = first.condensed.into_iter().zip(&swept.intervals).zip(&left);
        let condensed = condensed.map(|((condensed, by), left)| condensed.with_residual(by, left));
        let found = swept
            .responses(condensed.collect())
            .ok_or_else(neutral_error)?;
        let (mut sums, mut start, mut place) =
            (InertiaIntegrals::new(), Vector3::zeros(), Columns::zeros());
        for (k, left) in left.iter().enumerate() {
            let h = self.swept.intervals[k].h;
            let (places, end) = self.places(k, start);
            let (stages, reached) = self.swept.stages(k, &found, left, &place);
            for (i, (varied, r)) in stages.iter().zip(places).enumerate() {
                let (at, _) = self.stage_motion(k, i, r, varied, &found.force);
                let tangent = self.tangent(k, i, varied, &r);
                let second = second(&varied.turn, &varied.place);
                let scheme = Scheme::get();
                let s = self.swept.shape.places[k] + scheme.nodes[i] * h;
                let inertia = self.sections.inertia(s, rotary);
                sums.add(h * scheme.weights[i], &tangent, &at, &second, &inertia);
            }
            (start, place) = (end, reached);
        }
        let last = found.nodes[found.nodes.len() - 1];
        let [turn, couple] = [0, 3].map(|row| last.fixed_rows::<3>(row).into_owned());
        let couple = couple.column(REST) * self.swept.pulled.kappa;
        Ok(Some((sums, second(&turn, &place), couple)))
    }

    /// Tangent by the rates of the end data, and by a turn of the base, a rigid rotation of the rod.
    fn tangent(
        &self,
        k: usize,
        i: usize,
        varied: &StageVariations,
        r: &Vector3<f64>,
    ) -> Tangent<9> {
        let mut rows = [
            (varied.turn * self.columns, Matrix3::identity()),
            (varied.place * self.columns, -r.cross_matrix()),
        ];
        if let Some(turning) = &self.turning {
            let by = &turning.stages[k][i];
            rows[0].1 += by.turn;
            rows[1].1 += by.place;
        }
        let by = std::array::from_fn(|i| {
            let (rates, spin) = &rows[i / 3];
            std::array::from_fn(|k| match k {
                0..6 => rates[(i % 3, k)],
                _ => spin[(i % 3, k - 6)],
            })
        });
        Tangent {
            by,
            taken: [[0.0; 9]; 3],
        }
    }
}

/// (omega_t, r_tt).
fn second(turn: &Columns, place: &Columns) -> Second {
    Second::from_fn(|i, _| match i {
        0..3 => turn[(i, REST)],
        3..6 => place[(i - 3, REST)],
        _ => 0.0,
    })
}

pub(super) fn neutral_error() -> Error {
    Error::ill_conditioned("the motion of a taut rod is undefined: it is neutral as it is held")
}

impl Rates {
    /// Equation of the force of a rod beside `spring`, with forces in units of `unit`; and the columns by these
    /// rates.
    pub(super) fn force_equation(
        self,
        tip: &Tip,
        spring: &Spring,
        unit: f64,
    ) -> (ForceEquation, SMatrix<f64, 7, 6>) {
        let (give, stiffness, per) = match self {
            Self::End => (0.0, unit, unit),
            Self::Force => (1.0, spring.stiffness, 1.0),
        };
        let turned = if matches!(tip, Tip::Turned(_)) {
            1.0
        } else {
            0.0
        };
        let mut columns = SMatrix::<f64, 7, 6>::zeros();
        for i in 0..3 {
            (columns[(3 + i, i)], columns[(i, 3 + i)]) = (turned, per);
        }
        let hold = ForceEquation {
            give,
            stiffness,
            off: Vector3::zeros(),
            unit,
        };
        (hold, columns)
    }
}

impl Rod {
    /// Inertia of a taut rod on its equilibria in the motion `motion`, with the rates of `rates`. All are along the
    /// directors of the base, which are those of the clamp, as in [`Rod::generalized_inertia`]. If the rod bears a
    /// load and has no [`Taut::by_turn`], its base must be at rest, and terms of its turning are not computed.
    ///
    /// # Errors
    /// A rod that is neutral under these end data; a motion too fast for a law that is not linear.
    pub fn taut_inertia(
        &self,
        mass: &SectionMass,
        found: &Taut,
        rates: Rates,
        motion: &RodRates,
    ) -> Result<SpaceRodInertia> {
        let pulled = self.under_force(found, found.shape.n);
        let unit = pulled.kappa * pulled.kappa;
        let (hold, columns) = rates.force_equation(&found.tip, &found.spring, unit);
        let swept = LinearisedRod::new(&pulled, &found.shape, &found.tip, hold)?
            .ok_or_else(neutral_error)?;
        let mut motion = Motion {
            swept,
            sections: SectionRates::of(self),
            rates: columns * motion.rate,
            spin: motion.spin,
            columns,
            turning: None,
        };
        let (sums, end, couple) = (motion
            .inertia(&mass.per_mass(self.length), found.by_turn.is_some())?)
        .ok_or_else(|| self.motion_refused_error(&self.inward(&found.base)))?;
        Ok(self.generalized(&sums, mass.mass, &end, couple))
    }
}
