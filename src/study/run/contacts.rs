//! Contacts of a run with obstacles: events, the table `contacts`, the entry `contact` of the summary.

use super::header::RunHeader;
use super::record::{RunBranch, RunRecord};
use super::summary::object;
use super::table::name;
use crate::error::Quantity;
use crate::motion::contact::{ContactChange, ContactEvent, ContactId, ContactNow, Partner};
use crate::motion::contact::{
    ContactSample, ImpactRecord, RodContactEvent, RodContactNow, RodPartner, Rubbing,
};
use crate::scene::Scales;
use crate::study::{Cell, Column, Table};
use nalgebra::Vector3;
use serde_json::{Map, Value, json};

/// The contacts of a branch, in the units of the scene.
#[derive(Debug, Clone, Default)]
pub struct BranchContacts {
    /// Impacts and changes of contacts, in the order of time.
    pub events: Vec<ContactEvent>,
    /// Touches and releases of rods, in the order of time.
    pub rod_events: Vec<RodContactEvent>,
    /// Least gap at a sample or the end of a step; infinite without any.
    pub least_gap: f64,
    /// Largest |friction| / (coefficient * normal force) - 1 at a sample; `None` without friction.
    pub max_cone: Option<f64>,
}

impl BranchContacts {
    /// No contacts yet.
    pub fn new() -> Self {
        Self {
            least_gap: f64::INFINITY,
            ..Self::default()
        }
    }

    /// Takes in the contacts of a state.
    pub fn look(&mut self, sample: &ContactSample) {
        self.least_gap = self.least_gap.min(sample.least_gap);
        let bodies = sample.contacts.iter();
        let bodies = bodies.map(|at| (at.coefficient * at.normal_force, at.friction.norm()));
        let rods = sample.rods.iter();
        let rods = rods.map(|at| {
            let most = at.rubbing.coefficient * at.normal_force;
            (most, at.rubbing.friction.norm())
        });
        for (most, friction) in bodies.chain(rods).filter(|(most, _)| *most > 0.0) {
            let cone = friction / most - 1.0;
            self.max_cone = Some(self.max_cone.map_or(cone, |other| other.max(cone)));
        }
    }

    /// The contacts in the units of the scene.
    pub fn outward(&self, k: &Scales) -> Self {
        Self {
            events: self.events.iter().map(|event| outward(k, event)).collect(),
            rod_events: (self.rod_events.iter())
                .map(|event| RodContactEvent {
                    t: k.outward(Quantity::Time, event.t),
                    at: rod_outward(k, &event.at),
                    ..*event
                })
                .collect(),
            least_gap: k.outward(Quantity::Length, self.least_gap),
            max_cone: self.max_cone,
        }
    }
}

/// The contacts of a state in the units of the scene.
pub(super) fn sample_outward(k: &Scales, sample: &ContactSample) -> ContactSample {
    let energy = |x: f64| k.outward(Quantity::Couple, x);
    let force = |f: Vector3<f64>| k.outward(Quantity::Force, f);
    let contact = |at: &ContactNow| ContactNow {
        point: k.outward(Quantity::Length, at.point),
        normal_force: k.outward(Quantity::Force, at.normal_force),
        friction: force(at.friction),
        slip: k.outward(Quantity::Velocity, at.slip),
        ..*at
    };
    ContactSample {
        impact_lost: energy(sample.impact_lost),
        closing_lost: energy(sample.closing_lost),
        barrier: energy(sample.barrier),
        friction_lost: energy(sample.friction_lost),
        obstacle_work: energy(sample.obstacle_work),
        least_gap: k.outward(Quantity::Length, sample.least_gap),
        contacts: sample.contacts.iter().map(contact).collect(),
        rods: (sample.rods.iter()).map(|at| rod_outward(k, at)).collect(),
    }
}

