//! Light rods that join each other without a body, in motion: frames and linkages of rods without mass.

use crate::support::{frequencies, modes_of, near, text_of};
use nalgebra::Vector3;
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table};

fn ran(text: &str) -> RunRecord {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    run(&prepared, Fields::None, &mut tables, &mut Silent)
        .unwrap_or_else(|why| panic!("{why}\n{text}"))
}

/// Last place and velocity of the last body of a run with a closed ledger.
fn last(record: &RunRecord) -> [Vector3<f64>; 2] {
    let branch = &record.branches[0];
    assert!(
        branch.closing.error < 1e-8 * branch.closing.largest,
        "{:?}",
        branch.closing
    );
    let body = branch.last.bodies.last().expect("a body");
    [body.pose.translation.vector, body.velocity]
}

const ALONG_X: &str = "rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 }";

/// A body that is thrown at the end of rods of these fields, which begin on the ground along x.
fn thrown(rods: &str, nodes: &str, run: &str) -> String {
    format!(
        "{rods}\n{nodes}\n[[body]]\nname = \"m\"\nmass = 1.0\ninertia = [0.01, 0.02, 0.03]\n\
         velocity = [0.0, 0.2, -0.3]\n[loads]\ngravity = [0.0, 0.0, -1.0]\n[run]\ntolerance = 1e-10\n{run}\n"
    )
}

fn rod(name: &str, length: f64, ends: [&str; 2]) -> String {
    let [from, to] = ends;
    format!(
        "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = {length:?}\n\
         section = {{ bending = [1.0, 2.0], torsion = 0.8 }}\nfrom = {{ {from} }}\nto = {{ {to} }}\n"
    )
}

const KNEE: &str = "[[body]]\nname = \"knee\"\nmass = 0.0\n";

/// One rod, and the same rod cut at two nodes, which it meets turned and beside their origins.
fn whole_and_cut(run: &str) -> [String; 2] {
    let whole = rod("a", 2.0, [ALONG_X, &format!("body = \"m\", {ALONG_X}")]);
    let aside = format!("body = \"knee\", position = [0.1, -0.2, 0.05], {ALONG_X}");
    let second = "body = \"second\"";
    let cut = [
        rod("a", 0.8, [ALONG_X, &aside]),
        rod("b", 0.5, [&aside, second]),
        rod("c", 0.7, [second, &format!("body = \"m\", {ALONG_X}")]),
    ];
    let nodes = format!("{KNEE}[[body]]\nname = \"second\"\nmass = 0.0\n");
    [thrown(&whole, "", run), thrown(&cut.concat(), &nodes, run)]
}

/// Catches a wrong term of the balance of a node, its levers, or its motion: a rod cut at nodes moves as the whole one,
/// in space, and vibrates alike.
#[test]
fn a_rod_that_is_cut_at_nodes_moves_as_the_whole_one() {
    let [whole, cut] = whole_and_cut("duration = 0.5");
    let ([r, v], [r_cut, v_cut]) = (last(&ran(&whole)), last(&ran(&cut)));
    assert!((r - r_cut).norm() < 1e-9, "{r} {r_cut}");
    assert!((v - v_cut).norm() < 1e-8, "{v} {v_cut}");
    let [whole, cut] = [whole, cut].map(|text| frequencies(&modes_of(&text)));
    assert_eq!((whole.len(), cut.len()), (6, 6));
    for (a, b) in whole.iter().zip(&cut) {
        near(*b, *a, 1e-8);
    }
}

/// Catches a joint on a node whose axes do not turn with the node, a load on a node that does no work, and a support
/// whose power is lost: the ledger of a frame of three rods with all of these stays closed.
#[test]
fn a_frame_with_joints_and_loads_on_its_node_keeps_its_ledger_closed() {
    let turns = "motion = { turn = { axis = [0.0, 0.0, 1.0], rate = 0.3 } }";
    let fork = "joint = \"universal\", axis = [0.0, 1.0, 0.0], second_axis = [0.0, 0.0, 1.0]";
    let about_x = "rotation = { axis = [1.0, 0.0, 0.0], angle_degrees = 90.0 }";
    let rods = [
        rod(
            "a",
            0.8,
            [
                &format!("{ALONG_X}, {turns}"),
                &format!("body = \"knee\", position = [-0.05, 0.0, 0.02], {ALONG_X}"),
            ],
        ),
        rod(
            "b",
            1.2,
            [
                &format!("body = \"knee\", position = [0.05, 0.0, 0.0], {ALONG_X}, {fork}, stiffness = 0.5, couple = 0.2"),
                &format!("body = \"m\", {ALONG_X}"),
            ],
        ),
        rod(
            "c",
            1.0,
            [
                &format!("position = [0.8, 0.9, 0.0], {about_x}, joint = \"slider\", axis = [1.0, 0.0, 0.0], stiffness = 3.0"),
                &format!("body = \"knee\", {about_x}, joint = \"hinge\", axis = [0.0, 0.0, 1.0], damping = 0.3"),
            ],
        )
        .replace("torsion = 0.8", "torsion = 0.8, axial = 300.0"),
    ];
    let loads = "force = [0.3, 0.1, -0.4]\ncouple = { direction = [0.02, 0.1, -0.03], constant = 1.0, follower = true }\n";
    let text = thrown(&rods.concat(), &format!("{KNEE}{loads}"), "duration = 0.6");
    last(&ran(&text));
}

