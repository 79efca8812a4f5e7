//! Contacts of a body with an obstacle or with another body: for each pair of shapes a few gap functions.

use super::{Feature, Obstacle, PlacedShape, RigidMotion, Shape, Spread, Touch};
use crate::error::{Error, Result};
use nalgebra::{UnitVector3, Vector2, Vector3};

/// One gap function of a pair of rigid frames a and b.
///
/// A pair has several where a shape has several places that can touch: two ends, eight corners.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPair {
    kind: Kind,
    /// True if the first frame of `kind` is b.
    flipped: bool,
}

/// The plane of a face of an obstacle with sharp edges, in the obstacle's frame. The plane goes on beyond the edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    point: Vector3<f64>,
    normal: UnitVector3<f64>,
}

/// A gap function of a first and a second frame, each part in its own frame.
#[derive(Debug, Clone, PartialEq)]
enum Kind {
    /// A ball or a point of the first against the surface of the second.
    Knob {
        centre: Vector3<f64>,
        radius: f64,
        surface: Obstacle,
    },
    /// Capsules, or a capsule and an endless cylinder, side by side or crossed.
    Axes {
        first: CapsuleAxis,
        second: CapsuleAxis,
    },
    /// The rim at one end of a cylinder against a plane of the second.
    Rim {
        centre: Vector3<f64>,
        axis: Vector3<f64>,
        radius: f64,
        point: Vector3<f64>,
        normal: UnitVector3<f64>,
    },
}

/// The axis of a capsule, or of an endless cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CapsuleAxis {
    middle: Vector3<f64>,
    direction: Vector3<f64>,
    /// Infinite for a cylinder without end.
    half_length: f64,
    radius: f64,
}

impl CapsuleAxis {
    fn between(from: &Vector3<f64>, to: &Vector3<f64>, radius: f64) -> Self {
        Self {
            middle: 0.5 * (from + to),
            direction: (to - from).normalize(),
            half_length: 0.5 * (to - from).norm(),
            radius,
        }
    }
}

/// Largest sine of the angle between two parallel axes.
const PARALLEL: f64 = 1e-7;
/// Largest sine of the tilt of a standing cylinder.
const UPRIGHT: f64 = 1e-7;

impl ContactPair {
    /// The gap functions of a body (a) and an obstacle (b).
    ///
    /// # Errors
    /// A pair of shapes without a closed form here.
    pub fn of_obstacle(body: &PlacedShape, obstacle: &Obstacle) -> Result<Vec<Self>> {
        let pairs =
            surfaces(body, obstacle).ok_or_else(|| refusal(body.shape.name(), obstacle.name()))?;
        Ok(pairs)
    }

    /// The gap functions of two bodies. Two points never touch: they have none.
    ///
    /// # Errors
    /// A pair of shapes without a closed form here.
    pub fn of_bodies(a: &PlacedShape, b: &PlacedShape) -> Result<Vec<Self>> {
        if a.shape == Shape::Point && b.shape == Shape::Point {
            return Ok(Vec::new());
        }
        let forth = b.as_obstacle().and_then(|surface| surfaces(a, &surface));
        let back = || {
            let pairs = surfaces(b, &a.as_obstacle()?)?;
            Some(pairs.into_iter().map(Self::flip).collect())
        };
        forth
            .or_else(back)
            .ok_or_else(|| refusal(a.shape.name(), b.shape.name()))
    }

    fn flip(self) -> Self {
        Self {
            flipped: !self.flipped,
            ..self
        }
    }

    /// The face under a point at an obstacle with sharp edges. None for other pairs, and where an edge is nearest.
    pub fn face(&self, a: &RigidMotion, b: &RigidMotion) -> Option<Face> {
        let (first, second) = if self.flipped { (b, a) } else { (a, b) };
        let Kind::Knob {
            centre,
            radius: 0.0,
            surface: surface @ (Obstacle::Prism { .. } | Obstacle::Cuboid { .. }),
        } = &self.kind
        else {
            return None;
        };
        let x = second.seen(&first.place(centre));
        let gap = surface.gap(&x);
        matches!(gap.feature, Feature::Face(_)).then(|| Face {
            point: x - gap.normal * gap.value,
            normal: UnitVector3::new_normalize(gap.normal),
        })
    }

    /// The contact of the frames a and b with a face in place of the whole obstacle.
    pub fn touch_on(&self, face: &Face, a: &RigidMotion, b: &RigidMotion) -> Touch {
        let Kind::Knob { centre, radius, .. } = &self.kind else {
            return self.touch(a, b);
        };
        let (first, second) = if self.flipped { (b, a) } else { (a, b) };
        let plane = Obstacle::Plane {
            point: face.point,
            normal: face.normal,
        };
        let touch = knob(first, centre, *radius, second, &plane);
        if self.flipped {
            touch.turned_round()
        } else {
            touch
        }
    }

