//! A light rod with its mass between its attachments at one moment: generalized inertia, motion, spin (theory 3.9).
//!
//! The rod's inertia acts in the variables (V, b', Omega) along the present directors of its base: velocity of the
//! base, rate of the base wrench, spin of the base.

use super::attachment::Joint;
use super::chord_spin::Free;
use super::rod_element::{EndKind, Link, LinkPoint};
use crate::math::se3::{halves, join};
use crate::rod::{Rates, RodRates, SectionMass, SpaceRodInertia, Wrench};
use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// A light rod at the chart point q, evaluated between its attachments.
#[derive(Clone, Copy)]
pub(super) struct LightRodAt<'a> {
    pub link: &'a Link,
    /// Mass of the sections.
    pub sections: &'a SectionMass,
    pub q: &'a Wrench,
    pub point: &'a LinkPoint,
    /// Tolerance of the integration along the rod.
    pub tolerance: f64,
}

/// Wrenches on base and end that the inertia of a rod requires: linear in the accelerations of base and end, plus a
/// part for the accelerations present while no body accelerates along its own velocities.
pub(super) struct AttachmentInertia {
    pub matrix: SMatrix<f64, 12, 12>,
    pub force: SVector<f64, 12>,
    /// Rate of the spin about the chord, if the rod has one: linear in the accelerations, and constant part.
    pub spin: Option<(SVector<f64, 12>, f64)>,
}

/// Motion of a rod.
pub(super) struct RodMotion {
    pub inertia: SpaceRodInertia,
    /// (V, b', Omega) as a linear function of the twists of base and end in the world, and its present value.
    by_twists: SMatrix<f64, 12, 12>,
    pub now: SVector<f64, 12>,
    /// b'' and Omega_t, in the same rows, while nothing accelerates the attachments; 0 for a taut rod.
    bent: SVector<f64, 12>,
    /// Free spin about the chord of a rod between two ball joints.
    free: Option<Free>,
}

