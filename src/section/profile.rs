//! Linear laws from the shape of the section and its material.
//!
//! A point of the section is x1 d1 + x2 d2 from the centroid. Flexure u1 turns the section about d1, so that its
//! stiffness is E times the second moment *about* d1, the integral of x2^2; u2 likewise with x1^2.
//! ```text
//! K = diag(E I1, E I2, G J, k1 G A, k2 G A, E A),   I1 = int x2^2,   I2 = int x1^2
//! ```
//! with St Venant's torsion constant J (not the polar moment, except where the section is round) and the shear
//! correction factors k.

use super::Linear;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// The shape of a section, of the same material all over.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "scene",
    derive(serde::Serialize),
    serde(tag = "shape", rename_all = "lowercase")
)]
pub enum Shape {
    /// A disc.
    Circle {
        /// Its radius.
        radius: f64,
    },
    /// A rectangle.
    Rectangle {
        /// Side along d1.
        width: f64,
        /// Side along d2.
        height: f64,
    },
    /// A ring between two circles.
    Tube {
        /// Outer radius.
        outer_radius: f64,
        /// Thickness of the wall, at most the outer radius.
        thickness: f64,
    },
}

impl Shape {
    /// Area A.
    pub fn area(&self) -> f64 {
        match *self {
            Self::Circle { radius } => PI * radius * radius,
            Self::Rectangle { width, height } => width * height,
            Self::Tube {
                outer_radius,
                thickness,
            } => PI * thickness * (outer_radius + (outer_radius - thickness)),
        }
    }

    /// Second moments of area about d1 (integral of x2^2) and about d2 (integral of x1^2).
    pub fn second_moments(&self) -> [f64; 2] {
        match *self {
            Self::Circle { .. } | Self::Tube { .. } => [0.5 * self.torsion_constant(); 2],
            Self::Rectangle { width, height } => {
                let twelfth = width * height / 12.0;
                [twelfth * height * height, twelfth * width * width]
            }
        }
    }

    /// St Venant's torsion constant J, to rounding for any aspect ratio: the polar moment for circle and tube, the
    /// series for the rectangle.
    pub fn torsion_constant(&self) -> f64 {
        match *self {
            Self::Circle { radius } => 0.5 * PI * radius.powi(4),
            Self::Tube {
                outer_radius: outer,
                thickness,
            } => {
                let inner = outer - thickness;
                0.5 * self.area() * (outer * outer + inner * inner)
            }
            Self::Rectangle { width, height } => {
                let (long, short) = (width.max(height), width.min(height));
                long * short.powi(3) * rectangle_torsion(long / short)
            }
        }
    }

    /// Cowper's shear correction factor (J. Appl. Mech. 33 (1966) 335), the same for both directions:
    /// ```text
    /// circle    6 (1 + nu) / (7 + 6 nu)
    /// rectangle 10 (1 + nu) / (12 + 11 nu)
    /// tube      6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2),  m = inner radius / outer radius
    /// ```
    pub fn cowper_factor(&self, poisson: f64) -> f64 {
        let one = 1.0 + poisson;
        match *self {
            Self::Circle { .. } => 6.0 * one / (7.0 + 6.0 * poisson),
            Self::Rectangle { .. } => 10.0 * one / (12.0 + 11.0 * poisson),
            Self::Tube {
                outer_radius,
                thickness,
            } => {
                let m2 = ((outer_radius - thickness) / outer_radius).powi(2);
                let ring = (1.0 + m2).powi(2);
                6.0 * one * ring / ((7.0 + 6.0 * poisson) * ring + (20.0 + 12.0 * poisson) * m2)
            }
        }
    }

    fn check(&self) -> Result<()> {
        match *self {
            Self::Circle { radius } => positive("radius", radius),
            Self::Rectangle { width, height } => {
                positive("width", width)?;
                positive("height", height)
            }
            Self::Tube {
                outer_radius,
                thickness,
            } => {
                positive("outer radius", outer_radius)?;
                if !(0.0 < thickness && thickness <= outer_radius) {
                    return Err(Error::domain(format!(
                        "thickness = {thickness} must be > 0 and at most the outer radius {outer_radius}"
                    )));
                }
                Ok(())
            }
        }
    }
}

/// J / (a b^3) for sides a = `ratio` b >= b (Timoshenko, Goodier, Theory of Elasticity, art. 109): with n odd,
/// ```text
/// 1/3 - 64/(pi^5 ratio) sum tanh(n pi ratio/2)/n^5,   tanh(x/2) = 1 - 2/(e^x + 1),   sum 1/n^5 = 31/32 zeta(5):
/// ```
/// what is left to be summed falls as exp(-n pi ratio).
fn rectangle_torsion(ratio: f64) -> f64 {
    const ODD_FIFTHS: f64 = 1.004_523_762_795_139_6;
    let mut sum = ODD_FIFTHS;
    for n in (1..16).step_by(2) {
        let n = f64::from(n);
        sum -= 2.0 / (n.powi(5) * ((n * PI * ratio).exp() + 1.0));
    }
    1.0 / 3.0 - 64.0 / PI.powi(5) / ratio * sum
}

/// A linearly elastic isotropic material, or one whose two moduli are given apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    young: f64,
    shear: f64,
}

