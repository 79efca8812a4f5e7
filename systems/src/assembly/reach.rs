//! Whether rods are long enough for what they join.

use super::{Assembly, Attachment, On};
use crate::error::{Error, Message, Quantity, Result};
use nalgebra::DMatrix;

/// Rods that reach their places but for this part of the way are held to be straight between them.
const STRAIGHT: f64 = 1e-9;

impl Assembly {
    /// Looks whether the rods can join what they should, before equilibria are looked for: a rod that can be neither stretched nor sheared
    /// ends within its length, so that a chain of such rods and of bodies reaches no farther than the sum of their lengths and of the
    /// distances between the places of attachment.
    ///
    /// # Errors
    /// Two ends of rods that stand in the ground, or on supports where these are at t = 0, farther apart than that.
    pub fn within_reach(&self) -> Result<()> {
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
        for (k, &i) in standing.iter().enumerate() {
            for &j in &standing[k + 1..] {
                let [a, b] = [i, j].map(|end| ends[end].at(0.0, &[]).pose.translation.vector);
                let apart = (a - b).norm();
                if apart > reach[(i, j)] * (1.0 + STRAIGHT) {
                    return Err(self.too_short([i / 2, j / 2], apart, reach[(i, j)]));
                }
            }
        }
        Ok(())
    }

    fn too_short(&self, rods: [usize; 2], apart: f64, reach: f64) -> Error {
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
