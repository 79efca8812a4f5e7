//! A motion as glTF 2.0: one binary file with animated rods and bodies, for Blender, browsers and slides.

use super::Posed;
use crate::study::run::RunHeader;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde_json::{Value, json};

/// Joints of a rod, and corners of its cross-section.
const JOINTS: usize = 41;
const CORNERS: usize = 12;
/// Half axes of the drawn cross-section along d1 and d2, and the radius of a point mass, in lengths of the rod.
const HALF: [f64; 2] = [0.016, 0.006];
const BALL: f64 = 0.03;
/// Colours of the two sides of a rod, and of bodies: linear red, green, blue.
const FRONT: [f32; 3] = [0.05, 0.33, 0.74];
const BACK: [f32; 3] = [0.87, 0.45, 0.13];
const BODY: [f32; 3] = [0.25, 0.25, 0.27];

/// The bytes of a `.glb` file. Each rod is a tube with a skin of 41 joints, whose cross-section is flat along d2; each
/// body is the box of its inertia, or a ball. Joints and bodies have keys at the times of `moments`, between which
/// players interpolate linearly. The y axis is up: a scene in space, whose z is up, is turned.
pub fn gltf(header: &RunHeader, moments: &[Posed]) -> Vec<u8> {
    let mut file = Gltf::new(header.in_space());
    let times: Vec<f32> = moments.iter().map(|at| at.now.t as f32).collect();
    let length = header.scales.length;
    file.times = file.reals(&times, 1, None, true);
    for (k, rod) in header.rods.iter().enumerate() {
        let shapes: Vec<Vec<Isometry3<f64>>> = (moments.iter())
            .map(|at| resampled(&at.rods[k]))
            .filter(|shape| !shape.is_empty())
            .collect();
        // A rod that has no shape at some time is left out.
        if shapes.len() == moments.len() {
            file.rod(&named(&rod.name, "rod", k), &shapes, length);
        }
    }
    for (k, body) in header.bodies.iter().enumerate() {
        let half: [Vector3<f64>; 3] =
            std::array::from_fn(|i| body.solid.half_edges.column(i).into_owned());
        let mesh = if half.iter().all(|edge| *edge == Vector3::zeros()) {
            Mesh::ball(BALL * length)
        } else {
            Mesh::cuboid(body.solid.offset, half)
        };
        let poses = moments.iter().map(|at| at.now.bodies[k].pose).collect();
        file.body(&named(&body.name, "body", k), &mesh, poses);
    }
    file.finished()
}

fn named(name: &str, kind: &str, k: usize) -> String {
    match name {
        "" => format!("{kind} {k}"),
        name => name.to_owned(),
    }
}

