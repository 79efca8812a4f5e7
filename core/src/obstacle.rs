//! Obstacles as signed distances with their first two derivatives.

use crate::error::{Error, Result};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitVector3, Vector2, Vector3};

/// A fixed body that rods and other bodies do not enter, as a signed distance.
///
/// Planar scenes lie in z = 0: a disc is a cylinder along z, a segment a capsule, a polygon a prism along z.
/// All lengths are in one unit of the user's choice.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// The half-space behind a plane.
    Plane {
        /// A point of the plane.
        point: Vector3<f64>,
        /// The normal, from the obstacle outwards.
        normal: UnitVector3<f64>,
    },
    /// An infinite circular cylinder.
    Cylinder {
        /// A point of the axis.
        point: Vector3<f64>,
        /// The direction of the axis.
        axis: UnitVector3<f64>,
        /// The radius.
        radius: f64,
        /// True for a tube, touched from inside.
        inside: bool,
    },
    /// A sphere.
    Sphere {
        /// The centre.
        centre: Vector3<f64>,
        /// The radius.
        radius: f64,
        /// True for a shell, touched from inside.
        inside: bool,
    },
    /// All points within a distance from a segment.
    Capsule {
        /// One end of the segment.
        from: Vector3<f64>,
        /// Second end.
        to: Vector3<f64>,
        /// The distance; 0 for the segment itself.
        radius: f64,
    },
    /// A box.
    Cuboid {
        /// The centre.
        centre: Vector3<f64>,
        /// The box's axes as columns.
        rotation: Rotation3<f64>,
        /// Half of each side.
        half_sides: Vector3<f64>,
    },
    /// A convex polygon of the plane z = 0, extended along z without end; its corners go round counterclockwise.
    Prism {
        /// The corners (x, y).
        corners: Vec<Vector2<f64>>,
    },
}

/// The part of an obstacle's surface that is nearest to a point.
///
/// Where a path changes from one feature to another the normal is continuous and the Hessian jumps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// A smooth surface, or the face of this number.
    Face(u8),
    /// The edge of this number; of a prism, the edge over a corner.
    Edge(u8),
    /// The corner of this number; of a capsule, a cap.
    Corner(u8),
}

/// Signed distance from an obstacle's surface, less the thickness of the body there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Distance; negative inside of the obstacle.
    pub value: f64,
    /// Gradient of the distance: the unit normal from the obstacle outwards.
    pub normal: Vector3<f64>,
    /// Second derivative of the distance.
    pub hessian: Matrix3<f64>,
    /// The nearest part of the surface.
    pub feature: Feature,
}

impl Gap {
    /// Distance from a set of points that is locally a point, a line or a plane: `offset` is the vector from the
    /// nearest of the points, `moves_along` the projector on the directions in which the nearest point follows.
    ///
    /// At the set itself the normal is `fallback`, and the Hessian has no value: it is left out.
    fn from_set(
        offset: Vector3<f64>,
        moves_along: Matrix3<f64>,
        fallback: Vector3<f64>,
        feature: Feature,
    ) -> Self {
        let value = offset.norm();
        let normal = if value > 0.0 {
            offset / value
        } else {
            fallback
        };
        let hessian = if value > 0.0 {
            (Matrix3::identity() - moves_along - normal * normal.transpose()) / value
        } else {
            Matrix3::zeros()
        };
        Self {
            value,
            normal,
            hessian,
            feature,
        }
    }

    /// Distance from a flat face.
    fn from_face(value: f64, normal: Vector3<f64>, face: u8) -> Self {
        Self {
            value,
            normal,
            hessian: Matrix3::zeros(),
            feature: Feature::Face(face),
        }
    }

    /// The gap seen from inside: what touches is on the other side of the surface.
    fn inside_out(self) -> Self {
        Self {
            value: -self.value,
            normal: -self.normal,
            hessian: -self.hessian,
            feature: self.feature,
        }
    }

