//! Grooves: curves of the world in which a point slides without friction (theory 3.5).

use crate::error::{Error, Result};
use nalgebra::{DMatrix, Isometry3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Most points of a spline: its equations form one dense system.
const MOST_POINTS: usize = 200;
/// Number of places on each piece of a spline at which the search for the nearest begins.
const PLACES: usize = 12;
/// Most Newton steps to the nearest place.
const STEPS: usize = 50;
/// Pieces of a drawn line.
const DRAWN: usize = 200;
/// Distance from a knot, relative to the length of the spline, at which a parameter counts as on the knot.
const AT_KNOT: f64 = 1e-12;

/// A curve x(phi): a line, a circle or a spline.
#[derive(Debug, Clone)]
pub struct Groove {
    curve: GrooveCurve,
}

#[derive(Debug, Clone)]
enum GrooveCurve {
    /// x = point + phi direction, phi a length.
    Line {
        point: Vector3<f64>,
        direction: Vector3<f64>,
    },
    /// x = centre + radius (cos phi e1 + sin phi e2), phi an angle.
    Circle {
        centre: Vector3<f64>,
        radius: f64,
        axes: [Vector3<f64>; 2],
    },
    /// A spline; phi is the length of the chords.
    Spline(Arc<Spline>),
}

/// A curve of degree 5 with four continuous derivatives through points.
#[derive(Debug)]
struct Spline {
    knots: Vec<f64>,
    /// Coefficients of every piece, in powers of the fraction of the piece.
    pieces: Vec<[Vector3<f64>; 6]>,
    closed: bool,
}

impl Groove {
    /// The straight line through `point` along `direction`, without ends.
    ///
    /// # Errors
    /// A number that is not finite; no direction.
    pub fn line(point: Vector3<f64>, direction: Vector3<f64>) -> Result<Self> {
        check_components("point", &point)?;
        let direction = unit("direction", &direction)?;
        Ok(Self {
            curve: GrooveCurve::Line { point, direction },
        })
    }

    /// The circle about `centre` in the plane across `axis`. Its angle is counted from `start`, projected on that
    /// plane; without it, from an arbitrary direction of the plane.
    ///
    /// # Errors
    /// A number that is not finite; no axis; a radius that is not positive; a start along the axis.
    pub fn circle(
        centre: Vector3<f64>,
        axis: Vector3<f64>,
        radius: f64,
        start: Option<Vector3<f64>>,
    ) -> Result<Self> {
        check_components("centre", &centre)?;
        let axis = unit("axis", &axis)?;
        if !(0.0 < radius && radius < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the radius of a groove is {radius}; it must be positive and finite"
            )));
        }
        let start = start.unwrap_or_else(|| {
            // The world axis farthest from the axis of the circle.
            Vector3::ith(axis.iamin(), 1.0)
        });
        let across = start - axis * axis.dot(&start);
        if !(across.norm() > 1e-9 * start.norm()) {
            return Err(Error::domain(
                "the start of a circular groove must point away from its axis",
            ));
        }
        let first = across.normalize();
        Ok(Self {
            curve: GrooveCurve::Circle {
                centre,
                radius,
                axes: [first, axis.cross(&first)],
            },
        })
    }

    /// The curve through `points`, smooth up to its fourth derivative, `closed` or with two ends, where its third and
    /// fourth derivatives vanish. Its parameter is the length of the chords.
    ///
    /// # Errors
    /// Fewer than three points, or more than 200; points that are not finite, or neighbours that coincide.
    pub fn spline(points: &[Vector3<f64>], closed: bool) -> Result<Self> {
        if !(3..=MOST_POINTS).contains(&points.len()) {
            return Err(Error::domain(format!(
                "a groove through {} points: a spline has from 3 to {MOST_POINTS}",
                points.len()
            )));
        }
        points
            .iter()
            .try_for_each(|p| check_components("points", p))?;
        let mut points = points.to_vec();
        if closed {
            points.push(points[0]);
        }
        let mut knots = vec![0.0];
        for pair in points.windows(2) {
            let step = (pair[1] - pair[0]).norm();
            knots.push(knots[knots.len() - 1] + step);
            if !(step > 0.0) {
                return Err(Error::domain(format!(
                    "two neighbouring points of a groove are both at {}",
                    crate::error::named(&crate::error::AXES, pair[0].as_slice())
                )));
            }
        }
        let uneven = || {
            Error::ill_conditioned(
                "the points of a groove are spaced too unevenly for a smooth curve through them",
            )
        };
        let pieces = pieces(&points, &knots, closed).ok_or_else(uneven)?;
        let spline = Spline {
            knots,
            pieces,
            closed,
        };
        Ok(Self {
            curve: GrooveCurve::Spline(Arc::new(spline)),
        })
    }

    /// x, x_phi and x_phiphi. Beyond the ends of an open spline its first and its last piece are extended.
    pub fn at(&self, phi: f64) -> [Vector3<f64>; 3] {
        match &self.curve {
            GrooveCurve::Line { point, direction } => {
                [point + direction * phi, *direction, Vector3::zeros()]
            }
            GrooveCurve::Circle {
                centre,
                radius,
                axes: [a, b],
            } => {
                let (sin, cos) = phi.sin_cos();
                let outward = (a * cos + b * sin) * *radius;
                [centre + outward, (b * cos - a * sin) * *radius, -outward]
            }
            GrooveCurve::Spline(spline) => spline.at(phi),
        }
    }

    /// The parameter of the place nearest to `point`; of several, one of them. On a circle it lies in [-pi, pi].
    pub fn nearest(&self, point: &Vector3<f64>) -> f64 {
        match &self.curve {
            GrooveCurve::Line {
                point: from,
                direction,
            } => direction.dot(&(point - from)),
            GrooveCurve::Circle {
                centre,
                axes: [a, b],
                ..
            } => {
                let d = point - centre;
                b.dot(&d).atan2(a.dot(&d))
            }
            GrooveCurve::Spline(spline) => self.nearest_of(spline, point),
        }
    }

    fn nearest_of(&self, spline: &Spline, point: &Vector3<f64>) -> f64 {
        let away = |phi: f64| (self.at(phi)[0] - point).norm_squared();
        let places = spline.knots.windows(2).flat_map(|pair| {
            (0..PLACES).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / PLACES as f64)
        });
        let nearest = places
            .chain([spline.length()])
            .min_by(|a, b| away(*a).total_cmp(&away(*b)));
        let mut phi = nearest.unwrap_or_default();
        for _ in 0..STEPS {
            let [x, first, second] = self.at(phi);
            let slope = first.dot(&(x - point));
            // The squared distance is not convex where the curve bends away from the point.
            let curvature =
                (first.norm_squared() + second.dot(&(x - point))).max(0.5 * first.norm_squared());
            let step = slope / curvature;
            phi -= step;
            if !spline.closed {
                phi = phi.clamp(0.0, spline.length());
            }
            if !(step.abs() > f64::EPSILON * spline.length()) {
                break;
            }
        }
        phi
    }

    /// Points for a smooth drawing of the groove along the path `way` of a point, extended by the length `beyond` on
    /// both sides. The drawing ends with the groove, and goes at most once round a closed one. Empty if the path has
    /// no points.
    pub fn points_along(&self, way: &[Vector3<f64>], beyond: f64) -> Vec<Vector3<f64>> {
        let Some(first) = way.first() else {
            return Vec::new();
        };
        let mut phi = self.nearest(first);
        let speed = self.at(phi)[1].norm();
        let (mut low, mut high) = (phi, phi);
        for point in way {
            phi += self.shorter_way(phi, self.nearest(point));
            (low, high) = (low.min(phi), high.max(phi));
        }
        (low, high) = (low - beyond / speed, high + beyond / speed);
        if let Some([first, last]) = self.ends() {
            (low, high) = (low.max(first), high.min(last));
        }
        if let Some(period) = self.period() {
            high = high.min(low + period);
        }
        (0..=DRAWN)
            .map(|k| self.at(low + (high - low) * k as f64 / DRAWN as f64)[0])
            .collect()
    }

    /// `to` less `from`, the shorter way round a closed curve.
    pub fn shorter_way(&self, from: f64, to: f64) -> f64 {
        let way = to - from;
        match self.period() {
            Some(period) => way - period * (way / period).round(),
            None => way,
        }
    }

    /// Period of the parameter; None for an open curve.
    pub fn period(&self) -> Option<f64> {
        match &self.curve {
            GrooveCurve::Line { .. } => None,
            GrooveCurve::Circle { .. } => Some(TAU),
            GrooveCurve::Spline(spline) => spline.closed.then(|| spline.length()),
        }
    }

    /// The parameters of the ends, if there are any.
    pub fn ends(&self) -> Option<[f64; 2]> {
        match &self.curve {
            GrooveCurve::Spline(spline) if !spline.closed => Some([0.0, spline.length()]),
            _ => None,
        }
    }

    /// At an end, to rounding, the outward direction: -1 at the first point, 1 at the last.
    pub fn way_out(&self, phi: f64) -> Option<f64> {
        let [first, last] = self.ends()?;
        let rounding = AT_KNOT * (last - first);
        match phi {
            _ if (phi - first).abs() <= rounding => Some(-1.0),
            _ if (phi - last).abs() <= rounding => Some(1.0),
            _ => None,
        }
    }

    /// The end at `from`, to rounding, if `to` lies outside by more than rounding.
    pub fn end_left(&self, from: f64, to: f64) -> Option<f64> {
        let [first, last] = self.ends()?;
        let rounding = AT_KNOT * (last - first);
        match self.way_out(from)? {
            way if way > 0.0 => (to > last + rounding).then_some(last),
            _ => (to < first - rounding).then_some(first),
        }
    }

    /// The first parameter beyond `from` on the way to `to` at which some derivative jumps, an end included.
    pub fn first_break(&self, from: f64, to: f64) -> Option<f64> {
        let GrooveCurve::Spline(spline) = &self.curve else {
            return None;
        };
        let length = spline.length();
        let turns = if spline.closed {
            (from / length).floor()
        } else {
            0.0
        };
        let around: &[f64] = if spline.closed {
            &[-1.0, 0.0, 1.0]
        } else {
            &[0.0]
        };
        let all = around.iter().flat_map(|turn| {
            let shift = (turns + turn) * length;
            spline.knots.iter().map(move |knot| knot + shift)
        });
        // A knot at `from` to rounding is not beyond.
        let rounding = AT_KNOT * (length + from.abs());
        if from < to {
            all.filter(|knot| from + rounding < *knot && *knot <= to)
                .reduce(f64::min)
        } else {
            all.filter(|knot| to <= *knot && *knot < from - rounding)
                .reduce(f64::max)
        }
    }

    /// The curve seen from a frame with the pose `frame`.
    #[must_use]
    pub fn seen_from(&self, frame: &Isometry3<f64>) -> Self {
        let place = |x: &Vector3<f64>| frame.inverse_transform_point(&(*x).into()).coords;
        let turned = |v: &Vector3<f64>| frame.inverse_transform_vector(v);
        let curve = match &self.curve {
            GrooveCurve::Line { point, direction } => GrooveCurve::Line {
                point: place(point),
                direction: turned(direction),
            },
            GrooveCurve::Circle {
                centre,
                radius,
                axes,
            } => GrooveCurve::Circle {
                centre: place(centre),
                radius: *radius,
                axes: [turned(&axes[0]), turned(&axes[1])],
            },
            GrooveCurve::Spline(spline) => GrooveCurve::Spline(Arc::new(Spline {
                knots: spline.knots.clone(),
                pieces: spline
                    .pieces
                    .iter()
                    .map(|[x, rest @ ..]| {
                        let [a, b, c, d, e] = rest.map(|v| turned(&v));
                        [place(x), a, b, c, d, e]
                    })
                    .collect(),
                closed: spline.closed,
            })),
        };
        Self { curve }
    }
}

