//! State of a run of rods in elements at one moment.

use crate::contact::{
    ContactId, ContactNow, ContactSample, Partner, RodContactChange, RodContactEvent,
    RodContactNow, RodPartner, Rubbing, SLIPPING,
};
use crate::{Ledger, RodCurve, SectionState, State};
use nalgebra::{Isometry3, Vector6};
use snaprod_systems::assembly::BodyMotion;
use snaprod_systems::full_mass::elements::{
    BarrierContact, ElementAssembly, ElementMoment, Touched, Touching,
};
use snaprod_systems::full_mass::obstacles::Bearer;
use snaprod_systems::section::Strain;
use std::sync::Arc;

/// Fewest sections of a curve between its ends.
const FEWEST_SECTIONS: usize = 8;

/// State of a run of rods in elements at one moment. Quantities of one rod are those of the first rod.
#[derive(Debug, Clone)]
pub struct ElementSample {
    model: Arc<ElementAssembly>,
    at: ElementMoment,
    bodies: Vec<BodyMotion>,
    ledger: Ledger,
    friction: f64,
    numerical: f64,
    /// Contacts with obstacles; `None` without obstacles.
    contact: Option<ContactSample>,
}

/// Energies of a moment, with the integrals over time (time, friction, work, drag) of its state.
pub(super) fn ledger(
    model: &ElementAssembly,
    at: &ElementMoment,
    integrals: &[f64],
    numerical: f64,
) -> Ledger {
    let [kinetic, rod_kinetic, elastic, potential] = model.energies(at);
    let ([moved, lifted], before) = (model.riding(at.t), model.riding(0.0));
    Ledger {
        kinetic,
        rod_kinetic: rod_kinetic + moved,
        elastic,
        potential: potential + lifted,
        dissipated: integrals[1] + integrals[3] + integrals[4] + integrals[5] + numerical,
        work: integrals[2] + moved + lifted - before[0] - before[1],
    }
}

/// The contacts of a moment; `None` without obstacles.
fn contacts(
    model: &ElementAssembly,
    at: &ElementMoment,
    integrals: &[f64],
) -> Option<ContactSample> {
    let nearest = model.nearest_place(at, 1);
    if nearest.is_none() && !model.rods_meet() {
        return None;
    }
    let at_obstacles = nearest.map_or(f64::INFINITY, |nearest| nearest.gap);
    let mut sample = ContactSample {
        closing_lost: integrals[4],
        friction_lost: integrals[5],
        barrier: at.barrier(),
        least_gap: at_obstacles.min(model.least_gap_of_rods(at)),
        ..ContactSample::default()
    };
    for contact in model.barrier_contacts(at) {
        let BarrierContact {
            other,
            point,
            normal,
            reaction: normal_force,
            friction,
            slip,
            coefficient,
            ..
        } = contact;
        match contact.of {
            Touching::Rod {
                rod,
                stretch,
                centre,
            } => sample.rods.push(RodContactNow {
                rod,
                partner: match other {
                    Touched::Obstacle(obstacle) => RodPartner::Obstacle(obstacle),
                    Touched::Rod {
                        rod,
                        stretch,
                        centre,
                    } => RodPartner::Rod {
                        rod,
                        s: centre,
                        stretch,
                    },
                },
                s: centre,
                point,
                normal,
                normal_force,
                stretch,
                rubbing: Rubbing {
                    coefficient,
                    friction,
                    slip: Some(slip),
                },
            }),
            Touching::Body(on) => sample.contacts.push(ContactNow {
                contact: ContactId {
                    body: match on {
                        Bearer::Listed(body) => body,
                        Bearer::EndOf(_) => 0,
                    },
                    partner: match other {
                        Touched::Obstacle(obstacle) | Touched::Rod { rod: obstacle, .. } => {
                            Partner::Obstacle(obstacle)
                        }
                    },
                    place: 0,
                },
                point,
                normal,
                normal_force,
                friction,
                slip,
                coefficient,
                sticks: friction.norm() < coefficient * normal_force * (1.0 - SLIPPING),
            }),
        }
    }
    Some(sample)
}

