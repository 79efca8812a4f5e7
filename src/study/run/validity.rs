//! Whether leaving out the mass of the rod was right: numbers of one planar run (theory 2.8, 2.9).

use super::prepared::Prepared;
use super::record::RunBranch;
use crate::elastica::inertia::{INERTIAL_ESCAPE, RodInertia, VISCOUS_ESCAPE};
use crate::elastica::{EndStiffness, HeldMode, Passage, held_modes, settled};
use crate::motion::{Bounce, Snap};
use nalgebra::Vector2;
use serde_json::{Value, json};

/// What the mass of a light rod would change, in the scene's units.
#[derive(Debug, Clone)]
pub struct Validity {
    /// Mass of the rod over that of the body.
    pub eps: f64,
    /// Relative change of the lowest frequency of small motions about the equilibrium under the loads at t = 0, to first order; None
    /// where there is no stable one, and for a straight rod under a load along it.
    pub frequency_shift: Option<f64>,
    /// Lowest angular frequency of the rod's own vibrations there, its end held.
    pub rod_frequency: Option<f64>,
    /// Its decay, per time; 0 of a rod without friction.
    pub rod_decay: Option<f64>,
    /// The folds that were passed.
    pub folds: Vec<FoldPassed>,
    /// The bounces of the taut rod that were kept.
    pub bounces: Vec<BouncePassed>,
    /// True if the run follows the mass of the rod to first order.
    pub followed: bool,
    damped: bool,
    end: f64,
}

/// A fold, and by how much mass or friction would delay the snap.
#[derive(Debug, Clone, Copy)]
pub struct FoldPassed {
    /// Its time.
    pub t: f64,
    /// The numbers of its normal form, in units of the rod.
    pub form: Passage,
    /// Delay by the rod's mass alone.
    pub inertial_delay: f64,
    /// Delay by its friction alone; None without friction.
    pub viscous_delay: Option<f64>,
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
/// Decays of the ringing after which a rod counts as at rest.
const QUIET: f64 = 5.0;
/// Mass ratios above this are not small.
const HEAVY: f64 = 0.1;
/// Bounce numbers above this change the motion.
const HARD: f64 = 0.1;

impl Validity {
    /// Of a run whose branches are given; None unless the rod is planar, of known mass, without waves of its own, on a clamp that stands.
    pub(super) fn of(prepared: &Prepared, branches: &[RunBranch]) -> Option<Self> {
        let light = prepared.light()?;
        let k = &prepared.scales;
        let rest = settled(&light.load).ok()?;
        let (frequency_shift, mode) = match &rest {
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
        let of_snap = |snap: &Snap| fold(prepared, snap, light.eps, light.eta);
        let snaps = (branches.iter()).flat_map(|b| b.entered.iter().chain(&b.snaps));
        let bounces = branches.iter().flat_map(|b| &b.bounces);
        Some(Self {
            eps: light.eps,
            frequency_shift,
            rod_frequency: mode.and_then(|m| Some(m.frequency(light.eps)? / k.time)),
            rod_decay: mode.map(|m| m.friction * light.eta / light.eps / k.time),
            folds: snaps.filter_map(of_snap).collect(),
            bounces: bounces
                .map(|b| bounce(b, light.eps, light.eta, k.time))
                .collect(),
            followed: light.followed,
            damped: light.eta > 0.0,
            end: prepared.run.duration,
        })
    }

    /// One sentence each about the motion, its snaps and its bounces.
    pub fn verdict(&self) -> String {
        let percent = |x: f64| match 100.0 * x.abs() {
            x if x >= 10.0 => format!("{x:.0} %"),
            x if x >= 0.1 => format!("{x:.1} %"),
            x => format!("{x:.0e} %"),
        };
        let mut parts = Vec::new();
        let half = 0.5 * self.eps;
        let size = self.frequency_shift.unwrap_or(half).abs();
        parts.push(match self.followed {
            true if self.eps > HEAVY => format!(
                "the rod's mass is followed to first order, which is for rods of less than {HEAVY} of the body's mass: write inertia = \"full\" \
                 (it changes the lowest frequency by {})",
                percent(size)
            ),
            true => format!(
                "the rod's mass is followed to first order, which changes the lowest frequency by {} and leaves an error of about {}",
                percent(size),
                percent(self.eps * self.eps)
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
        let next = |k: usize| self.folds.get(k + 1).map_or(self.end, |fold| fold.t);
        let delay = |fold: &FoldPassed| fold.inertial_delay.max(fold.viscous_delay.unwrap_or(0.0));
        let late = (self.folds.iter().enumerate())
            .any(|(k, fold)| delay(fold) > 0.2 * (next(k) - fold.t).max(0.0));
        let longest = self.folds.iter().map(delay).fold(0.0, f64::max);
        if late {
            return format!(
                "snaps are late by up to {longest:.1e}, which is not short against the time to the next event: landings are not safe"
            );
        }
        let Some(decay) = self.rod_decay.filter(|decay| *decay > 0.0) else {
            return format!(
                "snaps are late by up to {longest:.1e}; without friction the rod rings on after them, and where it lands is a rule, not physics"
            );
        };
        let rings =
            (self.folds.iter().enumerate()).any(|(k, fold)| decay * (next(k) - fold.t) < QUIET);
        match rings {
            true => format!(
                "snaps are late by up to {longest:.1e}; the rod still rings at the next event (its vibrations decay as exp(-{decay:.1e} t)): landings are not safe"
            ),
            false => format!(
                "snaps are late by up to {longest:.1e}, and the rod is quiet again before the next event"
            ),
        }
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let folds = self.folds.iter().map(|fold| {
            json!({
                "t": fold.t,
                "A": fold.form.drive, "B": fold.form.bend, "M0": fold.form.mass, "D0": fold.form.friction,
                "viscous_delay": fold.viscous_delay,
                "inertial_delay": fold.inertial_delay,
            })
        });
        let bounces = self
            .bounces
            .iter()
            .map(|b| json!({ "t": b.t, "number": b.number, "inertia_number": b.inertia }));
        json!({
            "eps": self.eps,
            "frequency_shift": self.frequency_shift,
            "rod_frequency": self.rod_frequency,
            "rod_decay": self.rod_decay,
            "verdict": self.verdict(),
            "folds": folds.collect::<Vec<_>>(),
            "bounces": bounces.collect::<Vec<_>>(),
        })
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

fn fold(prepared: &Prepared, snap: &Snap, eps: f64, eta: f64) -> Option<FoldPassed> {
    let k = &prepared.scales;
    let v = prepared.inward(snap)?;
    let form = Passage::new(snap.from.q[0], snap.from.q[1], &v).ok()?;
    Some(FoldPassed {
        t: snap.t * k.time,
        form,
        inertial_delay: INERTIAL_ESCAPE * form.inertial(eps) * k.time,
        viscous_delay: (eta > 0.0).then(|| VISCOUS_ESCAPE * form.viscous(eta) * k.time),
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
