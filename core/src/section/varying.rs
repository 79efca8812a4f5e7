//! Linear laws whose stiffnesses and rest strains vary along the rod.

use super::linear::STRAIGHT;
use super::{Along, Free, Inverse, Linear, Profile, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::{Error, Result};
use nalgebra::Matrix6;
use std::fmt;
use std::sync::Arc;

/// A stiffness, or none for a strain held at its rest value.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Stiffness<T> {
    /// Held at the rest value.
    Rigid,
    /// Elastic.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Elastic(T),
}

impl<T: From<f64>> From<f64> for Stiffness<T> {
    fn from(value: f64) -> Self {
        Self::Elastic(value.into())
    }
}

impl From<Along> for Stiffness<Along> {
    fn from(along: Along) -> Self {
        Self::Elastic(along)
    }
}

impl<T> Stiffness<T> {
    /// The stiffness, unless rigid.
    pub fn elastic(&self) -> Option<&T> {
        match self {
            Self::Rigid => None,
            Self::Elastic(stiffness) => Some(stiffness),
        }
    }

    /// The stiffness, to be changed, unless rigid.
    pub fn elastic_mut(&mut self) -> Option<&mut T> {
        match self {
            Self::Rigid => None,
            Self::Elastic(stiffness) => Some(stiffness),
        }
    }
}

/// Stiffness of each strain, without coupling. Every number is > 0.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Diagonal {
    /// Couple per flexure about d1 and d2, force times length squared.
    pub bending: [Stiffness<Along>; 2],
    /// Couple per twist, force times length squared.
    pub torsion: Stiffness<Along>,
    /// Force per shear along d1 and d2.
    pub shear: Stiffness<[Along; 2]>,
    /// Force per stretch.
    pub axial: Stiffness<Along>,
}

impl Diagonal {
    /// Every stiffness with its name.
    pub fn stiffnesses(&self) -> impl Iterator<Item = (&'static str, &Along)> {
        const NAMES: [&str; 6] = [
            "bending[0]",
            "bending[1]",
            "torsion",
            "shear[0]",
            "shear[1]",
            "axial",
        ];
        let all = NAMES.into_iter().zip(self.each());
        all.filter_map(|(name, along)| Some((name, along?)))
    }

    /// Stiffness of each strain, unless rigid.
    fn each(&self) -> [Option<&Along>; 6] {
        let [first, second] = &self.bending;
        let [shear_1, shear_2] = match self.shear.elastic() {
            Some([first, second]) => [Some(first), Some(second)],
            None => [None; 2],
        };
        [
            first.elastic(),
            second.elastic(),
            self.torsion.elastic(),
            shear_1,
            shear_2,
            self.axial.elastic(),
        ]
    }

    /// The law with these rest strains, if all its numbers are uniform along the rod.
    ///
    /// # Errors
    /// As [`Linear::diagonal`] and [`Linear::with_rest`].
    pub fn uniform(&self, rest: &Rest) -> Result<Option<Linear>> {
        let uniform = rest.uniform().is_some()
            && self
                .stiffnesses()
                .all(|(_, along)| along.constant().is_some());
        uniform.then(|| self.at(rest, 0.0, 1.0)).transpose()
    }

    fn at(&self, rest: &Rest, s: f64, length: f64) -> Result<Linear> {
        let mut stiffness = Matrix6::zeros();
        for (k, along) in self.each().into_iter().enumerate() {
            if let Some(along) = along {
                stiffness[(k, k)] = along.at(s, length)?;
            }
        }
        let (curvature, twist) = rest.at(s, length)?;
        Linear::of(stiffness, self.rigid(), Strain::from(STRAIGHT))?.with_rest(curvature, twist)
    }

    /// Marks of the rigid strains.
    pub fn rigid(&self) -> [bool; 6] {
        self.each().map(|along| along.is_none())
    }

    fn check(&self) -> Result<()> {
        self.stiffnesses()
            .try_for_each(|(name, along)| along.check_positive(name))
    }
}

/// Rest strains, without load.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Rest {
    /// Flexures about d1 and d2, per length.
    pub curvature: [Along; 2],
    /// Twist, radians per length.
    pub twist: Along,
}

