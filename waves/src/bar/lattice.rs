//! The schemes of the thesis on linear elements (docs/bars.md 2), by name, with their faults.
//!
//! `central-lumped` and `central-consistent` move the positions of the nodes by central differences in velocity form.
//! The stretch forms move stretch and its rate q at the nodes, `lax-wendroff` stretch and velocity. A loaded end has
//! the stretch of its load.

use super::{
    Bar, BarMotion, End, EndState, Extremes, LOWER, Law1d, Ledger, Scheme, Snapshot, no_time,
};
use snaprod_core::error::{Cause, Error, Result, Stuck};

/// A bar in motion by one of the thesis' schemes.
pub struct Lattice {
    bar: Bar,
    scheme: Scheme,
    h: f64,
    dt: f64,
    time: f64,
    /// The last step, 0 at the start.
    last: f64,
    /// Places of the nodes, or their stretches.
    a: Vec<f64>,
    /// Velocities half a step behind, or rates of the stretches, or velocities.
    b: Vec<f64>,
    work: f64,
    impulse: f64,
    first: [f64; 2],
    extremes: [Extremes; 2],
}

/// Default step over h/c at the start: about that of the thesis.
const COURANT: f64 = 0.05;

impl Lattice {
    /// The bar on this number of elements, with steps of at most `time_step`.
    ///
    /// # Errors
    /// Fewer than 2 elements; another scheme; ends or a start that it cannot have; [`Scheme::StretchTaylor`] unless
    /// `unstable`.
    pub fn new(
        bar: &Bar,
        scheme: Scheme,
        elements: usize,
        time_step: Option<f64>,
        unstable: bool,
    ) -> Result<Self> {
        let name = scheme.name();
        let central = matches!(scheme, Scheme::CentralLumped | Scheme::CentralConsistent);
        if matches!(scheme, Scheme::FiniteVolume | Scheme::Spectral) {
            return Err(Error::domain(format!(
                "\"{name}\" is no scheme on linear elements"
            )));
        }
        if elements < 2 {
            return Err(Error::domain(format!(
                "cells = {elements} of a bar: \"{name}\" needs 2 or more"
            )));
        }
        if scheme == Scheme::StretchTaylor && !unstable {
            return Err(Error::domain(
                "scheme = \"stretch-taylor\", Lax-Wendroff finite elements as the thesis prints them, is unstable at every step: waves \
                 grow by |g|^2 = 1 + m^4/4 a step, m = 2 (c dt/h) sin(theta/2); write \"stretch-sequential\", in which the new rate \
                 moves the stretch, or `unstable = true` to see it fail",
            ));
        }
        let walls = bar.ends.iter().filter(|end| **end == End::Wall).count();
        let masses = bar.ends.iter().any(|end| matches!(end, End::Mass { .. }));
        if !central && (masses || walls == 0) {
            return Err(Error::domain(format!(
                "scheme = \"{name}\" knows neither a mass at an end nor a bar without a wall; use \"finite-volume\""
            )));
        }
        let h = bar.length / elements as f64;
        let (mut a, mut b) = bar.sampled((0..=elements).map(|i| i as f64 * h))?;
        let fastest = a
            .iter()
            .map(|lam| bar.material.speed(*lam))
            .fold(0.0, f64::max);
        for (side, node) in [0, elements].into_iter().enumerate() {
            if bar.ends[side] == End::Wall {
                b[node] = 0.0;
            }
        }
        if central {
            let mut place = 0.0;
            let stretches = a.clone();
            for i in 0..=elements {
                a[i] = place;
                // Simpson's rule between the nodes.
                let next = stretches.get(i + 1).copied().unwrap_or(1.0);
                let middle = bar.at_start((i as f64 + 0.5) * h)[0];
                place += h * (stretches[i] + 4.0 * middle + next) / 6.0;
            }
        } else if scheme != Scheme::LaxWendroff {
            let v = b.clone();
            for (i, rate) in b.iter_mut().enumerate() {
                let (low, high) = (i.saturating_sub(1), (i + 1).min(elements));
                *rate = (v[high] - v[low]) / ((high - low) as f64 * h);
            }
        }
        let mut lattice = Self {
            bar: bar.clone(),
            scheme,
            h,
            dt: time_step.unwrap_or(COURANT * h / fastest),
            time: 0.0,
            last: 0.0,
            a,
            b,
            work: 0.0,
            impulse: 0.0,
            first: [0.0; 2],
            extremes: [Extremes::new(0.0, 0.0); 2],
        };
        if !central {
            lattice.load(0.0)?;
        }
        lattice.extremes = lattice
            .snapshot()
            .ends
            .map(|end| Extremes::new(0.0, end.stress));
        let ledger = lattice.ledger();
        lattice.first = [ledger.kinetic + ledger.strain, ledger.momentum];
        Ok(lattice)
    }

