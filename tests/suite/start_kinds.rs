//! Starts by kind: start of the rod, motion of the support, treatment of the mass, single rod or assembly, plane or
//! space.

use crate::pairs::{Ran, TURNED, ran};
use snaprod::elastica::Equilibrium;
use snaprod::scene::Scene;
use snaprod::study::modes::{SmallMotions, modes};

/// Treatments of the rod's mass or friction.
const KINDS: [Kind; 4] = [Kind::Massless, Kind::FirstOrder, Kind::Viscous, Kind::Full];
const FORMS: [Form; 3] = [Form::Plane, Form::Space, Form::Assembly];
const BEGINNINGS: [Beginning; 3] = [Beginning::Settled, Beginning::Equilibrium, Beginning::Bent];
const SUPPORTS: [Support; 3] = [Support::Stands, Support::Shakes, Support::Turns];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Massless,
    FirstOrder,
    Viscous,
    Full,
}

/// Form of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Plane,
    Space,
    Assembly,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Beginning {
    Settled,
    /// Under a force on the end alone, with a velocity.
    Equilibrium,
    /// In a circle, with a velocity.
    Bent,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Support {
    Stands,
    Shakes,
    Turns,
}

/// Loads in the world: on the body, per length of the rod, and gravity.
#[derive(Debug, Clone, Copy, Default)]
struct Loads {
    dead: [f64; 2],
    along: [f64; 2],
    gravity: [f64; 2],
}

/// A cantilever along x, of unit length and bending stiffness, with a point mass.
#[derive(Debug, Clone, Copy)]
struct Case {
    kind: Kind,
    beginning: Beginning,
    support: Support,
    loads: Loads,
    /// Mass of the rod and of the body.
    masses: [f64; 2],
    /// Angle of the clamp in the plane.
    tilt: f64,
    duration: f64,
}

const LOADS: Loads = Loads {
    dead: [-0.5, -1.5],
    along: [0.0, 0.0],
    gravity: [0.3, -1.0],
};
/// Inertia of the sections in space, too small to change any compared number.
const SECTIONS: &str = "section_inertia = [1e-8, 1e-8, 2e-8]\n";

impl Case {
    fn new(kind: Kind, beginning: Beginning, support: Support) -> Self {
        Self {
            kind,
            beginning,
            support,
            loads: LOADS,
            masses: [0.05, 1.0],
            tilt: 0.0,
            duration: 0.01,
        }
    }

    /// A rod that settles on a clamp at rest.
    fn settled(kind: Kind, loads: Loads, masses: [f64; 2]) -> Self {
        Self {
            loads,
            masses,
            duration: 1e-3,
            ..Self::new(kind, Beginning::Settled, Support::Stands)
        }
    }

    fn rod(&self, form: Form) -> String {
        let model = match form {
            Form::Plane => "model = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n",
            _ => {
                "model = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.2], torsion = 1.0 }\n"
            }
        };
        let inertia = match self.kind {
            Kind::Massless | Kind::Viscous => "none",
            Kind::FirstOrder => "first-order",
            Kind::Full => "full",
        };
        let friction = match (self.kind, form) {
            (Kind::Massless | Kind::FirstOrder, _) => "",
            (_, Form::Plane) => "damping = 0.05\n",
            (_, _) => "damping = { proportional = 0.05 }\n",
        };
        let nodes = if friction.is_empty() {
            ""
        } else {
            "nodes = 10\n"
        };
        let sections = if form == Form::Plane { "" } else { SECTIONS };
        format!(
            "{model}mass = {:?}\ninertia = \"{inertia}\"\n{sections}{friction}{nodes}",
            self.masses[0]
        )
    }

    /// The motion of the clamp.
    fn motion(&self, form: Form) -> String {
        let planar = form == Form::Plane;
        match self.support {
            Support::Stands => String::new(),
            Support::Shakes => {
                let direction = if planar {
                    "[0.6, 0.8]"
                } else {
                    "[0.6, 0.8, 0.0]"
                };
                format!(
                    "motion = {{ translate = {{ direction = {direction}, amplitude = 0.1, frequency = 1.0 }} }}"
                )
            }
            Support::Turns => {
                let axis = if planar {
                    ""
                } else {
                    "axis = [0.0, 0.0, 1.0], "
                };
                format!("motion = {{ turn = {{ {axis}rate = 0.7 }} }}")
            }
        }
    }

    /// The scene; `None` for an assembly with a start other than settled, which scenes do not support.
    fn text(&self, form: Form) -> Option<String> {
        let planar = form == Form::Plane;
        let vector = |[x, y]: [f64; 2]| {
            if planar {
                format!("[{x:?}, {y:?}]")
            } else {
                format!("[{x:?}, {y:?}, 0.0]")
            }
        };
        let (
            rod,
            motion,
            Loads {
                dead,
                along,
                gravity,
            },
        ) = (self.rod(form), self.motion(form), self.loads);
        let run = format!(
            "[run]\nduration = {:?}\nsamples = 2\ntolerance = 1e-7\n",
            self.duration
        );
        if form == Form::Assembly {
            let comma = if motion.is_empty() { "" } else { ", " };
            let distributed = format!("distributed = {}\n", vector(along));
            return (self.beginning == Beginning::Settled).then(|| {
                format!(
                    "[[rod]]\nname = \"r\"\n{rod}{distributed}from = {{ position = [0.0, 0.0, 0.0], {TURNED}{comma}{motion} }}\n\
                     to = {{ body = \"m\", joint = \"ball\" }}\n[[body]]\nname = \"m\"\nmass = {:?}\nforce = {}\n[loads]\ngravity = {}\n{run}",
                    self.masses[1],
                    vector(dead),
                    vector(gravity),
                )
            });
        }
        let velocity = format!("velocity = {}", vector([0.2, 0.1]));
        let start = match (self.beginning, planar) {
            (Beginning::Settled, _) => "settled = true".to_owned(),
            // A light rod under a force of lambda^2 on its end.
            (Beginning::Equilibrium, true) => {
                format!("lambda = {LAMBDA:?}\nkappa = {KAPPA:?}\n{velocity}")
            }
            (Beginning::Equilibrium, false) => {
                let at = Equilibrium::from_lambda_kappa(LAMBDA, KAPPA).expect("an equilibrium");
                let [x, y] = [at.alpha.cos(), at.alpha.sin()].map(|part| -LAMBDA * LAMBDA * part);
                format!("equilibrium = {{ force = [{x:?}, {y:?}, 0.0] }}\n{velocity}")
            }
            (Beginning::Bent, true) => format!("curvature = [0.8]\n{velocity}"),
            (Beginning::Bent, false) => format!("strain = {{ u1 = [0.8] }}\n{velocity}"),
        };
        let place = if planar {
            format!("angle = {:?}\n", self.tilt)
        } else {
            format!("{TURNED}\n")
        };
        let joint = if planar { "" } else { "joint = \"ball\"\n" };
        Some(format!(
            "[rod]\n{rod}[clamp]\n{place}{motion}\n[body]\nmass = {:?}\n{joint}[start]\n{start}\n[loads]\ndead = {}\ndistributed = {}\ngravity = {}\n{run}",
            self.masses[1],
            vector(dead),
            vector(along),
            vector(gravity),
        ))
    }

    fn ran(&self, form: Form) -> Option<Result<Ran, String>> {
        self.text(form).map(|text| ran(&text))
    }

    fn modes(&self, form: Form) -> Option<Result<SmallMotions, String>> {
        let text = self.text(form)?;
        let scene = Scene::parse(&text).map_err(|faults| faults.to_string());
        let found = scene.and_then(|scene| modes(&scene).map_err(|why| why.to_string()));
        Some(found.map(|record| record.motions))
    }
}

const LAMBDA: f64 = 1.5;
const KAPPA: f64 = 0.3;

impl Case {
    /// Message of an intentional refusal of a kind.
    fn refused(&self, form: Form) -> Option<&'static str> {
        let elastic = matches!(self.kind, Kind::Massless | Kind::FirstOrder);
        let weighs = self.loads.gravity != [0.0; 2];
        match (self.kind, form) {
            (Kind::Viscous, Form::Assembly) => Some("rods of an assembly without mass are elastic"),
            (Kind::Viscous, _) if self.support == Support::Turns && weighs => {
                Some("is followed with all of its mass alone")
            }
            _ if elastic && self.beginning == Beginning::Bent => {
                Some("must be left out where the rod has no damping")
            }
            _ => None,
        }
    }

    /// Accepted difference between plane and space, one rod and an assembly: for rods with mass, the rotary inertia of
    /// sections and the next order.
    fn alike(&self) -> f64 {
        match self.kind {
            Kind::Massless | Kind::Viscous => 1e-7,
            Kind::FirstOrder | Kind::Full => 2e-5,
        }
    }
}

