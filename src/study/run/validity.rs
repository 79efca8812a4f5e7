//! Whether leaving out the mass of the rod is right: numbers of a planar rod at rest, and of one run (theory 2.8, 2.9).

use super::ModelKind;
use super::prepared::{Light, Prepared};
use super::record::RunBranch;
use crate::elastica::inertia::{INERTIAL_ESCAPE, RodInertia, VISCOUS_ESCAPE};
use crate::elastica::{EndStiffness, Equilibrium, HeldMode, Passage, held_modes, settled};
use crate::motion::{Bounce, Ledger, Snap};
use crate::scene::Units;
use nalgebra::Vector2;
use serde_json::{Value, json};

/// What the mass of a light rod changes where it rests, in the scene's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallMass {
    /// Mass of the rod over that of the body.
    pub eps: f64,
    /// Relative change of the lowest frequency of small motions about the equilibrium under the loads at t = 0, to first order; None
    /// where there is no stable one, and for a straight rod under a load along it.
    pub frequency_shift: Option<f64>,
    /// Lowest angular frequency of the rod's own vibrations there, its end held.
    pub rod_frequency: Option<f64>,
    /// Its decay, per time; 0 of a rod without friction.
    pub rod_decay: Option<f64>,
    /// True if the mass of the rod is followed to first order.
    pub followed: bool,
}

/// What the mass of a light rod would change in a run, in the scene's units.
#[derive(Debug, Clone)]
pub struct Validity {
    /// About the equilibrium under the loads at t = 0.
    pub rest: SmallMass,
    /// The folds that were passed.
    pub folds: Vec<FoldPassed>,
    /// The bounces of the taut rod that were kept.
    pub bounces: Vec<BouncePassed>,
    damped: bool,
}

/// What a run follows at a fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// Nothing: the rod jumps.
    Jump,
    /// The friction of the rod.
    Friction,
    /// Mass and friction.
    Mass,
}

/// A fold, and by how much mass or friction delays the snap.
#[derive(Debug, Clone, Copy)]
pub struct FoldPassed {
    /// The branch of the run that passed it.
    pub branch: usize,
    /// Its time.
    pub t: f64,
    /// What the run follows of it.
    pub follows: Follows,
    /// The numbers of its normal form, in units of the rod.
    pub form: Passage,
    /// Delay by the rod's mass alone.
    pub inertial_delay: f64,
    /// Delay by its friction alone; None without friction.
    pub viscous_delay: Option<f64>,
    /// eta D0 T_i/(eps M0): friction holds the rod back where it is large, mass where it is small (theory 2.8).
    pub ratio: f64,
    /// The energy that the light rod releases there.
    pub released: f64,
    /// The time until the next fold of the same branch, or its end.
    pub until_next: f64,
    /// How the energies change in that time, where the run follows the rod through the snap.
    pub changes: Option<Ledger>,
    /// How far the rod's slowest vibration has died down by then, as the x in exp(-x); None where its decay is not known.
    pub quiet: Option<f64>,
}

/// What becomes of a snap of a rod with mass, from the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Landing {
    /// It is late by a good part of the time to the next fold.
    Late,
    /// The rod rings for ever.
    Undamped,
    /// The rod still rings at the next event.
    Ringing,
    /// The rod is quiet before.
    Safe,
}

impl FoldPassed {
    /// The delay that the run leaves out.
    fn delay(&self) -> f64 {
        match self.follows {
            Follows::Jump => self.inertial_delay.max(self.viscous_delay.unwrap_or(0.0)),
            Follows::Friction if self.ratio > RULES => 0.0,
            Follows::Friction => self.inertial_delay,
            Follows::Mass => 0.0,
        }
    }

    fn landing(&self) -> Landing {
        if self.follows == Follows::Friction && self.ratio > RULES {
            return Landing::Safe;
        }
        if self.delay() > SHORT * self.until_next.max(0.0) {
            return Landing::Late;
        }
        match self.quiet {
            Some(quiet) if quiet >= QUIET => Landing::Safe,
            Some(quiet) if quiet > 0.0 => Landing::Ringing,
            Some(_) | None => Landing::Undamped,
        }
    }

