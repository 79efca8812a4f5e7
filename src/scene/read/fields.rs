//! Tables of the fields of a scene as data: name, set, unit, default and meaning of each field.
//!
//! The reader walks these tables, and `snaprod schema` and docs/scene.md are printed from them. Conditions between
//! fields are code, next to the functions that read them.

pub(super) use super::field_spec::*;
use super::groove::GROOVE;
use super::obstacle::{BODY_SHAPE, CONTACT, HIT, OBSTACLE, ON as TOUCHED};
use super::ranges::*;

use Form::*;
use Need::{No, Or, Yes};

/// Tables in which a misplaced field may belong.
pub(super) static HOMES: [&Spec; 11] = [
    &TOP,
    &BODY,
    &ROD,
    &SECTION,
    &REST_STRAINS,
    &CLAMP,
    &END,
    &START,
    &LOADS,
    &RUN,
    &SOLVE,
];

const ONE_KIND: &str = "with [body] and [run] the scene is one of motion, with [end], [solve] or [continue] one of statics: keep one of the two";
const NOT_FLAT: &str = "statics are of rods in space, model = \"cosserat\"; there the planar elastica is a rod with rigid shear and axial";

#[rustfmt::skip]
pub(super) static TOP: Spec = Spec {
    name: "",
    fields: &[
        field("units", ANY | BAR | WALL | FLOWS | INFLATIONS, Word(&["si", "dimensionless"]), "", Or("\"dimensionless\", or \"si\" where rod.material or tube.material is given"),
            "The system of units, for labels: it changes no number. \"si\": metre, kilogram, second. Any consistent system will do."),
        field("rod", ONE | BAR, Table(&ROD), "", Yes("model = \"elastica\""), "The rod."),
        field("rod", ASSEMBLY, Array(&Table(&ROD)), "", Yes("[[rod]]"), "The rods of an assembly, each a table [[rod]]. May be left out in a motion of bodies that all have a `position`."),
        field("plane", ASSEMBLY, Vector(&VALUE), "", No, "Normal of a plane in which bodies and rods stay, at rest: bodies move in the plane and turn about its normal, rods bend about it, a ball joint is a hinge, and the index counts what the plane allows. Without it the assembly is in space."),
        field("clamp", ONE, Table(&CLAMP), "", No, "The pose of the rod's base, s = 0, and how it moves; without it, at the origin along the axes."),
        field("body", MOTION, Table(&BODY), "", No, "The body at the end of the rod, s = length, in a scene of motion. May be left out where the rod has inertia = \"full\": its end is then free, and bears the loads of the body."),
        field("body", ASSEMBLY, Array(&Table(&BODY)), "", No, "The bodies of an assembly, each a table [[body]]; no rod is attached to a body that is not listed. May be left out at rest, and in a motion of rods with inertia = \"full\"."),
        field("body", INFLATIONS, Table(&BODY), "", No, "A heavy piston on the vessel of a sphere, in place of the membrane's density."),
        field("body", BAR, Table(&BODY), "", No, "A heavy mass at the end X = length of a bar, which is then free to move."),
        field("end", STATICS, Table(&END), "", Yes("force = [0.0, 0.0, -1.0]"), "What holds or loads the end of the rod, in a scene of statics; may be empty."),
        field("start", PLANE, Table(&START), "", Yes("lambda = 6.3"), "Shape of the rod at the start, and velocity of its end."),
        field("start", ONE_IN_SPACE, Table(&START), "", No, "Shape of the rod at the start, and velocity of its end; in statics where the search begins."),
        field("start", ASSEMBLY, Table(&START), "", No, "Where the bodies of a motion start: without it settled, at the equilibrium under the loads; what nothing holds settles where inertia = \"full\", as it falls."),
        field("start", BAR, Table(&START), "", No, "Uniform stretch and velocity of a bar at the start; without it, at rest and unstretched."),
        field("start", MEMBRANES, Table(&START), "", No, "The stretch of the membrane, in place of a load."),
        field("start", INFLATIONS, Table(&START), "", No, "With a piston: the stretch of the balloon and the velocity of the piston; without it, at rest under the force. A membrane with density starts unloaded and at rest."),
        field("loads", BAR, Table(&LOADS), "", No, "What acts on the end X = length of a bar."),
        field("loads", MOTION, Table(&LOADS), "", No, "What acts on the body beside the rod; without a body, on the end of the rod."),
        field("loads", ASSEMBLY, Table(&LOADS), "", No, "What acts on all bodies."),
        field("loads", STATICS, Table(&LOADS), "", No, "What acts along the rod at rest: its weight, or a force per length."),
        field("loads", MEMBRANES, Table(&LOADS), "", No, "The pressure in the membrane."),
        field("loads", INFLATIONS, Table(&LOADS), "", No, "The pressure in the membrane over time, or the force on a piston."),
        field("load", ANY, Array(&Table(&LISTED)), "", No, "Loads on ends, bodies, places and parts of rods, each a table [[load]], at most 100; beside those of the other tables."),
        field("station", ANY, Array(&Table(&STATION)), "", No, "Places on rods whose motion, strains and resultants are written, each a table [[station]], at most 100."),
        field("obstacle", TOUCHED, Array(&Table(&OBSTACLE)), "", No, "Bodies that stand or move in a given way, which the rod and its body do not enter, each a table [[obstacle]], at most 100."),
        field("contact", HIT, Table(&CONTACT), "", No, "Rules of contact with obstacles, in a motion."),
        field("run", MOTION | BAR | FLOWS | INFLATIONS, Table(&RUN), "", Yes("duration = 3.0"), "How long and how accurately a motion is followed, and what a snap does."),
        field("run", ASSEMBLY, Table(&RUN), "", No, "How long and how accurately a motion is followed; without it the assembly is one of statics."),
        field("solve", STATICS | ASSEMBLY, Table(&SOLVE), "", No, "How accurately, and by which path, equilibria are solved."),
        field("continue", STATICS | ASSEMBLY, Table(&CONTINUE), "", No, "A branch of equilibria in one parameter of the scene; of an assembly at rest."),
        field("continue", WALL, Table(&CONTINUE), "", No, "A branch of sections or of inflated states in one parameter."),
        field("tube", TUBED, Table(&TUBE_TABLE), "", Yes("radius = 5e-3"), "The wall of a tube (docs/tubes.md): a section of it under pressure; with [run] a tube with a flow."),
        field("membrane", INFLATED, Table(&MEMBRANE_TABLE), "", Yes("shape = \"sphere\""), "A membrane under pressure (docs/tubes.md); with [run] in motion."),
        field("outside", TUBED, Table(&OUTSIDE), "", No, "What surrounds the tube."),
        field("upstream", FLOWS, Table(&UPSTREAM), "", No, "What the end x = 0 leads to; without it the tube goes on there, and waves leave."),
        field("downstream", FLOWS, Table(&DOWNSTREAM), "", No, "What the end x = length leads to; without it the tube goes on there, and waves leave."),
        field("start", FLOWS, Table(&START), "", No, "Area and velocity along the tube at the start; without it, round and at rest."),
        field("fluid", TUBED, Table(&FLUID), "", No, "The fluid in the tube."),
        field("gas", INFLATED, Table(&GAS), "", No, "Gas in the membrane and in a vessel joined to it."),
    ],
    barred: &[
        (ASSEMBLY, "clamp", "every rod of an assembly has its own place: `from` in [[rod]]"),
        (ASSEMBLY, "end", "rods of an assembly end on bodies or on the ground: `to` in [[rod]]; a load is force and couple of a [[body]]"),
        (STATICS, "body", "with [end], [solve] or [continue] the scene is one of statics, with [body] and [run] one of motion: keep one of the two; at rest its weight is end.force"),
        (STATICS, "run", "with [end], [solve] or [continue] the scene is one of statics, with [body] and [run] one of motion: keep one of the two; a branch is [continue]"),
        (SPACE, "end", ONE_KIND), (SPACE, "solve", ONE_KIND), (SPACE, "continue", ONE_KIND),
        (PLANE, "end", NOT_FLAT), (PLANE, "solve", NOT_FLAT), (PLANE, "continue", NOT_FLAT),
        (BAR | WALL | INFLATIONS, "obstacle", "obstacles are for rods that bend, model = \"elastica\" or \"cosserat\""),
        (BAR | WALL | INFLATIONS | STATICS, "contact", "rules of contact are for motions of rods that bend, and of their bodies"),
        (FLOWS, "continue", "a flow is run in time: leave out [continue], or [run], [upstream], [downstream] and [start]"),
        (INFLATIONS, "continue", "a membrane in motion is run in time: leave out [continue], or [run], [body] and membrane.density"),
    ],
};

const TANGENT: &str = "Direction of the rod, d3, of any length, in place of quaternion and rotation. Without normal the directors turn the shortest way from the axes (from z to -z about y).";
const NORMAL: &str = "Direction of d1, with tangent: of any length, made perpendicular to tangent.";
const RATES: &str =
    "at rest there are no rates; a scene of motion has [body] and [run] in place of [end]";

