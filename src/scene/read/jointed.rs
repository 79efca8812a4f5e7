//! Single rods on joints in motion: each is an assembly of one rod with its body.

use super::joint::{joint, joint_in_plane};
use super::table::Table;
use crate::scene::{
    AssemblyBody, AssemblyRod, AssemblyScene, Body, Clamp, Extent, FaultKind, InitialShape, Joint,
    Load, Loads, RelaxedAt, Scene, SceneKind, Site, SiteJoint, Start, Straight,
};

/// Names of the rod, of the body, and of the end without a body.
const ROD: &str = "rod";
const BODY: &str = "body";
const END: &str = "end";

/// Joints of a single rod to the clamp and to the body; `None` for a faulty joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndJoints {
    base: Option<SiteJoint>,
    end: Option<SiteJoint>,
}

impl EndJoints {
    /// Reads the joints of `[clamp]` and `[body]`.
    pub fn read(clamp: Option<&Table>, body: Option<&Table>) -> Self {
        let base = match clamp {
            Some(table) if table.knows("second_axis") => joint(table),
            Some(table) if table.knows("joint") => joint_in_plane(table),
            _ => Some(SiteJoint::Weld),
        };
        let end = match body {
            Some(table) if table.knows("second_axis") => joint(table),
            _ => Some(SiteJoint::Weld),
        };
        Self { base, end }
    }

    /// True for a body that is not a point mass on a ball joint.
    pub fn holds_body(&self) -> Option<bool> {
        self.end.map(|end| end != SiteJoint::Ball)
    }

    /// True for a rod that is no single rod on a clamp. `None` with a fault.
    pub fn are_any(&self) -> Option<bool> {
        Some(self.base? != SiteJoint::Weld || self.end?.is_guided())
    }

    /// The assembly of a single rod with these joints; reports what such an assembly does not have.
    pub fn assembly(&self, top: &Table, scene: Scene) -> Option<Scene> {
        let (on_clamp, on_body) = (self.base?, self.end?);
        let field = if on_clamp == SiteJoint::Weld {
            BODY
        } else {
            "clamp"
        };
        let refuse = |name: &str, allowed: &str, hint: &str| {
            top.fault(FaultKind::Conflict, name, allowed, hint);
            None
        };
        if scene.rod.damping.is_some() && !scene.rod.is_heavy() {
            let hint = "write inertia = \"full\" and the mass of the rod, or leave damping out";
            return refuse(
                field,
                "without joint on a rod with friction and without its mass",
                hint,
            );
        }
        if scene.clamp.free {
            return refuse(
                field,
                "without joint where the base is free",
                "leave joint out",
            );
        }
        let start = start(top, &scene)?;
        let scene = if scene.is_planar() {
            match scene.lifted_from_plane() {
                Ok(lifted) => lifted,
                Err(why) => {
                    return refuse(field, "of a rod that can move in space", &why.to_string());
                }
            }
        } else {
            scene
        };
        let Scene {
            rod,
            clamp,
            body,
            loads,
            ..
        } = &scene;
        let mut given = AssemblyScene {
            plane: None,
            rods: vec![AssemblyRod {
                name: ROD.to_owned(),
                rod: rod.clone(),
                distributed: loads.distributed.clone(),
                from: base(clamp, on_clamp),
                to: end(body.as_ref(), on_body),
            }],
            free: Vec::new(),
            bodies: vec![carried(body.as_ref(), loads, &scene.start)],
        };
        given.fill_massless();
        let mut stations = scene.stations.clone();
        for station in &mut stations {
            station.rod = Some(ROD.to_owned());
        }
        Some(Scene {
            clamp: Clamp::default(),
            body: None,
            start,
            loads: Loads {
                gravity: scene.loads.gravity,
                ..Loads::default()
            },
            stations,
            kind: SceneKind::Assembly(given),
            ..scene
        })
    }
}

/// The start of the assembly: settled, or the unloaded rod. Velocities are those of the body.
fn start(top: &Table, scene: &Scene) -> Option<Start> {
    let given = &scene.start;
    let place = match &given.place {
        InitialShape::Settled { settled } => InitialShape::Settled { settled: *settled },
        InitialShape::Rest { .. } => InitialShape::Rest {
            rest: Straight::Straight,
        },
        InitialShape::Strain { strain } if strain.is_unloaded() => InitialShape::Rest {
            rest: Straight::Straight,
        },
        _ => {
            let allowed = "settled = true or rest = \"straight\" where the rod is on a joint";
            let hint = "another equilibrium is found near the `guess` of a [[body]]: write the scene with [[rod]] and [[body]]";
            return top.refuse(FaultKind::Conflict, "start", allowed, hint);
        }
    };
    let moves = scene.clamp.motion.is_some() && given.with_clamp;
    let other = given.rate.is_some() || given.relaxed != RelaxedAt::Start || moves;
    if other || given.imperfection != 0.0 {
        let allowed = "without strain_rate, curvature_rate, relaxed, imperfection, and with_clamp of a moving clamp, where the rod is on a joint";
        let hint = "the rates follow from the velocity of the body, which is that in the world";
        return top.refuse(FaultKind::Conflict, "start", allowed, hint);
    }
    Some(Start {
        place,
        ..Start::default()
    })
}

fn base(clamp: &Clamp, joint: SiteJoint) -> Site {
    Site {
        body: None,
        position: clamp.position,
        orientation: clamp.orientation,
        joint,
        motion: clamp.motion.clone(),
    }
}

fn end(body: Option<&Body>, joint: SiteJoint) -> Site {
    let is_point = body.is_some_and(|body| !body.joint.is_weld());
    Site {
        body: Some(body.map_or(END, |_| BODY).to_owned()),
        position: [0.0; 3],
        orientation: crate::scene::Orientation::default(),
        joint: if is_point { SiteJoint::Ball } else { joint },
        motion: None,
    }
}

/// The body of the rod, or a point without mass at the free end, with the loads.
fn carried(body: Option<&Body>, loads: &Loads, start: &Start) -> AssemblyBody {
    let mut force = Load::Constant(loads.dead);
    force.extend(loads.force.clone());
    let still = |moment: f64| Extent {
        inertia: [[moment; 3]; 3],
        offset: [0.0; 3],
        rotor: [0.0; 3],
    };
    AssemblyBody {
        name: body.map_or(END, |_| BODY).to_owned(),
        mass: body.map_or(0.0, |body| body.mass),
        extent: match body.map(|body| &body.joint) {
            None => Some(still(0.0)),
            Some(Joint::Ball) => None,
            Some(Joint::Weld {
                offset,
                inertia,
                rotor,
            }) => Some(Extent {
                inertia: *inertia,
                offset: *offset,
                rotor: *rotor,
            }),
        },
        force,
        couple: loads.couple.clone(),
        drag: loads.drag,
        rotational_drag: loads.rotational_drag,
        guess: None,
        place: None,
        groove: body.and_then(|body| body.groove.clone()),
        shape: body.and_then(|body| body.shape),
        velocity: start.velocity,
        angular_velocity: start.angular_velocity,
        functions: loads.functions.clone(),
    }
}
