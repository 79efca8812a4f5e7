//! Tendons of given tension through a rod: a stored energy beside that of the section law (theory 3.8).
//!
//! A frictionless tendon of tension T runs through the points r + R x(s) of the sections. The path has the
//! derivative R p' by s, with p' = v + u x x + x'. A rod with tendons has the stored energy W + sum T |p'| per length.
//! The sum is convex in the strains, as a norm of an affine map is. The resultants of this energy are the totals of rod
//! and tendons. The totals obey the balance laws of a rod without tendons, and are continuous where a tendon ends.

use super::linear::check_unconstrained;
use super::newton::{LawPoint, Potential, invert};
use super::{Free, Inverse, LawRates, Resultant, SectionLaw, Strain};
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Place of a tendon in the sections, along d1 and d2 from the centreline.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Route {
    /// Straight in the unloaded rod between an offset at s = 0 and one at the anchor.
    Linear([[f64; 2]; 2]),
    /// Around the centreline.
    Helix {
        /// Distance from the centreline.
        distance: f64,
        /// Angle at s = 0 from d1 towards d2, radians.
        phase: f64,
        /// Turns on the length of the rod.
        turns: f64,
    },
    /// Rows (s, offset along d1, offset along d2) of growing s, straight in between.
    Table(Vec<[f64; 3]>),
}

/// A tendon of given tension.
#[derive(Debug, Clone, PartialEq)]
pub struct Tendon {
    /// Route through the sections.
    pub route: Route,
    /// Arclength of the anchor, in (0, L]. The tendon does not pass the sections beyond the anchor.
    pub to: f64,
    /// Tension >= 0.
    pub tension: f64,
}

/// A section law with tendons.
#[derive(Debug, Clone)]
pub struct Tendons {
    base: Arc<dyn SectionLaw>,
    tendons: Vec<Tendon>,
    /// Rates of the tensions in time.
    rates: Vec<f64>,
    /// Length of the rod.
    length: f64,
}

/// A tendon at a section, under unit tension.
struct Strand {
    /// Derivative |p'| of its length by s.
    rate: f64,
    /// Couple and force of unit tension on the section, along the directors: (x cross t, t).
    pull: Vector6<f64>,
    /// Second derivative of |p'| by the strains.
    curvature: Matrix6<f64>,
}

impl Tendon {
    /// Offset from the centreline at s, along d1 and d2; `None` beyond the anchor.
    pub fn place(&self, s: f64, length: f64) -> Option<Vector3<f64>> {
        (s <= self.to).then(|| self.offset(s, length)[0])
    }

    /// Offset at s and its derivative.
    fn offset(&self, s: f64, length: f64) -> [Vector3<f64>; 2] {
        let line = |from: [f64; 2], to: [f64; 2], part: f64, span: f64| {
            let place = |i: usize| from[i] + (to[i] - from[i]) * part;
            let slope = |i: usize| (to[i] - from[i]) / span;
            [
                Vector3::new(place(0), place(1), 0.0),
                Vector3::new(slope(0), slope(1), 0.0),
            ]
        };
        match &self.route {
            Route::Linear([from, to]) => line(*from, *to, s / self.to, self.to),
            Route::Helix {
                distance,
                phase,
                turns,
            } => {
                let rate = TAU * turns / length;
                let (sin, cos) = (phase + rate * s).sin_cos();
                [
                    Vector3::new(cos, sin, 0.0) * *distance,
                    Vector3::new(-sin, cos, 0.0) * (rate * distance),
                ]
            }
            Route::Table(rows) => {
                let after = rows.partition_point(|row| row[0] <= s);
                let after = after.clamp(1, rows.len() - 1);
                let (a, b) = (rows[after - 1], rows[after]);
                let span = b[0] - a[0];
                line([a[1], a[2]], [b[1], b[2]], (s - a[0]) / span, span)
            }
        }
    }

