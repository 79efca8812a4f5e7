//! Contact of rods with themselves or each other: comparison with brute force over dense sections; the run stops at
//! contact.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, AttachedTo, Attachment, Body, BodyMotion, Configuration, Contact, Joint, Link,
    Nearness, Tube,
};
use snaprod::body::{History, PointMass, Support};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome, State};
use snaprod::rod::{EndConditions, Problem, Rod};
use snaprod::section::Linear;

fn rod() -> Rod {
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| law.with_shear([80.0, 90.0]))
        .and_then(|law| law.with_axial(150.0));
    Rod::new(1.0, law.expect("a law")).expect("a rod")
}

/// A mass on a ball joint at the end of a rod, thrown from equilibrium.
fn thrown(
    links: &[(Isometry3<f64>, Vector3<f64>, Vector3<f64>)],
    d: f64,
) -> (Assembly, Configuration) {
    let (mut all, mut carriers) = (Vec::new(), Vec::new());
    let (mut bodies, mut charts) = (Vec::new(), Vec::new());
    for (k, (base, end, velocity)) in links.iter().enumerate() {
        let seen = base.inverse_transform_point(&(*end).into()).coords;
        let problem = Problem::new(rod(), EndConditions::ball(seen), 1e-12).expect("a problem");
        let found = problem.solve(None).expect("an equilibrium");
        let (from, to) = (
            Attachment::ground(*base),
            Attachment::body(k, Isometry3::identity()),
        );
        let link = Link::new(rod(), from, to, Joint::Ball).with_diameter(d);
        charts.push(found.base.component_div(&link.units()));
        all.push(link);
        carriers.push(Body::point(PointMass::new(1.0).expect("a mass")));
        bodies.push(BodyMotion {
            pose: Isometry3::translation(end.x, end.y, end.z),
            twist: Vector6::new(0.0, 0.0, 0.0, velocity.x, velocity.y, velocity.z),
        });
    }
    let assembly = Assembly::new(carriers, all).expect("an assembly");
    (
        assembly,
        Configuration {
            bodies,
            charts,
            spins: Vec::new(),
        },
    )
}

/// Final state and outcome of a run of duration `end`, and the largest change of the ledger's total.
fn stopped(
    (assembly, now): &(Assembly, Configuration),
    end: f64,
    tolerance: f64,
) -> (AssemblySample, Outcome, f64) {
    let options = Options::new(end).and_then(|o| o.with_tolerance(tolerance));
    let mut run =
        AssemblyRun::new(assembly.clone(), now, options.expect("options")).expect("a run");
    let total = run.now().ledger().total();
    loop {
        if let Event::Stop(outcome) = run.advance().expect("an event") {
            let last = run.sample_now();
            let opened = (last.ledger().total() - total).abs();
            return (last, outcome, opened);
        }
    }
}

/// The nearest sections of two rods; of one rod, sections farther apart along it than half the girth.
fn brute(
    sample: &AssemblySample,
    base: [Isometry3<f64>; 2],
    rods: [usize; 2],
    d: f64,
) -> (f64, [f64; 2]) {
    let n = 500;
    let places: Vec<f64> = (0..=n).map(|k| f64::from(k) / f64::from(n)).collect();
    let curves = [0, 1].map(|i| {
        let sections = sample.rod_sections(rods[i], &places);
        let placed = sections
            .iter()
            .map(|at| base[i].transform_point(&at.position.into()).coords);
        placed.collect::<Vec<Vector3<f64>>>()
    });
    let mut best = (f64::INFINITY, [0.0; 2]);
    for (i, a) in curves[0].iter().enumerate() {
        for (j, b) in curves[1].iter().enumerate() {
            let apart = rods[0] != rods[1] || places[j] - places[i] > 1.6 * d;
            if apart && (a - b).norm() < best.0 {
                best = ((a - b).norm(), [places[i], places[j]]);
            }
        }
    }
    best
}

fn assert_touching(contact: &Contact, found: (f64, [f64; 2]), d: f64) {
    // Sections 1/500 apart overestimate the smallest distance by at most 2e-6.
    let off = found.0 - d;
    assert!(
        (-1e-9..1e-5).contains(&off),
        "the distance is {} and not {d}",
        found.0
    );
    for (s, at) in contact.at.iter().zip(found.1) {
        assert!(
            (s - at).abs() < 4e-3,
            "they touch at {:?}, not {:?}",
            contact.at,
            found.1
        );
    }
    assert!(contact.gap.abs() < 1e-12);
}

