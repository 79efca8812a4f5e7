//! Finite volumes for the flow in a tube: second order, exact for steady flow along a tube that varies.
//!
//! Each cell has a steady flow, with the flow and the head of the cell, less the friction over half a cell. This flow
//! is followed to the faces and to the middles of the neighbours. Slopes are limited slopes of the deviations from the
//! steady flow, in the characteristic variables. The change of the momentum by the wall and the surroundings is that
//! of the steady flow. So a steady flow stays, also where p_e, A0 and Kp vary (after Castro, Gallardo & Pares). Where
//! no steady flow of the cell passes the cell, near choking, the forces at its middle are taken.
//!
//! The energy is e = A u^2/2 + U/rho. The loss of the scheme is the power at the ends, from outside and to friction,
//! less the sum of de over the cells. The loss is summed at every stage; see [`FlowLedger::jumps`].

use super::ends::{EndNow, EndPressure};
use super::face::{Flux, Sided};
use super::{
    ElasticJump, FlowEnd, FlowEndState, FlowLaw, FlowLedger, FlowSnapshot, FlowTube, Friction,
    Place, jumps,
};
use snaprod_core::error::{Cause, Error, Result, Stuck};
use snaprod_waves::profile::limited;

/// Step over h/speed.
const COURANT: f64 = 0.6;
/// Largest jump beside an end, relative, at which the slope goes on to the end.
const SMOOTH: f64 = 0.05;
/// Part of the time in which friction would stop the fluid, as a bound of the step.
const DAMPED: f64 = 0.5;
/// Relative change of an area below which the noise of the law's table leads the iteration.
const ROUNDING: f64 = 2e-14;
/// Advice if the flow cannot go on.
const REMEDY: &str = "check pressures, ends and start, or use more cells";

/// A flow by finite volumes.
pub struct FlowVolumes {
    tube: FlowTube,
    h: f64,
    most: f64,
    time: f64,
    middles: Vec<Place>,
    faces: Vec<Place>,
    /// True for a tube that is the same everywhere, without friction.
    uniform: bool,
    area: Vec<f64>,
    flow: Vec<f64>,
    ends: [FlowEndState; 2],
    /// Flows in the rigid tubes at the ends.
    rigid: [f64; 2],
    sums: Powers,
    /// Energy at the start.
    first: f64,
    updates: u64,
    work: Scratch,
}

/// Powers of a stage, or their integrals over time.
#[derive(Debug, Clone, Copy, Default)]
struct Powers {
    ends: f64,
    outside: f64,
    friction: f64,
    jumps: f64,
}

impl Powers {
    fn add(&mut self, share: f64, other: &Self) {
        self.ends += share * other.ends;
        self.outside += share * other.outside;
        self.friction += share * other.friction;
        self.jumps += share * other.jumps;
    }
}

/// Workspace of a stage.
#[derive(Default)]
struct Scratch {
    /// States at the left and at the right face of every cell.
    sides: Vec<[[f64; 2]; 2]>,
    /// Change of the momentum of every cell by wall, surroundings and friction, per time and density.
    sources: Vec<f64>,
    fluxes: Vec<Flux>,
    /// Rates of area and flow.
    rates: Vec<[f64; 2]>,
    /// Rates of the flows in the rigid tubes.
    rigid: [f64; 2],
    ends: [FlowEndState; 2],
    top: f64,
}

/// A cell as the neighbouring cells see the cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    area: f64,
    flow: f64,
    velocity: f64,
    speed: f64,
    /// u^2/2 + p/rho.
    head: f64,
    /// Friction per length and density.
    friction: f64,
}

