//! Flat discs with a held edge in motion: conical rings of equal width, masses at their rims, central differences.
//!
//! A ring between the rims i and i + 1 is the frustum of a cone. Its stretches are uniform: l1 is its length over the
//! width h, l2 its mean radius over the unloaded one. With the unloaded volumes v of the rings and the volume V below
//! the surface the rims obey
//! ```text
//! m x'' = -d(sum v W(l1, l2))/dx + p dV/dx,   V = sum (pi/3)(r0^2 + r0 r1 + r1^2)(z0 - z1),
//! ```
//! The pressure p is given over time, or that of gas. The pressure follows the surface, and d(kinetic + stored) = p dV
//! up to the error of the steps. Each mass m
//! is the row sum of the mass matrix of linear elements. The steps are central differences in the velocity form, (6.41)
//! of the thesis named in docs/tubes.md.

use super::{Filling, Inflated, Shape};
use snaprod_core::{Error, Result};
use std::f64::consts::PI;
use std::fmt;

/// Part of the step at which a linear wave in the stiffest ring becomes unstable. Shocks need less than half of it.
const SAFE: f64 = 0.3;
/// Stretch below which a ring counts as collapsed.
const COLLAPSED: f64 = 0.1;
/// Compressive stress, in parts of the first constant of the material, from which a ring counts as wrinkled: rounding
/// lies far below.
const WRINKLED: f64 = 1e-6;

/// A direction in the surface of the membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Along the meridian.
    Meridian,
    /// Along the parallel.
    Parallel,
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Meridian => "meridian",
            Self::Parallel => "parallel",
        })
    }
}

/// An event of a ring in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingEvent {
    /// Time.
    pub time: f64,
    /// Number of the ring, 0 at the pole.
    pub ring: usize,
    /// The direction.
    pub direction: Direction,
}

/// The collapse of a ring: the end of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collapse {
    /// Place and time.
    pub at: RingEvent,
    /// Stretch in the direction; NaN where the numbers overflowed.
    pub stretch: f64,
}

impl fmt::Display for Collapse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RingEvent {
            time,
            ring,
            direction,
        } = self.at;
        write!(
            f,
            "collapse at t = {time}: ring {ring} from the pole has the stretch {} along its {direction}",
            self.stretch
        )
    }
}

impl std::error::Error for Collapse {}

/// Energies of a membrane in motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneLedger {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Stored energy.
    pub stored: f64,
    /// Energy of the gas and of what is outside, less that at the start; 0 under a given pressure.
    pub gas: f64,
    /// Work of a given pressure since the start; 0 under gas.
    pub work: f64,
}

impl MembraneLedger {
    /// Kinetic + stored + gas - work: 0 from rest without load, up to the error of the steps.
    pub fn error(&self) -> f64 {
        self.kinetic + self.stored + self.gas - self.work
    }
}

/// A height of the pole with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Height {
    /// Height.
    pub value: f64,
    /// Time.
    pub time: f64,
}

/// A disc in motion under a pressure that is given over time, or under gas.
#[derive(Debug, Clone)]
pub struct DiscMotion {
    disc: Inflated,
    density: f64,
    filling: Filling,
    /// Width h of a ring without load.
    width: f64,
    masses: Vec<f64>,
    /// Places [r, z] of the rims, the pole first.
    rims: Vec<[f64; 2]>,
    velocities: Vec<[f64; 2]>,
    /// Forces on the rims, without those of the holds.
    forces: Vec<[f64; 2]>,
    /// Derivatives of the volume by the places of the rims.
    growth: Vec<[f64; 2]>,
    shape: Shaped,
    time: f64,
    steps: u64,
    work: f64,
    highest: Height,
    wrinkle: Option<RingEvent>,
}

/// Quantities of the disc at the places of its rims.
#[derive(Debug, Clone, Copy, Default)]
struct Shaped {
    stored: f64,
    volume: f64,
    pressure: f64,
    /// Bound of the squared frequencies times the density and h^2/4: the modulus of the stiffest ring, and what gas
    /// adds.
    stiffest: f64,
    /// The first ring under compression, from the pole.
    pressed: Option<(usize, Direction)>,
    /// The first collapsed ring and its stretch.
    collapsed: Option<(usize, Direction, f64)>,
}

