//! Contacts that last: closing, release, slip and stick, and the states that keep the constraints.

use super::contact_dynamics::ContactDynamics;
use super::contact_event::{ContactChange, ContactEvent};
use super::contact_forces::{Closed, ContactRow, Grip, Moment};
use super::contact_set::{ContactSet, Pending};
use super::impacts::connected;
use nalgebra::{Vector2, Vector3};
use snaprod_systems::contact::{Mode, OneContact, Touch};
use snaprod_systems::error::Result;

/// Slip speed, as a part of the resting speed, below which surfaces do not slip.
pub(super) const STILL: f64 = 1e-3;
/// Acceleration of a gap, relative to that without contact forces, above which an unloaded contact opens.
const OPENS: f64 = 1e-9;
/// Way beyond a sharp edge after which a point has left the face.
const OFF_FACE: f64 = 1e-12;
/// Gaps and normal velocities of closed contacts above which a state is corrected.
const DRIFT: f64 = 1e-14;

/// An event of a closed contact to watch for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestWatch {
    pub candidate: usize,
    pub what: Watched,
}

/// A quantity whose fall to zero is an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Watched {
    /// The normal force.
    Pressure,
    /// The margin of the friction of surfaces that stick.
    Hold,
    /// The speed of slip along its direction.
    Slip,
    /// Less than [`OFF_FACE`] beyond a sharp edge of the face. A point that slides over the edge leaves the obstacle.
    Edge,
}

impl Moment<'_> {
    /// The watched quantities of the closed contacts, with their values.
    pub(crate) fn watch(mut self, closed: &[Closed]) -> Option<Vec<(RestWatch, f64)>> {
        let (rows, solution) = self.forces(closed)?;
        let held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        let mut watched = Vec::with_capacity(2 * rows.len());
        for (i, (row, closed)) in rows.iter().zip(held).enumerate() {
            let candidate = closed.candidate;
            let force: Vector3<f64> = solution.forces.fixed_rows::<3>(3 * i).into_owned();
            let of = |what| RestWatch { candidate, what };
            watched.push((of(Watched::Pressure), force.x));
            if closed.face.is_some() {
                // The place of the whole obstacle nearest to the point, beside that of the plane of the face.
                let nearest = |touch: &Touch| touch.point - touch.normal * touch.gap;
                let aside = nearest(&self.touch(candidate).0) - nearest(&row.touch);
                watched.push((of(Watched::Edge), OFF_FACE - aside.norm()));
            }
            let friction = self.system.candidates[candidate].surface.friction();
            match closed.grip {
                // Without friction nothing changes where the slip turns round.
                Grip::Slip(_) if friction == 0.0 => {}
                Grip::Slip(along) => {
                    watched.push((of(Watched::Slip), row.tangential().dot(&along)));
                }
                _ => watched.push((
                    of(Watched::Hold),
                    friction * force.x - force.y.hypot(force.z),
                )),
            }
        }
        Some(watched)
    }
}