    fn central(&self) -> bool {
        matches!(
            self.scheme,
            Scheme::CentralLumped | Scheme::CentralConsistent
        )
    }

    /// Size of the deviation from rest, which is then scaled by a factor: for the growth of small disturbances.
    pub(super) fn deviation(&mut self, factor: f64) -> f64 {
        let rest = |i: usize| {
            if self.central() {
                i as f64 * self.h
            } else {
                1.0
            }
        };
        let rests: Vec<f64> = (0..self.a.len()).map(rest).collect();
        let c = self.bar.material.speed(1.0);
        let unit = match self.scheme {
            Scheme::LaxWendroff => c,
            _ => c / self.h,
        };
        let mut sum = 0.0;
        for ((a, b), rest) in self.a.iter_mut().zip(&mut self.b).zip(rests) {
            sum += (*a - rest).powi(2) + (*b / unit).powi(2);
            *a = rest + (*a - rest) * factor;
            *b *= factor;
        }
        sum.sqrt()
    }

    /// Gives the nodes of loaded ends the stretch of the load at `t`.
    ///
    /// # Errors
    /// A load beyond all stresses of the law.
    fn load(&mut self, t: f64) -> Result<()> {
        let last = self.a.len() - 1;
        for (side, node) in [0, last].into_iter().enumerate() {
            if matches!(self.bar.ends[side], End::Loaded(_)) {
                self.a[node] = self.bar.under_load(side, t)?;
            }
        }
        Ok(())
    }

    /// Stretches of the elements by the positions of their nodes.
    fn elements(&self) -> impl Iterator<Item = f64> {
        self.a.windows(2).map(|pair| (pair[1] - pair[0]) / self.h)
    }

    /// Accelerations of the nodes in the displacement form, from the loads at `t`; and the forces of the walls.
    fn accelerations(&self, t: f64) -> (Vec<f64>, [f64; 2]) {
        let (n, area) = (self.a.len(), self.bar.area);
        let mut force = vec![0.0; n];
        for (i, lam) in self.elements().enumerate() {
            let pull = area * self.bar.material.stress(lam);
            force[i] += pull;
            force[i + 1] -= pull;
        }
        let element = self.bar.material.density() * area * self.h;
        let mut mass = vec![element; n];
        (mass[0], mass[n - 1]) = (0.5 * element, 0.5 * element);
        let mut walls = [0.0; 2];
        let held = [0, 1].map(|side| self.bar.ends[side] == End::Wall);
        let (mut off, mut main) = (0.0, mass);
        if self.scheme == Scheme::CentralConsistent {
            off = element / 6.0;
            for m in &mut main {
                *m *= 2.0 / 3.0;
            }
        }
        for (side, node) in [0, n - 1].into_iter().enumerate() {
            match &self.bar.ends[side] {
                End::Wall => walls[side] = -force[node],
                End::Loaded(load) => force[node] += load.at(t),
                End::Mass { mass, force: load } => {
                    force[node] += load.at(t);
                    main[node] += mass;
                }
            }
            if held[side] {
                force[node] = 0.0;
            }
        }
        if off == 0.0 {
            for (force, mass) in force.iter_mut().zip(&main) {
                *force /= mass;
            }
            return (force, walls);
        }
        // Thomas' elimination; the rows of held nodes are zero and decoupled from their neighbours.
        let link = |i: usize| {
            if (i == 0 && held[0]) || (i + 2 == n && held[1]) {
                0.0
            } else {
                off
            }
        };
        for i in 1..n {
            let part = link(i - 1) / main[i - 1];
            main[i] -= part * link(i - 1);
            force[i] -= part * force[i - 1];
        }
        force[n - 1] /= main[n - 1];
        for i in (0..n - 1).rev() {
            force[i] = (force[i] - link(i) * force[i + 1]) / main[i];
        }
        (force, walls)
    }

