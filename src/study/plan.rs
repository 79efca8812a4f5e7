//! What the program will do with a scene, before it does it: model, chart, state and steps, what is not computed and why, and what the
//! whole will cost, from a trial of its first part.

use super::any;
use super::assembly::AssemblyPrepared;
use super::bar::BarPrepared;
use super::run::{Fields, ModelKind, Prepared};
use super::{Hooks, Sink, Table};
use crate::assembly::Joint as Attached;
use crate::bar::Scheme;
use crate::error::Result;
use crate::motion::{Carried, LandingRule};
use crate::scene::{AssemblyBody, AssemblyRod, AssemblyScene, Joint, RodMassNote, Scene, Units};
use crate::solve::integrator::Method;
use crate::study::record::Cell;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Something that was chosen, or is not computed, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    /// What.
    pub what: String,
    /// Why.
    pub why: String,
}

/// The first part of a run, or all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The fraction of its duration that it came to.
    pub fraction: f64,
    /// Seconds that this took, and that came before its first step.
    pub seconds: [f64; 2],
    /// Steps, and right-hand sides; None of a bar, whose steps follow from its cells.
    pub work: Option<[u64; 2]>,
    /// Why it ended before its time, if it did so by itself.
    pub reason: Option<String>,
    /// True if it branches at snaps, so that nothing is known of the whole.
    pub branches: bool,
}

/// What the program does with a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The model.
    pub model: Choice,
    /// What says where the rods are.
    pub chart: Choice,
    /// The numbers that are carried from step to step at the start, or solved for.
    pub state: Vec<Carried>,
    /// How time is stepped through, or how equilibria are solved.
    pub method: Choice,
    /// What is not computed.
    pub left_out: Vec<Choice>,
    /// What the mass of each elastic rod of known mass does; the spring and dashpot that a rod is, if it is one.
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

/// What is done with a scene; a motion is tried for about `seconds`, not at all if that is 0.
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
/// A start from which no run can go; data that make no problem; in a trial what the run itself refuses.
pub fn plan(scene: &Scene, seconds: f64) -> Result<Plan> {
    if scene.bar.is_some() {
        return of_bar(scene, seconds);
    }
    if !scene.is_motion() {
        return of_statics(scene);
    }
    let mut plan = match &scene.assembly {
        Some(given) => of_assembly(scene, given)?,
        None => of_rod(scene)?,
    };
    plan.trial = trial(scene, seconds)?;
    Ok(plan)
}

impl Plan {
    /// How many numbers the state has.
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

    fn leave_out(&mut self, what: &str, why: impl Into<String>) {
        self.left_out.push(choice(what, why));
    }

    /// The same of several, if there are any.
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

    /// As JSON.
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
            "trial": self.trial.as_ref().map(|trial| json!({
                "fraction": trial.fraction,
                "seconds": trial.seconds[0],
                "seconds_before": trial.seconds[1],
                "steps": trial.work.map(|work| work[0]),
                "evaluations": trial.work.map(|work| work[1]),
                "reason": trial.reason,
                "expected_seconds": trial.expected(),
            })),
        })
    }

    /// In lines.
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

impl Trial {
    /// Seconds that the whole run may take, figures and files aside, if it goes on as it began; None where nothing tells that.
    pub fn expected(&self) -> Option<f64> {
        let known = !self.branches && self.reason.is_none() && self.fraction > 0.0;
        known.then(|| self.seconds[1] + self.seconds[0] / self.fraction)
    }

