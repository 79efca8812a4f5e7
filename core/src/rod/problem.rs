//! Problem of a rod with an end condition: held and loaded components, and the equations for the base wrench.

use super::distributed_load::{DistributedLoad, LoadMoment, LoadState, ScaledLoad};
use super::follower_load::{FollowedLoad, FollowedMoment, LoadsAlong};
use super::ivp::{self, LineState, Wrench};
use super::solution_path::Path;
use super::taut::{Solved, Spring};
use super::{Rod, RodSection};
use crate::error::{Error, Result};
use crate::math::se3::{inverse_left_jacobian, rotation_vector};
use crate::solve::warm_start::WarmStart;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, SMatrix, UnitQuaternion, Vector3, Vector6};

/// End condition in the world frame. Each component of position is held or loaded; the orientation is held (a clamp)
/// or free under a couple (a ball joint, a free end).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndConditions {
    /// Held components of the position; None where the force is given.
    pub position: [Option<f64>; 3],
    /// Held orientation; None where the couple is given.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// n(L), used where the position is free.
    pub force: Vector3<f64>,
    /// m(L), used where the orientation is free.
    pub couple: Vector3<f64>,
    /// True if force and couple are given along the directors at the end; only if nothing is held.
    pub follower: bool,
    /// Couple and force along the directors at the end, beside dead ones; only where the end is free.
    pub turning: [Vector3<f64>; 2],
    /// Arm from the end to the point of action of the force, along the directors there; 0 if anything is held, or the
    /// force follows.
    pub arm: Vector3<f64>,
}

impl EndConditions {
    /// A free end under a dead force and couple.
    pub fn load(force: Vector3<f64>, couple: Vector3<f64>) -> Self {
        Self {
            position: [None; 3],
            orientation: None,
            force,
            couple,
            follower: false,
            turning: [Vector3::zeros(); 2],
            arm: Vector3::zeros(),
        }
    }

    /// A free end under a dead force on an arm, as the weight of a body: `arm` is the vector to the point of action,
    /// along the directors at the end.
    pub fn weight(force: Vector3<f64>, arm: Vector3<f64>, couple: Vector3<f64>) -> Self {
        Self {
            arm,
            ..Self::load(force, couple)
        }
    }

    /// A free end under follower loads: components of force and couple along the directors.
    pub fn follower(force: Vector3<f64>, couple: Vector3<f64>) -> Self {
        Self {
            follower: true,
            ..Self::load(force, couple)
        }
    }

    /// A ball joint at a position.
    pub fn ball(position: Vector3<f64>) -> Self {
        Self {
            position: [Some(position.x), Some(position.y), Some(position.z)],
            ..Self::load(Vector3::zeros(), Vector3::zeros())
        }
    }

    /// A clamp in a pose.
    pub fn pose(position: Vector3<f64>, orientation: UnitQuaternion<f64>) -> Self {
        Self {
            orientation: Some(orientation),
            ..Self::ball(position)
        }
    }

    /// True if some of the position or the orientation is held.
    pub fn holds(&self) -> bool {
        self.orientation.is_some() || self.position.iter().any(Option::is_some)
    }
}

/// Loads on a rod that have no potential, per unloaded length and at single places.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadsWithoutPotential {
    /// Force along the directors.
    pub follower_force: DistributedLoad,
    /// Couple in the world.
    pub couple: DistributedLoad,
    /// Couple along the directors.
    pub follower_couple: DistributedLoad,
}

impl LoadsWithoutPotential {
    /// Places x = s/L inside the rod at which a load is not smooth.
    pub fn breaks(&self) -> impl Iterator<Item = f64> {
        let all = [&self.follower_force, &self.couple, &self.follower_couple];
        all.into_iter().flat_map(DistributedLoad::breaks)
    }
}

/// A rod with an end condition, in the clamp's frame and the numerics' units.
#[derive(Debug, Clone)]
pub struct Problem {
    pub(super) rod: Rod,
    pub(super) end: EndConditions,
    /// The world's axes seen from the clamp.
    pub(super) axes: [Vector3<f64>; 3],
    /// Targets by world component: position if held, force if not.
    pub(super) targets: [f64; 3],
    pub(super) orientation: Option<Matrix3<f64>>,
    pub(super) couple: Vector3<f64>,
    /// Arm of the force, along the directors of the end.
    pub(super) arm: Vector3<f64>,
    /// Couple and force on the end along its directors, beside dead ones.
    pub(super) turning: [Vector3<f64>; 2],
    /// Load along the rod; `None` if there is none.
    pub(super) weight: Option<ScaledLoad>,
    /// Follower forces and couples along the rod; `None` without any.
    pub(super) followed: Option<FollowedLoad>,
    pub(super) tolerance: f64,
    pub(super) path: Path,
    /// The equilibrium last found from both ends.
    pub(super) at_rest: WarmStart<Solved>,
}

