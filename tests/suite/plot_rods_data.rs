//! Made-up rods and branches with simple formulas, for tests of their figures and the gallery.

use snaprod::plot::*;
use std::f64::consts::{PI, TAU};

type Point = [f64; 3];

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: Point) -> Point {
    let length = dot(a, a).sqrt();
    a.map(|c| c / length)
}

/// A rod along a curve over [0, 1], with directors carried along it and turned by `twist` in all.
pub fn along(n: usize, twist: f64, f: impl Fn(f64) -> Point) -> SpaceRod {
    let h = 1e-5;
    let mut rod = SpaceRod::default();
    let mut normal = [0.31, -0.2, 0.93];
    for i in 0..n {
        let t = i as f64 / (n - 1) as f64;
        let (a, b) = (f(t - h), f(t + h));
        let d3 = unit([b[0] - a[0], b[1] - a[1], b[2] - a[2]]);
        let off = dot(normal, d3);
        normal = unit(std::array::from_fn(|k| normal[k] - off * d3[k]));
        let other = cross(d3, normal);
        let (s, c) = (twist * t).sin_cos();
        let d1: Point = std::array::from_fn(|k| c * normal[k] + s * other[k]);
        rod.points.push(f(t));
        rod.directors.push([d1, cross(d3, d1), d3]);
    }
    rod
}

pub fn helix(turns: f64, n: usize) -> SpaceRod {
    along(n, 0.0, move |t| {
        let (s, c) = (TAU * turns * t).sin_cos();
        [0.16 * c - 0.16, 0.16 * s, 0.75 * t]
    })
}

/// An open trefoil: a centreline that passes over and under itself.
pub fn knot() -> SpaceRod {
    along(240, 2.0 * TAU, |t| {
        let a = 0.75 + TAU * 0.87 * t;
        [
            0.16 * (a.sin() + 2.0 * (2.0 * a).sin()),
            0.16 * (a.cos() - 2.0 * (2.0 * a).cos()),
            -0.16 * (3.0 * a).sin(),
        ]
    })
}

/// theta(s) = top sin(pi s / 2), in the plane spanned by axes u (at the clamp) and v.
pub fn bent(top: f64, u: usize, v: usize) -> SpaceRod {
    let n = 101;
    let (mut a, mut b) = (0.0, 0.0);
    let mut rod = SpaceRod::default();
    let h = 1.0 / (n - 1) as f64;
    for i in 0..n {
        let mut p = [0.0; 3];
        (p[u], p[v]) = (a, b);
        rod.points.push(p);
        let (s, c) = (top * (0.5 * PI * (i as f64 + 0.5) * h).sin()).sin_cos();
        (a, b) = (a + h * c, b + h * s);
    }
    rod
}

pub fn ring() -> SpaceRod {
    along(161, 0.0, |t| {
        let (s, c) = (TAU * t).sin_cos();
        [s / TAU, 0.0, (1.0 - c) / TAU]
    })
}

/// Shapes along a branch in the plane x z, two of them unstable.
pub fn family() -> RodShapes {
    let rods = (0..8)
        .map(|i| {
            let load = 2.5 + 0.8 * i as f64;
            SpaceRod {
                value: Some(load),
                unstable: i == 3 || i == 4,
                ..bent(0.45 * i as f64, 0, 2)
            }
        })
        .collect();
    RodShapes {
        rods,
        value_label: "end force (EI/ℓ²)".into(),
        ..RodShapes::default()
    }
}

/// Shapes that leave the plane, coloured by twist.
pub fn twisted_family() -> RodShapes {
    let rods = (0..7)
        .map(|i| {
            let k = i as f64 / 6.0;
            let rod = along(141, 0.0, move |t| {
                let w = 0.35 * k * (1.0 - (TAU * t).cos()) / 2.0;
                let (s, c) = (TAU * 1.5 * k * t).sin_cos();
                [t * (1.0 - 0.45 * k), w * s * 1.3, w * c]
            });
            SpaceRod {
                directors: Vec::new(),
                value: Some(360.0 * k),
                unstable: i > 4,
                ..rod
            }
        })
        .collect();
    RodShapes {
        rods,
        value_label: "end rotation (deg)".into(),
        ..RodShapes::default()
    }
}

pub fn one(rod: SpaceRod, ribbon: f64) -> RodShapes {
    RodShapes {
        rods: vec![rod],
        ribbon,
        ..RodShapes::default()
    }
}

/// A state with smooth made-up loads; n2, v1 and v2 vanish.
pub fn state() -> RodState {
    let rod = helix(1.25, 161);
    let n = rod.points.len();
    let s: Vec<f64> = (0..n).map(|i| i as f64 / (n - 1) as f64).collect();
    let over = |f: &dyn Fn(f64) -> Point| s.iter().map(|&s| f(s)).collect::<Vec<Point>>();
    RodState {
        title: "Equilibrium 12 of branch 2".into(),
        rod,
        ribbon: 0.05,
        end_force: Some([0.0, 1.5, -14.8]),
        end_couple: Some([2.0, 1.0, 3.1]),
        couples: over(&|s| [6.0 * (7.0 * s).cos(), 6.0 * (7.0 * s).sin(), 2.0]),
        forces: over(&|s| [3.0 * (7.0 * s).sin(), 1e-14 * (300.0 * s).sin(), -14.0 - s]),
        curvatures: over(&|s| [6.0 * (7.0 * s).cos(), 6.0 * (7.0 * s).sin(), 2.5]),
        stretches: over(&|s| [0.0, 0.0, 1.0 - 0.01 * (1.0 + s)]),
        s,
        ..RodState::default()
    }
}