    /// The gap of a body that is thicker by `thickness` (of a rod: half its diameter; of a ball: its radius).
    #[must_use]
    pub fn less(mut self, thickness: f64) -> Self {
        self.value -= thickness;
        self
    }
}

/// A unit vector across `axis`.
fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let least = axis.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    (other - axis * axis[least]).normalize()
}

/// Refuses a vector with a component that is not finite.
fn check_place(what: &str, place: &Vector3<f64>) -> Result<()> {
    if place.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{what} of components {}, {}, {} must be finite",
        place.x, place.y, place.z
    )))
}

/// Refuses a size that is not positive and finite.
fn check_size(what: &str, size: f64) -> Result<()> {
    if size > 0.0 && size.is_finite() {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{what} = {size} must be finite and > 0"
    )))
}

/// The direction of a vector.
fn direction(what: &str, vector: Vector3<f64>) -> Result<UnitVector3<f64>> {
    check_place(what, &vector)?;
    UnitVector3::try_new(vector, 0.0)
        .ok_or_else(|| Error::domain(format!("{what} must not be the zero vector")))
}

impl Obstacle {
    /// The half-space behind the plane through `point`; `normal`, of any length, points outwards.
    ///
    /// # Errors
    /// A component that is not finite; a normal of length 0.
    pub fn plane(point: Vector3<f64>, normal: Vector3<f64>) -> Result<Self> {
        check_place("the point of a plane", &point)?;
        let normal = direction("the normal of a plane", normal)?;
        Ok(Self::Plane { point, normal })
    }

    /// A cylinder about the axis through `point` along `axis` (of any length), to be touched from outside or inside.
    ///
    /// # Errors
    /// A component that is not finite; an axis of length 0; a radius that is not positive.
    pub fn cylinder(
        point: Vector3<f64>,
        axis: Vector3<f64>,
        radius: f64,
        inside: bool,
    ) -> Result<Self> {
        check_place("the point of a cylinder", &point)?;
        check_size("the radius of a cylinder", radius)?;
        let axis = direction("the axis of a cylinder", axis)?;
        Ok(Self::Cylinder {
            point,
            axis,
            radius,
            inside,
        })
    }

    /// A sphere, to be touched from outside or inside.
    ///
    /// # Errors
    /// A component that is not finite; a radius that is not positive.
    pub fn sphere(centre: Vector3<f64>, radius: f64, inside: bool) -> Result<Self> {
        check_place("the centre of a sphere", &centre)?;
        check_size("the radius of a sphere", radius)?;
        Ok(Self::Sphere {
            centre,
            radius,
            inside,
        })
    }

    /// A disc of the plane z = 0, to be touched from outside or inside: a cylinder along z.
    ///
    /// # Errors
    /// A component that is not finite; a radius that is not positive.
    pub fn disc(centre: Vector2<f64>, radius: f64, inside: bool) -> Result<Self> {
        let point = Vector3::new(centre.x, centre.y, 0.0);
        Self::cylinder(point, Vector3::z(), radius, inside)
    }

    /// All points within `radius` from the segment between two points.
    ///
    /// # Errors
    /// A component that is not finite; two equal points; a radius that is not finite or < 0.
    pub fn capsule(from: Vector3<f64>, to: Vector3<f64>, radius: f64) -> Result<Self> {
        check_place("the end of a capsule", &from)?;
        check_place("the end of a capsule", &to)?;
        direction("the vector between the ends of a capsule", to - from)?;
        if !(radius >= 0.0 && radius.is_finite()) {
            return Err(Error::domain(format!(
                "the radius of a capsule = {radius} must be finite and >= 0"
            )));
        }
        Ok(Self::Capsule { from, to, radius })
    }

    /// A box about `centre` with the given sides along the columns of `rotation`.
    ///
    /// # Errors
    /// A number that is not finite; a side that is not positive.
    pub fn cuboid(
        centre: Vector3<f64>,
        sides: Vector3<f64>,
        rotation: Rotation3<f64>,
    ) -> Result<Self> {
        check_place("the centre of a box", &centre)?;
        for side in &sides {
            check_size("the side of a box", *side)?;
        }
        if !rotation.matrix().iter().all(|x| x.is_finite()) {
            return Err(Error::domain("the rotation of a box must be finite"));
        }
        Ok(Self::Cuboid {
            centre,
            rotation,
            half_sides: 0.5 * sides,
        })
    }