#[rustfmt::skip]
pub(super) static ROD: Spec = Spec {
    name: "rod",
    fields: &[
        field("name", ASSEMBLY, Name, "", Yes("name = \"left\""), "The name of the rod, letters, digits, - and _; each rod has another."),
        field("model", PLANE, Word(&["elastica"]), "", Yes("model = \"elastica\""),
            "The planar elastica: it bends in the plane, and neither shears nor stretches. \"cosserat\" is a rod in space."),
        field("model", ASSEMBLY, Word(&["cosserat", "elastica"]), "", Yes("model = \"cosserat\""),
            "The Cosserat rod in space: it bends, twists, shears and stretches. \"elastica\", in an assembly in a plane, is a rod that bends alone."),
        field("model", ONE_IN_SPACE, Word(&["cosserat"]), "", Yes("model = \"cosserat\""),
            "The Cosserat rod in space: it bends, twists, shears and stretches. \"elastica\" is a rod in the plane."),
        field("model", BAR, Word(&["bar"]), "", Yes("model = \"bar\""),
            "A bar with mass in longitudinal motion, with waves and shocks. \"elastica\" and \"cosserat\" are rods that bend and have no mass."),
        field("length", PLANE | BAR, Number(&SIZE), "m", Yes("length = 1.0"), "Length of the unloaded rod."),
        field("length", IN_SPACE, Number(&SIZE), "m", Yes("length = 1.0"), "Length of the unloaded rod. It may be left out where rest.helix or rest.arc says it."),
        field("bending_stiffness", PLANE, Number(&SIZE), "N m²", Yes("bending_stiffness = 1.0"),
            "Bending stiffness EI, or material and section in its place; with Maxwell branches that of the rod after a long time."),
        field("bending_stiffness", ASSEMBLY, Number(&SIZE), "N m²", No, "Bending stiffness EI of model = \"elastica\", in place of a section."),
        field("material", ANY, OneOf(&[Word(&["steel", "aluminium", "nitinol", "PET", "silicone"]), Table(&MATERIAL)]), "", No,
            "What the rod is made of, by name or by its constants; the section says its shape. A name stands for (E in Pa, nu, density in kg/m³): \
             steel (200e9, 0.30, 7850), aluminium (70e9, 0.33, 2700), nitinol (austenite; 75e9, 0.33, 6450), PET (2.8e9, 0.40, 1380), silicone (1e6, 0.49, 1100)."),
        field("section", PLANE, Table(&OUTLINE), "", No, "The shape of the cross-section of a rod of a material."),
        field("section", IN_SPACE, Table(&SECTION), "", Yes("bending = [1.0, 1.0]"), "The section law: stiffnesses, or a shape and a material."),
        field("bends", PLANE, Word(&["weak", "strong"]), "", Or("\"weak\""),
            "Which way a rectangle bends in the plane: \"weak\", about its longer side (a strip lies flat), or \"strong\"."),
        field("rest", IN_SPACE, Table(&REST_STRAINS), "", No, "Strains of the unloaded rod; without it, straight and untwisted."),
        field("drive", IN_SPACE, Table(&DRIVE), "", No, "What muscles, heat or swelling add to the strains of the unloaded rod: shapes along the rod times an amplitude."),
        field("tendon", IN_SPACE, Array(&Table(&TENDON)), "", No, "Frictionless tendons through the sections, each a table [[rod.tendon]], at most 16 (docs/rods.md)."),
        field("damping", PLANE, OneOf(&[Number(&ETA), Table(&DAMPING)]), "N m² s", No,
            "Internal friction: the viscosity eta of the couple EI theta' + eta theta'_t, or a table; without it, or 0, the rod is elastic."),
        field("damping", SPACE | ASSEMBLY, OneOf(&[Numbers(6), Rows(6), Table(&DAMPING)]), "", No,
            "Internal friction: six viscosities in the order u1 u2 u3 v1 v2 v3, six such rows, or a table; without it the rod is elastic. In an assembly with inertia = \"full\" only."),
        field("relaxation", MOTION | ASSEMBLY, Array(&Table(&MAXWELL)), "", No, "Maxwell branches (a Prony series), at most 32, beside a damping > 0."),
        field("nodes", MOTION | ASSEMBLY, Count(4, 400), "", No, "A fixed number of strain nodes; without it the program chooses and adapts it. Only with damping, or with inertia = \"full\"."),
        field("mass", MOTION | ASSEMBLY, Number(&SIZE), "kg", No, "Mass of the whole rod; without it density * area * length of a material and a shape. Its weight mass * loads.gravity acts along the rod; what its inertia does `inertia` says."),
        field("inertia", MOTION, Word(&["none", "full", "first-order"]), "", No,
            "What the mass of the rod does: nothing but weigh (\"none\"); all of it (\"full\": kinetic energy, weight, vibrations and waves of its own, docs/mass.md); or its kinetic energy and weight while the rod stays on its equilibria (\"first-order\": an elastic rod; the error is of the order of (rod mass / body mass)^2 on smooth motion). Without it \"first-order\" for an elastic rod of less than 0.1 of the body's mass where that can be followed, which the run says; else \"none\"."),
        field("inertia", ASSEMBLY, Word(&["none", "full", "first-order"]), "", No,
            "What the mass of the rod does in a motion: nothing but weigh, all of it, or to first order, as that of one rod; \"full\" for all rods or none. Without it \"first-order\" for a rod of less than 0.1 of the mass of each body that it holds, where that can be followed; else \"none\"."),
        field("section_inertia", SPACE | ASSEMBLY, Numbers(3), "kg m", No, "Inertia of the sections per length about d1, d2, d3, > 0; without it mass per length times the second moments over the area of a shape, or times bending / axial stiffness; without either as if the radius of gyration were length/1e6, so that the rod bends as a slender one."),
        field("distributed", ASSEMBLY, SPREAD_LOAD, "N/m", Or("[0.0, 0.0, 0.0]"), "Dead force per length of the unloaded rod, in the world, beside its weight: constant, a polynomial in s/length, or a table in s. Not of a rod between two ball joints, or with a free end."),
        field("mass", STATICS, Number(&SIZE), "kg", No, "Mass of the whole rod, spread evenly; without it density * area * length of a material and a shape. At rest it has the weight mass * loads.gravity."),
        field("contact_diameter", SPACE | ASSEMBLY, Number(&NON_NEGATIVE), "m", No, "How near centrelines come where the rod touches itself or another (the mean of both); the run of an elastic rod stops there. Rods with all of their mass touch each other there, at a run.tolerance of 1e-5 or more, and stop at a finer one. Also the thickness at obstacles of a rod with all of its mass. 0: it is not looked for. Without it the smallest size of the section's shape (diameter of a circle or a tube, thickness of a strip); without a shape it is not looked for."),
        field("contact_diameter", STATICS, Number(&NON_NEGATIVE), "m", No, "Thickness of the rod where obstacles touch it. Without it the smallest size of the section's shape (diameter of a circle or a tube, thickness of a strip); without a shape 0, the centreline."),
        field("area", BAR, Number(&POSITIVE), "m²", Yes("area = 1e-4"), "Area of the undeformed cross-section."),
        field("density", BAR, Number(&POSITIVE), "kg/m³", Yes("density = 1000.0"), "Mass per undeformed volume."),
        field("law", BAR, Table(&LAW), "", Yes("law = { mooney = [24.0, 1.5] }"), "Stress over stretch: one of the laws below."),
        field("scheme", BAR, Word(&["finite-volume", "spectral", "central-lumped", "central-consistent", "stretch-taylor", "stretch-sequential", "lax-wendroff"]), "", Or("\"finite-volume\""),
            "How the bar is computed: by finite volumes, which are right with shocks; by one spectral element, for motions that stay smooth; or by a scheme of the 1970s with its faults (docs/bars.md)."),
        field("cells", BAR, Count(2, 1_000_000), "", Or("300"), "Cells or elements; nodes of the spectral scheme (there without it 24)."),
        field("unstable", BAR, Flag, "", Or("false"), "true: a scheme that is unstable at every step, stretch-taylor, may be used."),
        field("base", BAR, Word(&["wall", "free"]), "", Or("\"wall\""), "Whether the end X = 0 is held or free."),
        field("tip", BAR, Word(&["free", "wall"]), "", Or("\"free\""), "Whether the end X = length is free, with a body and a load if there are, or held."),
        field("from", ASSEMBLY, Table(&SITE), "", Yes("from = { position = [0.0, 0.0, 0.0] }"), "What holds the rod's base, s = 0, and where."),
        field("to", ASSEMBLY, OneOf(&[Word(&["free"]), Table(&SITE)]), "", Yes("to = { body = \"m\" }"), "What holds its end, s = length, and where; \"free\": nothing. A rod with a free end is written after the others. Without mass and load it keeps its rest shape, rides on its base, which is welded, and bears no force (with inertia = \"full\" it bends under its own mass, and its contacts are looked for)."),
    ],
    barred: &[
        (STATICS, "damping", RATES), (STATICS, "relaxation", RATES), (STATICS, "nodes", RATES),
    ],
};

#[rustfmt::skip]
pub(super) static TUBE_TABLE: Spec = spec("tube", &[
    field("radius", TUBED, Number(&SIZE), "m", Yes("radius = 5e-3"), "Radius of the middle line of the wall at no load."),
    field("thickness", TUBED, Number(&SIZE), "m", No, "Thickness of the wall at no load, at most half the radius; needed with a material, and by law = \"extensible\"."),
    field("material", TUBED, Table(&TUBE_MATERIAL), "", No, "What the wall is made of: its bending stiffness is E h^3 / (12 (1 - nu^2)) per axial length."),
    field("stiffness", TUBED, Number(&SIZE), "N m", No, "Bending stiffness D per axial length, in place of a material. With radius = 1 and stiffness = 1 pressures are in D/R^3."),
    field("mode", TUBED, Count(2, 12), "", Or("2"), "Number of lobes into which the tube buckles. Modes above 2 need a support, and end where the walls of a lobe touch."),
    field("law", TUBED, OneOf(&[Word(&["ring", "extensible", "neo-hookean"]), Table(&TUBE_LAW)]), "", Or("\"ring\""),
        "Wall law: \"ring\", which does not stretch, round up to its buckling; \"extensible\", with k = 12 (R/h)^2; \"neo-hookean\", a thick wall that stays round; or a table with an algebraic law."),
    field("stretch", TUBED, Number(&SIZE), "", Or("1.0"), "Stretch along the axis, which makes the wall of a material narrower and thinner."),
    field("area", TUBES, Number(&POSITIVE), "", No, "Area over that of the round section at no load, in place of [outside] pressure."),
    field("length", FLOWS, Number(&SIZE), "m", No, "Length of the tube; needed but for a lumped one."),
    field("cells", FLOWS, Count(4, 1_000_000), "", Or("400"), "Cells along the tube."),
    field("tension", FLOWS, Number(&NON_NEGATIVE), "N", Or("0.0"), "Tension along the tube. Only 0 is computed."),
    field("lumped", FLOWS, Table(&LUMPED), "", No, "A Starling resistor in place of a tube with a length: one area between two rigid tubes. The numbers are in the units of the wall law, as in docs/tubes.md."),
]);
#[rustfmt::skip]
pub(super) static TUBE_MATERIAL: Spec = spec("tube.material", &[
    field("E", TUBED, Number(&STIFFNESS), "Pa", Yes("E = 1.5e6"), "Young's modulus; three times the shear modulus where nu = 0.5."),
    field("nu", TUBED, Number(&POISSON), "", Or("0.5"), "Poisson's ratio."),
]);
#[rustfmt::skip]
pub(super) static TUBE_LAW: Spec = spec("tube.law", &[
    field("power", TUBED, Numbers(2), "", Yes("power = [10.0, -1.5]"), "Exponents m >= 0 >= n of p - p_e = Kp (alpha^m - alpha^n), with Kp = D/R^3."),
]);
#[rustfmt::skip]
pub(super) static OUTSIDE: Spec = spec("outside", &[
    field("pressure", TUBES, Number(&VALUE), "Pa", No, "Pressure outside less inside; or tube.area."),
    field("pressure", FLOWS, OneOf(&[Number(&VALUE), Table(&OUTSIDE_PRESSURE)]), "Pa", Or("0.0"), "Pressure outside: a number, a table along the tube, or a history in time."),
]);
#[rustfmt::skip]
pub(super) static OUTSIDE_PRESSURE: Spec = spec("outside.pressure", &[
    field("table", FLOWS, Rows(2), "m, Pa", No, "Rows [x, p] along the tube, x growing from 0 to its length; linear in between."),
    field("constant", FLOWS, Number(&FINITE), "Pa", No, "A constant pressure."),
    field("amplitude", FLOWS, Number(&FINITE), "Pa", Yes("amplitude = 100.0"), "Amplitude of a sine in time, amplitude * sin(2 pi frequency t + phase)."),
    field("frequency", FLOWS, Number(&NON_NEGATIVE), "Hz", Yes("frequency = 2.0"), "Frequency of the sine."),
    field("phase", FLOWS, Number(&FINITE), "rad", Or("0.0"), "Phase of the sine."),
    field("ramp", FLOWS, Table(&RAMP), "", No, "A linear growth in time."),
    field("pulse", FLOWS, Table(&PULSE), "", No, "A pulse in time."),
    field("block", FLOWS, Table(&BLOCK), "", No, "A constant pressure for a while."),
]);
#[rustfmt::skip]
pub(super) static IN_TIME: Spec = spec("history", &[
    field("constant", FLOWS | INFLATIONS, Number(&FINITE), "Pa or m³/s or N", No, "A constant value."),
    field("amplitude", FLOWS | INFLATIONS, Number(&FINITE), "Pa or m³/s or N", Yes("amplitude = 100.0"), "Amplitude of a sine in time, amplitude * sin(2 pi frequency t + phase)."),
    field("frequency", FLOWS | INFLATIONS, Number(&NON_NEGATIVE), "Hz", Yes("frequency = 2.0"), "Frequency of the sine."),
    field("phase", FLOWS | INFLATIONS, Number(&FINITE), "rad", Or("0.0"), "Phase of the sine."),
    field("ramp", FLOWS | INFLATIONS, Table(&RAMP), "", No, "A linear growth in time."),
    field("pulse", FLOWS | INFLATIONS, Table(&PULSE), "", No, "A pulse in time."),
    field("block", FLOWS | INFLATIONS, Table(&BLOCK), "", No, "A constant value for a while."),
    field("table", FLOWS | INFLATIONS, Rows(2), "s, Pa or m³/s or N", No, "Rows [t, value], linear in between and constant outside."),
]);
#[rustfmt::skip]
pub(super) static UPSTREAM: Spec = spec("upstream", &[
    field("pressure", FLOWS, PRESSURE, "Pa", No, "Pressure of the reservoir: a number or a history in time. Its dynamic pressure at the inlet is won without loss."),
    field("flow", FLOWS, PRESSURE, "m³/s", No, "Flow into the tube, in place of a pressure: a number or a history in time."),
    field("area", FLOWS, Number(&POSITIVE), "", No, "With a flow that is a number and faster than waves: the area A/A0 at the end, which nothing downstream sets."),
    field("closed", FLOWS, Flag, "", Or("false"), "true: no flow through the end."),
    field("resistance", FLOWS, Number(&NON_NEGATIVE), "Pa s/m³", Or("0.0"), "Fall of the pressure over the flow between reservoir and tube."),
    field("inertance", FLOWS, Number(&NON_NEGATIVE), "Pa s²/m³", Or("0.0"), "Inertance of the rigid tube between them: density x length/area."),
    field("recovery", FLOWS, Number(&PART), "", Or("0.0"), "Part of the dynamic pressure that is regained where the flow leaves the tube here; 0 is a jet."),
]);
#[rustfmt::skip]
pub(super) static DOWNSTREAM: Spec = spec("downstream", &[
    field("pressure", FLOWS, PRESSURE, "Pa", No, "Pressure of the reservoir: a number or a history in time."),
    field("flow", FLOWS, PRESSURE, "m³/s", No, "Flow out of the tube, in place of a pressure: a number or a history in time."),
    field("closed", FLOWS, Flag, "", Or("false"), "true: no flow through the end."),
    field("resistance", FLOWS, Number(&NON_NEGATIVE), "Pa s/m³", Or("0.0"), "Fall of the pressure over the flow between tube and reservoir."),
    field("inertance", FLOWS, Number(&NON_NEGATIVE), "Pa s²/m³", Or("0.0"), "Inertance of the rigid tube between them: density x length/area."),
    field("recovery", FLOWS, Number(&PART), "", Or("0.0"), "Part of the dynamic pressure that is regained at the outlet, 1 - chi; 0 is a jet."),
]);
const PRESSURE: Form = OneOf(&[Number(&VALUE), Table(&IN_TIME)]);
#[rustfmt::skip]
pub(super) static LUMPED: Spec = spec("tube.lumped", &[
    field("l1", FLOWS, Number(&SIZE), "", Yes("l1 = 1.0"), "Inertance upstream."),
    field("l2", FLOWS, Number(&SIZE), "", Yes("l2 = 2.0"), "Inertance downstream."),
    field("lam", FLOWS, Number(&SIZE), "", Or("1.0"), "Volume of the collapsible part over its area."),
    field("r1", FLOWS, Number(&NON_NEGATIVE), "", Or("0.0"), "Resistance upstream."),
    field("r2", FLOWS, Number(&NON_NEGATIVE), "", Or("0.0"), "Resistance downstream."),
    field("chi", FLOWS, Number(&PART), "", Or("1.0"), "Part of the dynamic pressure that is lost behind the collapsible part; 1 is a jet."),
    field("E", FLOWS, Number(&FINITE), "", Or("0.0"), "Pressure outside."),
]);
#[rustfmt::skip]
pub(super) static FLUID: Spec = spec("fluid", &[
    field("density", TUBES, Number(&SIZE), "kg/m³", No, "Density, for the speed of pulses in the tube."),
    field("density", FLOWS, Number(&SIZE), "kg/m³", No, "Density; needed but for a lumped tube."),
    field("viscosity", FLOWS, Number(&POSITIVE), "m²/s", No, "Kinematic viscosity; without it there is no friction."),
    field("friction", FLOWS, Word(&["none", "linear", "darcy"]), "", Or("\"linear\" with a viscosity, \"none\" without"), "Friction at the wall: none; that of a slow flow in a round tube, 8 pi viscosity u; or Darcy's with its laminar and turbulent coefficients over the round perimeter."),
]);
#[rustfmt::skip]
pub(super) static MEMBRANE_TABLE: Spec = spec("membrane", &[
    field("shape", INFLATED, Word(&["sphere", "disc"]), "", Yes("shape = \"sphere\""), "A closed sphere, or a flat disc whose edge is held."),
    field("radius", INFLATED, Number(&SIZE), "m", Yes("radius = 0.1"), "Radius of the unloaded membrane."),
    field("thickness", INFLATED, Number(&SIZE), "m", Yes("thickness = 1e-3"), "Thickness of the unloaded membrane."),
    field("law", INFLATED, Table(&LAW), "", Yes("law = { mooney = [24.0, 1.5] }"), "Energy of the incompressible material: neo_hookean, mooney or biderman."),
    field("density", INFLATIONS, Number(&SIZE), "kg/m³", No, "Mass per volume of the unloaded membrane, which starts unloaded and at rest. Left out where a piston, [body], has the mass."),
    field("elements", INFLATIONS, Count(2, 10_000), "", Or("40"), "Number of conical rings of a disc."),
]);
#[rustfmt::skip]
pub(super) static GAS: Spec = spec("gas", &[
    field("contents", MEMBRANES, Number(&SIZE), "J", Yes("contents = 200.0"), "Content p V of gas in membrane and vessel, p absolute, at one temperature: the first state with it on the way from the unloaded membrane."),
    field("contents", INFLATIONS, Number(&SIZE), "J", Yes("contents = 200.0"), "Content p V of gas in membrane and vessel, p absolute, at one temperature. It is let into a membrane with density at the start."),
    field("volume", INFLATED, Number(&NON_NEGATIVE), "m³", Or("0.0"), "Volume of the vessel."),
    field("outside", INFLATED, Number(&NON_NEGATIVE), "Pa", Or("0.0"), "Absolute pressure outside."),
]);

