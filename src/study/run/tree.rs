//! Tree of runs that fork at landings.

use crate::error::Result;
use crate::motion::{Motion, Outcome, Snap};
use std::collections::VecDeque;

/// Origin of a run in the tree.
#[derive(Debug, Clone)]
pub struct BranchOrigin {
    /// Number in the order in which runs are followed; 0 is the trunk.
    pub id: usize,
    /// Number of the parent run.
    pub parent: Option<usize>,
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
    let mut waiting = VecDeque::from([(None, None, trunk)]);
    let (mut branches, mut whole, mut cut) = (Vec::new(), 0, 0);
    while let Some((parent, entered, mut motion)) = waiting.pop_front() {
        let id = branches.len();
        let stem = BranchOrigin {
            id,
            parent,
            entered,
        };
        let (branch, outcome) = follow(stem, &mut *motion)?;
        match &outcome {
            Outcome::Branched(snaps) => {
                for snap in snaps {
                    // The bound counts whole runs: a fork replaces one run by several.
                    if whole + waiting.len() < most {
                        waiting.push_back((Some(id), Some(snap.clone()), motion.branch(snap)?));
                    } else {
                        cut += 1;
                    }
                }
            }
            _ => whole += 1,
        }
        branches.push(branch);
    }
    Ok((branches, cut))
}
