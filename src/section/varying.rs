//! Linear laws whose stiffnesses and rest strains vary along the rod.

use super::linear::STRAIGHT;
use super::profile::positive;
use super::{Free, Inverse, Linear, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::{Error, Result};
use nalgebra::Matrix6;
use std::fmt;
use std::sync::Arc;

/// A number as a function of the arclength s.
#[derive(Debug, Clone, PartialEq)]
pub struct Along(Form);

#[derive(Debug, Clone, PartialEq)]
enum Form {
    Constant(f64),
    /// Linear between nodes (s, value), s in growing order; a place that stands twice is a jump.
    Table(Vec<(f64, f64)>),
    /// Coefficients of 1, s, s^2, ...
    Polynomial(Vec<f64>),
}

/// How far beyond the ends of a table s may lie, relative to its length: rounding.
const BEYOND: f64 = 1e-12;

impl From<f64> for Along {
    fn from(value: f64) -> Self {
        Self(Form::Constant(value))
    }
}

impl Along {
    /// Linear between the nodes (s, value). A place that stands twice is a jump; at the jump itself the second value
    /// holds. The interior nodes are breaks ([`SectionLaw::breaks`]). The table must cover the rod.
    ///
    /// # Errors
    /// Fewer than two nodes, numbers that are not finite, places out of order or standing more than twice.
    pub fn table(nodes: &[(f64, f64)]) -> Result<Self> {
        if nodes.len() < 2 {
            return Err(Error::domain(format!(
                "a table along the rod has {} nodes (s, value), it needs at least 2",
                nodes.len()
            )));
        }
        for (k, (s, value)) in nodes.iter().enumerate() {
            if !(s.is_finite() && value.is_finite()) {
                return Err(Error::domain(format!(
                    "table node {k} = ({s}, {value}) must be finite"
                )));
            }
        }
        for (k, pair) in nodes.windows(2).enumerate() {
            if !(pair[0].0 <= pair[1].0) {
                return Err(Error::domain(format!(
                    "table nodes must be in growing order of s: s = {} stands before s = {} (nodes {k} and {})",
                    pair[0].0,
                    pair[1].0,
                    k + 1
                )));
            }
        }
        let last = nodes.len() - 1;
        let crowd = nodes.windows(3).find(|three| three[0].0 == three[2].0);
        let ends = [&nodes[..2], &nodes[last - 1..]];
        let crowd = crowd.or(ends.into_iter().find(|two| two[0].0 == two[1].0));
        if let Some(crowd) = crowd {
            return Err(Error::domain(format!(
                "s = {} stands too often in the table: twice is a jump, and only inside",
                crowd[0].0
            )));
        }
        Ok(Self(Form::Table(nodes.to_vec())))
    }

    /// c0 + c1 s + c2 s^2 + ...
    ///
    /// # Errors
    /// No coefficients, or one that is not finite.
    pub fn polynomial(coefficients: &[f64]) -> Result<Self> {
        if coefficients.is_empty() || !coefficients.iter().all(|c| c.is_finite()) {
            return Err(Error::domain(format!(
                "the coefficients {coefficients:?} of a polynomial in s must be finite, at least one"
            )));
        }
        Ok(Self(Form::Polynomial(coefficients.to_vec())))
    }

    /// The value at s.
    ///
    /// # Errors
    /// s outside a table.
    pub fn at(&self, s: f64) -> Result<f64> {
        match &self.0 {
            Form::Constant(value) => Ok(*value),
            Form::Polynomial(coefficients) => {
                Ok(coefficients.iter().rev().fold(0.0, |sum, c| sum * s + c))
            }
            Form::Table(nodes) => {
                let last = nodes.len() - 1;
                let (from, to) = (nodes[0].0, nodes[last].0);
                let slack = BEYOND * (to - from);
                if !(from - slack <= s && s <= to + slack) {
                    return Err(Error::domain(format!(
                        "s = {s} lies outside the table, which goes from s = {from} to s = {to}"
                    )));
                }
                let right = nodes.partition_point(|node| node.0 <= s).clamp(1, last);
                let ((a, left), (b, right)) = (nodes[right - 1], nodes[right]);
                let t = ((s - a) / (b - a)).clamp(0.0, 1.0);
                Ok(left * (1.0 - t) + right * t)
            }
        }
    }

    fn is_constant(&self) -> bool {
        matches!(self.0, Form::Constant(_))
    }

    /// Zero for all s.
    fn vanishes(&self) -> bool {
        match &self.0 {
            Form::Constant(value) => *value == 0.0,
            Form::Table(nodes) => nodes.iter().all(|node| node.1 == 0.0),
            Form::Polynomial(coefficients) => coefficients.iter().all(|c| *c == 0.0),
        }
    }

    fn breaks(&self) -> &[(f64, f64)] {
        match &self.0 {
            Form::Table(nodes) => &nodes[1..nodes.len() - 1],
            _ => &[],
        }
    }

    /// Positive as far as it can be known beforehand: linear pieces are where their nodes are.
    fn positive(self, name: &str) -> Result<Self> {
        match &self.0 {
            Form::Constant(value) => positive(name, *value)?,
            Form::Table(nodes) => {
                for (s, value) in nodes {
                    positive(&format!("{name} at s = {s}"), *value)?;
                }
            }
            Form::Polynomial(_) => {}
        }
        Ok(self)
    }
}

/// What a user's law of s is called.
type Law = Arc<dyn Fn(f64) -> Result<Linear> + Send + Sync>;

/// A linear law that varies along the rod: diagonal with entries that are functions of s, or any [`Linear`] law as a
/// function of s. Shear and stretch are rigid until their stiffnesses are given, everywhere along the rod.
///
/// Tables are checked when they are given; polynomials and functions where they are evaluated, and the message names
/// s.
///
/// ```
/// # use snaprod::section::{Along, Linear, Material, Profile, Shape, SectionLaw, Varying};
/// let tapered = Varying::diagonal([Along::table(&[(0.0, 2.0), (1.0, 1.0)])?, 1.0.into()], 0.7.into())?;
/// assert_eq!(tapered.at(0.5)?.stiffness()[(0, 0)], 1.5);
///
/// let material = Material::with_poisson(1.0, 0.3)?;
/// let cone = Varying::by(move |s| {
///     Profile::new(Shape::Circle { radius: 0.1 - 0.05 * s }, material)?.law()
/// });
/// assert!(!cone.is_uniform());
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Clone)]
pub struct Varying {
    source: Source,
    breaks: Vec<f64>,
}