/// Would catch a contact found late, at another pair, or between neighbours along the rod, and a contact found without
/// request.
#[test]
fn a_rod_stops_where_its_end_touches_it() {
    let here = Isometry3::identity();
    let d = 0.08;
    let link = (
        here,
        Vector3::new(0.15, 0.05, 0.15),
        Vector3::new(-6.0, -2.0, 0.0),
    );
    let case = thrown(&[link], d);
    let (sample, outcome, opened) = stopped(&case, 0.1, 1e-11);
    let Outcome::SelfContact(contact) = outcome else {
        panic!("{outcome:?}")
    };
    assert_eq!(contact.rods, [0, 0]);
    assert_touching(&contact, brute(&sample, [here; 2], [0, 0], d), d);
    assert!(opened < 1e-10, "the ledger opens by {opened:e}");
    // The contact time does not depend on the steps.
    let (rough, ..) = stopped(&case, 0.1, 1e-7);
    assert!((rough.time() - sample.time()).abs() < 1e-7);
    let (_, none, _) = stopped(&thrown(&[link], 0.0), 0.03, 1e-9);
    assert_eq!(none, Outcome::EndOfTime);
}

/// Two rods that meet in their middles. Would catch an omitted base or pair, or arclengths of the wrong rod.
#[test]
fn two_rods_stop_where_they_touch_each_other() {
    let d = 0.05;
    let across =
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let bases = [
        Isometry3::identity(),
        Isometry3::from_parts(Vector3::new(-0.5, 0.2, 0.45).into(), across),
    ];
    let links = [
        (
            bases[0],
            Vector3::new(0.05, 0.0, 0.9),
            Vector3::new(0.0, 1.5, 0.0),
        ),
        (
            bases[1],
            Vector3::new(0.4, 0.25, 0.4),
            Vector3::new(0.0, -2.0, 0.0),
        ),
    ];
    let (sample, outcome, opened) = stopped(&thrown(&links, d), 1.0, 1e-10);
    let Outcome::SelfContact(contact) = outcome else {
        panic!("{outcome:?}")
    };
    assert_eq!(contact.rods, [0, 1]);
    assert!(
        contact.at.iter().all(|s| *s > 0.05 && *s < 0.95),
        "{contact:?}"
    );
    assert_touching(&contact, brute(&sample, bases, [0, 1], d), d);
    assert!(opened < 1e-9, "the ledger opens by {opened:e}");
}

/// Would catch a thickness that is not taken from the section or not scaled, a report without names and units, and a
/// run from a start in contact.
#[cfg(feature = "scene")]
#[test]
fn scenes_stop_at_contact_and_say_where() {
    use snaprod::scene::{Scene, Shape};
    use snaprod::study::{Silent, Table, run};
    let parsed =
        |text: &str| Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    // E and the diameter such that EI = 1: a silicone cord of 2 m, 8 cm thick in parts of its length.
    let section = "section = { circle = { diameter = 0.16 } }\nmaterial = { E = 1e6, nu = 0.4 }";
    let scene = |more: &str| {
        format!(
            "units = \"si\"\n[rod]\nmodel = \"cosserat\"\nlength = 2.0\n{section}\n{more}[body]\nmass = 3.0\njoint = \"ball\"\n\
             [start]\npose = {{ position = [0.3, 0.1, 0.3] }}\nvelocity = [-16.0, -5.3, 0.0]\n\
             [run]\nduration = 0.05\nsamples = 5\n"
        )
    };
    let ran = |text: &str| {
        let prepared = run::Prepared::new(&parsed(text)).expect("a scene that runs");
        let mut tables: Vec<Table> = Vec::new();
        run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record")
    };
    let record = ran(&scene(""));
    assert_eq!(record.outcome(), "self_contact", "{:?}", record.reason());
    let event = record.events().pop().expect("an event");
    assert_eq!(
        (event["kind"].as_str(), &event["s"][1]),
        (Some("self_contact"), &2.0.into())
    );
    let reason = record.reason().expect("a reason");
    assert!(
        reason.contains("touches itself at s = 0.") && reason.contains(" m and s = 2.000000 m"),
        "{reason}"
    );
    assert_eq!(record.summary()["contact_diameter"], 0.16);
    let free = ran(&scene("contact_diameter = 0.0\n"));
    assert_eq!(free.outcome(), "end_of_time");
    assert!(free.summary()["contact_diameter"].is_null());
    // A cord with a diameter above the distance of its ends touches itself at the start.
    let thick = parsed(&scene("contact_diameter = 0.45\n"));
    let refused = run::Prepared::new(&thick).and_then(|prepared| prepared.motion().map(drop));
    let said = refused.expect_err("a start in contact").to_string();
    assert!(
        said.contains("s = 2 m") && said.contains("nearer to each other at the start"),
        "{said}"
    );
    let strip = Shape::Rectangle {
        width: 0.02,
        height: 0.001,
    };
    assert_eq!(strip.thickness(), 0.001);

    // In the assembly the rod starts at its other end.
    let text = scene("")
        .replace(
            "[rod]",
            "[[rod]]\nname = \"cord\"\nto = { rotation = { axis = [1.0, 0.0, 0.0], angle_degrees = 180.0 } }\nfrom = { body = \"m\", joint = \"ball\" }",
        )
        .replace(
            "[body]",
            "[[body]]\nname = \"m\"\nguess = { position = [0.3, 0.1, 0.3] }",
        )
        .replace(
            "joint = \"ball\"\n[start]\npose = { position = [0.3, 0.1, 0.3] }\n",
            "",
        );
    // Without a support the start is not an equilibrium. A groove would hold the body, but lies across its velocity; a
    // force is used.
    let at = ran(&scene("contact_diameter = 0.0\n")).branches[0]
        .first
        .end()
        .action
        .expect("a rod")
        .force;
    let text = text.replace(
        "mass = 3.0\n",
        &format!(
            "mass = 3.0\nforce = [{:?}, {:?}, {:?}]\n",
            -at.x, -at.y, -at.z
        ),
    );
    let prepared = run::Prepared::new(&parsed(&text)).expect("a scene that runs");
    let mut tables: Vec<Table> = Vec::new();
    let record =
        run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record");
    assert_eq!(record.outcome(), "self_contact", "{:?}", record.reason());
    let reason = record.reason().expect("a reason");
    assert!(reason.contains("cord touches itself"), "{reason}");
    let event = record.events().pop().expect("an event");
    let s = [&event["s"][0], &event["s"][1]].map(|s| s.as_f64().expect("an arclength"));
    // The rod starts at the body: its end is at s = 0.
    assert!(s.contains(&0.0) && s.iter().any(|s| *s > 1.5), "{s:?}");
}

