//! Printed report of `snaprod run`.

use super::files::{number, rounded, settled};
use snaprod::motion::contact::ContactEvent;
use snaprod::motion::viscoelastic::Layer;
use snaprod::motion::{Outcome, Snap};
use snaprod::scene::{RodMassNote, Units};
use snaprod::study::neglected_mass::{FoldPassed, FoldTreatment, Validity};
use snaprod::study::run::{RunBranch, RunHeader, RunRecord, Spring};
use std::path::Path;

/// Number of snaps, or passages, printed one by one.
const SHOWN: usize = 20;

/// Report of a run with its files in `out`.
pub fn text(record: &RunRecord, out: Option<&Path>) -> String {
    let (header, u) = (&record.header, record.header.units);
    let mut lines = Vec::new();
    lines.extend(record.warning().map(|why| format!("note: {why}")));
    // If a verdict on the masses follows below, only defaults of the program are printed here.
    let said = header.masses.iter();
    let said = said.filter(|mass| mass.by_default || record.validity.is_none());
    lines.extend(said.filter_map(RodMassNote::text));
    if let Some(Ok(found)) = &record.spring {
        lines.push(spring(found, u));
    }
    for branch in &record.branches {
        if record.branches.len() > 1 {
            lines.push(match branch.parent {
                None => "branch 0".to_owned(),
                Some(parent) => format!("branch {} (from branch {parent})", branch.id),
            });
        }
        lines.extend(branch.all_snaps().take(SHOWN).map(|s| snap(header, s)));
        let snaps = branch.all_snaps().count();
        if snaps > SHOWN {
            lines.push(format!("... and {} more snaps", snaps - SHOWN));
        }
        let passages: Vec<&Layer> = branch.snap_layers().collect();
        lines.extend(passages.iter().take(SHOWN).map(|l| passage(l, u)));
        if passages.len() > SHOWN {
            lines.push(format!("... and {} more passages", passages.len() - SHOWN));
        }
        lines.extend(contacts(header, branch));
        lines.extend(heavy_folds(&record.folds, branch.id, u));
        lines.extend(end(header, branch));
        lines.extend(cost(header, branch));
    }
    lines.extend(record.bounces());
    lines.extend(
        record
            .time_without_mass()
            .map(|time| omitted_mass_note(time, u)),
    );
    lines.extend(
        record
            .missing_folds_note()
            .map(|why| format!("note: {why}")),
    );
    lines.extend(record.validity.as_ref().map(mass));
    if let Some(out) = out {
        lines.push(match record.strain_stride {
            None | Some(1) => format!("written to {}", out.display()),
            Some(n) => format!(
                "written to {} (strain.csv has one in {n} samples; --all-strain writes all)",
                out.display()
            ),
        });
    }
    lines.join("\n") + "\n"
}

fn snap(header: &RunHeader, snap: &Snap) -> String {
    let u = header.units;
    let of = header.rod_name(snap.rod).map(|name| format!(" of {name}"));
    format!(
        "snap{} at t = {}{}: {}released {}{}{}",
        of.unwrap_or_default(),
        rounded(snap.t, 12),
        Units::suffix(u.time()),
        match (snap.from.sheet, snap.to.sheet) {
            (Some(from), Some(to)) => format!("{from} -> {to}, "),
            _ => String::new(),
        },
        rounded(snap.released, 9),
        Units::suffix(u.energy()),
        chosen(snap),
    )
}

/// Impacts and changes of contacts of a branch, the first ones one by one.
fn contacts(header: &RunHeader, branch: &RunBranch) -> Vec<String> {
    let events = branch.contacts.iter().flat_map(|all| &all.events);
    let mut lines: Vec<String> = events
        .clone()
        .take(SHOWN)
        .map(|e| contact(header, e))
        .collect();
    let count = events.count();
    if count > SHOWN {
        lines.push(format!("... and {} more events of contacts", count - SHOWN));
    }
    lines
}

