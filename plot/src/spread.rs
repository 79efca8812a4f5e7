//! Spread of points in space along principal axes, and the view of their principal plane.

use super::data::View;
use super::geometry::{Point, along, box_of, cross, drawable, unit};
use super::stage::size_of;
use nalgebra::{Matrix3, SymmetricEigen};

/// Spread of points in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    /// Principal directions, widest first.
    pub axes: [Point; 3],
    /// Root mean squares along the axes, the box's longest edge being 1.
    pub size: [f64; 3],
}

impl Spread {
    /// Principal axes of the points.
    pub(crate) fn new<'a>(points: impl Iterator<Item = &'a Point> + Clone) -> Option<Self> {
        let bounds = box_of(points.clone())?;
        let size = size_of(&bounds);
        let scaled = |p: &Point| -> Point {
            std::array::from_fn(|i| (p[i] - 0.5 * (bounds[i][0] + bounds[i][1])) / size)
        };
        let (mut n, mut sum, mut square) = (0.0, [0.0; 3], Matrix3::zeros());
        for p in points.filter(|p| drawable(p)).map(scaled) {
            n += 1.0;
            sum = along(sum, 1.0, p);
            square += Matrix3::from_fn(|i, j| p[i] * p[j]);
        }
        let mean = sum.map(|c| c / n);
        let matrix = square / n - Matrix3::from_fn(|i, j| mean[i] * mean[j]);
        let eigen = SymmetricEigen::new(matrix);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        Some(Self {
            axes: order.map(|k| std::array::from_fn(|i| eigen.eigenvectors[(i, k)])),
            size: order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
        })
    }

    /// True if all points lie in a plane, up to what can be seen.
    pub(crate) fn is_plane(&self) -> bool {
        self.size[2] < 1e-4 * self.size[0].max(1e-3)
    }

    /// The best view of the shape: the principal plane nearly faces the eye, z points up where that plane
    /// stands, and x or y runs to the right.
    pub(crate) fn view(&self) -> View {
        let [long, wide, deep] = self.size;
        let slender = wide < 1e-3 * long.max(1e-3) || (deep > 0.6 * wide && wide < 0.75 * long);
        let round = deep > 0.6 * wide && !slender;
        if round {
            return View {
                azimuth: -60.0,
                elevation: 20.0,
            };
        }
        let normal = if slender {
            // A view from the side.
            unit(cross(self.axes[0], [0.0, 0.0, 1.0]))
                .filter(|_| self.axes[0][2].abs() < 0.95)
                .unwrap_or([0.0, -1.0, 0.0])
        } else {
            self.axes[2]
        };
        let (turn, lift) = if self.is_plane() {
            (12.0, 14.0)
        } else {
            (24.0, 20.0)
        };
        let upright = normal[2].abs();
        if upright > 0.8 {
            // A second rotation would make the shape seem to lean.
            return View {
                azimuth: if self.is_plane() {
                    -90.0
                } else {
                    -90.0 - 0.6 * turn
                },
                elevation: 90.0 - 1.6 * lift,
            };
        }
        // Right is (-sin, cos) of the azimuth.
        let to_right = -normal[1] + 0.99 * normal[0];
        let sign = if upright > 0.3 {
            normal[2].signum()
        } else if to_right < 0.0 {
            -1.0
        } else {
            1.0
        };
        let [x, y, z] = normal.map(|c| sign * c);
        View {
            azimuth: y.atan2(x).to_degrees() + turn,
            elevation: z.asin().to_degrees().clamp(lift, 62.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::geometry::dot;
    use super::*;

    fn facing(points: &[Point], normal: Point) -> f64 {
        let view = Spread::new(points.iter()).unwrap().view();
        let (sa, ca) = view.azimuth.to_radians().sin_cos();
        let (se, ce) = view.elevation.to_radians().sin_cos();
        dot([ce * ca, ce * sa, se], normal).abs()
    }

    /// Catches a camera that looks along the plane of a plane shape.
    #[test]
    fn planes_face_the_eye() {
        let arc: Vec<[f64; 2]> = (0..30)
            .map(|i| [0.1 * i as f64, (0.1 * i as f64).sin()])
            .collect();
        for (axis, normal) in [
            (0, [1.0, 0.0, 0.0]),
            (1, [0.0, 1.0, 0.0]),
            (2, [0.0, 0.0, 1.0]),
        ] {
            let points: Vec<Point> = arc
                .iter()
                .map(|[a, b]| {
                    let mut p = [0.0; 3];
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (*a, *b);
                    p
                })
                .collect();
            assert!(facing(&points, normal) > 0.9, "{axis}");
            assert!(Spread::new(points.iter()).unwrap().is_plane());
        }
        let tilted: Vec<Point> = arc.iter().map(|[a, b]| [*a, *b, 0.5 * a]).collect();
        assert!(facing(&tilted, unit([-0.5, 0.0, 1.0]).unwrap()) > 0.8);
    }
}
