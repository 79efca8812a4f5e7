//! Spring and dashpot exactly equivalent to some rods in space, in the units of the scene.

use crate::error::{Quantity, Result};
use crate::motion::reduction::Reduction;
use crate::scene::{Scales, StrainName};
use nalgebra::DMatrix;
use serde::Serialize;

/// Spring and dashpot exactly equivalent to a rod, per displacement of the end, and per angle for u3: AMV (6.3).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spring {
    /// The kind of motion: longitudinal, twisting or shearing.
    pub kind: String,
    /// The strains that move.
    pub moving: Vec<&'static str>,
    /// True if symmetry makes every such motion exact; false if only the given motion is.
    pub by_symmetry: bool,
    /// Stiffness, a row for each strain that moves.
    pub stiffness: Vec<Vec<f64>>,
    /// Dashpot.
    pub dashpot: Vec<Vec<f64>>,
    /// Maxwell branches.
    pub branches: Vec<SpringBranch>,
    /// The body's inertia against the strains.
    pub mass: Vec<Vec<f64>>,
    /// The body's own drag.
    pub drag: Vec<Vec<f64>>,
    /// Modes without damping, by frequency.
    pub modes: Vec<SpringMode>,
}

/// A spring in series with a dashpot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpringBranch {
    /// Stiffness of the spring, a row for each moving strain.
    pub stiffness: Vec<Vec<f64>>,
    /// Relaxation time.
    pub time: f64,
}

/// A mode of mass and spring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpringMode {
    /// In radians per unit of time.
    pub natural_frequency: f64,
    /// Share of critical damping by dashpot and drag.
    pub damping_ratio: f64,
}

impl Spring {
    /// Equivalent spring and dashpot of `reduction`; `k` are the scales of its units.
    ///
    /// # Errors
    /// Laws that cannot be evaluated on the unloaded rod.
    pub(super) fn new(reduction: &Reduction, k: &Scales) -> Result<Self> {
        let of = reduction.equivalent()?;
        let time = k.unit(Quantity::Time);
        let moved =
            |a: usize| k.unit([Quantity::Ratio, Quantity::Length][usize::from(of.moving[a] >= 3)]);
        // Entries are energies over displacements and angles, times a power of time.
        let matrix = |matrix: &DMatrix<f64>, time: f64| -> Vec<Vec<f64>> {
            let energy = |a, b| k.outward(Quantity::Couple, matrix[(a, b)]);
            let entry = |a, b| energy(a, b) * time / moved(a) / moved(b);
            (0..matrix.nrows())
                .map(|a| (0..matrix.ncols()).map(|b| entry(a, b)).collect())
                .collect()
        };
        let branches = of
            .branches
            .iter()
            .map(|(modulus, relaxation)| SpringBranch {
                stiffness: matrix(modulus, 1.0),
                time: k.outward(Quantity::Time, *relaxation),
            });
        let modes = of.modes.iter().map(|mode| SpringMode {
            natural_frequency: k.outward(Quantity::Rate, mode.natural_frequency),
            damping_ratio: mode.damping_ratio,
        });
        let names = of.moving.iter().map(|i| StrainName::ALL[*i].as_str());
        Ok(Self {
            kind: of.kind.to_string(),
            moving: names.collect(),
            by_symmetry: reduction.is_identical(),
            stiffness: matrix(&of.stiffness, 1.0),
            dashpot: matrix(&of.dashpot, time),
            branches: branches.collect(),
            mass: matrix(&of.mass, time * time),
            drag: matrix(&of.drag, time),
            modes: modes.collect(),
        })
    }

    /// True for a strain of rotation (u): the spring acts on an angle.
    pub fn is_angle(name: &str) -> bool {
        name.starts_with('u')
    }
}
