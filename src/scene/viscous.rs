//! What viscoelastic scenes have more than elastic ones: internal friction, relaxation, strain fields.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

/// Internal friction of the planar rod, m = EI theta' + m_v(theta'_t) (AMV (2.20)).
///
/// With eta the viscosity, m_v = eta theta'_t (Kelvin-Voigt), or, with a [`PowerLaw`],
/// m_v = eta theta'_t (1 + (theta'_t/rate)^2)^((exponent - 1)/2).
///
/// In a scene a number, `damping = 0.1`, or a table, `damping = { viscosity = 0.1, exponent = 0.5, rate = 1.0 }` or
/// `damping = { proportional = 0.05 }`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// How large it is.
    pub size: Friction,
    /// How it departs from being linear; `None`: Kelvin-Voigt.
    pub power: Option<PowerLaw>,
}

impl Damping {
    /// eta, stiffness times time, of a rod of this bending stiffness.
    pub fn viscosity(&self, bending_stiffness: f64) -> f64 {
        match self.size {
            Friction::Viscosity(viscosity) => viscosity,
            Friction::Proportional(time) => time * bending_stiffness,
        }
    }
}

impl Serialize for Damping {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if let (Friction::Viscosity(viscosity), None) = (self.size, self.power) {
            return serializer.serialize_f64(viscosity);
        }
        let mut table = serializer.serialize_map(None)?;
        match self.size {
            Friction::Viscosity(viscosity) => table.serialize_entry("viscosity", &viscosity)?,
            Friction::Proportional(time) => table.serialize_entry("proportional", &time)?,
        }
        power_entries(&mut table, self.power)?;
        table.end()
    }
}

/// Writes `exponent` and `rate`.
pub(super) fn power_entries<M: SerializeMap>(
    table: &mut M,
    power: Option<PowerLaw>,
) -> Result<(), M::Error> {
    if let Some(PowerLaw { exponent, rate }) = power {
        table.serialize_entry("exponent", &exponent)?;
        table.serialize_entry("rate", &rate)?;
    }
    Ok(())
}

/// The viscosity of a planar rod, in one of two ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// eta > 0, bending stiffness times time.
    Viscosity(f64),
    /// eta over the bending stiffness, a time > 0.
    Proportional(f64),
}

/// Friction that grows with a power of the rate: linear below `rate`, as rate^exponent above it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    /// In [0.1, 10]; 1 is Kelvin-Voigt, less is shear thinning.
    pub exponent: f64,
    /// Rate of the curvature > 0 at which the power sets in, 1/(length times time).
    pub rate: f64,
}

/// A Maxwell branch of the planar rod: a spring in series with a dashpot, beside the bending stiffness, which is that
/// of the rod after a long time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Maxwell {
    /// What it adds to the bending stiffness at once, >= 0.
    pub stiffness: f64,
    /// Its relaxation time > 0.
    pub time: f64,
}

/// The strain field to which the Maxwell branches are relaxed at the start: the shape in which the rod has been held
/// for a long time.
///
/// In a scene `relaxed = true`, `relaxed = false`, or the strain field.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Relaxed<T> {
    /// `true`, the default: that of the start. The branches carry nothing yet.
    #[default]
    Start,
    /// `false`: that of the unloaded rod, which has been deformed at once.
    Unloaded,
    /// This one.
    At(T),
}

impl<T> Relaxed<T> {
    pub(super) fn is_start(&self) -> bool {
        matches!(self, Self::Start)
    }

    /// With another strain field in [`Relaxed::At`].
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Relaxed<U> {
        match self {
            Self::Start => Relaxed::Start,
            Self::Unloaded => Relaxed::Unloaded,
            Self::At(field) => Relaxed::At(f(field)),
        }
    }
}

impl<T: Serialize> Serialize for Relaxed<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Start => true.serialize(serializer),
            Self::Unloaded => false.serialize(serializer),
            Self::At(field) => field.serialize(serializer),
        }
    }
}

/// How a viscoelastic run steps through time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The program chooses (the default).
    #[default]
    Auto,
    /// Explicit steps, bounded by the fastest decay of a strain.
    Explicit,
    /// Implicit steps, for stiff rods: small viscosity, fine grids.
    Implicit,
}

impl Method {
    pub(super) fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}