#[rustfmt::skip]
pub(super) static LAW: Spec = spec("rod.law", &[
    field("linear", BAR, Number(&FINITE), "Pa", No, "The modulus E of stress = E (stretch - 1)."),
    field("neo_hookean", BAR | INFLATED, Number(&FINITE), "Pa", No, "C of the energy C (I1 - 3) of an incompressible material."),
    field("mooney", BAR | INFLATED, Numbers(2), "Pa", No, "C1, C2 of C1 (I1 - 3) + C2 (I2 - 3)."),
    field("biderman", BAR | INFLATED, Numbers(4), "Pa", No, "B1 .. B4 of B1 (I1 - 3) + B2 (I1 - 3)^2 + B3 (I1 - 3)^3 + B4 (I2 - 3)."),
    field("polynomial", BAR, List, "Pa", No, "a1, a2, ... of stress = a1 e + a2 e^2 + ..., e = stretch - 1."),
    field("table", BAR, Rows(2), "1, Pa", No, "Rows [stretch, stress], both growing, one of them [1, 0]; a monotone cubic in between. A bar does not leave the table."),
]);

#[rustfmt::skip]
pub(super) static SITE: Spec = spec("site", &[
    field("body", ASSEMBLY, Name, "", No, "The name of the body that holds the rod; without it the ground."),
    field("position", ASSEMBLY, Vector(&VALUE), "m", Or("[0.0, 0.0, 0.0]"), "Place of the attachment: in the frame of the body, or in the world."),
    field("quaternion", ASSEMBLY, Numbers(4), "", No, "Directors of the attachment in the same frame, a unit quaternion [w, x, y, z]; or rotation. Without both, along the axes."),
    field("rotation", ASSEMBLY, Table(&ROTATION), "", No, "Directors of the attachment, by axis and angle."),
    field("tangent", ASSEMBLY, Vector(&VALUE), "", No, TANGENT),
    field("normal", ASSEMBLY, Vector(&VALUE), "", No, NORMAL),
    field("joint", ASSEMBLY, Word(&["weld", "ball", "hinge", "universal", "slider", "roller"]), "", Or("\"weld\""), "What holds the rod's end there. \"weld\": its directors turn with the attachment. \"ball\": it is free to turn. \"hinge\": it turns about `axis` alone. \"universal\": about `axis`, which stays with the attachment, and about `second_axis`, which stays with the rod; with the normal of a plane and d1 this is a fork, which bends freely and holds the twist. \"slider\": it slides along `axis` without a turn. \"roller\": it slides along `axis` and is free to turn. A point mass turns nothing: a rod that ends on one needs no joint and is free to turn, whatever is the default elsewhere. Between two ball joints it is a spring along its chord, and spins about it freely, which its own mass alone feels."),
    field("axis", ASSEMBLY, Vector(&VALUE), "", No, "Free axis of a hinge, first axis of a universal joint, direction of a slider or roller: along the directors of the attachment, not 0, of any length."),
    field("second_axis", ASSEMBLY, Vector(&VALUE), "", No, "Second axis of a universal joint, across the first: along the directors of the attachment where the joint is not turned."),
    field("slide", ASSEMBLY, Vector(&VALUE), "", No, "Direction along which a hinge or universal joint also slides, without force; along the directors of the attachment, not 0."),
    field("couple", ASSEMBLY, Number(&VALUE), "N m", Or("0.0"), "Constant couple on the rod about the axis of a hinge, or the first axis of a universal joint."),
    field("force", ASSEMBLY, Number(&VALUE), "N", Or("0.0"), "Constant force on the rod along the direction of a slider or roller."),
    field("stiffness", ASSEMBLY, Number(&NON_NEGATIVE), "N m or N/m", Or("0.0"), "Spring in the joint: couple per radian of each free axis, force per length of a direction."),
    field("rest", ASSEMBLY, Number(&VALUE), "rad or m", Or("0.0"), "Angle, or shift, at which the spring of the joint is unloaded: from the directors, or the place, of the attachment. Angles of a joint with a spring stay within half a turn."),
    field("damping", ASSEMBLY, Number(&NON_NEGATIVE), "N m s or N s/m", Or("0.0"), "Viscous friction in the joint: couple per rate of the angle of each free axis, force per rate of the shift."),
    field("motion", ASSEMBLY, Table(&CLAMP_MOTION), "", No, "How a place on the ground moves, in a motion; the displacement is from `position`."),
]);

#[rustfmt::skip]
pub(super) static MATERIAL: Spec = spec("material", &[
    field("E", ANY, Number(&STIFFNESS), "Pa", Yes("E = 200e9"), "Young's modulus."),
    field("nu", ANY, Number(&POISSON), "", No, "Poisson's ratio; in space this or G is needed."),
    field("G", ANY, Number(&STIFFNESS), "Pa", No, "Shear modulus, E / (2 (1 + nu)) of an isotropic material."),
    field("density", ANY, Number(&SIZE), "kg/m³", No, "Density: the mass of the rod, which counts where rod.inertia says so."),
]);

#[rustfmt::skip]
pub(super) static OUTLINE: Spec = spec("section", &[
    field("circle", ANY, Table(&CIRCLE), "", No, "A solid circle."),
    field("tube", ANY, Table(&TUBE), "", No, "A round tube."),
    field("rectangle", ANY, Table(&RECTANGLE), "", No, "A solid rectangle."),
]);
#[rustfmt::skip]
pub(super) static CIRCLE: Spec = spec("circle", &[
    field("diameter", PLANE, Number(&SIZE), "m", Yes("diameter = 0.001"), "Diameter."),
    field("diameter", IN_SPACE, SIZED, "m", Yes("diameter = 0.001"), "Diameter; it may vary along the rod."),
]);
#[rustfmt::skip]
pub(super) static TUBE: Spec = spec("section.tube", &[
    field("diameter", PLANE, Number(&SIZE), "m", Yes("diameter = 0.002"), "Outer diameter."),
    field("thickness", PLANE, Number(&SIZE), "m", Yes("thickness = 0.0002"), "Thickness of the wall, less than half the diameter."),
    field("diameter", IN_SPACE, SIZED, "m", Yes("diameter = 0.002"), "Outer diameter; it may vary along the rod."),
    field("thickness", IN_SPACE, SIZED, "m", Yes("thickness = 0.0002"), "Thickness of the wall, less than half the diameter; it may vary along the rod."),
]);
#[rustfmt::skip]
pub(super) static RECTANGLE: Spec = spec("rectangle", &[
    field("width", PLANE, Number(&SIZE), "m", Yes("width = 0.02"), "Side along d1. Bending about d1, stiffness bending[0] = E width thickness³/12, is that of a strip that lies flat."),
    field("thickness", PLANE, Number(&SIZE), "m", Yes("thickness = 0.0005"), "Side along d2; bending about d2 has the stiffness bending[1] = E thickness width³/12."),
    field("width", IN_SPACE, SIZED, "m", Yes("width = 0.02"), "Side along d1; it may vary along the rod. Bending about d1, stiffness bending[0] = E width thickness³/12, is that of a strip that lies flat."),
    field("thickness", IN_SPACE, SIZED, "m", Yes("thickness = 0.0005"), "Side along d2; it may vary along the rod. Bending about d2 has the stiffness bending[1] = E thickness width³/12."),
]);