/// Sections at even arclengths, between the given ones by linear interpolation; none of a rod without a shape.
fn resampled(rod: &[(f64, Isometry3<f64>)]) -> Vec<Isometry3<f64>> {
    let (Some((first, _)), Some((last, _))) = (rod.first(), rod.last()) else {
        return Vec::new();
    };
    if rod.len() < 2 {
        return Vec::new();
    }
    let at = |j: usize| {
        let s = first + (last - first) * j as f64 / (JOINTS - 1) as f64;
        let k = rod
            .partition_point(|(other, _)| *other < s)
            .clamp(1, rod.len() - 1);
        let [(a, before), (b, after)] = [rod[k - 1], rod[k]];
        let part = if b > a {
            ((s - a) / (b - a)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let place = before
            .translation
            .vector
            .lerp(&after.translation.vector, part);
        let turned = before
            .rotation
            .try_slerp(&after.rotation, part, 1e-12)
            .unwrap_or(before.rotation);
        Isometry3::from_parts(place.into(), turned)
    };
    (0..JOINTS).map(at).collect()
}

/// Triangles with normals and colours.
#[derive(Default)]
struct Mesh {
    places: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[f32; 3]>,
    corners: Vec<u16>,
}

fn single(v: Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

impl Mesh {
    fn vertex(&mut self, place: Vector3<f64>, normal: Vector3<f64>, colour: [f32; 3]) {
        self.places.push(single(place));
        self.normals.push(single(normal.normalize()));
        self.colours.push(colour);
    }

    /// Two triangles between rows of `count` vertices each, closed into rings.
    fn rings(&mut self, rows: usize, count: usize) {
        for row in 1..rows {
            for i in 0..count {
                let next = (i + 1) % count;
                let [a, b] = [(row - 1) * count, row * count];
                let four = [a + i, a + next, b + next, b + i].map(|k| k as u16);
                self.corners
                    .extend([four[0], four[1], four[2], four[0], four[2], four[3]]);
            }
        }
    }

    /// An elliptic tube along z with rings of vertices at even distances.
    fn tube(length: f64, half: [f64; 2]) -> Self {
        let mut mesh = Self::default();
        for j in 0..JOINTS {
            let z = length * j as f64 / (JOINTS - 1) as f64;
            for i in 0..CORNERS {
                let (sin, cos) =
                    ((i as f64 + 0.5) * std::f64::consts::TAU / CORNERS as f64).sin_cos();
                let colour = if sin > 0.0 { FRONT } else { BACK };
                let normal = Vector3::new(cos / half[0], sin / half[1], 0.0);
                mesh.vertex(
                    Vector3::new(half[0] * cos, half[1] * sin, z),
                    normal,
                    colour,
                );
            }
        }
        mesh.rings(JOINTS, CORNERS);
        mesh
    }

    fn ball(radius: f64) -> Self {
        const ROWS: usize = 9;
        let mut mesh = Self::default();
        for row in 0..ROWS {
            // The first and last rings shrink to the poles.
            let polar = std::f64::consts::PI * row as f64 / (ROWS - 1) as f64;
            for i in 0..CORNERS {
                let (sin, cos) = (i as f64 * std::f64::consts::TAU / CORNERS as f64).sin_cos();
                let normal = Vector3::new(cos * polar.sin(), sin * polar.sin(), -polar.cos());
                mesh.vertex(radius * normal, normal, BODY);
            }
        }
        mesh.rings(ROWS, CORNERS);
        mesh
    }

    /// A box about its centre, from the vectors to the middles of three faces.
    fn cuboid(centre: Vector3<f64>, half: [Vector3<f64>; 3]) -> Self {
        let mut mesh = Self::default();
        let right_handed = half[0].cross(&half[1]).dot(&half[2]) > 0.0;
        for (axis, side) in [
            (0, 1.0),
            (0, -1.0),
            (1, 1.0),
            (1, -1.0),
            (2, 1.0),
            (2, -1.0),
        ] {
            let (n, u, v) = (
                half[axis] * side,
                half[(axis + 1) % 3],
                half[(axis + 2) % 3],
            );
            // Corners run against the clock, seen from outside.
            let v = if (side > 0.0) == right_handed { v } else { -v };
            let first = mesh.places.len() as u16;
            for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.vertex(centre + n + s * u + t * v, n, BODY);
            }
            mesh.corners
                .extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        mesh
    }
}

/// Use of an accessor.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// Types of numbers.
const BYTE: u32 = 5121;
const SHORT: u32 = 5123;
const REAL: u32 = 5126;

/// A glTF file in the making.
struct Gltf {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    skins: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    /// Accessor of the times.
    times: usize,
    /// Nodes below the first one.
    children: Vec<usize>,
}

impl Gltf {
    fn new(in_space: bool) -> Self {
        let mut root = json!({ "name": "scene" });
        if in_space {
            // z, which is up in the scene, becomes y.
            root["rotation"] = json!([
                -std::f64::consts::FRAC_1_SQRT_2,
                0.0,
                0.0,
                std::f64::consts::FRAC_1_SQRT_2
            ]);
        }
        Self {
            bytes: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
            meshes: Vec::new(),
            skins: Vec::new(),
            nodes: vec![root],
            samplers: Vec::new(),
            channels: Vec::new(),
            times: 0,
            children: Vec::new(),
        }
    }

    fn accessor(&mut self, mut accessor: Value, bytes: &[u8], target: Option<u32>) -> usize {
        // Numbers begin at multiples of four bytes.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend(bytes);
        accessor["bufferView"] = self.views.len().into();
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// An accessor of reals in groups of `size`; with its least and largest numbers if `bounded`.
    fn reals(&mut self, values: &[f32], size: usize, target: Option<u32>, bounded: bool) -> usize {
        let kind = match size {
            1 => "SCALAR",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        let mut accessor =
            json!({ "componentType": REAL, "count": values.len() / size, "type": kind });
        if bounded {
            let end = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                let of = |i: usize| values.iter().skip(i).step_by(size).copied().reduce(pick);
                (0..size).filter_map(of).collect()
            };
            (accessor["min"], accessor["max"]) = (json!(end(f32::min)), json!(end(f32::max)));
        }
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(accessor, &bytes, target)
    }

    /// A mesh; `joints` gives the joint of every vertex.
    fn mesh(&mut self, name: &str, mesh: &Mesh, joints: Option<&dyn Fn(usize) -> u8>) -> usize {
        let vertices = Some(VERTICES);
        let mut attributes = json!({
            "POSITION": self.reals(mesh.places.as_flattened(), 3, vertices, true),
            "NORMAL": self.reals(mesh.normals.as_flattened(), 3, vertices, false),
            "COLOR_0": self.reals(mesh.colours.as_flattened(), 3, vertices, false),
        });
        if let Some(joint) = joints {
            let count = mesh.places.len();
            let four: Vec<u8> = (0..count).flat_map(|k| [joint(k), 0, 0, 0]).collect();
            let accessor = json!({ "componentType": BYTE, "count": count, "type": "VEC4" });
            attributes["JOINTS_0"] = self.accessor(accessor, &four, vertices).into();
            let weights: Vec<f32> = (0..count).flat_map(|_| [1.0, 0.0, 0.0, 0.0]).collect();
            attributes["WEIGHTS_0"] = self.reals(&weights, 4, vertices, false).into();
        }
        let accessor =
            json!({ "componentType": SHORT, "count": mesh.corners.len(), "type": "SCALAR" });
        let bytes: Vec<u8> = mesh.corners.iter().flat_map(|k| k.to_le_bytes()).collect();
        let indices = self.accessor(accessor, &bytes, Some(INDICES));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }],
        }));
        self.meshes.len() - 1
    }

    /// A node that follows `poses`, one for each time.
    fn moving(&mut self, name: String, poses: &[Isometry3<f64>]) -> usize {
        let mut places = Vec::with_capacity(3 * poses.len());
        let mut turns: Vec<f32> = Vec::with_capacity(4 * poses.len());
        let mut last: Option<UnitQuaternion<f64>> = None;
        for pose in poses {
            places.extend(single(pose.translation.vector));
            let mut turn = pose.rotation;
            // Of q and -q, one rotation, the nearer to the last is on the short way.
            if last.is_some_and(|last| last.coords.dot(&turn.coords) < 0.0) {
                turn = UnitQuaternion::new_unchecked(-turn.into_inner());
            }
            turns.extend(turn.coords.iter().map(|x| *x as f32));
            last = Some(turn);
        }
        let node = self.nodes.len();
        let (place, turn) = (places.get(..3), turns.get(..4));
        self.nodes
            .push(json!({ "name": name, "translation": place, "rotation": turn }));
        for (path, values, size) in [("translation", places, 3), ("rotation", turns, 4)] {
            let output = self.reals(&values, size, None, false);
            let sampler = self.samplers.len();
            self.samplers
                .push(json!({ "input": self.times, "output": output }));
            self.channels
                .push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
        }
        node
    }

    fn rod(&mut self, name: &str, shapes: &[Vec<Isometry3<f64>>], length: f64) {
        let mesh = Mesh::tube(length, HALF.map(|half| half * length));
        let mesh = self.mesh(name, &mesh, Some(&|vertex| (vertex / CORNERS) as u8));
        let mut joints = Vec::new();
        let mut inverse: Vec<f32> = Vec::new();
        for j in 0..JOINTS {
            let poses: Vec<Isometry3<f64>> = shapes.iter().map(|shape| shape[j]).collect();
            joints.push(self.moving(format!("{name} joint {j}"), &poses));
            let z = length * j as f64 / (JOINTS - 1) as f64;
            inverse.extend([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
            inverse.extend([0.0, 0.0, -z as f32, 1.0]);
        }
        let inverse = self.reals(&inverse, 16, None, false);
        let skin = self.skins.len();
        self.skins
            .push(json!({ "joints": joints, "inverseBindMatrices": inverse }));
        self.children.extend(joints);
        // A skinned mesh stands at the top: the joints alone place the mesh.
        self.nodes
            .push(json!({ "name": name, "mesh": mesh, "skin": skin }));
    }

    fn body(&mut self, name: &str, mesh: &Mesh, poses: Vec<Isometry3<f64>>) {
        let mesh = self.mesh(name, mesh, None);
        let node = self.moving(name.to_owned(), &poses);
        self.nodes[node]["mesh"] = mesh.into();
        self.children.push(node);
    }

    /// The file: a header, the description as JSON, the numbers.
    fn finished(mut self) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let skinned = (0..self.nodes.len()).filter(|k| self.nodes[*k].get("skin").is_some());
        let top: Vec<usize> = std::iter::once(0).chain(skinned).collect();
        self.nodes[0]["children"] = json!(self.children);
        let mut description = json!({
            "asset": { "version": "2.0", "generator": concat!("snaprod ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": top }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": [{
                "name": "matt",
                "doubleSided": true,
                "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.7 },
            }],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len() }],
            "animations": [{ "name": "motion", "samplers": self.samplers, "channels": self.channels }],
        });
        if !self.skins.is_empty() {
            description["skins"] = json!(self.skins);
        }
        let mut text = description.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() + 8 + self.bytes.len();
        let word = |x: usize| (x as u32).to_le_bytes();
        let head = [*b"glTF", word(2), word(whole), word(text.len()), *b"JSON"].concat();
        let numbers = [word(self.bytes.len()), *b"BIN\0"].concat();
        [head, text, numbers, self.bytes].concat()
    }
}