impl FlowVolumes {
    /// The tube in `cells` equal cells, at least 4.
    ///
    /// # Errors
    /// Fewer cells; numbers that make no tube; areas at the start that the law does not have.
    pub fn new(tube: &FlowTube, cells: usize) -> Result<Self> {
        if cells < 4 {
            return Err(Error::domain(format!(
                "cells = {cells} of a tube with flow must be 4 or more"
            )));
        }
        tube.check()?;
        let h = tube.length / cells as f64;
        let middles: Vec<Place> = (0..cells)
            .map(|i| (tube.places)((i as f64 + 0.5) * h))
            .collect();
        let faces: Vec<Place> = (0..=cells).map(|i| (tube.places)(i as f64 * h)).collect();
        let uniform = middles
            .iter()
            .chain(&faces)
            .all(|place| *place == middles[0])
            && tube.friction == Friction::None;
        let (mut area, mut flow) = (vec![0.0; cells], vec![0.0; cells]);
        for (i, place) in middles.iter().enumerate() {
            let x = (i as f64 + 0.5) * h;
            let start = (tube.start)(x);
            tube.law
                .check(start.area)
                .map_err(|error| error.context(format!("the start at x = {x}")))?;
            area[i] = start.area * place.area;
            flow[i] = area[i] * start.velocity;
        }
        let mut volumes = Self {
            tube: tube.clone(),
            h,
            most: f64::INFINITY,
            time: 0.0,
            uniform,
            ends: Default::default(),
            rigid: [flow[0], flow[cells - 1]],
            sums: Powers::default(),
            first: 0.0,
            updates: 0,
            work: Scratch {
                sides: vec![[[0.0; 2]; 2]; cells],
                sources: vec![0.0; cells],
                fluxes: vec![Flux::default(); cells + 1],
                rates: vec![[0.0; 2]; cells],
                ..Scratch::default()
            },
            middles,
            faces,
            area,
            flow,
        };
        let [kinetic, wall] = volumes.energies();
        volumes.first = kinetic + wall;
        volumes.look()?;
        Ok(volumes)
    }

    /// Bounds the length of the steps.
    #[must_use]
    pub fn bounded(mut self, step: Option<f64>) -> Self {
        self.most = step.unwrap_or(f64::INFINITY);
        self
    }

    /// The time.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The tube.
    pub fn tube(&self) -> &FlowTube {
        &self.tube
    }

    /// Cells times steps so far.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Least area over A0, with its place.
    pub fn narrowest(&self) -> (f64, f64) {
        let ratios = self.area.iter().zip(&self.middles).enumerate();
        let ratios = ratios.map(|(i, (area, place))| (area / place.area, i));
        let least = ratios.fold(
            (f64::INFINITY, 0),
            |least, at| if at.0 < least.0 { at } else { least },
        );
        (least.0, self.x(least.1))
    }

    /// Greatest speed index |u|/c, with its place.
    pub fn fastest(&self) -> (f64, f64) {
        let cells = (0..self.area.len()).map(|i| {
            let at = self
                .tube
                .sided(&self.middles[i], self.area[i], self.flow[i]);
            ((at.velocity / at.speed).abs(), i)
        });
        let most = cells.fold(
            (0.0, 0),
            |most: (f64, usize), at| if at.0 > most.0 { at } else { most },
        );
        (most.0, self.x(most.1))
    }

    /// Velocity of the cell at the place `x`.
    pub fn velocity_at(&self, x: f64) -> f64 {
        let last = self.area.len() - 1;
        let i = ((x / self.h) as usize).min(last);
        self.flow[i] / self.area[i]
    }

    fn x(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.h
    }

    /// Elastic jumps in the present state.
    pub fn jumps(&self) -> Vec<ElasticJump> {
        jumps::find(&self.tube, &self.middles, self.h, &self.area, &self.flow)
    }

    /// The present state.
    pub fn snapshot(&self) -> FlowSnapshot {
        let n = self.area.len();
        let extra = self.tube.outside.at(self.time);
        let cells: Vec<Sided> = (0..n)
            .map(|i| {
                self.tube
                    .sided(&self.middles[i], self.area[i], self.flow[i])
            })
            .collect();
        let pressure = |i: usize| {
            let place = &self.middles[i];
            place.outside
                + extra
                + place.stiffness * self.tube.law.at(self.area[i] / place.area).pressure
        };
        FlowSnapshot {
            time: self.time,
            x: (0..n).map(|i| self.x(i)).collect(),
            area: self.area.clone(),
            velocity: cells.iter().map(|at| at.velocity).collect(),
            pressure: (0..n).map(pressure).collect(),
            index: cells.iter().map(|at| at.velocity / at.speed).collect(),
            ends: self.ends,
        }
    }

