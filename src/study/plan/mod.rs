//! Plan of a study before its computation: model, chart, state, steps, parts left out with reasons, and a forecast of
//! the cost from a trial.

mod assembly;
mod bar;
mod flow;
mod forecast;
mod inflation;
mod rod;
mod statics;
mod trial;
mod wall;

pub use forecast::Forecast;
pub use trial::Trial;

use crate::error::Result;
use crate::motion::full_mass::IN_ELEMENTS;
use crate::motion::{Motion, StateVariables};
use crate::scene::{RodMassNote, Scene, Units};
use crate::solve::integrator::Method;
use serde_json::{Value, json};

/// A choice of the program with its reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    /// The choice.
    pub what: String,
    /// Why.
    pub why: String,
}

/// Plan of the treatment of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The model.
    pub model: Choice,
    /// Unknowns that determine the shapes of the rods.
    pub chart: Choice,
    /// State variables at the start, or unknowns of the equilibrium.
    pub state: Vec<StateVariables>,
    /// Time integrator, or solver of the equilibria.
    pub method: Choice,
    /// Parts that are not computed.
    pub left_out: Vec<Choice>,
    /// Effect of the mass of each elastic rod of known mass; the equivalent spring and dashpot of a rod, if any.
    pub notes: Vec<String>,
    /// A trial of a motion.
    pub trial: Option<Trial>,
    units: Units,
    duration: f64,
}

fn choice(what: impl Into<String>, why: impl Into<String>) -> Choice {
    Choice {
        what: what.into(),
        why: why.into(),
    }
}

/// Plan of a scene. The trial of a motion takes about `seconds` of processor time, at most four times as long; 0
/// skips it.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::plan;
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 1.0
///     bending_stiffness = 1.0
///     [body]
///     mass = 1.0
///     [start]
///     lambda = 6.3
///     kappa = 0.6
///     [run]
///     duration = 0.1
///     "#,
/// )?;
/// let plan = plan(&scene, 0.0)?;
/// assert_eq!(plan.size(), 7);
/// assert!(plan.left_out.iter().any(|part| part.what == "the shape of the rod"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A start from which no motion is possible; data without a well-posed problem; errors of the run, in a trial.
pub fn plan(scene: &Scene, seconds: f64) -> Result<Plan> {
    if scene.is_bar() {
        return bar::plan(scene, seconds);
    }
    if let Some(given) = scene.flow() {
        return flow::plan(scene, given, seconds);
    }
    if let Some(given) = scene.inflation() {
        return inflation::plan(scene, given, seconds);
    }
    if let Some(given) = scene.wall() {
        return Ok(wall::plan(scene, given));
    }
    if !scene.is_motion() {
        return statics::plan(scene);
    }
    let mut plan = match scene.assembly() {
        Some(given) => assembly::plan(scene, given)?,
        None => rod::plan(scene)?,
    };
    if plan.state.iter().any(|part| part.what == IN_ELEMENTS) {
        plan.in_elements();
    }
    plan.trial = trial::trial(scene, seconds)?;
    Ok(plan)
}

/// Why a strain is not in the state.
const RIGID: &str = "the section holds them rigid";

impl Plan {
    /// Number of scalars in the state.
    pub fn size(&self) -> usize {
        self.state.iter().map(|part| part.numbers).sum()
    }

    fn empty(scene: &Scene, duration: f64) -> Self {
        Self {
            model: choice("", ""),
            chart: choice("", ""),
            state: Vec::new(),
            method: choice("", ""),
            left_out: Vec::new(),
            notes: scene
                .mass_notes()
                .iter()
                .filter_map(RodMassNote::text)
                .collect(),
            trial: None,
            units: scene.units,
            duration,
        }
    }

    /// State variables of the motion, and the reason if elements were left for strains at nodes.
    fn carries(&mut self, motion: &dyn Motion<'_>) {
        self.state = motion.carries();
        let why = motion.why_no_elements();
        self.notes
            .extend(why.map(|why| format!("the strains at nodes follow the rod: {why}")));
    }

