//! What strain rates that no node holds enter by.

use super::rod::{HeavyRod, Moving};
use crate::section::Strain;
use std::f64::consts::PI;

impl HeavyRod {
    /// For each strain the time in which its rate, in the shortest wave that the nodes hold, makes a strain of its size, 1/omega, and that in which friction answers it with
    /// the stress of such a strain, D/K; both together, the longest along the rod. None outside the law's domain.
    ///
    /// Waves of wave number k: omega^2 = K k^4/(mu + J k^2) of bending, K k^2/J of torsion, K k^2/mu of shear and stretch; mu and J are mass and inertia per length.
    pub fn delays(&self, at: &Moving) -> Option<Strain> {
        let (grid, law) = (&self.sections.grid, &self.given.law);
        let mass = self.given.mass / law.length();
        let mut longest = Strain::zeros();
        for element in grid.elements() {
            let nodes = element.nodes();
            let length = (element.to() - element.from()) * law.length();
            let square = (length / (PI * nodes.len() as f64)).powi(2);
            for node in nodes {
                let s = grid.nodes()[node];
                let section = law.stiffness(s, &at.strains[node], &at.rates[node])?;
                for a in 0..6 {
                    let turned = match self.given.rotary {
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
                    let delay = swing + section.by_rate[(a, a)] / stiffness;
                    // A section that is not stiff has none.
                    let delay = if delay >= 0.0 { delay } else { f64::INFINITY };
                    longest[a] = longest[a].max(delay);
                }
            }
        }
        Some(longest)
    }
}
