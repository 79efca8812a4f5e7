//! Forces or impulses at several contacts at once, with Coulomb friction, by enumeration.
//!
//! One problem serves accelerations under forces and velocities under impulses. With B the inverse mass at the
//! contacts and w the motion without contact forces, u = w + B x obeys, at each contact,
//! ```text
//! x_n >= least,  u_n >= 0,  (x_n - least) u_n = 0,     |x_t| <= mu x_n,  u_t = 0  or  x_t = -mu x_n u_t/|u_t|.
//! ```

use super::impact::check_jamming;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector, Vector2, Vector3};

/// Most contacts of one problem; the number of cases grows like their number in the exponent.
pub const MAX_AT_ONCE: usize = 4;

/// One contact of a [`Complementarity`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneContact {
    /// Coefficient of friction.
    pub friction: f64,
    /// Least normal component, >= 0: 0, or a given impulse of restitution.
    pub least: f64,
    /// The direction of slip along the tangents if the surfaces slip already; None at rest.
    pub slips_along: Option<Vector2<f64>>,
}

/// Contact forces, or impulses, of several contacts; three components each: normal, two tangents.
#[derive(Debug, Clone, PartialEq)]
pub struct Complementarity {
    /// The inverse mass B, symmetric; singular where contacts depend on each other.
    pub inverse_mass: DMatrix<f64>,
    /// The motion w without contact forces.
    pub free: DVector<f64>,
    /// The contacts.
    pub contacts: Vec<OneContact>,
}

/// The state of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mode {
    /// The surfaces part.
    Open,
    /// No relative motion.
    Stick,
    /// Slip along this direction.
    Slip(Vector2<f64>),
}

/// The solution of a [`Complementarity`].
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSolution {
    /// Forces or impulses x.
    pub forces: DVector<f64>,
    /// The motion u = w + B x.
    pub motion: DVector<f64>,
    /// The state of each contact.
    pub modes: Vec<Mode>,
}

/// A case of the enumeration at one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Case {
    /// The normal component is at its least value.
    at_least: bool,
    /// True if the surfaces stick; false if the surfaces slip along this direction.
    slip: Option<Vector2<f64>>,
}

/// Relative tolerance of the inequalities.
const MARGIN: f64 = 1e-10;
/// Squares of singular values far below this part of their sum are zero: contacts that depend on each other.
const DEPENDENT: f64 = 1e-13;
/// Corrections of forces by what the equations leave over.
const CORRECTIONS: usize = 6;
/// Sweeps over contacts without a case, and the relative change of the forces at which the sweeps end.
const SWEEPS: usize = 20_000;
const SETTLED: f64 = 1e-14;
/// Iterations for unknown directions of slip.
const TURNS: usize = 100;

impl Complementarity {
    /// The solution. Of several, the one with most sticking contacts, and with the least forces where these are not
    /// determined.
    ///
    /// # Errors
    /// More than [`MAX_AT_ONCE`] contacts; a contact that may jam (Painleve); no solution.
    pub fn solve(&self) -> Result<ContactSolution> {
        let n = self.contacts.len();
        if n > MAX_AT_ONCE {
            return Err(Error::domain(format!(
                "{n} contacts of bodies act on each other at once; at most {MAX_AT_ONCE} are solved: use fewer or \
                 rounder bodies"
            )));
        }
        for (i, contact) in self.contacts.iter().enumerate() {
            let block = self.inverse_mass.fixed_view::<3, 3>(3 * i, 3 * i);
            check_jamming(&block.into_owned(), contact.friction)?;
        }
        // Digits of base 4: at least and slipping, the two bits of a case.
        for code in 0..1_u32 << (2 * n) {
            if let Some(solution) = self.try_cases(code) {
                return Ok(solution);
            }
        }
        if let Some(solution) = self.relax() {
            return Ok(solution);
        }
        Err(Error::no_convergence(
            "no contact forces fit these contacts and their friction (wedging): use less friction",
        ))
    }

    /// The forces and the motion if each contact is in the given state, whatever the inequalities say. Where contacts
    /// depend on each other their forces are the least, or share the friction in proportion to the normal forces.
    pub fn in_modes(&self, modes: &[Mode]) -> Option<ContactSolution> {
        let case = |mode: &Mode| match mode {
            Mode::Open => Case {
                at_least: true,
                slip: Some(Vector2::x()),
            },
            Mode::Stick => Case {
                at_least: false,
                slip: None,
            },
            Mode::Slip(d) => Case {
                at_least: false,
                slip: Some(*d),
            },
        };
        let cases: Vec<Case> = modes.iter().map(case).collect();
        let mut forces = self.linear(&cases, None)?;
        let beyond = |(i, contact): (usize, &OneContact)| {
            let (n, t) = (forces[3 * i], forces[3 * i + 1].hypot(forces[3 * i + 2]));
            cases[i].slip.is_none() && t > contact.friction * n
        };
        if cases.len() > 1 && self.contacts.iter().enumerate().any(beyond) {
            forces = self.linear(&cases, Some(&forces))?;
        }
        Some(ContactSolution {
            motion: &self.free + &self.inverse_mass * &forces,
            forces,
            modes: modes.to_vec(),
        })
    }

