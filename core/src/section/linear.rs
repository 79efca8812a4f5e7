//! Linear laws: W = 1/2 (e - rest).K (e - rest), with strains possibly held rigid.

use super::{
    Compliance, Free, Inverse, Resultant, SectionLaw, Strain, StrainName, UniformLinear, six,
};
use crate::error::{Error, Result, check_finite};
use nalgebra::{Matrix6, Vector6};

/// The strains of a straight unstretched rod.
pub(super) const STRAIGHT: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Rounding of a strain e held rigid: largest accepted distance from the rest value, over 1 + |e|.
const HELD: f64 = 1e-13;

/// A linear law: w = K (e - rest), K diagonal or any symmetric positive definite matrix.
///
/// Components may be *rigid*: held at their rest values as constraints. Their rows and columns of the compliance are
/// zero, and the couples and forces conjugate to them are reactions. The rest of the compliance is the inverse of the
/// free block of K. A rod of [`Linear::diagonal`] is unshearable and inextensible until these stiffnesses are given.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::{Linear, SectionLaw, Resultant};
/// let law = Linear::diagonal([1.0, 1.5], 0.7)?
///     .with_shear([100.0, 120.0])?
///     .with_rest([0.2, 0.0], 0.0)?;
/// let found = law.inverse(0.0, &Resultant::new(1.0, 3.0, 0.0, 10.0, 0.0, -50.0))?;
/// assert_eq!(found.strain.as_slice(), [1.2, 2.0, 0.0, 0.1, 0.0, 1.0]);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// K; entries of rigid components are kept if given, else zero.
    stiffness: Matrix6<f64>,
    rigid: [bool; 6],
    rest: Strain,
    compliance: Compliance,
}

impl Linear {
    /// K = diag(bending, torsion): flexural stiffnesses about d1 and d2, torsional stiffness about d3; unshearable,
    /// inextensible.
    ///
    /// # Errors
    /// A stiffness that is not finite and > 0, or so small that its inverse overflows.
    pub fn diagonal(bending: [f64; 2], torsion: f64) -> Result<Self> {
        let entries = Vector6::new(bending[0], bending[1], torsion, 0.0, 0.0, 0.0);
        Self::of(
            Matrix6::from_diagonal(&entries),
            six([true; 3]),
            Strain::from(STRAIGHT),
        )
    }

    /// Any stiffness matrix K, rows and columns in the order u1 u2 u3 v1 v2 v3; nothing is rigid.
    ///
    /// # Errors
    /// Entries that are not finite, a K that is not symmetric to rounding (it is then made symmetric) or not positive
    /// definite.
    pub fn full(stiffness: Matrix6<f64>) -> Result<Self> {
        for row in 0..6 {
            for column in 0..row {
                let (lower, upper) = (stiffness[(row, column)], stiffness[(column, row)]);
                let size = lower.abs().max(upper.abs())
                    + (stiffness[(row, row)].abs().sqrt()
                        * stiffness[(column, column)].abs().sqrt());
                if lower.is_finite()
                    && upper.is_finite()
                    && !((lower - upper).abs() <= 32.0 * f64::EPSILON * size)
                {
                    return Err(Error::domain(format!(
                        "stiffness[{row}][{column}] = {lower} and stiffness[{column}][{row}] = {upper} \
                         must be equal: a stored energy has a symmetric stiffness"
                    )));
                }
            }
        }
        let symmetric = stiffness.map_with_location(|i, j, entry| {
            let other = stiffness[(j, i)];
            if entry == other {
                entry
            } else {
                0.5 * entry + 0.5 * other
            }
        });
        Self::of(symmetric, [false; 6], Strain::from(STRAIGHT))
    }

    /// With shear stiffnesses (against v1, v2), which are then no longer rigid.
    ///
    /// # Errors
    /// As [`Linear::diagonal`].
    pub fn with_shear(mut self, shear: [f64; 2]) -> Result<Self> {
        self.stiffness[(3, 3)] = shear[0];
        self.stiffness[(4, 4)] = shear[1];
        let mut rigid = self.rigid;
        (rigid[3], rigid[4]) = (false, false);
        Self::of(self.stiffness, rigid, self.rest)
    }

    /// With an axial stiffness (against v3 - 1), which is then no longer rigid.
    ///
    /// # Errors
    /// As [`Linear::diagonal`].
    pub fn with_axial(mut self, axial: f64) -> Result<Self> {
        self.stiffness[(5, 5)] = axial;
        let mut rigid = self.rigid;
        rigid[5] = false;
        Self::of(self.stiffness, rigid, self.rest)
    }

    /// Holds the marked components of v1, v2, v3 rigid; the others are unchanged.
    ///
    /// # Errors
    /// None for a law that could be built; the free block is inverted anew.
    pub fn rigid(self, marked: [bool; 3]) -> Result<Self> {
        self.holding(six(marked))
    }

