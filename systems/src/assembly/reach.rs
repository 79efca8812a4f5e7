//! Reach of chains of inextensible rods between fixed attachments.

use super::attachment::Attachment;
use super::body::{Body, BodyMotion};
use super::guide::Guide;
use super::network::Assembly;
use crate::error::{Error, Message, Quantity, Result};
use nalgebra::DMatrix;

/// Relative slack below which a chain counts as straight.
const STRAIGHT: f64 = 1e-9;

/// A chain of inextensible rods and bodies between two fixed ends of rods.
struct Chain {
    rods: [usize; 2],
    /// Distance of the two ends.
    apart: f64,
    /// Largest possible distance; infinite if no such chain joins the ends.
    reach: f64,
}

impl Assembly {
    /// Checks before any search for equilibria that the rods can reach. An unshearable inextensible rod ends within
    /// its length. A chain of such rods and of bodies thus spans at most the sum of their lengths and of the
    /// distances between the points of attachment.
    ///
    /// # Errors
    /// Two ends of rods in the ground, or on supports at t = 0, that are farther apart than their chain spans.
    pub fn within_reach(&self) -> Result<()> {
        let chains = self.chains()?;
        let short = chains
            .iter()
            .find(|chain| chain.apart > chain.reach * (1.0 + STRAIGHT));
        short.map_or(Ok(()), |chain| Err(self.too_short(chain)))
    }

    /// First unshearable inextensible rod that is shorter than the distance of its attachments for these poses of
    /// the bodies.
    ///
    /// # Errors
    /// Those of the sections of the rods.
    pub fn overdrawn(&self, bodies: &[BodyMotion]) -> Result<Option<usize>> {
        for (k, link) in self.links().iter().enumerate() {
            let [base, tip] = [&link.from, &link.to].map(|end| end.at(0.0, bodies).pose);
            let apart = (base.translation.vector - tip.translation.vector).norm();
            if link.rod.is_inextensible()? && apart > link.rod.length() * (1.0 + STRAIGHT) {
                return Ok(Some(k));
            }
        }
        Ok(None)
    }

    /// Error for a chain drawn straight between fixed points: it bears no load across, since its force would be
    /// infinite.
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

    /// The place of the joint of a rod's end, if the joint turns without a slide.
    fn without_joint<'a>(&'a self, end: &'a Attachment) -> &'a Attachment {
        let node = end.carried_by().map(|node| &self.carriers()[node]);
        let joint = node.and_then(Body::joint);
        joint
            .filter(|joint| joint.shiftings() == 0)
            .map_or(end, Guide::on)
    }

    /// Chains between any two fixed ends.
    fn chains(&self) -> Result<Vec<Chain>> {
        let ends = self.links().iter();
        let ends = ends.flat_map(|link| [&link.from, &link.to]);
        let ends: Vec<&Attachment> = ends.map(|end| self.without_joint(end)).collect();
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
                if ends[i].carried_by().is_some() && ends[i].carried_by() == ends[j].carried_by() {
                    let [a, b] = [i, j].map(|end| ends[end].place.translation.vector);
                    joined(i, j, (a - b).norm());
                }
            }
        }
        // Shortest paths between all ends (Floyd, Warshall).
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
        let standing: Vec<usize> = (0..n).filter(|i| ends[*i].carried_by().is_none()).collect();
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
        let words = if one == other {
            format!("{one} is too short: its ends are held ")
        } else {
            format!("the rods are too short: those ends of {one} and {other} that do not move are ")
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