    /// A convex polygon of the plane z = 0; its corners may go round either way.
    ///
    /// # Errors
    /// Fewer than 3 or more than 250 corners; a corner that is not finite; a polygon that crosses itself, is not
    /// convex or has three corners in a line.
    pub fn polygon(corners: &[Vector2<f64>]) -> Result<Self> {
        let n = corners.len();
        if !(3..=250).contains(&n) {
            return Err(Error::domain(format!(
                "a polygon of {n} corners must have from 3 to 250"
            )));
        }
        if !corners.iter().flatten().all(|x| x.is_finite()) {
            return Err(Error::domain("the corners of a polygon must be finite"));
        }
        let turn = |i: usize| {
            let [a, b, c] = [corners[i], corners[(i + 1) % n], corners[(i + 2) % n]];
            (b - a).perp(&(c - b))
        };
        let sense = turn(0).signum();
        // All turns have one sense, and together they are one turn: a star that crosses itself makes more.
        let mut whole = 0.0;
        for i in 0..n {
            let [a, b, c] = [corners[i], corners[(i + 1) % n], corners[(i + 2) % n]];
            let sine = turn(i) * sense;
            if !(sine > 0.0) {
                return Err(Error::domain(format!(
                    "the polygon is not convex at its corner {} = ({}, {})",
                    (i + 1) % n,
                    b.x,
                    b.y
                )));
            }
            whole += sine.atan2((b - a).dot(&(c - b)));
        }
        if whole > 1.5 * std::f64::consts::TAU {
            return Err(Error::domain("the polygon crosses itself"));
        }
        let mut corners = corners.to_vec();
        if sense < 0.0 {
            corners.reverse();
        }
        Ok(Self::Prism { corners })
    }