impl Default for Rest {
    /// Straight and untwisted.
    fn default() -> Self {
        Self {
            curvature: [0.0.into(), 0.0.into()],
            twist: 0.0.into(),
        }
    }
}

impl Rest {
    /// Curvature and twist.
    pub fn all(&self) -> impl Iterator<Item = &Along> {
        self.curvature.iter().chain([&self.twist])
    }

    /// Curvatures and twist, if uniform along the rod.
    pub fn uniform(&self) -> Option<([f64; 2], f64)> {
        let [first, second] = &self.curvature;
        Some((
            [first.constant()?, second.constant()?],
            self.twist.constant()?,
        ))
    }

    fn at(&self, s: f64, length: f64) -> Result<([f64; 2], f64)> {
        let [first, second] = &self.curvature;
        let curvature = [first.at(s, length)?, second.at(s, length)?];
        Ok((curvature, self.twist.at(s, length)?))
    }
}

/// A user's linear law as a function of s.
type UserLaw = Arc<dyn Fn(f64) -> Result<Linear> + Send + Sync>;

/// A linear law that varies along the rod: diagonal with entries that are functions of s, or any [`Linear`] law as a
/// function of s. Shear and stretch are rigid until their stiffnesses are given, everywhere along the rod.
///
/// Tables are checked when they are given; polynomials and functions when they are evaluated, and the message names
/// s.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::{Along, Linear, Material, Profile, Shape, ShapeSettings, SectionLaw, Transverse, Varying};
/// let tapered = Varying::diagonal([Along::table(&[(0.0, 2.0), (1.0, 1.0)])?, 1.0.into()], 0.7.into())?;
/// assert_eq!(tapered.at(0.5)?.stiffness()[(0, 0)], 1.5);
///
/// let material = Material { young: 1.0, transverse: Transverse::Poisson(0.3) };
/// let cone = Varying::by(move |s| {
///     let shape = Shape::Circle { radius: 0.1 - 0.05 * s };
///     Profile { shape, material, set: ShapeSettings::default() }.law()
/// });
/// assert!(!cone.is_uniform());
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Clone)]
pub struct Varying {
    source: LawSource,
    breaks: Vec<f64>,
}

#[derive(Clone)]
enum LawSource {
    Entries(Box<Entries>),
    Shaped(Box<Shaped>),
    Rested(Box<Rested>),
    Function(UserLaw),
}

/// A law of a shape that varies.
#[derive(Debug, Clone)]
struct Shaped {
    profile: Profile<Along>,
    rest: Rest,
    /// Length of the rod.
    length: f64,
    /// Director about which the rod bends alone, and the stiffness of flexure about the other and of twist.
    plane: Option<(usize, f64)>,
}

impl Shaped {
    fn at(&self, s: f64) -> Result<Linear> {
        let mut law = self.profile.at(s, self.length)?.law()?;
        if let Some((normal, held)) = self.plane {
            law = law.held_in_plane(normal, held)?;
        }
        let (curvature, twist) = self.rest.at(s, self.length)?;
        law.with_rest(curvature, twist)
    }
}

/// A law with uniform stiffness and varying rest strains.
#[derive(Debug, Clone)]
struct Rested {
    law: Linear,
    rest: Rest,
    /// Length of the rod.
    length: f64,
}

#[derive(Debug, Clone)]
struct Entries {
    law: Diagonal,
    rest: Rest,
    /// Length of the rod.
    length: f64,
}

impl Entries {
    fn all(&self) -> impl Iterator<Item = &Along> {
        self.law
            .stiffnesses()
            .map(|(_, along)| along)
            .chain(self.rest.all())
    }
}

impl Varying {
    /// Stiffnesses and rest strains along a rod of this length.
    ///
    /// # Errors
    /// A constant or a node of a stiffness that is not finite and > 0.
    pub fn new(law: Diagonal, rest: Rest, length: f64) -> Result<Self> {
        law.check()?;
        if law.rigid() == [true; 6] {
            return Err(Error::domain(
                "a section that holds all strains rigid is no rod: leave a strain free",
            ));
        }
        let mut varying = Self {
            breaks: Vec::new(),
            source: LawSource::Entries(Box::new(Entries { law, rest, length })),
        };
        varying.gather_breaks();
        Ok(varying)
    }