    /// Chart and steps of rods with mass in elements.
    fn in_elements(&mut self) {
        self.model.what = "rods with all of their mass, cut into elements".to_owned();
        for part in self.left_out.iter_mut().filter(|part| part.why == RIGID) {
            part.why = "the section holds them rigid: stiff springs stand in, which give less than the tolerance".to_owned();
        }
        self.chart = choice(
            "positions and rotations of nodes along the rods, in elements",
            "run.tolerance of 1e-5 or coarser, and no rod.nodes: as many elements as the places ask for, which change between steps",
        );
        self.method = choice(
            "implicit steps (Radau IIA, of order 9 at fine tolerances, of order 5 at others)",
            "errors are measured in places: waves that are faster than the steps die out, as numerical_loss says; method = \"explicit\" follows them",
        );
    }

    fn leave_out(&mut self, what: &str, why: impl Into<String>) {
        self.left_out.push(choice(what, why));
    }

    /// Adds an entry for several names, if any.
    fn leave_out_of<'a>(
        &mut self,
        names: impl Iterator<Item = &'a str>,
        what: impl Fn(&str) -> String,
        why: &str,
    ) {
        let names: Vec<&str> = names.collect();
        if !names.is_empty() {
            self.leave_out(&what(&names.join(", ")), why);
        }
    }

    /// JSON form.
    pub fn json(&self) -> Value {
        let one = |choice: &Choice| json!({ "what": choice.what, "why": choice.why });
        let state = self
            .state
            .iter()
            .map(|part| json!({ "what": part.what, "numbers": part.numbers }));
        json!({
            "model": one(&self.model),
            "chart": one(&self.chart),
            "state": { "size": self.size(), "parts": state.collect::<Vec<_>>() },
            "method": one(&self.method),
            "left_out": self.left_out.iter().map(one).collect::<Vec<_>>(),
            "notes": self.notes,
            "trial": self.trial.as_ref().map(Trial::json),
        })
    }

    /// Text form, in lines.
    pub fn text(&self) -> String {
        let parts = self
            .state
            .iter()
            .map(|part| format!("{} {}", part.numbers, part.what));
        let parts: Vec<String> = parts.collect();
        let mut lines = vec![
            format!("model   {}\n          {}", self.model.what, self.model.why),
            format!("chart   {}\n          {}", self.chart.what, self.chart.why),
            format!("state   {} numbers: {}", self.size(), parts.join(", ")),
            format!(
                "method  {}\n          {}",
                self.method.what, self.method.why
            ),
        ];
        lines.extend(self.notes.iter().map(|note| format!("note    {note}")));
        lines.push("not computed".to_owned());
        let left_out = self.left_out.iter();
        lines.extend(left_out.map(|part| format!("  {}\n          {}", part.what, part.why)));
        lines.extend(
            self.trial
                .as_ref()
                .map(|trial| format!("cost    {}", trial.text(self.duration, self.units))),
        );
        lines.join("\n") + "\n"
    }
}

/// Steps by this method, for models with explicit and implicit ones.
fn steps(method: Method, implicit: &str) -> Choice {
    match method {
        Method::Auto => choice(
            format!("explicit steps of order 8 (DOP853), {implicit} where they pay"),
            "run.method = \"auto\": judged from step to step by what bounds the step, stability or accuracy",
        ),
        Method::Explicit => choice(
            "explicit steps of order 8 (DOP853)",
            "run.method = \"explicit\"",
        ),
        Method::Implicit => choice(implicit.to_owned(), "run.method = \"implicit\""),
        Method::Symmetric => symmetric(),
    }
}

fn symmetric() -> Choice {
    choice(
        "symmetric steps of order 12 (Gauss collocation)",
        "run.method = \"symmetric\": the energy of a long motion stays near what it was",
    )
}

/// Steps of rods with fully followed mass: Radau IIA.
const RADAU: &str =
    "implicit ones (Radau IIA, of order 9 at tolerances of 1e-7 and less, of order 5 at others)";

/// Radau IIA steps of rods with friction and no mass.
const RADAU_LIGHT: &str = "implicit ones (Radau IIA, of order 9 at tolerances of 1e-7 and less, or 13 at 1e-10 and less, of order 5 at others)";

/// Radau IIA steps with seven stages, for elastic rods in space.
const RADAU7: &str = "implicit ones of order 13 (Radau IIA with seven stages)";
