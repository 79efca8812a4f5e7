//! Folds of branches of equilibria, and the delay of the departure by mass and friction.

use crate::elastica::FoldNormalForm;
use crate::elastica::first_order_mass::{INERTIAL_ESCAPE, VISCOUS_ESCAPE};
use serde_json::{Value, json};

/// Origin of the mass in M0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassOrigin {
    /// Mass of the only rod.
    Rod,
    /// Masses of all bodies, and of all rods of known mass.
    Everything,
}

/// A fold of a branch, and the delay of the departure while the parameter crosses the fold at a steady rate r:
/// M0 a'' + tau D0 a' = A r t + B a^2. Here tau is the Kelvin-Voigt time of a friction proportional to the stiffness
/// (theory 2.8).
#[derive(Debug, Clone, PartialEq)]
pub struct FoldAtRest {
    /// Coefficients of the normal form in the units of the scene: A an energy per unit of the parameter, B and D0
    /// energies, M0 an energy times a time squared. The critical direction has a base wrench of length 1 in B/L and
    /// B/L^2; in an assembly, unknowns of length 1.
    pub form: FoldNormalForm,
    /// Delay by mass alone at the rate 1, in the units of the scene; proportional to |r|^(-1/5).
    pub inertial_delay: f64,
    /// Delay by friction alone at the rate 1 and tau = 1; proportional to (tau^2/|r|)^(1/3).
    pub viscous_delay: f64,
    /// Origin of the mass M0.
    pub of: MassOrigin,
}

impl FoldAtRest {
    /// Coefficients of a fold in the units of the scene, with the sign that makes the mass positive. `None` if
    /// friction then feeds the motion, or nothing that moves has mass.
    pub(in crate::study) fn new(
        [drive, bend]: [f64; 2],
        [mass, friction]: [f64; 2],
        of: MassOrigin,
    ) -> Option<Self> {
        let form = FoldNormalForm {
            drive: drive.abs(),
            bend: bend.abs(),
            mass: mass.abs(),
            friction: friction * mass.signum(),
            ahead: 0.0,
        };
        let fits = form.mass > 0.0 && form.friction > 0.0;
        fits.then(|| Self {
            inertial_delay: INERTIAL_ESCAPE * form.inertial(1.0),
            viscous_delay: VISCOUS_ESCAPE * form.viscous(1.0),
            form,
            of,
        })
    }

    /// One sentence.
    pub fn text(&self) -> String {
        let FoldNormalForm {
            drive,
            bend,
            mass,
            friction,
            ..
        } = self.form;
        format!(
            "delay when passed at the rate r: {:.3e} |r|^(-1/5) by {} alone, {:.3e} (tau^2/|r|)^(1/3) by friction of the \
             Kelvin-Voigt time tau alone (A {drive:.4e}, B {bend:.4e}, M0 {mass:.4e}, D0 {friction:.4e})",
            self.inertial_delay,
            match self.of {
                MassOrigin::Rod => "the rod's mass",
                MassOrigin::Everything => "the masses of bodies and rods",
            },
            self.viscous_delay
        )
    }

    pub(in crate::study) fn json(&self) -> Value {
        json!({
            "A": self.form.drive,
            "B": self.form.bend,
            "M0": self.form.mass,
            "D0": self.form.friction,
            "inertial_delay": self.inertial_delay,
            "viscous_delay": self.viscous_delay,
        })
    }
}
