//! Impact at one contact with Coulomb friction, along the path of the normal impulse.

use super::impact_in_space::curved_slip;
use super::{ImpactLaw, SurfacePair};
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Vector2, Vector3};

/// An impact at one contact. Components are (normal, first tangent, second tangent).
///
/// ```
/// # use snaprod_core as snaprod;
/// use nalgebra::{Matrix3, Vector3};
/// use snaprod::contact::{Impact, SurfacePair};
///
/// // A point of mass 2 that meets a wall at a slant.
/// let inverse_mass = Matrix3::identity() / 2.0;
/// let impact = Impact { inverse_mass, slip: Vector3::new(-3.0, 1.0, 0.0) };
/// let rebound = impact.rebound(&SurfacePair::new(0.5, 0.1)?)?;
/// assert!((rebound.impulse.x - 9.0).abs() < 1e-14);
/// assert!((rebound.slip - Vector3::new(1.5, 0.55, 0.0)).norm() < 1e-14);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Change of the slip velocity per impulse on body a: B, symmetric and positive definite.
    pub inverse_mass: Matrix3<f64>,
    /// The slip velocity u before; its normal component is negative.
    pub slip: Vector3<f64>,
}

/// The result of an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rebound {
    /// The impulse on body a.
    pub impulse: Vector3<f64>,
    /// The slip velocity after.
    pub slip: Vector3<f64>,
    /// Work of the normal impulse on the bodies, <= 0 under the laws of Stronge and Poisson.
    pub normal_work: f64,
    /// Kinetic energy lost.
    pub lost: f64,
    /// True if the surfaces stick at the end of the impact.
    pub sticks: bool,
}

/// Slip velocity, relative to the velocity of the impact, below which surfaces do not slip.
pub(super) const STILL: f64 = 1e-13;
/// Coupling out of the plane of slip, relative to B_nn, below which the slip keeps its plane.
const PLANAR: f64 = 1e-14;

/// The state of an impact on its way, as a function of the normal impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImpactPath {
    /// Impulse so far; the first component is the normal impulse p.
    pub impulse: Vector3<f64>,
    /// Slip velocity.
    pub slip: Vector3<f64>,
    /// Work of the normal impulse so far.
    pub work: f64,
}

/// The condition that ends an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ImpactEnd {
    /// The normal velocity rises to a value: 0 ends compression.
    NormalVelocity(f64),
    /// The normal impulse rises to a value.
    NormalImpulse(f64),
    /// The work of the normal impulse rises to a value, after compression.
    Work(f64),
}

impl ImpactEnd {
    /// Negative before the end, zero at the end.
    pub(super) fn missing(self, path: &ImpactPath) -> f64 {
        match self {
            Self::NormalVelocity(v) => path.slip.x - v,
            Self::NormalImpulse(p) => path.impulse.x - p,
            Self::Work(w) => path.work - w,
        }
    }

    /// The normal impulse from `path` to the end, for a normal velocity that grows at the rate `growth`.
    fn distance(self, path: &ImpactPath, growth: f64) -> f64 {
        let u = path.slip.x;
        match self {
            Self::NormalVelocity(v) => (v - u) / growth,
            Self::NormalImpulse(p) => p - path.impulse.x,
            Self::Work(w) => {
                // u p + growth p^2/2 = w - work, the larger root, in a form without cancellation.
                let missing = w - path.work;
                let root = (u * u + 2.0 * growth * missing).max(0.0).sqrt();
                if u > 0.0 {
                    2.0 * missing / (u + root)
                } else {
                    (root - u) / growth
                }
            }
        }
    }
}

impl ImpactPath {
    /// Goes on along a straight path: `force` is the impulse per normal impulse, `p` the normal impulse.
    fn advance(&mut self, b: &Matrix3<f64>, force: &Vector3<f64>, p: f64) {
        let change = b * force;
        self.work += (self.slip.x + 0.5 * change.x * p) * p;
        self.impulse += force * p;
        self.slip += change * p;
    }
}

/// The impulse per normal impulse of surfaces that start to move from rest relative to each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Onset {
    force: Vector3<f64>,
    sticks: bool,
}

impl Impact {
    /// Slip velocity, friction and B of an impact without slip: sticking, or slip in the direction in which the
    /// impulse drives it.
    fn onset(&self, friction: f64) -> Onset {
        let b = &self.inverse_mass;
        let tangential = b.fixed_view::<2, 2>(1, 1).into_owned();
        let coupling = Vector2::new(b.m21, b.m31);
        let holding = -(tangential.try_inverse().unwrap_or_default() * coupling);
        if holding.norm() <= friction * (1.0 + 1e-12) {
            return Onset {
                force: Vector3::new(1.0, holding.x, holding.y),
                sticks: true,
            };
        }
        // coupling - friction B_tt d = (rate) d with a rate > 0: a fixed point, from the direction against holding.
        let mut d = -holding.normalize();
        for _ in 0..200 {
            // A part of the friction is added to both sides, which makes the iteration fast.
            let part = 0.5 * tangential.trace() * friction;
            let next = coupling - tangential * d * friction + d * part;
            let Some(next) = next.try_normalize(0.0) else {
                break;
            };
            let moved = (next - d).norm();
            d = next;
            if moved < 1e-15 {
                break;
            }
        }
        Onset {
            force: Vector3::new(1.0, -friction * d.x, -friction * d.y),
            sticks: false,
        }
    }

