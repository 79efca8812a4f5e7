//! First-order inertia of a rod that stays in equilibrium while base and base wrench change (theory 3.9).
//!
//! In a frame that moves with the base and does not turn, the section s is at r(s), R(s). The base wrench b changes
//! at the rate b', and the base turns with Omega. The section then turns and moves by (omega, v) = T(s) (b', Omega),
//! T the tangent of the initial-value problem. At constant b' and Omega these change by (omega_t, r_tt):
//!
//! ```text
//! omega' = R u_t,                          v' = omega x tau + R v_t,                                         tau = r'
//! omega_t' = R u_tt + omega x R u_t,       r_tt' = omega_t x tau + omega x (omega x tau) + 2 omega x R v_t + R v_tt
//! (u, v)_t = C w_t,   (u, v)_tt = C w_tt,  w = (R^T m, R^T n),   m = m(0) - r x n - w
//! ```
//!
//! If the law is not linear, dC/dw w_t w_t joins (u, v)_tt; a load along the rod is dead and does not turn along.
//! With the velocity V of the base a section has the twist Lambda (V, b', Omega), Lambda = [0, T_omega; 1, T_v].
//! D'Alembert's principle asks for int Lambda^T inertia. The chart's own integration along the rod has found shape
//! and T at the stages of its steps. The second derivative and all integrals follow there by the same Runge-Kutta
//! formulas, as if they had been integrated together. Taut rods are swept from both ends ([`super::taut`]): their
//! rates are those of the end, or of the force.

use super::Rod;
use super::distributed_load::{DistributedLoad, LoadMoment, LoadState, ScaledLoad};
use super::ivp::{LineState, Wrench};
use super::ivp_trace::Track;
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::math::se3::join;
use crate::section::MassAlong;
use crate::solve::dop853::integrate_alongside;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

/// Mass and rotary inertia of the sections of a rod. Both vary as [`Rod::with_mass_along`] says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionMass {
    /// Mass of the whole rod.
    pub mass: f64,
    /// Mean inertia of the sections per length about their centre, along the directors.
    pub rotary: Vector3<f64>,
}

impl SectionMass {
    /// Rotary inertia of the sections over mass and the square of the length `length`.
    pub(super) fn per_mass(&self, length: f64) -> Vector3<f64> {
        self.rotary / (self.mass * length)
    }

    /// No mass.
    pub const NONE: Self = Self {
        mass: 0.0,
        rotary: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// Motion of the rod: rates of base wrench and base, along the present directors of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodRates {
    /// Rate of the base wrench in the world, in B/L and B/L^2 per time.
    pub rate: Wrench,
    /// Angular velocity of the base.
    pub spin: Vector3<f64>,
}

impl RodRates {
    /// (b', Omega).
    pub(super) fn rates(&self) -> [f64; 9] {
        std::array::from_fn(|i| match i {
            0..6 => self.rate[i],
            _ => self.spin[i - 6],
        })
    }
}

/// Inertia of a rod in (V, b', Omega): velocity of its base, rate of the base wrench in B/L and B/L^2, and angular
/// velocity of the base. All are along the present directors of the base. For a taut rod [`Rates`](super::Rates)
/// replace b'.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceRodInertia {
    /// int Lambda^T I Lambda, symmetric: twice the kinetic energy is its quadratic form.
    pub matrix: SMatrix<f64, 12, 12>,
    /// Inertial force int Lambda^T (inertia) at constant V, b' and Omega.
    pub force: SVector<f64, 12>,
    /// Centre of mass relative to the base.
    pub centre: Vector3<f64>,
    /// Angular momentum about the base while the base has no velocity.
    pub momentum: Vector3<f64>,
    /// (omega_t, r_tt) of the end at constant V, b' and Omega.
    pub second: Vector6<f64>,
    /// Second time derivative of the couple m(1) at constant rates.
    pub couple: Vector3<f64>,
}

/// Record of an integration along a rod, with shape and tangent at all stages; [`Rod::generalized_inertia`]
/// integrates over the same stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace(TraceKind);

/// An integration along a rod, and its end state.
pub(super) type Tracked<const K: usize, C> = (Track<K, C>, LineState<K, C>);

