//! Treatment of the small mass of elastic rods: first-order inertia where possible, none elsewhere.

use super::{AssemblyRod, AssemblyScene, Inertia, Method, Rod, Scales, Scene, SceneKind, Site};
use crate::error::{Error, Quantity, Result};
use serde_json::{Value, json};

/// Mass ratio rod / body from which a rod counts as heavy: first-order inertia is then not the default.
const LIGHT_MASS_RATIO: f64 = 0.1;

/// Treatment of the mass of an elastic rod whose mass is known, for messages and the record.
#[derive(Debug, Clone, PartialEq)]
pub struct RodMassNote {
    /// Name of the rod in an assembly.
    pub rod: Option<String>,
    /// Mass of the rod over the mass of the lightest body attached to it.
    pub eps: f64,
    /// Treatment of the mass.
    pub inertia: Inertia,
    /// True if the scene does not state the treatment.
    pub by_default: bool,
    /// Reason against first-order inertia, other than a large mass ratio; `None`: no such reason.
    pub why: Option<&'static str>,
}

impl RodMassNote {
    /// The note in one sentence; `None` if the scene itself asks to leave the mass out.
    pub fn text(&self) -> Option<String> {
        let rod = match &self.rod {
            Some(name) => format!("the mass of rod {name:?}"),
            None => "the mass of the rod".to_owned(),
        };
        let eps = format!("{:.2e} of the body's", self.eps);
        Some(match (self.inertia, self.by_default, self.why) {
            (Inertia::FirstOrder, true, _) => {
                format!(
                    "{rod}, {eps}, is followed to first order (set inertia = \"none\" to ignore it)"
                )
            }
            (Inertia::FirstOrder, false, _) => format!("{rod}, {eps}, is followed to first order"),
            (Inertia::None, true, Some(why)) => format!("{rod}, {eps}, is ignored: {why}"),
            (Inertia::None, true, None) => format!(
                "{rod}, {eps}, is ignored, although it is not small: set inertia = \"full\" to include it, or \"first-order\" to approximate it"
            ),
            _ => return None,
        })
    }

    /// The note as JSON.
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

/// Reason why contacts exclude first-order inertia.
const LOOKED_FOR: &str = "obstacles are looked for";

/// Reason why loads without a potential exclude first-order inertia.
const TURNED: &str = "a couple, or a load that turns with the rod, acts along it";

/// Reason why time steps of this method exclude first-order inertia in space.
fn method_excludes_first_order(method: Method) -> Option<&'static str> {
    (method == Method::Symmetric).then_some("symmetric steps do not follow it (run.method)")
}

impl Rod {
    /// Mass of the rod over the unit of mass, which is that of the first body; at rest it is the rod's own. `None` if
    /// the mass is unknown.
    pub(crate) fn mass_over_unit(&self, scales: &Scales) -> Option<f64> {
        Some(scales.inward(Quantity::Mass, self.mass()?))
    }

    /// Mass of the rod over the unit of mass.
    ///
    /// # Errors
    /// An unknown mass.
    pub(super) fn known_mass_over_unit(&self, scales: &Scales) -> Result<f64> {
        self.mass_over_unit(scales).ok_or_else(|| {
            Error::domain("rod.mass is missing: give it, or a material with a density and a shape")
        })
    }
}

impl Scene {
    /// True for a planar rod that bears no load along it but its weight: first-order inertia includes the weight in
    /// closed form. Under another load a planar rod runs in space.
    pub(super) fn stays_in_plane(&self) -> bool {
        self.is_planar() && self.loads.distributed.is_zero() && self.rod.loads.is_empty()
    }

