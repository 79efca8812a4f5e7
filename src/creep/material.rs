//! A viscoelastic section without dimensions, seen through those of its strains that can change.

use super::kinematics::Local;
use crate::error::{Error, Result};
use crate::section::rate::Viscoelastic;
use crate::section::{Strain, Units};
use nalgebra::{Matrix6, SMatrix, Vector6};

/// A viscoelastic section law without dimensions, reduced to `M` strains that can change.
#[derive(Debug, Clone)]
pub struct Material<const M: usize> {
    law: Viscoelastic,
    active: [usize; M],
    units: Units,
    /// Strains without load at the clamp; the values of the inactive ones hold all along the rod.
    rest: Strain,
    /// Of linear laws that are the same all along.
    hoisted: Option<Hoisted<M>>,
    branches: Vec<Branch<M>>,
}

#[derive(Debug, Clone)]
struct Hoisted<const M: usize> {
    stiffness: SMatrix<f64, M, M>,
    rest: Local<M>,
    fluidity: SMatrix<f64, M, M>,
}

/// A Maxwell branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branch<const M: usize> {
    /// Its modulus.
    pub modulus: SMatrix<f64, M, M>,
    /// Its relaxation time.
    pub time: f64,
}

/// Energy and resultants of the stored energy, without the Maxwell branches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored<const M: usize> {
    /// W.
    pub energy: f64,
    /// dW/de.
    pub resultants: Local<M>,
}

/// Rates under an overstress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Creep<const M: usize> {
    /// e_t.
    pub rate: Local<M>,
    /// d e_t/d(overstress).
    pub fluidity: SMatrix<f64, M, M>,
    /// d e_t/d e at fixed overstress.
    pub by_strain: SMatrix<f64, M, M>,
}

impl<const M: usize> Material<M> {
    /// The law `law` in `units`, for the strains `active` (places among u1 .. v3, in growing order).
    ///
    /// # Errors
    /// An active strain that the law holds rigid; a law that has no unloaded state.
    pub fn new(law: Viscoelastic, units: Units, active: [usize; M]) -> Result<Self> {
        let rigid = law.rate.rigid();
        if let Some(i) = active.iter().find(|i| rigid[**i]) {
            return Err(Error::domain(format!(
                "the strain number {i} of (u1, u2, u3, v1, v2, v3) is held rigid and cannot be an active one"
            )));
        }
        let mut material = Self {
            rest: law.elastic.unloaded(0.0)?,
            active,
            units,
            hoisted: None,
            branches: Vec::new(),
            law,
        };
        material.branches = material
            .law
            .branches
            .iter()
            .map(|branch| Branch {
                modulus: material.stiffness_in(&branch.modulus),
                time: branch.time / units.time,
            })
            .collect();
        if material.law.elastic.uniform_linear().is_some()
            && let Some(fluidity) = material.law.rate.uniform_fluidity()
        {
            material.hoisted = Some(Hoisted {
                stiffness: material
                    .stiffness_in(&material.law.elastic.free(0.0, &material.rest)?.tangent),
                rest: material.inward(&material.rest),
                fluidity: material.fluidity_in(&fluidity),
            });
        }
        Ok(material)
    }

    /// Places of the active strains among u1 .. v3.
    pub fn active(&self) -> &[usize; M] {
        &self.active
    }

    /// The law in the user's units.
    pub fn law(&self) -> &Viscoelastic {
        &self.law
    }

    /// The Maxwell branches.
    pub fn branches(&self) -> &[Branch<M>] {
        &self.branches
    }

    /// Where the law is not smooth, in (0, 1).
    pub fn breaks(&self) -> Vec<f64> {
        let scaled = self.law.breaks().into_iter().map(|s| s / self.units.length);
        scaled.filter(|s| *s > 1e-12 && *s < 1.0 - 1e-12).collect()
    }

    /// True if the rates are proportional to the overstress.
    pub fn is_linear(&self) -> bool {
        self.law.rate.is_linear()
    }

    /// True if stiffness and fluidity are the same everywhere and always.
    pub fn is_constant(&self) -> bool {
        self.hoisted.is_some()
    }