    /// The tendon at s under the strains e; `None` where the path of the tendon has no direction.
    fn strand(&self, s: f64, e: &Strain, length: f64) -> Option<Strand> {
        let [x, slope] = self.offset(s, length);
        let mut by_strain = Matrix3x6::zeros();
        by_strain
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&-x.cross_matrix());
        by_strain
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&Matrix3::identity());
        let path = by_strain * e + slope;
        let rate = path.norm();
        if !(rate > 0.0 && rate.is_finite()) {
            return None;
        }
        let t = path / rate;
        let across = Matrix3::identity() - t * t.transpose();
        Some(Strand {
            rate,
            pull: by_strain.tr_mul(&t),
            curvature: by_strain.tr_mul(&(across * by_strain)) / rate,
        })
    }

    fn check(&self, length: f64) -> Result<()> {
        let bad = |what: String| Err(Error::domain(what));
        let Self { route, to, tension } = self;
        if !(*tension >= 0.0 && tension.is_finite()) {
            return bad(format!(
                "the tension of a tendon is {tension}; it must be finite and >= 0: a tendon only pulls"
            ));
        }
        if !(*to > 0.0 && *to <= length) {
            return bad(format!(
                "the anchor of a tendon is at s = {to}; it must lie beyond the base, and at most at the length {length}"
            ));
        }
        let numbers: Vec<f64> = match route {
            Route::Linear(ends) => ends.as_flattened().to_vec(),
            Route::Helix {
                distance,
                phase,
                turns,
            } => vec![*distance, *phase, *turns],
            Route::Table(rows) => {
                let grows = rows.len() >= 2 && rows.windows(2).all(|two| two[0][0] < two[1][0]);
                let covers = rows.first().is_some_and(|row| row[0] <= 0.0)
                    && rows.last().is_some_and(|row| row[0] >= *to);
                if !(grows && covers) {
                    return bad(format!(
                        "the table of a tendon's route needs two or more rows [s, d1, d2], s growing from 0 to its anchor {to}"
                    ));
                }
                rows.as_flattened().to_vec()
            }
        };
        match numbers.iter().find(|x| !x.is_finite()) {
            Some(x) => bad(format!(
                "the route of a tendon has the number {x}; each must be finite"
            )),
            None => Ok(()),
        }
    }
}

impl Tendons {
    /// The law of a rod of this length with tendons.
    ///
    /// # Errors
    /// A tension < 0; an anchor outside of the rod; a route that is not defined up to the anchor.
    pub fn new(base: Arc<dyn SectionLaw>, tendons: Vec<Tendon>, length: f64) -> Result<Self> {
        let checked = tendons.iter().enumerate();
        for (k, tendon) in checked {
            tendon
                .check(length)
                .map_err(|e| e.context(format!("tendon {k}")))?;
        }
        Ok(Self {
            base,
            rates: vec![0.0; tendons.len()],
            tendons,
            length,
        })
    }

    /// The law with tensions that change at `rates`, one for each tendon.
    #[must_use]
    pub fn changing(mut self, rates: Vec<f64>) -> Self {
        self.rates = rates;
        self
    }

    /// The law of the rod without its tendons.
    pub fn backbone(&self) -> &Arc<dyn SectionLaw> {
        &self.base
    }

    /// The tendons.
    pub fn tendons(&self) -> &[Tendon] {
        &self.tendons
    }

    /// Derivative by s of the length of each tendon under the strains e; 0 beyond its anchor.
    pub fn rates(&self, s: f64, e: &Strain) -> Vec<f64> {
        let rate = |tendon: &Tendon| {
            let strand = tendon.strand(s, e, self.length);
            strand.map_or(0.0, |strand| strand.rate)
        };
        let on = |tendon: &Tendon| if s <= tendon.to { rate(tendon) } else { 0.0 };
        self.tendons.iter().map(on).collect()
    }

    /// Couple and force along the directors that the tendons bear together, of the total resultants.
    pub fn pull(&self, s: f64, e: &Strain) -> Resultant {
        let strands = self.strands(s, e).unwrap_or_default().into_iter();
        strands.fold(Vector6::zeros(), |sum, (tension, strand)| {
            sum + strand.pull * tension
        })
    }

    /// Each taut tendon at s with its tension; None if one has no direction.
    fn strands(&self, s: f64, e: &Strain) -> Option<Vec<(f64, Strand)>> {
        let here = self
            .tendons
            .iter()
            .filter(|tendon| s <= tendon.to && tendon.tension > 0.0);
        here.map(|tendon| Some((tendon.tension, tendon.strand(s, e, self.length)?)))
            .collect()
    }

    fn known(&self, s: f64, e: &Strain) -> Result<Vec<(f64, Strand)>> {
        self.strands(s, e).ok_or_else(|| pointlike(s))
    }
}

