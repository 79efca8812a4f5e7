//! Time scales (1/omega, D/K) of the shortest wave on the grid: how much unresolved strain rates can change the
//! motion.

use super::rod::{HeavyRod, RodState};
use crate::section::Strain;
use std::f64::consts::PI;

impl HeavyRod {
    /// For each strain two times by which an unresolved rate acts, in the shortest wave on the grid: on the motion,
    /// and on the energy. Both are the longest along the rod. None outside the law's domain.
    ///
    /// A rate has the energy of the strain rate/omega: the second time is 1/omega. It makes the strain
    /// rate/(omega + omega^2 D/K), since friction D stops a wave before it swings if omega D/K > 1. Nodes that leave
    /// the rate out change the motion by the product of both strains: the first time is the root of that product over
    /// the rate. Waves of wave number k: omega^2 = K k^4/(mu + J k^2) of bending, K k^2/J of torsion, K k^2/mu of
    /// shear and stretch; mu and J are mass and inertia per length.
    ///
    /// A section without moment, as at a free end, creeps: its rate is -(K/D) times its strain, so that friction
    /// cancels the elastic moment. Such rates are as large as friction is small, in a layer that no nodes resolve at
    /// first.
    pub fn delays(&self, at: &RodState) -> Option<[Strain; 2]> {
        let (grid, law) = (&self.sections.grid, &self.given.law);
        let mass = self.given.mass / law.length();
        let mut longest = [Strain::zeros(); 2];
        for element in grid.elements() {
            let nodes = element.nodes();
            let length = (element.to() - element.from()) * law.length();
            let square = (length / (PI * nodes.len() as f64)).powi(2);
            for node in nodes {
                let s = grid.nodes()[node];
                let (mass, rotary) = (mass * self.given.density(s), self.given.rotary_at_nodes(s));
                let section = self
                    .law(at)
                    .stiffness(s, &at.strains[node], &at.rates[node])?;
                for a in 0..6 {
                    let turned = match rotary {
                        Some(inertia) if a < 3 => inertia[(a, a)],
                        _ => 0.0,
                    };
                    let moved = match a {
                        0 | 1 => mass * square,
                        2 => 0.0,
                        _ => mass,
                    };
                    let stiffness = section.by_strain[(a, a)];
                    let swing = ((turned + moved) * square / stiffness).sqrt();
                    let friction = section.by_rate[(a, a)] / stiffness;
                    let moves = if swing == 0.0 {
                        0.0
                    } else {
                        swing * (swing / (swing + friction)).sqrt()
                    };
                    for (longest, delay) in longest.iter_mut().zip([moves, swing]) {
                        // A section without positive stiffness has no such wave.
                        let delay = if delay >= 0.0 { delay } else { f64::INFINITY };
                        longest[a] = longest[a].max(delay);
                    }
                }
            }
        }
        Some(longest)
    }
}
