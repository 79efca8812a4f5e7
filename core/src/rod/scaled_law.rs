//! Section law in the units of a rod, seen from either end, with the imperfection of a continuation.

use crate::error::{Error, Message, Quantity, Result};
use crate::section::{
    Compliance, Free, LawRates, Measures, SectionLaw, UniformLinear, law_in_units,
};
use nalgebra::{Vector3, Vector6};
use std::borrow::Cow;
use std::sync::Arc;

/// Distance of the pieces from a break, in parts of the length: a law that jumps has two values at the break. The
/// omitted length is of the size of rounding.
const BREAK_GAP: f64 = 4e-15;

/// Distance up to which two breaks are one.
pub(super) const SAME_BREAK: f64 = 4.0 * BREAK_GAP;

/// Resultants by which symmetry is tested, the turn of the test in radians, and the relative difference of strains that
/// is rounding.
const PROBE: [f64; 6] = [0.3, -0.2, 0.1, 0.25, 0.15, -0.05];
const TURN: f64 = 1.0;
const ALIKE: f64 = 1e-13;

/// A section law in the units of the rod; a linear uniform law has its inverse hoisted.
#[derive(Debug, Clone)]
pub(super) struct ScaledLaw {
    law: Arc<dyn SectionLaw>,
    hoisted: Option<UniformLinear>,
    /// Smooth pieces of the law between its breaks: from and to, in [0, 1].
    pieces: Vec<(f64, f64)>,
    /// Flexures and twist added to those of the law: the imperfection of a continuation.
    bend: Vector3<f64>,
    /// 1 if s runs from the clamp to the end, -1 from the end to the clamp.
    sense: f64,
    /// Units of the rod, in the user's units.
    units: Measures,
}

impl ScaledLaw {
    /// `law` in the units of the rod.
    pub(super) fn new(law: Arc<dyn SectionLaw>, units: Measures) -> Result<Self> {
        let law = law_in_units(law, units);
        let mut breaks = law.breaks();
        if breaks.windows(2).any(|pair| !(pair[0] < pair[1])) || breaks.iter().any(|s| s.is_nan()) {
            return Err(Error::domain(format!(
                "the section law's breaks {breaks:?} (in s/length) are not in growing order"
            )));
        }
        breaks.retain(|s| *s > BREAK_GAP && *s < 1.0 - BREAK_GAP);
        Ok(Self {
            hoisted: law.uniform_linear(),
            law,
            pieces: pieces_between(&breaks),
            bend: Vector3::zeros(),
            sense: 1.0,
            units,
        })
    }

    /// This law, to be integrated with additional breaks at the given places.
    pub(super) fn broken_at(mut self, breaks: &[f64]) -> Self {
        let own = self
            .pieces
            .windows(2)
            .map(|pair| 0.5 * (pair[0].1 + pair[1].0));
        let mut all: Vec<f64> = own.chain(breaks.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|a, b| *a - *b < SAME_BREAK);
        self.pieces = pieces_between(&all);
        self
    }

    /// This law on the part of the rod between two places.
    pub(super) fn between(&self, from: f64, to: f64) -> Self {
        let parts = self.pieces.iter().map(|(a, b)| (a.max(from), b.min(to)));
        let pieces = parts.filter(|(a, b)| a < b).collect();
        Self {
            pieces,
            ..self.clone()
        }
    }

    /// A wrench in the clamp's frame for messages, in the user's units.
    pub(super) fn wrench_text(&self, b: &Vector6<f64>) -> String {
        let couple = self.units.stiffness / self.units.length;
        let force = couple / self.units.length;
        let part = |at: usize, unit: f64| -> Vec<f64> {
            b.iter().skip(at).take(3).map(|x| x * unit).collect()
        };
        Message::from("couple ")
            .list(&part(0, couple), |_| Quantity::Ratio)
            .words(", force ")
            .list(&part(3, force), |_| Quantity::Ratio)
            .words(" in the frame of the clamp")
            .to_string()
    }

    /// The law with flexures and twist added.
    pub(super) fn bent(&self, bend: Vector3<f64>) -> Self {
        let mut bent = self.clone();
        if let Some(linear) = &mut bent.hoisted {
            for i in 0..3 {
                linear.rest[i] += self.sense * (bend[i] - self.bend[i]);
            }
        }
        bent.bend = bend;
        bent
    }

    /// The law seen from the end of the rod: s counts from the end, and frame and centreline run backwards, as if
    /// every strain had changed its sign.
    pub(super) fn reversed(&self) -> Self {
        let mut reversed = self.clone();
        reversed.sense = -self.sense;
        if let Some(linear) = &mut reversed.hoisted {
            linear.rest = -linear.rest;
            linear.compliance = linear.compliance.times(-1.0);
        }
        let mirrored = self.pieces.iter().rev();
        reversed.pieces = mirrored.map(|(from, to)| (1.0 - to, 1.0 - from)).collect();
        reversed
    }

    /// The law, if it is linear and uniform.
    pub(super) fn uniform(&self) -> Option<&UniformLinear> {
        self.hoisted.as_ref()
    }

    /// 1 if s runs from the clamp to the end, -1 from the end to the clamp.
    pub(super) fn sense(&self) -> f64 {
        self.sense
    }

    /// Pieces of an integration; in each the law is smooth, both ends included.
    pub(super) fn pieces(&self) -> &[(f64, f64)] {
        &self.pieces
    }

