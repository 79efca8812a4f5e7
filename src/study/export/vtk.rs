//! A motion for ParaView and VTK: one file with all times, in the format VTKHDF (unstructured grids over time).

use super::Posed;
use super::hdf5::{Attribute, Dataset, Group, file};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Numbers of cell types in VTK.
const VERTEX: u8 = 1;
const POLYLINE: u8 = 4;

/// Rods as lines, bodies and places of contacts as points, at all times of a motion: the bytes of a `.vtkhdf` file.
///
/// Point data: `d1`, `d2`, `d3`, the directors of a section or axes of a body frame; `s`, the arclength in the
/// unstrained rod (0 for a body); `velocity` of bodies (0 for sections, whose velocities are not computed). A motion
/// with contacts has `contact_force`, the force on the body. Cell data: `rod`, the index of the rod, and `body`, the
/// index of the body; -1 for others.
pub fn vtk(moments: &[Posed]) -> Vec<u8> {
    let grids: Vec<Grid> = moments.iter().map(Grid::of).collect();
    let points = || grids.iter().flat_map(|grid| &grid.points);
    let cells = || grids.iter().flat_map(|grid| &grid.cells);
    let total = points().count();
    let three = |name: &str, of: &dyn Fn(&Point) -> Vector3<f64>| {
        let values = points().map(of).collect::<Vec<_>>();
        Dataset::reals(name, &[total, 3], values.iter().flatten().copied())
    };
    let axis = |i: usize| {
        move |point: &Point| {
            let turned = point.pose.rotation.to_rotation_matrix();
            turned.matrix().column(i).into_owned()
        }
    };
    let mut point_data = vec![
        Dataset::reals("s", &[total], points().map(|point| point.s)),
        three("d1", &axis(0)),
        three("d2", &axis(1)),
        three("d3", &axis(2)),
        three("velocity", &|point| point.velocity),
    ];
    if moments.iter().any(|at| at.now.contact.is_some()) {
        point_data.push(three("contact_force", &|point| point.force));
    }
    let cell_data = vec![
        Dataset::whole("rod", cells().map(|cell| cell.of[0])),
        Dataset::whole("body", cells().map(|cell| cell.of[1])),
    ];
    // Where each time begins in the arrays of points and of cells.
    let point_starts = starts(grids.iter().map(|grid| grid.points.len()));
    let cell_starts = starts(grids.iter().map(|grid| grid.cells.len()));
    let offsets_of = |data: &[Dataset], starts: &[i64]| -> Vec<Dataset> {
        let offset = |set: &Dataset| Dataset::whole(&set.name, starts.iter().copied());
        data.iter().map(offset).collect()
    };
    let steps = Group {
        name: "Steps",
        attributes: vec![Attribute::Whole("NSteps", vec![grids.len() as i64])],
        groups: vec![
            Group {
                name: "PointDataOffsets",
                datasets: offsets_of(&point_data, &point_starts),
                ..Group::default()
            },
            Group {
                name: "CellDataOffsets",
                datasets: offsets_of(&cell_data, &cell_starts),
                ..Group::default()
            },
        ],
        datasets: vec![
            Dataset::reals("Values", &[grids.len()], moments.iter().map(|at| at.now.t)),
            Dataset::whole("PartOffsets", 0..grids.len() as i64),
            Dataset::whole("NumberOfParts", grids.iter().map(|_| 1)),
            Dataset::whole("PointOffsets", point_starts.iter().copied()),
            Dataset::whole("CellOffsets", cell_starts.iter().copied()),
            Dataset::whole("ConnectivityIdOffsets", point_starts.iter().copied()),
        ],
    };
    let lengths = |of: fn(&Grid) -> usize| grids.iter().map(move |grid| of(grid) as i64);
    // Each point belongs to one cell, in the order of the points.
    let connectivity = grids.iter().flat_map(|grid| 0..grid.points.len() as i64);
    let ends = grids.iter().flat_map(|grid| {
        let ends = grid.cells.iter().map(|cell| cell.end as i64);
        std::iter::once(0).chain(ends)
    });
    file(vec![Group {
        name: "VTKHDF",
        attributes: vec![
            Attribute::Whole("Version", vec![2, 0]),
            Attribute::Text("Type", "UnstructuredGrid"),
        ],
        datasets: vec![
            Dataset::whole("NumberOfPoints", lengths(|grid| grid.points.len())),
            Dataset::whole("NumberOfCells", lengths(|grid| grid.cells.len())),
            Dataset::whole("NumberOfConnectivityIds", lengths(|grid| grid.points.len())),
            three("Points", &|point| point.pose.translation.vector),
            Dataset::whole("Connectivity", connectivity),
            Dataset::whole("Offsets", ends),
            Dataset::bytes("Types", cells().map(|cell| cell.kind).collect()),
        ],
        groups: vec![
            Group {
                name: "PointData",
                datasets: point_data,
                ..Group::default()
            },
            Group {
                name: "CellData",
                datasets: cell_data,
                ..Group::default()
            },
            steps,
        ],
    }])
}

/// The sums of all lengths before each.
fn starts(lengths: impl Iterator<Item = usize>) -> Vec<i64> {
    let before = lengths.scan(0, |sum, length| {
        let start = *sum;
        *sum += length as i64;
        Some(start)
    });
    before.collect()
}

/// A point of a grid.
struct Point {
    s: f64,
    pose: Isometry3<f64>,
    velocity: Vector3<f64>,
    force: Vector3<f64>,
}

impl Point {
    fn at(s: f64, pose: Isometry3<f64>) -> Self {
        let (velocity, force) = (Vector3::zeros(), Vector3::zeros());
        Self {
            s,
            pose,
            velocity,
            force,
        }
    }
}

/// A cell with points up to before `end`: the indices of the rod and of the body, or -1.
struct GridCell {
    kind: u8,
    end: usize,
    of: [i64; 2],
}

/// The grid of one time.
#[derive(Default)]
struct Grid {
    points: Vec<Point>,
    cells: Vec<GridCell>,
}

impl Grid {
    fn of(at: &Posed) -> Self {
        let mut grid = Self::default();
        for (k, rod) in at.rods.iter().enumerate().filter(|(_, rod)| rod.len() > 1) {
            let sections = rod.iter().map(|(s, pose)| Point::at(*s, *pose));
            grid.points.extend(sections);
            grid.close(POLYLINE, [k as i64, -1]);
        }
        for (k, body) in at.now.bodies.iter().enumerate() {
            grid.points.push(Point {
                velocity: body.velocity,
                ..Point::at(0.0, body.pose)
            });
            grid.close(VERTEX, [-1, k as i64]);
        }
        for contact in at.now.contact.iter().flat_map(|all| &all.contacts) {
            let pose = Isometry3::from_parts(contact.point.into(), UnitQuaternion::identity());
            grid.points.push(Point {
                force: contact.normal * contact.normal_force + contact.friction,
                ..Point::at(0.0, pose)
            });
            grid.close(VERTEX, [-1, -1]);
        }
        grid
    }

    /// Ends a cell with the last point.
    fn close(&mut self, kind: u8, of: [i64; 2]) {
        let end = self.points.len();
        self.cells.push(GridCell { kind, end, of });
    }
}
