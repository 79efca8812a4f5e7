//! Exact reductions of a viscoelastic rod with a body to ordinary differential equations: AMV Sec. 6.
//!
//! A uniform rod, straight without load, moves with strains e(t) that do not depend on s exactly when the local
//! resultants do not either. With constant w = (m, n) along the directors the balances n' = 0, m' + r' x n = 0 read
//! ```text
//! u x n = 0,      u x m + v x n = 0.                                                                    (A)
//! ```
//! (AMV's (6.16), (6.19) for u = 0.) Then the material gives w from (e, e_t), and V = Q^T e_t has the few
//! components of e_t. The body's equation of motion is the ODE, provided that nothing accelerates the body
//! out of that motion (B). Three kinds of motion pass:
//!
//! * longitudinal, e = (0, 0, u3, 0, 0, v3(t)): mu v3'' = -n3 + loads, AMV (6.3);
//! * twisting, e = (0, 0, u3(t), 0, 0, v3(t)), with J3 u3'' = -m3 + couple. It suffices that the section's law is
//!   invariant under half a turn about d3; AMV ask for isotropy, which they need for shear at the same time, (6.21);
//! * shearing, u = 0, e = (0, 0, 0, v(t)), mu v'' = -n + loads, with (6.19), v x n = 0: the force goes
//!   through the clamp.
//!
//! In the first two (A) holds whatever the motion, by the symmetry of the law. In shearing it is an identity only if
//! flexure is rigid, for then m is a reaction that need not be constant along the rod. Else v x n = 0 is no identity
//! for any law of strain-rate type: by (2.33) n covers an open set as v_t varies, and so leaves the line of v. It is
//! two equations beside the three of motion, which only exceptional motions satisfy: shear that dies out as
//! exp(-sigma t) while a load holds the stretch, or a motion whose loads were made for it. A perturbation leaves
//! them, so (A) and (B) are checked at the start, with their first derivatives.
//!
//! A recognised motion is still integrated as the whole rod, which reaches the same digits on 8 nodes in
//! fewer steps (scenes/plunge.toml: 72 steps and 1627 right-hand sides against 399 and 4790 of the body's
//! equation). The use of a reduction is insight: the [`Equivalent`] spring and dashpot.
//!
//! The rod has length 1; loads, velocity and pose are those of the clamp's frame.

mod balance;
mod equivalent;

pub use equivalent::{Equivalent, EquivalentMode};

use balance::{Balance, ReducedState, Slots};
use nalgebra::Vector6;
use snaprod_systems::body::Mass;
use snaprod_systems::error::{InUnits, Message, Quantity};
use snaprod_systems::section::Strain;
use snaprod_systems::section::rate::Viscoelastic;
use std::fmt;

/// Kind of reduced motion, by the strains that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReductionKind {
    /// v3 alone.
    Longitudinal,
    /// u3 and v3.
    Twisting,
    /// v1, v2, v3 with constant directors.
    Shearing,
}

impl fmt::Display for ReductionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Longitudinal => "longitudinal",
            Self::Twisting => "twisting",
            Self::Shearing => "shearing",
        })
    }
}

/// Initial state of a motion.
#[derive(Debug, Clone)]
pub struct ReducedStart<'a> {
    /// The time.
    pub time: f64,
    /// The strains at one or more places along the rod.
    pub strains: &'a [Strain],
    /// The strains z of each Maxwell branch at some places along the rod; empty: all relaxed, z = e.
    pub branches: &'a [Vec<Strain>],
    /// (omega(1), r_t(1)); omega = 0 for an end on a ball joint.
    pub velocity: Vector6<f64>,
}

/// Reason why a motion is none of the three kinds.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal(Message);