    /// Holds the marked strains rigid; the others are unchanged.
    ///
    /// # Errors
    /// A law that holds all strains.
    pub fn holding(self, marked: [bool; 6]) -> Result<Self> {
        let rigid: [bool; 6] = std::array::from_fn(|k| self.rigid[k] || marked[k]);
        if rigid == [true; 6] {
            return Err(Error::domain(
                "a section that holds all strains rigid is no rod: leave a strain free",
            ));
        }
        Self::of(self.stiffness, rigid, self.rest)
    }

    /// With intrinsic curvatures u1, u2 and an intrinsic twist u3: the strains without load. The rest values of v
    /// are (0, 0, 1).
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn with_rest(mut self, curvature: [f64; 2], twist: f64) -> Result<Self> {
        for (name, value) in [
            ("rest curvature[0]", curvature[0]),
            ("rest curvature[1]", curvature[1]),
            ("rest twist", twist),
        ] {
            if !value.is_finite() {
                return Err(Error::domain(format!("{name} = {value} must be finite")));
            }
        }
        self.rest.x = curvature[0];
        self.rest.y = curvature[1];
        self.rest.z = twist;
        Ok(self)
    }

    /// This law with a stiffness `held` of flexure about the director other than `normal`, and of twist.
    pub(super) fn held_in_plane(mut self, normal: usize, held: f64) -> Result<Self> {
        for k in [1 - normal, 2] {
            self.stiffness[(k, k)] = held;
        }
        Self::of(self.stiffness, self.rigid, self.rest)
    }

    /// Stiffness K. Rows and columns of rigid components are meaningless.
    pub fn stiffness(&self) -> &Matrix6<f64> {
        &self.stiffness
    }

    /// Marks of the rigid strains.
    pub fn is_rigid(&self) -> [bool; 6] {
        self.rigid
    }

    /// The strains without load.
    pub fn rest(&self) -> &Strain {
        &self.rest
    }

    /// K^-1 of the free block, zero elsewhere.
    pub fn compliance(&self) -> &Compliance {
        &self.compliance
    }

    /// Checks the numbers and forms the inverse; every constructor ends here.
    pub(super) fn of(stiffness: Matrix6<f64>, rigid: [bool; 6], rest: Strain) -> Result<Self> {
        Ok(Self {
            compliance: compliance(&stiffness, rigid)?,
            stiffness,
            rigid,
            rest,
        })
    }

    /// e - rest, if the constraints hold.
    fn deviation(&self, e: &Strain) -> Result<Strain> {
        check_finite("the strains", e.as_slice())?;
        check_constraints(self.rigid, &self.rest, e)?;
        Ok(e - self.rest)
    }

    fn check_unconstrained(&self) -> Result<()> {
        check_unconstrained(self.rigid)
    }
}

/// Checks that the strains satisfy the constraints.
pub(super) fn check_constraints(rigid: [bool; 6], rest: &Strain, e: &Strain) -> Result<()> {
    for k in (0..6).filter(|k| rigid[*k]) {
        let (value, at) = (e[k], rest[k]);
        if !((value - at).abs() <= HELD * (1.0 + at.abs())) {
            return Err(Error::domain(format!(
                "the strain {} = {value} is held rigid at {at}",
                StrainName::ALL[k].as_str()
            )));
        }
    }
    Ok(())
}

/// Error if a strain is rigid: its resultant is then a reaction.
pub(super) fn check_unconstrained(rigid: [bool; 6]) -> Result<()> {
    match rigid.iter().position(|r| *r) {
        None => Ok(()),
        Some(k) => Err(Error::domain(format!(
            "{}{} is a reaction, it does not follow from the strains: {} is held rigid",
            ["m", "n"][k / 3],
            k % 3 + 1,
            StrainName::ALL[k].as_str()
        ))),
    }
}

/// The matrix with unit rows and columns at the rigid components.
pub(super) fn unit_at_rigid(stiffness: &Matrix6<f64>, rigid: [bool; 6]) -> Matrix6<f64> {
    let mut free = *stiffness;
    for k in (0..6).filter(|k| rigid[*k]) {
        free.row_mut(k).fill(0.0);
        free.column_mut(k).fill(0.0);
        free[(k, k)] = 1.0;
    }
    free
}

/// The inverse of the free block of a symmetric positive definite matrix, zero elsewhere.
fn compliance(stiffness: &Matrix6<f64>, rigid: [bool; 6]) -> Result<Compliance> {
    let free = unit_at_rigid(stiffness, rigid);
    for row in 0..6 {
        for column in 0..6 {
            let entry = free[(row, column)];
            if !(entry.is_finite() && (row != column || entry > 0.0)) {
                let allowed = if row == column {
                    "finite and > 0"
                } else {
                    "finite"
                };
                return Err(Error::domain(format!(
                    "{} = {entry} must be {allowed}",
                    entry_name(row, column)
                )));
            }
        }
    }
    let diagonal = free.diagonal();
    let mut inverse = if free == Matrix6::from_diagonal(&diagonal) {
        Compliance::Diagonal(diagonal.map(f64::recip))
    } else {
        Compliance::Full(inverse_of_full(&free)?)
    };
    for k in (0..6).filter(|k| rigid[*k]) {
        match &mut inverse {
            Compliance::Diagonal(entries) => entries[k] = 0.0,
            Compliance::Full(matrix) => matrix[(k, k)] = 0.0,
        }
    }
    let bounded = match &inverse {
        Compliance::Diagonal(entries) => entries.iter().all(|x| x.is_finite()),
        Compliance::Full(matrix) => matrix.iter().all(|x| x.is_finite()),
    };
    if !bounded {
        return Err(Error::domain(format!(
            "the stiffness is too small, its inverse overflows: its diagonal, by the strains, is {}",
            crate::error::named(&crate::error::STRAINS, diagonal.as_slice())
        )));
    }
    Ok(inverse)
}

