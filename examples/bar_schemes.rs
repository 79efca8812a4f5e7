//! Stress in a bar under a sine load after the wave has broken: the schemes of the thesis and finite volumes, 60
//! cells.
//!
//! Draws the stress along the bar to the SVG file named, if any: each scheme in a panel of its own, under the solution
//! with finer cells.
//!
//! cargo run --release --example bar_schemes -- figures/bar_schemes.svg

use snaprod::bar::{Bar, End, Material, Scheme, Snapshot, Stress, motion};
use snaprod::body::History;
use snaprod::plot::{Lines, Paper, Series, small_multiples};
use std::f64::consts::TAU;

const LENGTH: f64 = 3.0;
const TIME: f64 = 0.003;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rubber = Material::new(&Stress::Mooney(24.0, 1.5), 1e-4)?;
    let sine = End::Loaded(History::sine(1.7, TAU / 0.002, 0.0));
    let bar = Bar::new(rubber, LENGTH, 0.0314, [End::Wall, sine])?;
    let state = |scheme, cells, step| -> snaprod::Result<Snapshot> {
        let mut motion = motion(&bar, scheme, cells, step, true)?;
        // None of these ends short by 3 ms.
        let _ = motion.advance(TIME);
        Ok(motion.snapshot())
    };
    let fine = state(Scheme::FiniteVolume, 1920, None)?;
    let mut panels = Vec::new();
    for scheme in Scheme::ALL {
        if scheme == Scheme::Spectral {
            continue;
        }
        let step = (scheme != Scheme::FiniteVolume).then_some(2e-6);
        let coarse = state(scheme, 60, step)?;
        let off = gap(&coarse, &fine);
        println!("{:20} mean error of the stress {off:.2} psi", scheme.name());
        match scheme {
            Scheme::FiniteVolume => assert!(off < 1.5),
            Scheme::StretchSequential => assert!(off < 4.0),
            _ => assert!(off > 5.0),
        }
        panels.push(Lines {
            title: format!("{} ({off:.1})", scheme.name()),
            x_label: "X (in)".to_owned(),
            y_label: "stress (psi)".to_owned(),
            // The reference is drawn last, on top.
            series: vec![
                drawn("60 elements", &coarse, 4),
                drawn("finite-volume, 1920 cells", &fine, 0),
            ],
            ..Lines::default()
        });
    }
    if let Some(path) = std::env::args().nth(1) {
        let title = "Stress at 3 ms, dt = 2e-6 s (mean error, psi)";
        std::fs::write(path, small_multiples(title, &panels, &Paper::SCREEN)?)?;
    }
    Ok(())
}

fn drawn(name: &str, state: &Snapshot, colour: usize) -> Series {
    Series {
        name: name.to_owned(),
        x: state.x.clone(),
        y: state.stress.clone(),
        colour: Some(colour),
        ..Series::default()
    }
}

/// Mean absolute difference of the stress from that of finer cells, over all points.
fn gap(state: &Snapshot, fine: &Snapshot) -> f64 {
    let (n, h) = (fine.x.len(), LENGTH / 60.0);
    let place = |x: f64| ((x / LENGTH * n as f64).round() as usize).min(n);
    let gaps = state.x.iter().zip(&state.stress).map(|(x, stress)| {
        let cells = &fine.stress[place((x - 0.5 * h).max(0.0))..place(x + 0.5 * h)];
        (stress - cells.iter().sum::<f64>() / cells.len() as f64).abs()
    });
    gaps.sum::<f64>() / state.x.len() as f64
}