/// The fields of each kind of section are neighbours: KINDS in section.rs refers to index ranges.
#[rustfmt::skip]
pub(super) static SECTION: Spec = spec("rod.section", &[
    field("law", IN_SPACE, Word(&["linear", "barrier"]), "", Or("\"linear\""), "The law: linear, or with an energy that is infinite at total compression (AMV (2.7))."),
    field("barrier", IN_SPACE, Table(&BARRIER), "", No, "The barrier of law = \"barrier\"."),
    field("bending", IN_SPACE, Array(&HELD), "N m²", Yes("bending = [1.0, 1.0]"), "Two stiffnesses: couple per flexure about d1 and about d2. Each number may vary along the rod. One may be \"rigid\": the rod bends about the other director alone."),
    field("torsion", IN_SPACE, HELD, "N m²", Yes("torsion = 0.7"), "Couple per twist; or \"rigid\": it does not twist."),
    field("shear", IN_SPACE, OneOf(&[Word(&["rigid"]), Array(&VARIES)]), "N", Or("\"rigid\""), "Two stiffnesses: force per shear along d1 and along d2; or \"rigid\": unshearable."),
    field("axial", IN_SPACE, OneOf(&[Word(&["rigid"]), VARIES]), "N", Or("\"rigid\""), "Force per stretch; or \"rigid\": inextensible."),
    field("shape", IN_SPACE, Word(&["circle", "rectangle", "tube"]), "", Yes("shape = \"circle\""), "The shape of the cross-section, with its sizes, young and poisson; or circle, tube or rectangle with rod.material. Each size may vary along the rod: stiffnesses follow by their formulas, the mass the area."),
    field("radius", IN_SPACE, SIZED, "m", No, "Radius of a circle; or diameter."),
    field("diameter", IN_SPACE, SIZED, "m", No, "Diameter of a circle."),
    field("width", IN_SPACE, SIZED, "m", Yes("width = 0.01"), "Side of a rectangle along d1."),
    field("height", IN_SPACE, SIZED, "m", Yes("height = 0.01"), "Side of a rectangle along d2."),
    field("outer_radius", IN_SPACE, SIZED, "m", No, "Outer radius of a tube; or outer_diameter."),
    field("outer_diameter", IN_SPACE, SIZED, "m", No, "Outer diameter of a tube."),
    field("thickness", IN_SPACE, SIZED, "m", Yes("thickness = 0.001"), "Thickness of the wall of a tube, less than its outer radius."),
    field("young", IN_SPACE, Number(&STIFFNESS), "Pa", Yes("young = 2.1e11"), "Young's modulus of a shape."),
    field("shear_modulus", IN_SPACE, Number(&STIFFNESS), "Pa", No, "Shear modulus of a shape; or poisson."),
    field("poisson", IN_SPACE, Number(&POISSON), "", No, "Poisson's ratio of a shape."),
    field("shear_factor", IN_SPACE, Number(&SHEAR_FACTOR), "", No, "Shear stiffness over G times area; without it that of the shape (Cowper)."),
    field("torsion_constant", IN_SPACE, Number(&STIFFNESS), "m⁴", No, "Torsional stiffness over G; without it St Venant's constant of the shape."),
    field("rigid", IN_SPACE, Array(&Word(&["u1", "u2", "u3", "v1", "v2", "v3"])), "", Or("[]"), "Strains held at their rest values, at most one of u1 and u2. Of a matrix any, of a shape u1, u2, u3 (shear and axial have words of their own)."),
    field("stiffness", IN_SPACE, Rows(6), "", Yes("stiffness = [[1.0, 0.0, ...], ...]"), "The whole law: six rows of six stiffnesses, in the order u1 u2 u3 v1 v2 v3 (flexure, flexure, twist, shear, shear, stretch)."),
    field("circle", IN_SPACE, Table(&CIRCLE), "", No, "A solid circle of rod.material."),
    field("tube", IN_SPACE, Table(&TUBE), "", No, "A round tube of rod.material."),
    field("rectangle", IN_SPACE, Table(&RECTANGLE), "", No, "A solid rectangle of rod.material."),
]);
const HELD: Form = OneOf(&[Word(&["rigid"]), Number(&STIFFNESS), Table(&ALONG)]);
const VARIES: Form = OneOf(&[Number(&STIFFNESS), Table(&ALONG)]);
const SIZED: Form = OneOf(&[Number(&SIZE), Table(&ALONG)]);
const BENT: Form = OneOf(&[Number(&VALUE), Table(&ALONG)]);

#[rustfmt::skip]
pub(super) static ALONG: Spec = spec("along", &[
    field("s", IN_SPACE, List, "m", Yes("s = [0.0, 1.0]"), "Arclengths that grow from 0 to the length of the rod; linear in between. One that stands twice is a jump."),
    field("values", IN_SPACE, List, "", Yes("values = [1.0, 0.5]"), "The value at each of s."),
    field("polynomial", IN_SPACE, List, "", No, "c0, c1, ... (1 to 16) of c0 + c1 x + ..., x = s / length, in place of s and values."),
    field("pieces", IN_SPACE, Array(&List), "", No, "Of curvature and twist, in place of values: between each two neighbours of s a polynomial c0 + c1 y + ..., y from 0 to 1. As scene.toml has the curve of a `centreline`."),
]);
#[rustfmt::skip]
pub(super) static BARRIER: Spec = spec("barrier", &[
    field("strength", ANY, Number(&SIZE), "N", Yes("strength = 1.0"), "Size of its energy per length; of friction, what it adds to the axial viscosity of the straight rod (N s)."),
    field("half_widths", ANY, Numbers(2), "m", Yes("half_widths = [0.05, 0.05]"), "Half widths of the cross-section along d1 and d2, > 0."),
]);
#[rustfmt::skip]
pub(super) static REST_STRAINS: Spec = spec("rod.rest", &[
    field("curvature", IN_SPACE, Array(&BENT), "1/m", Or("[0.0, 0.0]"), "Flexures of the unloaded rod about d1 and d2."),
    field("twist", IN_SPACE, BENT, "rad/m", Or("0.0"), "Twist of the unloaded rod."),
    field("helix", IN_SPACE, Table(&COIL), "", No, "A helix, in place of curvature and twist. d1 points to its axis."),
    field("arc", IN_SPACE, Table(&ARC), "", No, "An arc of a circle, in place of curvature and twist: two of radius, angle and the length of the rod. d1 points to its centre."),
    field("centreline", IN_SPACE, OneOf(&[Name, Rows(3), Table(&CENTRELINE)]), "", No, "A smooth curve through points, in place of curvature and twist: the name of a file, rows [x, y, z], or a table."),
]);
#[rustfmt::skip]
pub(super) static CENTRELINE: Spec = spec("rod.rest.centreline", &[
    field("file", IN_SPACE, Name, "", No, "Name of a file with a row for each point, 4 at least; it counts from the directory of the scene's file. Or points."),
    field("columns", IN_SPACE, Array(&Name), "", Or("[\"x\", \"y\", \"z\"]"), "Names of the columns of `file`. Without a line of names the columns stand in this order."),
    field("points", IN_SPACE, Rows(3), "m", No, "The points as rows [x, y, z], 4 at least, in place of a file."),
    field("pieces", IN_SPACE, Count(1, 1000), "", No, "Number of polynomial pieces of the curve, for points with noise: the curve is then nearest to the points, in the sense of least squares. Without it a curve through the points; of more than 105 points, 100 pieces."),
    field("normal", IN_SPACE, Vector(&VALUE), "", No, "Direction of d1 at the first point, in the axes of the points; a part along the tangent is left out. Without it the axis that is most across the tangent."),
    field("twist", IN_SPACE, Number(&VALUE), "rad/m", Or("0.0"), "Twist of the unloaded rod about its centreline. At 0 the directors do not turn about the tangent."),
]);
#[rustfmt::skip]
pub(super) static COIL: Spec = spec("rod.rest.helix", &[
    field("radius", IN_SPACE, Number(&SIZE), "m", Yes("radius = 0.02"), "Radius of the centreline."),
    field("pitch", IN_SPACE, Number(&VALUE), "m", Yes("pitch = 0.05"), "Rise along the axis in a turn; negative of a left-handed helix."),
    field("turns", IN_SPACE, Number(&SIZE), "", No, "Turns, from which the length of the rod follows; or the length."),
    field("left", IN_SPACE, Flag, "", Or("false"), "true: a left-handed helix of positive pitch."),
]);
#[rustfmt::skip]
pub(super) static ARC: Spec = spec("rod.rest.arc", &[
    field("radius", IN_SPACE, Number(&SIZE), "m", No, "Radius of the centreline."),
    field("angle", IN_SPACE, Number(&VALUE), "rad", No, "Angle between the tangents of both ends, not 0; negative bends away from d1."),
    field("angle_degrees", IN_SPACE, Number(&VALUE), "degree", No, "That angle in degrees."),
]);
#[rustfmt::skip]
pub(super) static DRIVE: Spec = spec("rod.drive", &[
    field("curvature", IN_SPACE, Array(&BENT), "1/m", Or("[0.0, 0.0]"), "Flexures about d1 and d2 at amplitude 1; each may vary along the rod."),
    field("twist", IN_SPACE, BENT, "rad/m", Or("0.0"), "Twist at amplitude 1."),
    field("stretch", IN_SPACE, BENT, "", Or("0.0"), "Stretch at amplitude 1, added to that of the unloaded rod, 1."),
    field("amplitude", STATICS, Number(&VALUE), "", Or("1.0"), "Their common factor, for branches."),
    field("amplitude", SPACE | ASSEMBLY, OneOf(&[Number(&VALUE), Table(&HISTORY)]), "", Or("1.0"), "Their common factor: constant or, in a motion, in time."),
]);
#[rustfmt::skip]
pub(super) static TENDON: Spec = spec("rod.tendon", &[
    field("offset", IN_SPACE, OneOf(&[Numbers(2), Table(&OFFSET)]), "m", Yes("offset = [0.01, 0.0]"),
        "Where the tendon runs, from the centreline along d1 and d2: two numbers, parallel to the centreline; or a table. It may lie outside of the section."),
    field("to", IN_SPACE, Number(&SIZE), "m", No, "Arclength of its anchor; without it the end of the rod."),
    field("tension", STATICS, Number(&NON_NEGATIVE), "N", No, "Its tension, the same all along; or length."),
    field("tension", SPACE | ASSEMBLY, OneOf(&[Number(&NON_NEGATIVE), Table(&HISTORY)]), "N", No, "Its tension, the same all along: constant or, in a motion, in time."),
    field("length", IN_SPACE, Number(&SIZE), "m", No, "Length of its path from s = 0 to its anchor, in statics of one rod: the tension follows, 0 where the tendon is slack."),
]);
#[rustfmt::skip]
pub(super) static HISTORY: Spec = spec("rod.drive.amplitude", &[
    field("constant", SPACE | ASSEMBLY, Number(&FINITE), "", No, "A constant value, in place of a sine."),
    field("mean", SPACE | ASSEMBLY, Number(&FINITE), "", Or("0.0"), "Mean of a sine; of a tension at least the amplitude, since a tendon only pulls."),
    field("amplitude", SPACE | ASSEMBLY, Number(&FINITE), "", Yes("amplitude = 0.5"), "Amplitude of a sine, mean + amplitude * sin(2 pi frequency t + phase)."),
    field("frequency", SPACE | ASSEMBLY, Number(&NON_NEGATIVE), "Hz", Yes("frequency = 2.0"), "Frequency of the sine, cycles per time."),
    field("phase", SPACE | ASSEMBLY, Number(&FINITE), "rad", Or("0.0"), "Phase of the sine."),
    field("ramp", SPACE | ASSEMBLY, Table(&RAMP), "", No, "A value that grows linearly, in place of a sine."),
    field("pulse", SPACE | ASSEMBLY, Table(&PULSE), "", No, "A pulse, in place of a sine."),
    field("table", SPACE | ASSEMBLY, Rows(2), "s, 1", No, "Rows [t, value], linear in between and constant outside, in place of a sine."),
]);
#[rustfmt::skip]
pub(super) static OFFSET: Spec = spec("rod.tendon.offset", &[
    field("linear", IN_SPACE, Rows(2), "m", No, "Two offsets [d1, d2], at s = 0 and at the anchor; linear in between."),
    field("helix", IN_SPACE, Table(&HELIX), "", No, "Around the centreline."),
    field("table", IN_SPACE, Rows(3), "m", No, "Rows [s, d1, d2], s growing from 0 at least to the anchor, 2 to 500; linear in between, with guides at the kinks."),
]);
#[rustfmt::skip]
pub(super) static HELIX: Spec = spec("rod.tendon.offset.helix", &[
    field("distance", IN_SPACE, Number(&NON_NEGATIVE), "m", Yes("distance = 0.01"), "Distance from the centreline."),
    field("phase", IN_SPACE, Number(&VALUE), "rad", Or("0.0"), "Angle from d1 towards d2 at s = 0."),
    field("turns", IN_SPACE, Number(&VALUE), "", Yes("turns = 1.0"), "Turns on the length of the rod."),
]);
#[rustfmt::skip]
pub(super) static DAMPING: Spec = spec("damping", &[
    field("proportional", PLANE, Number(&POSITIVE_DAMPING), "s", No, "A time: viscosity over bending stiffness."),
    field("proportional", SPACE | ASSEMBLY, Number(&SIZE), "s", No, "A time: viscosity over stiffness, the same for all strains."),
    field("viscosity", PLANE, Number(&POSITIVE_DAMPING), "N m² s", No, "Viscosity eta, in place of proportional."),
    field("viscosity", SPACE | ASSEMBLY, OneOf(&[Numbers(6), Rows(6)]), "", No, "Six viscosities, or six rows, in place of proportional."),
    field("exponent", MOTION | ASSEMBLY, Number(&EXPONENT), "", No, "Above `rate` friction grows as rate^exponent (Carreau); 1 is linear, less is shear thinning. With `rate`."),
    field("rate", MOTION | ASSEMBLY, Number(&SIZE), "1/(m s)", No, "Rate of the curvature at which the power sets in; in space of flexure about the weakest axis of the section, wherever along the rod, and other rates count by their energy. With `exponent`."),
    field("barrier", SPACE | ASSEMBLY, Table(&BARRIER), "", No, "Friction that is infinite at total compression (AMV (2.40))."),
]);
#[rustfmt::skip]
pub(super) static MAXWELL: Spec = spec("relaxation", &[
    field("stiffness", PLANE, Number(&NON_NEGATIVE), "N m²", Yes("stiffness = 0.5"), "What the branch adds to the bending stiffness at once."),
    field("stiffness", SPACE | ASSEMBLY, OneOf(&[Numbers(6), Rows(6), Table(&PROPORTIONAL)]), "", Yes("stiffness = { proportional = 0.5 }"),
        "What the branch adds to the stiffnesses at once, in the order u1 u2 u3 v1 v2 v3."),
    field("time", MOTION | ASSEMBLY, Number(&POSITIVE), "s", Yes("time = 2.0"), "Its relaxation time."),
]);
#[rustfmt::skip]
pub(super) static PROPORTIONAL: Spec = spec("proportional", &[
    field("proportional", SPACE | ASSEMBLY, Number(&NON_NEGATIVE), "", Yes("proportional = 0.5"), "So many times the stiffness of the section."),
]);