    fn text(&self, duration: f64, units: Units) -> String {
        let [spent, before] = self.seconds;
        let work = match self.work {
            Some([steps, evaluations]) => format!("{steps} steps, {evaluations} right-hand sides"),
            None => "steps of its cells".to_owned(),
        };
        let at = format!(
            "{:.4} of {duration} {}",
            self.fraction * duration,
            units.time()
        );
        let at = at.trim_end();
        if let Some(reason) = &self.reason {
            return format!("the run ends at t = {at}, after {work}: {reason}");
        }
        if self.branches {
            return format!(
                "the first branch took {spent:.2} s for t = {at} ({work}); the run branches at every snap, which multiplies that"
            );
        }
        if self.fraction >= 1.0 {
            return format!(
                "all of it, done as a trial, took {:.2} s: {work}",
                spent + before
            );
        }
        match self.expected() {
            Some(all) => format!(
                "a trial of {:.2} s came to t = {at} ({work}): about {} for the whole, figures and files aside, if it goes on as it began",
                spent + before,
                long(all)
            ),
            None => format!(
                "a trial of {:.2} s ended within its first step",
                spent + before
            ),
        }
    }
}

/// Seconds, or what is read more easily.
fn long(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 2e5 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} days", s / 86400.0),
    }
}

/// Steps of this kind, in the models that have explicit and implicit ones.
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

/// Radau IIA, of rods with strains.
const RADAU: &str = "implicit ones of order 5 (Radau IIA)";

fn of_rod(scene: &Scene) -> Result<Plan> {
    let prepared = Prepared::new(scene)?;
    let (kind, run) = (prepared.kind(), scene.run()?);
    let mut plan = Plan::empty(scene, run.duration);
    plan.state = prepared.motion()?.carries();
    let full = prepared.is_full();
    let lifted = scene.is_planar() && kind.in_space();
    plan.model = match (kind, full) {
        (ModelKind::Sheet, _) => choice(
            "the planar elastica: end, force and stiffness in closed form",
            "rod.model = \"elastica\", no damping, no load along the rod: elliptic integrals know all that the body feels",
        ),
        (ModelKind::ElasticSpace, _) if lifted => choice(
            "an elastic rod in space that is stiff out of its plane",
            "rod.model = \"elastica\" with a load along the rod (its weight, loads.distributed), which no closed form has",
        ),
        (ModelKind::ElasticSpace, _) => choice(
            "an elastic rod in space, integrated along itself from its base at every evaluation",
            "rod.model = \"cosserat\", no damping",
        ),
        (ModelKind::Planar | ModelKind::Space, true) => choice(
            "a rod with all of its mass: the strains at nodes along it, and their rates",
            "rod.inertia = \"full\"",
        ),
        (ModelKind::Planar, false) => choice(
            "a viscoelastic rod in the plane: the curvature at nodes along it",
            "rod.model = \"elastica\" with rod.damping: strains have rates of their own and are no equilibrium",
        ),
        (ModelKind::Space, false) => choice(
            "a viscoelastic rod in space: the strains at nodes along it",
            "rod.model = \"cosserat\" with rod.damping: strains have rates of their own and are no equilibrium",
        ),
    };
    plan.chart = match kind {
        ModelKind::Sheet => choice(
            "(p, w), modulus and amplitude of the elastica",
            "one chart for all sheets, slack and taut: it goes on through folds, so that a fold is where its Jacobian vanishes",
        ),
        ModelKind::ElasticSpace => choice(
            "the wrench at the base; of a taut rod its force alone",
            "the equilibrium manifold is one sheet over it, whatever folds it has over the place of the end",
        ),
        ModelKind::Planar | ModelKind::Space => choice(
            "the strains themselves",
            match scene.rod.nodes {
                Some(_) => "at as many nodes as rod.nodes says",
                None => "at as many nodes as the tolerance asks for, which change between steps",
            },
        ),
    };
    plan.method = match (kind, run.method) {
        (_, Method::Symmetric) => symmetric(),
        (ModelKind::Sheet, _) => choice(
            "explicit steps of order 8 (DOP853)",
            "next to the straight rod and to the taut one they follow time scaled to the force there",
        ),
        (ModelKind::ElasticSpace, method) => steps(
            method,
            "implicit ones of order 13 (Radau IIA with seven stages)",
        ),
        (_, method) => steps(method, RADAU),
    };
    parts_of_rod(&mut plan, scene, &prepared)?;
    Ok(plan)
}

