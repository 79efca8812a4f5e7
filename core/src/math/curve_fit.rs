//! Smooth curves through or near points: splines of degree 5 by arclength, with few or many pieces.
//!
//! A spline with as many coefficients as points passes through these; one with fewer is nearest to them in the sense of
//! least squares (Piegl and Tiller, *The NURBS Book*, Secs. 9.2, 9.4). The parameter of a point is at first the length
//! of the chords up to it, then the arclength of the spline: chords alone cost the order of convergence.

use super::gauss::Rule;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, Vector3};

/// Degree of the splines, and that of splines through fewer than six points.
const DEGREE: usize = 5;
const LOW_DEGREE: usize = 3;
/// Fewest points.
pub const FEWEST: usize = 4;
/// Most points.
pub const MOST: usize = 20_000;
/// Most pieces without a wish; more points are then fitted by least squares.
pub const PIECES: usize = 100;
/// Fits with parameters renewed by arclength.
const ROUNDS: usize = 4;
/// Nodes of the quadrature of arclength in a piece.
const NODES: usize = 16;
/// Newton steps to the nearest point of the curve.
const STEPS: usize = 20;
/// Relative distance at which two points are one.
const SAME: f64 = 1e-12;
/// Least speed of a sound curve: near arclength the speed is 1.
const SLOW: f64 = 0.1;

/// Largest length of a curve over the sum of the chords of its points: with more the curve swings out between points.
const LONGER: f64 = 1.5;

/// A spline curve.
#[derive(Debug, Clone)]
pub struct CurveFit {
    degree: usize,
    knots: Vec<f64>,
    controls: Vec<Vector3<f64>>,
    /// Parameters of the points.
    parameters: Vec<f64>,
    /// Quadrature of the arclength in a piece.
    rule: Rule,
}