    /// The name of the obstacle in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Cylinder { .. } => "cylinder",
            Self::Sphere { .. } => "sphere",
            Self::Capsule { .. } => "capsule",
            Self::Cuboid { .. } => "box",
            Self::Prism { .. } => "polygon",
        }
    }

    /// Half of the least thickness; infinite for planes, and for tubes and shells that are touched from inside.
    pub fn least_radius(&self) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Cylinder { radius, inside, .. } | Self::Sphere { radius, inside, .. } => {
                if *inside {
                    f64::INFINITY
                } else {
                    *radius
                }
            }
            Self::Capsule { radius, .. } => *radius,
            Self::Cuboid { half_sides, .. } => half_sides.min(),
            Self::Prism { corners } => {
                let count = corners.len();
                // The width across each edge is the distance of the farthest corner.
                let widths = (0..count).map(|i| {
                    let (a, b) = (corners[i], corners[(i + 1) % count]);
                    let along = (b - a).normalize();
                    let each = corners.iter().map(|corner| along.perp(&(corner - a)).abs());
                    each.fold(0.0, f64::max)
                });
                0.5 * widths.fold(f64::INFINITY, f64::min)
            }
        }
    }

    /// The obstacle in the coordinates of a frame at this place. A polygon is seen from frames in its plane alone.
    #[must_use]
    pub fn seen_from(&self, frame: &Isometry3<f64>) -> Self {
        let inverse = frame.inverse();
        let place = |x: &Vector3<f64>| inverse.transform_point(&(*x).into()).coords;
        let turned = |v: &UnitVector3<f64>| inverse.rotation * v;
        match self {
            Self::Plane { point, normal } => Self::Plane {
                point: place(point),
                normal: turned(normal),
            },
            Self::Cylinder {
                point,
                axis,
                radius,
                inside,
            } => Self::Cylinder {
                point: place(point),
                axis: turned(axis),
                radius: *radius,
                inside: *inside,
            },
            Self::Sphere {
                centre,
                radius,
                inside,
            } => Self::Sphere {
                centre: place(centre),
                radius: *radius,
                inside: *inside,
            },
            Self::Capsule { from, to, radius } => Self::Capsule {
                from: place(from),
                to: place(to),
                radius: *radius,
            },
            Self::Cuboid {
                centre,
                rotation,
                half_sides,
            } => Self::Cuboid {
                centre: place(centre),
                rotation: inverse.rotation.to_rotation_matrix() * rotation,
                half_sides: *half_sides,
            },
            Self::Prism { corners } => Self::Prism {
                corners: (corners.iter())
                    .map(|corner| place(&Vector3::new(corner.x, corner.y, 0.0)).xy())
                    .collect(),
            },
        }
    }

    /// The gap between the surface and the point `x`.
    ///
    /// Inside of boxes and polygons the gap is the least depth below a face. On the axis of a cylinder, in the centre
    /// of a sphere and on the segment of a capsule the normal is one of many, and the Hessian is zero.
    pub fn gap(&self, x: &Vector3<f64>) -> Gap {
        match self {
            Self::Plane { point, normal } => Gap::from_face(normal.dot(&(x - point)), **normal, 0),
            Self::Cylinder {
                point,
                axis,
                radius,
                inside,
            } => {
                let along = **axis * axis.transpose();
                let d = x - point;
                let gap = Gap::from_set(d - along * d, along, across(axis), Feature::Face(0))
                    .less(*radius);
                if *inside { gap.inside_out() } else { gap }
            }
            Self::Sphere {
                centre,
                radius,
                inside,
            } => {
                let gap =
                    Gap::from_set(x - centre, Matrix3::zeros(), Vector3::z(), Feature::Face(0))
                        .less(*radius);
                if *inside { gap.inside_out() } else { gap }
            }
            Self::Capsule { from, to, radius } => {
                let side = to - from;
                let part = (x - from).dot(&side) / side.norm_squared();
                let fallback = across(&side.normalize());
                let gap = if part <= 0.0 {
                    Gap::from_set(x - from, Matrix3::zeros(), fallback, Feature::Corner(0))
                } else if part >= 1.0 {
                    Gap::from_set(x - to, Matrix3::zeros(), fallback, Feature::Corner(1))
                } else {
                    let along = side * side.transpose() / side.norm_squared();
                    let nearest = from + side * part;
                    Gap::from_set(x - nearest, along, fallback, Feature::Face(0))
                };
                gap.less(*radius)
            }
            Self::Cuboid {
                centre,
                rotation,
                half_sides,
            } => cuboid_gap(&(rotation.inverse() * (x - centre)), half_sides).turned(rotation),
            Self::Prism { corners } => prism_gap(x, corners),
        }
    }
}

impl Gap {
    /// The gap in axes turned by `rotation`.
    #[must_use]
    pub fn turned(self, rotation: &Rotation3<f64>) -> Self {
        Self {
            normal: rotation * self.normal,
            hessian: rotation.matrix() * self.hessian * rotation.matrix().transpose(),
            ..self
        }
    }
}

/// The gap of a box about the origin along the axes.
fn cuboid_gap(x: &Vector3<f64>, half: &Vector3<f64>) -> Gap {
    let beyond = x.abs() - half;
    let outside = beyond.map(|b| b > 0.0);
    let count = outside.iter().filter(|b| **b).count();
    let sign = |i: usize| if x[i] < 0.0 { -1.0 } else { 1.0 };
    let bit = |i: usize| u8::from(x[i] > 0.0) << i;
    if count <= 1 {
        // Nearest is a face: the one that the point is beyond, or the least deep one.
        let i = beyond.imax();
        let mut normal = Vector3::zeros();
        normal[i] = sign(i);
        let face = 2 * u8::try_from(i).unwrap_or(0) + u8::from(x[i] > 0.0);
        return Gap::from_face(beyond[i], normal, face);
    }
    let mut offset = Vector3::zeros();
    let mut along = Matrix3::zeros();
    let mut number = 0;
    for i in 0..3 {
        if outside[i] {
            offset[i] = beyond[i] * sign(i);
            number |= bit(i);
        } else {
            along[(i, i)] = 1.0;
            number |= u8::try_from(i).unwrap_or(0) << 3;
        }
    }
    let feature = if count == 3 {
        Feature::Corner(number)
    } else {
        Feature::Edge(number)
    };
    Gap::from_set(offset, along, Vector3::x(), feature)
}

