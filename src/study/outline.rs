//! Outlines of obstacles for figures: lines on their surfaces near the rod.

use crate::scene::{Obstacle, ObstacleShape};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;

/// Points of a circle.
const ROUND: usize = 49;
/// Lines of a patch of a plane in each direction.
const LINES: usize = 5;
/// Strokes behind the border of a half-space.
const STROKES: usize = 40;
/// Lines along a cylinder.
const STAVES: usize = 12;

type Polyline = Vec<[f64; 3]>;

/// A ball round the points that a figure shows.
struct Near {
    centre: Vector3<f64>,
    radius: f64,
}

/// Two unit vectors across a unit vector.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut other = Vector3::zeros();
    other[axis.iamin()] = 1.0;
    let first = axis.cross(&other).normalize();
    [first, axis.cross(&first)]
}

fn circle(
    centre: &Vector3<f64>,
    [a, b]: &[Vector3<f64>; 2],
    radius: f64,
    part: [f64; 2],
) -> Polyline {
    let point = |i: usize| {
        let angle = part[0] + (part[1] - part[0]) * i as f64 / (ROUND - 1) as f64;
        (centre + (a * angle.cos() + b * angle.sin()) * radius).into()
    };
    (0..ROUND).map(point).collect()
}

/// Lines on the surface of an obstacle near these points.
pub fn outline(obstacle: &Obstacle, points: &[Vector3<f64>]) -> Vec<Polyline> {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let distances = points.iter().map(|p| (p - centre).norm());
    let near = Near {
        centre,
        radius: distances.fold(0.0, f64::max),
    };
    match &obstacle.shape {
        ObstacleShape::Plane { point, normal } => plane(&(*point).into(), &(*normal).into(), &near),
        ObstacleShape::Cylinder {
            point,
            axis,
            radius,
            ..
        } => {
            let axis = Vector3::from(*axis).normalize();
            let point = Vector3::from(*point);
            let middle = point + axis * (near.centre - point).dot(&axis);
            let half = axis * near.radius;
            barrel([middle - half, middle + half], *radius)
        }
        ObstacleShape::Sphere { centre, radius, .. } => sphere(&(*centre).into(), *radius),
        ObstacleShape::Capsule { from, to, radius } => {
            let (from, to) = (Vector3::from(*from), Vector3::from(*to));
            let mut lines = barrel([from, to], *radius);
            let axis = (to - from).normalize();
            for (end, axis) in [(from, -axis), (to, axis)] {
                for side in across(&axis) {
                    lines.push(circle(&end, &[side, axis], *radius, [0.0, 0.5 * TAU]));
                }
            }
            lines
        }
        ObstacleShape::Disc { .. } | ObstacleShape::Segment { .. } | ObstacleShape::Polygon(_) => {
            let lines = outline_in_plane(obstacle, &near.centre, near.radius);
            let raised = |line: Vec<[f64; 2]>| line.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
            lines.into_iter().map(raised).collect()
        }
        ObstacleShape::Box {
            centre,
            sides,
            rotation,
        } => {
            let turn = rotation.map_or_else(Rotation3::identity, |turn| turn.matrix());
            cuboid(&(*centre).into(), &Vector3::from(*sides), &turn)
        }
    }
}

