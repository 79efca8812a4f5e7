//! Readers of `[run]` and `[solve]`.

use super::fields::{ASSEMBLY, Kinds, PLANE};
use super::friction::needs_damping;
use super::rod::RodTraits;
use super::start::landing;
use super::table::Table;
use crate::motion::Options;
use crate::rod::Path;
use crate::scene::{FaultKind, Method, Run, Solve};

/// Bound on the number of strobe periods of a run; fewer periods give at most 1e7 samples, the bound of `samples`.
const MOST_PERIODS: f64 = 1e7;

pub(super) fn run(table: &Table, memory: Option<RodTraits>) -> Option<Run> {
    let kind = table.reader.kind.get();
    let planar = kind == PLANE;
    let duration = table.number("duration");
    let tolerance = tolerance(table, memory);
    let elastic = memory.map_or(kind == ASSEMBLY, |memory| !memory.has_strains());
    let method = method(
        table,
        elastic,
        planar,
        memory.is_some_and(|memory| !memory.damped),
    );
    let samples = samples(table, kind, duration);
    let (max_steps, max_snaps) = (table.count("max_steps"), table.count("max_snaps"));
    // Kinds of scenes without this field have a fixed value.
    let reduce = match kind {
        ASSEMBLY => Some(false),
        PLANE => Some(true),
        _ => table.flag("reduce"),
    };
    let (landing, branches) = (landing(table, memory), table.count("branches"));
    let (samples, strobe) = samples?;
    Some(Run {
        duration: duration?,
        tolerance: tolerance?,
        method: method?,
        reduce: reduce?,
        landing: landing?,
        branches: branches?,
        samples,
        strobe,
        max_steps: max_steps?,
        max_snaps: max_snaps?,
    })
}

fn method(table: &Table, elastic: bool, planar: bool, heavy: bool) -> Option<Method> {
    let all = [
        Method::Auto,
        Method::Explicit,
        Method::Implicit,
        Method::Symmetric,
    ];
    let method = table.word("method", &all)?;
    match method {
        Method::Explicit | Method::Implicit if elastic && planar => {
            let why = "an elastic run in the plane takes explicit steps, or symmetric ones (\"symmetric\")";
            needs_damping(table, "method", why);
            None
        }
        Method::Symmetric if !elastic && heavy => {
            let allowed = "\"auto\", \"explicit\" or \"implicit\" where the rod has mass";
            let hint = "symmetric steps follow rods without mass";
            table.refuse(FaultKind::Conflict, "method", allowed, hint)
        }
        Method::Symmetric if !elastic => {
            let allowed = "\"auto\", \"explicit\" or \"implicit\" where the rod has damping";
            let hint = "symmetric steps keep the energy of a motion that can run backward, and a rod with damping loses it";
            table.refuse(FaultKind::Conflict, "method", allowed, hint)
        }
        method => Some(method),
    }
}

/// Reads the number of output times, and the period if the scene gives `strobe`.
fn samples(table: &Table, kind: Kinds, duration: Option<f64>) -> Option<(usize, Option<f64>)> {
    let samples = table.count("samples");
    let strobe = match kind {
        ASSEMBLY => None,
        _ => table.optional("strobe")?,
    };
    let (Some(period), Some(duration)) = (strobe, duration) else {
        return Some((samples?, None));
    };
    let whole = (duration / period).round();
    if !(1.0..MOST_PERIODS).contains(&whole) || (duration - whole * period).abs() > 1e-9 * duration
    {
        let allowed = "a period of which `duration` is a whole multiple, less than 1e7 times it";
        return table.refuse(FaultKind::Value, "strobe", allowed, None);
    }
    let written = whole as usize + 1;
    if table.has("samples") && samples != Some(written) {
        let allowed =
            format!("absent beside `strobe`, or {written}, which is what `strobe` makes it");
        return table.refuse(FaultKind::Value, "samples", allowed, None);
    }
    Some((written, strobe))
}

/// Default tolerance of rods of full mass without friction, whose waves never die out.
const OF_WAVES: f64 = 1e-4;

fn tolerance(table: &Table, memory: Option<RodTraits>) -> Option<f64> {
    let planar = table.reader.kind.get() == PLANE;
    let waves = memory.is_some_and(|memory| memory.heavy && !memory.damped);
    if waves && !table.has("tolerance") {
        return Some(OF_WAVES);
    }
    let tolerance = table.number("tolerance")?;
    let has_strains = memory.is_some_and(RodTraits::has_strains);
    if (!planar || has_strains) && !(tolerance >= Options::LEAST_WITH_STRAINS) {
        let allowed = "a number in [1e-13, 1e-2] of a rod with damping or in space";
        return table.refuse(FaultKind::Value, "tolerance", allowed, None);
    }
    Some(tolerance)
}

pub(super) fn solve(table: &Table) -> Option<Solve> {
    let paths = [Path::Auto, Path::Planar, Path::Spatial, Path::ClosedForm];
    let tolerance = table.number("tolerance");
    let path = match table.reader.kind.get() {
        ASSEMBLY => Some(Path::Auto),
        _ => table.word("path", &paths),
    };
    Some(Solve {
        tolerance: tolerance?,
        path: path?,
    })
}
