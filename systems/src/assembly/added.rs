//! What the mass of rods adds to an assembly, to first order: to its small vibrations, and at folds (theory 3.9).

use super::stiffness::carried;
use super::{Assembly, Configuration, Joint, LightRod, Link, LinkPoint, Modes};
use crate::math::se3::halves;
use crate::rod::{SectionMass, Swaying, Wrench};
use nalgebra::{DMatrix, DVector, SVector, Vector3, Vector6};

/// Squares of frequencies below this, relative to the largest and at all, are those of directions in which an equilibrium is free to move.
const NEUTRAL: f64 = 1e-10;
const ROUNDING: f64 = 1e-14;
/// Frequencies whose squares differ by less than this part are one: their motions mix as the mass of the rods tells.
const ONE: f64 = 1e-6;

impl Link {
    /// A, B and M0 of the normal form of the fold that the rod is at, or next to, along the critical direction of length 1 in the chart
    /// (theory 2.8, 3.9), for a rod of this mass whose attachments move as `point` says. None of a taut rod and of one between two ball joints.
    pub fn normal_form(
        &self,
        sections: &SectionMass,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<[f64; 3]> {
        if point.end.slack.is_some() || self.joint() == Joint::Pins {
            return None;
        }
        let light = LightRod {
            sections: *sections,
            followed: false,
        };
        let found = self.passage(&light, (q, point), tolerance)?;
        found
            .form
            .iter()
            .all(|x| x.is_finite())
            .then_some(found.form)
    }

    /// Twice the kinetic energy of two small motions of the rod, x^T N y, in every pair of the columns of `rates`: each has the twist of the base
    /// in the world above the rates of the chart.
    pub(crate) fn metric(
        &self,
        sections: &SectionMass,
        (q, point): (&Wrench, &LinkPoint),
        rates: &[(Vector6<f64>, Wrench)],
        tolerance: f64,
    ) -> Option<DMatrix<f64>> {
        let still = Swaying {
            rate: Wrench::zeros(),
            spin: Vector3::zeros(),
        };
        let found = self.inertia(sections, (q, point), &still, tolerance)?;
        let back = point.base.pose.rotation.inverse();
        let (m, n) = halves(q);
        let columns: Vec<SVector<f64, 12>> = rates
            .iter()
            .map(|(twist, rate)| {
                let (spin, velocity) = halves(twist);
                let (spin, velocity) = (back * spin, back * velocity);
                let mut column = SVector::<f64, 12>::zeros();
                column.fixed_rows_mut::<3>(0).copy_from(&velocity);
                column.fixed_rows_mut::<6>(3).copy_from(rate);
                // The base wrench in the world turns with the base.
                let mut couple = column.fixed_rows_mut::<3>(3);
                couple += spin.cross(&m);
                let mut force = column.fixed_rows_mut::<3>(6);
                force += spin.cross(&n);
                column.fixed_rows_mut::<3>(9).copy_from(&spin);
                column
            })
            .collect();
        let count = columns.len();
        Some(DMatrix::from_fn(count, count, |i, j| {
            columns[i].dot(&(found.matrix * columns[j]))
        }))
    }
}

impl Assembly {
    /// The change of the lowest frequency of `modes`, relative to it, by the mass of the rods, `masses` in the order of the links: -1/2 x^T N x
    /// for x^T M x = 1, to first order. Of several that are the lowest alike, the largest change. None where no frequency is above zero, and where
    /// a rod with mass is between two ball joints.
    pub fn shift_by_rods(
        &self,
        now: &Configuration,
        modes: &Modes,
        masses: &[Option<SectionMass>],
        tolerance: f64,
    ) -> Option<f64> {
        let largest = modes.squares.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
        let zero = NEUTRAL.max(ROUNDING * largest);
        let lowest = modes.squares.iter().copied().find(|x| *x > zero)?;
        let alike: Vec<usize> = (0..modes.squares.len())
            .filter(|k| (modes.squares[*k] - lowest).abs() <= ONE * lowest)
            .collect();
        let points = (self.points(0.0, &now.bodies, &now.charts, tolerance)).ok()?;
        let (starts, _) = self.freedoms();
        let own = self.own_twists(&now.bodies);
        let mut sum = DMatrix::zeros(alike.len(), alike.len());
        for (k, sections) in masses.iter().enumerate() {
            let Some(sections) = sections else { continue };
            let link = self.links.get(k)?;
            if link.joint() == Joint::Pins {
                return None;
            }
            let base = link.levers(&now.bodies)[0];
            let rates = alike.iter().map(|mode| {
                let shape = modes.shapes.column(*mode);
                let twist = base.map_or_else(Vector6::zeros, |(body, arm)| {
                    let rows = shape.rows(starts[body], self.carriers[body].freedoms());
                    let rows: DVector<f64> = rows.into_owned();
                    carried(&arm) * (&own[body] * rows)
                });
                let rate = modes.charts.column(*mode);
                (twist, rate.fixed_rows::<6>(6 * k).into_owned())
            });
            let rates: Vec<(Vector6<f64>, Wrench)> = rates.collect();
            let rod = (&now.charts[k], &points[k]);
            sum += link.metric(sections, rod, &rates, tolerance)?;
        }
        let most = sum.symmetric_eigenvalues().max();
        most.is_finite().then_some(-0.5 * most)
    }
}
