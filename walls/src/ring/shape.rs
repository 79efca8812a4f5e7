//! Outlines of sections: points of the wall from lobe to lobe.
//!
//! With the angle theta of the tangent from the tip of a lobe on, forces give the place of the wall without a further
//! integration: P r.t = kappa'/nu, P r.n = N about the centre of the forces (docs/tubes.md 1).

use super::lobe::Lobe;
use super::{Section, Wall};
use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;
use std::f64::consts::PI;

impl Section {
    /// Points of half a lobe at `count` >= 2 equal steps of unstretched arclength, from the tip (x, 0) to the middle
    /// between two lobes. In contact along a line the last points lie on the line. Lengths are in R.
    pub fn half_lobe(&self, count: usize) -> Vec<[f64; 2]> {
        let last = count.max(2) - 1;
        let share = PI / f64::from(self.mode);
        let (lobe, scale) = match self.wall {
            Wall::Round { radius } => {
                let point = |k: usize| share * k as f64 / last as f64;
                let place = |angle: f64| [radius * angle.cos(), radius * angle.sin()];
                return (0..=last).map(|k| place(point(k))).collect();
            }
            Wall::Lobed { lobe, scale } => (lobe, scale),
        };
        let rule = Rule::new(48);
        let whole = lobe.integrals(&rule).length;
        let along = |end: f64| Lobe { end, ..lobe }.integrals(&rule).length;
        let point = |k: usize| {
            let arc = share * k as f64 / last as f64 / scale;
            if arc > whole && scale < 1.0 {
                return [(share - arc * scale).max(0.0), 0.0];
            }
            let off = |end: f64| along(end) - arc;
            let root = chandrupatla(off, (0.0, -arc), (lobe.end, whole - arc), 0.0);
            let [x, y] = place(&lobe, &rule, root.unwrap_or(lobe.end));
            [
                x * scale + self.tip - scale * place(&lobe, &rule, 0.0)[0],
                y * scale,
            ]
        };
        (0..=last).map(point).collect()
    }

    /// The whole outline, closed, with `count` >= 2 points on each half of a lobe. Lengths are in R.
    pub fn outline(&self, count: usize) -> Vec<[f64; 2]> {
        let half = self.half_lobe(count);
        let mut outline = Vec::with_capacity(2 * half.len() * self.mode as usize + 1);
        for k in 0..self.mode {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(self.mode)).sin_cos();
            let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
            // From the trough before the tip to the tip, then to the trough after it, which the next lobe repeats.
            outline.extend(half[1..].iter().rev().map(|[x, y]| turned([*x, -y])));
            outline.extend(half[..half.len() - 1].iter().map(|point| turned(*point)));
        }
        outline.push(outline[0]);
        outline
    }
}

/// Place at the angle `phi`, seen from the centre of the forces.
fn place(lobe: &Lobe<f64>, rule: &Rule, phi: f64) -> [f64; 2] {
    let at = lobe.place(phi);
    let turn = Lobe { end: phi, ..*lobe }.integrals(rule).turn;
    let shear = -lobe.d * phi.sin() * at.speed;
    let pressure = lobe.pressure();
    let (sin, cos) = turn.sin_cos();
    [
        (-shear * sin - at.pull * cos) / pressure,
        (shear * cos - at.pull * sin) / pressure,
    ]
}