impl Refusal {
    /// The reason, with numbers in `units`.
    pub fn in_units(&self, units: InUnits<'_>) -> Self {
        Self(self.0.in_units(units))
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Refusal {}

/// A motion that ordinary differential equations govern exactly.
#[derive(Debug, Clone)]
pub struct Reduction {
    section: Viscoelastic,
    carried: Mass,
    kind: ReductionKind,
    slots: Slots,
    start: ReducedState,
    /// True if (A) and (B) hold in all motions of this kind.
    identical: bool,
}

/// Largest difference of strains that count as constant along the rod.
const SAME: f64 = 1e-10;
/// Largest relative defect of (A) and (B) at the start and at nearby states.
const EXACT: f64 = 1e-9;
/// Largest relative defect of their rates of change along the motion, which are found by differences.
const HELD: f64 = 1e-6;

impl Reduction {
    /// Decides whether the motion from `start` is of one of the three kinds, the simplest first.
    ///
    /// The laws are evaluated at the start and, for conditions on all motions of the kind, at some states
    /// nearby. A defect that vanishes at all of them escapes, as does a pulse in time.
    ///
    /// # Errors
    /// [`Refusal`]: why the motion is of none.
    pub fn recognise(
        section: &Viscoelastic,
        carried: &Mass,
        start: &ReducedStart,
    ) -> Result<Self, Refusal> {
        let refuse = |why: Message| Err(Refusal(why));
        if carried.support().is_some_and(|clamp| !clamp.is_fixed()) {
            return refuse("the clamp moves".into());
        }
        let Some(strain) = start.strains.first() else {
            return refuse("no strains are given at the start".into());
        };
        if !uniform(section, strain) {
            return refuse(
                "the section varies along the rod: so do the strains, and the motion has memory"
                    .into(),
            );
        }
        let rest = match section.elastic.unloaded(0.0) {
            Ok(rest) => rest,
            Err(e) => return refuse(format!("the unloaded section: {e}").into()),
        };
        if [0, 1, 3, 4].iter().any(|i| rest[*i].abs() > SAME) {
            let words = Message::from("the rod is not straight without load: its strains are ");
            return refuse(words.list(rest.as_slice(), Quantity::of_strain));
        }
        if !constant(start.strains) {
            return refuse(
                "the strains at the start are not the same all along the rod: the motion remembers their shape".into(),
            );
        }
        if !(strain[0].abs().max(strain[1].abs()) <= SAME) {
            return refuse(
                Message::from("the rod is bent (u1 = ")
                    .number(strain[0], Quantity::Curvature)
                    .words(", u2 = ")
                    .number(strain[1], Quantity::Curvature)
                    .words("): flexure has memory, AMV Sec. 6"),
            );
        }
        let branches = match remembered(section, strain, start.branches) {
            Ok(branches) => branches,
            Err(why) => return refuse(why),
        };
        let given = UniformStart {
            time: start.time,
            strain: *strain,
            branches,
            velocity: start.velocity,
        };
        let mut reasons = Message::default();
        for kind in [
            ReductionKind::Longitudinal,
            ReductionKind::Twisting,
            ReductionKind::Shearing,
        ] {
            match Self::of_kind(kind, section, carried, &given) {
                Ok(reduction) => return Ok(reduction),
                Err(why) => {
                    let next = match kind {
                        ReductionKind::Longitudinal => "",
                        _ => "; ",
                    };
                    reasons = reasons.words(format!("{next}not {kind}: ")).then(why);
                }
            }
        }
        refuse(reasons)
    }

    fn of_kind(
        kind: ReductionKind,
        section: &Viscoelastic,
        carried: &Mass,
        given: &UniformStart,
    ) -> Result<Self, Message> {
        let rigid = section.rate.rigid();
        let e = &given.strain;
        let moving: &[usize] = match kind {
            ReductionKind::Longitudinal => &[5],
            ReductionKind::Twisting => &[2, 5],
            ReductionKind::Shearing => &[3, 4, 5],
        };
        let slots = Slots::new(moving.iter().copied().filter(|i| !rigid[*i]));
        let sheared = e[3].abs().max(e[4].abs()) > SAME;
        match kind {
            ReductionKind::Longitudinal if rigid[5] => return Err("the rod is inextensible".into()),
            ReductionKind::Twisting if rigid[2] => return Err("the section cannot twist".into()),
            ReductionKind::Twisting if !carried.turns() => {
                return Err("the end is free to turn, so that no couple twists the rod".into());
            }
            ReductionKind::Shearing if rigid[3] && rigid[4] => {
                return Err("the section cannot shear".into());
            }
            ReductionKind::Shearing if e[2].abs() > SAME => {
                return Err(Message::from("the rod is twisted (u3 = ")
                    .number(e[2], Quantity::Curvature)
                    .words(")"));
            }
            ReductionKind::Longitudinal | ReductionKind::Twisting if sheared => {
                return Err(format!("the rod is sheared (v1 = {}, v2 = {})", e[3], e[4]).into());
            }
            _ => {}
        }
        for (i, branch) in given.branches.iter().enumerate() {
            if (0..6).any(|k| !slots.contains(k) && (branch[k] - e[k]).abs() > SAME) {
                return Err(format!(
                    "Maxwell branch {i} is not relaxed in a strain that would have to stay constant"
                )
                .into());
            }
        }
        let velocity = given.velocity;
        let size = velocity.amax();
        if let Some(k) =
            (0..6).find(|k| !slots.contains(*k) && !(velocity[*k].abs() <= SAME * size))
        {
            let names = ["omega1", "omega2", "omega3", "v1", "v2", "v3"];
            return Err(
                Message::from(format!("the end starts with {} = ", names[k]))
                    .number(velocity[k], Quantity::of_twist(k))
                    .words(" along the clamp's directors"),
            );
        }
        if let Mass::Rigid(body) = carried {
            let (c, j) = (body.offset(), body.inertia());
            let off = c.x.abs().max(c.y.abs()) > SAME;
            if kind != ReductionKind::Shearing && off && !rigid[..3].iter().all(|r| *r) {
                return Err(Message::from("the centre of mass is off the axis, at ")
                    .list(&[c.x, c.y], |_| Quantity::Length)
                    .words(" along d1, d2, so that the body bends the rod"));
            }
            if kind == ReductionKind::Twisting
                && j[(0, 2)].abs().max(j[(1, 2)].abs()) > SAME * j.amax()
            {
                return Err("d3 is not a principal axis of the body's inertia".into());
            }
        }
        let mut reduction = Self {
            section: section.clone(),
            carried: carried.clone(),
            kind,
            start: ReducedState {
                time: given.time,
                strain: *e,
                rate: slots.only(&velocity),
                branches: given.branches.clone(),
            },
            slots,
            identical: true,
        };
        let balance = reduction.demand(&reduction.start, EXACT)?;
        if let Err(why) = reduction.probe() {
            // Only shearing can be exact by exception.
            if kind != ReductionKind::Shearing {
                return Err(why);
            }
            reduction.identical = false;
            reduction.first_order(&balance)?;
        }
        Ok(reduction)
    }

    /// The balance at a state, if (A) and (B) hold there to a relative `tolerance`.
    fn demand(&self, at: &ReducedState, tolerance: f64) -> Result<Balance, Message> {
        let balance = self.balance(at).map_err(|e| e.to_string())?;
        match balance.defect() {
            (size, why) if !(size <= tolerance) => {
                Err(format!("{why} (relative defect {size:.1e})").into())
            }
            _ => Ok(balance),
        }
    }

    /// Checks (A) and (B) at nearby states and times, as they must hold in all motions of the kind.
    fn probe(&self) -> Result<(), Message> {
        let speed = self.start.rate.amax().max(0.1);
        for i in 0..12_u32 {
            let wave = |k: usize| (1.0 + f64::from(i) * (1.3 + 0.7 * k as f64)).sin();
            let mut at = self.start.clone();
            at.time += 0.37 * 10f64.powi(i as i32 % 6 - 2);
            for k in self.slots.iter() {
                at.strain[k] += 0.05 * wave(k);
                at.rate[k] += speed * wave(k + 7);
                for branch in &mut at.branches {
                    branch[k] += 0.05 * wave(k + 13);
                }
            }
            // A state beyond the law's domain says nothing.
            if self.balance(&at).is_ok() {
                self.demand(&at, EXACT)?;
            }
        }
        Ok(())
    }

    /// Checks that the time derivatives of the defects vanish along the motion.
    fn first_order(&self, balance: &Balance) -> Result<(), Message> {
        let slope = self.slope(&self.start, balance);
        let step = 1e-4 / (1.0 + slope.size());
        let moved = |h: f64| {
            self.balance(&self.start.moved(&slope, h))
                .map_err(|e| e.to_string())
        };
        let (after, before) = (moved(step)?, moved(-step)?);
        let rate = (after.defects() - before.defects()).amax() / (2.0 * step);
        if rate <= HELD * balance.scale() * (1.0 + slope.size()) {
            return Ok(());
        }
        Err(Message::from(
            "v x n = 0, AMV (6.19), or the balance of the body holds at the start, but is lost at the rate ",
        )
        .size(rate / balance.scale(), Quantity::Rate)
        .words(", relative to its terms"))
    }

    /// The kind of the motion.
    pub fn kind(&self) -> ReductionKind {
        self.kind
    }

    /// True if every motion with such a start is exact, by symmetry; false if only this one is, by exception.
    pub fn is_identical(&self) -> bool {
        self.identical
    }

    /// Indices in (u1, .. v3) of the strains that move.
    pub fn moving(&self) -> Vec<usize> {
        self.slots.iter().collect()
    }
}

/// The initial state, constant along the rod.
struct UniformStart {
    time: f64,
    strain: Strain,
    branches: Vec<Strain>,
    velocity: Vector6<f64>,
}

fn constant(field: &[Strain]) -> bool {
    field.iter().all(|e| {
        e.iter().all(|x| x.is_finite()) && (e - field[0]).amax() <= SAME * (1.0 + field[0].amax())
    })
}

/// True if the elastic law is uniform by its own account and the rate law gives the same overstress at some places.
fn uniform(section: &Viscoelastic, e: &Strain) -> bool {
    let rigid = section.rate.rigid();
    let rates = Strain::from_fn(|i, _| if rigid[i] { 0.0 } else { 0.3 - 0.1 * i as f64 });
    let at = |s: f64| section.rate.overstress(s, e, &rates).ok();
    let middle = at(0.5);
    section.elastic.is_uniform()
        && section.rate.breaks().is_empty()
        && [0.0, 0.03, 0.21, 0.379, 0.618, 0.83, 1.0]
            .iter()
            .all(|s| match (at(*s), middle) {
                (Some(a), Some(b)) => (a - b).amax() <= 1e-12 * b.amax(),
                // Errors of the law are reported where it is used.
                (None, None) => true,
                _ => false,
            })
}

fn remembered(
    section: &Viscoelastic,
    e: &Strain,
    fields: &[Vec<Strain>],
) -> Result<Vec<Strain>, Message> {
    let count = section.branches.len();
    if fields.is_empty() {
        return Ok(vec![*e; count]);
    }
    if fields.len() != count {
        return Err(format!(
            "strains of {} Maxwell branches are given, the section has {count}",
            fields.len()
        )
        .into());
    }
    fields
        .iter()
        .map(|field| match field.first() {
            Some(z) if constant(field) => Ok(*z),
            _ => {
                Err("the strains of the Maxwell branches are not the same all along the rod".into())
            }
        })
        .collect()
}