/// Would catch contact between ends that share one attachment: two rods from nearby points of the ground or of one
/// body, thicker than their distance, that diverge from there (theory 3.7).
#[cfg(feature = "scene")]
#[test]
fn ends_that_one_thing_holds_are_as_near_as_they_are_held() {
    use snaprod::scene::Scene;
    use snaprod::study::run;
    use snaprod::study::{Silent, Table};
    let rod = |name: &str, from: &str| {
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = 1.0\ncontact_diameter = 0.05\n\
             section = {{ bending = [1.0, 1.1], torsion = 0.8, axial = 300.0, shear = [200.0, 200.0] }}\n\
             from = {{ {from} }}\nto = {{ body = \"{name}\" }}\n\
             [[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nvelocity = [0.0, 0.1, 0.0]\n"
        )
    };
    let pair = |on: &str| {
        let site = |x: f64, angle: f64| {
            format!(
                "{on}position = [{x:?}, 0.0, 0.0], rotation = {{ axis = [0.0, 1.0, 0.0], angle = {angle:?} }}"
            )
        };
        let (left, right) = (site(-0.01, -0.3), site(0.01, 0.3));
        format!("{}{}", rod("left", &left), rod("right", &right))
    };
    let rest = "[start]\nrest = \"straight\"\n[run]\nduration = 0.05\n";
    let ground = format!("{}{rest}", pair(""));
    let hub = format!(
        "{}{}{rest}",
        rod("hub", "position = [0.0, 0.0, -1.0]"),
        pair("body = \"hub\", ")
    );
    for text in [ground, hub] {
        let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
        let prepared = run::Prepared::new(&scene).expect("a scene that runs");
        let mut tables: Vec<Table> = Vec::new();
        let record =
            run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record");
        assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    }
}

/// Would catch ends excluded as neighbours only because other ends of their rods share the ground: two cantilevers
/// with meeting tips, and a ring whose end reaches its own base.
#[cfg(feature = "scene")]
#[test]
fn ends_that_nothing_holds_together_touch() {
    use snaprod::scene::Scene;
    use snaprod::study::{Silent, Table, run};
    let rod = "model = \"cosserat\"\nlength = 1.0\ncontact_diameter = 0.05\n\
               section = { bending = [1.0, 1.1], torsion = 0.8, axial = 300.0, shear = [200.0, 200.0] }\n";
    let tips = |inertia: &str| {
        let half = |name: &str, from: &str, v: f64| {
            format!(
                "[[rod]]\nname = \"{name}\"\n{rod}{inertia}from = {{ {from} }}\nto = {{ body = \"{name}\" }}\n\
                 [[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nvelocity = [0.0, 0.0, {v:?}]\n"
            )
        };
        let turned = "position = [0.0, 0.0, 2.06], quaternion = [0.0, 1.0, 0.0, 0.0]";
        let (one, other) = (half("a", "", 0.15), half("b", turned, -0.15));
        format!("{one}{other}[start]\nrest = \"straight\"\n[run]\nduration = 0.3\n")
    };
    let heavy = "mass = 0.1\nsection_inertia = [1e-4, 1e-4, 2e-4]\ninertia = \"full\"\ndamping = { proportional = 0.01 }\n";
    for inertia in ["", heavy] {
        let text = tips(inertia);
        let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
        let prepared = run::Prepared::new(&scene).expect("a scene that runs");
        let mut tables: Vec<Table> = Vec::new();
        let record =
            run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record");
        assert_eq!(record.outcome(), "self_contact", "{:?}", record.reason());
        let event = record.events().pop().expect("an event");
        assert_eq!([&event["s"][0], &event["s"][1]], [1.0, 1.0], "{event}");
    }
    let ring = format!(
        "[rod]\n{}rest = {{ curvature = [0.0, 6.2] }}\n[body]\nmass = 1.0\ninertia = [0.01, 0.01, 0.01]\n[start]\nrest = \"straight\"\n\
         [run]\nduration = 0.05\n",
        rod.replace("0.05", "0.06")
    );
    let scene = Scene::parse(&ring).unwrap_or_else(|faults| panic!("{faults}"));
    let refused = run::Prepared::new(&scene).and_then(|prepared| prepared.motion().map(drop));
    let said = refused.expect_err("a start in contact").to_string();
    assert!(said.contains("nearer to each other"), "{said}");
}

/// Straight rods of length 1 and diameter 0.1 through these points along z, each held at both ends by its carrier.
fn straight<'a>(rods: &[(Vector3<f64>, &'a AttachedTo)]) -> Vec<Tube<'a>> {
    let tubes = rods.iter().enumerate().map(|(k, (foot, carrier))| {
        let foot = *foot;
        let exact = move |s: f64| Some([foot + Vector3::z() * s, Vector3::z(), Vector3::zeros()]);
        Tube::new(k, 0.1, vec![carrier; 2], 1.0, exact).expect("a rod")
    });
    tubes.collect()
}