// Made once a trace, and not moved about: the size of the variants does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
enum TraceKind {
    /// No load; a turn of the base, if any, is a rigid rotation of the rod.
    Bare(Tracked<6, ()>, bool),
    /// A load along the rod, the base at rest.
    Held(Tracked<6, LoadMoment<6>>),
    /// A load along the rod, with a turn of the base.
    Turning(Tracked<9, LoadMoment<9>>),
}

impl Trace {
    pub(super) fn bare(track: Track<6>, end: LineState<6>, turns: bool) -> Self {
        Self(TraceKind::Bare((track, end), turns))
    }

    pub(super) fn held(tracked: Tracked<6, LoadMoment<6>>) -> Self {
        Self(TraceKind::Held(tracked))
    }

    pub(super) fn turning(tracked: Tracked<9, LoadMoment<9>>) -> Self {
        Self(TraceKind::Turning(tracked))
    }
}

/// Tangent at a section: d(phi, r), and dw of a load, by b and, if K is 9, by a turn of the base.
pub(super) struct Tangent<const K: usize> {
    pub by: [[f64; K]; 6],
    pub taken: [[f64; K]; 3],
}

/// A rod in motion: sections, load, base wrench, rates.
struct MovingRod<'a, L> {
    sections: SectionRates<'a>,
    load: &'a L,
    b: &'a Wrench,
    /// (b', Omega).
    rates: [f64; 9],
    rotary: Vector3<f64>,
}

/// Inertia of a section.
pub(super) struct SectionInertia {
    /// Mass per length over its mean.
    density: f64,
    /// Rotary inertia over the mean mass.
    rotary: Vector3<f64>,
}

/// Section law and mass of the sections of a rod whose strains change in time.
pub(super) struct SectionRates<'a> {
    law: &'a ScaledLaw,
    mass_along: Option<&'a MassAlong>,
    /// True if the compliance does not depend on the resultants.
    linear: bool,
}

/// State of a moving section: shape, (omega, v), and the rates that (omega_t, r_tt) are formed from.
pub(super) struct MovingSection {
    pub turn: Matrix3<f64>,
    pub r: Vector3<f64>,
    pub omega: Vector3<f64>,
    pub v: Vector3<f64>,
    pub m: Vector3<f64>,
    pub n: Vector3<f64>,
    pub m_t: Vector3<f64>,
    pub n_t: Vector3<f64>,
}

impl MovingSection {
    /// m_tt of a section accelerated by r_tt, where the load takes w_tt.
    fn couple(&self, r_tt: &Vector3<f64>, taken: &Vector3<f64>) -> Vector3<f64> {
        -r_tt.cross(&self.n) - self.v.cross(&self.n_t) * 2.0 - taken
    }
}

/// (omega_t, r_tt), and w_tt of the load.
pub(super) type Second = SVector<f64, 9>;

fn three(x: &Second, row: usize) -> Vector3<f64> {
    Vector3::new(x[row], x[row + 1], x[row + 2])
}

fn half(x: &Vector6<f64>, row: usize) -> Vector3<f64> {
    Vector3::new(x[row], x[row + 1], x[row + 2])
}

/// Integrals along the rod, in its units.
pub(super) struct InertiaIntegrals<const K: usize> {
    /// int T^T I T, and int T_v.
    own: [[f64; K]; K],
    mixed: [[f64; K]; 3],
    /// int r, and the angular momentum.
    first: Vector3<f64>,
    momentum: Vector3<f64>,
    /// int r_tt, and int T^T (inertia).
    base: Vector3<f64>,
    chart: [f64; K],
}

impl<const K: usize> InertiaIntegrals<K> {
    pub fn new() -> Self {
        Self {
            own: [[0.0; K]; K],
            mixed: [[0.0; K]; 3],
            first: Vector3::zeros(),
            momentum: Vector3::zeros(),
            base: Vector3::zeros(),
            chart: [0.0; K],
        }
    }

