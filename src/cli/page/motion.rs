//! Data of a motion for a page: pictures of rods and bodies, energies, the sheet of a planar elastica.

use super::numbers::{quantized, short, units};
use nalgebra::{Isometry3, Vector3};
use serde_json::{Value, json};
use snaprod::Result;
use snaprod::elastica::stable_grid;
use snaprod::manifold::Sign;
use snaprod::motion::Ledger;
use snaprod::motion::contact::ContactNow;
use snaprod::plot::Curve;
use snaprod::study::film::{Film, PictureRole, Still};
use snaprod::study::run::{BodyMoment, Moment, RunBody, RunHeader, RunRod};
use snaprod::study::{outline, outline_in_plane};

/// Bounds on the number of sections of a rod, and on the number of sections in all pictures together, in the plane and
/// in space.
const SECTIONS: usize = 41;
const FEWEST: usize = 9;
const IN_ALL: [usize; 2] = [17_000, 12_000];
/// Points of the sheets, along p and along lam.
const GRID: [usize; 2] = [36, 26];
/// Distance from the plane, in lengths of the rod, up to which a motion counts as planar.
const FLAT: f64 = 1e-7;

/// Surroundings of a motion.
pub struct MotionContext<'r> {
    /// Units, rods and bodies.
    pub header: &'r RunHeader,
    /// Times of snaps, or of the passages of a rod with friction.
    pub marks: Vec<f64>,
    /// Name of the marked times.
    pub marked: &'static str,
    /// First fold of a planar rod, in the world; empty for a moving clamp.
    pub folds: Vec<Curve>,
    /// Of each body: true if the scene says how large it is.
    pub sized: Vec<bool>,
}

/// Data of the page of a motion.
///
/// # Errors
/// Errors of the sheets, which do not occur in practice.
pub fn motion_data(film: &Film, around: &MotionContext) -> Result<Value> {
    let (stills, header) = (&film.stills, around.header);
    let length = header.scales.length;
    let flat = is_flat(stills, length);
    let u = header.units;
    let mut data = json!({
        "kind": "motion",
        "units": { "length": u.length(), "time": u.time(), "energy": u.energy(), "velocity": u.velocity() },
        "length": length,
        "flat": flat,
        "exact": header.is_sheet(),
        "t": stills.iter().map(|at| short(at.now.t)).collect::<Vec<_>>(),
        "place": stills.iter().map(letter).collect::<String>(),
        "marks": around.marks.iter().map(|t| short(*t)).collect::<Vec<_>>(),
        "marked": around.marked,
        "steps": film.steps,
        "rods": rods(stills, header, flat),
        "bodies": bodies(film, around),
        "grooves": grooves(film, header),
        "energies": energies(film),
        "trace": quantized(&film.trace.iter().map(|at| at.t).collect::<Vec<_>>()),
        "on": names(stills),
    });
    if header.has_obstacles() {
        data["obstacles"] = obstacles(stills, header);
    }
    if header.has_contact {
        data["contacts"] = contacts(stills);
    }
    // A planar elastica: sheets and borders.
    if !header.in_space() {
        if !around.folds.is_empty() {
            data["folds"] = folds(&around.folds);
        }
        data["sheet"] = sheet(stills, length)?;
    }
    Ok(data)
}

fn letter(still: &Still) -> char {
    match still.place {
        PictureRole::Way => '.',
        PictureRole::Fold => 'f',
        PictureRole::Layer => 'y',
        PictureRole::Landing => 'l',
    }
}

fn is_flat(stills: &[Still], length: f64) -> bool {
    let sections = stills.iter().flat_map(|at| at.rods.iter().flatten());
    let bodies = stills.iter().flat_map(|at| &at.now.bodies);
    let places = sections.chain(bodies.map(|body| &body.pose));
    places
        .map(|at| at.translation.z.abs())
        .all(|z| z < FLAT * length)
}

/// Each rod: its sections in all pictures on one lattice, and in space also the director d1 of each.
fn rods(stills: &[Still], header: &RunHeader, flat: bool) -> Vec<Value> {
    let all = stills.len() * header.rods.len();
    let count = (IN_ALL[usize::from(!flat)] / all.max(1)).clamp(FEWEST, SECTIONS);
    let chosen = |rod: &[Isometry3<f64>]| -> Vec<Isometry3<f64>> {
        let at = |k: usize| (k * (rod.len() - 1) + (count - 1) / 2) / (count - 1);
        (0..count).map(|k| rod[at(k)]).collect()
    };
    let axes = if flat { 2 } else { 3 };
    let rod = |(k, rod): (usize, &RunRod)| {
        let rods = stills.iter().map(|still| chosen(&still.rods[k]));
        let sections: Vec<Isometry3<f64>> = rods.flatten().collect();
        let places = sections.iter().flat_map(|at| {
            let place = at.translation.vector;
            (0..axes).map(move |i| place[i])
        });
        let mut value = json!({
            "name": rod.name,
            "ground": rod.grounds,
            "sections": count,
            "at": quantized(&places.collect::<Vec<f64>>()),
        });
        if !flat {
            let across = sections.iter().map(|at| at.rotation * Vector3::x());
            value["d1"] = units(across.flat_map(|d| [d.x, d.y, d.z])).into();
        }
        value
    };
    header.rods.iter().enumerate().map(rod).collect()
}

