//! Forces on the body in a motion with strains that are constant along the rod.

use super::Reduction;
use nalgebra::{Isometry3, Matrix6, SVector, Translation3, UnitQuaternion, Vector3, Vector6};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::math::se3::{halves, join, rotate_halves};
use snaprod_systems::section::rate::Viscoelastic;
use snaprod_systems::section::{Resultant, Strain};

/// Indices of the strains that move, at most three.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slots {
    places: [usize; 3],
    count: usize,
}

impl Slots {
    pub fn new(places: impl Iterator<Item = usize>) -> Self {
        let mut slots = Self {
            places: [0; 3],
            count: 0,
        };
        for place in places.take(3) {
            slots.places[slots.count] = place;
            slots.count += 1;
        }
        slots
    }

    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.places[..self.count].iter().copied()
    }

    pub fn len(&self) -> usize {
        self.count
    }

    pub fn contains(&self, place: usize) -> bool {
        self.iter().any(|k| k == place)
    }

    /// The moving components of `x`, the others 0.
    pub fn only(&self, x: &Vector6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|i, _| if self.contains(i) { x[i] } else { 0.0 })
    }
}

/// State of a reduced motion: strains, their rates, and the strains of the Maxwell branches.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReducedState {
    pub time: f64,
    pub strain: Strain,
    /// Rates e_t; also the end's velocity along its directors, since V = Q^T e_t.
    pub rate: Strain,
    pub branches: Vec<Strain>,
}

impl ReducedState {
    /// The state after the time h, to first order; `slope` is d/dt of the state.
    pub fn moved(&self, slope: &Self, h: f64) -> Self {
        let branches = self.branches.iter().zip(&slope.branches);
        Self {
            time: self.time + slope.time * h,
            strain: self.strain + slope.strain * h,
            rate: self.rate + slope.rate * h,
            branches: branches.map(|(z, dz)| z + dz * h).collect(),
        }
    }

    /// Largest entry of strains, rates and branches.
    pub fn size(&self) -> f64 {
        let branches = self.branches.iter().map(|z| z.amax());
        branches.fold(self.strain.amax().max(self.rate.amax()), f64::max)
    }
}

/// The forces at a state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Balance {
    /// e_tt of the moving strains.
    pub acceleration: Strain,
    /// Largest of the forces and couples.
    largest: f64,
    /// Residual (A): u x n, u x m + v x n, the latter where no reaction couple can balance it.
    uneven: Vector6<f64>,
    /// Residual (B): forces and couples that move the body out of the motion.
    astray: Vector6<f64>,
}

impl Balance {
    /// The defects of (A) and (B), as forces and couples.
    pub fn defects(&self) -> SVector<f64, 12> {
        SVector::from_fn(|i, _| {
            if i < 6 {
                self.uneven[i]
            } else {
                self.astray[i - 6]
            }
        })
    }

    /// Scale of the defects.
    pub fn scale(&self) -> f64 {
        self.largest.max(f64::MIN_POSITIVE)
    }

    /// The largest relative defect (NaN counts as infinite) and the violated condition.
    pub fn defect(&self) -> (f64, &'static str) {
        let defects = self.defects();
        let (place, size) = defects.iter().enumerate().fold((0, 0.0), |most, (i, x)| {
            let size = if x.is_nan() { f64::INFINITY } else { x.abs() };
            if size > most.1 { (i, size) } else { most }
        });
        let why = match place {
            0..6 => "the force does not go through the clamp: v x n, AMV (6.19), bends the rod",
            6..9 => {
                "a couple would turn the end: of the section, of the loads, or of forces beside its centre of mass"
            }
            _ => "a force across the motion would move the end: of the section or of the loads",
        };
        (size / self.scale(), why)
    }
}

/// Resultants where the law does not constrain the strains, and their derivative by the strains.
pub(super) struct Stored {
    pub resultants: Resultant,
    pub tangent: Matrix6<f64>,
}

/// Stored resultants and tangent of the section at `e`. A law that holds some strains rigid gives only the
/// inverse, which is inverted here; the reactions are left 0.
pub(super) fn stored(section: &Viscoelastic, e: &Strain) -> Result<Stored> {
    let law = &section.elastic;
    if !section.rate.rigid()[3..].contains(&true) {
        return Ok(Stored {
            resultants: law.resultants(0.0, e)?,
            tangent: law.tangent(0.0, e)?,
        });
    }
    let mut resultants = Resultant::zeros();
    let mut last = f64::INFINITY;
    for _ in 0..40 {
        let inverse = law.inverse(0.0, &resultants)?;
        let mut compliance = inverse.compliance.matrix();
        let mut gap = e - inverse.strain;
        let free: [bool; 6] = std::array::from_fn(|k| compliance[(k, k)] > 0.0);
        for k in (0..6).filter(|k| !free[*k]) {
            compliance[(k, k)] = 1.0;
            gap[k] = 0.0;
        }
        let mut tangent = compliance
            .try_inverse()
            .ok_or_else(|| Error::ill_conditioned("the compliance of the section is singular"))?;
        let size = gap.amax();
        if size <= 4.0 * f64::EPSILON * (1.0 + e.amax()) || size >= last && size < 1e-12 {
            for k in (0..6).filter(|k| !free[*k]) {
                tangent[(k, k)] = 0.0;
            }
            return Ok(Stored {
                resultants,
                tangent,
            });
        }
        last = size;
        resultants += tangent * gap;
    }
    Err(Error::no_convergence(format!(
        "no resultants were found for the strains {}",
        snaprod_systems::error::named(&snaprod_systems::error::STRAINS, e.as_slice())
    )))
}