fn contact(header: &RunHeader, event: &ContactEvent) -> String {
    let u = header.units;
    let [a, b] = header.sides(event.contact());
    let at = format!(
        "at t = {}{}",
        rounded(event.time(), 12),
        Units::suffix(u.time())
    );
    match event {
        ContactEvent::Impact(hit) => format!(
            "impact of {a} on {b} {at}: normal velocity {} -> {}{}, lost {}{}",
            rounded(hit.before.dot(&hit.normal), 9),
            rounded(hit.after.dot(&hit.normal), 9),
            Units::suffix(u.velocity()),
            rounded(hit.lost, 9),
            Units::suffix(u.energy()),
        ),
        ContactEvent::Accumulation(_) => format!("bounces of {a} on {b} end {at}"),
        ContactEvent::Slip(_) => format!("{a} begins to slip on {b} {at}"),
        ContactEvent::Stick(_) => format!("{a} sticks to {b} {at}"),
        ContactEvent::Reverse(_) => format!("{a} slips back on {b} {at}"),
        ContactEvent::Release(_) => format!("{a} leaves {b} {at}"),
    }
}

/// Text on a landing chosen by a rule: the number of stable equilibria with less energy than the fold, and whether the
/// flow at small viscosity leads to the landing.
fn chosen(snap: &Snap) -> String {
    let Some(choices) = snap.choices else {
        return String::new();
    };
    let found = match (snap.to.sheet, choices) {
        // In the plane the list of equilibria is complete.
        (Some(_), _) => String::new(),
        (None, 1) => ", the only stable equilibrium found at lower energy".to_owned(),
        (None, _) => format!(", {choices} stable equilibria found at lower energy"),
    };
    let flow = match snap.reached {
        Some(true) => "the viscous flow leads here",
        Some(false) => "the viscous flow leads elsewhere",
        None => "the landing of the viscous flow was not found",
    };
    format!("{found} ({flow})")
}

fn passage(layer: &Layer, u: Units) -> String {
    format!(
        "passage away from equilibrium from t = {} to {}{}, peak at {}: dissipated {}{}, elastic energy released {}{}",
        rounded(layer.from, 6),
        rounded(layer.to, 6),
        Units::suffix(u.time()),
        rounded(layer.peak, 6),
        rounded(layer.dissipated, 6),
        Units::suffix(u.energy()),
        rounded(layer.elastic_from - layer.elastic_to, 6),
        Units::suffix(u.energy()),
    )
}

/// End of a branch: its outcome, then position and velocity of each body, or of the end and a free base; in the plane
/// also the sheet that the rod is on or near.
fn end(header: &RunHeader, branch: &RunBranch) -> Vec<String> {
    let (k, u) = (&header.scales, header.units);
    let (axes, decimals) = if header.in_space() { (3, 9) } else { (2, 12) };
    let vector = |v: &nalgebra::Vector3<f64>, scale: f64, symbol: &str| {
        // Components of a billionth are errors of the integration.
        let scale = 1e3 * v.amax().max(scale);
        let parts = v
            .iter()
            .take(axes)
            .map(|x| rounded(settled(*x, scale), decimals));
        let parts: Vec<String> = parts.collect();
        format!("({}){}", parts.join(", "), Units::suffix(symbol))
    };
    let bodies = branch.last.bodies.iter().map(|body| {
        format!(
            "r = {}, v = {}",
            vector(&body.pose.translation.vector, k.length, u.length()),
            vector(&body.velocity, k.velocity, u.velocity()),
        )
    });
    let outcome = format!(
        "t = {}{}: {}",
        number(match branch.outcome {
            // The last time of a rod with strains equals the duration up to rounding.
            Outcome::EndOfTime => header.run.duration,
            _ => branch.last.t,
        }),
        Units::suffix(u.time()),
        if branch.outcome.is_complete() {
            branch.outcome.to_string()
        } else {
            // The reason is printed on the error stream.
            format!("ended short ({})", branch.outcome.key())
        }
    );
    if header.is_assembly() {
        let named = header.bodies.iter().zip(bodies);
        let bodies = named.map(|(body, at)| format!("{}: {at}", body.name));
        return std::iter::once(outcome).chain(bodies).collect();
    }
    let on = match &branch.last.labels {
        _ if header.in_space() => String::new(),
        Some(labels) if header.is_sheet() => format!(", {}", labels.sheet),
        Some(labels) => format!(", near {}", labels.sheet),
        None if header.heavy => String::new(),
        None if header.is_sheet() => ", touching an obstacle".to_owned(),
        None => ", near no equilibrium".to_owned(),
    };
    let place: Vec<String> = bodies.collect();
    vec![format!("{outcome}; {}{on}", place.join("; base at "))]
}

