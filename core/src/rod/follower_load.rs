//! Loads along a rod that turn with its directors, such as pressure or thrust, and couples along it, beside dead forces
//! (theory 3.8).
//!
//! With p(s) along the directors f = R p is not known beforehand: the force g = int f that the rod has taken is
//! integrated, with its variation,
//!
//! ```text
//! n(s) = n(0) - int_0^s f_dead - g,   g' = R p,   dg' = phi x R p,
//! w' = r x f + l,   dw' = rho x f + r x (phi x R p) + dl,
//! ```
//!
//! l the couple per length: dead with dl = 0, or along the directors, l = R c with dl = phi x R c. A force or couple
//! at one place adds these terms at once. Such loads have no potential. Their power in a motion is linear in the
//! variation,
//!
//! ```text
//! P = int (rho . R p + phi . (l + R c)) ds,
//! ```
//!
//! and is integrated beside the tangent, column by column.

use super::distributed_load::{LoadMoment, LoadState, Place, ScaledLoad};
use nalgebra::Vector3;

/// Loads on a rod without a potential, in the numerics' units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FollowedLoad {
    /// Force along the directors.
    pub(super) force: ScaledLoad,
    /// Couple in the clamp's frame.
    pub(super) dead_couple: ScaledLoad,
    /// Couple along the directors.
    pub(super) couple: ScaledLoad,
}

impl FollowedLoad {
    /// All loads times a factor.
    pub(super) fn times(&self, part: f64) -> Self {
        Self {
            force: self.force.times(part),
            dead_couple: self.dead_couple.times(part),
            couple: self.couple.times(part),
        }
    }

    /// Loads at a section, by the part of each load that `of` takes.
    #[inline]
    fn at(&self, of: impl Fn(&ScaledLoad) -> Vector3<f64>) -> Followed {
        Followed {
            force: of(&self.force),
            dead_couple: of(&self.dead_couple),
            couple: of(&self.couple),
        }
    }
}

/// All loads on a rod in the numerics' units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadsAlong {
    /// Force in the clamp's frame.
    pub(super) dead: ScaledLoad,
    pub(super) followed: FollowedLoad,
}

/// Loads without a potential at one section: a force along the directors, and couples in both frames. At a break
/// they are whole, elsewhere densities.
struct Followed {
    force: Vector3<f64>,
    dead_couple: Vector3<f64>,
    couple: Vector3<f64>,
}

/// Sums of the loads along the rod from the clamp to a section: couple and force with their variations. The power is
/// that of the loads without a potential, by columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FollowedMoment<const K: usize> {
    /// Couple w of all loads; work of the dead one.
    moment: LoadMoment<K>,
    g: [f64; 3],
    dg: [[f64; K]; 3],
    power: [f64; K],
}

impl<const K: usize> FollowedMoment<K> {
    /// Adds loads at a section.
    #[inline]
    fn add(&mut self, load: &Followed, at: &Place<'_, K>) {
        let d = at.d.map(Vector3::from);
        let turned = |p: &Vector3<f64>| d[0] * p.x + d[1] * p.y + d[2] * p.z;
        let (f, l) = (turned(&load.force), turned(&load.couple));
        let r = Vector3::from(*at.r);
        let column = |of: &[[f64; K]; 3], j: usize| Vector3::new(of[0][j], of[1][j], of[2][j]);
        let whole = r.cross(&f) + l + load.dead_couple;
        self.moment.add_couple(&whole, |j| {
            let phi = column(at.phi, j);
            column(at.rho, j).cross(&f) + r.cross(&phi.cross(&f)) + phi.cross(&l)
        });
        for i in 0..3 {
            self.g[i] += f[i];
        }
        for j in 0..K {
            let phi = column(at.phi, j);
            let turned = phi.cross(&f);
            for (row, x) in self.dg.iter_mut().zip(turned.iter()) {
                row[j] += *x;
            }
            self.power[j] += column(at.rho, j).dot(&f) + phi.dot(&(l + load.dead_couple));
        }
    }
}

impl<const K: usize> LoadState<K> for FollowedMoment<K> {
    type Load = LoadsAlong;
    const NOTHING: Self = Self {
        moment: LoadMoment::NOTHING,
        g: [0.0; 3],
        dg: [[0.0; K]; 3],
        power: [0.0; K],
    };

    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.moment.axpy(a, &x.moment);
        for i in 0..3 {
            self.g[i] += a * x.g[i];
            for j in 0..K {
                self.dg[i][j] += a * x.dg[i][j];
            }
        }
        for (power, by) in self.power.iter_mut().zip(&x.power) {
            *power += a * by;
        }
    }

    #[inline]
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64) {
        (self.moment).add_errors(&from.moment, &to.moment, shape, tangent);
        let size = |g: &[f64; 3]| g.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        let scale = size(&from.g).max(size(&to.g));
        for i in 0..3 {
            *shape += (self.g[i] / scale).powi(2);
            for j in 0..K {
                let scale = 1.0 + from.dg[i][j].abs().max(to.dg[i][j].abs());
                *tangent += (self.dg[i][j] / scale).powi(2);
            }
        }
        for j in 0..K {
            let scale = 1.0 + from.power[j].abs().max(to.power[j].abs());
            *tangent += (self.power[j] / scale).powi(2);
        }
    }

    #[inline]
    fn force(&self, load: &LoadsAlong, base: &[f64; 3], s: f64) -> [f64; 3] {
        let dead = self.moment.force(&load.dead, base, s);
        std::array::from_fn(|i| dead[i] - self.g[i])
    }

    #[inline]
    fn taken_force(&self) -> Option<&[[f64; K]; 3]> {
        Some(&self.dg)
    }

    #[inline]
    fn power(&self) -> Option<&[f64; K]> {
        Some(&self.power)
    }

    #[inline]
    fn density(load: &LoadsAlong, s: f64) -> Vector3<f64> {
        load.dead.density(s)
    }

    #[inline]
    fn jump(load: &LoadsAlong, s: f64) -> Vector3<f64> {
        load.dead.jump_at(s)
    }

    #[inline]
    fn cross(&mut self, load: &LoadsAlong, s: f64, at: &Place<'_, K>) {
        self.moment.cross(&load.dead, s, at);
        let here = load.followed.at(|load| load.jump_at(s));
        self.add(&here, at);
    }

    #[inline]
    fn subtract_couple(&self, m: &mut [f64; 3]) {
        LoadState::<K>::subtract_couple(&self.moment, m);
    }

    #[inline]
    fn take_columns(&self, dm: &mut [[f64; K]; 3]) {
        self.moment.take_columns(dm);
    }

    #[inline]
    fn slope(load: &LoadsAlong, s: f64, at: &Place<'_, K>) -> Self {
        let mut slope = Self {
            moment: LoadMoment::slope(&load.dead, s, at),
            ..Self::NOTHING
        };
        let here = load.followed.at(|load| load.density(s));
        slope.add(&here, at);
        slope
    }

    #[inline]
    fn columns(&mut self) -> &mut [[f64; K]] {
        self.moment.columns()
    }

    fn work(&self) -> f64 {
        LoadState::<K>::work(&self.moment)
    }
}
