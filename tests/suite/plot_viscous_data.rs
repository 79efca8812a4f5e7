//! Made-up viscous runs with simple formulas, for tests of their figures and the gallery.

use snaprod::plot::*;
use std::f64::consts::PI;

/// Times on [0, 6], denser around two snaps, and the snaps.
pub fn snap_times(columns: usize) -> (Vec<f64>, [f64; 2]) {
    let snaps = [1.7, 4.1];
    let density = |t: f64| {
        1.0 + snaps
            .map(|s| 0.6 / (0.01 + (t - s).powi(2)))
            .iter()
            .sum::<f64>()
    };
    let fine = 20_000;
    let mut sums = vec![0.0];
    for k in 0..fine {
        let t = 6.0 * (k as f64 + 0.5) / fine as f64;
        sums.push(sums[k] + density(t));
    }
    let total = sums[fine];
    let mut k = 0;
    let time = (0..columns).map(|i| {
        let wanted = total * i as f64 / (columns - 1) as f64;
        while k + 1 < fine && sums[k + 1] < wanted {
            k += 1;
        }
        6.0 * (k as f64 + (wanted - sums[k]) / (sums[k + 1] - sums[k])) / fine as f64
    });
    (time.collect(), snaps)
}

/// A curvature that changes from one shape to the next in layers of width 0.03, and rings in between.
pub fn curvature(t: f64, s: f64) -> f64 {
    let jump = |at: f64| 0.5 * (1.0 + ((t - at) / 0.03).tanh());
    let (a, b) = (jump(1.7), jump(4.1));
    let lower = 3.0 * (0.5 * PI * s).cos() * (1.0 + 0.25 * (2.1 * t).sin());
    let higher = -5.0 * (1.3 * PI * s).cos() * (1.0 + 0.2 * (2.9 * t + 0.4).sin());
    let last = 2.2 * (0.9 * PI * s - 0.5).cos() * (1.0 + 0.3 * (1.7 * t).cos());
    let ringing =
        0.8 * (-0.9 * (t - 1.7).max(0.0)).exp() * a * (9.0 * t).sin() * (3.5 * PI * s).sin();
    lower * (1.0 - a) + higher * a * (1.0 - b) + last * b + ringing
}

/// `columns` x `rows` cells of the curvature and eta kappa_t^2.
pub fn strain_map_data(columns: usize, rows: usize) -> StrainMap {
    let (time, snaps) = snap_times(columns);
    let s: Vec<f64> = (0..rows)
        .map(|j| 0.5 - 0.5 * (PI * (j as f64 + 0.5) / rows as f64).cos())
        .collect();
    let rate = |t: f64, s: f64| (curvature(t + 1e-5, s) - curvature(t - 1e-5, s)) / 2e-5;
    let over = |f: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
        let column = |&t: &f64| s.iter().map(|&s| f(t, s)).collect();
        time.iter().map(column).collect()
    };
    StrainMap {
        strain: over(&curvature),
        dissipation: over(&|t, s| 1e-3 * rate(t, s).powi(2)),
        decades: Some(7.0),
        snaps: snaps.to_vec(),
        time,
        s,
        ..StrainMap::default()
    }
}

/// A rod in transition from q = 1 to q = -1 with a held end.
fn held(q: f64) -> Curve {
    let slope = |s: f64| {
        2.9 * q * (2.0 * s - 3.0 * s * s)
            + 0.34 * (1.0 - q * q) * 3.0 * PI * (3.0 * PI * s).sin() / 3.0
    };
    let n = 120;
    let (mut x, mut y) = (vec![0.0], vec![0.0]);
    for k in 0..n {
        let angle = slope((k as f64 + 0.5) / n as f64).clamp(-1.2, 1.2);
        x.push(x[k] + angle.cos() / n as f64);
        y.push(y[k] + angle.sin() / n as f64);
    }
    let (long, high) = (x[n], y[n]);
    for k in 0..=n {
        let s = k as f64 / n as f64;
        x[k] *= 0.72 / long;
        y[k] += (-0.08 - high) * s * s * (3.0 - 2.0 * s);
    }
    Curve { x, y }
}

/// A snap that releases 10.26.
pub fn layer_data() -> LayerFigure {
    let q = |t: f64| -(0.35 * (t - 14.0)).tanh();
    let run = |eta: f64| {
        let stretched: Vec<f64> = (0..=400).map(|i| 30.0 * f64::from(i) / 400.0).collect();
        let late = 1.4 * eta.powf(1.0 / 3.0);
        let part = |t: f64| 0.5 * (1.0 - q(t - late));
        LayerRun {
            eta,
            elastic: stretched.iter().map(|&t| 13.1 - 10.26 * part(t)).collect(),
            dissipated: stretched.iter().map(|&t| 10.26 * part(t)).collect(),
            stretched,
        }
    };
    LayerFigure {
        fold: held(1.0),
        landing: held(-1.0),
        shapes: [
            4.0, 8.0, 10.0, 11.5, 12.5, 13.5, 14.5, 15.5, 17.0, 19.0, 22.0,
        ]
        .map(|t| DrawnShape {
            time: t,
            axis: held(q(t)),
        })
        .to_vec(),
        runs: vec![run(0.1), run(1e-2), run(1e-4)],
        released: Some(10.26),
        ..LayerFigure::default()
    }
}