#[derive(Clone)]
enum Source {
    Entries(Box<Entries>),
    Function(Law),
}

#[derive(Debug, Clone)]
struct Entries {
    bending: [Along; 2],
    torsion: Along,
    shear: Option<[Along; 2]>,
    axial: Option<Along>,
    curvature: [Along; 2],
    twist: Along,
}

impl Entries {
    fn all(&self) -> impl Iterator<Item = &Along> {
        let shear = self.shear.iter().flatten();
        let rest = self.curvature.iter().chain([&self.twist]);
        let stiffness = self
            .bending
            .iter()
            .chain([&self.torsion])
            .chain(&self.axial);
        stiffness.chain(shear).chain(rest)
    }

    fn at(&self, s: f64) -> Result<Linear> {
        let mut stiffness = Matrix6::zeros();
        stiffness[(0, 0)] = self.bending[0].at(s)?;
        stiffness[(1, 1)] = self.bending[1].at(s)?;
        stiffness[(2, 2)] = self.torsion.at(s)?;
        if let Some([first, second]) = &self.shear {
            stiffness[(3, 3)] = first.at(s)?;
            stiffness[(4, 4)] = second.at(s)?;
        }
        if let Some(axial) = &self.axial {
            stiffness[(5, 5)] = axial.at(s)?;
        }
        let unshearable = self.shear.is_none();
        let rigid = [unshearable, unshearable, self.axial.is_none()];
        let curvature = [self.curvature[0].at(s)?, self.curvature[1].at(s)?];
        Linear::of(stiffness, rigid, Strain::from(STRAIGHT))?
            .with_rest(curvature, self.twist.at(s)?)
    }
}

