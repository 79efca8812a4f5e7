//! Whether rods are long enough for what they join.

use super::{Assembly, Attachment, On, Place};
use crate::error::{Error, Message, Quantity, Result};
use nalgebra::DMatrix;

/// Rods that reach their places but for this part of the way are held to be straight between them.
const STRAIGHT: f64 = 1e-9;

/// Rods and bodies that join an end of one rod to one of another.
struct Chain {
    rods: [usize; 2],
    /// How far these ends are from each other.
    apart: f64,
    /// How far they could be; infinite where nothing holds them.
    reach: f64,
}

impl Assembly {
    /// Looks whether the rods can join what they should, before equilibria are looked for: a rod that can be neither stretched nor sheared
    /// ends within its length, so that a chain of such rods and of bodies reaches no farther than the sum of their lengths and of the
    /// distances between the places of attachment.
    ///
    /// # Errors
    /// Two ends of rods that stand in the ground, or on supports where these are at t = 0, farther apart than that.
    pub fn within_reach(&self) -> Result<()> {
        let chains = self.chains()?;
        let short = chains
            .iter()
            .find(|chain| chain.apart > chain.reach * (1.0 + STRAIGHT));
        short.map_or(Ok(()), |chain| Err(self.too_short(chain)))
    }

    /// The first rod that is shorter than its ends are apart where the bodies are here, and can be neither stretched nor sheared.
    ///
    /// # Errors
    /// Those of the sections of the rods.
    pub fn overdrawn(&self, bodies: &[Place]) -> Result<Option<usize>> {
        for (k, link) in self.links().iter().enumerate() {
            let [base, tip] = [&link.from, &link.to].map(|end| end.at(0.0, bodies).pose);
            let apart = (base.translation.vector - tip.translation.vector).norm();
            if link.rod.is_inextensible()? && apart > link.rod.length() * (1.0 + STRAIGHT) {
                return Ok(Some(k));
            }
        }
        Ok(None)
    }

    /// Why no load across can be borne, if a chain is drawn straight between places that do not move: its force would be infinite.
    pub(super) fn drawn_straight(&self) -> Option<Error> {
        let chains = self.chains().ok()?;
        let drawn = |chain: &&Chain| {
            chain.reach.is_finite() && chain.apart >= chain.reach * (1.0 - STRAIGHT)
        };
        let [one, other] = chains
            .iter()
            .find(drawn)?
            .rods
            .map(|rod| self.rod_name(rod));
        Some(Error::ill_conditioned(format!(
            "what joins those ends of {one} and {other} that do not move is drawn straight and cannot be stretched: it bears no load across it; give longer \
             rods, or rods that stretch (an axial stiffness)"
        )))
    }

    /// What joins any two ends that stand.
    fn chains(&self) -> Result<Vec<Chain>> {
        let ends = self.links().iter();
        let ends: Vec<&Attachment> = ends.flat_map(|link| [&link.from, &link.to]).collect();
        let n = ends.len();
        let mut reach = DMatrix::from_element(n, n, f64::INFINITY);
        let mut joined = |i: usize, j: usize, way: f64| {
            let shorter = way.min(reach[(i, j)]);
            (reach[(i, j)], reach[(j, i)]) = (shorter, shorter);
        };
        for (k, link) in self.links().iter().enumerate() {
            if link.rod.is_inextensible()? {
                joined(2 * k, 2 * k + 1, link.rod.length());
            }
        }
        for i in 0..n {
            for j in 0..i {
                if let (On::Body(a), On::Body(b)) = (&ends[i].on, &ends[j].on)
                    && a == b
                {
                    let [a, b] = [i, j].map(|end| ends[end].place.translation.vector);
                    joined(i, j, (a - b).norm());
                }
            }
        }
        // The shortest ways from end to end over all others (Floyd, Warshall).
        for over in 0..n {
            for i in 0..n {
                for j in 0..n {
                    let way = reach[(i, over)] + reach[(over, j)];
                    if way < reach[(i, j)] {
                        reach[(i, j)] = way;
                    }
                }
            }
        }
        let standing: Vec<usize> = (0..n)
            .filter(|i| !matches!(ends[*i].on, On::Body(_)))
            .collect();
        let mut chains = Vec::new();
        for (k, &i) in standing.iter().enumerate() {
            for &j in &standing[k + 1..] {
                let [a, b] = [i, j].map(|end| ends[end].at(0.0, &[]).pose.translation.vector);
                chains.push(Chain {
                    rods: [i / 2, j / 2],
                    apart: (a - b).norm(),
                    reach: reach[(i, j)],
                });
            }
        }
        Ok(chains)
    }

    fn too_short(&self, &Chain { rods, apart, reach }: &Chain) -> Error {
        let [one, other] = rods.map(|rod| self.rod_name(rod));
        let words = match one == other {
            true => format!("{one} is too short: its ends are held "),
            false => {
                format!(
                    "the rods are too short: those ends of {one} and {other} that do not move are "
                )
            }
        };
        Error::domain(
            Message::from(words)
                .number(apart, Quantity::Length)
                .words(" apart, and what joins them, drawn straight, reaches ")
                .number(reach, Quantity::Length)
                .words(
                    " at most; bring them nearer together, give longer rods, or rods that stretch",
                ),
        )
    }
}
