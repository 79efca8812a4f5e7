//! ParaView and VTK files in XML: an unstructured grid (VTU) for each time, and a collection (PVD) of the grids with
//! their times.

use super::Posed;
use nalgebra::{Isometry3, UnitQuaternion};
use std::fmt::Write;

/// Numbers of cell types in VTK.
const VERTEX: u8 = 1;
const POLYLINE: u8 = 4;

/// Rods as lines, bodies and places of contacts as points. Point data: `d1`, `d2`, `d3`, the directors of a section or
/// axes of a body frame; `s`, the arclength in the unstrained rod (0 for a body); `velocity` of bodies (0 for sections,
/// whose velocities are not computed). A run with contacts has `contact_force`, the force on the body. Cell data:
/// `rod`, the index of the rod, and `body`, the index of the body; -1 for others.
pub fn vtk_frame(at: &Posed) -> String {
    let mut points: Vec<(f64, Isometry3<f64>, [f64; 3])> = Vec::new();
    let mut cells: Vec<(u8, usize, [i64; 2])> = Vec::new();
    for (k, rod) in at.rods.iter().enumerate().filter(|(_, rod)| rod.len() > 1) {
        points.extend(rod.iter().map(|(s, pose)| (*s, *pose, [0.0; 3])));
        cells.push((POLYLINE, points.len(), [k as i64, -1]));
    }
    for (k, body) in at.now.bodies.iter().enumerate() {
        points.push((0.0, body.pose, body.velocity.into()));
        cells.push((VERTEX, points.len(), [-1, k as i64]));
    }
    let mut forces = vec![[0.0; 3]; points.len()];
    for contact in at.now.contact.iter().flat_map(|all| &all.contacts) {
        let place = Isometry3::from_parts(contact.point.into(), UnitQuaternion::identity());
        points.push((0.0, place, [0.0; 3]));
        cells.push((VERTEX, points.len(), [-1, -1]));
        forces.push((contact.normal * contact.normal_force + contact.friction).into());
    }
    let axis = |i: usize| {
        let axes = points.iter().map(move |(_, pose, _)| {
            let axis = pose
                .rotation
                .to_rotation_matrix()
                .matrix()
                .column(i)
                .into_owned();
            [axis.x, axis.y, axis.z]
        });
        axes.collect::<Vec<_>>()
    };
    let places: Vec<[f64; 3]> = points
        .iter()
        .map(|(_, pose, _)| pose.translation.vector.into())
        .collect();
    let velocities: Vec<[f64; 3]> = points.iter().map(|(.., velocity)| *velocity).collect();
    let ends = cells.iter().map(|(_, end, _)| *end);
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        points.len(),
        cells.len()
    );
    text += "<PointData>\n";
    array(&mut text, "Float64", "s", points.iter().map(|(s, ..)| [*s]));
    for (i, name) in ["d1", "d2", "d3"].into_iter().enumerate() {
        array(&mut text, "Float64", name, axis(i));
    }
    array(&mut text, "Float64", "velocity", velocities);
    if at.now.contact.is_some() {
        array(&mut text, "Float64", "contact_force", forces);
    }
    text += "</PointData>\n<CellData>\n";
    array(
        &mut text,
        "Int64",
        "rod",
        cells.iter().map(|(.., of)| [of[0]]),
    );
    array(
        &mut text,
        "Int64",
        "body",
        cells.iter().map(|(.., of)| [of[1]]),
    );
    text += "</CellData>\n<Points>\n";
    array(&mut text, "Float64", "position", places);
    text += "</Points>\n<Cells>\n";
    array(
        &mut text,
        "Int64",
        "connectivity",
        (0..points.len()).map(|i| [i]),
    );
    array(&mut text, "Int64", "offsets", ends.map(|end| [end]));
    array(
        &mut text,
        "UInt8",
        "types",
        cells.iter().map(|(kind, ..)| [*kind]),
    );
    text += "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    text
}

/// XML data array with a line for each tuple.
fn array<T: std::fmt::Debug, const N: usize>(
    text: &mut String,
    kind: &str,
    name: &str,
    values: impl IntoIterator<Item = [T; N]>,
) {
    let _ = writeln!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{N}\" format=\"ascii\">"
    );
    for value in values {
        let numbers = value.map(|x| format!("{x:?}"));
        *text += &numbers.join(" ");
        text.push('\n');
    }
    *text += "</DataArray>\n";
}

/// Collection file from the times and names of the grid files.
pub fn vtk_collection(files: &[(f64, String)]) -> String {
    let mut text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n".to_owned();
    for (t, file) in files {
        let _ = writeln!(
            text,
            "<DataSet timestep=\"{t}\" part=\"0\" file=\"{file}\"/>"
        );
    }
    text + "</Collection>\n</VTKFile>\n"
}