/// Lines on an obstacle of the plane z = 0, those of a half-space within `radius` of `centre`. Strokes stand behind the
/// border of a half-space. Other obstacles are closed lines, or the round ends of a bar.
pub fn outline_in_plane(
    obstacle: &Obstacle,
    centre: &Vector3<f64>,
    radius: f64,
) -> Vec<Vec<[f64; 2]>> {
    let flat = |line: Polyline| line.into_iter().map(|[x, y, _]| [x, y]).collect();
    let axes = [Vector3::x(), Vector3::y()];
    match &obstacle.shape {
        ObstacleShape::Plane { point, normal } => {
            let point = Vector3::from(*point);
            let normal = Vector3::from(*normal).normalize();
            let along = Vector3::z().cross(&normal);
            let middle = centre - normal * (centre - point).dot(&normal);
            let ends = [-1.0, 1.0].map(|side| middle + along * (side * radius));
            let mut lines = vec![ends.map(|at| [at.x, at.y]).to_vec()];
            for i in 0..STROKES {
                let from = ends[0].lerp(&ends[1], (i as f64 + 0.5) / STROKES as f64);
                let to = from - (normal + along) * (radius / STROKES as f64);
                lines.push([from, to].map(|at| [at.x, at.y]).to_vec());
            }
            lines
        }
        ObstacleShape::Disc { centre, radius, .. } => {
            vec![flat(circle(&(*centre).into(), &axes, *radius, [0.0, TAU]))]
        }
        ObstacleShape::Segment { from, to, radius } => {
            let (from, to) = (Vector3::from(*from), Vector3::from(*to));
            let axis = (to - from).normalize();
            let side = Vector3::z().cross(&axis);
            let half = [0.0, 0.5 * TAU];
            let mut line = circle(&to, &[-side, axis], *radius, half);
            line.extend(circle(&from, &[side, -axis], *radius, half));
            line.extend(line.first().copied());
            vec![flat(line)]
        }
        ObstacleShape::Polygon(corners) => {
            vec![corners.iter().chain(corners.first()).copied().collect()]
        }
        ObstacleShape::Cylinder { .. }
        | ObstacleShape::Sphere { .. }
        | ObstacleShape::Capsule { .. }
        | ObstacleShape::Box { .. } => Vec::new(),
    }
}

/// A square patch below the points.
fn plane(point: &Vector3<f64>, normal: &Vector3<f64>, near: &Near) -> Vec<Polyline> {
    let normal = normal.normalize();
    let centre = near.centre - normal * (near.centre - point).dot(&normal);
    let [a, b] = across(&normal);
    let mut lines = Vec::new();
    for i in 0..LINES {
        let at = near.radius * (2.0 * i as f64 / (LINES - 1) as f64 - 1.0);
        for (along, aside) in [(a, b), (b, a)] {
            let ends = [-near.radius, near.radius];
            lines.push(
                ends.map(|end| (centre + along * end + aside * at).into())
                    .to_vec(),
            );
        }
    }
    lines
}

/// Rings and lines of a cylinder between two points of its axis.
fn barrel(ends: [Vector3<f64>; 2], radius: f64) -> Vec<Polyline> {
    let [from, to] = ends;
    let sides = across(&(to - from).normalize());
    let mut lines: Vec<Polyline> = [0.0, 0.5, 1.0]
        .map(|part| circle(&(from + (to - from) * part), &sides, radius, [0.0, TAU]))
        .to_vec();
    for i in 0..STAVES {
        let angle = TAU * i as f64 / STAVES as f64;
        let aside = (sides[0] * angle.cos() + sides[1] * angle.sin()) * radius;
        lines.push(ends.map(|end| (end + aside).into()).to_vec());
    }
    lines
}

fn sphere(centre: &Vector3<f64>, radius: f64) -> Vec<Polyline> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut lines = Vec::new();
    for axis in &axes {
        lines.push(circle(centre, &across(axis), radius, [0.0, TAU]));
    }
    for height in [-0.5, 0.5] {
        let ring = radius * (1.0_f64 - height * height).sqrt();
        let middle = centre + Vector3::z() * (height * radius);
        lines.push(circle(&middle, &across(&Vector3::z()), ring, [0.0, TAU]));
    }
    lines
}

fn cuboid(centre: &Vector3<f64>, sides: &Vector3<f64>, turn: &Rotation3<f64>) -> Vec<Polyline> {
    let corner = |signs: [f64; 3]| {
        let half = 0.5 * sides.component_mul(&Vector3::from(signs));
        (centre + turn * half).into()
    };
    let mut lines = Vec::new();
    for axis in 0..3 {
        for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let edge = [-1.0, 1.0].map(|end| {
                let mut signs = [0.0; 3];
                (signs[axis], signs[(axis + 1) % 3], signs[(axis + 2) % 3]) = (end, s, t);
                corner(signs)
            });
            lines.push(edge.to_vec());
        }
    }
    lines
}
