//! Spring and dashpot equivalent to the rod: AMV (6.3).

use super::balance::{ReducedState, Slots, stored};
use super::{Reduction, ReductionKind};
use nalgebra::{Complex, DMatrix, DVector, Matrix6};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::math::small_sort::{sort_eigenvalues, sort_few};
use snaprod_systems::section::Strain;
use std::fmt;

/// Spring and dashpot in the place of the rod, for small motions about a state.
///
/// Matrices have a row and a column for each strain that moves; a force or couple on the body is minus
/// stiffness dq + dashpot dq_t + the branches.
#[derive(Debug, Clone, PartialEq)]
pub struct Equivalent {
    /// The kind of motion.
    pub kind: ReductionKind,
    /// The strains that move, as places in (u1, .. v3).
    pub moving: Vec<usize>,
    /// dn/dr at fixed rates, with relaxed branches.
    pub stiffness: DMatrix<f64>,
    /// dn/dr_t.
    pub dashpot: DMatrix<f64>,
    /// Modulus and relaxation time of each Maxwell branch: a spring in series with a dashpot.
    pub branches: Vec<(DMatrix<f64>, f64)>,
    /// The body's inertia against the strains.
    pub mass: DMatrix<f64>,
    /// The body's own drag.
    pub drag: DMatrix<f64>,
    /// Modes without damping, by frequency.
    pub modes: Vec<EquivalentMode>,
    /// Eigenvalues of the motion with dashpot, drag and branches, by imaginary and real part.
    pub eigenvalues: Vec<Complex<f64>>,
}

/// A mode of mass and stiffness (their symmetric parts).
#[derive(Debug, Clone, PartialEq)]
pub struct EquivalentMode {
    /// In radians per unit of time; 0 where the stiffness is not positive.
    pub natural_frequency: f64,
    /// Share of critical damping by dashpot and drag, shape.C shape/(2 frequency); branches are left out.
    pub damping_ratio: f64,
    /// Normalised: shape.M shape = 1.
    pub shape: DVector<f64>,
}

/// q'' = -inverse_mass (stiffness q + dashpot q' + sum modulus (q - z)) + slowing q', z' = (q - z)/time.
pub(super) struct LinearisedReduction {
    stiffness: DMatrix<f64>,
    dashpot: DMatrix<f64>,
    branches: Vec<(DMatrix<f64>, f64)>,
    inverse_mass: DMatrix<f64>,
    slowing: DMatrix<f64>,
}

impl Reduction {
    /// The equivalent spring and dashpot about the unloaded rod at rest.
    ///
    /// # Errors
    /// Laws that cannot be evaluated there.
    pub fn equivalent(&self) -> Result<Equivalent> {
        let rest = self.section.elastic.unloaded(0.0)?;
        let mut at = self.start.clone();
        at.rate = Strain::zeros();
        for k in self.slots.iter() {
            at.strain[k] = rest[k];
        }
        self.linearised(&at)?.equivalent(self)
    }

    /// The motion linearised at a state.
    pub(super) fn linearised(&self, at: &ReducedState) -> Result<LinearisedReduction> {
        let section = &self.section;
        let elastic = stored(section, &at.strain)?.tangent;
        let overstress = section.rate.overstress(0.0, &at.strain, &at.rate)?;
        let rate = section.rate.rate(0.0, &at.strain, &overstress)?;
        // Rigid strains have no derivative of the rate: 1 stands in its place.
        let rigid = section.rate.rigid();
        let mut fluidity = rate.by_overstress;
        for k in (0..6).filter(|k| rigid[*k]) {
            fluidity[(k, k)] = 1.0;
        }
        let viscosity = fluidity
            .try_inverse()
            .ok_or_else(|| Error::ill_conditioned("the rates do not determine the overstress"))?;

        let pose = Self::pose(&at.strain);
        let (mobility, by_velocity) = self.linear_body(at, &pose);
        let inverse_mass = self.without_reactions(&mobility, &mobility)?;
        let slowing = self.without_reactions(&mobility, &by_velocity)?;
        let part = |a: &Matrix6<f64>| part(&self.slots, a);
        Ok(LinearisedReduction {
            stiffness: part(&(elastic - viscosity * rate.by_strain)),
            dashpot: part(&viscosity),
            branches: section
                .branches
                .iter()
                .map(|branch| (part(&branch.modulus), branch.time))
                .collect(),
            inverse_mass,
            slowing,
        })
    }

    /// The moving part of `derivative`, of the acceleration, with reactions that hold the rigid components.
    fn without_reactions(
        &self,
        mobility: &Matrix6<f64>,
        derivative: &Matrix6<f64>,
    ) -> Result<DMatrix<f64>> {
        let rigid = self.section.rate.rigid();
        let held: Vec<usize> = (0..6)
            .filter(|k| rigid[*k] && mobility[(*k, *k)] > 0.0)
            .collect();
        let moving = self.moving();
        let block = |a: &Matrix6<f64>, rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| a[(rows[i], columns[j])])
        };
        let plain = block(derivative, &moving, &moving);
        if held.is_empty() {
            return Ok(plain);
        }
        let reactions = block(mobility, &held, &held)
            .lu()
            .solve(&block(derivative, &held, &moving))
            .ok_or_else(|| Error::ill_conditioned("the mass matrix of the body is singular"))?;
        Ok(plain - block(mobility, &moving, &held) * reactions)
    }
}