fn entry_name(row: usize, column: usize) -> String {
    if row != column {
        return format!("stiffness[{row}][{column}]");
    }
    match row {
        0 | 1 => format!("the bending stiffness about d{}", row + 1),
        2 => "the torsional stiffness".into(),
        3 | 4 => format!("the shear stiffness along d{}", row - 2),
        _ => "the axial stiffness".into(),
    }
}

/// Inverse, scaled to a unit diagonal: the criterion for singularity must not depend on units.
fn inverse_of_full(stiffness: &Matrix6<f64>) -> Result<Matrix6<f64>> {
    let roots = stiffness.diagonal().map(f64::sqrt);
    let scaled = stiffness.map_with_location(|i, j, entry| {
        if i == j {
            1.0
        } else {
            entry / roots[i] / roots[j]
        }
    });
    for row in 0..6 {
        for column in 0..row {
            if !(scaled[(row, column)].abs() < 1.0) {
                return Err(Error::domain(format!(
                    "the stiffness is not positive definite: the minor of {} and {} is not, \
                     stiffness[{row}][{column}] = {} against the diagonal entries {} and {}",
                    StrainName::ALL[column].as_str(),
                    StrainName::ALL[row].as_str(),
                    stiffness[(row, column)],
                    stiffness[(column, column)],
                    stiffness[(row, row)]
                )));
            }
        }
    }
    let smallest = scaled.symmetric_eigenvalues().min();
    let singular = || {
        Error::domain(format!(
            "the stiffness is not positive definite: scaled to a unit diagonal \
             its smallest eigenvalue is {smallest:.3e}"
        ))
    };
    if !(smallest > 16.0 * f64::EPSILON) {
        return Err(singular());
    }
    let inverse = scaled.cholesky().ok_or_else(singular)?.inverse();
    // One step of Newton's iteration for inverses removes the error of the elimination.
    let inverse = inverse + inverse * (Matrix6::identity() - scaled * inverse);
    Ok(inverse
        .map_with_location(|i, j, entry| 0.5 * (entry + inverse[(j, i)]) / roots[i] / roots[j]))
}

impl SectionLaw for Linear {
    fn energy(&self, _s: f64, e: &Strain) -> Result<f64> {
        let mut deviation = self.deviation(e)?;
        for k in (0..6).filter(|k| self.rigid[*k]) {
            deviation[k] = 0.0;
        }
        Ok(0.5 * deviation.dot(&(self.stiffness * deviation)))
    }

    fn resultants(&self, _s: f64, e: &Strain) -> Result<Resultant> {
        self.check_unconstrained()?;
        Ok(self.stiffness * self.deviation(e)?)
    }

    fn tangent(&self, _s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        self.check_unconstrained()?;
        check_finite("the strains", e.as_slice())?;
        Ok(self.stiffness)
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let resultants = self.stiffness * self.deviation(e)?;
        Ok(Free::new(
            self.energy(s, e)?,
            resultants,
            self.stiffness,
            self.rigid,
        ))
    }

    fn rigid(&self) -> [bool; 6] {
        self.rigid
    }

    fn inverse(&self, _s: f64, w: &Resultant) -> Result<Inverse> {
        let deviation = &self.compliance * w;
        let energy = 0.5 * deviation.dot(w);
        if !energy.is_finite() {
            return Err(Error::domain(format!(
                "the resultants {} must be finite, and so must be their energy",
                crate::error::named(&crate::error::RESULTANTS, w.as_slice())
            )));
        }
        Ok(Inverse {
            strain: self.rest + deviation,
            energy,
            compliance: self.compliance,
        })
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        Some(UniformLinear {
            rest: self.rest,
            compliance: self.compliance,
        })
    }

    fn is_uniform(&self) -> bool {
        true
    }

    fn unloaded(&self, _s: f64) -> Result<Strain> {
        Ok(self.rest)
    }

    /// Exact: rest strains out of the plane and compliances that couple the two sets are zero.
    fn planar_about(&self) -> [bool; 2] {
        let matrix = self.compliance.matrix();
        std::array::from_fn(|axis| {
            let [inside, outside] = super::planar_strains(axis);
            outside
                .iter()
                .all(|i| self.rest[*i] == 0.0 && inside.iter().all(|j| matrix[(*i, *j)] == 0.0))
        })
    }
}