impl ElementSample {
    /// The sample of a moment, after a numerical loss.
    pub(super) fn new(
        model: &Arc<ElementAssembly>,
        at: ElementMoment,
        integrals: &[f64],
        numerical: f64,
    ) -> Self {
        Self {
            bodies: model.motions(&at),
            ledger: ledger(model, &at, integrals, numerical),
            friction: integrals[1],
            numerical,
            contact: contacts(model, &at, integrals),
            model: model.clone(),
            at,
        }
    }

    /// Touches and releases of rods since the moment `before`: obstacles and rods that begin or cease to push a rod.
    pub(super) fn changed_contacts(&self, before: &Self) -> Vec<RodContactEvent> {
        let rods = |of: &Self| -> Vec<RodContactNow> {
            of.contact
                .iter()
                .flat_map(|contact| contact.rods.clone())
                .collect()
        };
        let [now, then] = [rods(self), rods(before)];
        let pair =
            |a: &RodContactNow, b: &RodContactNow| a.rod == b.rod && a.partner.is(&b.partner);
        let new = |at: &RodContactNow, others: &[RodContactNow], own: &[RodContactNow]| {
            let first = own.iter().find(|other| pair(other, at));
            first == Some(at) && !others.iter().any(|other| pair(other, at))
        };
        let event = |at: &RodContactNow, change| RodContactEvent {
            t: self.at.t,
            change,
            at: *at,
        };
        let begun = now.iter().filter(|at| new(at, &then, &now));
        let begun = begun.map(|at| event(at, RodContactChange::Touch));
        let ended = then.iter().filter(|at| new(at, &now, &then));
        let ended = ended.map(|at| event(at, RodContactChange::Release));
        ended.chain(begun).collect()
    }

    /// The moment.
    pub(super) fn moment(&self) -> &ElementMoment {
        &self.at
    }

    fn curve(&self, k: usize, points: usize) -> RodCurve {
        let count = points.max(FEWEST_SECTIONS) + 1;
        let length = self.model.length(k);
        let section = |i: usize| {
            let s = i as f64 / count as f64;
            (s * length, self.model.section(&self.at, k, s))
        };
        (0..=count).map(section).collect()
    }

    fn end(&self) -> BodyMotion {
        let end = self.model.end(&self.at, 0);
        end.unwrap_or(BodyMotion::at_rest(Isometry3::identity()))
    }
}

impl State for ElementSample {
    fn time(&self) -> f64 {
        self.at.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.end().pose
    }

    fn twist(&self) -> Vector6<f64> {
        self.end().twist
    }

    fn action(&self) -> Vector6<f64> {
        self.model.action(&self.at)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    fn numerical_loss(&self) -> f64 {
        self.numerical
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.contact.as_ref()
    }

    fn bodies(&self) -> &[BodyMotion] {
        &self.bodies
    }

    fn curves(&self, points: usize) -> Vec<RodCurve> {
        let rods = 0..self.model.rods();
        rods.map(|k| self.curve(k, points)).collect()
    }

    fn groove_forces(&self) -> Vec<Option<nalgebra::Vector3<f64>>> {
        vec![None; self.bodies.len()]
    }

    fn strains_of(&self, rod: usize, places: &[f64]) -> Vec<Strain> {
        self.model.strains(&self.at, rod, places)
    }

    fn moving_sections(&self, rod: usize, places: &[f64]) -> Vec<SectionState> {
        let (model, at) = (&self.model, &self.at);
        let Some(resultants) = model.resultants(at, rod, places) else {
            return Vec::new();
        };
        let strains = model.strains(at, rod, places);
        let each = places.iter().zip(strains).zip(resultants);
        each.map(|((s, strain), resultants)| {
            let motion = model.motion_at(at, rod, *s);
            SectionState {
                pose: motion.pose,
                twist: motion.twist,
                strain,
                resultants,
            }
        })
        .collect()
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        self.model.dissipation(&self.at, 0, places)
    }

    fn sections(&self, points: usize) -> RodCurve {
        self.curve(0, points)
    }
}