    /// Flexural stiffnesses about d1 and d2, torsional stiffness about d3; unshearable, inextensible. The rod's
    /// length, by which polynomials measure s, is 1.
    ///
    /// # Errors
    /// A constant or a node of a table that is not finite and > 0.
    pub fn diagonal(bending: [Along; 2], torsion: Along) -> Result<Self> {
        let law = Diagonal {
            bending: bending.map(Stiffness::from),
            torsion: torsion.into(),
            shear: Stiffness::Rigid,
            axial: Stiffness::Rigid,
        };
        Self::new(law, Rest::default(), 1.0)
    }

    /// A law with rest strains that vary along a rod of this length.
    ///
    /// # Errors
    /// None for rest strains that are defined along the whole rod.
    pub fn from_linear(law: Linear, rest: Rest, length: f64) -> Result<Self> {
        let breaks: Vec<f64> = rest.all().flat_map(Along::breaks).copied().collect();
        let varying = Self {
            source: LawSource::Rested(Box::new(Rested { law, rest, length })),
            breaks: Vec::new(),
        };
        varying.with_breaks(&breaks)
    }

    /// The law of a shape and a material, of rest strains and of a shape that vary along a rod of this length.
    ///
    /// # Errors
    /// A size, at a node of a table, that is not finite and > 0.
    pub fn shaped(profile: Profile<Along>, rest: Rest, length: f64) -> Result<Self> {
        (profile.shape.sizes())
            .try_for_each(|size| size.check_positive("a size of the section"))?;
        let all = profile.shape.sizes().chain(rest.all());
        let breaks: Vec<f64> = all.flat_map(Along::breaks).copied().collect();
        let shaped = Shaped {
            profile,
            rest,
            length,
            plane: None,
        };
        let varying = Self {
            source: LawSource::Shaped(Box::new(shaped)),
            breaks: Vec::new(),
        };
        varying.with_breaks(&breaks)
    }

    /// A law of a shape that bends about its director `normal` (0 or 1) alone: flexure about the other and twist have
    /// the stiffness `held`. Other laws are unchanged.
    #[must_use]
    pub fn in_plane(mut self, normal: usize, held: f64) -> Self {
        if let LawSource::Shaped(shaped) = &mut self.source {
            shaped.plane = Some((normal, held));
        }
        self
    }

    /// Any law of s. It is taken to be smooth between breaks ([`Varying::with_breaks`]).
    pub fn by(law: impl Fn(f64) -> Result<Linear> + Send + Sync + 'static) -> Self {
        Self {
            source: LawSource::Function(Arc::new(law)),
            breaks: Vec::new(),
        }
    }

    /// Adds shear stiffnesses along d1 and d2.
    ///
    /// # Errors
    /// As [`Varying::diagonal`]; a law given as a function of s, which has its own.
    pub fn with_shear(self, shear: [Along; 2]) -> Result<Self> {
        self.edited("shear", |entries| {
            entries.law.shear = Stiffness::Elastic(shear)
        })
    }

    /// Adds an axial stiffness.
    ///
    /// # Errors
    /// As [`Varying::with_shear`].
    pub fn with_axial(self, axial: Along) -> Result<Self> {
        self.edited("axial", |entries| {
            entries.law.axial = Stiffness::Elastic(axial)
        })
    }

    /// Sets intrinsic curvatures u1, u2 and an intrinsic twist u3.
    ///
    /// # Errors
    /// A law given as a function of s, which has its own.
    pub fn with_rest(self, curvature: [Along; 2], twist: Along) -> Result<Self> {
        self.edited("rest", |entries| entries.rest = Rest { curvature, twist })
    }

    /// Adds places where the law is not smooth in s.
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn with_breaks(mut self, breaks: &[f64]) -> Result<Self> {
        if let Some(s) = breaks.iter().find(|s| !s.is_finite()) {
            return Err(Error::domain(format!("the break s = {s} must be finite")));
        }
        self.breaks.extend(breaks);
        self.sort_breaks();
        Ok(self)
    }

