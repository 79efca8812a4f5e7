//! First-order inertia by any two coordinates q of the equilibria: mass and force at the end from sums along the rod.

use super::AddedInertia;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};

/// Position of a section and its derivatives by q, times `scale`, in axes that turn with the force ([`EndMotion`]).
pub(super) type PlaceByChart<T> = [[T; 2]; 3];

/// Motion of the end.
pub(super) struct EndMotion {
    /// Factor of the fields. "Scaled" below means times this factor.
    pub scale: f64,
    /// Rotation from the axes of the fields to those of the clamp.
    pub turn: Matrix2<f64>,
    /// Inverse (scale Dr(1))^-1.
    pub inverse: Matrix2<f64>,
    /// Rate q'.
    pub rate: Vector2<f64>,
    /// Scaled second derivative of the end's position at constant q'.
    pub end: Vector2<f64>,
    /// Rate of turning of the axes whose term 2 spin J r_t is left out of the sections' second derivatives, but not
    /// of the end's.
    pub spin: f64,
}

/// Integrand without gravity: the scaled r_q^T r_q, r_q^T `left`, and r_q x r_q at a section. `left`: the scaled r_tt
/// at constant q', without the term of [`EndMotion::spin`].
#[inline(always)]
pub(super) fn inertia_integrand<T: Real>([_, p, l]: &PlaceByChart<T>, left: &[T; 2]) -> [T; 6] {
    [
        dot(p, p),
        dot(p, l),
        dot(l, l),
        dot(p, left),
        dot(l, left),
        cross(p, l),
    ]
}

/// Integrand with gravity: [`inertia_integrand`], then the scaled derivatives of the position by q, and the position.
#[inline(always)]
pub(super) fn inertia_integrand_with_weight<T: Real>(
    field: &PlaceByChart<T>,
    left: &[T; 2],
) -> [T; 12] {
    let [n11, n12, n22, f1, f2, turned] = inertia_integrand(field, left);
    let [w, p, l] = *field;
    [
        n11, n12, n22, f1, f2, turned, p[0], p[1], l[0], l[1], w[0], w[1],
    ]
}

impl EndMotion {
    /// Vector in the axes of the fields.
    #[inline(always)]
    pub fn in_field_axes(&self, v: &Vector2<f64>) -> Vector2<f64> {
        self.turn.tr_mul(v)
    }

    /// Added mass, force and centre from the sums of [`inertia_integrand_with_weight`].
    #[inline(always)]
    pub fn added_inertia(
        &self,
        [n11, n12, n22, f1, f2, turned, along @ ..]: [f64; 12],
        gravity: &Vector2<f64>,
    ) -> Option<AddedInertia> {
        let weight = self.weight_integral(along, gravity);
        let (mass, force) = self.mass_and_force([n11, n12, n22, f1, f2, turned], &weight)?;
        let [.., x, y] = along;
        Some(AddedInertia {
            mass,
            force,
            centre: self.turn * Vector2::new(x, y) / self.scale,
        })
    }

    /// The scaled int r_q^T g ds, from the integrals of r_q.
    #[inline(always)]
    pub fn weight_integral(
        &self,
        [p1, p2, l1, l2, ..]: [f64; 6],
        gravity: &Vector2<f64>,
    ) -> Vector2<f64> {
        let g = self.in_field_axes(gravity);
        Vector2::new(p1 * g.x + p2 * g.y, l1 * g.x + l2 * g.y)
    }

    /// Added mass and force from the sums of [`inertia_integrand`] and the scaled int r_q^T g ds.
    #[inline(always)]
    pub fn mass_and_force(
        &self,
        [n11, n12, n22, f1, f2, turned]: [f64; 6],
        weight: &Vector2<f64>,
    ) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        // P = r_q Dr^-1, both in the axes of the fields.
        let Self {
            scale,
            turn,
            inverse,
            ..
        } = self;
        let carried = Matrix2::new(n11, n12, n12, n22) * inverse;
        let spun = Vector2::new(-self.rate.y, self.rate.x) * (2.0 * self.spin * turned);
        let left = Vector2::new(f1, f2) + spun - carried * self.end;
        let mass = turn * inverse.tr_mul(&carried) * turn.transpose();
        let force = turn * inverse.tr_mul(&(weight - left / *scale));
        let all = mass.iter().chain(&force);
        all.copied().all(f64::is_finite).then_some((mass, force))
    }
}

#[inline(always)]
pub(super) fn dot<T: Real>(a: &[T; 2], b: &[T; 2]) -> T {
    a[0].times_plus(b[0], a[1] * b[1])
}

/// a x b.
#[inline(always)]
pub(super) fn cross<T: Real>(a: &[T; 2], b: &[T; 2]) -> T {
    a[0] * b[1] - a[1] * b[0]
}

/// J a.
#[inline(always)]
pub(super) fn quarter_turn(a: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-a.y, a.x)
}
