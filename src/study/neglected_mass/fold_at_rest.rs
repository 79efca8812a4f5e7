//! Folds of branches of equilibria, and how late they are left where masses are known.

use crate::elastica::Passage;
use crate::elastica::first_order_mass::{INERTIAL_ESCAPE, VISCOUS_ESCAPE};
use serde_json::{Value, json};

/// Whose mass makes a delay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Masses {
    /// That of the only rod.
    Rod,
    /// Those of all bodies, and of the rods of which it is known.
    Everything,
}

/// A fold of a branch, and how late it is left while the parameter is moved over it at a steady rate r:
/// M0 a'' + tau D0 a' = A r t + B a^2, tau being the Kelvin-Voigt time of a friction in proportion to the stiffness (theory 2.8).
#[derive(Debug, Clone, PartialEq)]
pub struct FoldAtRest {
    /// The numbers of its normal form in the scene's units: A an energy per unit of the parameter, B and D0 energies, M0 an energy times a time
    /// squared, along a critical direction whose base wrench has the length 1 in B/L and B/L^2, in an
    /// assembly whose unknowns have.
    pub form: Passage,
    /// Delay by mass alone at the rate 1, in the scene's units; at other rates it is by |r|^(-1/5) of it.
    pub inertial_delay: f64,
    /// Delay by friction alone at the rate 1 and tau = 1; otherwise it is by (tau^2/|r|)^(1/3) of it.
    pub viscous_delay: f64,
    /// Whose mass M0 has.
    pub of: Masses,
}

impl FoldAtRest {
    /// The numbers of a fold in the scene's units, of the motion whose sign makes the mass positive; None where friction feeds that motion, or
    /// nothing that moves has mass.
    pub(in crate::study) fn new(
        [drive, bend]: [f64; 2],
        [mass, friction]: [f64; 2],
        of: Masses,
    ) -> Option<Self> {
        let form = Passage {
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

    /// In one sentence.
    pub fn text(&self) -> String {
        let Passage {
            drive,
            bend,
            mass,
            friction,
            ..
        } = self.form;
        format!(
            "passed at the rate r, it is left {:.3e} |r|^(-1/5) late by {} alone, {:.3e} (tau^2/|r|)^(1/3) by friction of the \
             Kelvin-Voigt time tau alone (A {drive:.4e}, B {bend:.4e}, M0 {mass:.4e}, D0 {friction:.4e})",
            self.inertial_delay,
            match self.of {
                Masses::Rod => "the rod's mass",
                Masses::Everything => "the masses of bodies and rods",
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
