//! A viscoelastic section law in the units of the rod, restricted to the strains that can change.

use super::kinematics::Local;
use super::loads_at_nodes::LoadsAtNodes;
use crate::error::{Error, Result};
use crate::math::small_matrices::{add_times, times};
use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use crate::section::rate::Viscoelastic;
use crate::section::{LawInTime, Strain};
use nalgebra::{Matrix6, SMatrix, Vector6};
use std::sync::Arc;

/// A viscoelastic section law in the units of the rod ([`Viscoelastic::law_in_units`]), reduced to `M` free strains.
#[derive(Debug, Clone)]
pub struct Material<const M: usize> {
    law: Viscoelastic,
    active: [usize; M],
    /// Unloaded strains at the clamp; the inactive ones keep these values all along the rod.
    rest: Strain,
    /// Stiffness, rest strains and fluidity of a uniform linear law, formed once.
    hoisted: Option<Constant<M>>,
    branches: Vec<MaxwellBranch<M>>,
    /// Dead load on the rod, in the frame of the clamp.
    load: Option<DistributedLoad>,
    /// Loads on the rod without a potential, their dead couples in the frame of the clamp.
    turning: Option<LoadsWithoutPotential>,
    /// The elastic law of every moment, where tensions or rest strains are histories in time.
    in_time: Option<Arc<LawInTime>>,
}

/// A uniform linear law without memory: e_t = fluidity (resultants - stiffness (e - rest)).
#[derive(Debug, Clone)]
pub struct Constant<const M: usize> {
    /// The stiffness.
    pub stiffness: SMatrix<f64, M, M>,
    /// Strains without load.
    pub rest: Local<M>,
    /// Strain rates by overstress.
    pub fluidity: SMatrix<f64, M, M>,
}

/// A Maxwell branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxwellBranch<const M: usize> {
    /// Modulus.
    pub modulus: SMatrix<f64, M, M>,
    /// Relaxation time.
    pub time: f64,
}

/// Energy and resultants of the stored energy, without the Maxwell branches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored<const M: usize> {
    /// Stored energy W per length.
    pub energy: f64,
    /// Elastic resultants dW/de.
    pub resultants: Local<M>,
}

/// Strain rates under an overstress, with derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Creep<const M: usize> {
    /// Strain rates e_t.
    pub rate: Local<M>,
    /// d e_t/d(overstress).
    pub fluidity: SMatrix<f64, M, M>,
    /// d e_t/d e at fixed overstress.
    pub by_strain: SMatrix<f64, M, M>,
}

impl<const M: usize> Material<M> {
    /// The law `law`, in the units of the rod, for the strains `active` (indices among u1 .. v3, in growing order).
    ///
    /// # Errors
    /// An active strain that the law holds rigid; a law that has no unloaded state.
    pub fn new(law: Viscoelastic, active: [usize; M]) -> Result<Self> {
        let rigid = law.rate.rigid();
        if let Some(i) = active.iter().find(|i| rigid[**i]) {
            return Err(Error::domain(format!(
                "the strain number {i} of (u1, u2, u3, v1, v2, v3) is held rigid and cannot be an active one"
            )));
        }
        let mut material = Self {
            rest: law.elastic.unloaded(0.0)?,
            active,
            hoisted: None,
            branches: Vec::new(),
            load: None,
            turning: None,
            in_time: None,
            law,
        };
        material.branches = material
            .law
            .branches
            .iter()
            .map(|branch| MaxwellBranch {
                modulus: material.among(&branch.modulus),
                time: branch.time,
            })
            .collect();
        if material.law.elastic.uniform_linear().is_some()
            && let Some(fluidity) = material.law.rate.uniform_fluidity()
        {
            material.hoisted = Some(Constant {
                stiffness: material.among(&material.law.elastic.free(0.0, &material.rest)?.tangent),
                rest: material.active_of(&material.rest),
                fluidity: material.among(&fluidity),
            });
        }
        Ok(material)
    }

    /// Indices of the active strains among u1 .. v3.
    pub fn active(&self) -> &[usize; M] {
        &self.active
    }

    /// The law.
    pub fn law(&self) -> &Viscoelastic {
        &self.law
    }

    /// The Maxwell branches.
    pub fn branches(&self) -> &[MaxwellBranch<M>] {
        &self.branches
    }