#[rustfmt::skip]
pub(super) static CLAMP: Spec = Spec {
    name: "clamp",
    fields: &[
    field("position", ONE, Vector(&VALUE), "m", Or("0"), "Position of the base."),
    field("angle", PLANE, Number(&VALUE), "rad", Or("0.0"), "Angle of the rod's tangent at the base from +x towards +y."),
    field("quaternion", ONE_IN_SPACE, Numbers(4), "", No, "Orientation of the directors at the base, a unit quaternion [w, x, y, z]; or rotation. Without both, along the axes."),
    field("rotation", ONE_IN_SPACE, Table(&ROTATION), "", No, "Orientation of the directors at the base, by axis and angle."),
    field("tangent", ONE_IN_SPACE, Vector(&VALUE), "", No, TANGENT),
    field("normal", ONE_IN_SPACE, Vector(&VALUE), "", No, NORMAL),
    field("motion", MOTION, Table(&CLAMP_MOTION), "", No, "How the clamp moves."),
    field("free", ONE, Flag, "", Or("false"), "True: nothing holds the base, and the rod flies. Position and orientation are those of the base at the start, start.velocity and start.angular_velocity those of the base. In space, with inertia = \"full\"."),
    field("joint", SPACE, Word(&["weld", "ball", "hinge", "universal", "slider", "roller"]), "", Or("\"weld\""), "What holds the rod's base there in a motion of an elastic rod, or with inertia = \"full\"; the kinds are those of `from` in [[rod]]. With a joint the scene runs as an assembly of the rod \"rod\" and the body \"body\", or \"end\" where [body] is left out."),
    field("joint", PLANE, Word(&["weld", "hinge"]), "", Or("\"weld\""), "\"hinge\": the base turns freely in the plane. The scene then runs in space, as an assembly of the rod \"rod\" and the body \"body\"."),
    field("axis", SPACE, Vector(&VALUE), "", No, "Axis of a joint that has one, as in `from` of [[rod]], along the directors there."),
    field("second_axis", SPACE, Vector(&VALUE), "", No, "Second axis of a universal joint, which stays with the rod."),
    field("slide", SPACE, Vector(&VALUE), "", No, "Direction along which a hinge or universal joint also slides, without force."),
    field("couple", SPACE, Number(&VALUE), "N m", Or("0.0"), "Constant couple of a hinge or universal joint on the rod, about the first axis."),
    field("force", SPACE, Number(&VALUE), "N", Or("0.0"), "Constant force of a slider or roller on the rod, along the axis."),
    field("stiffness", SPACE, Number(&NON_NEGATIVE), "N m or N/m", Or("0.0"), "Spring in the joint: couple per radian, force per length."),
    field("rest", SPACE, Number(&VALUE), "rad or m", Or("0.0"), "Angle, or shift, at which the spring of the joint is unloaded."),
    field("damping", SPACE, Number(&NON_NEGATIVE), "N m s or N s/m", Or("0.0"), "Viscous friction in the joint: couple per rate of the angle, force per rate of the shift."),
    ],
    barred: &[(STATICS, "joint", "at rest a rod on joints is one [[rod]] with `from` and `to`, each with its joint")],
};
#[rustfmt::skip]
pub(super) static ROTATION: Spec = spec("rotation", &[
    field("axis", IN_SPACE, Vector(&VALUE), "", Yes("axis = [0.0, 1.0, 0.0]"), "Axis in the world, not 0, of any length."),
    field("angle", IN_SPACE, Number(&VALUE), "rad", No, "Angle in radians, of any size; or angle_degrees."),
    field("angle_degrees", IN_SPACE, Number(&VALUE), "degree", No, "Angle in degrees."),
]);
#[rustfmt::skip]
pub(super) static CLAMP_MOTION: Spec = spec("clamp.motion", &[
    field("translate", RUNS, OneOf(&[Array(&List), Table(&SHAKE)]), "", No,
        "Displacement of the clamp from its position: a table of rows [t, x, y] (in space [t, x, y, z]), at rest before the first and after the last and smooth between them; or a sine."),
    field("turn", RUNS, Table(&TURN), "", No, "Rotation of the clamp about its position: at a constant rate, a sine, or a table."),
]);
#[rustfmt::skip]
pub(super) static SHAKE: Spec = spec("clamp.motion.translate", &[
    field("direction", PLANE, Vector(&VALUE), "", Yes("direction = [0.0, 1.0]"), "Direction, not 0, of any length."),
    field("direction", SPACE | ASSEMBLY, Vector(&VALUE), "", Yes("direction = [0.0, 1.0, 0.0]"), "Direction, not 0, of any length."),
    field("amplitude", RUNS, Number(&FINITE), "m", Yes("amplitude = 0.01"), "Amplitude."),
    field("frequency", RUNS, Number(&NON_NEGATIVE), "Hz", Yes("frequency = 2.0"), "Frequency, cycles per time."),
    field("phase", RUNS, Number(&FINITE), "rad", Or("0.0"), "Phase."),
]);
#[rustfmt::skip]
pub(super) static TURN: Spec = spec("clamp.motion.turn", &[
    field("axis", SPACE | ASSEMBLY, Vector(&VALUE), "", Yes("axis = [0.0, 0.0, 1.0]"), "Axis in the world, not 0, of any length; not with rotation vectors."),
    field("table", PLANE, Rows(2), "s, rad", No, "Rows [t, angle] of growing times: smooth through them, at rest before the first and after the last."),
    field("table", SPACE | ASSEMBLY, OneOf(&[Rows(2), Rows(4)]), "s, rad", No,
        "Rows of growing times, [t, angle] about the axis or [t, x, y, z] with rotation vectors in the world: smooth through them (a spline of degree 5), at rest before the first and after the last."),
    field("rate", RUNS, Number(&FINITE), "rad/s", No, "Constant angular velocity; or a sine by amplitude and frequency."),
    field("amplitude", RUNS, Number(&FINITE), "rad", No, "Amplitude of a sine."),
    field("frequency", RUNS, Number(&NON_NEGATIVE), "Hz", No, "Frequency of the sine, cycles per time."),
    field("phase", RUNS, Number(&FINITE), "rad", Or("0.0"), "Phase of the sine."),
]);