fn parts_of_rod(plan: &mut Plan, scene: &Scene, prepared: &Prepared) -> Result<()> {
    let kind = prepared.kind();
    let (full, in_space) = (prepared.is_full(), kind.in_space());
    if kind.is_elastic() {
        plan.leave_out(
            "rates of the strains",
            "without damping the rod is in equilibrium at every moment but those of its snaps",
        );
        if run_lands(scene)? {
            plan.leave_out(
                "the fast fall of the rod",
                "at its snaps alone: there it settles with its end held, which decides where it lands",
            );
        }
    }
    if kind == ModelKind::Sheet {
        plan.leave_out(
            "the shape of the rod",
            "the end and its force do not need it; it is found at the samples that are drawn or written",
        );
    }
    if !in_space {
        plan.leave_out(
            "motion out of the plane",
            "rod.model = \"elastica\": clamp, loads and start lie in the plane, and nothing asks whether it would leave it",
        );
    } else {
        let all = ["u1", "u2", "u3", "v1", "v2", "v3"];
        let moving = prepared.strains();
        let rigid: Vec<&str> = (all.into_iter())
            .filter(|name| moving.iter().all(|(moves, _)| moves != name))
            .collect();
        if !rigid.is_empty() {
            plan.leave_out(
                &format!("the strains {}", rigid.join(", ")),
                "the section holds them rigid",
            );
        }
    }
    if scene.body()?.joint == Joint::Ball && in_space {
        plan.leave_out(
            "the turning of the body",
            "it hangs on a ball joint (body.joint), which takes no couple: it is a point",
        );
    }
    if !full && !scene.rod.is_light() {
        plan.leave_out(
            "the inertia of the rod",
            match scene.rod.mass() {
                None => "its mass is not known: neither rod.mass nor a material with a density",
                Some(_) => "rod.inertia = \"none\", or what is said of its mass",
            },
        );
    }
    if !full && !scene.is_loaded_along() {
        plan.leave_out(
            "loads along the rod",
            "neither loads.distributed nor a weight: its force is one vector from base to end",
        );
    }
    if scene.clamp.motion.is_none() {
        plan.leave_out("accelerations of the clamp", "it stands: no clamp.motion");
    }
    if !prepared.is_driven() {
        plan.leave_out(
            "the work of loads in time",
            "no load changes in time, and no support moves: all loads have a potential",
        );
    }
    if scene.rod.damping.is_some() && scene.rod.relaxation.is_empty() {
        plan.leave_out(
            "strains of dashpots",
            "no rod.relaxation: the damping is of Kelvin-Voigt's kind",
        );
    }
    if scene.rod.thickness().is_none() && (full || kind == ModelKind::ElasticSpace) {
        plan.leave_out(
            "contact of the rod with itself",
            "it has neither an outline nor rod.contact_diameter",
        );
    }
    if let Some(Ok(spring)) = prepared.spring()? {
        plan.notes.push(format!(
            "this {} motion is exactly that of a spring and a dashpot, which the run prints; it is integrated as every other is",
            spring.kind
        ));
    }
    Ok(())
}

/// True if snaps settle by the viscous layer.
fn run_lands(scene: &Scene) -> Result<bool> {
    Ok(scene.run()?.landing == LandingRule::Viscous)
}