/// Catches two ends on supports that move apart taken for ends of one holder, whose contact is skipped. End to end, the
/// ends of the rods are the nearest pair. On carriers that move as one the ends may be as near as they are held.
#[test]
fn ends_on_supports_that_move_apart_touch() {
    let support = |rate: f64, x: f64| {
        let place = Support::<3>::new(Vector3::new(x, 0.0, 0.0), &UnitQuaternion::identity());
        let moving = place
            .and_then(|support| support.with_translation(Vector3::z(), History::Rate { rate }));
        AttachedTo::Support(Box::new(moving.expect("a support")))
    };
    let feet = [Vector3::zeros(), Vector3::new(0.0, 0.0, 1.05)];
    let gap = |carriers: [&AttachedTo; 2]| {
        let rods = [(feet[0], carriers[0]), (feet[1], carriers[1])];
        Nearness::of(&straight(&rods)).gap()
    };
    let (one, beside, other) = (support(1.0, 0.0), support(1.0, 3.0), support(-1.0, 0.0));
    let touch = gap([&one, &other]);
    assert!((touch + 0.05).abs() < 1e-12, "{touch}");
    assert!(gap([&AttachedTo::Ground, &one]) < 0.0);
    assert!(gap([&AttachedTo::Body(0), &AttachedTo::Body(1)]) < 0.0);
    assert_eq!(gap([&one, &beside]), f64::INFINITY);
    let ground = [&AttachedTo::Ground, &AttachedTo::Ground];
    assert_eq!(gap(ground), f64::INFINITY);
}

/// Catches a distance from a search that has not converged. Newton's steps swing to and fro across the valley of two
/// parallel rods, whose sample points are not side by side.
#[test]
fn parallel_rods_are_as_far_apart_as_their_axes() {
    let ground = AttachedTo::Ground;
    for shift in [0.003, 0.0071, 0.31] {
        let feet = [Vector3::zeros(), Vector3::new(0.12, 0.0, shift)];
        let rods = straight(&feet.map(|foot| (foot, &ground)));
        let gap = Nearness::of(&rods).gap();
        assert!((gap - 0.02).abs() < 1e-12, "{shift}: {gap}");
    }
}