#[rustfmt::skip]
pub(super) static BODY: Spec = Spec {
    name: "body",
    fields: &[
    field("name", ASSEMBLY, Name, "", Yes("name = \"m\""), "The name of the body, letters, digits, - and _; each body has another."),
    field("mass", PLANE | BAR, Number(&SIZE), "kg", Yes("mass = 1.0"), "Mass of the body, a point at the free end, which may turn."),
    field("shape", PLANE, OneOf(&[Word(&["point"]), Table(&BODY_SHAPE)]), "", No, "Shape of the body where it hits obstacles; without it a point at the end of the rod."),
    field("shape", SPACE | ASSEMBLY, OneOf(&[Word(&["point", "solid"]), Table(&BODY_SHAPE)]), "", No, "Shape of the body where it hits obstacles and other bodies, about its centre of mass along its axes; \"solid\": that of its `solid`. Without it a point, the centre of mass."),
    field("mass", SPACE, Number(&SIZE), "kg", Yes("mass = 1.0"), "Mass of the body."),
    field("mass", INFLATIONS, Number(&SIZE), "kg", Yes("mass = 1.0"), "Mass of the piston."),
    field("area", INFLATIONS, Number(&SIZE), "m²", Yes("area = 0.01"), "Area of the piston, on which the gas presses."),
    field("mass", ASSEMBLY, Number(&SIZE_OR_0), "kg", Yes("mass = 1.0"), "Mass of the body. 0, and no inertia: a node, which joins rods, bears loads and turns with the rods. It may be left out of a node, but in a motion of rods without mass, where the loads of a node are constant."),
    field("joint", SPACE, Word(&["weld", "ball", "hinge", "universal", "slider", "roller"]), "", Or("\"weld\""), "A rigid body welded to the end, or a point mass on an end that is free to turn (\"ball\"); or a rigid body on a joint with an axis, as in `to` of [[rod]]."),
    field("axis", SPACE, Vector(&VALUE), "", No, "Axis of a joint that has one, as in `from` of [[rod]], along the directors there."),
    field("second_axis", SPACE, Vector(&VALUE), "", No, "Second axis of a universal joint, which stays with the rod."),
    field("slide", SPACE, Vector(&VALUE), "", No, "Direction along which a hinge or universal joint also slides, without force."),
    field("couple", SPACE, Number(&VALUE), "N m", Or("0.0"), "Constant couple of a hinge or universal joint on the rod, about the first axis."),
    field("force", SPACE, Number(&VALUE), "N", Or("0.0"), "Constant force of a slider or roller on the rod, along the axis."),
    field("stiffness", SPACE, Number(&NON_NEGATIVE), "N m or N/m", Or("0.0"), "Spring in the joint: couple per radian, force per length."),
    field("rest", SPACE, Number(&VALUE), "rad or m", Or("0.0"), "Angle, or shift, at which the spring of the joint is unloaded."),
    field("damping", SPACE, Number(&NON_NEGATIVE), "N m s or N s/m", Or("0.0"), "Viscous friction in the joint: couple per rate of the angle, force per rate of the shift."),
    field("offset", SPACE, Vector(&VALUE), "m", Or("[0.0, 0.0, 0.0]"), "Centre of mass of a welded body, from the end of the rod, along the directors there."),
    field("offset", ASSEMBLY, Vector(&VALUE), "m", Or("[0.0, 0.0, 0.0]"), "Centre of mass of a body with inertia, from the origin of its frame, along its axes."),
    field("inertia", SPACE, OneOf(&[Numbers(3), Rows(3)]), "kg m²", Yes("inertia = [0.01, 0.01, 0.01]"), "Inertia of a welded body about its centre of mass, along the directors: its diagonal, or three rows."),
    field("inertia", ASSEMBLY, OneOf(&[Numbers(3), Rows(3)]), "kg m²", No, "Inertia about the centre of mass along the axes of the body's frame: its diagonal, or three rows; without it the body is a point mass."),
    field("solid", SPACE | ASSEMBLY, Table(&SOLID), "", No, "A homogeneous solid with its centre in the centre of mass and its axes along the directors, of a body in an assembly along those of its frame: it says the inertia, and with a density the mass."),
    field("rotor", SPACE | ASSEMBLY, Vector(&VALUE), "kg m²/s", Or("[0.0, 0.0, 0.0]"), "Angular momentum, relative to a welded body, of a symmetric rotor in it that spins at a constant rate; along the directors."),
    field("force", ASSEMBLY, LOAD, "N", Or("[0.0, 0.0, 0.0]"), "Force at the centre of mass: constant, in the world; or in time or turning with the body, tables that are added up."),
    field("couple", ASSEMBLY, LOAD, "N m", Or("[0.0, 0.0, 0.0]"), "Couple on a body with inertia, likewise; sizes in its tables are those of a couple."),
    field("drag", ASSEMBLY, Number(&NON_NEGATIVE), "N s/m", Or("0.0"), "Force -drag * velocity of the centre of mass, in a motion."),
    field("rotational_drag", ASSEMBLY, Number(&NON_NEGATIVE), "N m s", Or("0.0"), "Couple -rotational_drag * angular velocity on a body with inertia, in a motion."),
    field("guess", ASSEMBLY, Table(&GUESS), "", No, "Near where the equilibrium is looked for; of all bodies, or of none. Without it the search begins at the unloaded rods. Of bodies that nothing holds on the ground it says where the first of them starts, and near which shape of the rods."),
    field("groove", SPACE | ASSEMBLY, Table(&GROOVE), "", No, "A curve fixed in the world in which the origin of the body's frame, of one rod its end, slides without friction; it turns there freely. Of elastic rods, and with inertia = \"full\" of any; the force of the groove is reported."),
    field("position", ASSEMBLY, Vector(&VALUE), "m", No, "Place of the origin of the body's frame at the start of a motion, of a body that no rod holds. Such bodies are written after the others."),
    field("quaternion", ASSEMBLY, Numbers(4), "", No, "Orientation of the frame of a body with a `position`, a unit quaternion [w, x, y, z]; or rotation. Without both, along the axes."),
    field("rotation", ASSEMBLY, Table(&ROTATION), "", No, "Orientation of the frame of a body with a `position`, by axis and angle."),
    field("velocity", ASSEMBLY, Vector(&VALUE), "m/s", Or("[0.0, 0.0, 0.0]"), "Velocity of the origin of the body's frame at the start of a motion, in the world."),
    field("angular_velocity", ASSEMBLY, Vector(&VALUE), "rad/s", Or("[0.0, 0.0, 0.0]"), "Angular velocity of a body with inertia at the start of a motion, in the world."),
    ],
    barred: &[(ASSEMBLY, "joint", "each rod has its own joints: write it in `from` or `to` of [[rod]]")],
};
#[rustfmt::skip]
pub(super) static SOLID: Spec = spec("solid", &[
    field("box", SPACE | ASSEMBLY, Numbers(3), "m", No, "Sides of a box along the three axes, each > 0."),
    field("cylinder", SPACE | ASSEMBLY, Numbers(2), "m", No, "Diameter and length, both > 0, of a cylinder along the third axis."),
    field("ball", SPACE | ASSEMBLY, Number(&SIZE), "m", No, "Diameter of a ball."),
    field("density", SPACE | ASSEMBLY, Number(&SIZE), "kg/m³", No, "Mass per volume; or the mass of the body in its place."),
]);
#[rustfmt::skip]
pub(super) static GUESS: Spec = spec("guess", &[
    field("position", ASSEMBLY, Vector(&VALUE), "m", Yes("position = [0.5, 0.0, 0.2]"), "Position of the origin of the body's frame."),
    field("quaternion", ASSEMBLY, Numbers(4), "", No, "Orientation of its frame, a unit quaternion [w, x, y, z]; or rotation. Without both, along the axes."),
    field("rotation", ASSEMBLY, Table(&ROTATION), "", No, "Orientation of its frame, by axis and angle."),
]);
#[rustfmt::skip]
pub(super) static END: Spec = spec("end", &[
    field("force", STATICS, Vector(&VALUE), "N", Or("[0.0, 0.0, 0.0]"), "Force applied to the end, in the world; 0 in held components."),
    field("couple", STATICS, Vector(&VALUE), "N m", Or("[0.0, 0.0, 0.0]"), "Couple applied to the end, in the world; 0 if the orientation is held."),
    field("load", STATICS, Number(&VALUE), "", Or("1.0"), "Common factor of forces and couples, for branches."),
    field("follower", STATICS, Flag, "", Or("false"), "Force and couple in the frame of the directors at the end, in place of the world."),
    field("follower_force", STATICS, Vector(&VALUE), "N", Or("[0.0, 0.0, 0.0]"), "Force along the directors at the end, with which it turns, beside `force`; only on a free end."),
    field("follower_couple", STATICS, Vector(&VALUE), "N m", Or("[0.0, 0.0, 0.0]"), "Couple along the directors at the end, beside `couple`; only on a free end."),
    field("position", STATICS, Array(&OneOf(&[Number(&VALUE), Word(&["free"])])), "m", No, "Where the end is held, three components, each a number or \"free\"; without it, all free."),
    field("quaternion", STATICS, Numbers(4), "", No, "Orientation at which the end is held, a unit quaternion [w, x, y, z]; or rotation; without both, free."),
    field("rotation", STATICS, Table(&ROTATION), "", No, "Orientation at which the end is held, by axis and angle."),
    field("tangent", STATICS, Vector(&VALUE), "", No, TANGENT),
    field("normal", STATICS, Vector(&VALUE), "", No, NORMAL),
    field("pose", STATICS, Table(&POSE), "", No, "Position and orientation in one table."),
]);
#[rustfmt::skip]
pub(super) static POSE: Spec = spec("pose", &[
    field("position", ONE_IN_SPACE, Array(&OneOf(&[Number(&VALUE), Word(&["free"])])), "m", Yes("position = [0.5, 0.0, 0.5]"), "Position of the end."),
    field("quaternion", ONE_IN_SPACE, Numbers(4), "", No, "Orientation of its directors, a unit quaternion [w, x, y, z]; or rotation."),
    field("rotation", ONE_IN_SPACE, Table(&ROTATION), "", No, "Orientation of its directors, by axis and angle."),
    field("tangent", ONE_IN_SPACE, Vector(&VALUE), "", No, TANGENT),
    field("normal", ONE_IN_SPACE, Vector(&VALUE), "", No, NORMAL),
]);

