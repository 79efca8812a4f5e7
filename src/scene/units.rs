//! The system of units of a scene, for labels.

use crate::error::Quantity;
use serde::Serialize;

/// The system of units, for labels only; no number changes. Top-level `units = "si"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Any consistent system; labels carry no symbol.
    #[default]
    Dimensionless,
    /// Metre, kilogram, second.
    Si,
}

impl Units {
    /// Symbol of length; like every symbol of this type, empty if dimensionless.
    pub fn length(self) -> &'static str {
        self.si("m")
    }

    /// Symbol of area.
    pub fn area(self) -> &'static str {
        self.si("m²")
    }

    /// Symbol of volume.
    pub fn volume(self) -> &'static str {
        self.si("m³")
    }

    /// Symbol of force.
    pub fn force(self) -> &'static str {
        self.si("N")
    }

    /// Symbol of couple.
    pub fn couple(self) -> &'static str {
        self.si("N m")
    }

    /// Symbol of bending and torsional stiffness.
    pub fn flexural(self) -> &'static str {
        self.si("N m²")
    }

    /// Symbol of curvature and twist.
    pub fn curvature(self) -> &'static str {
        self.si("rad/m")
    }

    /// Symbol of energy.
    pub fn energy(self) -> &'static str {
        self.si("J")
    }

    /// Symbol of power.
    pub fn power(self) -> &'static str {
        self.si("W")
    }

    /// Symbol of stress.
    pub fn stress(self) -> &'static str {
        self.si("Pa")
    }

    /// Symbol of time.
    pub fn time(self) -> &'static str {
        self.si("s")
    }

    /// Symbol of mass.
    pub fn mass(self) -> &'static str {
        self.si("kg")
    }

    /// Symbol of velocity.
    pub fn velocity(self) -> &'static str {
        self.si("m/s")
    }

    /// Symbol of a quantity.
    pub fn symbol(self, of: Quantity) -> &'static str {
        // Number of shears and stretches among the two strains.
        let forces = |i: usize, j: usize| usize::from(i > 2) + usize::from(j > 2);
        match of {
            Quantity::Ratio => "",
            Quantity::Time => self.time(),
            Quantity::Length => self.length(),
            Quantity::Mass => self.mass(),
            Quantity::Velocity => self.velocity(),
            Quantity::Acceleration => self.si("m/s²"),
            Quantity::AngularVelocity => self.si("rad/s"),
            Quantity::Rate => self.si("1/s"),
            Quantity::Inertia => self.si("kg m²"),
            Quantity::Force => self.force(),
            Quantity::Distributed => self.si("N/m"),
            Quantity::ForceRate => self.si("N/s"),
            Quantity::CoupleRate => self.si("N m/s"),
            Quantity::Couple => self.couple(),
            Quantity::Drag => self.si("N s/m"),
            Quantity::RotationalDrag => self.si("N m s"),
            Quantity::Curvature => self.curvature(),
            Quantity::CurvatureRate => self.si("rad/(m s)"),
            Quantity::Stiffness(i, j) => self.si(["N m²", "N m", "N"][forces(i, j)]),
            Quantity::Viscosity(i, j) => self.si(["N m² s", "N m s", "N s"][forces(i, j)]),
        }
    }

    /// A label for an axis or a column: `x (m)`, or `x` if the symbol is empty.
    pub fn label(name: &str, symbol: &str) -> String {
        match symbol {
            "" => name.to_owned(),
            _ => format!("{name} ({symbol})"),
        }
    }

    /// Symbol after a number: ` m`, or nothing if the symbol is empty.
    pub fn suffix(symbol: &str) -> String {
        match symbol {
            "" => String::new(),
            _ => format!(" {symbol}"),
        }
    }

    fn si(self, symbol: &'static str) -> &'static str {
        match self {
            Self::Dimensionless => "",
            Self::Si => symbol,
        }
    }
}
