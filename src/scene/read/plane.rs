//! Checks of planar assemblies: rods, attachments and loads lie in the plane of the scene.

use super::reader::Reader;
use super::table::Table;
use crate::scene::{AssemblyScene, FaultKind, Scene, Section, Site, SiteJoint, Stiffness};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest sine of an angle to the plane, and largest relative distance from the plane, that count as 0.
const FLAT: f64 = 1e-9;

/// Director (0 or 1) of an attachment along the normal, and its sign.
pub(in crate::scene) fn normal_director(site: &Site, normal: [f64; 3]) -> Option<(usize, bool)> {
    let [w, x, y, z] = site.orientation.quaternion();
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let seen = turn.inverse() * Vector3::from(normal).normalize();
    (0..2)
        .find(|k| seen[*k].abs() >= 1.0 - FLAT)
        .map(|k| (k, seen[k] > 0.0))
}

/// Stiffness out of the plane, and in torsion, over that in the plane, of a rod in motion that is given by its one
/// bending stiffness.
const FLAT_ROD: f64 = 10.0;

/// Makes a planar assembly in motion one in space: what starts in a plane stays there. `rods` are the tables of the
/// rods.
pub(super) fn lift(assembly: &mut AssemblyScene, rods: &[Table]) {
    let Some(normal) = assembly.plane.take() else {
        return;
    };
    for (rod, table) in assembly.rods.iter_mut().zip(rods) {
        let is_bare = table.has("bending_stiffness");
        let director = normal_director(&rod.from, normal);
        if let (true, Some((k, _)), Section::Diagonal(law)) =
            (is_bare, director, &mut rod.rod.section)
            && let Stiffness::Elastic(along) = &law.bending[k]
            && let Some(stiffness) = along.constant()
        {
            law.bending[1 - k] = (FLAT_ROD * stiffness).into();
            law.torsion = (FLAT_ROD * stiffness).into();
        }
    }
}

