//! An assembly as data: bodies, rods, names, and the counts of unknowns.

use super::attachment::Attachment;
use super::body::{Body, BodyMotion};
use super::free_end::FreeRod;
use super::guide::Guide;
use super::rod_element::{LightRod, Link, RodChart};
use crate::body::Support;
use crate::error::{Error, Result};
use crate::rod::SectionMass;
use nalgebra::Vector3;
use std::sync::Arc;

/// Bodies and the rods between them.
#[derive(Debug, Clone)]
pub struct Assembly {
    pub(super) carriers: Vec<Body>,
    pub(super) links: Vec<Link>,
    pub(super) free: Vec<FreeRod>,
    /// Names of the rods for messages: one each, or empty.
    names: Vec<String>,
}

impl Assembly {
    /// An assembly of bodies and rods, both numbered by their position in the lists.
    ///
    /// # Errors
    /// No body; a rod that ends on a body that is not in the list, on the body that it begins on, or on a point mass
    /// that it is welded to; a body that no rod reaches.
    pub fn new(carriers: Vec<Body>, links: Vec<Link>) -> Result<Self> {
        if links.is_empty() {
            return Err(Error::domain("an assembly has one rod at least"));
        }
        Self::with_free_bodies(carriers, links, 0)
    }

    /// An assembly of bodies and rods, of which no rod reaches the last `free` bodies that are no nodes of joints.
    /// These move freely.
    ///
    /// # Errors
    /// As [`Assembly::new`], but for missing rods.
    pub fn with_free_bodies(carriers: Vec<Body>, links: Vec<Link>, free: usize) -> Result<Self> {
        for (node, carrier) in carriers.iter().enumerate() {
            let Some(parent) = carrier.joint().and_then(Guide::parent) else {
                continue;
            };
            let aside = carrier
                .joint()
                .is_some_and(|joint| joint.on().place.translation.vector != Vector3::zeros());
            let holds = |body: &Body| {
                (body.turns() || !aside) && body.groove().is_none() && body.joint().is_none()
            };
            if !(parent < node && carriers.get(parent).is_some_and(holds)) {
                return Err(Error::domain(format!(
                    "a joint sits on body {parent}: only a body with an inertia, outside of grooves, can carry one"
                )));
            }
        }
        let reached = |body: usize| {
            let on = |site: &Attachment| site.carried_by() == Some(body);
            links.iter().any(|link| on(&link.from) || on(&link.to))
                || carriers
                    .iter()
                    .any(|node| node.joint().is_some_and(|joint| on(joint.on())))
        };
        let solids = carriers.iter().take_while(|body| body.joint().is_none());
        let flying = solids.count().saturating_sub(free)..;
        let flies = |body: usize| free > 0 && flying.contains(&body);
        if let Some(body) = (0..carriers.len()).find(|body| !reached(*body) && !flies(*body)) {
            return Err(Error::domain(format!("no rod reaches body {body}")));
        }
        Self::of_heavy_rods(carriers, links)
    }

    /// The assembly of the bodies and of the rods with held ends of one whose rods have all of their mass: a rod with a
    /// free end may be the only one that reaches a body, and there may be no body.
    ///
    /// # Errors
    /// As [`Assembly::new`], but for missing and unreached bodies.
    pub fn of_heavy_rods(carriers: Vec<Body>, links: Vec<Link>) -> Result<Self> {
        for (k, link) in links.iter().enumerate() {
            for (site, joint) in [&link.from, &link.to].into_iter().zip(link.joints()) {
                let Some(body) = site.carried_by() else {
                    continue;
                };
                let carrier = carriers.get(body).ok_or_else(|| {
                    Error::domain(format!(
                        "rod {k} is attached to body {body}; there are {}",
                        carriers.len()
                    ))
                })?;
                let aside = site.place.translation.vector.norm() != 0.0;
                if !carrier.turns() && (!joint.turns() || aside) {
                    return Err(Error::domain(format!(
                        "rod {k} is attached to the point mass {body}: only an end on a ball joint at the point itself can be; \
                         give the body an inertia, or use a ball joint"
                    )));
                }
            }
            if let Some(body) = link.from.carried_by()
                && link.to.carried_by() == Some(body)
            {
                return Err(Error::domain(format!(
                    "rod {k} begins and ends on body {body}"
                )));
            }
        }
        Ok(Self {
            carriers,
            links,
            free: Vec::new(),
            names: Vec::new(),
        })
    }

    /// Names the rods, in order, for messages; by default messages use their numbers.
    #[must_use]
    pub fn with_names(mut self, rods: Vec<String>) -> Self {
        self.names = rods;
        self
    }

    /// Name of a rod, if the rods have names.
    pub fn name_of_rod(&self, rod: usize) -> Option<&str> {
        self.names.get(rod).map(String::as_str)
    }

    /// Label of a rod in messages.
    pub fn rod_name(&self, rod: usize) -> String {
        match (self.names.get(rod), self.links.len()) {
            (Some(name), _) => format!("rod {name:?}"),
            (None, 1) => "the rod".to_owned(),
            (None, _) => format!("rod {rod}"),
        }
    }

