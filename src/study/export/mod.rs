//! Export of a motion: poses of bodies and shapes of rods at given times, as NumPy arrays, for ParaView and as glTF.

mod gltf;
mod hdf5;
mod npz;
mod vtk;

pub use gltf::gltf;
pub use npz::{Array, npz};
pub use vtk::vtk;

use super::Hooks;
use super::run::{Moment, Prepared, Shapes, shapes::at_times};
use crate::error::Result;
use crate::motion::State;

/// Bodies and rods at one time, in the world and the scene's units.
#[derive(Debug, Clone)]
pub struct Posed {
    /// The state, without labels and index.
    pub now: Moment,
    /// Sections of each rod, from base to end.
    pub rods: Shapes,
}

/// Bodies and rods at `times`, in any order. As in [`run::shapes`](super::run::shapes) the motion is computed again
/// and stops at each time exactly. A light rod has `points` sections, a rod with strain unknowns `points` per
/// element.
///
/// # Errors
/// A time that the motion, or its trunk, does not reach; rods without a shape; an interrupt.
pub fn posed(
    of: &Prepared,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<Vec<Posed>> {
    let mut seen = |state: &dyn State| {
        let (now, rods) = (of.moment_without_index(state), of.curves(state, points)?);
        Ok(Posed { now, rods })
    };
    at_times(of, times, hooks, &mut seen)
}

/// Arrays of the shapes. `time` has the shape (T). Each rod has `s` (T, S), the arclength in the unstrained rod,
/// `position` (T, S, 3) and `directors` (T, S, 3, 3), with d1, d2, d3 in the rows; named rods prefix these by
/// `NAME.`. Moments with fewer sections than others are filled with NaN.
pub fn shape_arrays(names: &[String], moments: &[Posed]) -> Vec<Array> {
    let times: Vec<f64> = moments.iter().map(|at| at.now.t).collect();
    let mut arrays = vec![Array::reals("time", &[times.len()], &times)];
    for (k, name) in names.iter().enumerate() {
        let rods = || moments.iter().map(|at| at.rods.get(k));
        let most = rods().flatten().map(Vec::len).max().unwrap_or(0);
        let (mut s, mut position, mut directors) = (Vec::new(), Vec::new(), Vec::new());
        for rod in rods() {
            let rod = rod.map_or(&[][..], Vec::as_slice);
            for (at, pose) in rod {
                s.push(*at);
                position.extend(pose.translation.vector.iter());
                // The columns of the matrix are the directors.
                directors.extend(pose.rotation.to_rotation_matrix().matrix().iter());
            }
            let missing = most - rod.len();
            s.extend(std::iter::repeat_n(f64::NAN, missing));
            position.extend(std::iter::repeat_n(f64::NAN, 3 * missing));
            directors.extend(std::iter::repeat_n(f64::NAN, 9 * missing));
        }
        let named = |what: &str| match name.as_str() {
            "" => what.to_owned(),
            name => format!("{name}.{what}"),
        };
        let count = times.len();
        arrays.extend([
            Array::reals(named("s"), &[count, most], &s),
            Array::reals(named("position"), &[count, most, 3], &position),
            Array::reals(named("directors"), &[count, most, 3, 3], &directors),
        ]);
    }
    arrays
}
