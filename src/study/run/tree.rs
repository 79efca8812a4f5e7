//! Tree of runs that fork at landings.

use crate::error::Result;
use crate::motion::{Motion, Outcome, Snap};
use std::collections::VecDeque;

/// Origin of a run in the tree, in the units of the motion.
#[derive(Debug, Clone)]
pub struct BranchOrigin {
    /// Number in the order in which runs are followed; 0 is the trunk.
    pub id: usize,
    /// Number of the parent run.
    pub parent: Option<usize>,
    /// Number among the runs in which the parent forks.
    pub fork: usize,
    /// Snap at which the run begins.
    pub entered: Option<Snap>,
}

/// Follows `trunk` and all its forks, at most `most` whole runs. Returns the records, each after its parent's, and
/// the number of runs cut.
///
/// # Errors
/// Those of `follow`; a branch that cannot begin.
pub fn tree<'a, B>(
    trunk: Box<dyn Motion<'a> + 'a>,
    most: usize,
    mut follow: impl FnMut(BranchOrigin, &mut dyn Motion<'a>) -> Result<(B, Outcome)>,
) -> Result<(Vec<B>, usize)> {
    let root = BranchOrigin {
        id: 0,
        parent: None,
        fork: 0,
        entered: None,
    };
    let mut waiting = VecDeque::from([(root, trunk)]);
    let (mut branches, mut whole, mut cut) = (Vec::new(), 0, 0);
    while let Some((origin, mut motion)) = waiting.pop_front() {
        let id = branches.len();
        let (branch, outcome) = follow(BranchOrigin { id, ..origin }, &mut *motion)?;
        branches.push(branch);
        let Outcome::Branched(snaps) = outcome else {
            whole += 1;
            continue;
        };
        for (fork, snap) in snaps.iter().enumerate() {
            // The bound counts whole runs: a fork replaces one run by several.
            if whole + waiting.len() >= most {
                cut += 1;
                continue;
            }
            let origin = BranchOrigin {
                id,
                parent: Some(id),
                fork,
                entered: Some(snap.clone()),
            };
            waiting.push_back((origin, motion.branch(snap)?));
        }
    }
    Ok((branches, cut))
}