impl Spline {
    fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    fn at(&self, phi: f64) -> [Vector3<f64>; 3] {
        let phi = if self.closed {
            phi.rem_euclid(self.length())
        } else {
            phi
        };
        let next = self.knots.partition_point(|knot| *knot <= phi);
        let k = next.clamp(1, self.pieces.len()) - 1;
        let h = self.knots[k + 1] - self.knots[k];
        let u = (phi - self.knots[k]) / h;
        let [c0, c1, c2, c3, c4, c5] = &self.pieces[k];
        [
            c0 + (c1 + (c2 + (c3 + (c4 + c5 * u) * u) * u) * u) * u,
            (c1 + (c2 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * u)) * u) * u) * u) / h,
            (c2 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * u)) * u) * u) / (h * h),
        ]
    }
}

/// The third and the fourth derivative of a piece of length `h` at its start, then at its end: by (rise, f', f'' at
/// the start, f', f'' at the end).
fn jumps(h: f64) -> [[f64; 5]; 4] {
    let (h2, third, fourth) = (h * h, 6.0 / h.powi(3), 24.0 / h.powi(4));
    [
        [10.0, -6.0 * h, -1.5 * h2, -4.0 * h, 0.5 * h2].map(|x| x * third),
        [-15.0, 8.0 * h, 1.5 * h2, 7.0 * h, -h2].map(|x| x * fourth),
        [10.0, -4.0 * h, -0.5 * h2, -6.0 * h, 1.5 * h2].map(|x| x * third),
        [15.0, -7.0 * h, -h2, -8.0 * h, 1.5 * h2].map(|x| x * fourth),
    ]
}

