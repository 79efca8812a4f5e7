//! The clamp of a scene as a support of the body: pose and prescribed motion.

use crate::body::{Frame, History, PointMass, Support};
use crate::error::{Error, Quantity, Result};
use crate::motion::full_mass::EndVelocity;
use crate::scene::{
    Clamp, ClampMotion, Dimensionless, Orientation, Scales, Scene, Start, Translation, Turn,
};
use nalgebra::{Isometry3, SVector, Vector2, Vector3, Vector6};

use super::planar::in_plane;
use super::rod::rotation;

/// The clamp of a planar rod, in units of the rod; `None` for the default clamp, at rest in the origin along +x.
pub(super) fn planar(clamp: &Clamp) -> Result<Option<Support<2>>> {
    if *clamp == Clamp::default() {
        return Ok(None);
    }
    let [w, _, _, z] = clamp.orientation.quaternion();
    let angle = 2.0 * z.atan2(w);
    let mut support = Support::<2>::new(in_plane(clamp.position), angle).map_err(named)?;
    let Some(motion) = &clamp.motion else {
        return Ok(Some(support));
    };
    for (direction, history) in translations(motion, in_plane).map_err(named)? {
        support = support
            .with_translation(direction, history)
            .map_err(named)?;
    }
    if let Some(Turn::About { angle, .. }) = &motion.turn {
        support = smooth(angle)
            .and_then(|angle| support.with_turning(angle))
            .map_err(named)?;
    }
    Ok(Some(support))
}

/// An angle in time; a table as the smooth curve through its rows.
fn smooth(angle: &History) -> Result<History> {
    match angle {
        History::Table(rows) => History::smooth(rows),
        angle => Ok(angle.clone()),
    }
}

/// Frame of the clamp of a planar rod with this body at time `t`.
pub(super) fn frame(body: &PointMass<2>, t: f64) -> Frame<3> {
    match body.support() {
        Some(support) => support.in_space(t),
        None => Frame::standing(&Isometry3::identity()),
    }
}

/// The moving clamp of a rod in space, in units of the rod; `None` for a clamp at rest, whose frame is that of the run.
pub(super) fn spatial(clamp: &Clamp) -> Result<Option<Support<3>>> {
    let Some(motion) = &clamp.motion else {
        return Ok(None);
    };
    let place = Isometry3::from_parts(
        Vector3::from(clamp.position).into(),
        rotation(&clamp.orientation),
    );
    moving_support(&place, motion).map(Some).map_err(named)
}

/// The clamp of a planar rod as one in space, in units of the rod; `None` for the default clamp, at rest in the origin
/// along +x.
pub(super) fn clamp_in_space(clamp: &Clamp) -> Result<Option<Support<3>>> {
    if *clamp == Clamp::default() {
        return Ok(None);
    }
    let place = Isometry3::from_parts(
        Vector3::from(clamp.position).into(),
        rotation(&clamp.orientation),
    );
    let support = match &clamp.motion {
        None => Support::<3>::new(place.translation.vector, &place.rotation),
        Some(motion) => moving_support(&place, &out_of_plane(motion)),
    };
    support.map(Some).map_err(named)
}

/// Motion of the clamp of a planar rod as one in space.
pub(super) fn out_of_plane(motion: &ClampMotion) -> ClampMotion {
    let mut motion = motion.clone();
    if let Some(Translation::Table(rows)) = &mut motion.translate {
        rows.iter_mut().for_each(|row| row.resize(4, 0.0));
    }
    motion
}

/// A support in space that starts at `place` with the given motion, in units of the rod.
pub(super) fn moving_support(place: &Isometry3<f64>, motion: &ClampMotion) -> Result<Support<3>> {
    let mut support = Support::<3>::new(place.translation.vector, &place.rotation)?;
    for (direction, history) in translations(motion, Vector3::from)? {
        support = support.with_translation(direction, history)?;
    }
    match &motion.turn {
        None => Ok(support),
        Some(Turn::About { axis, angle }) => {
            support.with_turning(&Vector3::from(*axis), smooth(angle)?)
        }
        Some(Turn::Vectors { table }) => {
            let along = |i: usize| {
                let points: Vec<[f64; 2]> = table.iter().map(|row| [row[0], row[1 + i]]).collect();
                History::smooth(&points)
            };
            support.with_rotation_vector([along(0)?, along(1)?, along(2)?])
        }
    }
}

