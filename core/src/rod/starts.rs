//! Starts of the paths to a solution: the unloaded rod, and others that lead past bifurcations and folds.

use super::chart::{Chart, dynamic};
use super::closed_form::ClosedForm;
use super::free_end::FreeEnd;
use super::ivp::Wrench;
use super::planar::Plane;
use super::problem::{EndConditions, Problem};
use crate::elastica::Elastica;
use crate::manifold::Multivalued;
use nalgebra::{Rotation3, Vector2, Vector3, Vector6};
use std::f64::consts::FRAC_PI_3;

/// Intrinsic flexures (u1, u2, u3 times L) in generic directions, which break every symmetry and so lead past
/// bifurcations.
const IMPERFECTIONS: [[f64; 3]; 4] = [
    [0.11, 0.23, 0.01],
    [0.21, -0.13, -0.02],
    [-0.12, -0.22, 0.015],
    [0.7, 0.4, 0.05],
];
/// Intrinsic flexures within a plane.
const PLANAR_IMPERFECTIONS: [f64; 3] = [0.25, -0.25, 0.8];

/// Start of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PathStart {
    /// The unloaded rod.
    Unloaded,
    /// The unloaded rod with an intrinsic curvature that is removed by the end of the path.
    Bent(Vector3<f64>),
    /// The rod under a base wrench (in the numerics' units), with no load along it.
    Loaded(Wrench),
    /// The rod under a base wrench, with all of the load along it.
    Resting(Wrench),
    /// The rod pulled along its clamp's d3; the pull is then turned about this axis into the direction of the force.
    Turned(Vector3<f64>),
}

impl PathStart {
    /// Description of the start, for messages.
    pub(super) fn description(self) -> &'static str {
        match self {
            Self::Unloaded => "from the unloaded rod",
            Self::Bent(_) => "from a slightly bent rod",
            Self::Loaded(_) | Self::Resting(_) => "from another shape of the rod",
            Self::Turned(_) => "from the rod pulled straight",
        }
    }
}

impl Problem {
    /// Starts of a rod in a plane.
    pub(super) fn planar_starts(&self, plane: &Plane) -> impl Iterator<Item = PathStart> {
        // Same side relative to the data in both of two problems that are mirror images within the plane.
        let [one, other] = self.hands();
        let side = (one * plane.normal().y - other * plane.normal().x).signum();
        let normal = plane.normal() * side;
        let bends = PLANAR_IMPERFECTIONS.map(|size| PathStart::Bent(normal * size));
        let arcs = self.arcs(&[normal, -normal]);
        // Bows to both sides, made by a follower force on the end.
        let held = self.end.position.iter().any(Option::is_some);
        let sides: &[f64] = if held { &[3.0, -3.0] } else { &[] };
        let sides = sides.iter().map(move |across| across * side);
        let bows = sides.filter_map(|across| {
            let q = plane.lift(Vector2::new(-0.3, across));
            FreeEnd
                .wrench(self, &dynamic(q))
                .ok()
                .map(PathStart::Loaded)
        });
        std::iter::once(PathStart::Unloaded)
            .chain(self.start_by_pull(normal))
            .chain(self.ball_jointed())
            .chain(bows)
            .chain(bends)
            .chain(arcs.into_iter().map(PathStart::Loaded))
    }

    /// Start for a dead force: a pull along the rod, stable whatever its size, then turned about `axis`.
    fn start_by_pull(&self, axis: Vector3<f64>) -> Option<PathStart> {
        let free = self.orientation.is_none() && self.end.position.iter().all(Option::is_none);
        let force = self.whole_force();
        let across = Vector3::z().cross(&force);
        let axis = if across.norm() > 1e-9 * force.norm() {
            across.normalize()
        } else {
            axis
        };
        (free && !self.is_followed() && force.norm() > 1.0).then_some(PathStart::Turned(axis))
    }

    fn turned(&self) -> Option<PathStart> {
        self.start_by_pull(self.axis_across())
    }

    /// A generic axis across d3.
    fn axis_across(&self) -> Vector3<f64> {
        let [one, other] = self.hands();
        Vector3::new(0.6 * other, 0.8 * one, 0.0)
    }