fn upper(v: &Vector6<f64>) -> Vector3<f64> {
    halves(v).0
}

fn lower(v: &Vector6<f64>) -> Vector3<f64> {
    halves(v).1
}

impl Reduction {
    /// Pose of the end at strains that are constant along the rod: twisted but straight, or sheared with
    /// directors that do not turn.
    pub(super) fn pose(e: &Strain) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), e[2]);
        Isometry3::from_parts(Translation3::from(lower(e)), turn)
    }

    /// d(acceleration)/d(wrench) and d(acceleration)/dV along the directors of the end.
    pub(super) fn linear_body(
        &self,
        at: &ReducedState,
        pose: &Isometry3<f64>,
    ) -> (Matrix6<f64>, Matrix6<f64>) {
        let v = rotate_halves(&pose.rotation, &at.rate);
        let linear = self
            .carried
            .linearised(at.time, pose, &v, &Vector6::zeros());
        let back = pose.rotation.inverse().to_rotation_matrix();
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(back.matrix());
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(back.matrix());
        let along = |a: Matrix6<f64>| turn * a * turn.transpose();
        (along(linear.by_wrench), along(linear.by_velocity))
    }

    /// Forces, accelerations and defects at a state.
    ///
    /// # Errors
    /// Strains outside the domain of a law.
    pub(super) fn balance(&self, at: &ReducedState) -> Result<Balance> {
        let (e, rate) = (&at.strain, &at.rate);
        let rigid = self.section.rate.rigid();
        let welded = self.carried.turns();
        let elastic = stored(&self.section, e)?;
        let viscous = self.section.rate.overstress(0.0, e, rate)?;
        let branches = self.section.branches.iter().zip(&at.branches);
        let branched = branches.fold(Resultant::zeros(), |sum, (branch, z)| {
            sum + branch.modulus * (e - z)
        });
        let mut w = elastic.resultants + viscous + branched;
        for k in (0..6).filter(|k| rigid[*k]) {
            w[k] = 0.0;
        }

        let pose = Self::pose(e);
        let velocity = rotate_halves(&pose.rotation, rate);
        let back = pose.rotation.inverse();
        let act = |w: &Resultant| {
            let rod = rotate_halves(&pose.rotation, &-w);
            rotate_halves(
                &back,
                &self
                    .carried
                    .motion(at.time, &pose, &velocity, &rod)
                    .acceleration,
            )
        };
        let (mobility, _) = self.linear_body(at, &pose);
        // Reactions of the rigid strains keep the end from moving in these components.
        let held: [bool; 6] = std::array::from_fn(|k| rigid[k] && mobility[(k, k)] > 0.0);
        let mut acceleration = act(&w);
        if held.contains(&true) {
            let matrix = Matrix6::from_fn(|i, j| match (held[i], held[j]) {
                (true, true) => mobility[(i, j)],
                _ => f64::from(i == j),
            });
            let missing = Vector6::from_fn(|k, _| if held[k] { acceleration[k] } else { 0.0 });
            w += matrix
                .lu()
                .solve(&missing)
                .ok_or_else(|| Error::ill_conditioned("the mass matrix of the body is singular"))?;
            acceleration = act(&w);
        }

        let (u, v, m, n) = (upper(e), lower(e), upper(&w), lower(&w));
        let mut couple = u.cross(&m) + v.cross(&n);
        if u == Vector3::zeros() {
            for k in (0..3).filter(|k| rigid[*k]) {
                couple[k] = 0.0;
            }
        }
        // Force or couple acting on the end: acceleration over mobility, component by component.
        let acting = |a: &Vector6<f64>| {
            Vector6::from_fn(|k, _| {
                if mobility[(k, k)] > 0.0 {
                    a[k] / mobility[(k, k)]
                } else {
                    0.0
                }
            })
        };
        let mut astray = acting(&(acceleration - self.slots.only(&acceleration)));
        for k in 0..6 {
            if held[k] {
                astray[k] = 0.0;
            } else if k < 3 && !welded {
                // A ball joint bears no couple.
                astray[k] = w[k];
            }
        }
        let free = act(&Resultant::zeros());
        // Forces far below those of the section at a strain of 1 are roundoff.
        let floor = self.slots.iter().map(|k| elastic.tangent[(k, k)].abs());
        let floor = 1e-6 * floor.fold(0.0, f64::max);
        let terms = [elastic.resultants, viscous, branched, w, acting(&free)];
        Ok(Balance {
            acceleration: self.slots.only(&acceleration),
            largest: terms.iter().map(|x| x.amax()).fold(floor, f64::max),
            uneven: join(&u.cross(&n), &couple),
            astray,
        })
    }

    /// d/dt of the state.
    pub(super) fn slope(&self, at: &ReducedState, balance: &Balance) -> ReducedState {
        let branches = self.section.branches.iter().zip(&at.branches);
        ReducedState {
            time: 1.0,
            strain: at.rate,
            rate: balance.acceleration,
            branches: branches
                .map(|(branch, z)| (at.strain - z) / branch.time)
                .collect(),
        }
    }
}