#[rustfmt::skip]
pub(super) static START: Spec = spec("start", &[
    field("lambda", PLANE, Number(&LAMBDA), "", No, "With kappa or p an equilibrium: lambda = L sqrt(|n| / EI), n the contact force."),
    field("kappa", PLANE, Number(&KAPPA), "", No, "sin((theta(L) - alpha) / 2), alpha the direction of n; 0 is straight, the sign mirrors."),
    field("p", PLANE, Number(&P), "", No, "In place of kappa = tanh p, for rods so nearly taut that kappa rounds to 1."),
    field("position", PLANE, Vector(&FINITE), "m", No, "Position of the body; of the equilibria there the one that `sheet` names. At full reach along the clamp's tangent the rod is straight."),
    field("sheet", PLANE, OneOf(&[Word(&["stable", "lowest"]), Table(&SHEET)]), "", Or("\"stable\""), "Of the equilibria at a position: the only stable one, the one of lowest energy, or the one of a name."),
    field("curvature", PLANE, List, "1/m", No, "theta' = c0 + c1 x + ..., x = s / length, 1 to 16 numbers: any shape, only with damping, or of a rod with mass (inertia = \"full\")."),
    field("curvature_rate", PLANE, List, "1/(m s)", No, "How fast the curvature of a rod with mass changes, c0 + c1 x + ..., with `curvature` and in place of velocity; without it as the rod without mass would follow its end."),
    field("strain", SPACE, Table(&STRAIN), "", No, "The strains, each a polynomial in s / length, only with damping, or of a rod with mass; without any start the rod is unloaded."),
    field("strain_rate", SPACE, Table(&STRAIN), "", No, "How fast the strains of a rod with mass change, each a polynomial in s / length, with `strain` and in place of velocities."),
    field("equilibrium", SPACE, Table(&EQUILIBRIUM), "", No, "The equilibrium under a load at the end."),
    field("pose", SPACE, Table(&POSE), "", No, "An equilibrium with the end held in a pose."),
    field("rest", MOTION, Word(&["straight"]), "", No, "\"straight\": the unloaded rod, with the pull of its tendons, which leaves the clamp as that is turned; held so and let go."),
    field("rest", ASSEMBLY, Word(&["straight"]), "", No, "\"straight\": the unloaded rods, where each leads to another body (no loops); held so and let go. Bodies that no rods join to the ground start so only."),
    field("imperfection", PLANE, Number(&IMPERFECTION), "rad", Or("0.0"), "With rest = \"straight\": the angle of the end of a rod that is bent by so little, as one is that begins to buckle; its sign is the side. A push along the rod beyond Euler's load needs it, for the straight rod is unstable then."),
    field("settled", RUNS, Flag, "", No, "true: the equilibrium under the loads at t = 0, a stable one if a few starts lead to one; of bodies with a guess, that to which it leads."),
    field("relaxed", PLANE, OneOf(&[Flag, List]), "", Or("true"), "Where the Maxwell branches are relaxed: true, at the shape of the start; false, at the unloaded rod; or the curvature c0, c1, ..."),
    field("relaxed", SPACE, OneOf(&[Flag, Table(&STRAIN)]), "", Or("true"), "Where the Maxwell branches are relaxed: true, at the shape of the start; false, at the unloaded rod; or these strains."),
    field("velocity", PLANE, Vector(&FINITE), "m/s", Or("[0.0, 0.0]"), "Velocity of the body in the world, or on top of that of the clamp (`with_clamp`)."),
    field("velocity", SPACE, Vector(&VALUE), "m/s", Or("[0.0, 0.0, 0.0]"), "Velocity of the end of the rod in the world, or on top of that of the clamp (`with_clamp`)."),
    field("angular_velocity", SPACE, Vector(&VALUE), "rad/s", Or("[0.0, 0.0, 0.0]"), "Angular velocity of a welded body, likewise."),
    field("with_clamp", MOTION, Flag, "", Or("false"), "On a clamp that moves or turns already at t = 0 (as under a sine of phase 0): true, the velocities come on top of those at which it carries the end, so that a rod starts at rest on its clamp; false, they are those in the world, where the body stands still while the clamp moves off."),
    field("stretch", INFLATIONS, Number(&STRETCH), "", No, "Stretch of the balloon below a piston, at least 1; without it that of the equilibrium under loads.force at t = 0."),
    field("velocity", INFLATIONS, Number(&VALUE), "m/s", Or("0.0"), "Velocity of the piston into the vessel."),
    field("stretch", MEMBRANES, Number(&STRETCH), "", No, "Stretch at the pole, at least 1; or [loads] pressure, or [gas]."),
    field("stretch", BAR, Number(&POSITIVE), "", Or("1.0"), "Uniform stretch of the bar."),
    field("velocity", BAR, Number(&FINITE), "m/s", Or("0.0"), "Uniform velocity of the bar along +X; beside a wall a blow."),
    field("area", FLOWS, OneOf(&[Number(&POSITIVE), Table(&START_AREA)]), "", Or("1.0"), "Area A/A0 of the tube: a number, or a table along it. A lumped tube starts beside its equilibrium without it."),
    field("velocity", FLOWS, Number(&FINITE), "m/s", Or("0.0"), "Velocity of the fluid."),
    field("left", FLOWS, Numbers(2), "1, m/s", No, "[area A/A0, velocity] left of `at`, with right: a Riemann problem in place of area and velocity."),
    field("right", FLOWS, Numbers(2), "1, m/s", No, "[area A/A0, velocity] right of `at`."),
    field("at", FLOWS, Number(&NON_NEGATIVE), "m", Or("half the length"), "Where left and right meet."),
    field("wrench", STATICS, Numbers(6), "N m, N", No, "Where the search begins: base wrench (m1, m2, m3, n1, n2, n3) in the world; without it, the unloaded rod."),
]);
#[rustfmt::skip]
pub(super) static START_AREA: Spec = spec("start.area", &[
    field("table", FLOWS, Rows(2), "m, 1", Yes("table = [[0.0, 1.0], [0.1, 0.9]]"), "Rows [x, A/A0] along the tube, x growing from 0 to its length; linear in between."),
]);
#[rustfmt::skip]
pub(super) static SHEET: Spec = spec("sheet", &[
    field("mode", PLANE, Count(0, 3000), "", Yes("mode = 1"), "Number of inflections inside the rod."),
    field("sign", PLANE, Word(&["+", "-"]), "", Yes("sign = \"-\""), "Sign of the curvature at the clamp: \"+\" curves to the left, towards +y."),
    field("near", PLANE, Number(&LAMBDA), "", No, "Where several equilibria share name and position, the one whose lambda is nearest to this."),
]);
#[rustfmt::skip]
pub(super) static LANDING: Spec = spec("landing", &[
    field("mode", PLANE, Count(0, 3000), "", Yes("mode = 1"), "Number of inflections inside the rod."),
    field("sign", PLANE, Word(&["+", "-"]), "", Yes("sign = \"-\""), "Sign of the curvature at the clamp."),
    field("order", SPACE | ASSEMBLY, Count(1, 1000), "", Yes("order = 1"), "Which of the stable equilibria found with less energy than at the fold, counted by their energy: 1 is the lowest."),
]);
#[rustfmt::skip]
pub(super) static STRAIN: Spec = spec("strain", &[
    field("u1", SPACE, List, "1/m", No, "Flexure about d1: c0, c1, ... of c0 + c1 x + ..., x = s / length; without it that of the unloaded rod."),
    field("u2", SPACE, List, "1/m", No, "Flexure about d2."),
    field("u3", SPACE, List, "rad/m", No, "Twist."),
    field("v1", SPACE, List, "", No, "Shear along d1."),
    field("v2", SPACE, List, "", No, "Shear along d2."),
    field("v3", SPACE, List, "", No, "Stretch, 1 when unstretched, > 0 everywhere."),
]);
#[rustfmt::skip]
pub(super) static EQUILIBRIUM: Spec = spec("equilibrium", &[
    field("force", SPACE, Vector(&VALUE), "N", Or("[0.0, 0.0, 0.0]"), "Force at the end."),
    field("couple", SPACE, Vector(&VALUE), "N m", Or("[0.0, 0.0, 0.0]"), "Couple at the end."),
]);

#[rustfmt::skip]
pub(super) static LOADS: Spec = Spec {
    name: "loads",
    fields: &[
    field("gravity", PLANE, Vector(&FINITE), "m/s²", Or("[0.0, 0.0]"), "Acceleration of gravity: a force mass * gravity at the centre of mass of the body, and along a rod whose mass is known."),
    field("gravity", SPACE | ASSEMBLY, Vector(&VALUE), "m/s²", Or("[0.0, 0.0, 0.0]"), "Acceleration of gravity: a force mass * gravity at the centre of mass of every body, and along rods whose mass is known."),
    field("gravity", STATICS, Vector(&VALUE), "m/s²", Or("[0.0, 0.0, 0.0]"), "Acceleration of gravity: a force mass * gravity on the rod, spread along it; the rod has a mass then, rod.mass or a density and a shape."),
    field("distributed", STATICS, SPREAD_LOAD, "N/m", Or("[0.0, 0.0, 0.0]"), "Dead force per length of the unloaded rod, in the world: constant, a polynomial in s/length, or a table in s."),
    field("follower", STATICS, SPREAD_LOAD, "N/m", Or("[0.0, 0.0, 0.0]"), "Force per length of the unloaded rod along the directors, with which it turns, as pressure does: constant, a polynomial in s/length, or a table in s."),
    field("load", STATICS, Number(&VALUE), "", Or("1.0"), "Common factor of gravity, distributed and follower, for branches."),
    field("dead", PLANE, Vector(&FINITE), "N", Or("[0.0, 0.0]"), "Constant force at the centre of mass."),
    field("dead", SPACE, Vector(&VALUE), "N", Or("[0.0, 0.0, 0.0]"), "Constant force at the centre of mass."),
    field("distributed", PLANE, SPREAD_LOAD, "N/m", Or("[0.0, 0.0]"), "Dead force per length of the unloaded rod, in the world: constant, a polynomial in s/length, or a table in s."),
    field("distributed", SPACE, SPREAD_LOAD, "N/m", Or("[0.0, 0.0, 0.0]"), "Dead force per length of the unloaded rod, in the world: constant, a polynomial in s/length, or a table in s."),
    field("couple", SPACE, LOAD, "N m", Or("[0.0, 0.0, 0.0]"), "Couple on a welded body: constant, in the world; or in time or turning with the body, tables that are added up."),
    field("drag", MOTION, Number(&NON_NEGATIVE), "N s/m", Or("0.0"), "Force -drag * velocity of the centre of mass."),
    field("rotational_drag", SPACE, Number(&NON_NEGATIVE), "N m s", Or("0.0"), "Couple -rotational_drag * angular velocity on a welded body."),
    field("force", MOTION, OneOf(&[Table(&FORCE), Array(&Table(&FORCE))]), "", No, "Forces in time at the centre of mass, added up: one table, or an array of them."),
    field("pressure", MEMBRANES, Number(&NON_NEGATIVE), "Pa", No, "Pressure inside less outside: the first state with it on the way from the unloaded membrane; or [start] stretch, or [gas]."),
    field("pressure", INFLATIONS, PRESSURE, "Pa", No, "Pressure inside less outside: a number, which is a step at t = 0, or a history in time; or [gas]."),
    field("force", INFLATIONS, PRESSURE, "N", Or("0.0"), "Force on the piston, into the vessel: a number or a history in time."),
    field("force", BAR, Table(&FORCE), "", No, "A force in time along +X on the end X = length: tension where it is positive."),
    ],
    barred: &[
        (ASSEMBLY, "distributed", "write it as `distributed` of its [[rod]]"),
        (STATICS, "dead", AT_REST), (STATICS, "couple", AT_REST), (STATICS, "drag", AT_REST), (STATICS, "rotational_drag", AT_REST), (STATICS, "force", AT_REST),
        (ASSEMBLY, "dead", "write it as `force` of its [[body]]"), (ASSEMBLY, "couple", "write it as `couple` of its [[body]]"),
        (ASSEMBLY, "drag", "write it as `drag` of its [[body]]"), (ASSEMBLY, "rotational_drag", "write it as `rotational_drag` of its [[body]]"),
        (ASSEMBLY, "force", "write it as `force` of its [[body]]"),
    ],
};
const AT_REST: &str =
    "it acts on the body of a scene of motion; in statics write force and couple in [end]";
