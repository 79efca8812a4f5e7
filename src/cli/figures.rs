//! Figures of a run, from what was recorded.
