//! Finite volumes: limited slopes of the characteristic variables, a Riemann solver at every face, SSP-RK3.
//!
//! At a face the solver takes acoustic waves into both sides, with the impedance of the shock if that is greater:
//! single shocks are exact. For strong waves, or an inflection of the stress between the states, it solves the
//! Riemann problem of the cells exactly, by the hull of the stress. For stretch and momentum the energy is an entropy
//! with the potential -sigma v. The scheme loses at a face
//!
//! ```text
//! D = [sigma] (v* - mean v) + [v] (sigma* - mean sigma)
//! ```
//!
//! (Tadmor), with brackets and means of the cells. The sum is the loss except for errors of the steps in time.
//! Without slopes every D is positive, whatever the impedances.

use super::edge::Edge;
use super::{Bar, BarMotion, End, EndState, Extremes, LOWER, Law1d, Ledger, Snapshot, no_time};
use crate::profile::limited;
use snaprod_core::error::{Cause, Error, Result, Stuck};

/// A bar in motion by finite volumes.
pub struct FiniteVolumes {
    bar: Bar,
    h: f64,
    most: f64,
    time: f64,
    lam: Vec<f64>,
    v: Vec<f64>,
    ends: [EndState; 2],
    extremes: [Extremes; 2],
    /// Stresses at the inflections of the law.
    bends: Vec<f64>,
    sums: TimeIntegrals,
    /// Energy and momentum at the start.
    first: [f64; 2],
    cells: u64,
    work: StageScratch,
}

/// Integrals over time.
#[derive(Debug, Clone, Copy, Default)]
struct TimeIntegrals {
    work: f64,
    impulse: f64,
    dissipated: f64,
}

/// Workspace of a stage.
#[derive(Default)]
struct StageScratch {
    lam: Vec<f64>,
    v: Vec<f64>,
    sigma: Vec<f64>,
    /// Impedance density x speed.
    z: Vec<f64>,
    /// sigma, v at the left and at the right face of every cell.
    sides: [Vec<f64>; 4],
    /// sigma, v at the faces.
    faces: [Vec<f64>; 2],
    losses: Vec<f64>,
    /// The greater impedance at the faces.
    tops: Vec<f64>,
}

/// Step over h/speed. SSP-RK3 with slopes is stable up to about 1.
pub(super) const COURANT: f64 = 0.6;
/// Largest slope over the lesser jump to the neighbours: the steepest that keeps their bounds.
pub(super) const STEEPEST: f64 = 2.0;
/// Largest jump, relative to the stretch and by the slower of the two states, for which acoustic waves suffice.
const WIDE: f64 = 0.3;
/// Strain across an inflection below which the stress counts as straight.
const FAINT: f64 = 1e-6;

impl FiniteVolumes {
    /// The bar in `cells` equal cells, at least 4.
    ///
    /// # Errors
    /// Fewer cells; a start outside the reach of the law.
    pub fn new(bar: &Bar, cells: usize) -> Result<Self> {
        if cells < 4 {
            return Err(Error::domain(format!(
                "cells = {cells} of a bar: finite volumes need 4 or more"
            )));
        }
        let h = bar.length / cells as f64;
        let (lam, v) = bar.sampled((0..cells).map(|i| (i as f64 + 0.5) * h))?;
        let length: f64 = lam.iter().map(|lam| lam * h).sum();
        let at = |position, x| EndState {
            position,
            velocity: bar.at_start(x)[1],
            stress: 0.0,
        };
        let mut volumes = Self {
            bar: bar.clone(),
            h,
            most: f64::INFINITY,
            time: 0.0,
            ends: [at(0.0, 0.0), at(length, bar.length)],
            extremes: [Extremes::new(0.0, 0.0); 2],
            bends: (bar.material.bends().iter())
                .map(|lam| bar.material.stress(*lam))
                .collect(),
            sums: TimeIntegrals::default(),
            first: [0.0; 2],
            cells: 0,
            work: StageScratch {
                lam: lam.clone(),
                v: v.clone(),
                sigma: vec![0.0; cells],
                z: vec![0.0; cells],
                sides: [(); 4].map(|()| vec![0.0; cells]),
                faces: [(); 2].map(|()| vec![0.0; cells + 1]),
                losses: vec![0.0; cells + 1],
                tops: vec![0.0; cells + 1],
            },
            lam,
            v,
        };
        volumes.look()?;
        volumes.extremes = volumes.ends.map(|end| Extremes::new(0.0, end.stress));
        let [kinetic, strain, momentum] = volumes.energies();
        volumes.first = [kinetic + strain, momentum];
        Ok(volumes)
    }