/// First order on the sheet, two thirds across folds.
pub fn convergence_data() -> Lines {
    let series = |name: &str, order: f64, size: f64| {
        let eta: Vec<f64> = (2..=16).map(|k| 10f64.powf(-0.5 * f64::from(k))).collect();
        Series {
            name: name.into(),
            y: eta
                .iter()
                .map(|e| size * e.powf(order) * (1.0 + 0.8 * e.powf(1.0 / 3.0)))
                .collect(),
            x: eta,
            trace: LineStyle::LineMarks,
            ..Series::default()
        }
    };
    let slope = |order: f64, name: &str, series: usize| Slope {
        order,
        name: name.into(),
        series: Some(series),
    };
    Lines {
        series: vec![
            series("on the sheet", 1.0, 0.3),
            series("after the first fold", 2.0 / 3.0, 0.9),
            series("after the second fold", 2.0 / 3.0, 3.1),
            series("after the third fold", 2.0 / 3.0, 7.0),
        ],
        slopes: vec![slope(1.0, "1", 0), slope(2.0 / 3.0, "2/3", 1)],
        x_label: "viscosity η (√(EI·μℓ³))".into(),
        y_label: "error of r(1) (ℓ)".into(),
        x_log: true,
        y_log: true,
        ..Lines::default()
    }
}

/// Five snaps at three viscosities.
pub fn losses_data() -> SnapLosses {
    let released = vec![10.263, 6.41, 3.87, 3.52, 1.18];
    let group = |eta: f64, name: &str| LossGroup {
        name: name.into(),
        dissipated: released
            .iter()
            .enumerate()
            .map(|(k, r)| r * (1.0 + (0.9 - 0.35 * k as f64) * eta.powf(2.0 / 3.0)))
            .collect(),
        labels: (1..=5).map(|k| k.to_string()).collect(),
        released: released.clone(),
    };
    SnapLosses {
        groups: vec![
            group(0.1, "η = 0.1"),
            group(1e-2, "η = 0.01"),
            group(1e-4, "η = 10⁻⁴"),
        ],
        ..SnapLosses::default()
    }
}

/// Three snaps, and runs that lose energy in layers and a little between.
pub fn losses_over_time_data() -> LossesOverTime {
    let (snaps, released) = ([1.1, 2.9, 4.4], [10.263, 16.67, 20.54]);
    let run = |eta: f64, name: &str| {
        let time: Vec<f64> = (0..=1200).map(|i| 6.0 * f64::from(i) / 1200.0).collect();
        let late = 0.9 * eta.powf(2.0 / 3.0);
        let mut before = 0.0;
        let sizes = released.map(|r| r - std::mem::replace(&mut before, r));
        let lost = |t: f64| -> f64 {
            let layer = |k: usize| {
                let stretched = (t - snaps[k] - late) / (2.0 * eta);
                0.5 * sizes[k] * (1.0 + stretched.tanh())
            };
            (0..3).map(layer).sum::<f64>() + 3.0 * eta * t
        };
        Series {
            name: name.into(),
            y: time.iter().map(|&t| lost(t)).collect(),
            x: time,
            ..Series::default()
        }
    };
    LossesOverTime {
        snaps: snaps.to_vec(),
        released: released.to_vec(),
        runs: vec![
            run(0.1, "dissipated, η = 0.1"),
            run(0.01, "dissipated, η = 0.01"),
            run(1e-3, "dissipated, η = 10⁻³"),
        ],
        ..LossesOverTime::default()
    }
}

/// Standard linear solids with one or two times.
pub fn kernel_data() -> KernelFigure {
    let time: Vec<f64> = (0..=240)
        .map(|i| 10f64.powf(-4.0 + f64::from(i) * 7.0 / 240.0))
        .collect();
    let curve = |name: &str, relaxed: f64, parts: &[(f64, f64)]| {
        let decay = |t: f64| {
            parts
                .iter()
                .map(|(e, tau)| e * (-t / tau).exp())
                .sum::<f64>()
        };
        KernelCurve {
            name: name.into(),
            values: time.iter().map(|&t| relaxed + decay(t)).collect(),
            instantaneous: Some(relaxed + parts.iter().map(|p| p.0).sum::<f64>()),
            relaxed: Some(relaxed),
        }
    };
    KernelFigure {
        relaxation: vec![
            curve("m₁–φ₁ (EI/ℓ)", 4.0, &[(2.5, 0.02), (1.2, 1.5)]),
            curve("n₂–r₂ (EI/ℓ³)", 12.0, &[(5.0, 0.05), (3.0, 4.0)]),
            curve("m₁–r₂ (EI/ℓ²)", -6.0, &[(-2.8, 0.03), (-1.6, 2.5)]),
        ],
        creep: vec![
            curve("m₁–φ₁ (EI/ℓ)", 1.0, &[(-0.30, 0.03), (-0.17, 2.2)]),
            curve("n₂–r₂ (EI/ℓ³)", 1.0 / 3.0, &[(-0.09, 0.08), (-0.06, 5.0)]),
            curve("m₁–r₂ (EI/ℓ²)", 0.5, &[(-0.13, 0.04), (-0.09, 3.0)]),
        ],
        time,
        creep_label: "creep function (inverse units)".into(),
        ..KernelFigure::default()
    }
}