fn part(slots: &Slots, a: &Matrix6<f64>) -> DMatrix<f64> {
    let places: Vec<usize> = slots.iter().collect();
    DMatrix::from_fn(slots.len(), slots.len(), |i, j| a[(places[i], places[j])])
}

fn symmetric(a: &DMatrix<f64>) -> DMatrix<f64> {
    (a + a.transpose()) * 0.5
}

/// Undamped modes: K x = omega^2 M x.
fn modes(
    mass: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
    damping: &DMatrix<f64>,
) -> Result<Vec<EquivalentMode>> {
    let indefinite = || Error::ill_conditioned("the mass of the body is not positive definite");
    let root = mass.clone().cholesky().ok_or_else(indefinite)?.l();
    let inverse = root.try_inverse().ok_or_else(indefinite)?;
    let eigen = symmetric(&(&inverse * stiffness * inverse.transpose())).symmetric_eigen();
    let mut modes: Vec<EquivalentMode> = (0..mass.nrows())
        .map(|i| {
            let shape = inverse.transpose() * eigen.eigenvectors.column(i);
            let natural_frequency = eigen.eigenvalues[i].max(0.0).sqrt();
            EquivalentMode {
                natural_frequency,
                damping_ratio: shape.dot(&(damping * &shape)) / (2.0 * natural_frequency),
                shape,
            }
        })
        .collect();
    sort_few(&mut modes, |mode| mode.natural_frequency);
    Ok(modes)
}

impl LinearisedReduction {
    /// The matrix of the first-order system in (q, q', z of each branch).
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        let (k, blocks) = (self.stiffness.nrows(), 2 + self.branches.len());
        let mut matrix = DMatrix::zeros(blocks * k, blocks * k);
        let identity = DMatrix::identity(k, k);
        let moduli = self.branches.iter().map(|(modulus, _)| modulus);
        let whole = moduli.fold(self.stiffness.clone(), |sum, modulus| sum + modulus);
        let mut place = |i: usize, j: usize, block: DMatrix<f64>| {
            matrix.view_mut((i * k, j * k), (k, k)).copy_from(&block);
        };
        place(0, 1, identity.clone());
        place(1, 0, -&self.inverse_mass * whole);
        place(1, 1, &self.slowing - &self.inverse_mass * &self.dashpot);
        for (b, (modulus, time)) in self.branches.iter().enumerate() {
            place(1, 2 + b, &self.inverse_mass * modulus);
            place(2 + b, 0, &identity / *time);
            place(2 + b, 2 + b, -&identity / *time);
        }
        matrix
    }

    fn equivalent(self, of: &Reduction) -> Result<Equivalent> {
        let matrix = self.matrix();
        // With entries that are not finite the search for eigenvalues would not end.
        if !matrix.iter().all(|x| x.is_finite()) {
            return Err(Error::domain("stiffness and dashpot are not finite here"));
        }
        let mut eigenvalues: Vec<Complex<f64>> =
            matrix.complex_eigenvalues().iter().copied().collect();
        sort_eigenvalues(&mut eigenvalues);
        let mass = self
            .inverse_mass
            .try_inverse()
            .ok_or_else(|| Error::ill_conditioned("the body has no inertia in this motion"))?;
        let mass = symmetric(&mass);
        let drag = -&mass * self.slowing;
        let damping = &self.dashpot + &drag;
        Ok(Equivalent {
            kind: of.kind,
            moving: of.moving(),
            modes: modes(&mass, &symmetric(&self.stiffness), &damping)?,
            stiffness: self.stiffness,
            dashpot: self.dashpot,
            branches: self.branches,
            mass,
            drag,
            eigenvalues,
        })
    }
}

impl fmt::Display for Equivalent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = ["u1", "u2", "u3", "v1", "v2", "v3"];
        let moving: Vec<&str> = self.moving.iter().map(|k| names[*k]).collect();
        writeln!(f, "{} motion in {}", self.kind, moving.join(", "))?;
        let rows = |a: &DMatrix<f64>| -> String {
            let rows: Vec<String> = a
                .row_iter()
                .map(|row| {
                    let entries: Vec<String> = row.iter().map(f64::to_string).collect();
                    entries.join(" ")
                })
                .collect();
            rows.join("; ")
        };
        writeln!(f, "stiffness {}", rows(&self.stiffness))?;
        writeln!(f, "dashpot {}", rows(&self.dashpot))?;
        for (modulus, time) in &self.branches {
            writeln!(f, "branch {}, relaxing in {time}", rows(modulus))?;
        }
        writeln!(f, "mass {}", rows(&self.mass))?;
        for mode in &self.modes {
            writeln!(
                f,
                "natural frequency {} rad per unit of time, damping ratio {}",
                mode.natural_frequency, mode.damping_ratio
            )?;
        }
        Ok(())
    }
}