    /// The contact of the frames a and b.
    pub fn touch(&self, a: &RigidMotion, b: &RigidMotion) -> Touch {
        let (first, second) = if self.flipped { (b, a) } else { (a, b) };
        let touch = match &self.kind {
            Kind::Knob {
                centre,
                radius,
                surface,
            } => knob(first, centre, *radius, second, surface),
            Kind::Axes {
                first: one,
                second: two,
            } => axes(first, one, second, two),
            Kind::Rim {
                centre,
                axis,
                radius,
                point,
                normal,
            } => {
                let rim = Rim {
                    centre: first.place(centre),
                    axis: first.pose.rotation * axis,
                    radius: *radius,
                };
                rim.on_plane(
                    first,
                    second,
                    &second.place(point),
                    &(second.pose.rotation * **normal),
                )
            }
        };
        if self.flipped {
            touch.turned_round()
        } else {
            touch
        }
    }
}

fn refusal(one: &str, other: &str) -> Error {
    Error::domain(format!(
        "contact of a {one} with a {other} has no closed form here; use balls, capsules or several bodies in place of \
         one of them, or leave the pair out"
    ))
}

/// The gap functions of a shape (first) and an obstacle (second); None without a closed form.
fn surfaces(body: &PlacedShape, obstacle: &Obstacle) -> Option<Vec<ContactPair>> {
    let forth = |kind| ContactPair {
        kind,
        flipped: false,
    };
    let knob = |centre, radius| {
        forth(Kind::Knob {
            centre,
            radius,
            surface: obstacle.clone(),
        })
    };
    // The shape lies on the hollow side of these surfaces, and the farthest points touch.
    let hollow = matches!(
        obstacle,
        Obstacle::Plane { .. }
            | Obstacle::Sphere { inside: true, .. }
            | Obstacle::Cylinder { inside: true, .. }
    );
    // A sphere is a knob that touches the surface of the body.
    let sphere = || match obstacle {
        Obstacle::Sphere {
            centre,
            radius,
            inside: false,
        } => Some(vec![ContactPair {
            kind: Kind::Knob {
                centre: *centre,
                radius: *radius,
                surface: body.as_obstacle()?,
            },
            flipped: true,
        }]),
        _ => None,
    };
    match body.shape {
        Shape::Point => Some(vec![knob(body.middle(), 0.0)]),
        Shape::Ball { radius } => Some(vec![knob(body.middle(), radius)]),
        Shape::Capsule {
            half_length,
            radius,
        } => {
            let [from, to] = body.ends(half_length);
            if hollow {
                return Some(vec![knob(from, radius), knob(to, radius)]);
            }
            let second = match obstacle {
                Obstacle::Capsule { from, to, radius } => CapsuleAxis::between(from, to, *radius),
                Obstacle::Cylinder {
                    point,
                    axis,
                    radius,
                    ..
                } => CapsuleAxis {
                    middle: *point,
                    direction: **axis,
                    half_length: f64::INFINITY,
                    radius: *radius,
                },
                _ => return sphere(),
            };
            let first = CapsuleAxis::between(&from, &to, radius);
            Some(vec![forth(Kind::Axes { first, second })])
        }
        Shape::Cylinder {
            half_length,
            radius,
        } => {
            let Obstacle::Plane { point, normal } = obstacle else {
                return None;
            };
            let axis = body.place.rotation * Vector3::z();
            let rim = |centre| {
                forth(Kind::Rim {
                    centre,
                    axis,
                    radius,
                    point: *point,
                    normal: *normal,
                })
            };
            Some(body.ends(half_length).map(rim).to_vec())
        }
        Shape::Cuboid { half_sides } => {
            if hollow {
                let corners = body.corners(&half_sides);
                return Some(corners.into_iter().map(|c| knob(c, 0.0)).collect());
            }
            sphere()
        }
    }
}

/// A ball of the first frame at the surface of the second.
fn knob(
    first: &RigidMotion,
    centre: &Vector3<f64>,
    radius: f64,
    second: &RigidMotion,
    surface: &Obstacle,
) -> Touch {
    let x = first.place(centre);
    let x_rate = first.velocity_at(&x);
    let turn = second.pose.rotation;
    let gap = surface.gap(&second.seen(&x)).less(radius);
    let normal = turn * gap.normal;
    let relative = turn.inverse() * (x_rate - second.velocity_at(&x));
    let normal_rate = second.spin.cross(&normal) + turn * (gap.hessian * relative);
    Touch {
        gap: gap.value,
        normal,
        point: x - normal * radius,
        normal_rate,
        point_rate: x_rate - normal_rate * radius,
        spread: None,
    }
}