/// The rod's end at a trial wrench: pose and resultants, and their derivatives by the six components of the wrench.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    pub(super) r: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// Couple and force at the end.
    pub(super) m: Vector3<f64>,
    pub(super) n: Vector3<f64>,
    /// Rows phi, rho; columns m(0), n.
    pub(super) tangent: [[f64; 6]; 6],
    /// -dw of a load along the rod, by the same columns.
    taken: [[f64; 6]; 3],
    /// Change of the force taken from a load that turns with the rod, by the same columns.
    taken_force: [[f64; 6]; 3],
}

impl Trial {
    /// An end without derivatives: pose, couple and force.
    pub(super) fn bare(
        r: Vector3<f64>,
        rotation: Matrix3<f64>,
        m: Vector3<f64>,
        n: Vector3<f64>,
    ) -> Self {
        Self {
            r,
            rotation,
            m,
            n,
            tangent: [[0.0; 6]; 6],
            taken: [[0.0; 6]; 3],
            taken_force: [[0.0; 6]; 3],
        }
    }
}

/// Variations of the rod's end by `N` columns: rotation vector, place, couple and force.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndVariation<const N: usize> {
    pub(super) phi: SMatrix<f64, 3, N>,
    pub(super) r: SMatrix<f64, 3, N>,
    pub(super) m: SMatrix<f64, 3, N>,
    pub(super) n: SMatrix<f64, 3, N>,
}

/// The rod's end under a base wrench, with or without a load along the rod.
pub(super) struct EndUnderWrench<const K: usize> {
    pub(super) at: LineState<K>,
    /// Couple and force.
    pub(super) m: Vector3<f64>,
    pub(super) n: Vector3<f64>,
    /// -dw of a load along the rod.
    taken: [[f64; K]; 3],
    /// Change of the force taken from a load that turns with the rod.
    taken_force: [[f64; K]; 3],
    /// Work int f.r ds of the load along the rod.
    pub(super) work: f64,
}

impl<const K: usize> EndUnderWrench<K> {
    fn new<C: LoadState<K>>(at: &LineState<K, C>, b: &Wrench, load: &C::Load) -> Self {
        let (m, n) = at.resultants(b, load);
        let mut taken = [[0.0; K]; 3];
        at.carried.take_columns(&mut taken);
        Self {
            at: at.without_load(),
            m,
            n,
            taken,
            taken_force: at.carried.taken_force().copied().unwrap_or([[0.0; K]; 3]),
            work: at.carried.work(),
        }
    }
}

impl Problem {
    /// Checks that the end condition makes sense and can be met.
    ///
    /// # Errors
    /// A number that is not finite; a follower load, or an arm, on a held end; a position out of the reach of an
    /// inextensible rod.
    pub fn new(rod: Rod, end: EndConditions, tolerance: f64) -> Result<Self> {
        if !(1e-14..=1e-3).contains(&tolerance) {
            return Err(Error::domain(format!(
                "the tolerance is {tolerance}; it must be in [1e-14, 1e-3]"
            )));
        }
        let loads = end.force.iter().chain(&end.couple).chain(&end.arm);
        let loads = loads.chain(end.turning.iter().flatten());
        let numbers = loads.copied();
        if !numbers
            .chain(end.position.iter().flatten().copied())
            .all(f64::is_finite)
        {
            return Err(Error::domain(
                "forces, couples and positions of the end must be finite",
            ));
        }
        if end.follower && end.holds() {
            return Err(Error::domain(
                "a follower load needs a free end: leave out the held position and orientation, or follower",
            ));
        }
        if end.turning != [Vector3::zeros(); 2] && (end.follower || end.holds()) {
            return Err(Error::domain(
                "loads along the directors of the end need an end that is free: leave out the held position and orientation, or the loads",
            ));
        }
        if end.arm != Vector3::zeros() && (end.follower || end.holds()) {
            return Err(Error::domain(
                "a force beside the end needs an end that is free, and must not follow it: leave out the arm, or what is held",
            ));
        }
        let problem = Self::unchecked(rod, end, tolerance);
        let rod = &problem.rod;
        if end.position.iter().any(Option::is_some) && rod.is_inextensible()? {
            // Distance of the end, or the least distance that the held components allow.
            let held = (0..3).filter(|i| end.position[*i].is_some());
            let reach = held.map(|i| problem.targets[i].powi(2)).sum::<f64>().sqrt();
            if !(reach < 1.0) {
                return Err(Error::unreachable(format!(
                    "the end is held at a distance of {:.9} from the clamp, but the rod is inextensible and {} long; \
                     hold it nearer, or give the rod an axial stiffness",
                    reach * rod.length,
                    rod.length
                )));
            }
        }
        Ok(problem)
    }