/// The toggle of the scenes in a shorter run, its strip in one piece or cut at a node.
fn toggle(cut: bool) -> String {
    let text = text_of("toggle")
        .replace("duration = 6.0", "duration = 2.0")
        .replace("tolerance = 1e-11", "tolerance = 1e-9");
    if !cut {
        return text;
    }
    let end = text
        .lines()
        .find(|line| line.starts_with("to = { body = \"block\", rotation"));
    let end = end.expect("the end of the strip");
    let more = format!(
        "[[rod]]\nname = \"rest\"\nmodel = \"cosserat\"\nlength = 0.6\nsection = {{ bending = [20.0, 1.0], torsion = 20.0 }}\n\
         from = {{ body = \"knee\" }}\n{end}\n\
         [[body]]\nname = \"knee\"\nmass = 0.0\n\
         guess = {{ position = [0.38, 0.0, 0.15], rotation = {{ axis = [0.0, 1.0, 0.0], angle_degrees = 60.0 }} }}\n"
    );
    let post = text.find("[[rod]]\nname = \"post\"").expect("the post");
    let (head, tail) = text.split_at(post);
    let head = head
        .replace(end, "to = { body = \"knee\" }")
        .replace("length = 1.0", "length = 0.4");
    format!("{head}{more}{tail}")
}

/// Catches a fold of joined rods that is missed or misplaced, and a fall of one of them alone: a strip that is cut at a
/// node comes to its fold at the same time as the whole one, where the run ends and names both rods.
#[test]
fn a_strip_that_is_cut_at_a_node_comes_to_the_fold_of_the_whole_one() {
    let [whole, cut] = [false, true].map(|cut| ran(&toggle(cut)));
    let snaps = &whole.branches[0].snaps;
    assert_eq!((snaps.len(), cut.branches[0].snaps.len()), (1, 0));
    let why = cut.reason().expect("an end at the fold").to_string();
    assert!(
        why.contains("strip") && why.contains("rest") && why.contains("snap together"),
        "{why}"
    );
    let end = cut.branches[0].last.t;
    near(end, snaps[0].t, 1e-8);
}

/// Asserts that a scene has one fault, of the given field and with the given word.
fn refused(text: &str, field: &str, word: &str) {
    let found = Scene::parse(text).expect_err(text);
    let all = found.as_slice().iter();
    let all: Vec<&str> = all.map(|fault| fault.field.as_str()).collect();
    assert_eq!(all, [field], "{found}\n{text}");
    assert!(found.to_string().contains(word), "{found}: {word}");
}

/// Catches a node that is given what only a body with a mass has, and a motion without any mass.
#[test]
fn what_nodes_of_light_rods_do_not_do_is_refused_by_name() {
    let cut = whole_and_cut("duration = 0.5")[1].clone();
    let node = "name = \"second\"\nmass = 0.0\n";
    let with = |more: &str| cut.replace(node, &format!("{node}{more}\n"));
    for (more, field) in [
        ("drag = 0.1", "body[1].drag"),
        ("velocity = [0.0, 0.1, 0.0]", "body[1].velocity"),
        ("inertia = [0.1, 0.1, 0.1]", "body[1].inertia"),
        (
            "force = { direction = [1.0, 0.0, 0.0], amplitude = 1.0, frequency = 2.0 }",
            "body[1].force",
        ),
    ] {
        refused(&with(more), field, "node");
    }
    let light = cut.replace(
        "mass = 1.0\ninertia = [0.01, 0.02, 0.03]\nvelocity = [0.0, 0.2, -0.3]",
        "mass = 0.0",
    );
    refused(&light, "body", "heavy bodies");
}