const SPREAD_LOAD: Form = OneOf(&[Vector(&VALUE), Table(&DISTRIBUTED)]);
#[rustfmt::skip]
pub(super) static DISTRIBUTED: Spec = spec("distributed", &[
    field("table", PLANE, Rows(3), "m, N/m", No, "Rows [s, fx, fy], s growing from 0 to the length of the rod, 2 to 500; linear in between."),
    field("table", IN_SPACE, Rows(4), "m, N/m", No, "Rows [s, fx, fy, fz], s growing from 0 to the length of the rod, 2 to 500; linear in between."),
    field("polynomial", ANY, Array(&Vector(&VALUE)), "N/m", No, "Vectors c0, c1, ... (1 to 16) of c0 + c1 x + ..., x = s / length, in place of a table."),
]);
#[rustfmt::skip]
pub(super) static LISTED: Spec = spec("load", &[
    field("on", ONE, Word(&["end"]), "", No, "\"end\": the load acts on the end of the rod, in a motion on the body there (a force at its centre of mass). Or s, or from and to."),
    field("on", ASSEMBLY, Name, "", No, "The name of the body that the load acts on, a force at its centre of mass. Or rod with s, or with from and to."),
    field("rod", ASSEMBLY, Name, "", No, "The name of the rod that the load acts on, held at both ends."),
    field("s", ANY, Number(&VALUE), "m", No, "The load acts at this arclength of the unloaded rod, inside the rod. In a motion on elastic rods without friction, and on rods with full mass in elements."),
    field("from", ANY, Number(&VALUE), "m", No, "The load acts along the rod from this arclength; force and couple are then per length."),
    field("to", ANY, Number(&VALUE), "m", No, "Arclength at which a load along the rod ends."),
    field("force", STATICS, Vector(&VALUE), "N", Or("[0.0, 0.0, 0.0]"), "Force, in the world, or along the directors where `follows` is true."),
    field("force", RUNS, LOAD, "N", Or("[0.0, 0.0, 0.0]"), "Force, in the world, or along the directors where `follows` is true; on a body it may be in time, as body.force of an assembly."),
    field("couple", STATICS, Vector(&VALUE), "N m", Or("[0.0, 0.0, 0.0]"), "Couple, likewise."),
    field("couple", SPACE | ASSEMBLY, LOAD, "N m", Or("[0.0, 0.0, 0.0]"), "Couple, likewise; on a body with inertia."),
    field("follows", ANY, Flag, "", Or("false"), "true: force and couple turn with the rod, or the body, and are given along its directors; of a planar rod along its tangent and its normal, [t, n]. On the end with a point mass they turn with the end of the rod. In a motion on elastic rods, on rods with full mass, and on bodies."),
    field("factor", ANY, Number(&VALUE), "", Or("1.0"), "Common factor of force and couple on a rod, for branches: load.0.factor."),
]);
#[rustfmt::skip]
pub(super) static STATION: Spec = spec("station", &[
    field("name", ANY, Name, "", No, "Name before the columns of the station, as mid in mid.x; without it station1, station2, ... in the order of the list."),
    field("rod", ASSEMBLY, Name, "", No, "The name of the rod; may be left out where there is one."),
    field("s", ANY, Number(&VALUE), "m", Yes("s = 0.5"), "Arclength of the unloaded rod, from 0 to its length."),
]);
const LOAD: Form = OneOf(&[Vector(&VALUE), Table(&FORCE), Array(&Table(&FORCE))]);
#[rustfmt::skip]
pub(super) static FORCE: Spec = spec("loads.force", &[
    field("direction", PLANE, Vector(&FINITE), "", Yes("direction = [0.0, 1.0]"), "Direction, not 0, of any length: only the amplitude is the size of the force."),
    field("direction", SPACE | ASSEMBLY, Vector(&FINITE), "", Yes("direction = [0.0, 1.0, 0.0]"), "Direction, not 0, of any length: only the amplitude is the size of the force."),
    field("follower", SPACE | ASSEMBLY, Flag, "", Or("false"), "true: the direction is along the axes of the body (of a welded one the directors at the end), with which the load turns; false: along those of the world."),
    field("constant", RUNS | BAR, Number(&FINITE), "N", No, "A constant size, in place of a sine."),
    field("amplitude", RUNS | BAR, Number(&FINITE), "N", Yes("amplitude = 0.5"), "Amplitude of a sine, amplitude * sin(2 pi frequency t + phase)."),
    field("frequency", RUNS | BAR, Number(&NON_NEGATIVE), "Hz", Yes("frequency = 2.0"), "Frequency of the sine, cycles per time."),
    field("phase", RUNS | BAR, Number(&FINITE), "rad", Or("0.0"), "Phase of the sine."),
    field("ramp", RUNS | BAR, Table(&RAMP), "", No, "A force that grows linearly, in place of a sine."),
    field("pulse", RUNS | BAR, Table(&PULSE), "", No, "A pulse, in place of a sine."),
    field("file", RUNS, Name, "", No, "Name of a file with rows of times and components, in place of a direction and a size; linear in between and constant outside. It counts from the directory of the scene's file."),
    field("columns", RUNS, Array(&Name), "", Or("[\"t\", \"x\", \"y\", \"z\"]"), "Names of the columns of `file`: of the time, then of the components along the axes of the world, or of the body where `follower` is true. Without a line of names the columns stand in this order."),
    field("block", BAR, Table(&BLOCK), "", No, "A constant force for a while, with jumps, in place of a sine."),
    field("table", RUNS | BAR, Rows(2), "s, N", No, "Rows [t, f], linear in between and constant outside, in place of a sine."),
]);
#[rustfmt::skip]
pub(super) static RAMP: Spec = spec("ramp", &[
    field("from", DRIVEN, Number(&FINITE), "N", Or("0.0"), "Value before `start`."),
    field("to", DRIVEN, Number(&FINITE), "N", Yes("to = 1.0"), "Value after `until`."),
    field("start", DRIVEN, Number(&NON_NEGATIVE), "s", Or("0.0"), "When it begins to grow."),
    field("until", DRIVEN, Number(&POSITIVE), "s", Yes("until = 1.0"), "When it has grown, after `start`."),
]);
#[rustfmt::skip]
pub(super) static PULSE: Spec = spec("pulse", &[
    field("at", DRIVEN, Number(&FINITE), "s", Yes("at = 1.0"), "Time of its middle."),
    field("width", DRIVEN, Number(&POSITIVE), "s", Yes("width = 0.1"), "How long it lasts; its shape is a raised cosine."),
    field("amplitude", DRIVEN, Number(&FINITE), "N", Yes("amplitude = 1.0"), "Its height."),
]);

#[rustfmt::skip]
pub(super) static BLOCK: Spec = spec("block", &[
    field("size", BAR | FLOWS | INFLATIONS, Number(&FINITE), "N", Yes("size = 2.0"), "Its size."),
    field("start", BAR | FLOWS | INFLATIONS, Number(&NON_NEGATIVE), "s", Or("0.0"), "When it begins."),
    field("until", BAR | FLOWS | INFLATIONS, Number(&POSITIVE), "s", Yes("until = 0.002"), "When it ends, after `start`."),
]);

#[rustfmt::skip]
pub(super) static RUN: Spec = Spec {
    name: "run",
    fields: &[
        field("duration", DRIVEN, Number(&POSITIVE), "s", Yes("duration = 3.0"), "How long the motion is followed."),
        field("tolerance", PLANE, Number(&TOLERANCE), "", Or("1e-10"), "Relative tolerance of the time steps; with damping at least 1e-13. Without it 1e-4 where rods have inertia = \"full\" and no damping: a tolerance of places, which leaves out waves too short for them. Below 1e-5 such rods are followed by strains at nodes, and every wave is resolved."),
        field("tolerance", SPACE | ASSEMBLY, Number(&TOLERANCE), "", Or("1e-8"), "Relative tolerance of the time steps; at least 1e-13. Without it 1e-4 where rods have inertia = \"full\" and no damping: a tolerance of places, which leaves out waves too short for them. Below 1e-5 such rods are followed by strains at nodes, and every wave is resolved."),
        field("method", RUNS, Word(&["auto", "explicit", "implicit", "symmetric"]), "", Or("\"auto\""),
            "How the run steps through time. With damping the program chooses, or takes explicit steps, or implicit ones for stiff rods. Without, steps are explicit; in space and of assemblies implicit where that takes less work, as where a rod is stiff, or, asked for, whatever rings in its fast modes: they damp it; or symmetric: of one length, they keep the energy of an unforced motion over any number of periods, and cost about as much as explicit ones at a tolerance a hundred times finer."),
        field("reduce", SPACE, Flag, "", Or("true"), "Look whether the motion is exactly that of a spring and a dashpot, and tell of which."),
        field("landing", PLANE, OneOf(&[Word(&["viscous", "lowest", "all"]), Table(&LANDING)]), "", Or("\"viscous\""),
            "Where an elastic rod lands that snaps: where a rod of small viscosity would, on the stable equilibrium of lowest energy, on every stable one with less energy than at the fold (the run branches), or on the one of a named sheet, if that has less energy than at the fold."),
        field("landing", SPACE | ASSEMBLY, OneOf(&[Word(&["viscous", "lowest", "all"]), Table(&LANDING)]), "", Or("\"viscous\""),
            "Where an elastic rod lands that snaps, its ends held: where a rod of small viscosity would, on the stable equilibrium of lowest energy, on every stable one with less energy than at the fold (the run branches), or on the one in some place by energy. The last three rules choose from what a search finds, which may miss an equilibrium."),
        field("branches", RUNS, Count(1, 10_000), "", Or("64"), "Bound on the number of whole runs, those that do not branch again, under landing = \"all\"."),
        field("samples", DRIVEN, Count(2, 10_000_000), "", Or("400"), "Number of equally spaced times, both ends counted, at which the motion is written."),
        field("strobe", MOTION, Number(&POSITIVE), "s", No,
            "A period: the motion is written at its whole multiples in place of `samples` even times; the duration is a whole number of them. With the period of a load, or of the clamp's motion, the trajectory is a Poincaré section, drawn as poincare.svg."),
        field("time_step", BAR | FLOWS, Number(&POSITIVE), "s", No, "The longest step of finite volumes, also of a flow; the step of the schemes on linear elements; without it the first is chosen by the speed of waves, the second 0.05 cells of the fastest wave at the start."),
        field("max_steps", RUNS, Count(1, 1_000_000_000), "", Or("10000000"), "The run stops after so many steps."),
        field("max_snaps", RUNS, Count(0, 1_000_000_000), "", Or("100000"), "The run stops at the next snap after so many."),
    ],
    barred: &[
        (ASSEMBLY, "reduce", "it is for one rod with damping"),
    ],
};
#[rustfmt::skip]
pub(super) static SOLVE: Spec = spec("solve", &[
    field("tolerance", STATICS | ASSEMBLY, Number(&SOLVE_TOLERANCE), "", Or("1e-10"), "Relative tolerance of the equilibria."),
    field("path", STATICS, Word(&["auto", "planar", "spatial", "closed-form"]), "", Or("\"auto\""), "The path of the computation; the program chooses the fastest that holds."),
]);
#[rustfmt::skip]
pub(super) static CONTINUE: Spec = spec("continue", &[
    field("parameter", TUBES, Word(&["outside.pressure", "tube.area"]), "", Yes("parameter = \"outside.pressure\""), "What varies."),
    field("parameter", MEMBRANES, Word(&["membrane.stretch"]), "", Yes("parameter = \"membrane.stretch\""), "What varies: the stretch at the pole."),
    field("from", WALL, Number(&VALUE), "", Yes("from = 1.0"), "Its first value."),
    field("to", WALL, Number(&VALUE), "", Yes("to = 2.0"), "Its last value."),
    field("points", WALL, Count(2, 100_000), "", Or("101"), "Points at equal steps of the parameter; special points come besides."),
    field("parameter", STATICS | ASSEMBLY, PATH, "", Yes("parameter = \"end.force.x\""), "What varies: the path of a number of the scene, such as end.load, or loads.load under a load along the rod; of an assembly a component of a constant force or couple of a body, body.NAME.force.z, loads.gravity.z, or a place on the ground, rod.NAME.from.position.x or rod.NAME.to.rotation.angle. Numbers in place of names and letters are read, too: body[0].force[2]."),
    field("from", STATICS | ASSEMBLY, Number(&VALUE), "", No, "Its first value; without it the one in the scene."),
    field("to", STATICS | ASSEMBLY, Number(&VALUE), "", Yes("to = 1.0"), "The value at which the branch ends."),
    field("step", STATICS | ASSEMBLY, Number(&STEP), "", Or("0.01"), "First step along the branch; a change of the parameter alone from `from` to `to` has length 1."),
    field("min_step", STATICS | ASSEMBLY, Number(&STEP), "", Or("1e-8"), "Shortest step."),
    field("max_step", STATICS | ASSEMBLY, Number(&STEP), "", Or("0.1"), "Longest step."),
    field("points", STATICS | ASSEMBLY, Count(2, 1_000_000), "", Or("200"), "A branch ends after so many points."),
    field("switch", STATICS | ASSEMBLY, Flag, "", Or("false"), "Follow the branches that leave at branch points."),
    field("both", STATICS | ASSEMBLY, Flag, "", Or("false"), "Also go the other way from `from`, as far as to 2 from - to."),
    field("back", STATICS | ASSEMBLY, Flag, "", Or("false"), "A branch that turns at a fold and comes back to `from` is what was asked for, not one that ended short of `to`."),
    field("deflate", STATICS | ASSEMBLY, Flag, "", Or("false"), "Look for branches that do not meet this one (deflation)."),
    field("at", STATICS | ASSEMBLY, List, "", Or("[]"), "Values of the parameter that the branch hits exactly."),
    field("second", STATICS | ASSEMBLY, Table(&SECOND), "", No, "A second parameter: the curves of folds in both."),
]);
#[rustfmt::skip]
pub(super) static SECOND: Spec = spec("continue.second", &[
    field("parameter", STATICS | ASSEMBLY, PATH, "", Yes("parameter = \"end.force.x\""), "What varies, not the first parameter."),
    field("from", STATICS | ASSEMBLY, Number(&VALUE), "", No, "One end of its range; without it the value in the scene."),
    field("to", STATICS | ASSEMBLY, Number(&VALUE), "", Yes("to = 1.0"), "The other end."),
    field("step", STATICS | ASSEMBLY, Number(&STEP), "", Or("0.01"), "First step along the curve."),
    field("min_step", STATICS | ASSEMBLY, Number(&STEP), "", Or("1e-8"), "Shortest step."),
    field("max_step", STATICS | ASSEMBLY, Number(&STEP), "", Or("0.05"), "Longest step."),
    field("points", STATICS | ASSEMBLY, Count(2, 1_000_000), "", Or("400"), "A curve ends after so many points in each direction."),
]);
const PATH: Form = Word(&[]);