/// Closing error of the ledger, and cost of the branch.
fn cost(header: &RunHeader, branch: &RunBranch) -> Vec<String> {
    let energy = Units::suffix(header.units.energy());
    let closing = format!(
        "energy balance error {:.1e}{energy} (relative {:.1e})",
        branch.closing.error,
        branch.closing.relative()
    );
    let cost = &branch.cost;
    let why = branch.why_no_elements.iter();
    let why = why.map(|why| format!("the strains at nodes follow the rod: {why}"));
    let Some(nodes) = branch.resolution.filter(|_| !header.is_assembly()) else {
        let steps = format!(
            "{closing}; {} steps, {} right-hand sides",
            cost.steps, cost.evaluations
        );
        return [steps].into_iter().chain(why).collect();
    };
    let told = [
        format!(
            "dissipated {}{energy}; {closing}",
            rounded(branch.last.ledger.dissipated, 9)
        ),
        format!(
            "{} steps, {} of them implicit, {} right-hand sides; up to {} nodes; strain truncation error {:.1e}",
            cost.steps, cost.implicit_steps, cost.evaluations, nodes.most_nodes, nodes.tail
        ),
    ];
    told.into_iter().chain(why).collect()
}

/// Folds of the light rods that heavy rods passed in a branch, with the gains of energy after each.
fn heavy_folds(folds: &[FoldPassed], branch: usize, u: Units) -> Vec<String> {
    let folds = folds.iter().filter(|fold| fold.branch == branch);
    let told = folds
        .filter(|fold| fold.follows == FoldTreatment::Mass)
        .take(SHOWN);
    let text = told.filter_map(|fold| {
        let ledger = fold.changes?;
        let (of, gains) = match &fold.rod {
            Some(rod) => (format!("the light rod {rod}"), ["bodies", "rods"]),
            None => ("the light rod".to_owned(), ["body", "rod"]),
        };
        Some(format!(
            "fold of {of} passed at t = {}{}: a snap would release {}{}; energy changes over the next {}: kinetic of the {} {}, \
             kinetic of the {} {}, dissipated {}",
            rounded(fold.t, 9),
            Units::suffix(u.time()),
            rounded(fold.released, 6),
            Units::suffix(u.energy()),
            rounded(fold.until_next, 6),
            gains[0],
            rounded(ledger.kinetic, 6),
            gains[1],
            rounded(ledger.rod_kinetic, 6),
            rounded(ledger.dissipated, 6),
        ))
    });
    text.collect()
}

/// Verdict on the effect of the rods' mass.
fn mass(validity: &Validity) -> String {
    let eps = validity.rest.eps().unwrap_or_default();
    let of = match validity.rest.rods.len() {
        1 => format!("the rod has {eps:.2e} of the body's mass"),
        _ => format!("the rods have up to {eps:.2e} of a body's mass"),
    };
    format!("{of}: {}", validity.verdict())
}

/// Note on the time during which a run left the mass of a rod out.
fn omitted_mass_note(time: f64, u: Units) -> String {
    format!(
        "rod mass ignored for {time:.3e}{} in total, where it cannot be included (for instance from just before a fold to the landing); the kinetic energy of the rod \
         counts as dissipated there",
        Units::suffix(u.time())
    )
}

/// The spring and dashpot to which the rod reduces.
fn spring(of: &Spring, u: Units) -> String {
    let parts = of.moving.iter().enumerate().map(|(a, name)| {
        // Unit per radian, or per length.
        let per = |angle: &str, length: &str| match u {
            Units::Dimensionless => String::new(),
            Units::Si if Spring::is_angle(name) => Units::suffix(angle),
            Units::Si => Units::suffix(length),
        };
        format!(
            "{name}: spring {}{}, dashpot {}{}",
            rounded(of.stiffness[a][a], 9),
            per("N m/rad", "N/m"),
            rounded(of.dashpot[a][a], 9),
            per("N m s/rad", "N s/m"),
        )
    });
    let modes = of.modes.iter().map(|mode| {
        format!(
            "natural angular frequency {}{}, damping ratio {}",
            rounded(mode.natural_frequency, 9),
            if u == Units::Si { " rad/s" } else { "" },
            rounded(mode.damping_ratio, 6),
        )
    });
    let branches = match of.branches.len() {
        0 => None,
        1 => Some("one Maxwell branch in parallel".to_owned()),
        n => Some(format!("{n} Maxwell branches in parallel")),
    };
    let all: Vec<String> = parts.chain(branches).chain(modes).collect();
    format!(
        "{} motion: the rod is exactly a spring and a dashpot; {}",
        of.kind,
        all.join("; ")
    )
}