    /// Reason why the mass of the rod cannot be followed to first order; `None` if possible.
    pub(super) fn not_first_order(&self) -> Option<&'static str> {
        let run = self.run.as_ref()?;
        if self.has_contact() {
            return Some(LOOKED_FOR);
        }
        if self.rod.has_turning_loads() {
            return Some(TURNED);
        }
        // Only runs in space exclude a method.
        if self.stays_in_plane() {
            None
        } else {
            method_excludes_first_order(run.method)
        }
    }

    /// Reason why the mass of rod k of an assembly cannot be followed to first order; `None` if possible.
    pub(super) fn not_first_order_in_assembly(&self, k: usize) -> Option<&'static str> {
        let rod = self.assembly().and_then(|given| given.rods.get(k));
        let axes = "a joint at an end of it has axes";
        let node = "it ends on a node without mass";
        if self.has_contact() {
            return Some(LOOKED_FOR);
        }
        if rod.is_some_and(|rod| rod.rod.has_turning_loads()) {
            return Some(TURNED);
        }
        method_excludes_first_order(self.run.as_ref()?.method)
            .or(rod.is_some_and(AssemblyRod::has_joint_axes).then_some(axes))
            .or(self.ends_on_node(k).then_some(node))
    }

    /// True if rod k of an assembly ends on a node without mass.
    fn ends_on_node(&self, k: usize) -> bool {
        let Some((given, rod)) = self
            .assembly()
            .and_then(|given| Some((given, given.rods.get(k)?)))
        else {
            return false;
        };
        let holders = [&rod.from, &rod.to].map(|site| given.holder(site));
        let mut bodies = holders.iter().flatten();
        bodies.any(|body| given.bodies[*body].is_massless())
    }

    /// Chooses first-order inertia for light rods if the scene leaves their inertia open and the run allows it.
    pub(super) fn choose_inertia(&mut self) {
        let light = |note: &RodMassNote| {
            note.by_default && note.why.is_none() && note.eps < LIGHT_MASS_RATIO
        };
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
        match &mut self.kind {
            SceneKind::Rod
            | SceneKind::Bar(_)
            | SceneKind::Flow(_)
            | SceneKind::Inflation(_)
            | SceneKind::Wall(_) => choose(&mut self.rod, rods.contains(&0)),
            SceneKind::Assembly(given) => {
                for (k, rod) in given.rods.iter_mut().enumerate() {
                    choose(&mut rod.rod, rods.contains(&k));
                }
            }
        }
    }

    /// Treatment of the mass of every elastic rod whose mass is known.
    pub fn mass_notes(&self) -> Vec<RodMassNote> {
        self.rod_masses().map(|(_, note)| note).collect()
    }

    /// Rod k of the rods held at both ends.
    pub(crate) fn rod_of(&self, k: usize) -> &Rod {
        match self.assembly() {
            Some(given) => &given.rods[k].rod,
            None => &self.rod,
        }
    }

    /// Mass of rod k over the mass of the lightest body attached to it; `None` if the mass is unknown or no body is
    /// attached.
    pub(crate) fn mass_over_lightest_body(&self, k: usize) -> Option<f64> {
        let body = match self.assembly() {
            Some(given) => lightest(given, [&given.rods[k].from, &given.rods[k].to])?,
            None => self.body.as_ref()?.mass,
        };
        Some(self.rod_of(k).mass()? / body)
    }

    fn rod_masses(&self) -> impl Iterator<Item = (usize, RodMassNote)> {
        let count = match (&self.run, self.assembly()) {
            (None, _) => 0,
            (_, None) => 1,
            (_, Some(given)) => given.rods.len(),
        };
        (0..count).filter_map(|k| {
            let rod = self.rod_of(k);
            let (name, why) = match self.assembly() {
                None => (None, self.not_first_order()),
                Some(given) => (
                    Some(given.rods[k].name.clone()),
                    self.not_first_order_in_assembly(k),
                ),
            };
            if rod.damping.is_some() || rod.is_heavy() {
                return None;
            }
            let why = why.or(rod
                .field_in_time()
                .map(|_| "its section law varies in time"));
            let note = RodMassNote {
                rod: name,
                eps: self.mass_over_lightest_body(k)?,
                inertia: rod.inertia.unwrap_or(Inertia::None),
                by_default: rod.inertia.is_none() || rod.inertia_chosen,
                why,
            };
            Some((k, note))
        })
    }
}

/// Mass of the lightest body at these attachments.
fn lightest(given: &AssemblyScene, sites: [&Site; 2]) -> Option<f64> {
    let masses = sites.iter().filter_map(|site| given.holder(site));
    let masses = masses.map(|body| given.bodies[body].mass);
    masses.min_by(f64::total_cmp)
}