    /// The problem of an end condition that has been checked.
    pub(super) fn unchecked(rod: Rod, end: EndConditions, tolerance: f64) -> Self {
        let (couple, force) = rod.units();
        let turn = rod.clamp.rotation.inverse();
        let origin = rod.clamp.translation.vector;
        let targets = std::array::from_fn(|i| match end.position[i] {
            Some(x) => (x - origin[i]) / rod.length,
            None => end.force[i] / force,
        });
        // Follower loads are in the frame of the end, whatever that of the clamp.
        let given = end.couple / couple;
        Self {
            axes: std::array::from_fn(|i| turn * Vector3::ith(i, 1.0)),
            targets,
            orientation: end
                .orientation
                .map(|q| *(turn * q).to_rotation_matrix().matrix()),
            couple: if end.follower { given } else { turn * given },
            arm: end.arm / rod.length,
            turning: [end.turning[0] / couple, end.turning[1] / force],
            weight: None,
            followed: None,
            rod,
            end,
            tolerance,
            path: Path::Auto,
            at_rest: WarmStart::default(),
        }
    }

    /// This problem with a dead load along the rod, such as its weight, in addition to the loads on the end.
    ///
    /// Charts that need a constant force along the rod are excluded: the closed form, and the force on an end that
    /// bears no couple.
    #[must_use]
    pub fn with_distributed(mut self, load: &DistributedLoad) -> Self {
        self.weight = Some(ScaledLoad::new(load, &self.rod));
        self.rod.law = self.rod.law.broken_at(&load.breaks());
        self
    }

    /// Adds follower forces and couples along the rod.
    #[must_use]
    pub fn with_followers(mut self, loads: &LoadsWithoutPotential) -> Self {
        let LoadsWithoutPotential {
            follower_force: force,
            couple,
            follower_couple,
        } = loads;
        self.followed = Some(FollowedLoad {
            force: ScaledLoad::turning(force, &self.rod),
            dead_couple: ScaledLoad::couples(couple, &self.rod, false),
            couple: ScaledLoad::couples(follower_couple, &self.rod, true),
        });
        for load in [force, couple, follower_couple] {
            self.rod.law = self.rod.law.broken_at(&load.breaks());
        }
        self
    }

    /// All loads on the rod; `None` if all have a potential.
    pub(super) fn followed(&self) -> Option<LoadsAlong> {
        Some(LoadsAlong {
            followed: self.followed.clone()?,
            dead: self.weight.clone().unwrap_or_else(ScaledLoad::nothing),
        })
    }

    /// The rod.
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// The rod at `count` (at least 2) evenly spaced sections under a base wrench in the world frame.
    ///
    /// # Errors
    /// As [`Rod::shape`].
    pub fn shape(&self, base: &Wrench, count: usize) -> Result<Vec<RodSection>> {
        let last = count.max(2) - 1;
        let at: Vec<f64> = (0..=last).map(|i| i as f64 / last as f64).collect();
        self.sections(base, &at)
    }

    /// Sections under a base wrench at places in [0, 1], in growing order.
    pub fn sections(&self, base: &Wrench, at: &[f64]) -> Result<Vec<RodSection>> {
        if let Some(taut) = self.taut_at(&self.rod.inward(base)) {
            return self.taut_sections(&taut, &Spring::NONE, at);
        }
        if let Some(loads) = &self.followed() {
            let b = self.rod.inward(base);
            let law = &self.rod.law;
            let all =
                ivp::loaded_sections::<0, FollowedMoment<0>>(law, loads, &b, self.tolerance, at)?;
            let all = all.iter();
            return all.map(|at| self.rod.outward(at, &b, loads)).collect();
        }
        if let Some(weight) = &self.weight {
            let b = self.rod.inward(base);
            let law = &self.rod.law;
            let sections =
                ivp::loaded_sections::<0, LoadMoment<0>>(law, weight, &b, self.tolerance, at)?;
            let sections = sections.iter();
            return sections
                .map(|section| self.rod.outward(section, &b, weight))
                .collect();
        }
        let at: Vec<f64> = at.iter().map(|s| self.rod.length * s).collect();
        self.rod.shape(base, &at, self.tolerance)
    }

