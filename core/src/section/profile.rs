//! Linear laws from the shape and the material of a section.
//!
//! A point of the section is x1 d1 + x2 d2 from the centroid. Flexure u1 turns the section about d1, so that its
//! stiffness is E times the second moment *about* d1, the integral of x2^2; u2 likewise with x1^2.
//! ```text
//! K = diag(E I1, E I2, G J, k G A, k G A, E A),   I1 = int x2^2,   I2 = int x1^2
//! ```
//! with St Venant's torsion constant J (not the polar moment, except for round sections) and Cowper's shear
//! correction factor k, which depends on nu. Both can be given instead.

use super::Linear;
use crate::error::{Error, Result, check_positive};
use std::f64::consts::PI;

/// Shape of a homogeneous section, by sizes that are numbers, or vary along the rod (`Shape<Along>`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(tag = "shape", rename_all = "lowercase")
)]
pub enum Shape<T = f64> {
    /// A disc.
    Circle {
        /// Radius of the disc.
        radius: T,
    },
    /// A rectangle.
    Rectangle {
        /// Side along d1.
        width: T,
        /// Side along d2.
        height: T,
    },
    /// A ring between two circles.
    Tube {
        /// Outer radius.
        outer_radius: T,
        /// Thickness of the wall, at most the outer radius.
        thickness: T,
    },
}

impl Shape {
    /// Smallest width of the section: rods whose centrelines are nearer than this touch, whatever their orientation.
    pub fn thickness(&self) -> f64 {
        match *self {
            Self::Circle { radius } => 2.0 * radius,
            Self::Tube { outer_radius, .. } => 2.0 * outer_radius,
            Self::Rectangle { width, height } => width.min(height),
        }
    }

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
            Self::Circle { radius } => check_positive("radius", radius),
            Self::Rectangle { width, height } => {
                check_positive("width", width)?;
                check_positive("height", height)
            }
            Self::Tube {
                outer_radius,
                thickness,
            } => {
                check_positive("outer radius", outer_radius)?;
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
/// the terms of the remaining sum fall as exp(-n pi ratio).
fn rectangle_torsion(ratio: f64) -> f64 {
    const ODD_FIFTHS: f64 = 1.004_523_762_795_139_6;
    let mut sum = ODD_FIFTHS;
    for n in (1..16).step_by(2) {
        let n = f64::from(n);
        sum -= 2.0 / (n.powi(5) * ((n * PI * ratio).exp() + 1.0));
    }
    1.0 / 3.0 - 64.0 / PI.powi(5) / ratio * sum
}

/// A linearly elastic isotropic material, or one with two independent moduli.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Material {
    /// Young's modulus E > 0, force per area.
    pub young: f64,
    /// Shear modulus or Poisson's ratio.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub transverse: Transverse,
}

/// The elastic constant besides Young's modulus.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "snake_case")
)]
pub enum Transverse {
    /// Shear modulus G > 0, force per area.
    ShearModulus(f64),
    /// Poisson's ratio in (-1, 0.5].
    Poisson(f64),
}

impl Material {
    /// Shear modulus G: E/2(1 + nu) if Poisson's ratio is given.
    pub fn shear(&self) -> f64 {
        match self.transverse {
            Transverse::ShearModulus(modulus) => modulus,
            Transverse::Poisson(ratio) => 0.5 * self.young / (1.0 + ratio),
        }
    }

    /// Poisson's ratio nu: E/2G - 1 if G is given, possibly outside (-1, 1/2].
    pub fn poisson(&self) -> f64 {
        match self.transverse {
            Transverse::ShearModulus(modulus) => 0.5 * self.young / modulus - 1.0,
            Transverse::Poisson(ratio) => ratio,
        }
    }

    fn check(&self) -> Result<()> {
        check_positive("Young's modulus", self.young)?;
        match self.transverse {
            Transverse::Poisson(ratio) if !(-1.0 < ratio && ratio <= 0.5) => Err(Error::domain(
                format!("Poisson's ratio = {ratio} must be > -1 and <= 0.5"),
            )),
            _ => check_positive("shear modulus", self.shear()),
        }
    }
}

/// The word `"rigid"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Rigid {
    /// Held at the rest value.
    Rigid,
}

