//! Waves in a bar with a heavy end, by both of its schemes.

use crate::problems::{DATA, Problem, Ran, counts, plane};
use crate::support::{json, number, rows};
use snaprod::bar::{self, Bar, BarMotion as _, End, FiniteVolumes, Material, Spectral, Stress};
use snaprod::body::History;
use std::time::Instant;

/// A bar of a fifth of the mass at its end, pushed by a smooth force for two units of time.
fn pushed() -> Bar {
    let force = |t: f64| {
        let inside = t > 0.0 && t < 2.0;
        let bump = |u: f64| 0.6 * (4.0 - 1.0 / (u * (1.0 - u))).exp();
        [if inside { bump(t / 2.0) } else { 0.0 }, 0.0, 0.0]
    };
    let force = History::custom(force, vec![0.0, 2.0]);
    let law = Material::new(&Stress::NeoHookean(1.0 / 6.0), 0.2).expect("a law");
    let ends = [End::Wall, End::Mass { mass: 1.0, force }];
    Bar::new(law, 1.0, 1.0, ends).expect("a bar")
}

/// A bar of the library with the given scheme; scenes admit no user-defined load history.
fn bar<M: bar::BarMotion + 'static>(
    key: &'static str,
    title: &'static str,
    settings: &[usize],
    scheme: impl Fn(&Bar, usize) -> M + 'static,
    work: fn(&M) -> Option<u64>,
) -> Problem {
    let data = json("waves/heavy_mass_given.json");
    let last = rows(&rows(&data, "pde", 4)[0], "states", 6)
        .last()
        .expect("a state");
    let duration = number(last, "t");
    let run = move |count: f64| {
        let mut motion = scheme(&pushed(), count as usize);
        let clock = Instant::now();
        motion.advance(duration).expect("a run to the end");
        let ms = clock.elapsed().as_secs_f64() * 1e3;
        let end = motion.snapshot().ends[1];
        Ran {
            end: plane(&[end.position, 0.0, end.velocity, 0.0]),
            work: work(&motion),
            ms,
        }
    };
    Problem {
        key,
        title,
        settings: counts(settings),
        reference: plane(&[number(last, "r"), 0.0, number(last, "v"), 0.0]),
        source: DATA,
        floor: 1e-11,
        compute: Box::new(run),
    }
}

pub fn volumes() -> Problem {
    let scheme = |bar: &Bar, cells| FiniteVolumes::new(bar, cells).expect("cells");
    // Three right-hand sides of the whole bar a step.
    let work = |volumes: &FiniteVolumes| {
        let cells = volumes.snapshot().x.len() as u64;
        Some(3 * volumes.updates() / cells)
    };
    let title = "bar, finite volumes";
    bar("volumes", title, &[80, 160, 320, 640], scheme, work)
}

pub fn spectral() -> Problem {
    let scheme = |bar: &Bar, nodes| Spectral::new(bar, nodes, 1e-13).expect("nodes");
    bar(
        "spectral",
        "bar, spectral element",
        &[4, 6, 8, 12, 16, 24],
        scheme,
        |_| None,
    )
}