/// Each body: position, rotation and velocity of its frame in all pictures; position and velocity along the trace. Each
/// component has its own range.
fn bodies(film: &Film, around: &MotionContext) -> Vec<Value> {
    let body = |(k, RunBody { name, solid, .. }): (usize, &RunBody)| {
        let stills: Vec<&Moment> = film.stills.iter().map(|at| &at.now).collect();
        let trace: Vec<&Moment> = film.trace.iter().collect();
        type Part = fn(&BodyMoment, usize) -> f64;
        let part = |of: &[&Moment], part: Part, i: usize| {
            let all = of.iter().map(|at| part(&at.bodies[k], i));
            quantized(&all.collect::<Vec<f64>>())
        };
        let place: Part = |body, i| body.pose.translation.vector[i];
        let velocity: Part = |body, i| body.velocity[i];
        let turn: Part = |body, i| body.pose.rotation.coords[i];
        let turns = [0, 1, 2, 3].map(|i| part(&stills, turn, i));
        let three = |of: &[&Moment], which: Part| [0, 1, 2].map(|i| part(of, which, i));
        json!({
            "name": name,
            "at": three(&stills, place),
            "velocity": three(&stills, velocity),
            // Components of the quaternion: x, y, z, w.
            "turn": turns,
            "way": three(&trace, place),
            "speed": three(&trace, velocity),
            "offset": solid.offset.as_slice(),
            "edges": solid.half_edges.as_slice(),
            "solid": around.sized.get(k) == Some(&true),
        })
    };
    around.header.bodies.iter().enumerate().map(body).collect()
}

/// Lines on the obstacles, as far as the motion reaches: two coordinates in the plane, three in space.
fn obstacles(stills: &[Still], header: &RunHeader) -> Value {
    if header.in_space() {
        let bodies = stills.iter().flat_map(|still| &still.now.bodies);
        let places: Vec<_> = bodies.map(|body| body.pose.translation.vector).collect();
        let lines = header
            .obstacles
            .iter()
            .flat_map(|each| outline(each, &places));
        let line = |line: Vec<[f64; 3]>| {
            let along = |i: usize| quantized(&line.iter().map(|p| p[i]).collect::<Vec<_>>());
            json!([along(0), along(1), along(2)])
        };
        return lines.map(line).collect();
    }
    let clamp = stills
        .first()
        .map(|still| still.now.clamp.translation.vector);
    let centre = clamp.unwrap_or_else(Vector3::zeros);
    let all = header.obstacles.iter();
    let lines = all.flat_map(|each| outline_in_plane(each, &centre, header.scales.length));
    let line = |line: Vec<[f64; 2]>| {
        let along = |i: usize| quantized(&line.iter().map(|p| p[i]).collect::<Vec<_>>());
        json!([along(0), along(1)])
    };
    lines.map(line).collect()
}

/// Contacts of every picture: place and force on the body, six numbers each.
fn contacts(stills: &[Still]) -> Value {
    let numbers = |at: &ContactNow| -> Vec<f64> {
        let force = at.normal * at.normal_force + at.friction;
        at.point.iter().chain(&force).map(|x| short(*x)).collect()
    };
    let of = |still: &Still| -> Vec<Vec<f64>> {
        let contact = still.now.contact.iter();
        contact.flat_map(|all| &all.contacts).map(numbers).collect()
    };
    json!(stills.iter().map(of).collect::<Vec<_>>())
}

/// Grooves of the bodies.
fn grooves(film: &Film, header: &RunHeader) -> Vec<Value> {
    let groove = |(k, body): (usize, &RunBody)| {
        let poses = film.trace.iter().map(|at| &at.bodies[k].pose);
        let points = body.solid.groove_around(poses, header.scales.length);
        let part = |i: usize| quantized(&points.iter().map(|p| p[i]).collect::<Vec<_>>());
        (!points.is_empty()).then(|| json!([part(0), part(1), part(2)]))
    };
    let bodies = header.bodies.iter().enumerate();
    bodies.filter_map(groove).collect()
}