    /// Energies since the start.
    pub fn ledger(&self) -> FlowLedger {
        let [kinetic, wall] = self.energies();
        let sums = self.sums;
        FlowLedger {
            kinetic,
            wall,
            work: sums.ends,
            outside: sums.outside,
            friction: sums.friction,
            jumps: sums.jumps,
            error: self.first + sums.ends + sums.outside
                - kinetic
                - wall
                - sums.friction
                - sums.jumps,
        }
    }

    /// Volume of the fluid in the tube.
    pub fn volume(&self) -> f64 {
        self.h * self.area.iter().sum::<f64>()
    }

    /// \[kinetic, wall\].
    fn energies(&self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for ((area, flow), place) in self.area.iter().zip(&self.flow).zip(&self.middles) {
            let wall = self.tube.law.at(area / place.area);
            sums[0] += 0.5 * self.tube.density * flow * flow / area * self.h;
            sums[1] += place.stiffness * place.area * wall.energy * self.h;
        }
        sums
    }

    /// Goes on until the time `until`.
    ///
    /// # Errors
    /// The flow cannot go on: where, why and what would help.
    pub fn advance(&mut self, until: f64) -> Result<(), Stuck> {
        while self.time < until {
            self.step(until)?;
        }
        self.look()
            .map_err(|error| Stuck::new(self.time, Cause::Failed(error), REMEDY))
    }

    /// One step, at most to `until`, at most to the break of a history. States of the ends are those before the step.
    ///
    /// # Errors
    /// As [`FlowVolumes::advance`].
    pub fn step(&mut self, until: f64) -> Result<(), Stuck> {
        let at = self.time;
        self.try_step(until)
            .map_err(|error| Stuck::new(at, Cause::Failed(error), REMEDY))?;
        if self.time < until && until + (self.time - at) == until {
            let why =
                Error::ill_conditioned("waves pass a cell in less than the last digit of the time");
            return Err(Stuck::new(at, Cause::Failed(why), REMEDY));
        }
        Ok(())
    }

    fn try_step(&mut self, until: f64) -> Result<()> {
        let n = self.area.len();
        let stop = until.min(self.tube.next_break(self.time));
        let (mut area, mut flow, mut rigid) = (self.area.clone(), self.flow.clone(), self.rigid);
        let mut dt = 0.0;
        let mut sums = self.sums;
        for (part, share, at) in [
            (1.0, 1.0 / 6.0, 0.0),
            (0.25, 1.0 / 6.0, 1.0),
            (2.0 / 3.0, 2.0 / 3.0, 0.5),
        ] {
            // At the end of a step up to a break, a history still has its value before the break.
            let t = (self.time + at * dt).min(stop.next_down());
            let powers = self.stage(t, &area, &flow, rigid)?;
            if at == 0.0 {
                self.ends = self.work.ends;
                dt = (COURANT * self.h / self.work.top).min(self.most);
                dt = dt
                    .min(self.stopping_time(&area, &flow))
                    .min(stop - self.time);
            }
            sums.add(share * dt, &powers);
            let (keep, to) = (1.0 - part, part * dt);
            for i in 0..n {
                let [by_area, by_flow] = self.work.rates[i];
                area[i] = keep * self.area[i] + part * area[i] + to * by_area;
                flow[i] = keep * self.flow[i] + part * flow[i] + to * by_flow;
            }
            for (side, now) in rigid.iter_mut().enumerate() {
                *now = keep * self.rigid[side] + part * *now + to * self.work.rigid[side];
            }
        }
        for (i, area) in area.iter().enumerate() {
            let checked = self.tube.law.check(area / self.middles[i].area);
            checked.map_err(|error| FlowLaw::at_place(&error, self.x(i)))?;
        }
        (self.area, self.flow, self.rigid, self.sums) = (area, flow, rigid, sums);
        self.updates += n as u64;
        self.time = if dt >= stop - self.time {
            stop
        } else {
            self.time + dt
        };
        Ok(())
    }