impl ContactSet<'_> {
    fn still(&self) -> f64 {
        STILL * self.resting_speed
    }

    /// Decides which contacts are closed: those closed up to now and the new ones, each with its normal velocity after
    /// an impact. Velocities of `y` are corrected to those of closed contacts.
    ///
    /// # Errors
    /// Contact forces without a solution, or too many contacts.
    pub(crate) fn settle<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        new: &[(usize, f64)],
    ) -> Result<()> {
        let before = std::mem::take(&mut self.closed);
        let mut numbers: Vec<usize> = before.iter().map(|closed| closed.candidate).collect();
        for &(candidate, speed) in new {
            let elastic = self.system.candidates[candidate].surface.restitution() == 1.0;
            let rests =
                speed <= self.resting_speed && !(elastic && speed > STILL * self.resting_speed);
            if !rests {
                if numbers.contains(&candidate) {
                    self.release(dynamics, y, candidate);
                }
                numbers.retain(|k| *k != candidate);
            } else if !numbers.contains(&candidate) {
                numbers.push(candidate);
            }
        }
        numbers.sort_unstable();
        let now = dynamics.moment(y);
        let mut rows: Vec<ContactRow> = numbers.iter().map(|k| now.row(*k, None)).collect();
        while !rows.is_empty() {
            let chosen = connected(&rows, 0);
            let mut island = Vec::new();
            let mut others = Vec::new();
            for (row, chosen) in rows.into_iter().zip(chosen) {
                if chosen { &mut island } else { &mut others }.push(row);
            }
            self.settle_island(dynamics, y, island, new, &before)?;
            rows = others;
        }
        self.pending
            .retain(|pending| self.closed.iter().any(|c| c.candidate == pending.candidate));
        Ok(())
    }

    /// Settles contacts that act on each other.
    fn settle_island<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        rows: Vec<ContactRow>,
        new: &[(usize, f64)],
        before: &[Closed],
    ) -> Result<()> {
        let mut now = dynamics.moment(y);
        let still = self.still();
        let contacts = now.contacts(&rows, |row| {
            (row.tangential().norm() > still).then(Vector2::x)
        });
        let free: Vec<Vector3<f64>> = rows.iter().map(|row| now.second_rates(row)).collect();
        let scale = free
            .iter()
            .fold(0.0_f64, |most, free| most.max(free.amax()));
        let problem = now.problem(&rows, free.into_iter(), contacts);
        let solution = problem.solve()?;
        let mut stays = Vec::new();
        for (i, row) in rows.iter().enumerate() {
            let grip = match solution.modes[i] {
                Mode::Open if solution.motion[3 * i] > OPENS * scale => {
                    if before
                        .iter()
                        .any(|closed| closed.candidate == row.candidate)
                    {
                        self.release(dynamics, y, row.candidate);
                    }
                    continue;
                }
                Mode::Open => Grip::Idle,
                Mode::Stick => Grip::Stick,
                Mode::Slip(d) => Grip::Slip(row.axes * Vector3::new(0.0, d.x, d.y)),
            };
            let closed = Closed {
                candidate: row.candidate,
                grip,
                face: now.face(row.candidate),
            };
            self.closed.push(closed);
            stays.push((i, closed));
            // The sum of the flights that are left, 2 v/a (1 + e + ..).
            let came = new.iter().find(|(k, _)| *k == row.candidate);
            let e = self.system.candidates[row.candidate].surface.restitution();
            if let Some(&(_, speed)) = came
                && grip != Grip::Idle
                && speed > 0.0
                && e > 0.0
            {
                let mut modes = solution.modes.clone();
                modes[i] = Mode::Open;
                let fall = problem
                    .in_modes(&modes)
                    .map_or(0.0, |other| -other.motion[3 * i]);
                if fall > 0.0 {
                    self.pending.push(Pending {
                        candidate: row.candidate,
                        t: dynamics.time(y) + 2.0 * speed / (fall * (1.0 - e)),
                    });
                }
            }
        }
        // The impulses that the flights left over would have had besides the contact force: along its cone.
        let rows: Vec<ContactRow> = stays
            .iter()
            .filter(|(_, closed)| closed.grip != Grip::Idle)
            .map(|(i, _)| rows[*i].clone())
            .collect();
        let modes: Vec<Mode> = (stays.iter())
            .filter(|(_, closed)| closed.grip != Grip::Idle)
            .map(|(i, _)| solution.modes[*i])
            .collect();
        if rows.iter().any(|row| row.slip.norm() > 0.0) {
            let contacts = now.contacts(&rows, |_| None);
            let problem = now.problem(&rows, rows.iter().map(ContactRow::seen), contacts);
            if let Some(stop) = problem.in_modes(&modes) {
                now.apply(dynamics, &rows, &stop.forces, y);
            }
        }
        Ok(())
    }

    /// Reports the release of a contact.
    fn release<D: ContactDynamics>(&mut self, dynamics: &D, y: &D::State, candidate: usize) {
        self.pending
            .retain(|pending| pending.candidate != candidate);
        let change = self.change(dynamics, y, candidate, &[]);
        self.report(ContactEvent::Release(change));
    }

    /// The record of a contact now; `closed` gives the forces.
    pub(super) fn change<D: ContactDynamics>(
        &self,
        dynamics: &D,
        y: &D::State,
        candidate: usize,
        closed: &[Closed],
    ) -> ContactChange {
        let mut now = dynamics.moment(y);
        let (touch, slip) = now.touch(candidate);
        let force = now.forces(closed).and_then(|(rows, solution)| {
            let i = rows.iter().position(|row| row.candidate == candidate)?;
            let force: Vector3<f64> = solution.forces.fixed_rows::<3>(3 * i).into_owned();
            Some((force.x, rows[i].axes * Vector3::new(0.0, force.y, force.z)))
        });
        let (normal_force, friction) = force.unwrap_or_default();
        ContactChange {
            contact: self.system.candidates[candidate].id,
            t: dynamics.time(y),
            point: touch.point,
            slip,
            normal_force,
            friction,
        }
    }

    /// The event of a watched quantity that came to zero.
    ///
    /// # Errors
    /// As [`BodyMotion::settle`].
    pub(super) fn turn<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        watch: RestWatch,
    ) -> Result<()> {
        let candidate = watch.candidate;
        let at = self.closed.iter().position(|c| c.candidate == candidate);
        let Some(at) = at else {
            return Ok(());
        };
        match watch.what {
            Watched::Pressure | Watched::Edge => {
                self.closed.remove(at);
                self.release(dynamics, y, candidate);
                self.settle(dynamics, y, &[])
            }
            Watched::Hold => {
                let held = self.change(dynamics, y, candidate, &self.closed);
                let onset = -held.friction.try_normalize(0.0).unwrap_or_else(Vector3::x);
                self.closed[at].grip = Grip::Slip(onset);
                let change = self.change(dynamics, y, candidate, &self.closed);
                self.report(ContactEvent::Slip(change));
                Ok(())
            }
            Watched::Slip => {
                let Grip::Slip(along) = self.closed[at].grip else {
                    return Ok(());
                };
                // In space a slip may only turn by a right angle.
                let mut now = dynamics.moment(y);
                let row = now.row(candidate, None);
                let speed = row.tangential().norm();
                if speed > self.resting_speed {
                    self.closed[at].grip = Grip::Slip(row.tangential() / speed);
                    return Ok(());
                }
                let friction = now.contacts(std::slice::from_ref(&row), |_| None);
                let seen = Vector3::new(0.0, row.seen().y, row.seen().z);
                let rows = [row];
                let problem = now.problem(&rows, std::iter::once(seen), friction);
                if let Some(stop) = problem.in_modes(&[Mode::Stick]) {
                    now.apply(dynamics, &rows, &stop.forces, y);
                }
                self.settle(dynamics, y, &[])?;
                let grip = self.closed.iter().find(|c| c.candidate == candidate);
                let change = self.change(dynamics, y, candidate, &self.closed);
                match grip.map(|closed| closed.grip) {
                    Some(Grip::Stick) => self.report(ContactEvent::Stick(change)),
                    Some(Grip::Slip(now)) if now.dot(&along) < 0.0 => {
                        self.report(ContactEvent::Reverse(change));
                    }
                    _ => {}
                }
                Ok(())
            }
        }
    }

    /// Corrects a state at the end of a step: gaps and normal velocities of closed contacts to zero, and the slip of
    /// surfaces that stick. Directions of slip are renewed. Returns true if the state changed.
    pub(crate) fn keep<D: ContactDynamics>(&mut self, dynamics: &D, y: &mut D::State) -> bool {
        if self.closed.iter().all(|closed| closed.grip == Grip::Idle) {
            return false;
        }
        let mut now = dynamics.places(y);
        let rows = now.held_rows(&self.closed);
        let held = self.closed.iter_mut().filter(|c| c.grip != Grip::Idle);
        let mut drift: f64 = 0.0;
        let mut modes = Vec::with_capacity(rows.len());
        for (closed, row) in held.zip(&rows) {
            drift = drift.max(row.touch.gap.abs()).max(row.seen().x.abs());
            if let Grip::Slip(along) = &mut closed.grip {
                let slip = row.tangential();
                if slip.dot(along) > STILL * self.resting_speed {
                    *along = slip.normalize();
                }
                modes.push(Mode::Slip(Vector2::x()));
            } else {
                drift = drift.max(row.tangential().norm());
                modes.push(Mode::Stick);
            }
        }
        if drift <= DRIFT {
            return false;
        }
        let smooth = OneContact {
            friction: 0.0,
            least: 0.0,
            slips_along: None,
        };
        let contacts = vec![smooth; rows.len()];
        let gaps: Vec<_> = (rows.iter().map(|row| Vector3::x() * row.touch.gap)).collect();
        let open: Vec<Mode> = rows.iter().map(|_| Mode::Slip(Vector2::x())).collect();
        let problem = now.problem(&rows, gaps.into_iter(), contacts.clone());
        if let Some(shift) = problem.in_modes(&open) {
            dynamics.shift(y, &now.changes(&rows, &shift.forces));
        }
        let problem = now.problem(&rows, rows.iter().map(ContactRow::seen), contacts);
        if let Some(stop) = problem.in_modes(&modes) {
            dynamics.add_twists(y, &now.changes(&rows, &stop.forces));
        }
        true
    }
}
