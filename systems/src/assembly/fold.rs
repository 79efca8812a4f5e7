//! Normal form of a fold on a branch of an assembly (theory 2.8).
//!
//! The imbalance at a distance a along the critical direction z is A (p - p_f) + B a^2. The equations of balance are
//! forces and couples on the bodies, and the gaps of the rods are constraints. Where l . F_x = 0, l . F is therefore
//! the power of the imbalance against the twists that l has in the place of the bodies. Under loads with a potential
//! these are z's own, which gives l its length.

use super::branch::AssemblyFamily;
use super::configuration::Configuration;
use super::equations::UnknownScales;
use super::network::Assembly;
use crate::error::{Error, Result};
use crate::solve::normal_form::{normal_form, null_vectors};
use crate::solve::parametrised_problem::Family;
use nalgebra::DVector;

/// Relative difference up to which the twists of l and z count as equal.
const ALIKE: f64 = 1e-4;
/// Relative motion below which the bodies count as fixed.
const STANDING: f64 = 1e-9;

/// Normal form of a fold of an assembly.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyFold {
    /// A, an energy per unit of the parameter.
    pub drive: f64,
    /// B, an energy.
    pub bend: f64,
    /// y^T M z of the bodies.
    pub mass: f64,
    /// z, of length 1 in the rates of rotation vectors, of displacements over the mean length of the rods, and of
    /// charts.
    pub along: CriticalMotion,
    /// y, the twists of the power balance; None if y = z.
    pub against: Option<CriticalMotion>,
}

/// A small motion of an assembly about an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalMotion {
    now: Configuration,
    twists: DVector<f64>,
    charts: DVector<f64>,
    /// Amplitude at which the unknowns change by 1 + the norm of all charts.
    pub scale: f64,
}

impl CriticalMotion {
    /// Configuration displaced by the amplitude `far`.
    pub fn at(&self, assembly: &Assembly, far: f64) -> Configuration {
        let own = &self.twists * far;
        let mut now = Configuration {
            bodies: assembly.displaced(&self.now.bodies, own.as_slice()),
            charts: self.now.charts.clone(),
            spins: Vec::new(),
        };
        for (q, rate) in now.charts.iter_mut().zip(self.charts.as_slice().chunks(6)) {
            q.iter_mut()
                .zip(rate)
                .for_each(|(q, rate)| *q += far * rate);
        }
        now
    }
}

impl<P: Fn(f64) -> Result<Assembly>> AssemblyFamily<P> {
    /// Normal form of the fold at x and p.
    ///
    /// # Errors
    /// Those of the family; a point that is no fold; a fold at which no body moves.
    pub fn fold(&self, x: &DVector<f64>, p: f64) -> Result<AssemblyFold> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        let frame = UnknownScales::new(&assembly, now.bodies.iter().map(|place| place.pose));
        // The same unknowns, counted from the fold.
        let phase = assembly.free_phase(&frame, &now, self.tolerance())?;
        let family = self.counted_from(frame.clone(), phase);
        let x = family.unknowns(&now, p)?;
        let total = assembly.freedoms().1;
        let rods = x.len() - total;
        let jacobian = family.linearised(&x, p)?.jacobian;
        let [l, z] = null_vectors(&jacobian)?;
        let (moved, against) = (frame.twists(&assembly, &z), frame.against(&assembly, &l));
        if !(against.norm() > STANDING * l.norm() && moved.norm() > STANDING * z.norm()) {
            return Err(Error::domain("no body moves at this fold"));
        }
        let scale = moved.dot(&against) / against.norm_squared();
        let alike = (&against * scale - &moved).norm() <= ALIKE * moved.norm();
        let motion = |twists: DVector<f64>, charts: DVector<f64>| {
            let size: f64 = now.charts.iter().map(|q| q.norm_squared()).sum();
            let length = frame.rates(&assembly, &twists).norm_squared() + charts.norm_squared();
            CriticalMotion {
                scale: (1.0 + size.sqrt()) / length.sqrt(),
                now: now.clone(),
                twists,
                charts,
            }
        };
        let along = motion(moved.clone(), z.rows(total, rods).into_owned());
        let (l, against) = if alike {
            (l * scale, None)
        } else {
            // Scaled to the length of the twists of z; the rods follow the bodies.
            let unit = moved.norm() / against.norm();
            let twists = against * unit;
            let driven = jacobian.view((total, 0), (rods, total)) * frame.rates(&assembly, &twists);
            let by_charts = jacobian.view((total, total), (rods, rods)).into_owned();
            let charts = by_charts.lu().solve(&-driven).ok_or_else(|| {
                Error::ill_conditioned("a rod is at a fold of its own with its ends held")
            })?;
            (l * unit, Some(motion(twists, charts)))
        };
        let [drive, bend] = normal_form(&family, &x, p, &l, &z)?;
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance())?;
        let masses = assembly.mass_matrix(&now, &points)?;
        let y = against.as_ref().map_or(&along.twists, |y| &y.twists);
        Ok(AssemblyFold {
            drive,
            bend,
            mass: y.dot(&(masses * &along.twists)),
            along,
            against,
        })
    }
}