    /// Its numbers as an event has them.
    pub(super) fn json(&self) -> Value {
        let verdict = match self.landing() {
            _ if self.follows == Follows::Mass => "followed with its mass",
            Landing::Safe if self.delay() == 0.0 => "friction holds it back, not its mass",
            Landing::Late => "late: the landing is not safe",
            Landing::Undamped => "rings on: where it lands is a rule, not physics",
            Landing::Ringing => "still rings at the next event: the landing is not safe",
            Landing::Safe => "quiet before the next event",
        };
        json!({
            "viscous_delay": self.viscous_delay,
            "inertial_delay": self.inertial_delay,
            "friction_over_inertia": self.ratio,
            "until_next": self.until_next,
            "ringing_decays": self.quiet,
            "verdict": verdict,
        })
    }

    /// How the energies change until the next fold, where the run follows the rod through the snap.
    pub(super) fn energies(&self) -> Option<Value> {
        let ledger = self.changes?;
        Some(json!({
            "kinetic": ledger.kinetic,
            "rod_kinetic": ledger.rod_kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
        }))
    }

    pub(super) fn form(&self) -> Value {
        json!({
            "A": self.form.drive, "B": self.form.bend, "M0": self.form.mass, "D0": self.form.friction,
        })
    }
}

/// A bounce.
#[derive(Debug, Clone, Copy)]
pub struct BouncePassed {
    /// Its time.
    pub t: f64,
    /// eta lam^2/(m v): friction takes no part of the energy where it is small.
    pub number: f64,
    /// sqrt(eps) v/(4 sin^2(gam/4)): the mass of the rod takes no part where it is small.
    pub inertia: f64,
}

/// Fundamental vibration of a straight clamped rod whose other end is held in place: omega^2 = x^4, cos x sinh x = sin x cosh x.
const STRAIGHT: HeldMode = HeldMode {
    stiffness: 237.721_067_534_944_6,
    friction: 118.860_533_767_472_3,
};
/// 33/140: what the straight rod adds to a mass that moves across it.
const ACROSS: f64 = 33.0 / 140.0;
/// Delays above this part of the time to the next event are not short.
const SHORT: f64 = 0.2;
/// Decays of the ringing after which a rod counts as at rest.
const QUIET: f64 = 5.0;
/// Friction rules at a fold where it is so many times the inertia.
const RULES: f64 = 10.0;
/// Mass ratios above this are not small.
const HEAVY: f64 = 0.1;
/// Bounce numbers above this change the motion.
const HARD: f64 = 0.1;

impl SmallMass {
    /// About the equilibrium `at`, None of the straight rod, in units of time of the rod.
    pub(in crate::study) fn new(light: &Light, at: Option<&Equilibrium>, time: f64) -> Self {
        let (frequency_shift, mode) = match at {
            None if light.load == Vector2::zeros() => {
                (Some(-0.5 * light.eps * ACROSS), Some(STRAIGHT))
            }
            // A pull along the straight rod changes its shapes: these numbers are those of the unloaded one.
            None => (None, None),
            Some(at) => (
                shift(at.p, at.w, light.eps),
                held_modes(at.p, at.w, 1)
                    .ok()
                    .and_then(|m| m.first().copied()),
            ),
        };
        Self {
            eps: light.eps,
            frequency_shift,
            rod_frequency: mode.and_then(|m| Some(m.frequency(light.eps)? / time)),
            rod_decay: mode.map(|m| m.friction * light.eta / light.eps / time),
            followed: light.followed,
        }
    }

    /// In one sentence.
    pub fn text(&self, units: Units) -> String {
        let rate = match units.time() {
            "" => String::new(),
            time => format!(" rad/{time}"),
        };
        let mut text = format!("the rod has {:.2e} of the body's mass", self.eps);
        if let Some(shift) = self.frequency_shift {
            text += &format!(", which lowers the lowest frequency by {}", percent(shift));
        }
        if let Some(omega) = self.rod_frequency {
            text +=
                &format!("; with its end held it vibrates at omega {omega:.4e}{rate} and above");
            text += &match self.rod_decay {
                Some(decay) if decay > 0.0 => format!(", which decays as exp(-{decay:.2e} t)"),
                _ => ", without friction".to_owned(),
            };
        }
        text
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "eps": self.eps,
            "frequency_shift": self.frequency_shift,
            "rod_frequency": self.rod_frequency,
            "rod_decay": self.rod_decay,
        })
    }
}

fn percent(x: f64) -> String {
    match 100.0 * x.abs() {
        x if x >= 10.0 => format!("{x:.0} %"),
        x if x >= 0.1 => format!("{x:.1} %"),
        x => format!("{x:.0e} %"),
    }
}