    /// The bodies.
    pub fn carriers(&self) -> &[Body] {
        &self.carriers
    }

    /// The bodies without the nodes of joints, which come last.
    pub fn solids(&self) -> &[Body] {
        let joints = self.carriers.iter().rev();
        let joints = joints.take_while(|carrier| carrier.joint().is_some());
        &self.carriers[..self.carriers.len() - joints.count()]
    }

    /// The rods.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// A copy for observers of a motion. Their solutions of taut rods do not become the start of the motion's next
    /// search, which would move the motion within its tolerance.
    #[must_use]
    pub fn observer_copy(self: &Arc<Self>) -> Arc<Self> {
        if self
            .links
            .iter()
            .any(|link| link.last_taut.last().is_some())
        {
            Arc::new(Self::clone(self))
        } else {
            self.clone()
        }
    }

    /// Sets the chart of rod `k` ([`Link::set_chart`]).
    pub fn set_chart(&mut self, k: usize, chart: RodChart) {
        self.links[k].set_chart(chart);
    }

    /// First time after `t` at which a load or the motion of a support is not smooth; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let bodies = self.carriers.iter().map(|carrier| carrier.next_break(t));
        let supports = self.links.iter().map(|link| link.next_break(t));
        bodies.chain(supports).fold(f64::INFINITY, f64::min)
    }

    /// True if a load without a potential, a moving support or a section law in time can do work.
    pub fn is_driven(&self) -> bool {
        let ends = self.links.iter().flat_map(|link| [&link.from, &link.to]);
        self.carriers.iter().any(|body| body.mass().is_driven())
            || self.links.iter().any(Link::varies_in_time)
            || ends.into_iter().any(Attachment::moves)
            || self.has_joints()
    }

    /// True if drag, or a joint, dissipates energy.
    pub fn is_damped(&self) -> bool {
        self.has_joints() || self.carriers.iter().any(|body| body.mass().is_damped())
    }

    /// True if the loads at time `t`, held as they are then, have a potential.
    pub fn is_conservative(&self, t: f64) -> bool {
        !self.has_turning() && self.carriers.iter().all(|body| body.is_conservative(t))
    }

    /// The assembly at rest under the loads of time `t`, with a share of those without a potential.
    ///
    /// # Errors
    /// A share that is not finite.
    pub fn with_share_of_driving(&self, t: f64, share: f64) -> Result<Self> {
        let mut shared = self.clone();
        let carriers = self.carriers.iter().cloned();
        let carriers = carriers.map(|carrier| carrier.with_share_of_driving(t, share));
        shared.carriers = carriers.collect::<Result<_>>()?;
        Ok(shared)
    }

    /// Poses of bodies and joints as near to the given ones as planes, grooves and joints allow.
    pub(crate) fn confined(&self, bodies: &mut [BodyMotion]) {
        for (node, carrier) in self.carriers.iter().enumerate() {
            let pose = bodies[node].pose;
            let joint = carrier.joint().filter(|joint| !joint.is_ball());
            bodies[node].pose = match joint {
                None if carrier.joint().is_some() => pose,
                None => carrier.confined(pose),
                Some(joint) => {
                    let frame = joint.frame(0.0, bodies);
                    joint.pose(&frame, &joint.coordinates(&frame, &pose))
                }
            };
        }
    }

    /// True if a load at time `t` turns with a body or with a rod.
    pub fn is_followed(&self, t: f64) -> bool {
        self.has_turning() || self.carriers.iter().any(|body| body.is_followed(t))
    }

    /// True if loads along rods have no potential: equilibria then have no index, not even with these loads kept dead.
    pub fn has_turning(&self) -> bool {
        self.links.iter().any(Link::has_turning)
    }

    /// Index of the first velocity of each body in the vector of all velocities, and the total count.
    pub fn freedoms(&self) -> (Vec<usize>, usize) {
        let mut total = 0;
        let starts = self.carriers.iter().map(|carrier| {
            total += carrier.freedoms();
            total - carrier.freedoms()
        });
        (starts.collect(), total)
    }

    /// Indices of the velocities of bodies that have a mass; nodes have none.
    pub fn massive(&self) -> Vec<usize> {
        let (starts, _) = self.freedoms();
        let all = starts.iter().zip(self.carriers());
        all.filter(|(_, carrier)| !carrier.is_massless())
            .flat_map(|(start, carrier)| *start..start + carrier.freedoms())
            .collect()
    }

    /// Bodies at rest, displaced from `places` by their own velocities. A joint moves with the body that carries it.
    pub(super) fn displaced(&self, places: &[BodyMotion], own: &[f64]) -> Vec<BodyMotion> {
        let mut moved: Vec<BodyMotion> = Vec::with_capacity(places.len());
        let mut start = 0;
        for (carrier, place) in self.carriers.iter().zip(places) {
            let own = &own[start..start + carrier.freedoms()];
            start += carrier.freedoms();
            let pose = match carrier.guide() {
                None => carrier.moved(&place.pose, own),
                Some(guide) => {
                    let from = guide.frame(0.0, places);
                    guide.moved((&from, &place.pose), &guide.frame(0.0, &moved), own)
                }
            };
            moved.push(BodyMotion::at_rest(pose));
        }
        moved
    }

    /// Number of unknowns of statics: one per velocity of the bodies, and six chart components per rod.
    pub(super) fn unknowns(&self) -> usize {
        let bodies: usize = self.carriers.iter().map(Body::freedoms).sum();
        bodies + 6 * self.links.len()
    }

    /// Unknowns of statics that vanish in a planar assembly.
    pub fn out_of_plane(&self) -> Vec<usize> {
        let bodies: usize = self.carriers.iter().map(Body::freedoms).sum();
        let links = self.links.iter().enumerate();
        links
            .flat_map(|(k, link)| link.out_of_plane().map(move |i| bodies + 6 * k + i))
            .collect()
    }

    /// Mean length of the rods, and largest of their couple units B/L.
    pub(super) fn scales(&self) -> (f64, f64) {
        let links = self.links().iter();
        let length: f64 = links.clone().map(|link| link.rod().length()).sum();
        let couple = links.map(|link| link.units()[0]).fold(0.0, f64::max);
        (length / self.links().len() as f64, couple)
    }

    /// Indices of the rotational velocities among those of all bodies.
    pub(super) fn rotations(&self) -> Vec<usize> {
        let (starts, _) = self.freedoms();
        let all = starts.iter().zip(self.carriers());
        all.flat_map(|(start, carrier)| *start..start + carrier.turnings())
            .collect()
    }

    /// The assembly with rods that have a free end ([`Assembly::shapes`] returns them after the others).
    ///
    /// # Errors
    /// A rod on a body that is not in the list, or on a point mass, about which it could turn freely.
    pub fn with_free(mut self, free: Vec<FreeRod>) -> Result<Self> {
        for (k, rod) in free.iter().enumerate() {
            let Some(body) = rod.from.carried_by() else {
                continue;
            };
            let carrier = self.carriers.get(body).ok_or_else(|| {
                Error::domain(format!(
                    "free rod {k} is attached to body {body}; there are {}",
                    self.carriers.len()
                ))
            })?;
            if !carrier.turns() {
                return Err(Error::domain(format!(
                    "free rod {k} is attached to the point mass {body}, about which it could turn as it likes; give the body an inertia"
                )));
            }
        }
        self.free = free;
        Ok(self)
    }

    /// The rods that have a free end.
    pub fn free(&self) -> &[FreeRod] {
        &self.free
    }

    /// True if some rod has a contact diameter.
    pub fn looks_for_contacts(&self) -> bool {
        self.links.iter().any(|link| link.diameter().is_some())
    }

    /// Gives rods a mass that is treated to first order, one entry for each rod.
    ///
    /// # Errors
    /// A mass or inertia that is not finite and positive; a rod under loads without a potential; a rod under a load
    /// along it, or between two ball joints, that is seen from a clamp that turns.
    pub fn with_light_rods(mut self, light: Vec<Option<LightRod>>) -> Result<Self> {
        let clamp_turns = self.clamp().is_some_and(Support::turns);
        for (k, light) in light.iter().enumerate() {
            let Some(light) = light else { continue };
            let name = self.rod_name(k);
            let refuse = |why: &str| {
                Err(Error::domain(format!(
                    "the mass of {name} is not followed to first order: {why}; write inertia = \"none\""
                )))
            };
            let SectionMass { mass, rotary } = &light.sections;
            let Some(link) = self.links.get(k) else {
                return refuse("there is no such rod");
            };
            if !(*mass > 0.0 && mass.is_finite() && rotary.iter().all(|j| *j >= 0.0)) {
                return refuse("its mass must be > 0, the inertia of its sections >= 0");
            }
            if link.has_turning() {
                return refuse("it bears loads that turn with it, or couples along it");
            }
            let turns = link.distributed().is_some() || link.is_pinned();
            if clamp_turns && turns {
                return refuse(
                    "it bears a load along it, or spins between two ball joints, and the clamp from which it is seen turns (attach it to a support)",
                );
            }
        }
        for (link, light) in self.links.iter_mut().zip(light) {
            link.mass = light;
            link.clamp_turns = clamp_turns;
        }
        Ok(self)
    }

    /// Rods whose mass is treated to first order, by number.
    pub fn light_rods(&self) -> impl Iterator<Item = (usize, &LightRod)> {
        let all = self.links.iter().enumerate();
        all.filter_map(|(k, link)| Some((k, link.mass()?)))
    }

    /// True if the motion includes the inertia of a rod now.
    pub fn feels_rods(&self) -> bool {
        self.links.iter().any(Link::is_followed)
    }

    /// Switches the inertia of rod `k` on or off.
    pub fn set_inertia(&mut self, k: usize, followed: bool) {
        if let Some(mass) = self.links.get_mut(k).and_then(|link| link.mass.as_mut()) {
            mass.followed = followed;
        }
    }

    /// Clamp from which the bodies are seen, if any.
    pub(super) fn clamp(&self) -> Option<&Support<3>> {
        let mut bodies = self.carriers.iter();
        bodies.find_map(|body| body.mass().support())
    }
}