/// The pieces between `points`, with continuous third and fourth derivatives.
fn pieces(points: &[Vector3<f64>], knots: &[f64], closed: bool) -> Option<Vec<[Vector3<f64>; 6]>> {
    let last = points.len() - 1;
    let jets = if closed { last } else { last + 1 };
    let mean = knots[last] / last as f64;
    let mut matrix = DMatrix::zeros(2 * jets, 2 * jets);
    let mut right = DMatrix::zeros(2 * jets, 3);
    for k in 0..last {
        let h = knots[k + 1] - knots[k];
        let rise = points[k + 1] - points[k];
        let all = jumps(h);
        for (side, knot) in [k, (k + 1) % jets].into_iter().enumerate() {
            for order in 0..2 {
                let row = 2 * knot + order;
                // Comparable rows: derivatives times powers of the mean length of a piece.
                let sign = if side == 0 { 1.0 } else { -1.0 };
                let scale = sign * mean.powi(3 + order as i32);
                let by = all[2 * side + order].map(|x| x * scale);
                for (j, column) in [k, (k + 1) % jets].into_iter().enumerate() {
                    matrix[(row, 2 * column)] += by[1 + 2 * j] / mean;
                    matrix[(row, 2 * column + 1)] += by[2 + 2 * j] / (mean * mean);
                }
                for i in 0..3 {
                    right[(row, i)] -= by[0] * rise[i];
                }
            }
        }
    }
    let solved = matrix.lu().solve(&right)?;
    let jet = |k: usize| {
        let row = 2 * (k % jets);
        let vector = |row: usize| Vector3::from_fn(|i, _| solved[(row, i)]);
        (vector(row) / mean, vector(row + 1) / (mean * mean))
    };
    let pieces = (0..last).map(|k| {
        let h = knots[k + 1] - knots[k];
        let rise = points[k + 1] - points[k];
        let ((d0, s0), (d1, s1)) = (jet(k), jet(k + 1));
        let (d0, s0, d1, s1) = (d0 * h, s0 * (h * h), d1 * h, s1 * (h * h));
        [
            points[k],
            d0,
            s0 * 0.5,
            rise * 10.0 - d0 * 6.0 - d1 * 4.0 - s0 * 1.5 + s1 * 0.5,
            rise * -15.0 + d0 * 8.0 + d1 * 7.0 + s0 * 1.5 - s1,
            rise * 6.0 - (d0 + d1) * 3.0 - (s0 - s1) * 0.5,
        ]
    });
    let pieces: Vec<[Vector3<f64>; 6]> = pieces.collect();
    let sound = pieces
        .iter()
        .flatten()
        .all(|c| c.iter().all(|x| x.is_finite()));
    sound.then_some(pieces)
}

fn check_components(what: &str, v: &Vector3<f64>) -> Result<()> {
    if v.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(Error::domain(format!(
        "the {what} of a groove has the components {}; they must be finite",
        crate::error::named(&crate::error::AXES, v.as_slice())
    )))
}

fn unit(what: &str, v: &Vector3<f64>) -> Result<Vector3<f64>> {
    check_components(what, v)?;
    let length = v.norm();
    if !(length > 0.0 && length < f64::INFINITY) {
        return Err(Error::domain(format!(
            "the {what} of a groove has the components {}; it must not be 0",
            crate::error::named(&crate::error::AXES, v.as_slice())
        )));
    }
    Ok(v / length)
}