    /// The active strains without load.
    ///
    /// # Errors
    /// As the law's.
    pub fn unloaded(&self, s: f64) -> Result<Local<M>> {
        Ok(self.inward(&self.law.elastic.unloaded(s * self.units.length)?))
    }

    /// Length of a strain's unit: L for u, 1 for v.
    fn span(&self, i: usize) -> f64 {
        if i < 3 { self.units.length } else { 1.0 }
    }

    /// Active strains, without dimensions.
    pub fn inward(&self, e: &Strain) -> Local<M> {
        Local::from_fn(|a, _| e[self.active[a]] * self.span(self.active[a]))
    }

    /// All strains in the user's units.
    pub fn outward(&self, e: &Local<M>) -> Strain {
        let mut all = self.rest;
        for (a, &i) in self.active.iter().enumerate() {
            all[i] = e[a] / self.span(i);
        }
        all
    }

    fn stiffness_in(&self, k: &Matrix6<f64>) -> SMatrix<f64, M, M> {
        let unit = self.units.length * self.units.length / self.units.stiffness;
        SMatrix::from_fn(|a, b| {
            let (i, j) = (self.active[a], self.active[b]);
            k[(i, j)] * unit / self.span(i) / self.span(j)
        })
    }

    fn fluidity_in(&self, c: &Matrix6<f64>) -> SMatrix<f64, M, M> {
        let unit = self.units.time * self.units.stiffness / (self.units.length * self.units.length);
        SMatrix::from_fn(|a, b| {
            let (i, j) = (self.active[a], self.active[b]);
            c[(i, j)] * unit * self.span(i) * self.span(j)
        })
    }

    /// Stored energy and its resultants at s in [0, 1]; None outside the law's domain.
    #[inline]
    pub fn stored(&self, s: f64, e: &Local<M>) -> Option<Stored<M>> {
        if let Some(h) = &self.hoisted {
            let deviation = e - h.rest;
            let resultants = h.stiffness * deviation;
            return Some(Stored {
                energy: 0.5 * deviation.dot(&resultants),
                resultants,
            });
        }
        let unit = self.units.length * self.units.length / self.units.stiffness;
        let free = self
            .law
            .elastic
            .free(s * self.units.length, &self.outward(e))
            .ok()?;
        Some(Stored {
            energy: free.energy * unit,
            resultants: Local::from_fn(|a, _| {
                let i = self.active[a];
                free.resultants[i] * unit / self.span(i)
            }),
        })
    }

    /// d^2W/de^2.
    pub fn tangent(&self, s: f64, e: &Local<M>) -> Option<SMatrix<f64, M, M>> {
        if let Some(h) = &self.hoisted {
            return Some(h.stiffness);
        }
        let free = self
            .law
            .elastic
            .free(s * self.units.length, &self.outward(e))
            .ok()?;
        Some(self.stiffness_in(&free.tangent))
    }

    /// The rates under an overstress.
    #[inline]
    pub fn creep(&self, s: f64, e: &Local<M>, overstress: &Local<M>) -> Option<Creep<M>> {
        if let Some(h) = &self.hoisted {
            return Some(Creep {
                rate: h.fluidity * overstress,
                fluidity: h.fluidity,
                by_strain: SMatrix::zeros(),
            });
        }
        let unit = self.units.length * self.units.length / self.units.stiffness;
        let mut local = Vector6::zeros();
        for (a, &i) in self.active.iter().enumerate() {
            local[i] = overstress[a] / unit * self.span(i);
        }
        let rate = self
            .law
            .rate
            .rate(s * self.units.length, &self.outward(e), &local)
            .ok()?;
        let time = self.units.time;
        Some(Creep {
            rate: Local::from_fn(|a, _| {
                let i = self.active[a];
                rate.rate[i] * time * self.span(i)
            }),
            fluidity: self.fluidity_in(&rate.by_overstress),
            by_strain: SMatrix::from_fn(|a, b| {
                let (i, j) = (self.active[a], self.active[b]);
                rate.by_strain[(i, j)] * time * self.span(i) / self.span(j)
            }),
        })
    }
}