/// Terms of the ledger that do not vanish, and their constant sum, in all pictures and along the trace.
fn energies(film: &Film) -> Vec<Value> {
    type Term = fn(&Ledger) -> f64;
    let terms: [(&str, Term); 6] = [
        ("kinetic", |l| l.kinetic),
        ("rod kinetic", |l| l.rod_kinetic),
        ("elastic", |l| l.elastic),
        ("potential", |l| l.potential),
        ("dissipated", |l| l.dissipated),
        ("work", |l| l.work),
    ];
    let ledgers = || film.stills.iter().map(|at| &at.now).chain(&film.trace);
    let used: Vec<&(&str, Term)> = (terms.iter())
        .filter(|(_, term)| ledgers().any(|at| term(&at.ledger) != 0.0))
        .collect();
    // Without losses and work the sum equals the total mechanical energy, under the name of energies.svg.
    let more = used
        .iter()
        .any(|(name, _)| ["dissipated", "work"].contains(name));
    let total: (&str, Term) = if more {
        ("total with losses and work", Ledger::total)
    } else {
        ("total mechanical", Ledger::total)
    };
    let value = |(name, term): &(&str, Term)| {
        let stills = film.stills.iter().map(|at| term(&at.now.ledger));
        let trace = film.trace.iter().map(|at| term(&at.ledger));
        let (values, trace): (Vec<f64>, Vec<f64>) = (stills.collect(), trace.collect());
        json!({ "name": name, "values": quantized(&values), "trace": quantized(&trace) })
    };
    used.into_iter().chain([&total]).map(value).collect()
}

/// Names of the sheets that the rod is on or near, and their index in each picture; -1 for none.
fn names(stills: &[Still]) -> Value {
    let mut names: Vec<String> = Vec::new();
    let of = stills.iter().map(|at| {
        let name = at.now.labels?.sheet.to_string();
        let known = names.iter().position(|known| *known == name);
        Some(known.unwrap_or_else(|| {
            names.push(name);
            names.len() - 1
        }))
    });
    let of: Vec<Option<usize>> = of.collect();
    json!({ "names": names, "of": of })
}

fn folds(folds: &[Curve]) -> Value {
    let fold = |fold: &Curve| json!({ "x": quantized(&fold.x), "y": quantized(&fold.y) });
    folds.iter().map(fold).collect()
}

/// Stable sheets of the elastica over the positions of its end, with height theta(1), and the path on them, in the
/// clamp's frame.
fn sheet(stills: &[Still], length: f64) -> Result<Value> {
    let [rows, columns] = GRID;
    let patch = |side| -> Result<Value> {
        let grid = stable_grid(side, rows, columns)?;
        let part = |of: fn(&snaprod::elastica::GridPoint) -> f64, by: f64| {
            quantized(&grid.iter().map(|q| by * of(q)).collect::<Vec<_>>())
        };
        Ok(json!({
            "rows": rows,
            "columns": columns,
            "at": [part(|q| q.x, length), part(|q| q.y, length), part(|q| q.theta1, 1.0)],
        }))
    };
    let path: Vec<[f64; 3]> = stills.iter().map(|at| lifted(&at.rods[0])).collect();
    let part = |i: usize| quantized(&path.iter().map(|p| p[i]).collect::<Vec<_>>());
    Ok(json!({
        "patches": [patch(Sign::Plus)?, patch(Sign::Minus)?],
        "path": [part(0), part(1), part(2)],
        "from_clamp": stills.iter().any(|at| is_off(&at.rods[0][0], length)),
    }))
}

/// True for a clamp that is not at the origin along x.
fn is_off(clamp: &Isometry3<f64>, length: f64) -> bool {
    let turned = clamp.rotation * Vector3::z() - Vector3::x();
    turned.norm() > 1e-6 || clamp.translation.vector.norm() > 1e-6 * length
}

/// Position of the end and total rotation of the rod, in the frame of the clamp of a planar rod.
fn lifted(rod: &[Isometry3<f64>]) -> [f64; 3] {
    let tangent = |at: &Isometry3<f64>| at.rotation * Vector3::z();
    let normal = rod[0].rotation * Vector3::x();
    let turns = rod.windows(2).map(|pair| {
        let (a, b) = (tangent(&pair[0]), tangent(&pair[1]));
        normal.dot(&a.cross(&b)).atan2(a.dot(&b))
    });
    let way = rod[rod.len() - 1].translation.vector - rod[0].translation.vector;
    let along = tangent(&rod[0]);
    [way.dot(&along), way.dot(&normal.cross(&along)), turns.sum()]
}