    /// Points in (0, 1) at which the law or the load is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.law.breaks();
        breaks.extend(self.load.iter().flat_map(DistributedLoad::breaks));
        breaks.extend(self.turning.iter().flat_map(LoadsWithoutPotential::breaks));
        breaks.retain(|s| *s > 1e-12 && *s < 1.0 - 1e-12);
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|a, b| *a - *b < 1e-12);
        breaks
    }

    /// Sets the dead load along the rod, in the frame of the clamp and the units of the rod.
    #[must_use]
    pub fn under(mut self, load: Option<DistributedLoad>) -> Self {
        self.load = load;
        self
    }

    /// Sets the loads along the rod that have no potential, in the frame of the clamp and the units of the rod. Loads
    /// at single places are left out: no node is there.
    #[must_use]
    pub fn turned_by(mut self, loads: Option<LoadsWithoutPotential>) -> Self {
        self.turning = loads;
        self
    }

    /// Loads at points in [0, 1]; None without a load.
    pub fn loads_at(&self, places: &[f64]) -> Option<LoadsAtNodes> {
        LoadsAtNodes::new(self.load.as_ref(), self.turning.as_ref(), places)
    }

    /// Lets the elastic law vary in time. The law given before is that at the time 0, in the same units.
    #[must_use]
    pub fn with_law_in_time(mut self, law: Option<LawInTime>) -> Self {
        if law.is_some() {
            self.hoisted = None;
        }
        self.in_time = law.map(Arc::new);
        self
    }

    /// True if the elastic law varies in time.
    pub fn varies_in_time(&self) -> bool {
        self.in_time.is_some()
    }

    /// First time after `t` at which the law does not vary smoothly.
    pub fn next_break(&self, t: f64) -> f64 {
        let in_time = self.in_time.as_ref();
        in_time.map_or(f64::INFINITY, |law| law.next_break(t))
    }

    /// The material with the law of the time `t`; None where it is not defined.
    pub fn seen_at(&self, t: f64) -> Option<Self> {
        let mut seen = self.clone();
        if let Some(in_time) = &self.in_time {
            seen.law.elastic = in_time.at(t).ok()?;
        }
        Some(seen)
    }

    /// Power per length at s of what changes the law in time, at fixed strains; None outside the law's domain.
    pub fn drive_power(&self, s: f64, e: &Local<M>) -> Option<f64> {
        if self.in_time.is_none() {
            return Some(0.0);
        }
        let (law, e) = (&self.law.elastic, self.all(e));
        let resultants = law.free(s, &e).ok()?.resultants;
        let rates = law.rates(s, &e, &resultants).ok()?;
        Some(rates.map_or(0.0, |rates| rates.power))
    }

    /// True if the rates are proportional to the overstress.
    pub fn is_linear(&self) -> bool {
        self.law.rate.is_linear()
    }

    /// The law, if uniform and linear without memory.
    pub fn constant(&self) -> Option<&Constant<M>> {
        self.hoisted.as_ref().filter(|_| self.branches.is_empty())
    }

    /// True if stiffness and fluidity are uniform and constant.
    pub fn is_constant(&self) -> bool {
        self.hoisted.is_some()
    }

    /// Unloaded values of the active strains.
    ///
    /// # Errors
    /// A law that has no unloaded state at s.
    pub fn unloaded(&self, s: f64) -> Result<Local<M>> {
        Ok(self.active_of(&self.law.elastic.unloaded(s)?))
    }

    /// Selects the active components of strains (or of resultants, or of rates).
    pub fn active_of(&self, e: &Strain) -> Local<M> {
        Local::from_fn(|a, _| e[self.active[a]])
    }

    /// All strains: the active ones as given, the others unloaded.
    pub fn all(&self, e: &Local<M>) -> Strain {
        let mut all = self.rest;
        for (a, &i) in self.active.iter().enumerate() {
            all[i] = e[a];
        }
        all
    }

    /// Rows and columns of the active strains.
    fn among(&self, k: &Matrix6<f64>) -> SMatrix<f64, M, M> {
        SMatrix::from_fn(|a, b| k[(self.active[a], self.active[b])])
    }

    /// Stored energy and elastic resultants at s in [0, 1]; None outside the law's domain.
    #[inline]
    pub fn stored(&self, s: f64, e: &Local<M>) -> Option<Stored<M>> {
        if let Some(h) = &self.hoisted {
            let deviation = e - h.rest;
            let resultants = times(&h.stiffness, &deviation);
            return Some(Stored {
                energy: 0.5 * deviation.dot(&resultants),
                resultants,
            });
        }
        let free = self.law.elastic.free(s, &self.all(e)).ok()?;
        Some(Stored {
            energy: free.energy,
            resultants: self.active_of(&free.resultants),
        })
    }

    /// The tangent stiffness d^2W/de^2 at s in [0, 1]; None outside the law's domain.
    pub fn tangent(&self, s: f64, e: &Local<M>) -> Option<SMatrix<f64, M, M>> {
        if let Some(h) = &self.hoisted {
            return Some(h.stiffness);
        }
        let free = self.law.elastic.free(s, &self.all(e)).ok()?;
        Some(self.among(&free.tangent))
    }

    /// Strain rates and overstress without energy and derivatives (see [`Self::stored`], [`Self::creep`]). `left` are
    /// the local resultants less the Maxwell branches' share; the stored energy takes the rest up to the overstress.
    #[inline(always)]
    pub fn flowing(&self, s: f64, e: &Local<M>, left: &Local<M>) -> Option<(Local<M>, Local<M>)> {
        let Some(h) = &self.hoisted else {
            let overstress = left - self.stored(s, e)?.resultants;
            return Some((self.creep(s, e, &overstress)?.rate, overstress));
        };
        let mut overstress = *left;
        add_times(&mut overstress, &h.stiffness, &(h.rest - e));
        Some((times(&h.fluidity, &overstress), overstress))
    }

    /// The strain rates under an overstress, with their derivatives; None outside the law's domain.
    #[inline]
    pub fn creep(&self, s: f64, e: &Local<M>, overstress: &Local<M>) -> Option<Creep<M>> {
        if let Some(h) = &self.hoisted {
            return Some(Creep {
                rate: times(&h.fluidity, overstress),
                fluidity: h.fluidity,
                by_strain: SMatrix::zeros(),
            });
        }
        let mut over = Vector6::zeros();
        for (a, &i) in self.active.iter().enumerate() {
            over[i] = overstress[a];
        }
        let found = self.law.rate.rate(s, &self.all(e), &over).ok()?;
        Some(Creep {
            rate: self.active_of(&found.rate),
            fluidity: self.among(&found.by_overstress),
            by_strain: self.among(&found.by_strain),
        })
    }
}
