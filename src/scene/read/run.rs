//! Reads `[run]` and `[solve]`.

use super::fields::{ASSEMBLY, PLANE};
use super::friction::needs_damping;
use super::rod::Memory;
use super::start::landing;
use super::table::Table;
use crate::rod::Path;
use crate::scene::{FaultKind, Method, Run, Solve};

/// What rounding leaves of the tolerance of a viscoelastic run.
const FINEST: f64 = 1e-13;

pub(super) fn run(table: &Table, memory: Option<Memory>) -> Option<Run> {
    let kind = table.reader.kind.get();
    let planar = kind == PLANE;
    let duration = table.number("duration");
    let tolerance = tolerance(table, !planar || memory.is_some_and(|memory| memory.damped));
    let elastic = memory.is_some_and(|memory| !memory.damped);
    if elastic {
        needs_damping(table, "method", "an elastic run has one method");
    }
    let methods = [Method::Auto, Method::Explicit, Method::Implicit];
    let samples = table.count("samples");
    let (max_steps, max_snaps) = (table.count("max_steps"), table.count("max_snaps"));
    // What the kind of scene does not have is what its motion does anyway.
    let (method, reduce) = match kind {
        ASSEMBLY => (Some(Method::Auto), Some(false)),
        PLANE => (table.word("method", &methods), Some(true)),
        _ => (table.word("method", &methods), table.flag("reduce")),
    };
    let (landing, branches) = (landing(table, memory), table.count("branches"));
    Some(Run {
        duration: duration?,
        tolerance: tolerance?,
        method: method?,
        reduce: reduce?,
        landing: landing?,
        branches: branches?,
        samples: samples?,
        max_steps: max_steps?,
        max_snaps: max_snaps?,
    })
}

fn tolerance(table: &Table, damped: bool) -> Option<f64> {
    let tolerance = table.number("tolerance")?;
    if damped && !(tolerance >= FINEST) {
        let allowed = "a number in [1e-13, 1e-2] where the rod has damping";
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
