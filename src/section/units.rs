//! The units in which a rod is made dimensionless.

/// Length, force and time by which a material is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Length of the rod.
    pub length: f64,
    /// A bending stiffness.
    pub stiffness: f64,
    /// A time.
    pub time: f64,
}

impl Units {
    /// Everything is 1.
    pub const ONE: Self = Self {
        length: 1.0,
        stiffness: 1.0,
        time: 1.0,
    };
}