    /// The solution by projected Gauss-Seidel sweeps, where forces that depend on each other meet none of the cases of
    /// the enumeration. A settled sweep breaks no condition by more than its last change. None if the sweeps go on.
    fn relax(&self) -> Option<ContactSolution> {
        let b = &self.inverse_mass;
        let mut forces = DVector::zeros(self.free.len());
        for _ in 0..SWEEPS {
            let mut moved: f64 = 0.0;
            for (i, contact) in self.contacts.iter().enumerate() {
                let motion = |k: usize, forces: &DVector<f64>| {
                    self.free[3 * i + k] + b.row(3 * i + k).dot(&forces.transpose())
                };
                let before: Vector3<f64> = forces.fixed_rows::<3>(3 * i).into();
                let normal = before.x - motion(0, &forces) / b[(3 * i, 3 * i)];
                forces[3 * i] = normal.max(contact.least);
                let most = contact.friction * forces[3 * i];
                let block = b.fixed_view::<2, 2>(3 * i + 1, 3 * i + 1);
                let slip = Vector2::new(motion(1, &forces), motion(2, &forces));
                let friction = match contact.slips_along {
                    Some(along) => -along * most,
                    None => (before.yz() - slip / block.trace()).cap_magnitude(most),
                };
                forces.fixed_rows_mut::<2>(3 * i + 1).copy_from(&friction);
                moved = moved.max((forces.fixed_rows::<3>(3 * i) - before).norm());
            }
            if moved <= SETTLED * forces.amax() {
                let motion = &self.free + b * &forces;
                let case = |(i, contact): (usize, &OneContact)| {
                    let (x, u) = (forces.fixed_rows::<3>(3 * i), motion.fixed_rows::<3>(3 * i));
                    let slip = Vector2::new(u[1], u[2]).try_normalize(MARGIN * self.scale());
                    Case {
                        at_least: x[0] <= contact.least,
                        slip: contact.slips_along.or(slip),
                    }
                };
                let cases: Vec<Case> = self.contacts.iter().enumerate().map(case).collect();
                return self.admissible(&cases, forces);
            }
        }
        None
    }

    /// The solution in one set of cases; None if it breaks an inequality.
    fn try_cases(&self, code: u32) -> Option<ContactSolution> {
        let mut cases = Vec::with_capacity(self.contacts.len());
        let begun = self.motion_by_least();
        for (i, contact) in self.contacts.iter().enumerate() {
            let bits = code >> (2 * i) & 3;
            let (slips, at_least) = (bits & 1 == 1, bits & 2 == 2);
            // An open contact without any force has no friction: one case.
            let idle = at_least && contact.least == 0.0;
            let must_slip = contact.slips_along.is_some() || contact.friction == 0.0;
            if slips != (must_slip || idle) && (must_slip || idle) {
                return None;
            }
            let start = || {
                let along = Vector2::new(begun[3 * i + 1], begun[3 * i + 2]);
                along.try_normalize(0.0).unwrap_or_else(Vector2::x)
            };
            cases.push(Case {
                at_least,
                slip: slips.then(|| contact.slips_along.unwrap_or_else(start)),
            });
        }
        let mut forces = self.linear(&cases, None)?;
        for _ in 0..TURNS {
            let motion = &self.free + &self.inverse_mass * &forces;
            let mut moved: f64 = 0.0;
            for (i, case) in cases.iter_mut().enumerate() {
                let contact = &self.contacts[i];
                let turns = contact.slips_along.is_none() && contact.friction > 0.0;
                // Slip plus a part of the friction: at the solution all are parallel, and the iteration converges fast.
                let block = self.inverse_mass.fixed_view::<2, 2>(3 * i + 1, 3 * i + 1);
                let part = 0.5 * block.trace() * contact.friction * forces[3 * i];
                let along = Vector2::new(motion[3 * i + 1], motion[3 * i + 2])
                    + case.slip.unwrap_or_default() * part;
                if let Some(slip) = &mut case.slip
                    && turns
                    && forces[3 * i] > 0.0
                    && let Some(next) = along.try_normalize(MARGIN * self.scale())
                {
                    moved = moved.max((next - *slip).norm());
                    *slip = next;
                }
            }
            if moved < 1e-15 {
                break;
            }
            forces = self.linear(&cases, None)?;
        }
        self.admissible(&cases, forces).or_else(|| {
            // Friction shared by contacts in proportion to their normal forces.
            let first = self.linear(&cases, None)?;
            let shared = self.linear(&cases, Some(&first))?;
            self.admissible(&cases, shared)
        })
    }

