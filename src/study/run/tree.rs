//! The tree of runs that grows where landings fork.

use crate::error::Result;
use crate::motion::{Motion, Outcome, Snap};
use std::collections::VecDeque;

/// Where a run of a tree comes from.
#[derive(Debug, Clone)]
pub struct Stem {
    /// Its number, in the order in which the runs are followed; 0 is the trunk.
    pub id: usize,
    /// The run it forks from.
    pub parent: Option<usize>,
    /// The snap by which it was entered.
    pub entered: Option<Snap>,
}

/// Follows `trunk` and every run into which it branches, `most` whole ones at most: the records, each after its parent's, and how many
/// runs were cut.
///
/// # Errors
/// Those of `follow`; a branch that cannot begin.
pub fn tree<'a, B>(
    trunk: Box<dyn Motion<'a> + 'a>,
    most: usize,
    mut follow: impl FnMut(Stem, &mut dyn Motion<'a>) -> Result<(B, Outcome)>,
) -> Result<(Vec<B>, usize)> {
    let mut waiting = VecDeque::from([(None, None, trunk)]);
    let (mut branches, mut whole, mut cut) = (Vec::new(), 0, 0);
    while let Some((parent, entered, mut motion)) = waiting.pop_front() {
        let id = branches.len();
        let stem = Stem {
            id,
            parent,
            entered,
        };
        let (branch, outcome) = follow(stem, &mut *motion)?;
        match &outcome {
            Outcome::Branched(snaps) => {
                for snap in snaps {
                    // The bound counts whole runs: a fork replaces one by several.
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