    /// True if the loads have a potential: no follower load, no couple at an end that is free to turn.
    pub fn is_conservative(&self) -> bool {
        !self.is_followed() && (self.end.orientation.is_some() || self.couple == Vector3::zeros())
    }

    /// True if a load turns with the rod: its equilibria have no index.
    pub fn is_followed(&self) -> bool {
        self.end.follower || self.is_mixed()
    }

    /// True for a follower load or a couple on the rod, or a follower load at the end beside dead loads. The
    /// equilibrium then has no index, not even with the follower load kept dead.
    pub fn is_mixed(&self) -> bool {
        self.followed.is_some() || self.turning != [Vector3::zeros(); 2]
    }

    /// Arm of the force at the given rotation of the end.
    pub(super) fn lever(&self, rotation: &Matrix3<f64>) -> Vector3<f64> {
        rotation * self.arm
    }

    /// The rod's end, with `K` columns of the tangent.
    pub(super) fn integrate_to_end<const K: usize>(&self, b: &Wrench) -> Result<EndUnderWrench<K>> {
        let law = &self.rod.law;
        if let Some(loads) = &self.followed() {
            let end = ivp::loaded_end::<K, FollowedMoment<K>>(law, loads, b, self.tolerance)?;
            return Ok(EndUnderWrench::new(&end.0, b, loads));
        }
        Ok(match &self.weight {
            None => EndUnderWrench::new::<()>(&ivp::end(law, b, self.tolerance)?.0, b, &()),
            Some(weight) => {
                let end = ivp::loaded_end::<K, LoadMoment<K>>(law, weight, b, self.tolerance)?;
                EndUnderWrench::new(&end.0, b, weight)
            }
        })
    }

    /// The end of the rod at the base wrench `b`, with its tangent.
    pub(super) fn trial(&self, b: &Wrench) -> Result<Trial> {
        let end = self.integrate_to_end::<6>(b)?;
        Ok(Trial {
            r: end.at.position(),
            rotation: end.at.rotation(),
            m: end.m,
            n: end.n,
            tangent: end.at.tangent,
            taken: end.taken,
            taken_force: end.taken_force,
        })
    }

    /// The end without its tangent.
    pub(super) fn bare_trial(&self, b: &Wrench) -> Result<Trial> {
        let end = self.integrate_to_end::<0>(b)?;
        let (r, rotation) = (end.at.position(), end.at.rotation());
        Ok(Trial::bare(r, rotation, end.m, end.n))
    }

    /// The six equations at a trial: rotation or couple, then for each world component position or force.
    pub(super) fn residual(&self, trial: &Trial) -> Vector6<f64> {
        let (m, n) = (trial.m, trial.n);
        let (first, second) = if self.end.follower {
            let back = trial.rotation.transpose();
            (
                back * m - self.couple,
                back * n - Vector3::from(self.targets),
            )
        } else {
            let first = match &self.orientation {
                Some(target) => rotation_vector(&(trial.rotation * target.transpose())),
                None => {
                    let turned = self.couple + trial.rotation * self.turning[0];
                    m - turned - self.lever(&trial.rotation).cross(&n)
                }
            };
            let n = n - trial.rotation * self.turning[1];
            let second = Vector3::from_fn(|i, _| {
                let quantity = if self.end.position[i].is_some() {
                    trial.r
                } else {
                    n
                };
                self.axes[i].dot(&quantity) - self.targets[i]
            });
            (first, second)
        };
        Vector6::new(first.x, first.y, first.z, second.x, second.y, second.z)
    }

    /// The derivatives of couple and force at the end by the base wrench, at a trial.
    pub(super) fn resultants_by(&self, trial: &Trial) -> [Matrix3x6<f64>; 2] {
        let d_r = Matrix3x6::from_fn(|i, j| trial.tangent[3 + i][j]);
        let mut d_n = Matrix3x6::zeros();
        d_n.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        if self.followed.is_some() {
            d_n -= Matrix3x6::from_fn(|i, j| trial.taken_force[i][j]);
        }
        // m(1) = m(0) - r x n(1) - w(1), n(1) = n(0) - int f.
        let mut d_m = trial.n.cross_matrix() * d_r - trial.r.cross_matrix() * d_n;
        for i in 0..3 {
            d_m[(i, i)] += 1.0;
        }
        if self.weight.is_some() || self.followed.is_some() {
            d_m += Matrix3x6::from_fn(|i, j| trial.taken[i][j]);
        }
        [d_m, d_n]
    }

