//! The light rod in space, in the chart of its base wrench.

use super::{ALIKE, EndResidual, FINE, MasslessRod, places};
use crate::State;
use crate::snap::SnapEnd;
use nalgebra::{DMatrix, DVector};
use snaprod_systems::assembly::{BodyMotion, Configuration, Joint, Link, LinkPoint};
use snaprod_systems::math::se3::halves;
use snaprod_systems::rod::Wrench;
use snaprod_systems::section::Strain;

/// A light rod from a standing clamp to a body at the end, in the chart of the base wrench.
#[derive(Debug, Clone)]
pub struct LightInSpace {
    link: Link,
    /// Role of the rod in an assembly.
    member: Option<ReferenceRod>,
}

/// A rod of an assembly.
#[derive(Debug, Clone)]
struct ReferenceRod {
    number: usize,
    /// The rod between its attachments.
    between: Link,
    /// True if the rod begins where the states of the assembly have its end.
    reversed: bool,
}

impl LightInSpace {
    /// The rod of `link`, from the ground to the only body, in units of its length; both ends are at their
    /// attachments.
    pub fn new(link: &Link) -> Self {
        Self {
            link: link.with_chart_by_pull(),
            member: None,
        }
    }

    /// The rod with this number of an assembly, without a load along it. Its clamp is the attachment of its
    /// base, wherever that goes. `reversed`: the rod begins where the states of the assembly have its end.
    pub fn in_assembly(number: usize, between: &Link, reversed: bool) -> Self {
        Self {
            link: between.alone().with_chart_by_pull(),
            member: Some(ReferenceRod {
                number,
                between: between.clone(),
                reversed,
            }),
        }
    }

    fn point(&self, q: &DVector<f64>, site: &BodyMotion, tolerance: f64) -> Option<LinkPoint> {
        let bodies = std::slice::from_ref(site);
        self.link.point(0.0, bodies, &wrench(q), tolerance).ok()
    }

    /// Strains of the rod in a state, at arc lengths counted from the base of the light rod.
    fn strains(&self, state: &dyn State, places: &[f64]) -> Vec<Strain> {
        if !self.member.as_ref().is_some_and(|rod| rod.reversed) {
            return state.strains_of(self.number(), places);
        }
        let back: Vec<f64> = places.iter().rev().map(|s| 1.0 - s).collect();
        let mut strains = state.strains_of(self.number(), &back);
        strains.reverse();
        for strain in &mut strains {
            // The directors are turned by pi about d1.
            strain[0] = -strain[0];
            strain[3] = -strain[3];
        }
        strains
    }
}

fn wrench(q: &DVector<f64>) -> Wrench {
    Wrench::from_column_slice(q.as_slice())
}

fn dynamic(q: &Wrench) -> DVector<f64> {
    DVector::from_column_slice(q.as_slice())
}

impl MasslessRod for LightInSpace {
    fn number(&self) -> usize {
        self.member.as_ref().map_or(0, |rod| rod.number)
    }

    fn end(&self, state: &dyn State) -> BodyMotion {
        match &self.member {
            Some(rod) => rod.between.end_place(state.time(), state.bodies()),
            None => BodyMotion {
                pose: state.pose(),
                twist: state.twist(),
            },
        }
    }

    fn held(&self, q: &DVector<f64>, site: &BodyMotion, tolerance: f64) -> Option<EndResidual> {
        let point = self.point(q, site, tolerance)?;
        Some(EndResidual {
            gap: dynamic(&point.gap()),
            jacobian: DMatrix::from_column_slice(6, 6, point.end.jacobian.as_slice()),
            drive: dynamic(&point.drive()),
            fold: point.end.jacobian.determinant(),
            other: point.end.is_taut(),
        })
    }

    fn inverted(
        &self,
        guess: &DVector<f64>,
        site: &BodyMotion,
        tolerance: f64,
    ) -> Option<DVector<f64>> {
        let found = self.link.polished(&wrench(guess), &site.pose, tolerance);
        let found = found.ok()?;
        Some(dynamic(&found))
    }

    fn matching_equilibrium(&self, state: &dyn State) -> Option<DVector<f64>> {
        let (link, held) = (&self.link, self.end(state).pose);
        let length = link.rod().length();
        let strains = |places: &[f64]| self.strains(state, places);
        // In units of the rod's own length.
        let own = |places: &[f64]| {
            let mut strains = strains(places);
            for strain in &mut strains {
                strain.fixed_rows_mut::<3>(0).scale_mut(length);
            }
            strains
        };
        let q = link.nearest(&own, &held, FINE).ok()?;
        let places = places();
        let strains = strains(&places);
        let at: Vec<f64> = places.iter().map(|s| s * length).collect();
        let sections = link.shape(&q, &held, &at, FINE).ok()?;
        let (mut apart, mut size) = (0.0, 0.0);
        for ((s, e), section) in at.iter().zip(&strains).zip(&sections) {
            let unloaded = link.rod().law().unloaded(*s).ok()?;
            apart += (section.strain - e).norm_squared();
            size += (unloaded - e).norm_squared();
        }
        let stable = || link.index(&q, &held, FINE).is_ok_and(|index| index == 0);
        (apart < ALIKE * ALIKE * size && stable()).then(|| dynamic(&q))
    }

    fn landing(&self, fold: &DVector<f64>, site: &BodyMotion) -> Option<DVector<f64>> {
        let landed = self.link.settle(&wrench(fold), &site.pose, FINE).ok()?;
        Some(dynamic(&landed))
    }

    fn snap_end(&self, q: &DVector<f64>, site: &BodyMotion) -> Option<(SnapEnd, f64)> {
        let point = self.point(q, site, FINE)?;
        let end = SnapEnd {
            q: q.clone(),
            sheet: None,
            index: 0,
            elastic: point.end.energy,
        };
        Some((end, point.end.whole_energy()))
    }

    fn apart(&self, a: &BodyMotion, b: &BodyMotion) -> f64 {
        let moved = (b.pose.translation.vector - a.pose.translation.vector).norm()
            / self.link.rod().length();
        match self.link.joint() {
            Joint::Weld => moved + a.pose.rotation.angle_to(&b.pose.rotation),
            Joint::Ball => moved,
        }
    }

    fn report_end(
        &self,
        q: &DVector<f64>,
        site: &BodyMotion,
    ) -> (DVector<f64>, DVector<f64>, Option<Configuration>) {
        let now = Configuration {
            bodies: vec![*site],
            charts: vec![wrench(q)],
            spins: Vec::new(),
        };
        let (place, velocity) = (site.pose.translation.vector, halves(&site.twist).1);
        let dynamic = |v: &nalgebra::Vector3<f64>| DVector::from_column_slice(v.as_slice());
        (dynamic(&place), dynamic(&velocity), Some(now))
    }
}