impl LightRodAt<'_> {
    /// (V, b', Omega) from the twists of base and end in the world and the rates of the chart. For a taut rod, whose
    /// base wrench does not determine its end, the twist of the end replaces b'.
    pub fn base_motion<const C: usize>(
        &self,
        twists: &SMatrix<f64, 12, C>,
        rates: &SMatrix<f64, 6, C>,
    ) -> SMatrix<f64, 12, C> {
        let Self { link, q, point, .. } = *self;
        let mut swept = point.base_motion(q, twists, rates);
        if point.end.is_taut() {
            let mut own = swept.fixed_rows_mut::<6>(3);
            own.copy_from(&(point.relative_by_twists() * twists));
            own.fixed_rows_mut::<3>(3).unscale_mut(link.rod().length());
        }
        swept
    }

    /// Motion of the rod; None if the chart is singular or the law refuses.
    pub fn moving(&self) -> Option<RodMotion> {
        let Self { link, q, point, .. } = *self;
        let scale = link.gap_scale(&point.end);
        // The end of a taut rod moves with its attachment, whatever the chart.
        let factors = if point.end.is_taut() {
            None
        } else {
            Some(link.regular(&point.end)?)
        };
        let chart = match &factors {
            Some(factors) => factors.solve(&(scale * point.drive_by_twists()))?,
            None => SMatrix::zeros(),
        };
        let by_twists = self.base_motion(&SMatrix::identity(), &chart);
        let mut twists = SVector::<f64, 12>::zeros();
        twists.fixed_rows_mut::<6>(0).copy_from(&point.base.twist);
        twists.fixed_rows_mut::<6>(6).copy_from(&point.tip.twist);
        let mut now = by_twists * twists;
        if let Some(along) = point.free_spin(q) {
            now += along * point.spin;
        }
        let motion = swaying(&now);
        let inertia = self.inertia(&motion, Rates::End)?;
        let bent = match &factors {
            Some(factors) => {
                let rates = factors.solve(&-(scale * self.constraint_curvature(&inertia)))?;
                point.bent(q, rates, &motion, &halves(&inertia.second).1)
            }
            None => SVector::zeros(),
        };
        let free = self.freedom(&inertia.matrix);
        Some(RodMotion {
            inertia,
            by_twists,
            now,
            bent,
            free,
        })
    }

    /// Free spin of the rod with generalized inertia `matrix`; None if its attachments hold the rod or the spin has no
    /// inertia.
    pub fn freedom(&self, matrix: &SMatrix<f64, 12, 12>) -> Option<Free> {
        let length = self.link.rod().length();
        self.point
            .freedom(self.q, matrix, self.sections.mass, length)
    }

    /// Spin about the chord at which the rod's angular momentum about the chord vanishes, whatever spin the rod has.
    /// None if the rod has no such freedom.
    pub fn idle_spin(&self) -> Option<f64> {
        let moving = self.moving()?;
        Some(self.point.spin + moving.free?.idle(&moving.now))
    }

    /// Generalized inertia of the moving rod, for a taut rod by `rates`; None where its law refuses.
    pub fn inertia(&self, motion: &RodRates, rates: Rates) -> Option<SpaceRodInertia> {
        let Self { link, q, point, .. } = *self;
        if let Some(taut) = point.end.taut() {
            let inertia = link.rod().taut_inertia(self.sections, taut, rates, motion);
            return inertia.ok();
        }
        let seen = link.with_base_rotation(&point.base.pose.rotation);
        let trace = match point.end.trace() {
            Some(trace) => trace.clone(),
            None => seen.traced(q, self.tolerance).ok()?,
        };
        let rod = link.rod();
        let inertia = rod.generalized_inertia(self.sections, q, seen.borne(), motion, &trace);
        inertia.ok()
    }

    /// Second derivative of the quantities held by the attachment, in the rows of the Jacobian.
    pub fn constraint_curvature(&self, inertia: &SpaceRodInertia) -> Vector6<f64> {
        let (turned, moved) = halves(&inertia.second);
        match (&self.point.end.kind, self.link.joint()) {
            (
                EndKind::Pinned {
                    chord, per_couple, ..
                },
                _,
            ) => {
                let across = inertia.couple * *per_couple;
                join(&Vector3::zeros(), &(chord * chord.dot(&moved) + across))
            }
            (_, Joint::Weld) => join(&turned, &moved),
            (_, Joint::Ball) => join(&inertia.couple, &moved),
        }
    }

    /// Inertia felt at both attachments, which have the accelerations `drawn` beside those of the bodies.
    pub fn felt(&self, drawn: &SVector<f64, 12>) -> Option<AttachmentInertia> {
        let moving = self.moving()?;
        let SpaceRodInertia { matrix, force, .. } = &moving.inertia;
        let by_twists = &moving.by_twists;
        let (mut left, mut force, mut spin) = (*matrix, *force, None);
        if let Some(free) = &moving.free {
            let by = -by_twists.tr_mul(&free.momentum) / free.inertia;
            let turned = self.point.chord_turns(&swaying(&moving.now).spin);
            let loaded = free.along.dot(&force) / free.inertia;
            let alone = free.idle(&moving.bent) - loaded + turned;
            spin = Some((by, alone + by.dot(drawn)));
            left = free.eliminated(matrix);
            force -= free.momentum * loaded;
        }
        let matrix = by_twists.tr_mul(&(left * by_twists));
        Some(AttachmentInertia {
            matrix,
            force: by_twists.tr_mul(&(force + left * moving.bent)) + matrix * drawn,
            spin,
        })
    }
}

/// (b', Omega) of (V, b', Omega).
pub(super) fn swaying(motion: &SVector<f64, 12>) -> RodRates {
    RodRates {
        rate: motion.fixed_rows::<6>(3).into_owned(),
        spin: motion.fixed_rows::<3>(9).into_owned(),
    }
}
