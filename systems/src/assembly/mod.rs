//! Assemblies: rigid bodies and point masses joined by elastic rods (theory 3.3, 3.4).
//!
//! A rod without inertia sits between two attachments: the ground, a support that moves, or the frame of a body. Its
//! chart is the base wrench q = (m(0), n) on the equilibrium manifold, in the directors of its base. The end of the
//! rod moves by the twist of one attachment relative to the other. The bodies are free but for the wrenches of their
//! rods.
//!
//! * [`Assembly`]: bodies, rods, attachments; [`HeavyBody`] a body; [`Link`] a rod with its attachments; [`FreeRod`]
//!   one with a free end.
//! * [`Configuration`]: poses and charts; [`Assembly::balance`], [`Assembly::stiffness`] and the Morse index of the
//!   assembly.
//! * [`Assembly::equilibrium`], [`Assembly::modes`], [`AssemblyFamily`]: statics, small vibrations, branches.

mod axial_slider;
mod ball_ball_rod;
mod body;
mod branch;
mod branch_point_ahead;
mod chord_spin;
mod contact;
mod distributed_load;
mod equations;
mod first_order_mass;
mod fold;
mod fold_ahead;
mod free_end;
mod frequency_shift;
mod homotopy;
mod implicit;
mod inextensible_pull;
mod landing;
mod modes;
mod reach;
mod rod_element;
mod state;
mod statics;
mod stiffness;
mod taut;
mod viscous_layer;

pub use axial_slider::EndSlider;
pub use body::{BodyMotion, HeavyBody, Mass};
pub use branch::{AssemblyFamily, AssemblyState};
pub use branch_point_ahead::NeutralApproach;
pub use chord_spin::Spin;
pub use contact::{Contact, Nearness, Tube};
pub use first_order_mass::{LightRod, RodMomentum};
pub use fold::{AssemblyFold, Motion};
pub use free_end::FreeRod;
pub use frequency_shift::HeldFold;
pub use implicit::Linearised;
pub use inextensible_pull::Tether;
pub use landing::Landing;
pub use modes::Modes;
pub use rod_element::{AttachedTo, Attachment, Joint, Link, LinkEnd, LinkPoint};
pub use state::{Configuration, Evaluated, Integrals, RodMonitor, SlowedTime};
pub use statics::{AssemblyEquilibrium, AssemblyRoute};
pub use stiffness::Stiffness;
pub use taut::ChartKind;

use crate::error::{Error, Result};
use std::sync::Arc;

/// Bodies and the rods between them.
#[derive(Debug, Clone)]
pub struct Assembly {
    carriers: Vec<HeavyBody>,
    links: Vec<Link>,
    free: Vec<FreeRod>,
    /// Mass properties by rod number; empty if no rod has mass.
    light: Vec<Option<LightRod>>,
    /// Names of the rods for messages: one each, or empty.
    names: Vec<String>,
}

impl Assembly {
    /// An assembly of bodies and rods, both numbered by their position in the lists.
    ///
    /// # Errors
    /// No body; a rod that ends on a body that is not in the list, on the body that it begins on, or on a point mass
    /// that it is welded to; a body that no rod reaches.
    pub fn new(carriers: Vec<HeavyBody>, links: Vec<Link>) -> Result<Self> {
        if carriers.is_empty() {
            return Err(Error::domain("an assembly has one body at least"));
        }
        for (k, link) in links.iter().enumerate() {
            let base = match link.joint {
                Joint::Pins => Joint::Ball,
                _ => Joint::Weld,
            };
            for (site, joint) in [(&link.from, base), (&link.to, link.joint)] {
                let AttachedTo::Body(body) = site.on else {
                    continue;
                };
                let carrier = carriers.get(body).ok_or_else(|| {
                    Error::domain(format!(
                        "rod {k} is attached to body {body}; there are {}",
                        carriers.len()
                    ))
                })?;
                if !carrier.turns() && (joint == Joint::Weld || site.lever() != 0.0) {
                    return Err(Error::domain(format!(
                        "rod {k} is attached to the point mass {body}: only an end on a ball joint at the point itself can be; \
                         give the body an inertia, or use a ball joint"
                    )));
                }
            }
            if let (AttachedTo::Body(a), AttachedTo::Body(b)) = (&link.from.on, &link.to.on)
                && a == b
            {
                return Err(Error::domain(format!(
                    "rod {k} begins and ends on body {a}"
                )));
            }
        }
        let reached = |body: usize| {
            links.iter().any(|link| {
                [&link.from, &link.to]
                    .iter()
                    .any(|site| matches!(site.on, AttachedTo::Body(on) if on == body))
            })
        };
        if let Some(body) = (0..carriers.len()).find(|body| !reached(*body)) {
            return Err(Error::domain(format!("no rod reaches body {body}")));
        }
        Ok(Self {
            carriers,
            links,
            free: Vec::new(),
            light: Vec::new(),
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
    pub fn carriers(&self) -> &[HeavyBody] {
        &self.carriers
    }

    /// The rods.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// A copy for observers of a motion. Their solutions of taut rods do not become the start of the motion's next
    /// search, which would move the motion within its tolerance.
    #[must_use]
    pub fn observer_copy(self: &Arc<Self>) -> Arc<Self> {
        if self.links.iter().any(|link| link.warm.last().is_some()) {
            Arc::new(Self::clone(self))
        } else {
            self.clone()
        }
    }

    /// Sets the chart kind of rod `k` ([`Link::set_chart_kind`]).
    pub fn set_chart_kind(&mut self, k: usize, seen: ChartKind) {
        self.links[k].set_chart_kind(seen);
    }

    /// Sets the spring beside the end of rod `k` ([`Link::set_end_spring`]).
    pub fn brace(&mut self, k: usize, stiffness: f64) {
        self.links[k].set_end_spring(stiffness);
    }

    /// At the start of a motion: lets the ends of inextensible rods give way by less than the tolerance
    /// ([`Link::allow`]). True if one does so at once.
    pub fn allow(&mut self, tolerance: f64, at: &Evaluated) -> bool {
        for (link, point) in self.links.iter_mut().zip(&at.points) {
            link.allow(tolerance);
            link.set_slider(link.suited_slider(&point.end));
        }
        self.links.iter().any(|link| link.give().is_some())
    }

    /// Sets the slider between the end of rod `k` and its attachment ([`Link::set_slider`]).
    pub fn let_give(&mut self, k: usize, give: Option<EndSlider>) {
        self.links[k].set_slider(give);
    }

    /// First time after `t` at which a load or the motion of a support is not smooth; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let bodies = self.carriers.iter().map(|carrier| carrier.next_break(t));
        let supports = self.links.iter().map(|link| link.next_break(t));
        bodies.chain(supports).fold(f64::INFINITY, f64::min)
    }

    /// True if the loads at time `t`, held as they are then, have a potential.
    pub fn is_conservative(&self, t: f64) -> bool {
        self.carriers.iter().all(|body| body.is_conservative(t))
    }

    /// True if a load at time `t` turns with its body.
    pub fn is_followed(&self, t: f64) -> bool {
        self.carriers.iter().any(|body| body.is_followed(t))
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

    /// Number of unknowns of statics: one per velocity of the bodies, and six chart components per rod.
    pub(super) fn unknowns(&self) -> usize {
        let bodies: usize = self.carriers.iter().map(HeavyBody::freedoms).sum();
        bodies + 6 * self.links.len()
    }
}
