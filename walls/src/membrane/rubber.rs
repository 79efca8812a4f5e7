//! Energies of incompressible rubber sheets under two stretches, with first and second derivatives.

use snaprod_core::{Error, Result};

/// W = B1 (I1 - 3) + B2 (I1 - 3)^2 + B3 (I1 - 3)^3 + B4 (I2 - 3): Biderman's law, of which the neo-Hookean and
/// Mooney's are parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubber {
    constants: [f64; 4],
}

/// Energy and derivatives at the stretches l1, l2 of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Biaxial {
    /// W per unloaded volume.
    pub energy: f64,
    /// dW/dl1 and dW/dl2.
    pub stress: [f64; 2],
    /// d2W/dl1 dl1, d2W/dl1 dl2, d2W/dl2 dl2.
    pub moduli: [f64; 3],
}

impl Rubber {
    /// W = C (I1 - 3).
    ///
    /// # Errors
    /// C that is not finite and positive.
    pub fn neo_hookean(c: f64) -> Result<Self> {
        Self::biderman([c, 0.0, 0.0, 0.0])
    }

    /// W = C1 (I1 - 3) + C2 (I2 - 3).
    ///
    /// # Errors
    /// Constants that are not finite, C1 <= 0, C2 < 0.
    pub fn mooney(c1: f64, c2: f64) -> Result<Self> {
        Self::biderman([c1, 0.0, 0.0, c2])
    }

    /// Biderman's law with its constants B1 to B4.
    ///
    /// # Errors
    /// Constants that are not finite, B1 <= 0, B4 < 0.
    pub fn biderman(constants: [f64; 4]) -> Result<Self> {
        let finite = constants.iter().all(|c| c.is_finite());
        if !(finite && constants[0] > 0.0 && constants[3] >= 0.0) {
            return Err(Error::domain(format!(
                "the constants {constants:?} of (I1 - 3), its powers and (I2 - 3) must be finite, the first > 0 and the \
                 last >= 0"
            )));
        }
        Ok(Self { constants })
    }

    /// The constant of I1 - 3.
    pub fn first(&self) -> f64 {
        self.constants[0]
    }

    /// Derivatives of W by I1: first and second.
    fn by_first(&self, excess: f64) -> [f64; 2] {
        let [b1, b2, b3, _] = self.constants;
        [
            b1 + excess * (2.0 * b2 + 3.0 * b3 * excess),
            2.0 * b2 + 6.0 * b3 * excess,
        ]
    }

    /// Energy and derivatives at two stretches.
    pub fn at(&self, l1: f64, l2: f64) -> Biaxial {
        let [b1, b2, b3, b4] = self.constants;
        let (s1, s2) = (l1 * l1, l2 * l2);
        let t = 1.0 / (s1 * s2);
        let excess = s1 + s2 + t - 3.0;
        let second = 1.0 / s1 + 1.0 / s2 + s1 * s2 - 3.0;
        let [w1, w11] = self.by_first(excess);
        let first = [2.0 * (l1 - t / l1), 2.0 * (l2 - t / l2)];
        let other = [
            2.0 * (l1 * s2 - 1.0 / (l1 * s1)),
            2.0 * (l2 * s1 - 1.0 / (l2 * s2)),
        ];
        let second_first = [2.0 + 6.0 * t / s1, 4.0 * t / (l1 * l2), 2.0 + 6.0 * t / s2];
        let second_other = [
            2.0 * s2 + 6.0 / (s1 * s1),
            4.0 * l1 * l2,
            2.0 * s1 + 6.0 / (s2 * s2),
        ];
        let products = [
            first[0] * first[0],
            first[0] * first[1],
            first[1] * first[1],
        ];
        Biaxial {
            energy: excess * (b1 + excess * (b2 + excess * b3)) + b4 * second,
            stress: [0, 1].map(|k| w1 * first[k] + b4 * other[k]),
            moduli: [0, 1, 2]
                .map(|k| w1 * second_first[k] + w11 * products[k] + b4 * second_other[k]),
        }
    }
}
