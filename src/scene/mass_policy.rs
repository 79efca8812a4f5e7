//! What is done with the small mass of elastic rods: followed to first order where that can be, left out elsewhere.

use super::{AssemblyScene, Inertia, Method, Rod, Scene, Site};
use serde_json::{Value, json};

/// Rods of at least this part of the mass of a body are not light: their mass is not followed to first order unless that is asked for.
const LIGHT: f64 = 0.1;

/// What a motion does with the mass of an elastic rod whose mass is known.
#[derive(Debug, Clone, PartialEq)]
pub struct RodMassNote {
    /// The rod's name in an assembly.
    pub rod: Option<String>,
    /// Its mass over that of the lightest body that it holds.
    pub eps: f64,
    /// What its mass does.
    pub inertia: Inertia,
    /// True if the scene does not say it.
    pub by_default: bool,
    /// Why its mass is not followed to first order, if that is not for its size.
    pub why: Option<&'static str>,
}

impl RodMassNote {
    /// In one sentence; None where a mass is left out because the scene says so.
    pub fn text(&self) -> Option<String> {
        let rod = match &self.rod {
            Some(name) => format!("the mass of rod {name:?}"),
            None => "the mass of the rod".to_owned(),
        };
        let eps = format!("{:.2e} of the body's", self.eps);
        Some(match (self.inertia, self.by_default, self.why) {
            (Inertia::FirstOrder, true, _) => {
                format!(
                    "{rod}, {eps}, is followed to first order (inertia = \"none\" leaves it out)"
                )
            }
            (Inertia::FirstOrder, false, _) => format!("{rod}, {eps}, is followed to first order"),
            (Inertia::None, true, Some(why)) => format!("{rod}, {eps}, is left out: {why}"),
            (Inertia::None, true, None) => format!(
                "{rod}, {eps}, is left out: it is not small (inertia = \"full\" has all of it, \"first-order\" what is of its first order)"
            ),
            _ => return None,
        })
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "rod": self.rod,
            "eps": self.eps,
            "inertia": self.inertia,
            "by_default": self.by_default,
            "why": self.why,
        })
    }
}

/// Why steps of this kind do not follow it, in space.
fn by_steps(method: Method) -> Option<&'static str> {
    (method == Method::Symmetric).then_some("symmetric steps do not follow it (run.method)")
}

impl Scene {
    /// Why the mass of the rod cannot be followed to first order; None where it can.
    pub(super) fn not_first_order(&self) -> Option<&'static str> {
        let run = self.run.as_ref()?;
        // In space steps may be implicit; so they are of a planar rod under a load along it, which runs as one in space.
        let closed = self.is_planar() && self.loads.distributed.is_zero();
        if closed { None } else { by_steps(run.method) }
    }

    /// The same of the rods of an assembly.
    pub(super) fn not_first_order_in_assembly(&self) -> Option<&'static str> {
        by_steps(self.run.as_ref()?.method)
    }

    /// Follows the mass of light rods to first order where the scene does not say what it does and where that can be.
    pub(super) fn choose_inertia(&mut self) {
        let light = |note: &RodMassNote| note.by_default && note.why.is_none() && note.eps < LIGHT;
        let rods: Vec<usize> = self
            .rod_masses()
            .filter(|(_, note)| light(note))
            .map(|(k, _)| k)
            .collect();
        let choose = |rod: &mut Rod, chosen: bool| {
            if chosen {
                (rod.inertia, rod.inertia_chosen) = (Some(Inertia::FirstOrder), true);
            }
        };
        match &mut self.assembly {
            None => choose(&mut self.rod, rods.contains(&0)),
            Some(given) => {
                for (k, rod) in given.rods.iter_mut().enumerate() {
                    choose(&mut rod.rod, rods.contains(&k));
                }
            }
        }
    }

    /// What a motion does with the mass of every elastic rod whose mass is known.
    pub fn mass_notes(&self) -> Vec<RodMassNote> {
        self.rod_masses().map(|(_, note)| note).collect()
    }

    /// The rod of this number among those that are held at both ends.
    pub(crate) fn rod_of(&self, k: usize) -> &Rod {
        match &self.assembly {
            Some(given) => &given.rods[k].rod,
            None => &self.rod,
        }
    }

    /// Its mass over that of the lightest body that it holds; None where its mass is not known, or it holds none.
    pub(crate) fn mass_ratio(&self, k: usize) -> Option<f64> {
        let body = match &self.assembly {
            Some(given) => lightest(given, [&given.rods[k].from, &given.rods[k].to])?,
            None => self.body.as_ref()?.mass,
        };
        Some(self.rod_of(k).mass()? / body)
    }

    fn rod_masses(&self) -> impl Iterator<Item = (usize, RodMassNote)> {
        let count = match (&self.run, &self.assembly) {
            (None, _) => 0,
            (_, None) => 1,
            (_, Some(given)) => given.rods.len(),
        };
        (0..count).filter_map(|k| {
            let rod = self.rod_of(k);
            let (name, why) = match &self.assembly {
                None => (None, self.not_first_order()),
                Some(given) => (
                    Some(given.rods[k].name.clone()),
                    self.not_first_order_in_assembly(),
                ),
            };
            if rod.damping.is_some() || rod.is_heavy() {
                return None;
            }
            let note = RodMassNote {
                rod: name,
                eps: self.mass_ratio(k)?,
                inertia: rod.inertia.unwrap_or(Inertia::None),
                by_default: rod.inertia.is_none() || rod.inertia_chosen,
                why,
            };
            Some((k, note))
        })
    }
}

/// The mass of the lightest body at these places.
fn lightest(given: &AssemblyScene, sites: [&Site; 2]) -> Option<f64> {
    let masses = sites.iter().filter_map(|site| given.holder(site));
    let masses = masses.map(|body| given.bodies[body].mass);
    masses.min_by(f64::total_cmp)
}