/// Another: plane, inextensible, pulled; most components vanish.
pub fn plane_state() -> RodState {
    let rod = bent(1.9, 0, 1);
    let n = rod.points.len();
    let s: Vec<f64> = (0..n).map(|i| i as f64 / (n - 1) as f64).collect();
    let over = |f: &dyn Fn(f64) -> Point| s.iter().map(|&s| f(s)).collect::<Vec<Point>>();
    RodState {
        rod,
        end_force: Some([-2.0, 3.0, 0.0]),
        end_couple: Some([0.0; 3]),
        couples: over(&|s| [3e-13, 3.0 * (0.5 * PI * s).cos(), 0.0]),
        forces: over(&|s| [3.0 * (2.0 * s).cos(), 0.0, 3.0 * (2.0 * s).sin()]),
        curvatures: over(&|s| [0.0, 3.0 * (0.5 * PI * s).cos(), 0.0]),
        stretches: over(&|_| [0.0, 0.0, 1.0]),
        s,
        ..RodState::default()
    }
}

fn branch(name: &str, colour: usize, points: Vec<(f64, f64, Option<usize>)>) -> BranchLine {
    BranchLine {
        name: name.into(),
        x: points.iter().map(|p| p.0).collect(),
        y: points.iter().map(|p| p.1).collect(),
        index: points.iter().map(|p| p.2).collect(),
        colour: Some(colour),
    }
}

fn special(x: f64, y: f64, kind: SpecialKind, label: &str) -> Special {
    Special {
        x,
        y,
        kind,
        label: label.into(),
    }
}

/// Two pitchforks off a straight state (at x = 2.5 and 6); the first turns back at two folds, x(a) = 2.5 +
/// 12 a^2 - 30 a^4 + 20 a^6, a in [0, 1.05]; index unknown on the second beyond a = 0.4.
pub fn pitchfork_panel() -> BranchPanel {
    let x1 = |a: f64| 2.5 + 12.0 * a.powi(2) - 30.0 * a.powi(4) + 20.0 * a.powi(6);
    // x1' = 24 a - 120 a^3 + 120 a^5 = 0.
    let fold = |sign: f64| ((5.0 + sign * 5f64.sqrt()) / 10.0).sqrt();
    let (f1, f2) = (fold(-1.0), fold(1.0));
    let index = |a: f64| match a.abs() {
        a if a < f1 => Some(0),
        a if a < f2 => Some(1),
        _ => Some(0),
    };
    let straight: Vec<_> = (0..=90)
        .map(|i| {
            let x = 0.1 * i as f64;
            let index = usize::from(x > 2.5) + usize::from(x > 6.0);
            (x, 0.0, Some(index))
        })
        .collect();
    let mut panel = BranchPanel {
        y_label: "deflection x(1) (ℓ)".into(),
        branches: vec![branch("straight", 6, straight)],
        specials: vec![
            special(2.5, 0.0, SpecialKind::BranchPoint, "BP1"),
            special(6.0, 0.0, SpecialKind::BranchPoint, "BP2"),
        ],
        ..BranchPanel::default()
    };
    for sign in [1.0, -1.0] {
        let arm = (0..=105).map(|i| 0.0101 * i as f64);
        let arm = arm.map(|a| (x1(a), sign * 0.7 * a, index(a))).collect();
        panel.branches.push(branch("first mode", 0, arm));
        let ends = if sign > 0.0 {
            ["LP1", "LP3", "EP1"]
        } else {
            ["LP2", "LP4", "EP2"]
        };
        for (label, a) in [(ends[0], f1), (ends[1], f2)] {
            panel
                .specials
                .push(special(x1(a), sign * 0.7 * a, SpecialKind::Fold, label));
        }
        let a = 0.0101 * 105.0;
        let last = special(x1(a), sign * 0.7 * a, SpecialKind::End, ends[2]);
        panel.specials.push(last);
        let second = (0..=60).map(|i| 0.01 * i as f64);
        let second = second
            .map(|a| {
                let index = match a {
                    a if a < 0.2 => Some(2),
                    a if a < 0.4 => Some(3),
                    _ => None,
                };
                (6.0 + 8.0 * a * a, sign * 0.7 * a, index)
            })
            .collect();
        panel.branches.push(branch("second mode", 1, second));
        let change = special(
            6.0 + 8.0 * 0.04,
            sign * 0.14,
            SpecialKind::StabilityChange,
            if sign > 0.0 { "SC1" } else { "SC2" },
        );
        panel.specials.push(change);
    }
    panel
}

pub fn pitchfork() -> BranchDiagram {
    BranchDiagram {
        x_label: "end force λ² (EI/ℓ²)".into(),
        panels: vec![pitchfork_panel()],
        ..BranchDiagram::default()
    }
}

/// The pitchfork diagram with an additional panel of energies above.
pub fn pitchfork_energy() -> BranchDiagram {
    let below = pitchfork_panel();
    let energy = |x: f64, y: f64| 4.0 * y * y + 0.06 * x * y.abs();
    let mut above = below.clone();
    above.y_label = "energy (EI/ℓ)".into();
    for branch in &mut above.branches {
        branch.y = branch
            .x
            .iter()
            .zip(&branch.y)
            .map(|(x, y)| energy(*x, *y))
            .collect();
    }
    for special in &mut above.specials {
        special.y = energy(special.x, special.y);
    }
    // By symmetry one branch of each pair is enough.
    above.branches.truncate(3);
    above
        .specials
        .retain(|s| !["LP2", "LP4", "EP2", "SC2"].contains(&s.label.as_str()));
    BranchDiagram {
        title: "Clamped rod under a dead end force".into(),
        panels: vec![above, below],
        ..pitchfork()
    }
}