/// The contact of a rod in the units of the scene.
fn rod_outward(k: &Scales, at: &RodContactNow) -> RodContactNow {
    RodContactNow {
        s: k.outward(Quantity::Length, at.s),
        point: k.outward(Quantity::Length, at.point),
        normal_force: k.outward(Quantity::Force, at.normal_force),
        partner: match at.partner {
            RodPartner::Rod { rod, s, stretch } => RodPartner::Rod {
                rod,
                s: k.outward(Quantity::Length, s),
                stretch: stretch.map(|s| k.outward(Quantity::Length, s)),
            },
            obstacle @ RodPartner::Obstacle(_) => obstacle,
        },
        stretch: at.stretch.map(|s| k.outward(Quantity::Length, s)),
        rubbing: Rubbing {
            friction: k.outward(Quantity::Force, at.rubbing.friction),
            slip: (at.rubbing.slip).map(|slip| k.outward(Quantity::Velocity, slip)),
            ..at.rubbing
        },
        ..*at
    }
}

/// An event in the units of the scene.
fn outward(k: &Scales, event: &ContactEvent) -> ContactEvent {
    let impulse = k.outward(Quantity::Couple, 1.0) / k.outward(Quantity::Velocity, 1.0);
    let change = |at: &ContactChange| ContactChange {
        t: k.outward(Quantity::Time, at.t),
        point: k.outward(Quantity::Length, at.point),
        slip: k.outward(Quantity::Velocity, at.slip),
        normal_force: k.outward(Quantity::Force, at.normal_force),
        friction: k.outward(Quantity::Force, at.friction),
        ..*at
    };
    match event {
        ContactEvent::Impact(at) => ContactEvent::Impact(ImpactRecord {
            t: k.outward(Quantity::Time, at.t),
            point: k.outward(Quantity::Length, at.point),
            before: k.outward(Quantity::Velocity, at.before),
            after: k.outward(Quantity::Velocity, at.after),
            impulse: at.impulse * impulse,
            lost: k.outward(Quantity::Couple, at.lost),
            ..*at
        }),
        ContactEvent::Accumulation(at) => ContactEvent::Accumulation(change(at)),
        ContactEvent::Slip(at) => ContactEvent::Slip(change(at)),
        ContactEvent::Stick(at) => ContactEvent::Stick(change(at)),
        ContactEvent::Reverse(at) => ContactEvent::Reverse(change(at)),
        ContactEvent::Release(at) => ContactEvent::Release(change(at)),
    }
}

impl RunHeader {
    /// Names of the two sides of a contact.
    pub fn sides(&self, contact: ContactId) -> [&str; 2] {
        let body = |k: usize| match self.bodies.get(k) {
            Some(body) if !body.name.is_empty() => body.name.as_str(),
            _ => "body",
        };
        let partner = match contact.partner {
            Partner::Body(k) => body(k),
            Partner::Obstacle(k) => self.obstacles.get(k).map_or("", |obstacle| &obstacle.name),
        };
        [body(contact.body), partner]
    }

    /// Names of a rod and of its partner at a contact.
    fn rod_sides(&self, contact: &RodContactNow) -> [&str; 2] {
        let rod = |k: usize| self.rod_name(k).unwrap_or("rod");
        let other = match contact.partner {
            RodPartner::Obstacle(k) => self.obstacles.get(k).map_or("", |obstacle| &obstacle.name),
            RodPartner::Rod { rod: k, .. } => rod(k),
        };
        [rod(contact.rod), other]
    }

    /// True if rods with all of their mass touch obstacles, through a barrier.
    pub fn has_barrier(&self) -> bool {
        self.barrier_gap.is_some()
    }

    /// True for a run among obstacles.
    pub fn has_obstacles(&self) -> bool {
        !self.obstacles.is_empty()
    }
}

/// The table `contacts` of a branch, without rows.
pub(super) fn table(header: &RunHeader, branch: usize) -> Table {
    let u = header.units;
    let mut columns = vec![
        Column::reals("t", u.time(), "time"),
        Column::words("a", "the body, or the rod"),
        Column::words("b", "the obstacle, or the other rod or body"),
    ];
    for axis in ["x", "y", "z"] {
        let meaning = format!("place of the contact, along {axis}");
        columns.push(Column::reals(axis, u.length(), meaning));
    }
    for axis in ["x", "y", "z"] {
        let meaning = format!("unit normal from the obstacle to the body, along {axis}");
        columns.push(Column::reals(format!("n{axis}"), "", meaning));
    }
    columns.extend([
        Column::reals("normal", u.force(), "normal force on the body"),
        Column::reals("tangential", u.force(), "size of the friction on the body"),
        Column::reals(
            "slip_rate",
            u.velocity(),
            "speed of the body along the surface, seen from the obstacle",
        ),
        Column::words("state", "stick or slip"),
        Column::reals(
            "s",
            u.length(),
            "arclength of the contact of a rod, the centre of the forces on a stretch; empty for a body",
        ),
        Column::reals("s_from", u.length(), "where the stretch of a rod that touches begins"),
        Column::reals("s_to", u.length(), "where the stretch ends"),
        Column::reals(
            "s_other",
            u.length(),
            "arclength of the contact along the other rod; empty at an obstacle",
        ),
    ]);
    Table::new(name("contacts", branch), columns)
}