    /// As [`SectionLaw::planar_about`].
    pub(super) fn planar_about(&self) -> [bool; 2] {
        self.law.planar_about()
    }

    /// Flexural compliances about d1 and d2 of the unloaded clamp.
    pub(super) fn flexures(&self) -> [f64; 2] {
        self.inverse(0.0, &Vector6::zeros()).map_or([1.0; 2], |at| {
            let c = at.compliance.matrix();
            [c[(0, 0)], c[(1, 1)]]
        })
    }

    /// Unloaded flexure of a law that is uniform, linear, untwisted, and isotropic about d3 apart from this flexure.
    pub(super) fn is_isotropic(&self) -> Option<Vector3<f64>> {
        let linear = self.hoisted.as_ref()?;
        let Compliance::Diagonal(c) = &linear.compliance else {
            return None;
        };
        let rest = &linear.rest;
        let same =
            c[0] == c[1] && c[3] == c[4] && rest[2] == 0.0 && rest[3] == 0.0 && rest[4] == 0.0;
        same.then(|| Vector3::new(rest[0], rest[1], 0.0))
    }

    /// True if a turn of a section about its d3 changes nothing: no flexure or shear at rest, and resultants that are
    /// turned turn the strains. Sections at both ends and in the middle of every piece answer for all.
    pub(super) fn is_axisymmetric(&self) -> bool {
        let turn = |w: &Vector6<f64>| {
            let (sine, cosine) = TURN.sin_cos();
            let pair = |i: usize| {
                [
                    cosine * w[i] - sine * w[i + 1],
                    sine * w[i] + cosine * w[i + 1],
                ]
            };
            let ([a, b], [c, d]) = (pair(0), pair(3));
            Vector6::new(a, b, w[2], c, d, w[5])
        };
        let same = |s: f64| {
            let rest = self.inverse(s, &Vector6::zeros()).ok()?.strain;
            let w = Vector6::from(PROBE);
            let here = self.inverse(s, &w).ok()?.strain;
            let there = self.inverse(s, &turn(&w)).ok()?.strain;
            let size = here.norm();
            let aside = [0, 1, 3, 4]
                .map(|i| rest[i].abs())
                .into_iter()
                .fold(0.0, f64::max);
            Some(aside.max((turn(&here) - there).norm()) <= ALIKE * size)
        };
        let pieces: &[_] = if self.hoisted.is_some() {
            &[(0.5, 0.5)]
        } else {
            &self.pieces
        };
        let mut places = pieces.iter().flat_map(|(a, b)| [*a, 0.5 * (a + b), *b]);
        places.all(|s| same(s).unwrap_or(false))
    }

    /// The energy of strains.
    pub(super) fn energy(&self, s: f64, strain: &Vector6<f64>) -> Result<f64> {
        let s = if self.sense < 0.0 { 1.0 - s } else { s };
        let mut strain = strain * self.sense;
        for i in 0..3 {
            strain[i] -= self.bend[i];
        }
        self.law.energy(s, &strain)
    }

    /// Marks of the rigid strains.
    pub(super) fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    /// Energy, resultants and tangent in the strains that are not rigid, of a rod that begins at its clamp.
    pub(super) fn free(&self, s: f64, strain: &Vector6<f64>) -> Result<Free> {
        let mut strain = *strain;
        for i in 0..3 {
            strain[i] -= self.bend[i];
        }
        self.law.free(s, &strain)
    }

    /// Rates of a law that varies in time at given strains, those of the resultants `w`, of a rod that begins at its
    /// clamp.
    pub(super) fn rates(
        &self,
        s: f64,
        strain: &Vector6<f64>,
        w: &Vector6<f64>,
    ) -> Result<Option<LawRates>> {
        let mut strain = *strain;
        for i in 0..3 {
            strain[i] -= self.bend[i];
        }
        self.law.rates(s, &strain, w)
    }

    /// Strains and energy under the local resultants `w`, and the compliance, lent if it is hoisted.
    #[inline]
    pub(super) fn inverse(&self, s: f64, w: &Vector6<f64>) -> Result<Response<'_>> {
        if let Some(linear) = &self.hoisted {
            let change = &linear.compliance * w;
            return Ok(Response {
                strain: linear.rest + change,
                energy: 0.5 * self.sense * w.dot(&change),
                compliance: Cow::Borrowed(&linear.compliance),
            });
        }
        let s = if self.sense < 0.0 { 1.0 - s } else { s };
        let inverse = self.law.inverse(s, w)?;
        let mut strain = inverse.strain;
        for i in 0..3 {
            strain[i] += self.bend[i];
        }
        Ok(Response {
            strain: strain * self.sense,
            energy: inverse.energy,
            compliance: Cow::Owned(inverse.compliance.times(self.sense)),
        })
    }
}

/// The pieces between breaks in growing order.
fn pieces_between(breaks: &[f64]) -> Vec<(f64, f64)> {
    let from = std::iter::once(0.0).chain(breaks.iter().map(|s| s + BREAK_GAP));
    let to = breaks.iter().map(|s| s - BREAK_GAP).chain([1.0]);
    from.zip(to).filter(|(from, to)| from < to).collect()
}

/// Response of a section to its resultants: strain, energy, compliance.
pub(super) struct Response<'a> {
    pub(super) strain: Vector6<f64>,
    pub(super) energy: f64,
    pub(super) compliance: Cow<'a, Compliance>,
}