    /// Adds a section with its quadrature weight.
    pub fn add(
        &mut self,
        weight: f64,
        tangent: &Tangent<K>,
        at: &MovingSection,
        second: &Second,
        SectionInertia { density, rotary }: &SectionInertia,
    ) {
        let (omega_t, r_tt) = (three(second, 0), three(second, 3));
        let mass = weight * density;
        self.first += at.r * mass;
        self.base += r_tt * mass;
        self.momentum += at.r.cross(&at.v) * mass;
        let row = |i: usize| &tangent.by[i];
        for i in 0..3 {
            let v = row(3 + i);
            self.add_pair(v, mass, r_tt[i] * mass);
            for (sum, v) in self.mixed[i].iter_mut().zip(v) {
                *sum += v * mass;
            }
        }
        if *rotary == Vector3::zeros() {
            return;
        }
        let spun = at.turn * rotary.component_mul(&at.turn.tr_mul(&at.omega));
        self.momentum += spun * weight;
        let turned = at.turn.tr_mul(&at.omega.cross(&spun));
        let own = at.turn.tr_mul(&omega_t).component_mul(rotary) + turned;
        for i in 0..3 {
            // Component along the director i.
            let d = at.turn.column(i);
            let along: [f64; K] =
                std::array::from_fn(|k| d[0] * row(0)[k] + d[1] * row(1)[k] + d[2] * row(2)[k]);
            self.add_pair(&along, rotary[i] * weight, own[i] * weight);
        }
    }

    /// own += weight row^T row, chart += force row.
    #[inline]
    fn add_pair(&mut self, row: &[f64; K], weight: f64, force: f64) {
        for i in 0..K {
            let scaled = row[i] * weight;
            for (sum, x) in self.own[i].iter_mut().zip(row) {
                *sum += scaled * x;
            }
            self.chart[i] += force * row[i];
        }
    }
}

/// Step of the differences for the derivative of the compliance of a nonlinear law, relative to the resultants.
const ASIDE: f64 = 2e-3;

impl<'a> SectionRates<'a> {
    pub fn of(rod: &'a Rod) -> Self {
        Self {
            law: &rod.law,
            mass_along: rod.mass_along.as_deref(),
            linear: rod.section.is_linear(),
        }
    }

    /// Inertia of the section at s. `rotary`: mean rotary inertia of the rod over the mass of the rod.
    pub fn inertia(&self, s: f64, rotary: &Vector3<f64>) -> SectionInertia {
        match self.mass_along {
            None => SectionInertia {
                density: 1.0,
                rotary: *rotary,
            },
            Some(along) => SectionInertia {
                density: along.density().at(s),
                rotary: along.rotary(s).component_mul(rotary),
            },
        }
    }

    /// (omega_t', r_tt') of a section with the second rates omega_t and m_tt, under a force that changes at a
    /// constant rate.
    pub fn second(
        &self,
        s: f64,
        at: &MovingSection,
        omega_t: &Vector3<f64>,
        m_tt: &Vector3<f64>,
    ) -> Option<[Vector3<f64>; 2]> {
        let MovingSection {
            turn,
            omega,
            m,
            n,
            m_t,
            n_t,
            ..
        } = at;
        // (R^T a)_t = R^T (a_t - omega x a), twice.
        let once = |a: &Vector3<f64>, a_t: &Vector3<f64>| turn.tr_mul(&(a_t - omega.cross(a)));
        let turning = |a: &Vector3<f64>, a_t: &Vector3<f64>| {
            omega.cross(&(omega.cross(a) - a_t * 2.0)) - omega_t.cross(a)
        };
        let local = join(&turn.tr_mul(m), &turn.tr_mul(n));
        let response = self.law.inverse(s, &local).ok()?;
        let compliance = &*response.compliance;
        let w_t = join(&once(m, m_t), &once(n, n_t));
        let e_t = compliance * &w_t;
        let w_tt = join(
            &turn.tr_mul(&(m_tt + turning(m, m_t))),
            &turn.tr_mul(&turning(n, n_t)),
        );
        let mut e_tt = compliance * &w_tt;
        if !self.linear {
            e_tt += self.stiffening(s, &local, &w_t)?;
        }
        let tau = turn * half(&response.strain, 3);
        let (u_t, v_t) = (turn * half(&e_t, 0), turn * half(&e_t, 3));
        let turned = turn * half(&e_tt, 0) + omega.cross(&u_t);
        let moved = omega_t.cross(&tau)
            + omega.cross(&(omega.cross(&tau) + v_t * 2.0))
            + turn * half(&e_tt, 3);
        Some([turned, moved])
    }

    /// Derivative of the compliance of a nonlinear law along w_t, times w_t: central differences of fourth order.
    fn stiffening(&self, s: f64, w: &Vector6<f64>, w_t: &Vector6<f64>) -> Option<Vector6<f64>> {
        let speed = w_t.norm();
        if speed == 0.0 {
            return Some(Vector6::zeros());
        }
        let step = ASIDE * (1.0 + w.norm()) / speed;
        let at = |part: f64| {
            let there = self.law.inverse(s, &(w + w_t * (part * step))).ok()?;
            Some(&*there.compliance * w_t)
        };
        let near = at(1.0)? - at(-1.0)?;
        let far = at(2.0)? - at(-2.0)?;
        Some((near * 8.0 - far) / (12.0 * step))
    }
}