impl Prepared {
    /// What the mass of the rod changes where it rests under the loads at t = 0; None unless the rod is planar, of known mass, without
    /// waves of its own, on a clamp that stands, and where no stable equilibrium is found.
    pub fn small_mass(&self) -> Option<SmallMass> {
        if self.is_full() {
            return None;
        }
        self.mass_at_rest()
    }

    fn mass_at_rest(&self) -> Option<SmallMass> {
        let light = self.light.as_ref()?;
        let rest = settled(&light.load).ok()?;
        Some(SmallMass::new(light, rest.as_ref(), light.time))
    }
}

impl Validity {
    /// Of a run whose branches are given; None as of [`Prepared::small_mass`].
    pub(super) fn of(
        prepared: &Prepared,
        branches: &[RunBranch],
        folds: &[FoldPassed],
    ) -> Option<Self> {
        if prepared.kind().in_space() {
            // Under a load along the rod folds and bounces are not those of the closed form.
            return None;
        }
        let (light, rest) = (prepared.light.as_ref()?, prepared.small_mass()?);
        let time = prepared.scales.time;
        let bounces = branches.iter().flat_map(|b| &b.bounces);
        Some(Self {
            rest,
            folds: folds.to_vec(),
            bounces: bounces
                .map(|b| bounce(b, light.eps, light.eta, time))
                .collect(),
            damped: light.eta > 0.0,
        })
    }

    /// One sentence each about the motion, its snaps and its bounces.
    pub fn verdict(&self) -> String {
        let SmallMass {
            eps,
            frequency_shift,
            followed,
            ..
        } = self.rest;
        let mut parts = Vec::new();
        let half = 0.5 * eps;
        let size = frequency_shift.unwrap_or(half).abs();
        parts.push(match followed {
            true if eps > HEAVY => format!(
                "the rod's mass is followed to first order, which is for rods of less than {HEAVY} of the body's mass: write inertia = \"full\" \
                 (it changes the lowest frequency by {})",
                percent(size)
            ),
            true => format!(
                "the rod's mass is followed to first order, which changes the lowest frequency by {} and leaves an error of about {}",
                percent(size),
                percent(eps * eps)
            ),
            false => format!("massless rod: smooth motion good to about {}", percent(size)),
        });
        if !self.folds.is_empty() {
            parts.push(self.of_snaps());
        }
        let most = |f: fn(&BouncePassed) -> f64| self.bounces.iter().map(f).fold(0.0, f64::max);
        let (number, inertia) = (most(|b| b.number), most(|b| b.inertia));
        if inertia > HARD || number > HARD {
            let friction = match self.damped {
                true => format!("that of friction is up to {number:.1e}, "),
                false => String::new(),
            };
            parts.push(format!(
                "bounces depend on the model: of the numbers that should be below {HARD} {friction}that of the rod's mass is up to {inertia:.1e}"
            ));
        } else if !self.bounces.is_empty() && !self.damped {
            parts.push(
                "bounces are elastic, which depends on the model: a real rod has friction"
                    .to_owned(),
            );
        }
        parts.join("; ")
    }

    fn of_snaps(&self) -> String {
        let longest = self.folds.iter().map(FoldPassed::delay).fold(0.0, f64::max);
        let worst = self.folds.iter().map(FoldPassed::landing).min();
        let decay = self.rest.rod_decay.unwrap_or(0.0);
        let followed = self
            .folds
            .iter()
            .all(|fold| fold.follows == Follows::Friction);
        match worst.unwrap_or(Landing::Safe) {
            Landing::Safe if longest == 0.0 => {
                "snaps are held back by friction, not by mass".to_owned()
            }
            worst if followed => format!(
                "snaps are late by up to {longest:.1e} more than friction makes them{}",
                match worst {
                    Landing::Safe => ", and the rod is quiet again before the next event",
                    _ => ", or ring at the next event: landings are not safe",
                }
            ),
            Landing::Late => format!(
                "snaps are late by up to {longest:.1e}, which is not short against the time to the next event: landings are not safe"
            ),
            Landing::Undamped => format!(
                "snaps are late by up to {longest:.1e}; without friction the rod rings on after them, and where it lands is a rule, not physics"
            ),
            Landing::Ringing => format!(
                "snaps are late by up to {longest:.1e}; the rod still rings at the next event (its vibrations decay as exp(-{decay:.1e} t)): landings are not safe"
            ),
            Landing::Safe => format!(
                "snaps are late by up to {longest:.1e}, and the rod is quiet again before the next event"
            ),
        }
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let folds = self.folds.iter().map(|fold| {
            let mut json = fold.form();
            json["t"] = fold.t.into();
            json["viscous_delay"] = fold.viscous_delay.into();
            json["inertial_delay"] = fold.inertial_delay.into();
            json
        });
        let bounces = self
            .bounces
            .iter()
            .map(|b| json!({ "t": b.t, "number": b.number, "inertia_number": b.inertia }));
        let mut json = self.rest.json();
        json["verdict"] = self.verdict().into();
        json["folds"] = folds.collect();
        json["bounces"] = bounces.collect();
        json
    }
}