/// Nearest places of two axes: the parameters s along each, and whether each is free (not at an end).
fn nearest(between: &Vector3<f64>, d: [&Vector3<f64>; 2], half: [f64; 2]) -> ([f64; 2], [bool; 2]) {
    // Least |between + s0 d0 - s1 d1|.
    let cos = d[0].dot(d[1]);
    let (p, q) = (between.dot(d[0]), between.dot(d[1]));
    let sine2 = d[0].cross(d[1]).norm_squared();
    let clamp = |s: f64, half: f64| s.clamp(-half, half);
    let first = |s1: f64| clamp(cos * s1 - p, half[0]);
    let second = |s0: f64| clamp(cos * s0 + q, half[1]);
    let s0 = if sine2 > PARALLEL * PARALLEL {
        clamp((cos * q - p) / sine2, half[0])
    } else {
        // The middle of the stretch in which both lie side by side.
        let centre = -p;
        let low = (centre - half[1]).max(-half[0]);
        let high = (centre + half[1]).min(half[0]);
        clamp(0.5 * (low + high), half[0])
    };
    let s1 = second(s0);
    let s0 = if sine2 > PARALLEL * PARALLEL {
        first(s1)
    } else {
        s0
    };
    let s = [s0, s1];
    let free = std::array::from_fn(|i| s[i].abs() < half[i]);
    (s, free)
}

/// Two axes with their radii.
fn axes(first: &RigidMotion, one: &CapsuleAxis, second: &RigidMotion, two: &CapsuleAxis) -> Touch {
    let middles = [first.place(&one.middle), second.place(&two.middle)];
    let d = [
        first.pose.rotation * one.direction,
        second.pose.rotation * two.direction,
    ];
    let spins = [&first.spin, &second.spin];
    let between = middles[0] - middles[1];
    let half = [one.half_length, two.half_length];
    let (s, free) = nearest(&between, [&d[0], &d[1]], half);
    let places = [middles[0] + d[0] * s[0], middles[1] + d[1] * s[1]];
    let c = places[0] - places[1];
    let distance = c.norm();
    let cross = d[0].cross(&d[1]);
    let normal = if distance > 0.0 {
        c / distance
    } else {
        cross.try_normalize(0.0).unwrap_or_else(Vector3::x)
    };
    // Rates of the parameters keep the free ones at the nearest places: d0 . c = 0, d1 . c = 0.
    let rates = [
        first.velocity_at(&places[0]),
        second.velocity_at(&places[1]),
    ];
    let c_rate = rates[0] - rates[1];
    let drive: [f64; 2] =
        std::array::from_fn(|i| spins[i].cross(&d[i]).dot(&c) + d[i].dot(&c_rate));
    let cos = d[0].dot(&d[1]);
    let parallel = cross.norm() <= PARALLEL && free == [true, true];
    let s_rate = match free {
        [true, true] if !parallel => {
            let sine2 = cross.norm_squared();
            Vector2::new(
                (cos * drive[1] - drive[0]) / sine2,
                (drive[1] - cos * drive[0]) / sine2,
            )
        }
        [true, false] => Vector2::new(-drive[0], 0.0),
        [false, true] => Vector2::new(0.0, drive[1]),
        _ => Vector2::zeros(),
    };
    let total = c_rate + d[0] * s_rate[0] - d[1] * s_rate[1];
    let normal_rate = if distance > 0.0 {
        (total - normal * normal.dot(&total)) / distance
    } else {
        Vector3::zeros()
    };
    Touch {
        gap: distance - one.radius - two.radius,
        normal,
        point: places[0] - normal * one.radius,
        normal_rate,
        point_rate: rates[0] + d[0] * s_rate[0] - normal_rate * one.radius,
        spread: parallel.then_some(Spread::ParallelAxes),
    }
}

/// A rim in the world: centre, axis of the cylinder, radius.
struct Rim {
    centre: Vector3<f64>,
    axis: Vector3<f64>,
    radius: f64,
}

impl Rim {
    /// The lowest point of the rim over the plane through `point` with the normal `n`.
    fn on_plane(
        &self,
        first: &RigidMotion,
        second: &RigidMotion,
        point: &Vector3<f64>,
        n: &Vector3<f64>,
    ) -> Touch {
        let (axis, cos) = (self.axis, self.axis.dot(n));
        let across = n - axis * cos;
        let tilt = across.norm();
        let n_rate = second.spin.cross(n);
        let axis_rate = first.spin.cross(&axis);
        let centre_rate = first.velocity_at(&self.centre);
        // The direction up the end face, and its rate.
        let (up, up_rate) = if tilt > UPRIGHT {
            let up = across / tilt;
            let cos_rate = axis_rate.dot(n) + axis.dot(&n_rate);
            let rate = n_rate - axis_rate * cos - axis * cos_rate;
            (up, (rate - up * up.dot(&rate)) / tilt)
        } else {
            let mut other = Vector3::zeros();
            other[axis.iamin()] = 1.0;
            let up = (other - axis * axis.dot(&other)).normalize();
            (up, first.spin.cross(&up))
        };
        let lowest = self.centre - up * self.radius;
        Touch {
            gap: n.dot(&(lowest - point)),
            normal: *n,
            point: lowest,
            normal_rate: n_rate,
            point_rate: centre_rate - up_rate * self.radius,
            spread: (tilt <= UPRIGHT).then_some(Spread::FlatEnd),
        }
    }
}