impl<L> MovingRod<'_, L> {
    /// Tangent at a section. The columns of a turn of the base, at a fixed base wrench, are a rigid rotation less the
    /// response to the rotated wrench.
    fn tangent<const J: usize, const K: usize>(
        &self,
        at: &LineState<J, impl LoadState<J, Load = L>>,
    ) -> Tangent<K> {
        let mut by = [[0.0; K]; 6];
        let mut taken = [[0.0; K]; 3];
        let mut own = [[0.0; J]; 3];
        at.carried.take_columns(&mut own);
        for (row, own) in by.iter_mut().zip(&at.tangent) {
            row[..J].copy_from_slice(own);
        }
        for (row, own) in taken.iter_mut().zip(&own) {
            row[..J].copy_from_slice(own);
        }
        if K > J {
            let r = at.position();
            let [m, n] = [half(self.b, 0), half(self.b, 3)];
            for k in 0..3 {
                let axis = Vector3::ith(k, 1.0);
                let rigid = join(&axis, &axis.cross(&r));
                let back = join(&axis.cross(&m), &axis.cross(&n));
                for (i, row) in by.iter_mut().enumerate() {
                    let turned: f64 = row[..6].iter().zip(&back).map(|(t, b)| t * b).sum();
                    row[6 + k] = rigid[i] - turned;
                }
            }
        }
        Tangent { by, taken }
    }

    fn section_motion<const J: usize, C: LoadState<J, Load = L>, const K: usize>(
        &self,
        at: &LineState<J, C>,
        tangent: &Tangent<K>,
    ) -> MovingSection {
        let along =
            |row: &[f64; K]| -> f64 { row.iter().zip(&self.rates).map(|(t, b)| t * b).sum() };
        let by = |from: usize| Vector3::from_fn(|i, _| along(&tangent.by[from + i]));
        let (omega, v) = (by(0), by(3));
        let taken = Vector3::from_fn(|i, _| along(&tangent.taken[i]));
        let (m, n) = at.resultants(self.b, self.load);
        let [m_rate, n_t] = [0, 3].map(|i| Vector3::from_column_slice(&self.rates[i..i + 3]));
        let r = at.position();
        MovingSection {
            turn: at.rotation(),
            r,
            omega,
            v,
            m,
            n,
            m_t: m_rate + taken - v.cross(&n) - r.cross(&n_t),
            n_t,
        }
    }

    /// Derivatives along s of (omega_t, r_tt) and of w_tt.
    fn slope(
        &self,
        s: f64,
        at: &MovingSection,
        second: &Second,
        density: &Vector3<f64>,
    ) -> Option<Second> {
        let (omega_t, r_tt) = (three(second, 0), three(second, 3));
        let m_tt = at.couple(&r_tt, &three(second, 6));
        let [turned, moved] = self.sections.second(s, at, &omega_t, &m_tt)?;
        let taken = r_tt.cross(density);
        Some(Second::from_fn(|i, _| [turned, moved, taken][i / 3][i % 3]))
    }

    /// The inertia, in the rod's units, from the sections of `track`; None if the law refuses.
    fn inertia_along_track<const J: usize, C: LoadState<J, Load = L>, const K: usize>(
        &self,
        track: &Track<J, C>,
        end: &LineState<J, C>,
    ) -> Option<(InertiaIntegrals<K>, Second, Vector3<f64>)> {
        let mut sums = InertiaIntegrals::new();
        let mut second = Second::zeros();
        let mut last = 0.0;
        for (h, stages) in track.steps() {
            let from = stages[0].s();
            if from > last {
                // A force at the break has a couple about the base.
                let taken = three(&second, 3).cross(&C::jump(self.load, 0.5 * (last + from)));
                let mut couple = second.fixed_rows_mut::<3>(6);
                couple += taken;
            }
            last = from + h;
            second = integrate_alongside(&second, h, |i, second, weight| {
                let stage = &stages[i];
                let tangent = self.tangent::<J, K>(stage);
                let at = self.section_motion(stage, &tangent);
                if weight != 0.0 {
                    let inertia = self.sections.inertia(stage.s(), &self.rotary);
                    sums.add(weight, &tangent, &at, second, &inertia);
                }
                self.slope(stage.s(), &at, second, &C::density(self.load, stage.s()))
            })?;
        }
        let at = self.section_motion(end, &self.tangent::<J, K>(end));
        let couple = at.couple(&three(&second, 3), &three(&second, 6));
        Some((sums, second, couple))
    }
}