    /// The imperfections, mirrored like the problem.
    fn bends(&self) -> [PathStart; 4] {
        let [one, other] = self.hands();
        IMPERFECTIONS
            .map(|[a, b, twist]| PathStart::Bent([other * a, one * b, one * other * twist].into()))
    }

    /// Signs (1 or -1) of the sides of d1 and d2 on which the data lie; mirroring the problem along a director
    /// changes its sign. Generic directions are taken to these sides. The starts of a mirror image are then the
    /// mirror images of the starts, and lead to mirror images of the same solutions. Places and forces along d1, and
    /// couples and flexures about d2, change sign if d1 is mirrored; couples and twist along d3 if either is.
    fn hands(&self) -> [f64; 2] {
        let part = |held: bool| -> Vector3<f64> {
            let among = (0..3).filter(|i| self.end.position[*i].is_some() == held);
            among.map(|i| self.axes[i] * self.targets[i]).sum()
        };
        let weight = self.weight.as_ref().map(|weight| weight.total());
        let polar = [part(true), part(false), weight.unwrap_or_default()];
        let rest = self.rod.law.inverse(0.0, &Vector6::zeros());
        let rest = rest.map_or_else(
            |_| Vector3::zeros(),
            |at| at.strain.fixed_rows::<3>(0).into(),
        );
        let turn = self.orientation.map_or_else(Vector3::zeros, |target| {
            Rotation3::from_matrix_unchecked(target).scaled_axis()
        });
        let axial = [self.couple, rest, turn];
        // Smaller components of a vector are rounding.
        let sign = |x: f64, of: &Vector3<f64>| (x.abs() > 1e-9 * of.norm()).then_some(x.signum());
        let first = |along: usize, about: usize| {
            let along = polar.iter().find_map(|v| sign(v[along], v));
            along.or_else(|| axial.iter().find_map(|v| sign(v[about], v)))
        };
        let twist = axial.iter().find_map(|v| sign(v.z, v)).unwrap_or(1.0);
        match (first(0, 1), first(1, 0)) {
            (Some(one), Some(other)) => [one, other],
            (Some(one), None) => [one, one * twist],
            (None, Some(other)) => [other * twist, other],
            (None, None) => [1.0, twist],
        }
    }

    /// Dead force on the end, in the clamp's frame.
    pub(super) fn dead_force(&self) -> Vector3<f64> {
        (0..3).map(|i| self.axes[i] * self.targets[i]).sum()
    }

    /// Dead force on the end plus the whole load along the rod.
    pub(super) fn whole_force(&self) -> Vector3<f64> {
        match &self.weight {
            None => self.dead_force(),
            Some(weight) => self.dead_force() + weight.total(),
        }
    }

    /// Fraction of the load along the rod at the start of a path.
    pub(super) fn first_part(&self, start: PathStart) -> f64 {
        match start {
            PathStart::Unloaded | PathStart::Bent(_) | PathStart::Loaded(_) => 0.0,
            PathStart::Turned(_) => self.pull() / self.whole_force().norm(),
            PathStart::Resting(_) => 1.0,
        }
    }

    /// A pull that bends the rod, lam = 3, and is easy to follow; the whole force if that is smaller.
    pub(super) fn pull(&self) -> f64 {
        let [a, b] = self.rod.law.flexures();
        self.whole_force().norm().min(9.0 / a.max(b))
    }

    /// Starts in the chart of the force along the directors of the end: the unloaded rod, a turned pull, bent rods; if
    /// the end is held, also bows to all sides.
    pub(super) fn free_starts(&self) -> impl Iterator<Item = PathStart> {
        std::iter::once(PathStart::Unloaded)
            .chain(self.turned())
            .chain(self.bends())
            .chain(self.bows_to_six_sides())
    }

    /// Bows of a held end to six sides.
    fn bows_to_six_sides(&self) -> impl Iterator<Item = PathStart> {
        let held = self.end.position.iter().any(Option::is_some);
        let [one, other] = self.hands();
        (0..if held { 6 } else { 0 }).filter_map(move |k| {
            let (sin, cos) = (1.1 + FRAC_PI_3 * f64::from(k)).sin_cos();
            let q = Vector3::new(3.0 * one * cos, 3.0 * other * sin, -0.3);
            FreeEnd
                .wrench(self, &dynamic(q))
                .ok()
                .map(PathStart::Loaded)
        })
    }