/// Optional settings besides the shape of a cross-section.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ShapeSettings {
    /// Shear stiffness = factor * G * area, in (0, 1] (5/6 is a common choice for rectangles); without it, Cowper's.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub shear_factor: Option<f64>,
    /// Torsional stiffness = G * constant, > 0, length to the fourth; without it, that of St Venant.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub torsion_constant: Option<f64>,
    /// Marks of flexures about d1 and d2 and of twist that are held rigid.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "rigid",
            serialize_with = "names",
            skip_serializing_if = "nothing"
        )
    )]
    pub held: [bool; 3],
    /// `"rigid"`: unshearable.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub shear: Option<Rigid>,
    /// `"rigid"`: inextensible.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub axial: Option<Rigid>,
}

impl ShapeSettings {
    /// Marks of the rigid strains.
    pub fn rigid(&self) -> [bool; 6] {
        let [u1, u2, u3] = self.held;
        let shear = self.shear.is_some();
        [u1, u2, u3, shear, shear, self.axial.is_some()]
    }
}

/// True if no mark is set.
#[cfg(feature = "serde")]
fn nothing(marks: &[bool; 3]) -> bool {
    *marks == [false; 3]
}

/// Writes the names of the marked strains.
#[cfg(feature = "serde")]
fn names<S: serde::Serializer>(
    marks: &[bool; 3],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    let all = super::StrainName::ALL.iter().zip(marks);
    serializer.collect_seq(all.filter(|(_, marked)| **marked).map(|(name, _)| name))
}

/// A section of given shape and material; makes a [`Linear`] law.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::{Material, Profile, Rigid, Shape, ShapeSettings, Transverse};
/// let law = Profile {
///     shape: Shape::Rectangle { width: 0.1, height: 0.5 },
///     material: Material { young: 2.07e11, transverse: Transverse::Poisson(0.3) },
///     set: ShapeSettings { shear_factor: Some(5.0 / 6.0), axial: Some(Rigid::Rigid), ..Default::default() },
/// }
/// .law()?;
/// assert_eq!(law.is_rigid(), [false, false, false, false, false, true]);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Profile<T = f64> {
    /// Shape of the section.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub shape: Shape<T>,
    /// Material of the section.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub material: Material,
    /// Optional settings.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub set: ShapeSettings,
}

impl Profile {
    /// Shear factor k, equal along d1 and d2; 1 if shear is rigid.
    fn shear_factor(&self) -> Result<f64> {
        if let Some(factor) = self.set.shear_factor.or(self.set.shear.map(|_| 1.0)) {
            check_positive("shear factor", factor)?;
            return Ok(factor);
        }
        let poisson = self.material.poisson();
        // nu = 1/2 computed from G has a rounding error.
        if !(-1.0 < poisson && poisson <= 0.5 + 4.0 * f64::EPSILON) {
            return Err(Error::domain(format!(
                "the moduli E = {} and G = {} mean a Poisson's ratio of {poisson}, outside -1 < nu <= 0.5: \
                 there is no shear factor of Cowper's for it; give the shear factor",
                self.material.young,
                self.material.shear()
            )));
        }
        Ok(self.shape.cowper_factor(poisson))
    }

    /// The law K = diag(E I1, E I2, G J, k G A, k G A, E A).
    ///
    /// # Errors
    /// Sizes, moduli and settings that are not finite and > 0; a wall thicker than the tube's radius; Cowper's factor
    /// for moduli of no isotropic material; stiffnesses that overflow or underflow.
    pub fn law(&self) -> Result<Linear> {
        self.shape.check()?;
        self.material.check()?;
        let (young, shear) = (self.material.young, self.material.shear());
        let area = self.shape.area();
        let factor = self.shear_factor()?;
        let given = self.set.torsion_constant;
        let constant = given.unwrap_or_else(|| self.shape.torsion_constant());
        check_positive("torsion constant", constant)?;
        let bending = self.shape.second_moments().map(|moment| young * moment);
        Linear::diagonal(bending, shear * constant)?
            .with_shear([factor * shear * area; 2])?
            .with_axial(young * area)?
            .holding(self.set.rigid())
    }
}