fn of_assembly(scene: &Scene, given: &AssemblyScene) -> Result<Plan> {
    let run = scene.run()?;
    let prepared = AssemblyPrepared::new(scene)?;
    let mut plan = Plan::empty(scene, run.duration);
    plan.state = prepared.motion()?.0.carries();
    let rods = || given.rods.iter();
    let full = rods().any(|rod| rod.rod.is_heavy());
    (plan.model, plan.chart, plan.method) = if full {
        (
            choice(
                "rods with mass between bodies: strains at nodes along every rod, and their rates",
                "[[rod]] inertia = \"full\"",
            ),
            choice(
                "the strains themselves, and places of the bodies",
                "ends of rods are held by multipliers, which are solved for with the accelerations",
            ),
            steps(run.method, RADAU),
        )
    } else {
        (
            choice(
                "elastic rods between bodies, each integrated along itself from its base at every evaluation",
                "[[rod]] without damping and without inertia = \"full\"",
            ),
            choice(
                "the wrench at the base of every rod; of a taut one its force alone",
                "the bodies say where the ends are, the charts which of the equilibria there each rod is in",
            ),
            steps(
                run.method,
                "implicit ones of order 13 (Radau IIA with seven stages)",
            ),
        )
    };
    if !full {
        plan.leave_out(
            "rates of the strains",
            "without damping and inertia = \"full\" the rods are in equilibrium at every moment but those of their snaps",
        );
    }
    let bodies = given.bodies.iter();
    let points = bodies.filter(|body| body.extent.is_none());
    plan.leave_out_of(
        points.map(|body| body.name.as_str()),
        |names| format!("the turning of {names}"),
        "points: no inertia, held by ball joints",
    );
    let some = |chosen: &dyn Fn(&AssemblyRod) -> bool| -> Vec<&str> {
        let rods = rods().filter(|rod| !full && chosen(rod));
        rods.map(|rod| rod.name.as_str()).collect()
    };
    let pinned =
        |rod: &AssemblyRod| [&rod.from, &rod.to].map(|site| site.joint) == [Attached::Ball; 2];
    plan.leave_out_of(
        some(&pinned).into_iter(),
        |names| format!("the spin of {names} about the chord"),
        "between two ball joints nothing feels it: the rod is a spring along its chord",
    );
    plan.leave_out_of(
        some(&|rod| rod.rod.mass().is_none()).into_iter(),
        |names| format!("the inertia of {names}"),
        "the mass is not known: neither mass nor a material with a density",
    );
    let floats = scene.loads.gravity == [0.0; 3];
    let bare =
        |rod: &AssemblyRod| rod.distributed.is_zero() && (floats || rod.rod.mass().is_none());
    plan.leave_out_of(
        some(&bare).into_iter(),
        |names| format!("loads along {names}"),
        "neither distributed nor a weight: the force is one vector from base to end",
    );
    if rods().all(|rod| rod.rod.thickness().is_none()) {
        plan.leave_out(
            "contacts of rods",
            "none has an outline or a contact_diameter",
        );
    }
    if rods().all(|rod| rod.from.motion.is_none() && rod.to.motion.is_none()) {
        plan.leave_out("motion of supports", "no site has a motion: they stand");
    }
    if !given.free.is_empty() {
        plan.leave_out(
            "rods with a free end",
            "nothing hangs on them: they are equilibria alone, found when they are drawn",
        );
    }
    Ok(plan)
}

fn of_bar(scene: &Scene, seconds: f64) -> Result<Plan> {
    let prepared = BarPrepared::new(scene)?;
    let given = prepared.given();
    let mut plan = Plan::empty(scene, given.duration);
    plan.model = choice(
        "a bar with mass in longitudinal motion",
        "rod.model = \"bar\": stretch and velocity along it, waves and shocks",
    );
    plan.chart = choice(
        "stretch and velocity of every cell",
        "rod.cells says how many",
    );
    plan.state = vec![Carried {
        what: "stretches and velocities of the cells",
        numbers: 2 * given.cells,
    }];
    plan.method = match given.scheme {
        Scheme::FiniteVolume => choice(
            "finite volumes with an exact Riemann solver, of high resolution where the motion is smooth",
            "rod.scheme, or its default",
        ),
        other => choice(format!("the scheme {:?}", other.name()), "rod.scheme"),
    };
    plan.leave_out(
        "bending, shear and torsion",
        "a bar stays straight; rod.model = \"cosserat\" with inertia = \"full\" has them all, without shocks",
    );
    if given.scheme != Scheme::FiniteVolume {
        plan.leave_out(
            "shocks",
            "only finite volumes resolve them and book what they lose",
        );
    }
    plan.trial = trial(scene, seconds)?;
    Ok(plan)
}