    /// The motion with the least normal forces alone.
    fn motion_by_least(&self) -> DVector<f64> {
        let mut least = DVector::zeros(self.free.len());
        for (i, contact) in self.contacts.iter().enumerate() {
            least[3 * i] = contact.least;
        }
        &self.free + &self.inverse_mass * least
    }

    /// The size of the motion: without contact forces, or with the least normal forces alone.
    fn scale(&self) -> f64 {
        let sizes = self.free.amax().max(self.motion_by_least().amax());
        sizes.max(f64::MIN_POSITIVE)
    }

    /// The forces in these cases, without the inequalities. `shares`: forces whose normal components weigh the
    /// friction of contacts that depend on each other.
    fn linear(&self, cases: &[Case], shares: Option<&DVector<f64>>) -> Option<DVector<f64>> {
        let (b, size) = (&self.inverse_mass, self.free.len());
        // x = given + spread z, and the rows of u that vanish.
        let mut given = DVector::zeros(size);
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut rows = Vec::new();
        for (i, case) in cases.iter().enumerate() {
            let friction = self.contacts[i].friction;
            let mut along = DVector::zeros(size);
            along[3 * i] = 1.0;
            if let Some(d) = case.slip {
                along[3 * i + 1] = -friction * d.x;
                along[3 * i + 2] = -friction * d.y;
            }
            if case.at_least {
                given += &along * self.contacts[i].least;
            } else {
                columns.push(along);
                rows.push(3 * i);
            }
            if case.slip.is_none() {
                let weight = shares.map_or(1.0, |x| x[3 * i].abs().sqrt());
                for k in 1..3 {
                    let mut column = DVector::zeros(size);
                    column[3 * i + k] = weight;
                    columns.push(column);
                    rows.push(3 * i + k);
                }
            }
        }
        if columns.is_empty() {
            return Some(given);
        }
        let spread = DMatrix::from_columns(&columns);
        let moved = b * &spread;
        let missing = &self.free + b * &given;
        let matrix = DMatrix::from_fn(rows.len(), rows.len(), |i, j| moved[(rows[i], j)]);
        let target = DVector::from_fn(rows.len(), |i, _| -missing[rows[i]]);
        // One contact alone is never singular.
        if cases.len() == 1 {
            return Some(given + spread * matrix.lu().solve(&target)?);
        }
        // The least of all solutions, as the limit of regularised ones, is the sum of z = M^T (M M^T + eps)^-1 r with
        // r = target - M z. A singular value of rounding alone stays far below eps, and takes no part.
        let mut gram = &matrix * matrix.transpose();
        let small = DEPENDENT * gram.trace();
        (0..rows.len()).for_each(|i| gram[(i, i)] += small);
        let gram = gram.cholesky()?;
        let mut z = DVector::zeros(rows.len());
        for _ in 0..CORRECTIONS {
            z += matrix.tr_mul(&gram.solve(&(&target - &matrix * &z)));
        }
        let left = (&matrix * &z - &target).amax();
        if !(left <= MARGIN * self.scale()) {
            return None;
        }
        Some(given + spread * z)
    }

    /// The solution, if these forces obey all inequalities.
    fn admissible(&self, cases: &[Case], forces: DVector<f64>) -> Option<ContactSolution> {
        let motion = &self.free + &self.inverse_mass * &forces;
        let (force, velocity) = (MARGIN * forces.amax(), MARGIN * self.scale());
        let mut modes = Vec::with_capacity(cases.len());
        for (i, (case, contact)) in cases.iter().zip(&self.contacts).enumerate() {
            let (x, u) = (forces.fixed_rows::<3>(3 * i), motion.fixed_rows::<3>(3 * i));
            let slip = Vector2::new(u[1], u[2]);
            let pressed = x[0] >= contact.least - force;
            let apart = u[0] >= -velocity;
            let held = x[1].hypot(x[2]) <= contact.friction * x[0] + force;
            let fits = match case.slip {
                Some(d) if contact.slips_along.is_none() && contact.friction * x[0] > force => {
                    (slip - d * slip.dot(&d)).norm() <= velocity && slip.dot(&d) >= -velocity
                }
                _ => true,
            };
            if !(pressed && apart && held && fits) {
                return None;
            }
            modes.push(match case.slip {
                _ if case.at_least && contact.least == 0.0 => Mode::Open,
                None => Mode::Stick,
                Some(d) => Mode::Slip(d),
            });
        }
        Some(ContactSolution {
            forces,
            motion,
            modes,
        })
    }
}