/// -eps/2 v.A v for the softest direction v of the end.
fn shift(p: f64, w: f64, eps: f64) -> Option<f64> {
    let [(_, v), _] = EndStiffness::at(p, w).ok()?.principal();
    let added = RodInertia::new(p, w)
        .ok()?
        .added(&Vector2::zeros(), &Vector2::zeros())?;
    Some(-0.5 * eps * v.dot(&(added.mass * v)))
}

/// The folds that a planar rod of known mass passed in the branches of a run: its snaps, or those of the light rod beside it.
pub(super) fn folds(prepared: &Prepared, branches: &[RunBranch]) -> Vec<FoldPassed> {
    let (Some(light), Some(rest)) = (prepared.light.as_ref(), prepared.mass_at_rest()) else {
        return Vec::new();
    };
    let k = &prepared.scales;
    let mut folds = Vec::new();
    for branch in branches {
        let snaps = branch.entered.iter().chain(&branch.snaps);
        let crossed = branch.crossed.iter();
        let all: Vec<(&Snap, Option<Ledger>)> = snaps
            .map(|snap| (snap, None))
            .chain(crossed.map(|c| (&c.snap, Some(c.ledger.scaled(k.energy)))))
            .collect();
        for (i, (snap, ledger)) in all.iter().enumerate() {
            let next = all.get(i + 1);
            let until = next.map_or(branch.last.t, |(next, _)| next.t * k.time);
            let then = next.map_or(Some(branch.last.ledger), |(_, ledger)| *ledger);
            let changes = ledger.zip(then).map(|(here, then)| then.less(&here));
            folds.extend(
                fold(prepared, (branch.id, snap), light, until, rest.rod_decay)
                    .map(|fold| FoldPassed { changes, ..fold }),
            );
        }
    }
    folds
}

fn fold(
    prepared: &Prepared,
    (branch, snap): (usize, &Snap),
    light: &Light,
    next: f64,
    decay: Option<f64>,
) -> Option<FoldPassed> {
    let k = &prepared.scales;
    let v = prepared.inward(snap)?;
    let form = Passage::new(snap.from.q[0], snap.from.q[1], &v).ok()?;
    let t = snap.t * k.time;
    let viscous = || VISCOUS_ESCAPE * form.viscous(light.eta) * k.time;
    Some(FoldPassed {
        branch,
        t,
        follows: match prepared.kind() {
            _ if prepared.is_full() => Follows::Mass,
            ModelKind::Sheet | ModelKind::ElasticSpace => Follows::Jump,
            ModelKind::Planar | ModelKind::Space => Follows::Friction,
        },
        ratio: light.eta * form.friction * form.inertial(light.eps) / (light.eps * form.mass),
        released: snap.released * k.energy,
        changes: None,
        form,
        inertial_delay: INERTIAL_ESCAPE * form.inertial(light.eps) * k.time,
        viscous_delay: (light.eta > 0.0).then(viscous),
        until_next: next - t,
        quiet: decay.map(|decay| decay * (next - t)),
    })
}

/// All that moves along the pull is in the rod where it is hardest: E = m v^2/2 = 4 S^2 lam, S = sin(gam/4).
fn bounce(bounce: &Bounce, eps: f64, eta: f64, time: f64) -> BouncePassed {
    let (energy, lam) = (bounce.elastic, bounce.lambda);
    let v = (2.0 * energy).sqrt();
    BouncePassed {
        t: bounce.t * time,
        number: eta * lam * lam / v,
        inertia: eps.sqrt() * v * lam / energy,
    }
}