/// The gap of a prism along z over a convex polygon that goes round counterclockwise.
fn prism_gap(x: &Vector3<f64>, corners: &[Vector2<f64>]) -> Gap {
    let n = corners.len();
    let place = x.xy();
    let number = |i: usize| u8::try_from(i).unwrap_or(u8::MAX);
    let mut nearest: Option<Gap> = None;
    let mut deepest: Option<Gap> = None;
    for i in 0..n {
        let (from, to) = (corners[i], corners[(i + 1) % n]);
        let side = to - from;
        let outwards = Vector2::new(side.y, -side.x).normalize();
        let normal = Vector3::new(outwards.x, outwards.y, 0.0);
        let height = outwards.dot(&(place - from));
        let face = Gap::from_face(height, normal, number(i));
        if deepest.is_none_or(|gap| height > gap.value) {
            deepest = Some(face);
        }
        if height <= 0.0 {
            continue;
        }
        let part = (place - from).dot(&side) / side.norm_squared();
        let corner = |at: usize| {
            let d = place - corners[at];
            let along = Vector3::z() * Vector3::z().transpose();
            let offset = Vector3::new(d.x, d.y, 0.0);
            Gap::from_set(offset, along, normal, Feature::Edge(number(at)))
        };
        let gap = if part <= 0.0 {
            corner(i)
        } else if part >= 1.0 {
            corner((i + 1) % n)
        } else {
            face
        };
        if nearest.is_none_or(|least| gap.value < least.value) {
            nearest = Some(gap);
        }
    }
    // A polygon has three corners or more, and so a deepest face.
    nearest
        .or(deepest)
        .unwrap_or_else(|| Gap::from_face(f64::INFINITY, Vector3::z(), 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obstacles() -> Vec<Obstacle> {
        let v = Vector3::new;
        let w = |x: f64, y: f64| Vector2::new(x, y);
        vec![
            Obstacle::plane(v(0.1, 0.2, 0.3), v(1.0, -2.0, 0.5)).unwrap(),
            Obstacle::cylinder(v(0.1, 0.0, -0.2), v(0.3, 1.0, 0.2), 0.4, false).unwrap(),
            Obstacle::cylinder(v(0.1, 0.0, -0.2), v(0.3, 1.0, 0.2), 0.4, true).unwrap(),
            Obstacle::sphere(v(0.3, -0.1, 0.2), 0.5, false).unwrap(),
            Obstacle::sphere(v(0.3, -0.1, 0.2), 0.5, true).unwrap(),
            Obstacle::capsule(v(-0.2, 0.1, 0.0), v(0.5, 0.4, 0.3), 0.1).unwrap(),
            Obstacle::cuboid(
                v(0.1, 0.1, 0.1),
                v(0.8, 0.5, 0.3),
                Rotation3::from_euler_angles(0.3, -0.4, 0.9),
            )
            .unwrap(),
            Obstacle::polygon(&[w(0.0, 0.5), w(0.6, 0.1), w(0.2, -0.5), w(-0.4, -0.3)]).unwrap(),
        ]
    }

    /// Catches a wrong sign or a missing term in a gradient or a Hessian: central differences of the value.
    #[test]
    fn derivatives_agree_with_differences() {
        let mut features = std::collections::BTreeSet::new();
        for obstacle in &obstacles() {
            for k in 0..400 {
                let k = f64::from(k);
                let x = Vector3::new((1.7 * k).sin(), (2.3 * k + 1.0).sin(), (3.1 * k).cos()) * 1.2;
                let gap = obstacle.gap(&x);
                features.insert(format!("{:?}", gap.feature));
                assert!((gap.normal.norm() - 1.0).abs() < 1e-14);
                let h = 1e-5;
                for i in 0..3 {
                    let mut step = Vector3::zeros();
                    step[i] = h;
                    let (above, below) = (obstacle.gap(&(x + step)), obstacle.gap(&(x - step)));
                    if above.feature != gap.feature || below.feature != gap.feature {
                        continue;
                    }
                    let slope = (above.value - below.value) / (2.0 * h);
                    assert!((slope - gap.normal[i]).abs() < 1e-7, "{obstacle:?} {x:?}");
                    let bend = (above.normal - below.normal) / (2.0 * h);
                    let column = gap.hessian.column(i);
                    let scale = 1.0 + gap.hessian.norm().powi(3);
                    assert!((bend - column).norm() < 1e-7 * scale, "{obstacle:?} {x:?}");
                }
            }
        }
        assert!(features.len() > 20, "{features:?}");
    }

    /// Catches a wrong nearest feature: the distance to the nearest of many points of the solid is no less.
    #[test]
    fn values_are_the_least_distances() {
        let v = Vector3::new;
        let cuboid = Obstacle::cuboid(Vector3::zeros(), v(2.0, 4.0, 6.0), Rotation3::identity());
        let cuboid = cuboid.unwrap();
        let near = |x: f64, y: f64, z: f64, value: f64| {
            assert!((cuboid.gap(&v(x, y, z)).value - value).abs() < 1e-15);
        };
        near(0.0, 0.0, 0.0, -1.0);
        near(0.5, 1.9, 0.0, -0.1);
        near(1.0 + 3.0, 2.0 + 4.0, 0.0, 5.0);
        near(-1.0 - 2.0, 2.0 + 3.0, -3.0 - 6.0, 7.0);
        let w = |x: f64, y: f64| Vector2::new(x, y);
        // A clockwise square is turned round.
        let square = Obstacle::polygon(&[w(0.0, 0.0), w(0.0, 1.0), w(1.0, 1.0), w(1.0, 0.0)]);
        let square = square.unwrap();
        assert_eq!(square.gap(&v(0.4, 0.5, 7.0)).value, -0.4);
        assert_eq!(square.gap(&v(4.0, 5.0, 7.0)).value, 5.0);
        assert_eq!(square.gap(&v(0.5, -2.0, 0.0)).value, 2.0);
    }

    /// Catches an obstacle without a meaning that is taken: each is refused.
    #[test]
    fn refuses_what_is_no_obstacle() {
        let v = Vector3::new;
        let w = |x: f64, y: f64| Vector2::new(x, y);
        let zero = Vector3::zeros();
        assert!(Obstacle::plane(zero, zero).is_err());
        assert!(Obstacle::plane(v(f64::NAN, 0.0, 0.0), Vector3::x()).is_err());
        assert!(Obstacle::cylinder(zero, zero, 1.0, true).is_err());
        assert!(Obstacle::cylinder(zero, Vector3::x(), 0.0, true).is_err());
        assert!(Obstacle::sphere(zero, f64::NAN, true).is_err());
        assert!(Obstacle::capsule(zero, zero, 1.0).is_err());
        assert!(Obstacle::capsule(zero, Vector3::x(), -1.0).is_err());
        assert!(Obstacle::cuboid(zero, v(1.0, 0.0, 1.0), Rotation3::identity()).is_err());
        let bent = [w(0.0, 0.0), w(2.0, 0.0), w(1.0, 0.5), w(1.0, 2.0)];
        assert!(Obstacle::polygon(&bent).is_err());
        let star: Vec<_> = (0..5)
            .map(|k| {
                let angle = 0.4 * std::f64::consts::TAU * f64::from(k);
                w(angle.cos(), angle.sin())
            })
            .collect();
        let error = Obstacle::polygon(&star).unwrap_err().to_string();
        assert!(error.contains("crosses"), "{error}");
    }
}