    /// The path from `path` to the end. Returns true if the surfaces stick at the end.
    fn run(
        &self,
        path: &mut ImpactPath,
        friction: f64,
        speed: f64,
        end: ImpactEnd,
    ) -> Result<bool> {
        let b = &self.inverse_mass;
        // At most: curved slip, then slip or rest; each way ends in one piece.
        for _ in 0..4 {
            let slip = Vector2::new(path.slip.y, path.slip.z);
            if slip.norm() <= STILL * speed {
                let onset = self.onset(friction);
                let growth = (b * onset.force).x;
                path.advance(b, &onset.force, end.distance(path, growth));
                if onset.sticks {
                    (path.slip.y, path.slip.z) = (0.0, 0.0);
                }
                return Ok(onset.sticks);
            }
            let d = slip.normalize();
            let force = Vector3::new(1.0, -friction * d.x, -friction * d.y);
            let change = b * force;
            let sideways = d.x * change.z - d.y * change.y;
            if sideways.abs() <= PLANAR * b.m11 * (1.0 + friction) {
                let slowing = -(d.x * change.y + d.y * change.z);
                let left = end.distance(path, change.x);
                let stop = slip.norm() / slowing;
                if !(slowing > 0.0 && stop < left) {
                    path.advance(b, &force, left);
                    return Ok(false);
                }
                path.advance(b, &force, stop);
                (path.slip.y, path.slip.z) = (0.0, 0.0);
            } else if curved_slip(b, friction, speed, path, end)? {
                return Ok(false);
            } else {
                (path.slip.y, path.slip.z) = (0.0, 0.0);
            }
        }
        Err(Error::no_convergence(
            "the slip of an impact starts and stops again and again",
        ))
    }

    /// The rebound. The impulse is integrated through slip, stick and reversal.
    ///
    /// Accuracy: rounding where the slip keeps its plane, else some 1e-13.
    ///
    /// # Errors
    /// A normal velocity that does not close; friction and coupling so large that a rigid contact may jam
    /// (Painleve); Newton's law where it would create energy.
    pub fn rebound(&self, surface: &SurfacePair) -> Result<Rebound> {
        let (b, friction, e) = (
            &self.inverse_mass,
            surface.friction(),
            surface.restitution(),
        );
        let speed = self.slip.norm();
        if !(self.slip.x < 0.0 && speed < f64::INFINITY) {
            return Err(Error::domain(format!(
                "an impact needs a normal velocity < 0, not {}",
                self.slip.x
            )));
        }
        check_jamming(b, friction)?;
        let start = ImpactPath {
            impulse: Vector3::zeros(),
            slip: self.slip,
            work: 0.0,
        };
        let mut path = start;
        let mut sticks;
        if surface.law() == ImpactLaw::Newton {
            let end = ImpactEnd::NormalVelocity(-e * self.slip.x);
            sticks = self.run(&mut path, friction, speed, end)?;
        } else {
            sticks = self.run(&mut path, friction, speed, ImpactEnd::NormalVelocity(0.0))?;
            path.slip.x = 0.0;
            if e > 0.0 {
                let end = if surface.law() == ImpactLaw::Poisson {
                    ImpactEnd::NormalImpulse((1.0 + e) * path.impulse.x)
                } else {
                    ImpactEnd::Work((1.0 - e * e) * path.work)
                };
                sticks = self.run(&mut path, friction, speed, end)?;
            }
        }
        // The change of kinetic energy is J . (u before + u after)/2.
        let lost = -0.5 * path.impulse.dot(&(self.slip + path.slip));
        let energy = 0.5 * speed * speed / b.m11;
        if surface.law() == ImpactLaw::Newton && lost < -1e-12 * energy {
            return Err(Error::domain(format!(
                "Newton's law of impact would create the energy {:.3e} here (restitution {e}, friction {friction}); \
                 use law = \"stronge\" or \"poisson\"",
                -lost
            )));
        }
        Ok(Rebound {
            impulse: path.impulse,
            slip: path.slip,
            normal_work: path.work,
            lost,
            sticks,
        })
    }
}

/// Refuses a contact at which a sliding rigid body may jam: B_nn <= friction |B_tn| (Painleve).
pub(super) fn check_jamming(b: &Matrix3<f64>, friction: f64) -> Result<()> {
    let coupling = b.m21.hypot(b.m31);
    if b.m11 > friction * coupling {
        return Ok(());
    }
    Err(Error::domain(format!(
        "friction = {friction} is so large that a rigid contact may jam (Painleve: B_nn = {:.6} <= friction |B_tn| = \
         {:.6}); use friction below {:.6}",
        b.m11,
        friction * coupling,
        b.m11 / coupling
    )))
}