fn of_statics(scene: &Scene) -> Result<Plan> {
    let mut plan = Plan::empty(scene, 0.0);
    plan.leave_out("time", "a scene without [run] asks for an equilibrium");
    let numbers = |what, numbers| Carried { what, numbers };
    if let Some(given) = &scene.assembly {
        plan.model = choice(
            "the equilibrium of rods and bodies",
            "[[rod]] and [[body]] without [run]",
        );
        plan.chart = choice(
            "places of the bodies, and the wrench at the base of every rod",
            "all together: regular where a single rod is at its fold, and where it is straight",
        );
        let freedoms = |body: &AssemblyBody| {
            let turns = if body.extent.is_some() { 3 } else { 0 };
            turns + if body.groove.is_some() { 1 } else { 3 }
        };
        plan.state = vec![
            numbers(
                "places of the bodies",
                given.bodies.iter().map(freedoms).sum(),
            ),
            numbers("charts of the rods", 6 * given.rods.len()),
        ];
        plan.method = choice(
            "Newton's method, from the guess or the unloaded rods, along a path of loads where that fails",
            "the equations have exact derivatives",
        );
        return Ok(plan);
    }
    let problem = scene.problem()?;
    let taken = problem.solve(scene.guess().as_ref())?.taken;
    plan.model = choice(
        "the equilibrium of one rod",
        "[end] in place of [body] and [run]",
    );
    plan.chart = choice(
        "the wrench at the base",
        "the rod follows from it by one integration, whatever holds its end",
    );
    plan.state = vec![numbers("components of the wrench", 6)];
    plan.method = choice(taken.path.as_str(), taken.why);
    if !scene.is_loaded_along() {
        plan.leave_out(
            "loads along the rod",
            "neither loads.distributed nor a weight: its force is one vector from base to end",
        );
    }
    if problem.rod().hoists_inverse() {
        plan.leave_out(
            "the inverse of the law of the section along the rod",
            "the law is linear and the same everywhere: it is inverted once",
        );
    }
    Ok(plan)
}

/// Takes all rows, and keeps none.
struct Nowhere(usize);

impl Sink for Nowhere {
    fn begin(&mut self, _: Table) -> Result<usize> {
        self.0 += 1;
        Ok(self.0 - 1)
    }

    fn row(&mut self, _: usize, _: &[Cell]) -> Result<()> {
        Ok(())
    }
}

/// Ends a run some time after its first step.
struct Clock {
    begun: Instant,
    given: Duration,
    first: Option<Instant>,
    last: Instant,
    fraction: f64,
}

impl Hooks for Clock {
    fn interrupted(&mut self) -> bool {
        self.begun.elapsed() >= self.given
    }

    fn progress(&mut self, fraction: f64, _: f64) {
        self.last = Instant::now();
        self.first.get_or_insert(self.last);
        self.fraction = self.fraction.max(fraction);
    }
}

/// Runs the scene for about so many seconds.
fn trial(scene: &Scene, seconds: f64) -> Result<Option<Trial>> {
    if !(seconds > 0.0) {
        return Ok(None);
    }
    let begun = Instant::now();
    let mut clock = Clock {
        begun,
        given: Duration::from_secs_f64(seconds.min(1e6)),
        first: None,
        last: begun,
        fraction: 0.0,
    };
    let found = any::motion(scene, Fields::None, &mut Nowhere(0), &mut clock)?;
    let all = begun.elapsed().as_secs_f64();
    let first = clock.first.unwrap_or(clock.last);
    let spent = (clock.last - first).as_secs_f64();
    let count = |key: &str| found.summary["work"][key].as_u64();
    let interrupted = found.summary["outcome"] == "interrupted";
    let whole = !interrupted && found.reason.is_none();
    Ok(Some(Trial {
        fraction: if whole { 1.0 } else { clock.fraction },
        seconds: [spent, all - spent],
        work: (count("steps").zip(count("evaluations"))).map(<[u64; 2]>::from),
        reason: found.reason.filter(|_| !interrupted),
        branches: scene
            .run
            .as_ref()
            .is_some_and(|run| run.landing == LandingRule::All),
    }))
}