    /// Bounds the length of the steps.
    #[must_use]
    pub fn bounded(mut self, step: Option<f64>) -> Self {
        self.most = step.unwrap_or(f64::INFINITY);
        self
    }

    /// The width of a cell.
    pub fn width(&self) -> f64 {
        self.h
    }

    /// Cells times steps so far.
    pub fn updates(&self) -> u64 {
        self.cells
    }

    /// Energy dissipated per time at the inner faces in the last stage; face i is at X = i h.
    pub fn losses(&self) -> impl Iterator<Item = f64> {
        let area = self.bar.area;
        self.work.losses.iter().map(move |loss| area * loss)
    }

    /// \[kinetic, strain, momentum\].
    fn energies(&self) -> [f64; 3] {
        let material = &self.bar.material;
        let cell = self.h * self.bar.area;
        let mut sums = [0.0; 3];
        for (lam, v) in self.lam.iter().zip(&self.v) {
            sums[0] += 0.5 * material.density() * v * v * cell;
            sums[1] += material.energy(*lam) * cell;
            sums[2] += material.density() * v * cell;
        }
        for (end, state) in self.bar.ends.iter().zip(&self.ends) {
            if let End::Mass { mass, .. } = end {
                sums[0] += 0.5 * mass * state.velocity.powi(2);
                sums[2] += mass * state.velocity;
            }
        }
        sums
    }

    /// Updates the states of the ends to the present.
    fn look(&mut self) -> Result<()> {
        for side in 0..2 {
            let force = self.bar.ends[side].force_rate(self.time);
            let last = self.ends[side].velocity;
            let edge = self
                .bar
                .edge(side, self.h, [&self.lam, &self.v], last, force)?;
            self.ends[side].stress = edge.stress;
            // The velocity of a mass is a state of its own.
            if !matches!(self.bar.ends[side], End::Mass { .. }) {
                self.ends[side].velocity = edge.velocity;
            }
        }
        Ok(())
    }