    /// The law at s.
    ///
    /// # Errors
    /// s outside a table; a law without a positive definite stiffness at s.
    pub fn at(&self, s: f64) -> Result<Linear> {
        match &self.source {
            LawSource::Entries(entries) => entries.law.at(&entries.rest, s, entries.length),
            LawSource::Rested(rested) => {
                let found = rested.rest.at(s, rested.length);
                found.and_then(|(curvature, twist)| rested.law.with_rest(curvature, twist))
            }
            LawSource::Shaped(shaped) => shaped.at(s),
            LawSource::Function(law) => law(s),
        }
        .map_err(|e| e.context(format!("the section at s = {s}")))
    }

    fn edited(mut self, what: &str, edit: impl FnOnce(&mut Entries)) -> Result<Self> {
        match &mut self.source {
            LawSource::Entries(entries) => {
                edit(entries);
                entries.law.check()?;
            }
            LawSource::Shaped(_) | LawSource::Rested(_) | LawSource::Function(_) => {
                return Err(Error::domain(format!(
                    "{what} cannot be set on a law given as a function of s: set it in the function"
                )));
            }
        }
        self.gather_breaks();
        Ok(self)
    }

    fn gather_breaks(&mut self) {
        if let LawSource::Entries(entries) = &self.source {
            self.breaks.extend(entries.all().flat_map(Along::breaks));
        }
        self.sort_breaks();
    }

    fn sort_breaks(&mut self) {
        self.breaks.sort_by(f64::total_cmp);
        self.breaks.dedup();
    }
}

impl fmt::Debug for Varying {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Varying");
        match &self.source {
            LawSource::Entries(entries) => shown.field("entries", entries),
            LawSource::Shaped(shaped) => shown.field("shaped", shaped),
            LawSource::Rested(rested) => shown.field("rested", rested),
            LawSource::Function(_) => shown.field("law", &"a function of s"),
        };
        shown.field("breaks", &self.breaks).finish()
    }
}

impl SectionLaw for Varying {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        self.at(s)?.energy(s, e)
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        self.at(s)?.resultants(s, e)
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        self.at(s)?.tangent(s, e)
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        self.at(s)?.free(s, e)
    }

    /// Marks of the rigid strains at the clamp, which are rigid along the whole rod.
    fn rigid(&self) -> [bool; 6] {
        self.at(0.0).map_or([false; 6], |law| law.is_rigid())
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        self.at(s)?.inverse(s, w)
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let uniform = self.is_uniform().then(|| self.at(0.0).ok()).flatten()?;
        uniform.uniform_linear()
    }

    fn is_linear(&self) -> bool {
        true
    }

    /// True if every entry is a constant.
    fn is_uniform(&self) -> bool {
        match &self.source {
            LawSource::Entries(entries) => entries.all().all(|along| along.constant().is_some()),
            LawSource::Shaped(_) | LawSource::Rested(_) | LawSource::Function(_) => false,
        }
    }

    fn has_uniform_stiffness(&self) -> bool {
        match &self.source {
            LawSource::Entries(entries) => {
                let mut entries = entries.law.stiffnesses();
                entries.all(|(_, along)| along.constant().is_some())
            }
            LawSource::Rested(_) => true,
            LawSource::Shaped(_) | LawSource::Function(_) => false,
        }
    }

    /// The interior nodes of the tables, and the user's breaks.
    fn breaks(&self) -> Vec<f64> {
        self.breaks.clone()
    }

    fn unloaded(&self, s: f64) -> Result<Strain> {
        Ok(*self.at(s)?.rest())
    }

    /// Exact for entries and shapes (they are diagonal); false for a function of s.
    fn planar_about(&self) -> [bool; 2] {
        let Rest { curvature, twist } = match &self.source {
            LawSource::Entries(entries) => &entries.rest,
            LawSource::Shaped(shaped) => &shaped.rest,
            LawSource::Rested(_) | LawSource::Function(_) => return [false; 2],
        };
        std::array::from_fn(|axis| twist.vanishes() && curvature[1 - axis].vanishes())
    }
}