impl Varying {
    /// Flexural stiffnesses about d1 and d2, torsional stiffness about d3; unshearable, inextensible.
    ///
    /// # Errors
    /// A constant or a node of a table that is not finite and > 0.
    pub fn diagonal(bending: [Along; 2], torsion: Along) -> Result<Self> {
        let [first, second] = bending;
        Ok(Self::of(Entries {
            bending: [
                first.positive("bending[0]")?,
                second.positive("bending[1]")?,
            ],
            torsion: torsion.positive("torsion")?,
            shear: None,
            axial: None,
            curvature: [0.0.into(), 0.0.into()],
            twist: 0.0.into(),
        }))
    }

    /// Any law of s. It is taken to be smooth between breaks ([`Varying::with_breaks`]).
    pub fn by(law: impl Fn(f64) -> Result<Linear> + Send + Sync + 'static) -> Self {
        Self {
            source: Source::Function(Arc::new(law)),
            breaks: Vec::new(),
        }
    }

    /// With shear stiffnesses along d1 and d2.
    ///
    /// # Errors
    /// As [`Varying::diagonal`]; a law given as a function of s, which has its own.
    pub fn with_shear(self, shear: [Along; 2]) -> Result<Self> {
        let [first, second] = shear;
        let shear = [first.positive("shear[0]")?, second.positive("shear[1]")?];
        self.edited("shear", |entries| entries.shear = Some(shear))
    }

    /// With an axial stiffness.
    ///
    /// # Errors
    /// As [`Varying::with_shear`].
    pub fn with_axial(self, axial: Along) -> Result<Self> {
        let axial = axial.positive("axial")?;
        self.edited("axial", |entries| entries.axial = Some(axial))
    }

    /// With intrinsic curvatures u1, u2 and an intrinsic twist u3.
    ///
    /// # Errors
    /// A law given as a function of s, which has its own.
    pub fn with_rest(self, curvature: [Along; 2], twist: Along) -> Result<Self> {
        self.edited("rest", |entries| {
            entries.curvature = curvature;
            entries.twist = twist;
        })
    }

    /// With further places where the law is not smooth in s.
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
    /// s outside a table; a law that is not positive definite there.
    pub fn at(&self, s: f64) -> Result<Linear> {
        match &self.source {
            Source::Entries(entries) => entries.at(s),
            Source::Function(law) => law(s),
        }
        .map_err(|e| e.context(format!("the section at s = {s}")))
    }

    fn of(entries: Entries) -> Self {
        let mut law = Self {
            breaks: Vec::new(),
            source: Source::Entries(Box::new(entries)),
        };
        law.gather_breaks();
        law
    }

    fn edited(mut self, what: &str, edit: impl FnOnce(&mut Entries)) -> Result<Self> {
        match &mut self.source {
            Source::Entries(entries) => edit(entries),
            Source::Function(_) => {
                return Err(Error::domain(format!(
                    "{what} cannot be set on a law given as a function of s: set it in the function"
                )));
            }
        }
        self.gather_breaks();
        Ok(self)
    }

    fn gather_breaks(&mut self) {
        if let Source::Entries(entries) = &self.source {
            let nodes = entries.all().flat_map(Along::breaks).map(|node| node.0);
            self.breaks.extend(nodes);
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
            Source::Entries(entries) => shown.field("entries", entries),
            Source::Function(_) => shown.field("law", &"a function of s"),
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

    /// What is rigid at the clamp is rigid all along.
    fn rigid(&self) -> [bool; 3] {
        self.at(0.0).map_or([false; 3], |law| law.is_rigid())
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        self.at(s)?.inverse(s, w)
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let uniform = self.is_uniform().then(|| self.at(0.0).ok()).flatten()?;
        uniform.uniform_linear()
    }

    /// True if every entry is a constant.
    fn is_uniform(&self) -> bool {
        match &self.source {
            Source::Entries(entries) => entries.all().all(Along::is_constant),
            Source::Function(_) => false,
        }
    }

    /// The interior nodes of the tables, and the places the user named.
    fn breaks(&self) -> Vec<f64> {
        self.breaks.clone()
    }

    fn unloaded(&self, s: f64) -> Result<Strain> {
        Ok(*self.at(s)?.rest())
    }

    /// Exact for entries (they are diagonal); false for a function of s.
    fn planar_about(&self) -> [bool; 2] {
        let Source::Entries(entries) = &self.source else {
            return [false; 2];
        };
        let untwisted = entries.twist.vanishes();
        std::array::from_fn(|axis| untwisted && entries.curvature[1 - axis].vanishes())
    }
}