    /// Fills the faces from a state; returns the sum of the losses per time.
    fn faces(
        &mut self,
        lam: &[f64],
        v: &[f64],
        mass: [f64; 2],
        force: [[f64; 2]; 2],
    ) -> Result<f64> {
        let density = self.bar.material.density();
        let n = lam.len();
        // Steeper slopes would keep the jump of a compound wave from splitting.
        let steep = if self.bends.is_empty() { STEEPEST } else { 1.0 };
        let StageScratch { sigma, z, .. } = &mut self.work;
        if !self.bar.material.fill(lam, sigma, z) {
            return Err(self.outside(lam));
        }
        for z in z.iter_mut() {
            *z = (density * *z).sqrt();
        }
        let [left, right] = [0, 1].map(|side| {
            self.bar
                .edge(side, self.h, [lam, v], mass[side], force[side])
        });
        let (left, right) = (left?, right?);
        let StageScratch {
            sigma,
            z,
            sides,
            faces,
            losses,
            tops,
            ..
        } = &mut self.work;
        // The end is half a cell away.
        let rises = |edge: &Edge, i: usize| [edge.stress - sigma[i], edge.velocity - v[i]];
        let (into, out) = (rises(&left, 0), rises(&right, n - 1));
        let (first, last) = (into.map(|rise| -2.0 * rise), out.map(|rise| 2.0 * rise));
        (losses[0], losses[n]) = (into[0] * into[1], out[0] * out[1]);
        let [fs, fv] = faces;
        for (face, edge) in [(0, left), (n, right)] {
            (fs[face], fv[face]) = (edge.stress, edge.velocity);
            tops[face] = density * edge.fastest;
        }
        let gap = |i: usize| [sigma[i + 1] - sigma[i], v[i + 1] - v[i]];
        for (i, before, after) in [(0, first, gap(0)), (n - 1, gap(n - 2), last)] {
            let found = sloped(steep, sigma[i], v[i], z[i], before, after);
            for (side, found) in sides.iter_mut().zip(found) {
                side[i] = found;
            }
        }
        // Slices of one length each, so that the loops below run without checks, several cells at a time.
        let inner = n - 2;
        {
            let [sl, vl, sr, vr] = sides.each_mut().map(|side| &mut side[1..=inner]);
            let [s0, s1, s2] = [0, 1, 2].map(|k| &sigma[k..k + inner]);
            let [v0, v1, v2] = [0, 1, 2].map(|k| &v[k..k + inner]);
            let z = &z[1..=inner];
            for i in 0..inner {
                let (before, after) = (
                    [s1[i] - s0[i], v1[i] - v0[i]],
                    [s2[i] - s1[i], v2[i] - v1[i]],
                );
                [sl[i], vl[i], sr[i], vr[i]] = sloped(steep, s1[i], v1[i], z[i], before, after);
            }
        }
        let inner = n - 1;
        let [s0, s1] = [0, 1].map(|k| &sigma[k..k + inner]);
        let [v0, v1] = [0, 1].map(|k| &v[k..k + inner]);
        let [z0, z1] = [0, 1].map(|k| &z[k..k + inner]);
        let [l0, l1] = [0, 1].map(|k| &lam[k..k + inner]);
        let (sl, vl) = (&sides[2][..inner], &sides[3][..inner]);
        let (sr, vr) = (&sides[0][1..=inner], &sides[1][1..=inner]);
        let (fs, fv) = (&mut fs[1..=inner], &mut fv[1..=inner]);
        let inside = &mut losses[1..=inner];
        let tops = &mut tops[1..=inner];
        let (mut wide, scale) = (false, density / WIDE);
        for i in 0..inner {
            let (ds, dv, dl) = (s1[i] - s0[i], v1[i] - v0[i], l1[i] - l0[i]);
            let shock = (density * ds * dl / (dl * dl + 1e-30)).sqrt();
            let (zl, zr) = (z0[i].max(shock), z1[i].max(shock));
            tops[i] = zl.max(zr);
            let one = 1.0 / (zl + zr);
            // v* and sigma* minus the means of the cells.
            let (ms, mv) = (0.5 * (s1[i] + s0[i]), 0.5 * (v1[i] + v0[i]));
            let to_v = (zl * vl[i] + zr * vr[i] + sr[i] - sl[i]) * one - mv;
            let to_s = (zr * sl[i] + zl * sr[i] + zl * zr * (vr[i] - vl[i])) * one - ms;
            let loss = ds * to_v + dv * to_s;
            fs[i] = ms + to_s;
            fv[i] = mv + to_v;
            inside[i] = loss;
            // Possibly a strong jump, by the slower of its sides.
            let weakest = z0[i].min(z1[i]);
            wide |= scale * (to_s.abs() + ds.abs()) > l0[i] * weakest * weakest;
        }
        if wide || !self.bends.is_empty() {
            self.solve_exactly(lam, v)?;
        }
        Ok(self.bar.area * self.work.losses.iter().sum::<f64>())
    }