    /// Updates the ends to the present.
    fn look(&mut self) -> Result<()> {
        let (area, flow) = (
            std::mem::take(&mut self.area),
            std::mem::take(&mut self.flow),
        );
        let done = self.stage(self.time, &area, &flow, self.rigid);
        (self.area, self.flow) = (area, flow);
        self.ends = self.work.ends;
        done.map(drop)
    }

    /// Least time in which friction would stop the fluid of a cell, times [`DAMPED`].
    fn stopping_time(&self, area: &[f64], flow: &[f64]) -> f64 {
        if self.tube.friction == Friction::None {
            return f64::INFINITY;
        }
        let cells = area.iter().zip(flow).zip(&self.middles);
        let times = cells.map(|((area, flow), place)| {
            let force = self.tube.friction.force(place, flow / area);
            if force == 0.0 {
                f64::INFINITY
            } else {
                DAMPED * flow / force
            }
        });
        times.fold(f64::INFINITY, f64::min)
    }

    /// Fills the rates of a state.
    fn stage(&mut self, t: f64, area: &[f64], flow: &[f64], rigid: [f64; 2]) -> Result<Powers> {
        let n = area.len();
        let mut work = std::mem::take(&mut self.work);
        let done = self.fill(&mut work, t, area, flow, rigid);
        self.work = work;
        done?;
        let work = &self.work;
        let (density, extra) = (self.tube.density, self.tube.outside.at(t));
        let mut powers = Powers::default();
        for side in 0..2 {
            let face = side * n;
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let end = work.ends[side];
            let velocity = end.flow / end.area;
            powers.ends += sign
                * work.fluxes[face].volume
                * (end.pressure + 0.5 * density * velocity * velocity);
        }
        let mut growth = 0.0;
        for i in 0..n {
            let place = &self.middles[i];
            let velocity = flow[i] / area[i];
            let wall = self.tube.law.at(area[i] / place.area);
            let [by_area, by_flow] = work.rates[i];
            let by_area_of_energy =
                place.stiffness * wall.pressure - 0.5 * density * velocity * velocity;
            growth += by_area_of_energy * by_area + density * velocity * by_flow;
            powers.outside -= (place.outside + extra) * by_area * self.h;
            powers.friction +=
                density * velocity * self.tube.friction.force(place, velocity) * self.h;
        }
        powers.jumps = powers.ends + powers.outside - powers.friction - growth * self.h;
        Ok(powers)
    }