    /// The equations and their derivatives by the base wrench at a trial.
    pub(super) fn equations(&self, trial: &Trial) -> (Vector6<f64>, Matrix6<f64>) {
        let half = |row: usize| Matrix3x6::from_fn(|i, j| trial.tangent[row + i][j]);
        let [m, n] = self.resultants_by(trial);
        let value = self.residual(trial);
        let by = EndVariation {
            phi: half(0),
            r: half(3),
            m,
            n,
        };
        (value, self.equations_by(trial, &value, &by))
    }

    /// The derivatives of the equations, of the given value, along variations of the end.
    pub(super) fn equations_by<const N: usize>(
        &self,
        trial: &Trial,
        value: &Vector6<f64>,
        by: &EndVariation<N>,
    ) -> SMatrix<f64, 6, N> {
        let (m, n) = (trial.m, trial.n);
        let (first, second) = if self.end.follower {
            let back = trial.rotation.transpose();
            (
                back * (by.m + m.cross_matrix() * by.phi),
                back * (by.n + n.cross_matrix() * by.phi),
            )
        } else {
            let first = if self.orientation.is_some() {
                let phi = value.fixed_rows::<3>(0).into_owned();
                inverse_left_jacobian(&phi) * by.phi
            } else {
                // d(R arm) = dphi x R arm.
                let lever = self.lever(&trial.rotation).cross_matrix();
                let turned = (trial.rotation * self.turning[0]).cross_matrix();
                by.m - n.cross_matrix() * lever * by.phi - lever * by.n + turned * by.phi
            };
            let turned = (trial.rotation * self.turning[1]).cross_matrix();
            let d_n = by.n + turned * by.phi;
            let mut second = SMatrix::<f64, 3, N>::zeros();
            for i in 0..3 {
                let d = if self.end.position[i].is_some() {
                    &by.r
                } else {
                    &d_n
                };
                second.row_mut(i).copy_from(&(self.axes[i].transpose() * d));
            }
            (first, second)
        };
        let mut matrix = SMatrix::<f64, 6, N>::zeros();
        matrix.fixed_view_mut::<3, N>(0, 0).copy_from(&first);
        matrix.fixed_view_mut::<3, N>(3, 0).copy_from(&second);
        matrix
    }

    /// The potential -int f.r ds of the load along the rod, in the world and in the user's units; 0 without one.
    ///
    /// # Errors
    /// A wrench that the rod cannot follow.
    pub fn potential(&self, base: &Wrench) -> Result<f64> {
        let Some(weight) = &self.weight else {
            return Ok(0.0);
        };
        let b = self.rod.inward(base);
        let work = match self.taut_at(&b) {
            Some(taut) => taut.work,
            None => self.integrate_to_end::<0>(&b)?.work,
        };
        Ok(weight.potential(work) * self.rod.units().0)
    }

    /// The potential -F.r of the dead force on the end, by its components where the place is free, in the world and in
    /// the user's units. A couple has none.
    pub fn potential_of_end(&self, end: &RodSection) -> f64 {
        if self.end.follower {
            return 0.0;
        }
        let place = end.position + end.directors * self.end.arm;
        let free = (0..3).filter(|i| self.end.position[*i].is_none());
        -free.map(|i| self.end.force[i] * place[i]).sum::<f64>()
    }

    /// The section at the end of the rod.
    pub(super) fn end_section(&self, b: &Wrench) -> Result<RodSection> {
        if let Some(taut) = self.taut_at(b) {
            return self
                .taut_sections(&taut, &Spring::NONE, &[1.0])
                .map(|mut all| all.remove(0));
        }
        let law = &self.rod.law;
        if let Some(loads) = &self.followed() {
            let end = ivp::loaded_end::<0, FollowedMoment<0>>(law, loads, b, self.tolerance)?;
            return self.rod.outward(&end.0, b, loads);
        }
        match &self.weight {
            None => self
                .rod
                .outward(&ivp::end::<0>(law, b, self.tolerance)?.0, b, &()),
            Some(weight) => {
                let end = ivp::loaded_end::<0, LoadMoment<0>>(law, weight, b, self.tolerance)?;
                self.rod.outward(&end.0, b, weight)
            }
        }
    }
}