    fn step(&mut self, dt: f64) -> Result<()> {
        let t = self.time;
        let n = self.a.len();
        let material = self.bar.material.clone();
        let (density, h) = (material.density(), self.h);
        if self.central() {
            let (acceleration, walls) = self.accelerations(t);
            let held = [0, 1].map(|side| self.bar.ends[side] == End::Wall);
            for (i, a) in acceleration.iter().enumerate() {
                if (i == 0 && held[0]) || (i == n - 1 && held[1]) {
                    continue;
                }
                self.b[i] += 0.5 * (self.last + dt) * a;
                self.a[i] += dt * self.b[i];
            }
            for (side, node) in [0, n - 1].into_iter().enumerate() {
                let end = &self.bar.ends[side];
                let force = 0.5 * (end.force(t) + end.force(t + dt));
                self.work += force * dt * self.b[node];
                self.impulse += dt * (force + walls[side]);
            }
        } else {
            let jets: Vec<[f64; 4]> = self.a.iter().map(|lam| material.jet(*lam)).collect();
            let loaded = [0, 1].map(|side| matches!(self.bar.ends[side], End::Loaded(_)));
            let before = [self.a[0], self.a[n - 1]];
            let ends = self.snapshot().ends;
            let free = |i: usize| !((i == 0 && loaded[0]) || (i == n - 1 && loaded[1]));
            // Second differences; at a wall, with no load P, twice the one-sided first difference.
            let second = |f: &dyn Fn(usize) -> f64, i: usize| match i {
                0 => 2.0 * (f(1) - f(0)),
                i if i == n - 1 => 2.0 * (f(n - 2) - f(n - 1)),
                i => f(i - 1) - 2.0 * f(i) + f(i + 1),
            };
            if self.scheme == Scheme::LaxWendroff {
                self.two_step(dt, &jets);
            } else {
                let old = self.b.clone();
                let stress = |i: usize| jets[i][1];
                let flow = |i: usize| jets[i][2] / density * old[i];
                for i in (0..n).filter(|i| free(*i)) {
                    let bend = second(&stress, i) / (density * h * h);
                    self.b[i] += dt * bend + dt * dt / (2.0 * h * h) * second(&flow, i);
                    let q = match self.scheme {
                        Scheme::StretchTaylor => old[i],
                        _ => self.b[i],
                    };
                    self.a[i] += dt * q + 0.5 * dt * dt * bend;
                }
            }
            self.load(t + dt)?;
            if self.scheme != Scheme::LaxWendroff {
                for side in (0..2).filter(|side| loaded[*side]) {
                    let node = side * (n - 1);
                    self.b[node] = (self.a[node] - before[side]) / dt;
                }
            }
            for side in 0..2 {
                let end = &self.bar.ends[side];
                let pull = if side == 0 { -1.0 } else { 1.0 } * ends[side].stress * self.bar.area;
                self.work += dt * end.force(t) * ends[side].velocity;
                self.impulse += dt * if loaded[side] { end.force(t) } else { pull };
            }
        }
        self.last = dt;
        self.time += dt;
        Ok(())
    }

    /// Richtmyer's two steps: by half a step to the middles of the elements, from there by a step.
    fn two_step(&mut self, dt: f64, jets: &[[f64; 4]]) {
        let (n, h) = (self.a.len(), self.h);
        let density = self.bar.material.density();
        let middle = |i: usize| {
            let lam =
                0.5 * (self.a[i] + self.a[i + 1]) + 0.5 * dt / h * (self.b[i + 1] - self.b[i]);
            let rise = jets[i + 1][1] - jets[i][1];
            let v = 0.5 * (self.b[i] + self.b[i + 1]) + 0.5 * dt / (h * density) * rise;
            (self.bar.material.stress(lam), v)
        };
        let middles: Vec<(f64, f64)> = (0..n - 1).map(middle).collect();
        for i in 0..n {
            // Half a cell at the ends: a wall does not move, and the stress at a loaded end is the load.
            let (left, right) = match i {
                0 => ((jets[0][1], 0.0), middles[0]),
                i if i == n - 1 => (middles[n - 2], (jets[n - 1][1], 0.0)),
                i => (middles[i - 1], middles[i]),
            };
            let width = if i == 0 || i == n - 1 { 0.5 * h } else { h };
            let held = (i == 0 && self.bar.ends[0] == End::Wall)
                || (i == n - 1 && self.bar.ends[1] == End::Wall);
            self.a[i] += dt / width * (right.1 - left.1);
            if !held {
                self.b[i] += dt / (width * density) * (right.0 - left.0);
            }
        }
    }

    /// Places from stretches, or velocities from their rates: the sum from the wall, which is fixed.
    fn summed(&self, rates: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0];
        for pair in rates.windows(2) {
            sums.push(sums[sums.len() - 1] + 0.5 * self.h * (pair[0] + pair[1]));
        }
        if self.bar.ends[0] != End::Wall {
            let last = sums[sums.len() - 1];
            // The right wall is at the length of the bar at the start, with velocity 0. Shifts affect neither.
            sums.iter_mut().for_each(|sum| *sum -= last);
        }
        sums
    }

    /// Error for a bar outside the domain of the law, by scheme.
    fn blown_up(&self, dt: f64) -> Stuck {
        let name = self.scheme.name();
        let ratio = self.bar.material.speed(1.0) * dt / self.h;
        let why = match self.scheme {
            Scheme::StretchTaylor => format!(
                "\"{name}\" has blown up, as it must: it is unstable at every step, waves grow by |g|^2 = 1 + m^4/4 a step, \
                 m = 2 (c dt/h) sin(theta/2), here with c dt/h = {ratio:.3} at stretch 1"
            ),
            _ => format!(
                "\"{name}\" has blown up: c dt/h = {ratio:.3} at stretch 1, more where the bar is compressed; it rings behind shocks until \
                 an element collapses"
            ),
        };
        let remedy = match self.scheme {
            Scheme::StretchSequential => "use scheme = \"finite-volume\", or shorter steps",
            _ => "use scheme = \"finite-volume\", or \"stretch-sequential\", or shorter steps",
        };
        Stuck::new(self.time, Cause::Failed(Error::no_convergence(why)), remedy)
    }
}