fn pointlike(s: f64) -> Error {
    Error::domain(format!(
        "a tendon has no direction at s = {s}: the rod is bent so much that the tendon is a point there"
    ))
}

/// The law at one s, as a function of its strains.
struct TendonLawAt<'a> {
    law: &'a Tendons,
    s: f64,
}

impl Potential for TendonLawAt<'_> {
    fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    fn at(&self, x: &Vector6<f64>) -> Result<Option<LawPoint>> {
        let Ok(free) = self.law.free(self.s, x) else {
            return Ok(None);
        };
        Ok(Some(LawPoint {
            strain: *x,
            energy: free.energy,
            resultants: free.resultants,
            frame: Matrix6::identity(),
            slope: free.tangent,
        }))
    }
}

impl SectionLaw for Tendons {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        let strands = self.known(s, e)?.into_iter();
        let pulled: f64 = strands.map(|(tension, strand)| tension * strand.rate).sum();
        Ok(self.base.energy(s, e)? + pulled)
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        check_unconstrained(self.rigid())?;
        Ok(self.free(s, e)?.resultants)
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        check_unconstrained(self.rigid())?;
        Ok(self.free(s, e)?.tangent)
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let Free {
            mut energy,
            mut resultants,
            mut tangent,
        } = self.base.free(s, e)?;
        for (tension, strand) in self.known(s, e)? {
            energy += tension * strand.rate;
            resultants += strand.pull * tension;
            tangent += strand.curvature * tension;
        }
        Ok(Free::new(energy, resultants, tangent, self.rigid()))
    }

    fn rigid(&self) -> [bool; 6] {
        self.base.rigid()
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        if self
            .tendons
            .iter()
            .all(|tendon| s > tendon.to || tendon.tension == 0.0)
        {
            return self.base.inverse(s, w);
        }
        // The pull in the unloaded shape is near the pull of most states.
        let unloaded = self.base.unloaded(s)?;
        let near = self.base.inverse(s, &(w - self.pull(s, &unloaded)));
        let start = near.map_or(unloaded, |near| near.strain);
        let here = TendonLawAt { law: self, s };
        invert(&here, start, w, |_| ())
            .map_err(|e| e.context(format!("the section with its tendons at s = {s}")))
    }

    fn rates(&self, s: f64, e: &Strain, w: &Resultant) -> Result<Option<LawRates>> {
        let base = self.base.rates(s, e, &(w - self.pull(s, e)))?;
        if base.is_none() && self.rates.iter().all(|rate| *rate == 0.0) {
            return Ok(None);
        }
        let mut sum = base.unwrap_or(LawRates {
            power: 0.0,
            resultants: Vector6::zeros(),
        });
        let all = self.tendons.iter().zip(&self.rates);
        for (tendon, rate) in all.filter(|(tendon, rate)| s <= tendon.to && **rate != 0.0) {
            let strand = tendon.strand(s, e, self.length);
            let strand = strand.ok_or_else(|| pointlike(s))?;
            sum.power += strand.rate * rate;
            sum.resultants += strand.pull * *rate;
        }
        for k in (0..6).filter(|k| self.rigid()[*k]) {
            sum.resultants[k] = 0.0;
        }
        Ok(Some(sum))
    }

    fn is_uniform(&self) -> bool {
        let straight = |tendon: &Tendon| match tendon.route {
            Route::Linear([from, to]) => from == to && tendon.to == self.length,
            _ => false,
        };
        self.base.is_uniform() && self.tendons.iter().all(straight)
    }

    fn planar_about(&self) -> [bool; 2] {
        let base = self.base.planar_about();
        let in_plane = |axis: usize| {
            self.tendons.iter().all(|tendon| match &tendon.route {
                Route::Linear(ends) => ends.iter().all(|end| end[axis] == 0.0),
                Route::Helix { distance, .. } => *distance == 0.0,
                Route::Table(rows) => rows.iter().all(|row| row[1 + axis] == 0.0),
            })
        };
        std::array::from_fn(|axis| base[axis] && in_plane(axis))
    }

    fn breaks(&self) -> Vec<f64> {
        let mut all = self.base.breaks();
        for tendon in &self.tendons {
            if let Route::Table(rows) = &tendon.route {
                all.extend(rows.iter().map(|row| row[0]));
            }
            all.push(tendon.to);
        }
        all.retain(|s| 0.0 < *s && *s < self.length);
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}