impl CurveFit {
    /// A curve through the points, or near them with the wished number of polynomial pieces.
    ///
    /// # Errors
    /// Fewer than [`FEWEST`] or more than [`MOST`] points; coordinates that are not finite; neighbours at one place;
    /// more pieces than the points determine; points through which no smooth curve goes.
    pub fn new(points: &[Vector3<f64>], pieces: Option<usize>) -> Result<Self> {
        let count = points.len();
        if !(FEWEST..=MOST).contains(&count) {
            return Err(Error::domain(format!(
                "{count} points: a smooth curve needs {FEWEST} to {MOST}; give more points, or thin them out"
            )));
        }
        if let Some(k) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(Error::domain(format!(
                "point {} has a coordinate that is not finite",
                k + 1
            )));
        }
        let chords: Vec<f64> = points
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).norm())
            .collect();
        let whole: f64 = chords.iter().sum();
        if let Some(k) = chords.iter().position(|chord| !(*chord > SAME * whole)) {
            return Err(Error::domain(format!(
                "points {} and {} are at one place: leave one of them out",
                k + 1,
                k + 2
            )));
        }
        let degree = if count > DEGREE { DEGREE } else { LOW_DEGREE };
        let most = count - degree;
        let pieces = match pieces {
            Some(pieces) if !(1..=most).contains(&pieces) => {
                return Err(Error::domain(format!(
                    "pieces = {pieces}: {count} points determine 1 to {most} pieces of degree {degree}"
                )));
            }
            Some(pieces) => pieces,
            None => most.min(PIECES),
        };
        let mut parameters = vec![0.0];
        for chord in &chords {
            parameters.push(parameters[parameters.len() - 1] + chord);
        }
        let mut fit = Self::with(points, parameters, degree, pieces)?;
        for _ in 1..ROUNDS {
            let parameters = fit.arclengths();
            let length = parameters[count - 1];
            if !(length <= LONGER * whole) {
                return Err(Error::domain(format!(
                    "the curve swings out between the points: its length would be {length:.3}, that of the chords is {whole:.3}; give points \
                     at equal distances, more points, or fewer `pieces`"
                )));
            }
            fit = Self::with(points, parameters, degree, pieces)?;
        }
        let slow = fit.samples().find(|t| !(fit.at(*t)[1].norm() > SLOW));
        if let Some(t) = slow {
            let near = fit.parameters.partition_point(|other| *other < t).max(1);
            return Err(Error::domain(format!(
                "no smooth curve goes through the points near points {near} and {}: it would turn back there; give more points, or, for points \
                 with noise, fewer `pieces`",
                near + 1
            )));
        }
        Ok(fit)
    }

    fn with(
        points: &[Vector3<f64>],
        parameters: Vec<f64>,
        degree: usize,
        pieces: usize,
    ) -> Result<Self> {
        let count = points.len();
        let controls = pieces + degree;
        let last = parameters[count - 1];
        let mut knots = vec![0.0; degree + 1];
        for j in 1..pieces {
            knots.push(if controls == count {
                parameters[j..j + degree].iter().sum::<f64>() / degree as f64
            } else {
                // As many points in every piece.
                let place = j as f64 * (count - 1) as f64 / pieces as f64;
                let (k, part) = (place as usize, place.fract());
                parameters[k] * (1.0 - part) + parameters[(k + 1).min(count - 1)] * part
            });
        }
        knots.extend(vec![last; degree + 1]);
        let mut fit = Self {
            degree,
            knots,
            controls: vec![Vector3::zeros(); controls],
            parameters,
            rule: Rule::new(NODES),
        };
        let mut matrix = DMatrix::zeros(count, controls);
        for (row, t) in fit.parameters.iter().enumerate() {
            let (first, values) = fit.basis(*t);
            for (k, value) in values.iter().enumerate() {
                matrix[(row, first + k)] = *value;
            }
        }
        let sides = DMatrix::from_fn(count, 3, |i, j| points[i][j]);
        let factors = matrix.qr();
        let turned = factors.q().tr_mul(&sides);
        let solved = factors.r().solve_upper_triangular(&turned);
        let solved = solved.filter(|x| x.iter().all(|x| x.is_finite()));
        let solved = solved.ok_or_else(|| {
            Error::domain(
                "the points lie too unevenly for a curve of so many pieces: give fewer `pieces`",
            )
        })?;
        for (control, row) in fit.controls.iter_mut().zip(solved.row_iter()) {
            *control = row.transpose().fixed_rows::<3>(0).into_owned();
        }
        Ok(fit)
    }

    fn span(&self, t: f64) -> usize {
        let (first, last) = (self.degree, self.controls.len() - 1);
        let after = self.knots.partition_point(|knot| *knot <= t);
        after.saturating_sub(1).clamp(first, last)
    }

    /// First basis function that is not zero at `t`, and the values of this one and those after it, by de Boor's
    /// recursion.
    fn basis(&self, t: f64) -> (usize, Vec<f64>) {
        let span = self.span(t);
        let mut values = vec![1.0];
        for p in 1..=self.degree {
            let mut next = vec![0.0; p + 1];
            for (k, value) in values.iter().enumerate() {
                let (from, to) = (self.knots[span + 1 + k - p], self.knots[span + 1 + k]);
                let part = (t - from) / (to - from);
                next[k] += value * (1.0 - part);
                next[k + 1] += value * part;
            }
            values = next;
        }
        (span - self.degree, values)
    }

    /// r, r' and r'' by the parameter, which is nearly the arclength.
    pub fn at(&self, t: f64) -> [Vector3<f64>; 3] {
        let span = self.span(t);
        let p = self.degree;
        let mut points: Vec<Vector3<f64>> = self.controls[span - p..=span].to_vec();
        let mut found = [Vector3::zeros(); 3];
        // The control points of a derivative are differences of those before.
        for (order, found) in found.iter_mut().enumerate() {
            let degree = p - order;
            let mut blossom = points.clone();
            for level in 1..=degree {
                for k in 0..=degree - level {
                    let (from, to) = (
                        self.knots[span - degree + level + k],
                        self.knots[span + 1 + k],
                    );
                    let part = (t - from) / (to - from);
                    blossom[k] = blossom[k] * (1.0 - part) + blossom[k + 1] * part;
                }
            }
            *found = blossom[0];
            points = (0..degree)
                .map(|k| {
                    let (from, to) = (self.knots[span - degree + 1 + k], self.knots[span + 1 + k]);
                    (points[k + 1] - points[k]) * (degree as f64 / (to - from))
                })
                .collect();
        }
        found
    }

    /// Ends of the polynomial pieces, in the parameter.
    pub fn ends(&self) -> Vec<f64> {
        self.knots[self.degree..=self.controls.len()].to_vec()
    }

    fn samples(&self) -> impl Iterator<Item = f64> + '_ {
        let ends = self.ends();
        let pieces = ends.windows(2).map(|pair| [pair[0], pair[1]]);
        let pieces: Vec<[f64; 2]> = pieces.collect();
        let part = |k: usize| k as f64 / NODES as f64;
        let inside =
            move |[from, to]: [f64; 2]| (0..=NODES).map(move |k| from + (to - from) * part(k));
        pieces.into_iter().flat_map(inside)
    }

    /// Arclength between two parameters of one piece.
    pub fn length(&self, from: f64, to: f64) -> f64 {
        let each = self.rule.nodes.iter().zip(&self.rule.weights);
        let each = each.map(|(x, w)| w * self.at(from + (to - from) * x)[1].norm());
        each.sum::<f64>() * (to - from)
    }

    /// Arclengths of the points on the curve.
    fn arclengths(&self) -> Vec<f64> {
        let mut places: Vec<f64> = self.ends();
        places.extend(&self.parameters);
        places.sort_by(f64::total_cmp);
        places.dedup();
        let mut lengths = vec![0.0];
        for pair in places.windows(2) {
            lengths.push(lengths[lengths.len() - 1] + self.length(pair[0], pair[1]));
        }
        let of = |t: &f64| {
            let k = places.partition_point(|place| place < t);
            lengths[k.min(lengths.len() - 1)]
        };
        self.parameters.iter().map(of).collect()
    }

    /// Largest distance of the points from the curve.
    pub fn farthest(&self, points: &[Vector3<f64>]) -> f64 {
        let last = self.knots[self.knots.len() - 1];
        let distance = |(point, t): (&Vector3<f64>, &f64)| {
            let mut t = *t;
            let mut best = (self.at(t)[0] - point).norm();
            for _ in 0..STEPS {
                let [r, first, second] = self.at(t);
                let off = r - point;
                let slope = first.norm_squared() + second.dot(&off);
                if !(slope > 0.0) {
                    break;
                }
                t = (t - first.dot(&off) / slope).clamp(0.0, last);
                let now = (self.at(t)[0] - point).norm();
                if !(now < best) {
                    break;
                }
                best = now;
            }
            best
        };
        points
            .iter()
            .zip(&self.parameters)
            .map(distance)
            .fold(0.0, f64::max)
    }
}