    fn fill(
        &self,
        work: &mut Scratch,
        t: f64,
        area: &[f64],
        flow: &[f64],
        rigid: [f64; 2],
    ) -> Result<()> {
        let n = area.len();
        for i in 0..n {
            let (sides, source) = self.reconstruct(i, area, flow);
            (work.sides[i], work.sources[i]) = (sides, source);
        }
        work.top = 0.0;
        for face in 1..n {
            let place = &self.faces[face];
            let [left, right] = [work.sides[face - 1][1], work.sides[face][0]]
                .map(|[area, flow]| self.tube.sided(place, area, flow));
            let (flux, top) = (self.tube.flux(place, &left, &right))
                .map_err(|error| FlowLaw::at_place(&error, face as f64 * self.h))?;
            work.fluxes[face] = flux;
            work.top = work.top.max(top);
        }
        let extra = self.tube.outside.at(t);
        for (side, held) in rigid.into_iter().enumerate() {
            let (face, cell) = (side * n, side * (n - 1));
            let place = self.faces[face];
            let [area, flow] = work.sides[cell][side];
            let inside = self.tube.sided(&place, area, flow);
            let now = EndNow {
                time: t,
                outside: place.outside + extra,
                flow: held,
            };
            let at = self.tube.end_state(side, &place, &inside, now)?;
            work.fluxes[face] = at.flux;
            for state in [&inside, &at] {
                work.top = work.top.max(state.velocity.abs() + state.speed);
            }
            let wall = self.tube.law.at(at.area / place.area);
            let pressure = now.outside + place.stiffness * wall.pressure;
            work.ends[side] = FlowEndState {
                pressure,
                flow: at.flow,
                area: at.area,
            };
            work.rigid[side] = match &self.tube.ends[side] {
                FlowEnd::Reservoir(reservoir) if reservoir.inertance > 0.0 => {
                    let at = EndPressure {
                        pressure,
                        dynamic: 0.5 * self.tube.density * at.velocity * at.velocity,
                        reservoir: reservoir.pressure.at(t),
                        flow: at.flow,
                    };
                    self.tube.end_rate(reservoir, side, at)
                }
                _ => 0.0,
            };
        }
        if !(work.top > 0.0 && work.top < f64::INFINITY) {
            return Err(Error::no_convergence(
                "the speed of waves is not finite in the tube",
            ));
        }
        for i in 0..n {
            let (left, right) = (work.fluxes[i], work.fluxes[i + 1]);
            work.rates[i] = [
                (left.volume - right.volume) / self.h,
                (left.momentum - right.momentum + work.sources[i]) / self.h,
            ];
        }
        Ok(())
    }

    fn cell(&self, i: usize, area: f64, flow: f64) -> Cell {
        let place = &self.middles[i];
        let alpha = area / place.area;
        let wall = self.tube.law.at(alpha);
        let unit = place.stiffness / self.tube.density;
        let velocity = flow / area;
        Cell {
            area,
            flow,
            velocity,
            speed: (unit * alpha * wall.slope).sqrt(),
            head: 0.5 * velocity * velocity
                + unit * wall.pressure
                + place.outside / self.tube.density,
            friction: self.tube.friction.force(place, velocity),
        }
    }

    /// \[area, flow\] at the two faces of a cell, and the change of the momentum by wall, surroundings and friction.
    fn reconstruct(&self, i: usize, area: &[f64], flow: &[f64]) -> ([[f64; 2]; 2], f64) {
        let n = area.len();
        let cell = self.cell(i, area[i], flow[i]);
        let base = self.steady(i, &cell);
        let step = |k: usize, there: f64| [area[k] - there, flow[k] - flow[i]];
        let before = (i > 0).then(|| step(i - 1, base.middles[0]).map(|rise| -rise));
        let after = (i + 1 < n).then(|| step(i + 1, base.middles[1]));
        let slope = match (before, after) {
            (Some(before), Some(after)) => {
                let spread = [area[i - 1], area[i], area[i + 1]];
                let steep = if self.tube.bent(&self.middles[i], spread) {
                    1.0
                } else {
                    2.0
                };
                limited_slope(&cell, steep, before, after)
            }
            (None, Some(rise)) | (Some(rise), None) if rise[0].abs() < SMOOTH * cell.area => rise,
            _ => [0.0; 2],
        };
        let mut sides = [0, 1].map(|side| {
            let half = if side == 0 { -0.5 } else { 0.5 };
            [
                base.faces[side] + half * slope[0],
                flow[i] + half * slope[1],
            ]
        });
        let fits = |side: usize| {
            self.tube
                .law
                .check(sides[side][0] / self.faces[i + side].area)
                .is_ok()
        };
        if !(fits(0) && fits(1)) {
            sides = [0, 1].map(|side| [base.faces[side], flow[i]]);
        }
        (sides, base.source)
    }

