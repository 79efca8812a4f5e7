//! Folds of branches of equilibria, and how a rod leaves them whose mass is known.

use super::space::ALONG;
use crate::elastica::Passage;
use crate::elastica::inertia::{INERTIAL_ESCAPE, VISCOUS_ESCAPE};
use crate::inertia::held::resistance;
use crate::rod::Wrench;
use crate::scene::Scene;
use serde_json::{Value, json};

/// A fold of a branch, and how late a rod leaves it while its parameter is moved over it at a steady rate r:
/// M0 a'' + tau D0 a' = A r t + B a^2, tau being the Kelvin-Voigt time of a friction in proportion to the stiffness (theory 2.8).
#[derive(Debug, Clone, PartialEq)]
pub struct FoldAtRest {
    /// The numbers of its normal form in the scene's units: A an energy per unit of the parameter, B and D0 energies, M0 an energy times a time
    /// squared, along a critical direction whose base wrench has the length 1 in B/L and B/L^2.
    pub form: Passage,
    /// Delay by the rod's mass alone at the rate 1, in the scene's units; at other rates it is by |r|^(-1/5) of it.
    pub inertial_delay: f64,
    /// Delay by friction alone at the rate 1 and tau = 1; otherwise it is by (tau^2/|r|)^(1/3) of it.
    pub viscous_delay: f64,
}

impl FoldAtRest {
    /// The fold of the rod of a scene of statics under this base wrench, of (A, B) along the critical direction `z`; None where the mass of the rod
    /// is not known, or its fold has no normal form.
    pub(in crate::study) fn new(
        scene: &Scene,
        base: &Wrench,
        z: &Wrench,
        [drive, bend]: [f64; 2],
    ) -> Option<Self> {
        let rod = scene.standing_rod(base).ok()??;
        let point = rod.link.point(0.0, &[], &rod.chart, ALONG).ok()?;
        let at = (&rod.link, &rod.chart, &point);
        let [mass, friction] = resistance(&rod.massive, at, z).ok()?;
        let k = &rod.scales;
        let form = Passage {
            drive: drive * k.energy,
            bend: bend * k.energy,
            mass: mass * k.energy * k.time * k.time,
            friction: friction * k.energy,
            ahead: 0.0,
        };
        Some(Self {
            form,
            inertial_delay: INERTIAL_ESCAPE * form.inertial(1.0),
            viscous_delay: VISCOUS_ESCAPE * form.viscous(1.0),
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
            "passed at the rate r, it is left {:.3e} |r|^(-1/5) late by the rod's mass alone, {:.3e} (tau^2/|r|)^(1/3) by friction of the \
             Kelvin-Voigt time tau alone (A {drive:.4e}, B {bend:.4e}, M0 {mass:.4e}, D0 {friction:.4e})",
            self.inertial_delay, self.viscous_delay
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
