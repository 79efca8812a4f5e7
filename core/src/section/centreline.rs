//! Rest strains of a rod whose unloaded centreline goes through or near given points.
//!
//! The directors do not rotate about the tangent (d1' = -(d1 . d3') d3), but for a given uniform twist. The flexures
//! are then u1 = -d3'.d2, u2 = d3'.d1. They are kept as polynomials in s, piece by piece.

use super::{Along, Rest};
use crate::error::{Error, Result};
use crate::math::curve_fit::CurveFit;
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use std::f64::consts::PI;

/// Degree of the polynomials of the flexures.
const DEGREE: usize = 12;
/// Steps of the transport of d1 between two nodes of a polynomial.
const STEPS: usize = 8;
/// Newton steps to a given arclength.
const NEWTON: usize = 30;
/// Least sine of the angle between the tangent and a given normal.
const ALONG: f64 = 1e-6;

/// A rest shape by points of its centreline.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Centreline {
    /// Number of points.
    pub points: usize,
    /// Number of polynomial pieces of the curve.
    pub pieces: usize,
    /// Length of the curve.
    pub length: f64,
    /// Largest distance of the points from the curve.
    pub distance: f64,
    /// Place, tangent d3 and normal d1 of the curve at its begin, in the axes of the points.
    pub position: [f64; 3],
    /// Tangent.
    pub tangent: [f64; 3],
    /// Normal.
    pub normal: [f64; 3],
}

impl Centreline {
    /// The centreline with its rest strains. `normal` is the direction of d1 at the begin, up to a part along the
    /// tangent; by default that of the axes x, y, z that is most across the tangent. `twist` is in radians per length.
    ///
    /// # Errors
    /// As [`CurveFit::new`]; a normal that is zero or along the tangent.
    pub fn new(
        points: &[Vector3<f64>],
        pieces: Option<usize>,
        normal: Option<Vector3<f64>>,
        twist: f64,
    ) -> Result<(Self, Rest)> {
        let curve = CurveFit::new(points, pieces)?;
        let ends = curve.ends();
        let (tangent, _) = bend(&curve, ends[0]);
        let given = normal.unwrap_or_else(|| Vector3::ith(tangent.iamin(), 1.0));
        let across = given - tangent * tangent.dot(&given);
        if !(across.norm() > ALONG * given.norm()) {
            return Err(Error::domain(
                "the normal must be finite, not 0 and not along the first tangent of the centreline",
            ));
        }
        let first = across.normalize();
        let mut d1 = first;
        let mut places = vec![0.0];
        let mut flexures: [Vec<Vec<f64>>; 2] = Default::default();
        let nodes: Vec<f64> = (0..=DEGREE)
            .map(|k| 0.5 * (1.0 - (PI * k as f64 / DEGREE as f64).cos()))
            .collect();
        let powers = DMatrix::from_fn(DEGREE + 1, DEGREE + 1, |i, k| nodes[i].powi(k as i32));
        let powers = powers.lu();
        for pair in ends.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let whole = curve.length(from, to);
            let begin = places[places.len() - 1];
            let mut values = [DVector::zeros(DEGREE + 1), DVector::zeros(DEGREE + 1)];
            let mut t = from;
            for (k, node) in nodes.iter().enumerate() {
                let next = at_arclength(&curve, (from, to), node * whole);
                d1 = transported(&curve, d1, t, next);
                t = next;
                let (d3, bend) = bend(&curve, t);
                let angle = twist * (begin + node * whole);
                let turned = Rotation3::new(d3 * angle) * d1;
                values[0][k] = -bend.dot(&d3.cross(&turned));
                values[1][k] = bend.dot(&turned);
            }
            for (flexure, values) in flexures.iter_mut().zip(&values) {
                let solved = powers.solve(values).unwrap_or_else(|| values.clone() * 0.0);
                flexure.push(solved.iter().copied().collect());
            }
            places.push(begin + whole);
        }
        let length = places[places.len() - 1];
        let [one, other] = flexures;
        let rest = Rest {
            curvature: [
                Along::pieces_between(&places, one)?,
                Along::pieces_between(&places, other)?,
            ],
            twist: twist.into(),
        };
        let centreline = Self {
            points: points.len(),
            pieces: ends.len() - 1,
            length,
            distance: curve.farthest(points),
            position: curve.at(ends[0])[0].into(),
            tangent: tangent.into(),
            normal: first.into(),
        };
        Ok((centreline, rest))
    }
}

/// Tangent, and its derivative by arclength.
fn bend(curve: &CurveFit, t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let [_, first, second] = curve.at(t);
    let speed = first.norm();
    let d3 = first / speed;
    (d3, (second - d3 * d3.dot(&second)) / (speed * speed))
}

/// Parameter in a piece at an arclength from the begin of the piece.
fn at_arclength(curve: &CurveFit, (from, to): (f64, f64), s: f64) -> f64 {
    let mut t = from + s;
    for _ in 0..NEWTON {
        t = t.clamp(from, to);
        let off = curve.length(from, t) - s;
        let step = off / curve.at(t)[1].norm();
        t -= step;
        if step.abs() <= 1e-15 * (to - from) {
            break;
        }
    }
    t.clamp(from, to)
}

/// The director d1 carried along the curve without rotation about the tangent, by the classical method of Runge and
/// Kutta.
fn transported(curve: &CurveFit, d1: Vector3<f64>, from: f64, to: f64) -> Vector3<f64> {
    let h = (to - from) / STEPS as f64;
    let rate = |t: f64, d1: &Vector3<f64>| {
        let (d3, bend) = bend(curve, t);
        d3 * (-d1.dot(&bend) * curve.at(t)[1].norm())
    };
    let mut d1 = d1;
    for k in 0..STEPS {
        let t = from + h * k as f64;
        let one = rate(t, &d1);
        let two = rate(t + 0.5 * h, &(d1 + one * (0.5 * h)));
        let three = rate(t + 0.5 * h, &(d1 + two * (0.5 * h)));
        let four = rate(t + h, &(d1 + three * h));
        d1 += (one + two * 2.0 + three * 2.0 + four) * (h / 6.0);
    }
    let (d3, _) = bend(curve, to);
    (d1 - d3 * d3.dot(&d1)).normalize()
}