impl Material {
    /// Young's modulus E > 0 and Poisson's ratio -1 < nu <= 1/2: G = E / 2(1 + nu).
    ///
    /// # Errors
    /// Values outside these ranges.
    pub fn with_poisson(young: f64, poisson: f64) -> Result<Self> {
        positive("Young's modulus", young)?;
        if !(-1.0 < poisson && poisson <= 0.5) {
            return Err(Error::domain(format!(
                "Poisson's ratio = {poisson} must be > -1 and <= 0.5"
            )));
        }
        Self::with_shear(young, 0.5 * young / (1.0 + poisson))
    }

    /// Young's modulus E > 0 and the shear modulus G > 0.
    ///
    /// # Errors
    /// Values outside these ranges.
    pub fn with_shear(young: f64, shear: f64) -> Result<Self> {
        positive("Young's modulus", young)?;
        positive("shear modulus", shear)?;
        Ok(Self { young, shear })
    }

    /// Young's modulus E.
    pub fn young(&self) -> f64 {
        self.young
    }

    /// G.
    pub fn shear(&self) -> f64 {
        self.shear
    }

    /// nu = E/2G - 1, which for moduli given apart may lie outside (-1, 1/2].
    pub fn poisson(&self) -> f64 {
        0.5 * self.young / self.shear - 1.0
    }
}

/// A section of given shape and material; makes a [`Linear`] law.
///
/// Torsion constant: St Venant's. Shear correction factors: Cowper's, which depend on nu. Both can be given instead;
/// shear and stretch can be made rigid afterwards ([`Linear::rigid`]).
///
/// ```
/// # use snaprod::section::{Material, Profile, Shape};
/// let steel = Material::with_poisson(2.07e11, 0.3)?;
/// let law = Profile::new(Shape::Rectangle { width: 0.1, height: 0.5 }, steel)?
///     .with_shear_factors([5.0 / 6.0, 5.0 / 6.0])?
///     .law()?
///     .rigid([false, false, true])?;
/// assert_eq!(law.is_rigid(), [false, false, true]);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    shape: Shape,
    material: Material,
    torsion_constant: Option<f64>,
    shear_factors: Option<[f64; 2]>,
}

impl Profile {
    /// A shape of a material.
    ///
    /// # Errors
    /// Sizes of the shape that are not finite and > 0, a tube whose inner radius is not less than the outer.
    pub fn new(shape: Shape, material: Material) -> Result<Self> {
        shape.check()?;
        Ok(Self {
            shape,
            material,
            torsion_constant: None,
            shear_factors: None,
        })
    }

    /// With a torsion constant J of the user's.
    ///
    /// # Errors
    /// A value that is not finite and > 0.
    pub fn with_torsion_constant(mut self, torsion_constant: f64) -> Result<Self> {
        positive("torsion constant", torsion_constant)?;
        self.torsion_constant = Some(torsion_constant);
        Ok(self)
    }

    /// With shear correction factors k1, k2 of the user's, along d1 and d2 (5/6 is a common choice for rectangles).
    ///
    /// # Errors
    /// A value that is not finite and > 0.
    pub fn with_shear_factors(mut self, factors: [f64; 2]) -> Result<Self> {
        positive("shear factor[0]", factors[0])?;
        positive("shear factor[1]", factors[1])?;
        self.shear_factors = Some(factors);
        Ok(self)
    }

    /// J in use.
    pub fn torsion_constant(&self) -> f64 {
        self.torsion_constant
            .unwrap_or_else(|| self.shape.torsion_constant())
    }

    /// k1, k2 in use.
    ///
    /// # Errors
    /// Cowper's factor for moduli E and G that no isotropic material has.
    pub fn shear_factors(&self) -> Result<[f64; 2]> {
        if let Some(factors) = self.shear_factors {
            return Ok(factors);
        }
        let poisson = self.material.poisson();
        // nu = 1/2 comes back from G with an error of rounding.
        if !(-1.0 < poisson && poisson <= 0.5 + 4.0 * f64::EPSILON) {
            return Err(Error::domain(format!(
                "the moduli E = {} and G = {} mean a Poisson's ratio of {poisson}, outside -1 < nu <= 0.5: \
                 there is no shear factor of Cowper's for it; give the shear factors",
                self.material.young, self.material.shear
            )));
        }
        Ok([self.shape.cowper_factor(poisson); 2])
    }

    /// The law K = diag(E I1, E I2, G J, k1 G A, k2 G A, E A).
    ///
    /// # Errors
    /// As [`Profile::shear_factors`]; stiffnesses that overflow or underflow.
    pub fn law(&self) -> Result<Linear> {
        let Material { young, shear } = self.material;
        let area = self.shape.area();
        let factors = self.shear_factors()?;
        let bending = self.shape.second_moments().map(|moment| young * moment);
        Linear::diagonal(bending, shear * self.torsion_constant())?
            .with_shear(factors.map(|k| k * shear * area))?
            .with_axial(young * area)
    }
}

/// A number that must be finite and > 0.
pub(super) fn positive(name: &str, value: f64) -> Result<()> {
    if 0.0 < value && value < f64::INFINITY {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{name} = {value} must be finite and > 0"
    )))
}