    /// Starts in space: the unloaded rod, a turned pull, the rod with its end free to turn, bent rods, arcs; under a
    /// load along the rod also bows.
    pub(super) fn starts(&self) -> impl Iterator<Item = PathStart> {
        let across = self.held_place().map(|place| Vector3::z().cross(&place));
        let axis = across
            .filter(|across| across.norm() > 1e-3)
            .unwrap_or(self.axis_across());
        let [one, other] = self.hands();
        let side = Vector3::z().cross(&axis) * (one * other);
        let axes = [
            axis,
            axis + 0.5 * side,
            axis - 0.5 * side,
            side,
            -side,
            -axis,
        ];
        // A small force breaks every symmetry.
        let force = Vector6::new(0.0, 0.0, 0.0, 0.1 * one, 0.07 * other, 0.05);
        let arcs = self.arcs(&axes).into_iter().map(move |b| b + force);
        std::iter::once(PathStart::Unloaded)
            .chain(self.turned())
            .chain(self.ball_jointed())
            .chain(self.bends())
            .chain(arcs.map(PathStart::Loaded))
            .chain(
                (self.weight.is_some())
                    .then(|| self.bows_to_six_sides())
                    .into_iter()
                    .flatten(),
            )
    }

    /// Points of the chart from which a path may lead to the target: a small load, or bows to both sides; then, if
    /// need be, every stable elastica with its end at the target.
    pub(super) fn closed_starts(&self, chart: &ClosedForm) -> impl Iterator<Item = PathStart> {
        let target = chart.target(self);
        let held = self.end.position[0].is_some();
        let bows =
            [1.0, -1.0].map(|side: f64| ClosedForm::at(side.copysign(side * target.y) * 0.6, 1.2));
        let slight = chart.slightly_loaded(self, &(target * 1e-3));
        let first = slight.filter(|_| !held).into_iter().chain(bows);
        let all = move || {
            let found = held.then(|| Elastica.stable_at(&target).ok()).flatten();
            let found = found.unwrap_or_default().into_iter();
            found.map(|q| ClosedForm::at(q.x, q.y))
        };
        let rest = std::iter::once_with(all).flatten();
        first
            .chain(rest)
            .filter_map(|x| chart.wrench(self, &dynamic(x)).ok().map(PathStart::Loaded))
    }

    /// Circular arcs, made by couples about the given axes, whose chord is as long as the distance to be held. They
    /// serve when the unloaded rod cannot be moved (a straight inextensible rod is singular) or its path ends in a
    /// fold.
    fn arcs(&self, axes: &[Vector3<f64>]) -> Vec<Wrench> {
        let Some(target) = self.held_place() else {
            return Vec::new();
        };
        let chord = target.norm().clamp(0.05, 0.98);
        // 2 sin(k/2)/k = chord, by Newton's method from the small-angle value.
        let mut k = (24.0 * (1.0 - chord)).sqrt();
        for _ in 0..30 {
            let (s, c) = (0.5 * k).sin_cos();
            k -= (2.0 * s / k - chord) / (c / k - 2.0 * s / (k * k));
        }
        let wrench = |axis: &Vector3<f64>| {
            let m = axis.normalize() * k;
            Vector6::new(m.x, m.y, m.z, 0.0, 0.0, 0.0)
        };
        axes.iter().map(wrench).collect()
    }

    /// The rod with its end in place but free to turn; a path then turns the end into its orientation.
    fn ball_jointed(&self) -> impl Iterator<Item = PathStart> {
        std::iter::once_with(|| {
            self.orientation?;
            let ball = Problem {
                end: EndConditions {
                    orientation: None,
                    couple: Vector3::zeros(),
                    ..self.end
                },
                orientation: None,
                couple: Vector3::zeros(),
                ..self.clone()
            };
            let found = ball.solve(None).ok()?;
            Some(PathStart::Resting(self.rod.inward(&found.base)))
        })
        .flatten()
    }

    /// Held position of the end, if all its components are held.
    fn held_place(&self) -> Option<Vector3<f64>> {
        let held = self.end.position.iter().all(Option::is_some);
        held.then(|| (0..3).map(|i| self.axes[i] * self.targets[i]).sum())
    }
}