/// Reports what leaves the plane of the scene; true if nothing does.
pub(super) fn lies_in_plane(
    top: &Table,
    (rods, bodies): (&[Table], &[Table]),
    scene: &Scene,
    assembly: &AssemblyScene,
) -> bool {
    let Some(normal) = assembly.plane else {
        return true;
    };
    let n = Vector3::from(normal).normalize();
    let mut flat = true;
    let mut refuse = |reader: &Reader, at: usize, field: String, allowed: &str, hint: String| {
        flat = false;
        reader.record(FaultKind::Conflict, at, &field, None, allowed, hint);
    };
    if !assembly.free.is_empty() {
        let hint = "leave out plane, or the rods with to = \"free\"".to_owned();
        refuse(
            top.reader,
            top.at,
            "plane".to_owned(),
            "left out where a rod has a free end",
            hint,
        );
    }
    let across = |v: [f64; 3]| {
        let v = Vector3::from(v);
        v.dot(&n).abs() > FLAT * v.norm()
    };
    let along = |v: [f64; 3]| {
        let v = Vector3::from(v);
        v.cross(&n).norm() > FLAT * v.norm()
    };
    let in_plane = "in the plane, across its normal";
    if across(scene.loads.gravity) {
        refuse(
            top.reader,
            top.at,
            "loads.gravity".to_owned(),
            in_plane,
            "plane is the normal of the plane".to_owned(),
        );
    }
    let mut height: Option<f64> = None;
    for (rod, table) in assembly.rods.iter().zip(rods) {
        let sites = [("from", &rod.from), ("to", &rod.to)];
        let directors = sites.map(|(_, site)| normal_director(site, normal));
        for ((name, site), director) in sites.into_iter().zip(directors) {
            let field = format!("{}.{name}", table.path());
            let mut wrong = |part: &str, allowed: &str, hint: &str| {
                refuse(
                    table.reader,
                    table.at,
                    format!("{field}{part}"),
                    allowed,
                    hint.to_owned(),
                );
            };
            if director.is_none() {
                wrong(
                    ".rotation",
                    "a turn that leaves d1 or d2 along the normal of the plane",
                    "the rod runs in the plane along d3, and bends about d1 or d2",
                );
            }
            let level = Vector3::from(site.position).dot(&n);
            let wanted = match site.body {
                Some(_) => 0.0,
                None => *height.get_or_insert(level),
            };
            if (level - wanted).abs() > FLAT * (1.0 + rod.rod.length) {
                wrong(
                    ".position",
                    "in the plane: on the ground at one height, on a body at 0 along the normal",
                    "rods beside each other are for assemblies in space: leave out plane",
                );
            }
            match &site.joint {
                SiteJoint::Weld | SiteJoint::Ball => {}
                SiteJoint::Hinge(turn) => {
                    let [w, x, y, z] = site.orientation.quaternion();
                    let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                    if along((turned * Vector3::from(turn.axis)).into()) {
                        wrong(
                            ".axis",
                            "the normal of the plane, along the directors of the attachment",
                            "a hinge in a plane turns about its normal",
                        );
                    }
                    if turn
                        .slide
                        .is_some_and(|slide| across((turned * Vector3::from(slide)).into()))
                    {
                        wrong(".slide", in_plane, "along the directors of the attachment");
                    }
                }
                SiteJoint::Universal { .. } => {
                    wrong(
                        ".joint",
                        "\"weld\", \"ball\", \"hinge\", \"slider\" or \"roller\" in a plane",
                        "a universal joint turns out of the plane: leave out plane",
                    );
                }
                SiteJoint::Slider(slide) | SiteJoint::Roller(slide) => {
                    let [w, x, y, z] = site.orientation.quaternion();
                    let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                    if across((turned * Vector3::from(slide.axis)).into()) {
                        wrong(".axis", in_plane, "along the directors of the attachment");
                    }
                }
            }
        }
        let field = table.path().to_owned();
        if let [Some(from), Some(to)] = directors {
            if from != to {
                refuse(
                    table.reader,
                    table.at,
                    format!("{field}.to.rotation"),
                    "with the same director along the normal, pointing the same way, as from",
                    "between these the rod would be twisted out of the plane".to_owned(),
                );
            }
            let other = rod.rod.rest.curvature[1 - from.0].constant() == Some(0.0);
            if !(other && rod.rod.rest.twist.constant() == Some(0.0)) {
                refuse(
                    table.reader,
                    table.at,
                    format!("{field}.rest"),
                    "curvature about the normal alone, and no twist",
                    "a rod that is curved out of the plane is for assemblies in space: leave out plane".to_owned(),
                );
            }
            if let Err(why) = rod.rod.in_plane(from.0) {
                refuse(
                    table.reader,
                    table.at,
                    format!("{field}.section"),
                    "a section of a rod in a plane",
                    why.to_string(),
                );
            }
        }
        let load = rod.distributed.on(rod.rod.length);
        for listed in &rod.rod.loads {
            let field = |name: &str| format!("load[{}].{name}", listed.number);
            let (reader, at) = (table.reader, table.at);
            // Along the directors, the one along the normal counts.
            let normal = directors[0].filter(|_| listed.follows);
            let leaves = |x: [f64; 3]| normal.map_or_else(|| across(x), |(k, _)| x[k] != 0.0);
            if leaves(listed.force) {
                let why = "plane is the normal of the plane".to_owned();
                refuse(reader, at, field("force"), in_plane, why);
            }
            let beside = |x: [f64; 3]| {
                let whole = Vector3::from(x);
                let normal = normal.map_or(n, |(k, _)| Vector3::ith(k, 1.0));
                (whole - normal * normal.dot(&whole)).norm() > FLAT * whole.norm()
            };
            if beside(listed.couple) {
                let allowed = "along the normal of the plane";
                let why = "another couple would twist the rod, or bend it out of the plane";
                refuse(reader, at, field("couple"), allowed, why.to_owned());
            }
        }
        let beside = |f: &Vector3<f64>| {
            if across((*f).into()) {
                *f
            } else {
                Vector3::zeros()
            }
        };
        if load.is_ok_and(|load| !load.mapped(beside).is_zero()) {
            refuse(
                table.reader,
                table.at,
                format!("{field}.distributed"),
                in_plane,
                "plane is the normal of the plane".to_owned(),
            );
        }
    }
    for (body, table) in assembly.bodies.iter().zip(bodies) {
        let field = table.path().to_owned();
        let mut wrong = |part: &str, allowed: &str, hint: &str| {
            refuse(
                table.reader,
                table.at,
                format!("{field}.{part}"),
                allowed,
                hint.to_owned(),
            );
        };
        if across(body.force.constant()) {
            wrong("force", in_plane, "plane is the normal of the plane");
        }
        if along(body.couple.constant()) {
            wrong(
                "couple",
                "along the normal of the plane",
                "another couple turns the body out of the plane",
            );
        }
        if across(body.velocity) {
            wrong("velocity", in_plane, "plane is the normal of the plane");
        }
        if along(body.angular_velocity) {
            wrong(
                "angular_velocity",
                "along the normal of the plane",
                "another spin turns the body out of the plane",
            );
        }
        if body.groove.is_some() {
            wrong(
                "groove",
                "left out in a plane",
                "a groove is for assemblies in space: leave out plane, or write a slider",
            );
        }
    }
    flat
}