/// The rows of a state in the table `contacts`, in the units of the scene.
pub(super) fn rows(header: &RunHeader, t: f64, sample: &ContactSample) -> Vec<Vec<Cell>> {
    let row = |contact: &ContactNow| {
        let [a, b] = header.sides(contact.contact);
        let n = contact.normal;
        let slip = contact.slip - n * n.dot(&contact.slip);
        let word = |word: &str| Cell::Word(word.to_owned().into());
        let mut cells = vec![Cell::Real(t), word(a), word(b)];
        let place = contact.point.iter().chain(n.iter());
        cells.extend(place.copied().map(Cell::Real));
        cells.extend([
            Cell::Real(contact.normal_force),
            Cell::Real(contact.friction.norm()),
            Cell::Real(slip.norm()),
            word(if contact.sticks { "stick" } else { "slip" }),
            None::<f64>.into(),
            None::<f64>.into(),
            None::<f64>.into(),
            None::<f64>.into(),
        ]);
        cells
    };
    let rod = |contact: &RodContactNow| {
        let word = |word: &str| Cell::Word(word.to_owned().into());
        let [a, b] = header.rod_sides(contact);
        let (rubbing, n) = (&contact.rubbing, contact.normal);
        let along = |slip: &Vector3<f64>| (slip - n * n.dot(slip)).norm();
        let mut cells = vec![Cell::Real(t), word(a), word(b)];
        let place = contact.point.iter().chain(contact.normal.iter());
        cells.extend(place.copied().map(Cell::Real));
        cells.extend([
            Cell::Real(contact.normal_force),
            Cell::Real(rubbing.friction.norm()),
            rubbing.slip.map(|slip| along(&slip)).into(),
            word(if contact.sticks() { "stick" } else { "slip" }),
            Cell::Real(contact.s),
            Cell::Real(contact.stretch[0]),
            Cell::Real(contact.stretch[1]),
            contact.partner.s().into(),
        ]);
        cells
    };
    let rods = sample.rods.iter().map(rod);
    sample.contacts.iter().map(row).chain(rods).collect()
}

/// Columns of the energies of contacts in the trajectory; those of barriers where there is one.
pub(super) fn columns(header: &RunHeader) -> Vec<Column> {
    let units = header.units;
    let energy = |name, meaning| Column::reals(name, units.energy(), meaning);
    let mut columns = vec![
        energy(
            "impact_lost",
            "lost in impacts so far, a part of dissipated",
        ),
        energy(
            "friction_lost",
            "lost to friction at contacts so far, a part of dissipated",
        ),
        energy(
            "obstacle_work",
            "work of moving obstacles so far, a part of work",
        ),
    ];
    if header.has_barrier() {
        columns.push(energy(
            "closing_lost",
            "lost where surfaces close so far, a part of dissipated",
        ));
        columns.push(energy(
            "barrier",
            "energy of the barrier between surfaces, a part of elastic",
        ));
    }
    columns
}

/// Values of [`columns`].
pub(super) fn cells(header: &RunHeader, sample: Option<&ContactSample>) -> Vec<Cell> {
    let none = ContactSample::default();
    let sample = sample.unwrap_or(&none);
    let mut sums = vec![
        sample.impact_lost,
        sample.friction_lost,
        sample.obstacle_work,
    ];
    if header.has_barrier() {
        sums.extend([sample.closing_lost, sample.barrier]);
    }
    sums.into_iter().map(Cell::Real).collect()
}