impl BarMotion for Lattice {
    fn time(&self) -> f64 {
        self.time
    }

    fn go(&mut self, until: f64, most: usize) -> Result<(), Stuck> {
        // Equal steps: breaks are ignored, as in the thesis.
        let steps = ((until - self.time) / self.dt - 1e-6).ceil().max(0.0);
        let dt = (until - self.time) / steps;
        for _ in 0..most.min(steps as usize) {
            if until + dt == until {
                return Err(no_time(self.time));
            }
            let at = self.time;
            self.step(dt)
                .map_err(|error| Stuck::new(at, Cause::Failed(error), LOWER))?;
            let now = self.snapshot();
            if now
                .stretch
                .iter()
                .any(|lam| self.bar.material.check(*lam).is_err())
            {
                let time = self.time;
                return Err((self.bar.overloaded(time)).unwrap_or_else(|| self.blown_up(dt)));
            }
            for side in 0..2 {
                self.extremes[side].see(self.time, now.ends[side].stress);
            }
        }
        if steps as usize <= most {
            self.time = until;
        }
        Ok(())
    }

    fn snapshot(&self) -> Snapshot {
        let n = self.a.len();
        let material = &self.bar.material;
        let (x, stretch, velocity, nodes, places) = if self.central() {
            let behind = 0.5 * self.last;
            let (acceleration, _) = self.accelerations(self.time);
            let held = [0, 1].map(|side| self.bar.ends[side] == End::Wall);
            let v = |i: usize| {
                if (i == 0 && held[0]) || (i == n - 1 && held[1]) {
                    0.0
                } else {
                    self.b[i] + behind * acceleration[i]
                }
            };
            let x: Vec<f64> = (0..n - 1).map(|i| (i as f64 + 0.5) * self.h).collect();
            let stretch: Vec<f64> = self.elements().collect();
            let velocity: Vec<f64> = (0..n - 1).map(|i| 0.5 * (v(i) + v(i + 1))).collect();
            let places = [self.a[0], self.a[n - 1]];
            (x, stretch, velocity, [v(0), v(n - 1)], places)
        } else {
            let x = (0..n).map(|i| i as f64 * self.h).collect();
            let velocity = match self.scheme {
                Scheme::LaxWendroff => self.b.clone(),
                _ => self.summed(&self.b),
            };
            let place = self.summed(&self.a);
            let nodes = [velocity[0], velocity[n - 1]];
            (x, self.a.clone(), velocity, nodes, [place[0], place[n - 1]])
        };
        let stress: Vec<f64> = stretch.iter().map(|lam| material.stress(*lam)).collect();
        let last = stress.len() - 1;
        let ends = [0, 1].map(|side| EndState {
            position: places[side],
            velocity: nodes[side],
            stress: match &self.bar.ends[side] {
                End::Loaded(force) => {
                    force.at(self.time) / self.bar.area * if side == 0 { -1.0 } else { 1.0 }
                }
                _ => stress[side * last],
            },
        });
        Snapshot {
            time: self.time,
            x,
            stretch,
            velocity,
            stress,
            ends,
        }
    }

    fn ledger(&self) -> Ledger {
        let now = self.snapshot();
        let material = &self.bar.material;
        let last = now.x.len() - 1;
        let mut ledger = Ledger::default();
        for (i, (lam, v)) in now.stretch.iter().zip(&now.velocity).enumerate() {
            let half = !self.central() && (i == 0 || i == last);
            let cell = self.bar.area * self.h * if half { 0.5 } else { 1.0 };
            ledger.strain += material.energy(*lam) * cell;
            ledger.kinetic += 0.5 * material.density() * v * v * cell;
            ledger.momentum += material.density() * v * cell;
        }
        for (end, state) in self.bar.ends.iter().zip(&now.ends) {
            if let End::Mass { mass, .. } = end {
                ledger.kinetic += 0.5 * mass * state.velocity.powi(2);
                ledger.momentum += mass * state.velocity;
            }
        }
        ledger.work = self.work;
        ledger.lost = self.first[0] + self.work - ledger.kinetic - ledger.strain;
        ledger.momentum -= self.first[1];
        ledger.impulse = self.impulse;
        ledger
    }

    fn extremes(&self) -> [Extremes; 2] {
        self.extremes
    }
}