    /// The steady flow through the cell `i`; without one, the area of the middle.
    fn steady(&self, i: usize, cell: &Cell) -> SteadyCell {
        let plain = SteadyCell {
            faces: [cell.area; 2],
            middles: [cell.area; 2],
            source: 0.0,
        };
        if self.uniform {
            return plain;
        }
        let n = self.middles.len();
        // The head falls by friction.
        let fall = cell.friction / cell.area;
        let along = |place: &Place, distance: f64| {
            self.area_of_head(place, cell, cell.head - fall * distance)
        };
        let faces = [
            along(&self.faces[i], -0.5 * self.h),
            along(&self.faces[i + 1], 0.5 * self.h),
        ];
        if let [Some(left), Some(right)] = faces {
            let thrust = |side: usize, area: f64| {
                self.tube
                    .sided(&self.faces[i + side], area, cell.flow)
                    .flux
                    .momentum
            };
            let beyond = |k: Option<usize>, distance: f64| {
                let place = k.and_then(|k| self.middles.get(k));
                place.map_or(Some(cell.area), |place| along(place, distance))
            };
            let middles = [
                beyond(i.checked_sub(1), -self.h),
                beyond((i + 1 < n).then_some(i + 1), self.h),
            ];
            if let [Some(before), Some(after)] = middles {
                return SteadyCell {
                    faces: [left, right],
                    middles: [before, after],
                    source: thrust(1, right) - thrust(0, left),
                };
            }
        }
        let here = |place: &Place| {
            let wall = self.tube.law.at(cell.area / place.area);
            let unit = place.stiffness / self.tube.density;
            let pressure = unit * wall.pressure + place.outside / self.tube.density;
            place.area * unit * wall.thrust(cell.area / place.area) - cell.area * pressure
        };
        SteadyCell {
            source: here(&self.faces[i + 1]) - here(&self.faces[i]) - self.h * cell.friction,
            ..plain
        }
    }

    /// The area at a place with the flow of a cell and the head `head`, on the cell's side of choking.
    fn area_of_head(&self, place: &Place, cell: &Cell, head: f64) -> Option<f64> {
        let unit = place.stiffness / self.tube.density;
        let flow = cell.flow / place.area;
        let mut alpha = cell.area / place.area;
        let slow = cell.velocity.abs() < cell.speed;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        for _ in 0..30 {
            let wall = self.tube.law.at(alpha);
            let velocity = flow / alpha;
            let off = 0.5 * velocity * velocity
                + unit * wall.pressure
                + place.outside / self.tube.density
                - head;
            let slope = unit * wall.slope - velocity * velocity / alpha;
            if (slope > 0.0) != slow {
                return None;
            }
            let change = off / slope;
            let done = change.abs() <= ROUNDING * alpha;
            if change > 0.0 {
                high = alpha;
            } else {
                low = alpha;
            }
            // Past a bend of the law, or near choking, the step may be far too long.
            let next = (alpha - change).clamp(0.5 * alpha, 2.0 * alpha);
            let bracketed = done || low < next && next < high;
            alpha = if bracketed { next } else { 0.5 * (low + high) };
            if done {
                return self.tube.law.check(alpha).ok().map(|()| alpha * place.area);
            }
        }
        None
    }
}

/// A steady flow through a cell.
#[derive(Debug, Clone, Copy)]
struct SteadyCell {
    /// Areas at the faces.
    faces: [f64; 2],
    /// Areas at the middles of the neighbours.
    middles: [f64; 2],
    /// Change of the momentum.
    source: f64,
}

/// The slope of area and flow over a cell, by the characteristic variables, from the rises before and after it.
#[inline]
fn limited_slope(cell: &Cell, steep: f64, before: [f64; 2], after: [f64; 2]) -> [f64; 2] {
    let (down, up) = (cell.velocity + cell.speed, cell.velocity - cell.speed);
    let parts = |[area, flow]: [f64; 2]| {
        let one = 0.5 / cell.speed;
        [(flow - up * area) * one, (down * area - flow) * one]
    };
    let (a, b) = (parts(before), parts(after));
    let [right, left] = [0, 1].map(|k| limited(steep, a[k], b[k]));
    [right + left, down * right + up * left]
}