impl Scene {
    /// The scene frozen at t = 0: the clamp rests in its pose at that time, all velocities vanish, and the rod has no
    /// friction.
    ///
    /// # Errors
    /// A scene of statics; an invalid motion of the clamp.
    pub fn frozen_at_start(&self) -> Result<Self> {
        let plain = self.dimensionless()?;
        let frame = if self.is_planar() {
            planar(&plain.clamp)?.map(|support| support.in_space(0.0))
        } else {
            spatial(&plain.clamp)?.map(|support| support.at(0.0))
        };
        let mut standing = self.clone();
        if let (Some(_), Some(frame)) = (&self.clamp.motion, frame) {
            let pose = frame.pose();
            let q = pose.rotation.quaternion();
            standing.clamp = Clamp {
                position: (pose.translation.vector * self.scales()?.length).into(),
                orientation: Orientation::Quaternion([q.w, q.i, q.j, q.k]),
                motion: None,
                free: false,
            };
        }
        standing.rod.damping = None;
        standing.start = Start {
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            with_clamp: false,
            ..self.start.clone()
        };
        Ok(standing)
    }
}

fn named(error: Error) -> Error {
    error.context("[clamp]")
}

fn translations<const N: usize>(
    motion: &ClampMotion,
    inward: impl Fn([f64; 3]) -> SVector<f64, N>,
) -> Result<Vec<(SVector<f64, N>, History)>> {
    match &motion.translate {
        None => Ok(Vec::new()),
        Some(Translation::Sine { direction, sine }) => {
            let direction = inward(*direction);
            Ok(vec![(direction / direction.norm(), History::Sine(*sine))])
        }
        Some(Translation::Table(rows)) => {
            let along = |i: usize| {
                let points: Vec<[f64; 2]> = rows.iter().map(|row| [row[0], row[1 + i]]).collect();
                let axis = SVector::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
                Ok((axis, History::smooth(&points)?))
            };
            (0..N).map(along).collect()
        }
    }
}

/// The clamp of a planar rod at t = 0, for conversion of places and velocities from the world to its frame.
pub(super) struct ClampFrame(pub Option<Support<2>>);

impl ClampFrame {
    pub fn place(&self, place: [f64; 3]) -> Vector2<f64> {
        let place = in_plane(place);
        self.0.as_ref().map_or(place, |support| {
            let frame = support.at(0.0);
            frame.inward(&(place - frame.place(&Vector2::zeros())))
        })
    }

    /// Initial velocity relative to the clamp of an end at `end` in the clamp's frame, and the text `about` for
    /// messages on this start.
    pub fn velocity(
        &self,
        end: &Vector2<f64>,
        plain: &Dimensionless,
        about: &str,
        scales: &Scales,
    ) -> (Vector2<f64>, String) {
        let velocity = in_plane(plain.start.velocity);
        let Some(support) = &self.0 else {
            return (velocity, about.to_owned());
        };
        let frame = support.at(0.0);
        let carried = scales.outward(
            Quantity::Velocity,
            frame.outward(&frame.velocity_of_fixed_point(end)),
        );
        (
            initial_relative_velocity(&frame, end, &velocity, plain),
            start_context(about, &[("velocity", carried.as_slice())], plain),
        )
    }
}

/// Velocity at t = 0, relative to the moving clamp's frame, of an end at `place` in that frame. `velocity` is its given
/// velocity along the axes of the world.
pub(super) fn initial_relative_velocity<const D: usize>(
    frame: &Frame<D>,
    place: &SVector<f64, D>,
    velocity: &SVector<f64, D>,
    plain: &Dimensionless,
) -> SVector<f64, D> {
    if plain.start.with_clamp {
        frame.inward(velocity)
    } else {
        frame.relative(place, velocity)
    }
}

/// Initial velocity of the end of a rod with mass on this clamp. `given` is (angular velocity, velocity) as in
/// `[start]`.
pub(super) fn end_velocity(
    clamp: Option<&Support<3>>,
    given: &Vector6<f64>,
    plain: &Dimensionless,
) -> EndVelocity {
    match clamp {
        Some(clamp) if plain.start.with_clamp => {
            EndVelocity::OnClamp(clamp.at(0.0).of_poses().inward(given))
        }
        _ => EndVelocity::InWorld(*given),
    }
}

/// Extends the text `about` for messages on a rejected start by the velocities with which the clamp carries the end at
/// t = 0: the user may have forgotten them.
pub(super) fn start_context(
    about: &str,
    carried: &[(&str, &[f64])],
    plain: &Dimensionless,
) -> String {
    let moving = |(_, rates): &(&str, &[f64])| rates.iter().any(|rate| *rate != 0.0);
    if plain.start.with_clamp || !carried.iter().any(moving) {
        return about.to_owned();
    }
    let named: Vec<String> = carried
        .iter()
        .map(|(name, rates)| format!("{name} = {rates:?}"))
        .collect();
    format!(
        "{about} (the clamp moves at t = 0: an end at rest on it has {} in the world; with_clamp = true in [start] adds that)",
        named.join(" and ")
    )
}
