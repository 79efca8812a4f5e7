//! The light rod in the plane: the elastica.

use super::{ALIKE, EndResidual, MasslessRod, places};
use crate::State;
use crate::snap::{LandingRule, SnapEnd, landings};
use nalgebra::{DMatrix, DVector, Vector2};
use snaprod_systems::assembly::{BodyMotion, Configuration};
use snaprod_systems::elastica::chart::ChartPoint;
use snaprod_systems::elastica::{Elastica, Equilibrium};
use snaprod_systems::manifold::{EquilibriumManifold, Multivalued, invert_near};
use snaprod_systems::math::se3::halves;

fn flat(q: &DVector<f64>) -> Vector2<f64> {
    Vector2::new(q[0], q[1])
}

fn dynamic(q: &Vector2<f64>) -> DVector<f64> {
    DVector::from_column_slice(q.as_slice())
}

fn velocity(site: &BodyMotion) -> Vector2<f64> {
    halves(&site.twist).1.xy()
}

/// Chart points are (p, w).
impl MasslessRod for Elastica {
    fn held(&self, q: &DVector<f64>, site: &BodyMotion, _tolerance: f64) -> Option<EndResidual> {
        let q = flat(q);
        let at = self.point(&q)?;
        Some(EndResidual {
            gap: dynamic(&(site.pose.translation.vector.xy() - at.pose)),
            jacobian: DMatrix::from_column_slice(2, 2, at.jacobian.as_slice()),
            drive: dynamic(&velocity(site)),
            fold: ChartPoint::new(q[0], q[1]).fold_function(),
            other: false,
        })
    }

    fn inverted(
        &self,
        guess: &DVector<f64>,
        site: &BodyMotion,
        tolerance: f64,
    ) -> Option<DVector<f64>> {
        let place = site.pose.translation.vector.xy();
        let found = invert_near(self, &place, &flat(guess), tolerance).ok()?;
        Some(dynamic(&found.q))
    }

    fn matching_equilibrium(&self, state: &dyn State) -> Option<DVector<f64>> {
        if let Some(labels) = state.equilibrium() {
            return Some(DVector::from_column_slice(&[labels.p, labels.w]));
        }
        let places = places();
        let strains = state.strains_at(&places);
        let size: f64 = strains.iter().map(|e| e[0] * e[0]).sum();
        let apart = |q: &Vector2<f64>| -> Option<f64> {
            let there = Equilibrium::new(q[0], q[1]).ok()?;
            let mut sum = 0.0;
            for (s, e) in places.iter().zip(&strains) {
                sum += (there.section(*s).ok()?.curvature - e[0]).powi(2);
            }
            Some(sum / size)
        };
        let stable = self.stable_at(&state.pose().translation.vector.xy()).ok()?;
        let each = stable.into_iter().filter_map(|q| Some((apart(&q)?, q)));
        let (apart, q) = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (apart < ALIKE * ALIKE).then(|| dynamic(&q))
    }

    fn landing(&self, fold: &DVector<f64>, _site: &BodyMotion) -> Option<DVector<f64>> {
        let landed = landings(self, &flat(fold), LandingRule::Viscous).ok()?.at;
        landed.first().map(|(q, _)| dynamic(q))
    }

    fn snap_end(&self, q: &DVector<f64>, _site: &BodyMotion) -> Option<(SnapEnd, f64)> {
        let at = flat(q);
        let elastic = self.point(&at)?.energy;
        let end = SnapEnd {
            q: q.clone(),
            sheet: Some(self.sheet(&at)),
            index: 0,
            elastic,
        };
        Some((end, elastic))
    }

    fn apart(&self, a: &BodyMotion, b: &BodyMotion) -> f64 {
        (b.pose.translation.vector - a.pose.translation.vector)
            .xy()
            .norm()
    }

    fn report_end(
        &self,
        _q: &DVector<f64>,
        site: &BodyMotion,
    ) -> (DVector<f64>, DVector<f64>, Option<Configuration>) {
        let place = site.pose.translation.vector.xy();
        (dynamic(&place), dynamic(&velocity(site)), None)
    }
}
