//! `snaprod run SCENE`.
use super::{Ending, Refusal, RunArgs};
pub fn run(_: &RunArgs) -> Result<Ending, Refusal> {
    Ok(Ending::Done)
}