    /// Solves the Riemann problem of the two cells exactly at the faces for which acoustic waves do not suffice.
    ///
    /// Across an inflection of the stress waves may be compound, and a jump that meets the jump conditions need not
    /// be admissible: the impedance of the chord would keep it for ever. Strong waves of the state between the cells
    /// are faster than either cell's own.
    fn solve_exactly(&mut self, lam: &[f64], v: &[f64]) -> Result<()> {
        let (material, density) = (&self.bar.material, self.bar.material.density());
        let StageScratch {
            sigma,
            z,
            faces: [fs, fv],
            losses,
            tops,
            ..
        } = &mut self.work;
        for face in 1..lam.len() {
            let (l, r) = (face - 1, face);
            let (low, high) = (
                sigma[l].min(sigma[r]).min(fs[face]),
                sigma[l].max(sigma[r]).max(fs[face]),
            );
            let weakest = z[l].min(z[r]);
            let beyond = (fs[face] - 0.5 * (sigma[l] + sigma[r])).abs();
            let jump = beyond + 0.5 * (sigma[r] - sigma[l]).abs();
            let strain = density * jump / (weakest * weakest);
            let bent = strain > FAINT && self.bends.iter().any(|bend| low < *bend && *bend < high);
            if !(bent || strain > WIDE * lam[l]) {
                continue;
            }
            let [stretch, velocity] = material.between([lam[l], v[l]], [lam[r], v[r]])?;
            let stress = material.stress(stretch);
            losses[face] = (sigma[r] - sigma[l]) * (velocity - 0.5 * (v[l] + v[r]))
                + (v[r] - v[l]) * (stress - 0.5 * (sigma[l] + sigma[r]));
            (fs[face], fv[face]) = (stress, velocity);
            let fastest = [lam[l], lam[r]].map(|ahead| material.fastest(ahead, stretch));
            tops[face] = density * fastest[0].max(fastest[1]);
        }
        Ok(())
    }

    fn outside(&self, lam: &[f64]) -> Error {
        let bad = lam
            .iter()
            .enumerate()
            .find(|(_, lam)| self.bar.material.check(**lam).is_err());
        let (i, lam) = bad.map_or((0, f64::NAN), |(i, lam)| (i, *lam));
        let x = (i as f64 + 0.5) * self.h;
        let [low, high] = self.bar.material.reach();
        Error::domain(format!(
            "the stretch {lam} at X = {x} has left ({low}, {high}), where the stress of the bar grows with the stretch"
        ))
    }

    /// One step, at most to `until`, at most to the break of a load.
    fn step(&mut self, until: f64) -> Result<()> {
        let n = self.lam.len();
        let stop = self.bar.next_break(self.time);
        let [mut lam, mut v] = [&mut self.work.lam, &mut self.work.v].map(std::mem::take);
        lam.copy_from_slice(&self.lam);
        v.copy_from_slice(&self.v);
        let density = self.bar.material.density();
        let started = self.ends.map(|end| end.velocity);
        let mut mass = started;
        let mut dt = 0.0;
        let mut done = Ok(());
        for (part, share, at) in [
            (1.0, 1.0 / 6.0, 0.0),
            (0.25, 1.0 / 6.0, 1.0),
            (2.0 / 3.0, 2.0 / 3.0, 0.5),
        ] {
            // At the end of a step up to a break, the load still has its value before the break.
            let t = (self.time + at * dt).min(stop.next_down());
            let force = [0, 1].map(|side| self.bar.ends[side].force_rate(t));
            let loss = match self.faces(&lam, &v, mass, force) {
                Ok(found) => found,
                Err(error) => {
                    done = Err(error);
                    break;
                }
            };
            let faces = &self.work.faces;
            if at == 0.0 {
                for side in 0..2 {
                    let [stress, velocity] = [0, 1].map(|k| faces[k][side * n]);
                    self.extremes[side].see(self.time, stress);
                    self.ends[side].velocity = velocity;
                }
                let most = self.work.tops.iter().fold(0.0f64, |most, z| most.max(*z));
                dt = (COURANT * self.h * density / most).min(self.most);
                dt = dt.min(until.min(stop) - self.time);
            }
            let (keep, to_lam) = (1.0 - part, part * dt / self.h);
            let to_v = to_lam / density;
            let [[fs0, fs1], [fv0, fv1]] = [0, 1].map(|k| [0, 1].map(|j| &faces[k][j..j + n]));
            let (lam0, v0) = (&self.lam[..n], &self.v[..n]);
            for (i, (lam, v)) in lam.iter_mut().zip(v.iter_mut()).enumerate() {
                *lam = keep * lam0[i] + part * *lam + to_lam * (fv1[i] - fv0[i]);
                *v = keep * v0[i] + part * *v + to_v * (fs1[i] - fs0[i]);
            }
            for side in 0..2 {
                let [stress, velocity] = [0, 1].map(|k| faces[k][side * n]);
                let pull = if side == 0 { stress } else { -stress } * self.bar.area;
                let share = share * dt;
                self.ends[side].position += share * velocity;
                match &self.bar.ends[side] {
                    End::Wall => self.sums.impulse -= share * pull,
                    End::Loaded(_) => {
                        self.sums.impulse += share * force[side][0];
                        self.sums.work += share * force[side][0] * velocity;
                    }
                    End::Mass { mass: m, .. } => {
                        self.sums.impulse += share * force[side][0];
                        self.sums.work += share * force[side][0] * velocity;
                        let moved = mass[side] + dt * (force[side][0] + pull) / m;
                        mass[side] = keep * started[side] + part * moved;
                    }
                }
            }
            self.sums.dissipated += share * dt * loss;
        }
        if done.is_ok() {
            std::mem::swap(&mut lam, &mut self.lam);
            std::mem::swap(&mut v, &mut self.v);
            self.time = if dt >= until.min(stop) - self.time {
                until.min(stop)
            } else {
                self.time + dt
            };
            self.cells += n as u64;
            for (end, velocity) in self.ends.iter_mut().zip(mass) {
                end.velocity = velocity;
            }
        }
        (self.work.lam, self.work.v) = (lam, v);
        done
    }
}

