//! Impacts: one contact alone by its law, several at once by complementarity.

use super::contact_dynamics::ContactDynamics;
use super::contact_event::{ContactEvent, ImpactRecord, RuleOfImpact};
use super::contact_forces::{ContactRow, Moment};
use super::contact_set::ContactSet;
use super::first_touch::DEPTH;
use nalgebra::{DVector, Matrix3, Vector3};
use snaprod_systems::contact::{Impact, OneContact};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::math::se3::halves;

/// Gap below which other approaching contacts take part in an impact.
const SIMULTANEOUS: f64 = 1e-10;
/// Part of the largest impulse below which a contact took no part.
const NO_PART: f64 = 1e-12;

/// Impulses at the contacts of an impact, three components along the axes of each.
struct Impulses {
    all: DVector<f64>,
    after: DVector<f64>,
    rule: RuleOfImpact,
    sticks: Vec<bool>,
}

impl Moment<'_> {
    /// Gives impulses to the bodies of a state, and books the work of obstacles and the loss.
    pub(super) fn apply<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        rows: &[ContactRow],
        impulses: &DVector<f64>,
        y: &mut D::State,
    ) {
        let t = dynamics.time(y);
        let before = self.energies(t)[0];
        let mut work = 0.0;
        for (i, row) in rows.iter().enumerate() {
            let impulse: Vector3<f64> = impulses.fixed_rows::<3>(3 * i).into_owned();
            work += (row.axes * impulse).dot(&self.obstacle_velocity(row));
        }
        let changes = self.changes(rows, impulses);
        dynamics.add_twists(y, &changes);
        for (motion, change) in self.motions.iter_mut().zip(&changes) {
            let (spin, velocity): (Vector3<f64>, Vector3<f64>) = halves(change);
            motion.spin += spin;
            motion.velocity += velocity;
        }
        let loss = before + work - self.energies(t)[0];
        dynamics.book_impact(y, loss, work);
    }
}

impl ContactSet<'_> {
    /// The impact at the state `y` in which the candidate `hit` takes part. Contacts that may close afterwards are
    /// returned with their normal velocities.
    pub(super) fn impact<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        hit: usize,
    ) -> Result<Vec<(usize, f64)>> {
        let mut now = dynamics.places(y);
        let rows = self.rows_of_impact(&now, hit);
        for row in &rows {
            if let Some(spread) = row.touch.spread {
                return Err(Error::domain(format!(
                    "{spread}: such a contact has no single point; tilt the bodies a little, or use other shapes"
                )));
            }
        }
        let impulses = self.impulses(&mut now, &rows)?;
        let largest = impulses.all.amax();
        let mut may_close = Vec::new();
        for (i, row) in rows.iter().enumerate() {
            let part = |all: &DVector<f64>| row.axes * all.fixed_rows::<3>(3 * i);
            let (impulse, after) = (part(&impulses.all), part(&impulses.after));
            may_close.push((row.candidate, impulses.after[3 * i]));
            if impulses.all[3 * i] <= NO_PART * largest {
                continue;
            }
            self.impacts += 1;
            let record = ImpactRecord {
                contact: self.system.candidates[row.candidate].id,
                t: dynamics.time(y),
                point: row.touch.point,
                normal: row.touch.normal,
                before: row.slip,
                after,
                impulse,
                lost: -0.5 * impulse.dot(&(row.slip + after)),
                rule: impulses.rule,
                sticks: impulses.sticks[i],
            };
            self.report(ContactEvent::Impact(record));
        }
        now.apply(dynamics, &rows, &impulses.all, y);
        Ok(may_close)
    }

    /// The contacts that take part: closed or approaching, and connected with the one that is hit through bodies.
    fn rows_of_impact(&self, now: &Moment<'_>, hit: usize) -> Vec<ContactRow> {
        let closed = |k: usize| self.closed.iter().any(|closed| closed.candidate == k);
        let near = (0..self.system.candidates.len()).filter(|&k| {
            if k == hit || closed(k) {
                return true;
            }
            let (touch, slip) = now.touch(k);
            touch.gap <= SIMULTANEOUS && touch.normal.dot(&slip) < 0.0
        });
        let rows: Vec<ContactRow> = near.map(|k| now.row(k, None)).collect();
        let start = rows.iter().position(|row| row.candidate == hit);
        let chosen = connected(&rows, start.unwrap_or(0));
        rows.into_iter()
            .zip(chosen)
            .filter_map(|(row, chosen)| chosen.then_some(row))
            .collect()
    }

    fn impulses(&self, now: &mut Moment<'_>, rows: &[ContactRow]) -> Result<Impulses> {
        let surface = |row: &ContactRow| self.system.candidates[row.candidate].surface;
        let contact = |row: &ContactRow, least: f64| OneContact {
            friction: surface(row).friction(),
            least,
            slips_along: None,
        };
        let contacts = rows.iter().map(|row| contact(row, 0.0)).collect();
        let slips = rows.iter().map(ContactRow::seen);
        let problem = now.problem(rows, slips, contacts);
        if let [row] = rows {
            let inverse_mass: Matrix3<f64> = problem.inverse_mass.fixed_view::<3, 3>(0, 0).into();
            let slip = row.seen();
            let rebound = Impact { inverse_mass, slip }.rebound(&surface(row))?;
            return Ok(Impulses {
                all: DVector::from_column_slice(rebound.impulse.as_slice()),
                after: DVector::from_column_slice(rebound.slip.as_slice()),
                rule: RuleOfImpact::Law(surface(row).law()),
                sticks: vec![rebound.sticks],
            });
        }
        let compression = problem.solve()?;
        let (mut all, mut last) = (compression.forces.clone(), compression);
        if rows.iter().any(|row| surface(row).restitution() > 0.0) {
            let mut problem = problem;
            problem.free = last.motion;
            for (i, (row, contact)) in rows.iter().zip(&mut problem.contacts).enumerate() {
                contact.least = surface(row).restitution() * all[3 * i].max(0.0);
            }
            last = problem.solve()?;
            all += &last.forces;
        }
        let sticks = |i: usize| last.motion[3 * i + 1].hypot(last.motion[3 * i + 2]) <= DEPTH;
        Ok(Impulses {
            all,
            sticks: (0..rows.len()).map(sticks).collect(),
            after: last.motion,
            rule: RuleOfImpact::Simultaneous,
        })
    }
}

/// Which rows are connected with the row `start` through bodies.
pub(super) fn connected(rows: &[ContactRow], start: usize) -> Vec<bool> {
    let mut chosen = vec![false; rows.len()];
    let mut waiting = vec![start];
    while let Some(i) = waiting.pop() {
        if std::mem::replace(&mut chosen[i], true) {
            continue;
        }
        for (j, other) in rows.iter().enumerate() {
            let shared = rows[i].bodies().any(|k| other.bodies().any(|l| l == k));
            if shared && !chosen[j] {
                waiting.push(j);
            }
        }
    }
    chosen
}