impl RunHeader {
    /// An event of a contact of a rod, in the units of the scene.
    pub(super) fn rod_event(&self, event: &RodContactEvent) -> Value {
        let axes = if self.in_space() { 3 } else { 2 };
        let vector = |v: &Vector3<f64>| json!(v.as_slice()[..axes]);
        let [a, b] = self.rod_sides(&event.at);
        let mut told = json!({
            "kind": event.key(), "t": event.t, "a": a, "b": b,
            "s": event.at.s,
            "place": vector(&event.at.point),
            "normal": vector(&event.at.normal),
            "normal_force": event.at.normal_force,
        });
        if let Some(s) = event.at.partner.s() {
            told["s_other"] = json!(s);
        }
        told
    }

    /// An event of a contact of a body, in the units of the scene.
    pub(super) fn contact_event(&self, event: &ContactEvent) -> Map<String, Value> {
        let axes = if self.in_space() { 3 } else { 2 };
        let vector = |v: &Vector3<f64>| json!(v.as_slice()[..axes]);
        let [a, b] = self.sides(event.contact());
        let mut told = object(json!({
            "kind": event.key(), "t": event.time(), "a": a, "b": b,
        }));
        told.extend(object(match event {
            ContactEvent::Impact(at) => json!({
                "place": vector(&at.point),
                "normal": vector(&at.normal),
                "before": vector(&at.before),
                "after": vector(&at.after),
                "impulse": vector(&at.impulse),
                "lost": at.lost,
                "law": at.rule.key(),
                "sticks": at.sticks,
            }),
            ContactEvent::Accumulation(at)
            | ContactEvent::Slip(at)
            | ContactEvent::Stick(at)
            | ContactEvent::Reverse(at)
            | ContactEvent::Release(at) => json!({
                "place": vector(&at.point),
                "slip": vector(&at.slip),
                "normal_force": at.normal_force,
                "friction": vector(&at.friction),
            }),
        }));
        told
    }
}

impl RunRecord {
    /// The events of the contacts of a branch, each with its time.
    pub(super) fn contact_events(&self, branch: &RunBranch) -> Vec<(f64, Value)> {
        let events = branch.contacts.iter().flat_map(|all| &all.events);
        let rods = branch.contacts.iter().flat_map(|all| &all.rod_events);
        events
            .map(|event| {
                (
                    event.time(),
                    Value::Object(self.header.contact_event(event)),
                )
            })
            .chain(rods.map(|event| (event.t, self.header.rod_event(event))))
            .collect()
    }

    /// The entry `contact` of the summary; `None` without contact.
    pub(super) fn contact_summary(&self) -> Option<Value> {
        if !self.header.has_contact {
            return None;
        }
        let last = self.last();
        let all = || self.branches.iter().filter_map(|b| b.contacts.as_ref());
        let events = || all().flat_map(|contacts| &contacts.events);
        let mut counts: Map<String, Value> = Map::new();
        let mut impulse = 0.0;
        for event in events() {
            let count = counts.entry(event.key()).or_insert(json!(0));
            *count = json!(count.as_u64().unwrap_or(0) + 1);
            if let ContactEvent::Impact(at) = event {
                impulse += at.impulse.dot(&at.normal);
            }
        }
        let mut of_rods: Map<String, Value> = Map::new();
        for event in all().flat_map(|contacts| &contacts.rod_events) {
            let count = of_rods.entry(event.key()).or_insert(json!(0));
            *count = json!(count.as_u64().unwrap_or(0) + 1);
        }
        let least = all().fold(f64::INFINITY, |least, one| least.min(one.least_gap));
        let cones = all().filter_map(|one| one.max_cone);
        let sums = last.last.contact.clone().unwrap_or_default();
        let mut told = object(json!({
            "method": if self.header.has_barrier() { "barrier" } else { "exact" },
            "counts": counts,
            "rod_counts": of_rods,
            "normal_impulse": impulse,
            "impact_lost": sums.impact_lost,
            "friction_lost": sums.friction_lost,
            "obstacle_work": sums.obstacle_work,
            "min_gap": Some(least).filter(|gap| gap.is_finite()),
            "max_cone": cones.reduce(f64::max),
        }));
        if let Some(gap) = self.header.barrier_gap {
            told.extend(object(json!({
                "why": "rods with all of their mass touch obstacles and each other through a barrier",
                "gap": gap,
                "change_at_half_gap": self.change_at_half_gap,
                "closing_lost": sums.closing_lost,
                "barrier": sums.barrier,
            })));
        }
        Some(Value::Object(told))
    }
}