impl BarMotion for FiniteVolumes {
    fn time(&self) -> f64 {
        self.time
    }

    fn go(&mut self, until: f64, steps: usize) -> Result<(), Stuck> {
        let stuck = |at: f64, error| Stuck::new(at, Cause::Failed(error), LOWER);
        for _ in 0..steps {
            if self.time >= until {
                break;
            }
            let (at, stop) = (self.time, until.min(self.bar.next_break(self.time)));
            self.step(until).map_err(|error| stuck(at, error))?;
            // A step up to a break may be arbitrarily short.
            if self.time < stop && until + (self.time - at) == until {
                return Err(no_time(at));
            }
        }
        if self.time < until {
            return Ok(());
        }
        self.look().map_err(|error| stuck(self.time, error))?;
        for side in 0..2 {
            self.extremes[side].see(self.time, self.ends[side].stress);
        }
        Ok(())
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot {
            time: self.time,
            x: (0..self.lam.len())
                .map(|i| (i as f64 + 0.5) * self.h)
                .collect(),
            stretch: self.lam.clone(),
            velocity: self.v.clone(),
            stress: self
                .lam
                .iter()
                .map(|lam| self.bar.material.stress(*lam))
                .collect(),
            ends: self.ends,
        }
    }

    fn ledger(&self) -> Ledger {
        let [kinetic, strain, momentum] = self.energies();
        Ledger {
            kinetic,
            strain,
            work: self.sums.work,
            lost: self.first[0] + self.sums.work - kinetic - strain,
            dissipated: self.sums.dissipated,
            momentum: momentum - self.first[1],
            impulse: self.sums.impulse,
        }
    }

    fn extremes(&self) -> [Extremes; 2] {
        self.extremes
    }
}

/// (sigma, v) at the left and at the right face of a cell, from the jumps of (sigma, v) before and after it.
#[inline]
fn sloped(steep: f64, sigma: f64, v: f64, z: f64, before: [f64; 2], after: [f64; 2]) -> [f64; 4] {
    let one = 1.0 / z;
    let (ap, am) = (before[1] + before[0] * one, before[1] - before[0] * one);
    let (bp, bm) = (after[1] + after[0] * one, after[1] - after[0] * one);
    let (p, m) = (limited(steep, ap, bp), limited(steep, am, bm));
    let (ds, dv) = (0.25 * z * (p - m), 0.25 * (p + m));
    [sigma - ds, v - dv, sigma + ds, v + dv]
}
