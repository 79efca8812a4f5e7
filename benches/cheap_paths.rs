//! Time ratios of cheap computation paths to the general one, on the scenes that the tests compare:
//! `cargo bench --bench cheap_paths`.

#[path = "../tests/suite/pairs.rs"]
mod pairs;

use pairs::{end, pairs};
use std::time::Instant;

/// Runs of each; the fastest counts.
const RUNS: usize = 9;

fn main() {
    println!("| left out | ends apart | right-hand sides | ms | by the general path | ms | gain |");
    println!("|---|---|---|---|---|---|---|");
    for pair in pairs() {
        let mut best = [f64::INFINITY; 2];
        // The two scenes alternate, to spread other load of the machine over both.
        for _ in 0..RUNS {
            for (best, scene) in best.iter_mut().zip([&pair.cheap, &pair.general]) {
                let begun = Instant::now();
                end(scene);
                *best = best.min(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
        let ((cheap, few), (general, many)) = (end(&pair.cheap), end(&pair.general));
        println!(
            "| {} | {:.0e} | {few} | {:.2} | {many} | {:.2} | {:.1} |",
            pair.leaves_out,
            (cheap - general).norm(),
            best[0],
            best[1],
            best[1] / best[0]
        );
    }
}