impl Rod {
    /// Inertia of the rod on its equilibria, in the motion `motion`. The base wrench `b` is in B/L and B/L^2, along
    /// the directors of the base, as is the dead load along the rod. `trace` is the record of the integration that
    /// found the end under both, and sets the error. The clamp is not used. If the rod bears a load and the trace has
    /// no turns of its base, the base must be at rest, and terms of its turning are not computed.
    ///
    /// # Errors
    /// A motion too fast for a law that is not linear.
    pub fn generalized_inertia(
        &self,
        mass: &SectionMass,
        b: &Wrench,
        load: Option<&DistributedLoad>,
        motion: &RodRates,
        trace: &Trace,
    ) -> Result<SpaceRodInertia> {
        let found = match &trace.0 {
            TraceKind::Bare(way, true) => {
                self.inertia_with_load::<6, (), 9>(mass, b, &(), motion, way)
            }
            TraceKind::Bare(way, false) => {
                self.inertia_with_load::<6, (), 6>(mass, b, &(), motion, way)
            }
            TraceKind::Held(way) => self.inertia_with_load::<6, LoadMoment<6>, 6>(
                mass,
                b,
                &self.scaled_load(load),
                motion,
                way,
            ),
            TraceKind::Turning(way) => self.inertia_with_load::<9, LoadMoment<9>, 9>(
                mass,
                b,
                &self.scaled_load(load),
                motion,
                way,
            ),
        };
        found.ok_or_else(|| self.motion_refused_error(b))
    }

    /// Error: the section law refuses the motion.
    pub(super) fn motion_refused_error(&self, b: &Wrench) -> Error {
        Error::domain(format!(
            "the motion of the rod cannot be followed along it, its section law refuses: {}",
            self.law.wrench_text(b)
        ))
    }

    fn scaled_load(&self, load: Option<&DistributedLoad>) -> ScaledLoad {
        load.map_or_else(ScaledLoad::nothing, |load| ScaledLoad::new(load, self))
    }

    fn inertia_with_load<const J: usize, C: LoadState<J>, const K: usize>(
        &self,
        mass: &SectionMass,
        b: &Wrench,
        load: &C::Load,
        motion: &RodRates,
        (track, end): &Tracked<J, C>,
    ) -> Option<SpaceRodInertia> {
        let field = MovingRod {
            sections: SectionRates::of(self),
            load,
            b,
            rates: motion.rates(),
            rotary: mass.per_mass(self.length),
        };
        let (sums, second, couple) = field.inertia_along_track::<J, C, K>(track, end)?;
        Some(self.generalized(&sums, mass.mass, &second, couple))
    }

    /// The integrals in the user's units; `couple` is m(1)_tt.
    pub(super) fn generalized<const K: usize>(
        &self,
        sums: &InertiaIntegrals<K>,
        mass: f64,
        end: &Second,
        couple: Vector3<f64>,
    ) -> SpaceRodInertia {
        let length = self.length;
        // Integrals are in lengths L; V is in the user's.
        let unit = mass * length * length;
        let mut matrix = SMatrix::<f64, 12, 12>::zeros();
        let mut force = SVector::<f64, 12>::zeros();
        for i in 0..3 {
            matrix[(i, i)] = mass;
            force[i] = sums.base[i] * mass * length;
            for k in 0..K {
                matrix[(i, 3 + k)] = sums.mixed[i][k] * mass * length;
                matrix[(3 + k, i)] = matrix[(i, 3 + k)];
            }
        }
        for i in 0..K {
            force[3 + i] = sums.chart[i] * unit;
            for k in 0..K {
                matrix[(3 + i, 3 + k)] = sums.own[i][k] * unit;
            }
        }
        SpaceRodInertia {
            matrix,
            force,
            centre: sums.first * length,
            momentum: sums.momentum * unit,
            second: join(&three(end, 0), &(three(end, 3) * length)),
            couple: couple * self.units().0,
        }
    }
}