impl DiscMotion {
    /// A `disc` of the given `density` at rest without load, in `rings` conical rings, under `filling` from time 0. A
    /// history in time is a pressure.
    ///
    /// # Errors
    /// A membrane of another shape; a density that is not finite and positive; fewer than 2 rings; a history with
    /// numbers that are not finite; gas without a vessel.
    pub fn new(
        disc: Inflated,
        density: f64,
        rings: usize,
        filling: impl Into<Filling>,
    ) -> Result<Self> {
        if disc.shape != Shape::Disc {
            return Err(Error::domain(
                "conical rings are for discs, shape = \"disc\": a sphere has one stretch, see membrane::breathing",
            ));
        }
        if !(0.0 < density && density < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the density {density} of a membrane in motion must be finite and > 0"
            )));
        }
        if rings < 2 {
            return Err(Error::domain(format!(
                "a disc in motion needs 2 rings or more, and not {rings}: 40 are usual"
            )));
        }
        let width = disc.radius / rings as f64;
        let radius = |i: usize| i as f64 * width;
        let sheet = 2.0 * PI * density * disc.thickness * width;
        let mut masses = vec![0.0; rings + 1];
        for i in 0..rings {
            let (inner, outer) = (radius(i), radius(i + 1));
            masses[i] += sheet * (2.0 * inner + outer) / 6.0;
            masses[i + 1] += sheet * (inner + 2.0 * outer) / 6.0;
        }
        let mut motion = Self {
            disc,
            density,
            filling: filling.into().checked(0.0)?,
            width,
            masses,
            rims: (0..=rings).map(|i| [radius(i), 0.0]).collect(),
            velocities: vec![[0.0; 2]; rings + 1],
            forces: vec![[0.0; 2]; rings + 1],
            growth: vec![[0.0; 2]; rings + 1],
            shape: Shaped::default(),
            time: 0.0,
            steps: 0,
            work: 0.0,
            highest: Height {
                value: 0.0,
                time: 0.0,
            },
            wrinkle: None,
        };
        motion.load(0.0);
        Ok(motion)
    }

    /// Volume at the present places, and its derivatives.
    fn grow(&mut self) -> f64 {
        let mut volume = 0.0;
        self.growth.fill([0.0; 2]);
        for i in 0..self.rims.len() - 1 {
            let ([r0, z0], [r1, z1]) = (self.rims[i], self.rims[i + 1]);
            let disc = PI / 3.0 * (r0 * r0 + r0 * r1 + r1 * r1);
            let wide = PI / 3.0 * (z0 - z1);
            volume += disc * (z0 - z1);
            self.growth[i][0] += wide * (2.0 * r0 + r1);
            self.growth[i][1] += disc;
            self.growth[i + 1][0] += wide * (r0 + 2.0 * r1);
            self.growth[i + 1][1] -= disc;
        }
        volume
    }

    /// Bound of what gas adds to the squared frequencies: -dp/dV sum (dV/dx)^2/m over the rims that move.
    fn of_gas(&self, volume: f64) -> f64 {
        let stiffness = self.filling.stiffness(volume);
        if stiffness == 0.0 {
            return 0.0;
        }
        let moving = self.growth.iter().zip(&self.masses).rev().skip(1);
        stiffness
            * moving
                .map(|([a, b], mass)| (a * a + b * b) / mass)
                .sum::<f64>()
    }

    /// Forces, energy and volume at the present places, under the pressure at `time`.
    fn load(&mut self, time: f64) {
        let volume = self.grow();
        let pressure = self.filling.pressure(time, volume);
        let rubber = self.disc.rubber;
        let mut shape = Shaped {
            volume,
            pressure,
            stiffest: 0.25 * self.density * self.width.powi(2) * self.of_gas(volume),
            ..Shaped::default()
        };
        for (force, growth) in self.forces.iter_mut().zip(&self.growth) {
            *force = growth.map(|part| pressure * part);
        }
        let of_gas = shape.stiffest;
        for i in 0..self.rims.len() - 1 {
            let ([r0, z0], [r1, z1]) = (self.rims[i], self.rims[i + 1]);
            let (along, fall) = (r1 - r0, z0 - z1);
            let length = along.hypot(fall);
            let middle = (i as f64 + 0.5) * self.width;
            let (l1, l2) = (length / self.width, 0.5 * (r0 + r1) / middle);
            let gone = |stretch: f64| !(stretch > COLLAPSED && stretch < f64::INFINITY);
            if gone(l1) {
                shape.collapsed.get_or_insert((i, Direction::Meridian, l1));
            } else if gone(l2) {
                shape.collapsed.get_or_insert((i, Direction::Parallel, l2));
            }
            let at = rubber.at(l1, l2);
            let least = -WRINKLED * rubber.first();
            for (stress, direction) in
                (at.stress.into_iter()).zip([Direction::Meridian, Direction::Parallel])
            {
                if stress < least {
                    shape.pressed.get_or_insert((i, direction));
                }
            }
            let unloaded = 2.0 * PI * middle * self.width * self.disc.thickness;
            shape.stored += unloaded * at.energy;
            // The gradient of the stored energy.
            let pull = unloaded * at.stress[0] / (self.width * length);
            let hoop = unloaded * at.stress[1] / (2.0 * middle);
            let [inner, outer] = [i, i + 1];
            self.forces[inner][0] += pull * along - hoop;
            self.forces[inner][1] -= pull * fall;
            self.forces[outer][0] -= pull * along + hoop;
            self.forces[outer][1] += pull * fall;
            let [w11, w12, w22] = at.moduli;
            let slim = 0.5 * self.width / middle;
            let across = at.stress[0] / l1;
            let modulus = w11.max(across) + slim * (2.0 * w12.abs() + slim * w22);
            shape.stiffest = shape.stiffest.max(of_gas + modulus);
        }
        self.shape = shape;
    }

    /// Half a step of the velocities. The pole stays on the axis, and the edge is held.
    fn kick(&mut self, half: f64) {
        let last = self.rims.len() - 1;
        for i in 0..last {
            let push = half / self.masses[i];
            let [radial, upward] = self.forces[i];
            if i > 0 {
                self.velocities[i][0] += push * radial;
            }
            self.velocities[i][1] += push * upward;
        }
    }

    /// One step, at most to the time `end`, which lies ahead.
    ///
    /// # Errors
    /// As [`DiscMotion::advance`].
    pub fn step(&mut self, end: f64) -> std::result::Result<(), Collapse> {
        let longest = SAFE * self.width * (self.density / self.shape.stiffest).sqrt();
        let jump = self.filling.next_break(self.time);
        let stop = end.min(jump);
        let left = stop - self.time;
        // The last two steps share the time left: neither is tiny.
        let step = if left <= longest {
            left
        } else {
            longest.min(0.5 * left)
        };
        let (height, rise) = (self.rims[0][1], self.velocities[0][1]);
        let (before, load) = (self.shape.volume, self.shape.pressure);
        self.kick(0.5 * step);
        for (rim, velocity) in self.rims.iter_mut().zip(&self.velocities) {
            rim[0] += step * velocity[0];
            rim[1] += step * velocity[1];
        }
        let from = self.time;
        self.time = if left <= longest { stop } else { from + step };
        // A step up to a jump of the pressure ends with the pressure before it.
        let within = self.time.min(jump.next_down());
        self.load(within);
        self.kick(0.5 * step);
        if self.filling.is_driven() {
            self.work += 0.5 * (load + self.shape.pressure) * (self.shape.volume - before);
        }
        self.steps += 1;
        if within < self.time {
            self.load(self.time);
        }
        let event = |ring, direction| RingEvent {
            time: self.time,
            ring,
            direction,
        };
        if let Some((ring, direction, stretch)) = self.shape.collapsed {
            let at = event(ring, direction);
            return Err(Collapse { at, stretch });
        }
        if let (None, Some((ring, direction))) = (self.wrinkle, self.shape.pressed) {
            self.wrinkle = Some(event(ring, direction));
        }
        let after = self.velocities[0][1];
        let reached = if rise > 0.0 && after <= 0.0 {
            // The velocity is linear over a step, to the order of the scheme.
            let part = rise / (rise - after);
            Height {
                value: height + 0.5 * rise * part * step,
                time: from + part * step,
            }
        } else {
            Height {
                value: self.rims[0][1],
                time: self.time,
            }
        };
        if reached.value > self.highest.value {
            self.highest = reached;
        }
        Ok(())
    }

    /// Goes on to the time `end`.
    ///
    /// # Errors
    /// A ring whose stretch falls below 0.1 or overflows; the motion does not go on then.
    pub fn advance(&mut self, end: f64) -> std::result::Result<(), Collapse> {
        while self.time < end {
            self.step(end)?;
        }
        Ok(())
    }

    /// Time.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Places [r, z] of the rims from the pole to the edge.
    pub fn rims(&self) -> &[[f64; 2]] {
        &self.rims
    }

    /// Height of the pole over the plane of the edge.
    pub fn height(&self) -> f64 {
        self.rims[0][1]
    }

    /// The greatest height of the pole since the start.
    pub fn highest(&self) -> Height {
        self.highest
    }

    /// Volume below the surface and above the plane of the edge.
    pub fn volume(&self) -> f64 {
        self.shape.volume
    }

    /// Stretch along the meridian at the pole.
    pub fn stretch(&self) -> f64 {
        let [[r0, z0], [r1, z1]] = [self.rims[0], self.rims[1]];
        (r1 - r0).hypot(z1 - z0) / self.width
    }

    /// Pressure inside less outside.
    pub fn pressure(&self) -> f64 {
        self.shape.pressure
    }

    /// Velocity of the pole, upward.
    pub fn velocity(&self) -> f64 {
        self.velocities[0][1]
    }

    /// Radii of the rims without load, from the pole to the edge.
    pub fn unloaded_radii(&self) -> impl Iterator<Item = f64> {
        let width = self.width;
        (0..self.rims.len()).map(move |i| i as f64 * width)
    }

    /// Number of steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The first compression of a ring. A sheet without bending stiffness wrinkles there. The rings bear the
    /// compression from then on; a real sheet does not.
    pub fn wrinkle(&self) -> Option<RingEvent> {
        self.wrinkle
    }

    /// Energies.
    pub fn ledger(&self) -> MembraneLedger {
        let moving = self.masses.iter().zip(&self.velocities);
        MembraneLedger {
            kinetic: moving
                .map(|(mass, [a, b])| 0.5 * mass * (a * a + b * b))
                .sum(),
            stored: self.shape.stored,
            gas: self.filling.energy(0.0, self.shape.volume),
            work: self.work,
        }
    }
}