/// Catches a start that differs between one rod and an assembly, or between plane and space. A rod with full mass that
/// settles and then moves because its clamp turns is an example. Catches a kind accepted by only some of the three
/// forms.
#[test]
#[ignore = "second tier: 4 s"]
fn starts_of_every_kind_are_alike_however_they_are_written() {
    let mut wrong = Vec::new();
    for (kind, beginning, support) in KINDS.iter().flat_map(|kind| {
        let both = BEGINNINGS
            .iter()
            .flat_map(|b| SUPPORTS.iter().map(move |s| (b, s)));
        both.map(move |(beginning, support)| (*kind, *beginning, *support))
    }) {
        let mut case = Case::new(kind, beginning, support);
        if beginning == Beginning::Equilibrium {
            // The first-order mass of a light rod in space includes weight; the planar one does not.
            case.loads.gravity = [0.0; 2];
        }
        let mut first: Option<Ran> = None;
        for form in FORMS {
            let told = format!("{kind:?} {beginning:?} {support:?} {form:?}");
            let ran = match (case.ran(form), case.refused(form)) {
                (None, _) => continue,
                (Some(Ok(ran)), None) => ran,
                (Some(Err(why)), Some(words)) if why.contains(words) => continue,
                (Some(found), words) => {
                    wrong.push(format!(
                        "{told}: {:?}, to be refused: {words:?}",
                        found.err()
                    ));
                    continue;
                }
            };
            let rests = ran.vectors(["vx", "vy", "vz"])[0].amax();
            if beginning == Beginning::Settled && !(rests < 1e-10) {
                wrong.push(format!("{told}: it starts at {rests:e}"));
            }
            let first = match &first {
                Some(first) => first,
                None => {
                    first = Some(ran);
                    continue;
                }
            };
            for name in QUANTITIES {
                let (Some(a), Some(b)) = (first.ends(name), ran.ends(name)) else {
                    continue;
                };
                // Skipped: the end of an unsupported circular rod accelerates by an amount that depends on the nodes.
                if name.starts_with('f') && beginning == Beginning::Bent {
                    continue;
                }
                // The work of moving supports is counted from different origins by one rod and an assembly.
                let times = if name == "potential" && support != Support::Stands {
                    1
                } else {
                    2
                };
                for i in 0..times {
                    if !((a[i] - b[i]).abs() < case.alike() * (1.0 + a[i].abs())) {
                        wrong.push(format!("{told}: {name} {} and {}", a[i], b[i]));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

const QUANTITIES: [&str; 10] = [
    "x",
    "y",
    "vx",
    "vy",
    "fx",
    "fy",
    "elastic",
    "kinetic",
    "rod_kinetic",
    "potential",
];

/// End position of a buckled cantilever: along, and across the line of the clamp. Under an end load of 4 by elliptic
/// integrals; under a weight of 20 as a light rod, by shooting; ten nodes are off by 4e-6.
const PUSHED: [f64; 2] = [0.2741801869, 0.8024065174];
const WEIGHED: [f64; 2] = [-0.3342055955, 0.7049142372];

fn buckling() -> [(Loads, [f64; 2], Option<[f64; 2]>); 3] {
    let none = Loads::default();
    [
        (
            Loads {
                dead: [-4.0, 0.0],
                ..none
            },
            [0.02, 1.0],
            Some(PUSHED),
        ),
        (
            Loads {
                gravity: [-1.0, 0.0],
                ..none
            },
            [20.0, 1e-3],
            Some(WEIGHED),
        ),
        (
            Loads {
                along: [-9.0, 0.0],
                ..none
            },
            [0.02, 1.0],
            None,
        ),
    ]
}

/// Catches a rod settled on an unstable equilibrium, for every load and every treatment of mass. In the plane the
/// start is refused, in space the rod buckles to one side. Catches a round rod not found because rotation about its
/// load costs no energy.
#[test]
#[ignore = "second tier: 4 s"]
fn nothing_settles_where_it_is_unstable() {
    let mut wrong = Vec::new();
    for kind in KINDS {
        for (loads, masses, end) in buckling() {
            let case = Case::settled(kind, loads, masses);
            for found in [
                case.ran(Form::Plane).map(|ran| ran.err()),
                case.modes(Form::Plane).map(|m| m.err()),
            ] {
                let why = found.flatten().unwrap_or_default();
                let unseen = kind == Kind::Viscous && why.contains("are not found");
                if !(why.contains("either side") || unseen) {
                    wrong.push(format!("{kind:?} {loads:?}: {why:?}"));
                }
            }
            for form in [Form::Space, Form::Assembly] {
                // The search of an assembly under a distributed load takes long.
                let long = form == Form::Assembly && loads.dead == [0.0; 2];
                if long || case.refused(form).is_some() {
                    continue;
                }
                // With a mass twenty thousand times the body's, the first-order motion is meaningless.
                if kind == Kind::FirstOrder && masses[0] > masses[1] {
                    continue;
                }
                let round = case.text(form).filter(|_| kind == Kind::Full);
                let round = round.map(|text| ran(&text.replace("[1.0, 1.2]", "[1.0, 1.0]")));
                for found in [case.ran(form), round].into_iter().flatten() {
                    let told = format!("{kind:?} {loads:?} {form:?}");
                    let ran = match found {
                        Ok(ran) => ran,
                        Err(why) => {
                            wrong.push(format!("{told}: {why}"));
                            continue;
                        }
                    };
                    let [place, _] = ran.vectors(["x", "y", "z"]);
                    let [_, velocity] = ran.vectors(["vx", "vy", "vz"]);
                    let across = place.y.hypot(place.z);
                    let off = end.map_or(0.0, |[x, y]| (place.x - x).hypot(across - y));
                    if !(off < 1e-5 && across > 0.5 && velocity.amax() < 1e-5) {
                        wrong.push(format!("{told}: {place} {velocity}"));
                    }
                }
                // Small motions under one kind of load suffice: one rod, under its weight.
                if masses[0] > 1.0 || form == Form::Assembly {
                    match case.modes(form) {
                        Some(Ok(modes)) if modes.stable && modes.index == 0 => {}
                        found => wrong.push(format!("{kind:?} {loads:?} {form:?}: {found:?}")),
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Catches a refused stable straight rod: pushed below its buckling load, hanging, or pulled taut; and a slightly
/// tilted planar rod that does not lean to the tilted side.
#[test]
fn what_is_stable_settles() {
    let none = Loads::default();
    let cases = [
        (
            Loads {
                dead: [-2.4, 0.0],
                ..none
            },
            [0.02, 1.0],
        ),
        (
            Loads {
                gravity: [1.0, 0.0],
                ..none
            },
            [20.0, 1.0],
        ),
        (
            Loads {
                dead: [1e3, 0.0],
                ..none
            },
            [0.02, 1.0],
        ),
    ];
    let mut wrong = Vec::new();
    for (loads, masses) in cases {
        for form in FORMS {
            // Light inextensible rods pulled straight cannot be followed.
            let place = match Case::settled(Kind::Full, loads, masses).ran(form) {
                Some(Ok(ran)) => ran.vectors(["x", "y", "z"])[0],
                found => {
                    wrong.push(format!("{loads:?} {form:?}: {:?}", found.map(|f| f.err())));
                    continue;
                }
            };
            let off = (place.x - 1.0).abs().max(place.y.abs()).max(place.z.abs());
            if !(off < 1e-8) {
                wrong.push(format!("{loads:?} {form:?}: {place}"));
            }
        }
    }
    for (loads, masses, _) in buckling() {
        let leaning = |kind: Kind| Case {
            tilt: 0.01,
            ..Case::settled(kind, loads, masses)
        };
        let ends = [Kind::Massless, Kind::Full].map(|kind| match leaning(kind).ran(Form::Plane) {
            Some(Ok(ran)) => ran.vectors(["x", "y", "z"])[0],
            found => panic!("{loads:?}: {:?}", found.map(|found| found.err())),
        });
        if !((ends[0] - ends[1]).norm() < 1e-6 && ends[1].y > 0.5) {
            wrong.push(format!("{loads:?}: {ends:?}"));
        }
        let modes = leaning(Kind::Full).modes(Form::Plane);
        if !modes.is_some_and(|found| found.is_ok_and(|modes| modes.stable)) {
            wrong.push(format!("{loads:?}: unstable"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
