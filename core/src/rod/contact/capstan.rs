//! A long rod wound on a drum with friction, as all of the contact slips one way: the capstan of a rod that bends.
//!
//! Far from the drum the rod is straight under the tension T. Its centreline leaves the drum, of radius rho, with the
//! drum's curvature. By the first integral kappa^2/2 + n . t = const, in units B = 1, the tangent makes the angle psi
//! with the pull there:
//!
//! ```text
//! sin(psi/2) = 1/(2 rho sqrt T).
//! ```
//!
//! Drum and rod exchange a point reaction T sin psi there, with friction of its own. On the drum the tension grows as
//! exp(mu angle). With the held side 1 and the pulled side 2, and the turn Phi between both pulls:
//!
//! ```text
//! T_1 (cos psi_1 + mu sin psi_1) exp(mu (Phi - psi_1 - psi_2)) = T_2 (cos psi_2 - mu sin psi_2).
//! ```
//!
//! Friction acts on the centreline: its couple about the centreline is left out.

use crate::error::{Error, Result};
use crate::solve::roots::chandrupatla;

/// Doublings of the pull in the search for the root.
const DOUBLINGS: usize = 200;

/// A rod wound on a drum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capstan {
    stiffness: f64,
    radius: f64,
    turn: f64,
    friction: f64,
}

/// One side of a rod on a drum: where the rod leaves the drum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapstanSide {
    /// The tension of the straight rod far from the drum.
    pub pull: f64,
    /// Angle between the pull and the tangent where the rod leaves the drum.
    pub lift_off: f64,
    /// Point reaction of the drum where the rod leaves the drum, friction apart.
    pub reaction: f64,
    /// Tension in the rod on the drum next to that place.
    pub on_drum: f64,
}

/// The state of a rod all of whose contact slips on a drum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapstanSlip {
    /// The side that gives way.
    pub held: CapstanSide,
    /// The side to which the rod slips.
    pub pulled: CapstanSide,
    /// Angle of the drum on which the rod lies.
    pub wrapped: f64,
}

impl Capstan {
    /// A rod of the bending stiffness `stiffness` on a drum. `radius` is that of the centreline, `turn` the angle
    /// between the pulls at both ends, in radians, `friction` the coefficient.
    ///
    /// # Errors
    /// A number that is not finite; a stiffness, a radius or a turn that is not positive; a negative friction.
    pub fn new(stiffness: f64, radius: f64, turn: f64, friction: f64) -> Result<Self> {
        let sizes = [
            ("the bending stiffness", stiffness),
            ("the radius of the drum", radius),
            ("the turn", turn),
        ];
        for (what, value) in sizes {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::domain(format!(
                    "{what} = {value} must be finite and > 0"
                )));
            }
        }
        if !(friction >= 0.0 && friction.is_finite()) {
            return Err(Error::domain(format!(
                "the friction = {friction} must be finite and >= 0"
            )));
        }
        Ok(Self {
            stiffness,
            radius,
            turn,
            friction,
        })
    }

    /// The state in which all slips towards the pulled side, while the other side is held by the tension `held`. To
    /// rounding.
    ///
    /// # Errors
    /// A tension too small for the rod to lie on the drum; a friction so large that no pull lets all of the rod slip.
    pub fn slip(&self, held: f64) -> Result<CapstanSlip> {
        let least = self.stiffness / (4.0 * self.radius * self.radius);
        if !(held > least && held.is_finite()) {
            return Err(Error::domain(format!(
                "the held tension = {held} must be finite and above B/(4 rho^2) = {least}: a looser rod does not bend round the drum"
            )));
        }
        let start = self.side(held, 1.0);
        // The missing pull: negative while the rod does not slip yet.
        let missing = |pull: f64| {
            let end = self.side(pull, -1.0);
            let wrapped = self.turn - start.lift_off - end.lift_off;
            end.on_drum - start.on_drum * (self.friction * wrapped).exp()
        };
        let (mut low, mut high) = (held, held);
        for _ in 0..DOUBLINGS {
            if missing(high) >= 0.0 {
                break;
            }
            (low, high) = (high, 2.0 * high);
        }
        let ends = (missing(low), missing(high));
        let found = if ends.1 == 0.0 {
            Some(high)
        } else if ends.0 < 0.0 && ends.1 > 0.0 {
            chandrupatla(missing, (low, ends.0), (high, ends.1), 0.0)
        } else {
            None
        };
        let wedged = || {
            Error::unreachable(
                "no pull lets all of the rod slip: the friction at the places where the rod leaves the drum holds it",
            )
        };
        let pulled = self.side(found.ok_or_else(wedged)?, -1.0);
        let wrapped = self.turn - start.lift_off - pulled.lift_off;
        if !(wrapped >= 0.0) {
            return Err(Error::domain(format!(
                "the rod touches the drum at a point: the turn = {} is below the sum of the lift-off angles, {}",
                self.turn,
                start.lift_off + pulled.lift_off
            )));
        }
        Ok(CapstanSlip {
            held: start,
            pulled,
            wrapped,
        })
    }

    /// A side under a pull; `way` is 1 if friction at the point reaction pulls with the pull, -1 against it.
    fn side(&self, pull: f64, way: f64) -> CapstanSide {
        let half = (self.stiffness / pull).sqrt() / (2.0 * self.radius);
        let lift_off = 2.0 * half.asin();
        let reaction = pull * lift_off.sin();
        CapstanSide {
            pull,
            lift_off,
            reaction,
            on_drum: pull * lift_off.cos() + way * self.friction * reaction,
        }
    }
}
