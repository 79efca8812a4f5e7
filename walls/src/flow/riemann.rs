//! Riemann problems of the flow in a uniform tube, and of a tube that ends (docs/tubes.md 5).
//!
//! The waves are those of the [`Law1d`] over the volume of fluid, which move with the fluid: a wave of the speed M over
//! the volume passes the place of an area a at u - M/a or u + M/a.

use super::FlowLaw;
use snaprod_core::{Error, Result};
use snaprod_waves::law1d::{Law1d, Wave, WaveKind};

/// A state of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowState {
    /// Area a.
    pub area: f64,
    /// Velocity u.
    pub velocity: f64,
}

/// A part of a wave, with speeds over the tube, positive towards +x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowWave {
    /// Elastic jump or fan.
    pub kind: WaveKind,
    /// Area ahead.
    pub from: f64,
    /// Area behind.
    pub to: f64,
    /// Speed of the front.
    pub head: f64,
    /// Speed of the end; that of the front for a jump.
    pub tail: f64,
}

/// Direction of a wave over the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Towards -x.
    Left,
    /// Towards +x.
    Right,
}

impl Way {
    fn sign(self) -> f64 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }
}

/// The solution of a Riemann problem: self-similar in x/t.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowStar {
    /// State between the two waves.
    pub between: FlowState,
    /// Parts of the wave towards -x over the fluid, the foremost first.
    pub left: Vec<FlowWave>,
    /// Parts of the wave towards +x over the fluid, the foremost first.
    pub right: Vec<FlowWave>,
    sides: [FlowState; 2],
}

impl FlowLaw {
    /// Solves the Riemann problem of two states exactly, in the units of the law.
    ///
    /// # Errors
    /// Areas that the law does not have; states that part or meet so fast that no area stands between them.
    pub fn riemann(&self, left: FlowState, right: FlowState) -> Result<FlowStar> {
        self.check(left.area)?;
        self.check(right.area)?;
        let pair = |state: FlowState| [1.0 / state.area, state.velocity];
        let star = self.star(pair(left), pair(right));
        let Some([lam, velocity]) = star.filter(|[lam, _]| lam.is_finite()) else {
            let [low, high] = self.areas();
            return Err(Error::unreachable(format!(
                "the areas {} and {} with the speeds {} and {} part or meet so fast that no area between {low} and \
                 {high} stands between them: the tube empties, or bursts",
                left.area, right.area, left.velocity, right.velocity
            )));
        };
        let between = FlowState {
            area: 1.0 / lam,
            velocity,
        };
        Ok(FlowStar {
            between,
            left: self.over_the_tube(left, between.area, Way::Left),
            right: self.over_the_tube(right, between.area, Way::Right),
            sides: [left, right],
        })
    }

    /// The parts of the wave into the state `ahead` that leaves the area `behind`.
    pub(super) fn over_the_tube(&self, ahead: FlowState, behind: f64, way: Way) -> Vec<FlowWave> {
        let sign = way.sign();
        let mut velocity = ahead.velocity;
        let place = |wave: &Wave, velocity: f64| {
            let (from, to) = (wave.from, wave.to);
            let change = match wave.kind {
                WaveKind::Shock => wave.head * (to - from),
                WaveKind::Fan => self.phi(from, to),
            };
            let after = velocity - sign * change;
            let head = velocity + sign * wave.head * from;
            let tail = match wave.kind {
                WaveKind::Shock => head,
                WaveKind::Fan => after + sign * wave.tail * to,
            };
            (
                FlowWave {
                    kind: wave.kind,
                    from: 1.0 / from,
                    to: 1.0 / to,
                    head,
                    tail,
                },
                after,
            )
        };
        let waves = self.waves(1.0 / ahead.area, 1.0 / behind);
        let parts = waves.iter().map(|wave| {
            let (part, after) = place(wave, velocity);
            velocity = after;
            part
        });
        parts.collect()
    }

    /// The state at x/t = `xi` on the way through the wave into the state `ahead`; `None` past the wave.
    pub(super) fn inside_wave(
        &self,
        ahead: FlowState,
        waves: &[FlowWave],
        way: Way,
        xi: f64,
    ) -> Option<FlowState> {
        let sign = way.sign();
        let mut state = ahead;
        // Along sign * x, fronts come in falling order of their speeds.
        for wave in waves {
            if sign * xi >= sign * wave.head {
                return Some(state);
            }
            let (from, to) = (1.0 / wave.from, 1.0 / wave.to);
            let velocity = |lam: f64| state.velocity - sign * self.phi(from, lam);
            match wave.kind {
                WaveKind::Shock => {
                    let rise = self.chord_speed(from, to) * (to - from);
                    state.velocity -= sign * rise;
                }
                WaveKind::Fan if sign * xi > sign * wave.tail => {
                    let off = |lam: f64| velocity(lam) + sign * self.speed(lam) * lam - xi;
                    let ends = ((from, wave.head - xi), (to, wave.tail - xi));
                    let found = snaprod_core::solve::roots::chandrupatla(off, ends.0, ends.1, 0.0);
                    let lam = found.unwrap_or(from);
                    return Some(FlowState {
                        area: 1.0 / lam,
                        velocity: velocity(lam),
                    });
                }
                WaveKind::Fan => state.velocity = velocity(to),
            }
            state.area = wave.to;
        }
        None
    }

    /// The state at x/t = `xi` of a solution.
    pub fn sample(&self, star: &FlowStar, xi: f64) -> FlowState {
        self.inside_wave(star.sides[0], &star.left, Way::Left, xi)
            .or_else(|| self.inside_wave(star.sides[1], &star.right, Way::Right, xi))
            .unwrap_or(star.between)
    }
}
