//! Rods at rest that touch obstacles at points: against elliptic integrals, against integrations made in Python, and
//! against what must hold of any equilibrium.
//!
//! The numbers of the strip, the rod held at its tip, the cantilever and the peg are closed forms in elliptic integrals
//! (see docs/theory.md); those of rods in space are made by tools/ref_contact.py.

use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3, Vector6};
use serde_json::Value;
use snaprod::Error;
use snaprod::contact::Obstacle;
use snaprod::rod::contact::{
    ContactBranch, ContactEquilibrium, ContactEventKind, ContactGuess, ContactOptions,
    ContactProblem, ContactStop, GuessedTouch, Surface, Way,
};
use snaprod::rod::{DistributedLoad, EndConditions, Path, Problem, Rod};
use snaprod::section::Linear;
use snaprod::solve::arclength::Options;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

fn near(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!(
        (got - expected).abs() <= tolerance * (1.0 + expected.abs()),
        "{what} = {got}, not {expected}"
    );
}

fn law() -> Linear {
    Linear::diagonal([1.0, 1.0], 1.0).expect("a law")
}

/// A rod of length 1 along x from the origin.
fn along_x() -> Rod {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    Rod::new(1.0, law())
        .expect("a rod")
        .with_clamp(Vector3::zeros(), turn)
}

fn plane(height: f64, outwards: f64) -> Surface {
    let point = Vector3::new(0.0, height, 0.0);
    let plane = Obstacle::plane(point, Vector3::new(0.0, outwards, 0.0)).expect("a plane");
    Surface::new(plane, 0.0).expect("a surface")
}

fn among(problem: Problem, surfaces: Vec<Surface>) -> ContactProblem {
    ContactProblem::new(problem, surfaces, ContactOptions::default()).expect("a contact problem")
}

/// The strip: both ends clamped along x, shortened, with a wall on the side to which it buckles.
fn strip(shortening: f64, wall: f64) -> snaprod::Result<ContactProblem> {
    let rod = along_x();
    let turn = rod.clamp_pose().rotation;
    let end = EndConditions::pose(Vector3::new(1.0 - shortening, 0.0, 0.0), turn);
    let problem = Problem::new(rod, end, 1e-13)?.with_path(Path::Planar);
    ContactProblem::new(problem, vec![plane(-wall, 1.0)], ContactOptions::default())
}

fn guess_of(found: &ContactEquilibrium) -> ContactGuess {
    let touches = found.touches.iter().map(GuessedTouch::from);
    ContactGuess {
        base: found.base,
        touches: touches.collect(),
    }
}

/// Steps and tolerance of a branch whose parameter is a length.
fn over_lengths(from: f64, to: f64) -> Options {
    Options {
        weight: 1000.0,
        max_step: 20.0,
        initial_step: 0.5,
        tolerance: 1e-11,
        ..Options::between(from, to)
    }
}

/// Catches a wrong jump of the force or a wrong place of the touch: thrust, reaction, curvature and energy of the strip
/// are elliptic integrals. Both parts of the strip are unstable alone, so that the index catches a missing term.
#[test]
fn strip_against_a_wall() {
    // Shortening, thrust, reaction, curvature at the touch, energy; wall at 0.1.
    let rows = [
        [
            0.02539755328962067,
            54.00160736589504,
            7.188423738843049,
            1.8243484478113259,
            1.0114573025996103,
        ],
        [
            0.02646034508058697,
            88.28256144877149,
            25.25644140876578,
            1.340609665740798,
            1.0882742382827872,
        ],
        [
            0.02865010297707843,
            130.961917638729,
            49.206060373757,
            0.5735581723173847,
            1.3330180994664795,
        ],
    ];
    for [shortening, thrust, reaction, curvature, energy] in rows {
        let found = strip(shortening, 0.1)
            .and_then(|p| p.solve(None))
            .expect("an equilibrium");
        near("thrust", -found.end.force.x, thrust, 3e-11);
        let [touch] = found.touches[..] else {
            panic!("one touch, not {:?}", found.touches)
        };
        near("place", touch.s, 0.5, 1e-12);
        near("reaction", touch.reaction, reaction, 3e-11);
        near("curvature", touch.relative_curvature, curvature, 1e-10);
        near("energy", found.end.energy, energy, 1e-11);
        assert_eq!((found.index, found.neutral), (Some(0), 0));
        assert_eq!(found.way, Way::Obstacles);
        assert!(found.min_gap > 0.0);
    }
}

/// Catches an event that is late. Touch and beginning of line contact are known to all digits, with their thrusts. Line
/// contact must be named and must end the branch.
#[test]
fn strip_is_followed_from_touch_to_line_contact() {
    let first = strip(0.0245, 0.1).expect("a strip");
    let start = first.solve(None).expect("an equilibrium");
    assert!(start.touches.is_empty() && start.min_gap > 0.0);
    let range = over_lengths(0.0245, 0.034);
    let branch = ContactBranch::follow(|x| strip(x, 0.1), &guess_of(&start), 0.0245, range);
    let branch = branch.expect("a branch");
    let [touch, line] = &branch.events[..] else {
        panic!("two events, not {:?}", branch.events)
    };
    assert_eq!(touch.kind, ContactEventKind::Touch);
    assert_eq!((touch.index, touch.surface), ((Some(0), Some(0)), Some(0)));
    near("touch", touch.point.p, 0.025066723500463652, 1e-12);
    near(
        "thrust",
        -touch.point.equilibrium.end.force.x,
        39.98029510107074,
        1e-10,
    );
    assert_eq!(line.kind, ContactEventKind::Line);
    near("line", line.point.p, 0.03074903690589187, 1e-10);
    near(
        "thrust",
        -line.point.equilibrium.end.force.x,
        155.45894916256026,
        1e-8,
    );
    assert_eq!(branch.stop, ContactStop::Event(ContactEventKind::Line));
}

/// Catches a wrong thrust or reaction of a rod that lies along a wall: both free parts are elliptic integrals. Without
/// weight the parts are in neutral balance, so that the place of the line is known to half of the digits.
#[test]
fn strip_lies_along_a_wall() {
    // Shortening, thrust, reaction at each end of the line, length of the line.
    let rows = [
        [
            0.034159171407178945,
            188.991562426136,
            43.38909233545867,
            0.09469302506208305,
        ],
        [
            0.03759195225029576,
            225.1089504534877,
            56.97216306169022,
            0.17216615291507528,
        ],
        [
            0.04104984962950604,
            263.5682451876825,
            72.97964307394967,
            0.23664394528091573,
        ],
        [
            0.04453540859919744,
            304.1095544452594,
            91.54502298560823,
            0.2910711715792392,
        ],
    ];
    for [shortening, thrust, reaction, length] in rows {
        let found = strip(shortening, 0.1)
            .and_then(|p| p.solve(None))
            .expect("a strip");
        let [touch] = &found.touches[..] else {
            panic!("one contact, not {:?}", found.touches)
        };
        let line = touch.line.expect("a line");
        near("thrust", -found.end.force.x, thrust, 1e-9);
        near("reaction at the start", line.at_start, reaction, 1e-8);
        near("reaction at the end", line.at_end, reaction, 1e-8);
        near("pressure", line.pressed, 0.0, 1e-12);
        near("length", line.length, length, 1e-5);
        assert_eq!(found.index, None);
    }
}

/// A rod along x, clamped on the floor, with a weight of 1 per length.
fn heavy_on_floor(length: f64, end: EndConditions) -> snaprod::Result<ContactProblem> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    let rod = Rod::new(length, law())?.with_clamp(Vector3::zeros(), turn);
    let weight = DistributedLoad::constant(Vector3::new(0.0, 0.0, -1.0))?;
    let problem = Problem::new(rod, end, 1e-13)?.with_distributed(&weight);
    let floor = Obstacle::plane(Vector3::zeros(), Vector3::z())?;
    ContactProblem::new(
        problem,
        vec![Surface::new(floor, 0.0)?],
        ContactOptions::default(),
    )
}

/// Catches a wrong place, reaction or shape of a rod that lies on the floor from its clamp on, and whose end is lifted.
/// No guess is given. The numbers are those of the given data, made by another program.
#[test]
fn pipe_is_lifted_off_the_floor() {
    // Height, pull, length off the floor, lifting force, reaction at the end of the line, x of the end from there.
    let rows = [
        [
            1e-4,
            0.0,
            0.22133639706399028,
            0.11066820756801656,
            0.11066818949597372,
            0.22133636350162877,
        ],
        [
            0.5,
            0.0,
            1.9020875861890323,
            0.9794338013847261,
            0.9226537848043062,
            1.8009006168291213,
        ],
        [
            2.0,
            0.0,
            3.2317603583337156,
            2.0436600208441607,
            1.188100337489555,
            2.063599454935438,
        ],
        [
            1.0,
            1.0,
            2.661748747030794,
            1.8399692411371336,
            0.8217795058936603,
            2.3647855117264416,
        ],
    ];
    const LENGTH: f64 = 6.0;
    let lifted = |height: f64, pull: f64| {
        let held = EndConditions {
            position: [None, Some(0.0), Some(height)],
            ..EndConditions::load(Vector3::new(pull, 0.0, 0.0), Vector3::zeros())
        };
        heavy_on_floor(LENGTH, held)
    };
    for [height, pull, off, force, reaction, x] in rows {
        let found = lifted(height, pull)
            .and_then(|p| p.solve(None))
            .expect("a pipe");
        let line = found.touches[0].line.expect("a line");
        near("length off the floor", LENGTH - line.length, off, 1e-9);
        near("lifting force", found.end.force.z, force, 1e-9);
        near("reaction", line.at_end, reaction, 1e-9);
        near("end", found.end.position.x - line.length, x, 1e-9);
        near("weight on the floor", line.pressed, line.length, 1e-10);
    }
    // The branch goes on where the last of the rod leaves the floor. Its force is the slope of the energy.
    let start = lifted(0.5, 0.0)
        .and_then(|p| p.solve(None))
        .expect("a pipe");
    let range = Options {
        max_step: 0.2,
        tolerance: 1e-11,
        ..Options::between(0.5, 5.0)
    };
    let branch = ContactBranch::follow(|h| lifted(h, 0.0), &guess_of(&start), 0.5, range);
    let branch = branch.expect("a branch");
    let [point] = &branch.events[..] else {
        panic!("one event, not {:?}", branch.events)
    };
    assert_eq!(point.kind, ContactEventKind::Point);
    near(
        "index beyond",
        point.index.1.map_or(f64::NAN, |index| index as f64),
        0.0,
        0.0,
    );
    let last = branch.points.last().expect("points");
    assert!(
        last.p == 5.0 && last.equilibrium.touches.is_empty(),
        "{:?}",
        branch.stop
    );
}

/// Catches two lines at once, and a thrust that the lying parts do not carry. A rod on the floor between two
/// clamps that have come together buckles up. Numbers of the given data; half of the rod by another program.
#[test]
fn rod_between_two_clamps_buckles_off_the_floor() {
    // Thrust, length of the buckle, reactions at its ends, shortening.
    let rows = [
        [
            5.0,
            4.028136519674097,
            2.0140682598370483,
            0.2609121382970665,
        ],
        [
            2.6,
            5.619706088552657,
            2.8098530442763283,
            2.0508279210747777,
        ],
    ];
    const LENGTH: f64 = 9.0;
    for [thrust, buckle, reaction, shortening] in rows {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
        let end = EndConditions::pose(Vector3::new(LENGTH - shortening, 0.0, 0.0), turn);
        let problem = heavy_on_floor(LENGTH, end).expect("a problem");
        let lying = 0.5 * (LENGTH - buckle);
        let mut base = Vector6::zeros();
        base[3] = -1.001 * thrust;
        let line = |s: f64, reaction: f64| GuessedTouch {
            surface: 0,
            s: Some(s),
            reaction,
            length: lying,
        };
        let touches = vec![line(0.0, 1.001 * reaction), line(LENGTH - lying, 0.0)];
        let found = problem.solve(Some(&ContactGuess { base, touches }));
        let found = found.expect("a buckled rod");
        let lines: Vec<_> = found
            .touches
            .iter()
            .filter_map(|touch| touch.line)
            .collect();
        assert_eq!(lines.len(), 2);
        near("thrust", -found.base[3], thrust, 1e-9);
        near(
            "buckle",
            LENGTH - lines[0].length - lines[1].length,
            buckle,
            1e-8,
        );
        near("reaction", lines[0].at_end, reaction, 1e-8);
        near("reaction", lines[1].at_start, reaction, 1e-8);
    }
}

/// Catches a wrong couple, tension or pressure of a rod that lies on a drum. Along a rod without weight m^2/2 + n.t is
/// constant, also through the ends of the line, and the pressure is T/r.
#[test]
fn rod_lies_on_a_drum() {
    const RADIUS: f64 = 0.8;
    let pulled = |force: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
        let rod = Rod::new(3.0, law())?.with_clamp(Vector3::zeros(), turn);
        let end = EndConditions::load(Vector3::new(0.0, 0.0, -force), Vector3::zeros());
        let centre = Vector3::new(1.0, 0.0, -RADIUS - 0.05);
        let drum = Obstacle::cylinder(centre, Vector3::y(), RADIUS, false)?;
        let problem = Problem::new(rod, end, 1e-13)?;
        ContactProblem::new(
            problem,
            vec![Surface::new(drum, 0.0)?],
            ContactOptions::default(),
        )
    };
    for force in [3.0, 10.0] {
        let found = pulled(force).and_then(|p| p.solve(None)).expect("a rod");
        let line = found.touches[0].line.expect("a line");
        let tension = line.pressed * RADIUS / line.length;
        let integral = tension + 0.5 / (RADIUS * RADIUS);
        let tangent = found.end.directors * Vector3::z();
        near(
            "integral at the end",
            found.end.force.dot(&tangent),
            integral,
            1e-9,
        );
        let at_clamp = 0.5 * found.base[1].powi(2) + found.base[3];
        near("integral at the clamp", at_clamp, integral, 1e-9);
        assert!(line.at_start > 0.0 && line.at_end > 0.0);
    }
    let start = pulled(1.0).and_then(|p| p.solve(None)).expect("a rod");
    let range = Options {
        max_step: 0.5,
        ..Options::between(1.0, 3.0)
    };
    let branch = ContactBranch::follow(pulled, &guess_of(&start), 1.0, range).expect("a branch");
    let kinds: Vec<_> = branch.events.iter().map(|event| event.kind).collect();
    assert_eq!(kinds, [ContactEventKind::Line]);
    let last = branch.points.last().expect("points");
    assert_eq!(last.p, 3.0);
    let found = pulled(3.0).and_then(|p| p.solve(None)).expect("a rod");
    near(
        "branch and equilibrium",
        last.equilibrium.touches[0].s,
        found.touches[0].s,
        1e-8,
    );
}

/// Catches a wrong place of a touch off the middle, where both pieces differ. Catches an index that misses the sliding
/// of the touching point, too.
#[test]
fn rod_held_at_its_tip_under_a_wall() {
    let held = |x: f64| {
        let end = EndConditions::ball(Vector3::new(x, 0.0, 0.0));
        let problem = Problem::new(along_x(), end, 1e-13)?.with_path(Path::Planar);
        ContactProblem::new(problem, vec![plane(0.1, -1.0)], ContactOptions::default())
    };
    // The rod that buckles upwards.
    let first = held(0.975).expect("a problem");
    let mut free = first.problem().solve(None).expect("an equilibrium").base;
    if free[2] < 0.0 {
        (free[2], free[4]) = (-free[2], -free[4]);
    }
    let start = ContactGuess {
        base: free,
        touches: Vec::new(),
    };
    // x, force on the mass, place of the touch, reaction, energy.
    let rows = [
        [
            0.9721597963815438,
            38.01643471224168,
            -7.278257172097857,
            0.6183594987281141,
            9.741141273033499,
            0.5792500412231393,
        ],
        [
            0.9660564252360704,
            80.10053507854282,
            -24.87459771935406,
            0.6634452291178995,
            36.50551981353103,
            0.9537966475138605,
        ],
    ];
    let range = Options {
        at: rows.iter().map(|row| row[0]).collect(),
        ..over_lengths(0.975, 0.963)
    };
    let branch = ContactBranch::follow(held, &start, 0.975, range).expect("a branch");
    for [x, fx, fy, s, reaction, energy] in rows {
        let point = branch
            .points
            .iter()
            .find(|point| point.p == x)
            .expect("a point");
        let found = &point.equilibrium;
        near("force", found.end.force.x, -fx, 1e-10);
        near("force", found.end.force.y, -fy, 1e-10);
        near("place", found.touches[0].s, s, 1e-11);
        near("reaction", found.touches[0].reaction, reaction, 1e-10);
        near("energy", found.end.energy, energy, 1e-11);
        assert_eq!(found.index, Some(0));
    }
    let kinds: Vec<_> = branch.events.iter().map(|event| event.kind).collect();
    assert_eq!(kinds, [ContactEventKind::Touch, ContactEventKind::Line]);
    near("touch", branch.events[0].point.p, 0.9736856391679122, 1e-12);
    near("line", branch.events[1].point.p, 0.964530582449702, 1e-10);
}

/// Catches a touch of the free end that has a place of its own, or the wrong sign of its reaction. From the height
/// 0.3291610099 on the end lies along the floor.
#[test]
fn cantilever_pressed_on_a_floor() {
    // N H^2 of a rod whose end lies along the floor.
    const LIES: f64 = 2.1754525488 * 0.3291610099 * 0.3291610099;
    let pressed = |height: f64| {
        let along = Vector3::new(FRAC_PI_3.cos(), -FRAC_PI_3.sin(), 0.0);
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).expect("a turn");
        let base = Vector3::new(0.0, height, 0.0);
        let rod = Rod::new(1.0, law()).expect("a rod").with_clamp(base, turn);
        let none = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        among(
            Problem::new(rod, none, 1e-13).expect("a problem"),
            vec![plane(0.0, 1.0)],
        )
    };
    let rows = [
        [0.7871834012034148, 0.6529246807462492, 0.6135148489294716],
        [0.45967096998656015, 1.8115529576901344, 0.8523931494828485],
    ];
    for [height, force, x] in rows {
        let problem = pressed(height);
        assert!(problem.is_planar());
        let found = problem.solve(None).expect("an equilibrium");
        assert!(found.touches.len() == 1 && found.touches[0].at_end);
        near("reaction", found.touches[0].reaction, force, 1e-11);
        near("place", found.end.position.x, x, 1e-11);
        near("force beyond the touch", found.end.force.norm(), 0.0, 1e-10);
        assert_eq!(found.index, Some(0));
    }
    // Where the end lies along the floor N H^2 is constant.
    for height in [0.328, 0.2] {
        let found = pressed(height).solve(None).expect("an equilibrium");
        let line = found.touches[0].line.expect("a line");
        near(
            "s at the end of the line",
            found.touches[0].s + line.length,
            1.0,
            1e-12,
        );
        near("reaction", line.at_start, LIES / (height * height), 1e-9);
    }
    for (from, to) in [(0.5, 0.2), (0.2, 0.5)] {
        let start = pressed(from).solve(None).expect("an equilibrium");
        let options = Options::between(from, to);
        let branch = ContactBranch::follow(|h| Ok(pressed(h)), &guess_of(&start), from, options);
        let branch = branch.expect("a branch");
        assert_eq!(branch.events.len(), 1, "{:?}", branch.events);
        near("height", branch.events[0].point.p, 0.3291610099, 1e-6);
        assert_eq!(branch.points.last().map(|point| point.p), Some(to));
    }
}

/// Catches a rod that passes through a peg on its way, and a wrong normal: the force of a peg on a cantilever, over the
/// square of its distance, is an elliptic integral of the angle of the rod there. The peg is a disc beside the point.
#[test]
fn peg_pushes_a_cantilever() {
    const DISTANCE: f64 = 0.5;
    const RADIUS: f64 = 0.03;
    // Angle, place over distance, depth over distance, force times the square of the distance.
    let rows = [
        [
            0.2,
            1.0107484998532914,
            0.13410032008192282,
            0.39206097306109083,
        ],
        [
            0.6,
            1.1030167041214034,
            0.4218753330878927,
            0.9983718620791318,
        ],
    ];
    let at = |depth: f64, angle: f64| {
        let (sine, cosine) = f64::sin_cos(angle);
        let centre = Vector2::new(
            DISTANCE + RADIUS * sine,
            -depth * DISTANCE + RADIUS * cosine,
        );
        let disc = Obstacle::disc(centre, RADIUS - 0.01, false)?;
        let none = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        let problem = Problem::new(along_x(), none, 1e-13)?;
        let surfaces = vec![Surface::new(disc, 0.01)?];
        ContactProblem::new(problem, surfaces, ContactOptions::default())
    };
    for [angle, place, depth, force] in rows {
        let cosine = f64::cos(angle);
        let free = ContactGuess {
            base: Vector6::zeros(),
            touches: Vec::new(),
        };
        // The disc comes from above.
        let found = ContactProblem::solve_along(|t| at(t * depth, t * angle), &free, 0.25);
        let found = found.expect("an equilibrium");
        let [touch] = found.touches[..] else {
            panic!("one touch, not {:?}", found.touches)
        };
        near("place", touch.s, place * DISTANCE, 1e-11);
        near(
            "reaction",
            touch.reaction * DISTANCE * DISTANCE,
            force,
            1e-11,
        );
        near("normal", touch.normal.y, -cosine, 1e-11);
        assert_eq!(found.index, Some(0));
    }
    // A load that bends the rod over a peg far thicker than its way in one step: it stays above.
    let peg = Obstacle::disc(Vector2::new(0.5, -0.02), 0.01, false).expect("a disc");
    let load = EndConditions::load(Vector3::new(0.0, -3.0, 0.0), Vector3::zeros());
    let problem = Problem::new(along_x(), load, 1e-12).expect("a problem");
    let found = among(problem, vec![Surface::new(peg, 0.005).expect("a surface")]).solve(None);
    let found = found.expect("an equilibrium");
    assert!(
        found.touches.len() == 1 && found.touches[0].normal.y > 0.9,
        "{:?}",
        found.touches
    );
    assert_eq!(found.way, Way::Loads);
}

/// Catches a branch that ends without a reason where the rod slips off: a disc pushes a cantilever down until the touch
/// is at the free end.
#[test]
fn rod_slips_off_a_disc() {
    let at = |depth: f64| {
        let none = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        let problem = Problem::new(along_x(), none, 1e-12)?;
        let disc = Obstacle::disc(Vector2::new(0.5, 0.03 - depth), 0.02, false)?;
        ContactProblem::new(
            problem,
            vec![Surface::new(disc, 0.01)?],
            ContactOptions::default(),
        )
    };
    let free = ContactGuess {
        base: Vector6::zeros(),
        touches: Vec::new(),
    };
    let range = Options {
        weight: 10.0,
        max_step: 1.0,
        ..Options::between(-0.01, 1.5)
    };
    let branch = ContactBranch::follow(at, &free, -0.01, range).expect("a branch");
    let kinds: Vec<_> = branch
        .events
        .iter()
        .map(|event| event.kind.as_str())
        .collect();
    assert_eq!(kinds, ["touch", "slip_off"]);
    near("touch", branch.events[0].point.p, 0.0, 1e-12);
    near("place", branch.events[1].s.expect("a place"), 1.0, 1e-5);
    assert_eq!(branch.stop, ContactStop::Event(ContactEventKind::SlipOff));
}

/// Catches an error with a curvature at rest: a ring welded in one point of a plate is pressed by another one. Force,
/// curvature at the weld and energy are elliptic integrals of the height.
#[test]
fn ring_between_plates() {
    // Height, curvature at the lower plate, force, energy.
    let rows = [
        [
            1.9025618279792018,
            0.8,
            0.610439805537146,
            0.030426117001695584,
        ],
        [
            1.5003038580583532,
            0.1,
            2.5303971464150004,
            0.6861878741323774,
        ],
    ];
    let turn = along_x().clamp_pose().rotation;
    let bent = law().with_rest([1.0, 0.0], 0.0).expect("a law");
    let ring = Rod::new(std::f64::consts::TAU, bent).expect("a ring");
    let ring = ring.with_clamp(Vector3::zeros(), turn);
    let weld = EndConditions::pose(Vector3::zeros(), turn);
    let problem = Problem::new(ring, weld, 1e-13).expect("a problem");
    let free = ContactGuess {
        base: Vector6::zeros(),
        touches: Vec::new(),
    };
    for [height, curvature, force, energy] in rows {
        // The ring lies below the weld.
        let found = among(problem.clone(), vec![plane(-height, 1.0)]).solve(Some(&free));
        let found = found.expect("an equilibrium");
        near("force", found.touches[0].reaction, force, 1e-10);
        near("curvature", 1.0 - found.base[2].abs(), curvature, 1e-10);
        near("energy", found.end.energy, energy, 1e-10);
        assert_eq!(found.index, Some(0));
    }
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().expect("a number"))
}

/// Catches an error of the equations in space: rods with three stiffnesses, curved at rest, heavy, stretched, with one
/// touch and with two, made in Python from the base wrench. The compliances must be symmetric (Maxwell), and the
/// reaction must follow a surface that moves by the compliance.
#[test]
fn rods_in_space_against_python() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/contact.json");
    let text = std::fs::read_to_string(path).expect("tests/data/contact.json");
    let data: Value = serde_json::from_str(&text).expect("JSON");
    for case in data["cases"].as_array().expect("cases") {
        let [a, b, c] = numbers(&case["stiffness"]);
        let [u1, u2, u3] = numbers(&case["rest"]);
        let mut law = Linear::diagonal([a, b], c).expect("a law");
        if let Some(axial) = case["axial"].as_f64() {
            law = law.with_axial(axial).expect("a law");
        }
        let law = law.with_rest([u1, u2], u3).expect("a law");
        let rod = Rod::new(1.0, law).expect("a rod");
        let [w, x, y, z] = numbers(&case["end"]["quaternion"]);
        let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let end = EndConditions::pose(Vector3::from(numbers(&case["end"]["position"])), turn);
        let weight = DistributedLoad::constant(Vector3::from(numbers(&case["weight"])));
        let problem = Problem::new(rod, end, 1e-13).expect("a problem");
        let problem = problem
            .with_distributed(&weight.expect("a load"))
            .with_path(Path::Spatial);
        let number = |value: &Value| value.as_f64().expect("a number");
        let touches = case["touches"].as_array().expect("touches");
        let surfaces = |thicker: f64| -> Vec<Surface> {
            let sphere = |touch: &Value| {
                let centre = Vector3::from(numbers(&touch["centre"]));
                let sphere = Obstacle::sphere(centre, number(&case["radius"]), false);
                let offset = number(&case["offset"]) + thicker;
                Surface::new(sphere.expect("a sphere"), offset).expect("a surface")
            };
            touches.iter().map(sphere).collect()
        };
        let base = Vector6::from(numbers::<6>(&case["base"]));
        let guess = ContactGuess {
            base: base * 1.01,
            touches: (touches.iter().enumerate())
                .map(|(k, touch)| GuessedTouch {
                    surface: k,
                    s: Some(number(&touch["s"]) + 0.003),
                    reaction: 0.98 * number(&touch["reaction"]),
                    length: 0.0,
                })
                .collect(),
        };
        let solve = |thicker: f64| {
            let found = among(problem.clone(), surfaces(thicker)).solve(Some(&guess));
            found.expect("an equilibrium")
        };
        let found = solve(0.0);
        for i in 0..6 {
            near("base wrench", found.base[i], base[i], 1e-9);
        }
        for (touch, expected) in found.touches.iter().zip(touches) {
            near("place", touch.s, number(&expected["s"]), 1e-10);
            near(
                "reaction",
                touch.reaction,
                number(&expected["reaction"]),
                1e-9,
            );
            near(
                "h''",
                touch.relative_curvature,
                number(&expected["relative_curvature"]),
                1e-9,
            );
            let normal = Vector3::from(numbers(&expected["normal"]));
            near("normal", (touch.normal - normal).norm(), 0.0, 1e-9);
        }
        let compliance = &found.compliance;
        let size = compliance.norm();
        assert!(
            (compliance - compliance.transpose()).norm() < 1e-9 * size,
            "{compliance}"
        );
        // All surfaces grow by h: the gaps shrink by h, and C dR = h.
        let h = 1e-5;
        let reactions = |thicker: f64| {
            let reactions: Vec<f64> = solve(thicker).touches.iter().map(|t| t.reaction).collect();
            nalgebra::DVector::from_vec(reactions)
        };
        let rate = (reactions(2.0 * h) - reactions(0.0)) / (2.0 * h);
        let middle = solve(h).compliance;
        for opened in (middle * rate).iter() {
            near("C dR/dh", *opened, 1.0, 1e-6);
        }
    }
}

/// Catches a factor of units or a turn that is missing: a rod of another length and stiffness, clamped elsewhere and
/// turned, has the same equilibrium in its own units.
#[test]
fn units_and_the_place_of_the_clamp_do_not_matter() {
    let solve = |length: f64, stiffness: f64, place: Vector3<f64>, turn: UnitQuaternion<f64>| {
        let bending = [stiffness, 1.4 * stiffness];
        let law = Linear::diagonal(bending, 0.8 * stiffness).expect("a law");
        let force = stiffness / (length * length);
        let load = turn * Vector3::new(-4.0, 1.0, 0.5) * force;
        let rod = Rod::new(length, law)
            .expect("a rod")
            .with_clamp(place, turn);
        let end = EndConditions::load(load, Vector3::zeros());
        let weight =
            DistributedLoad::constant(turn * Vector3::new(-1.0, 2.0, -1.0) * force / length);
        let problem = Problem::new(rod, end, 1e-13).expect("a problem");
        let problem = problem.with_distributed(&weight.expect("a load"));
        let centre = place + turn * Vector3::new(-0.13, 0.02, 0.55) * length;
        let axis = turn * Vector3::new(0.1, 1.0, 0.2);
        let bar = Obstacle::cylinder(centre, axis, 0.1 * length, false).expect("a cylinder");
        let surface = Surface::new(bar, 0.01 * length).expect("a surface");
        among(problem, vec![surface])
            .solve(None)
            .expect("an equilibrium")
    };
    let one = solve(1.0, 1.0, Vector3::zeros(), UnitQuaternion::identity());
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
    let place = Vector3::new(3.0, -1.0, 2.0);
    let (length, stiffness) = (2.5, 7.0);
    let other = solve(length, stiffness, place, turn);
    let (a, b) = (&one.touches[0], &other.touches[0]);
    near("place", b.s / length, a.s, 1e-9);
    near(
        "reaction",
        b.reaction * length * length / stiffness,
        a.reaction,
        1e-9,
    );
    near(
        "curvature",
        b.relative_curvature * length,
        a.relative_curvature,
        1e-9,
    );
    near("normal", (b.normal - turn * a.normal).norm(), 0.0, 1e-9);
    near(
        "position",
        (b.position - place - turn * a.position * length).norm(),
        0.0,
        1e-9,
    );
    let scale = stiffness / length.powi(3);
    near(
        "compliance",
        other.compliance[(0, 0)] * scale * 1e3,
        one.compliance[(0, 0)] * 1e3,
        1e-8,
    );
    near(
        "energy",
        other.end.energy * length / stiffness,
        one.end.energy,
        1e-9,
    );
    assert_eq!((one.index, other.index), (Some(0), Some(0)));
}

/// A round rod clamped along z and guided there, pushed at its middle by a sphere whose centre is `aside` of the axis.
fn pushed(aside: f64, height: f64) -> ContactProblem {
    let end = EndConditions {
        position: [Some(0.0), Some(0.0), None],
        orientation: Some(UnitQuaternion::identity()),
        ..EndConditions::load(Vector3::zeros(), Vector3::zeros())
    };
    let rod = Rod::new(1.0, law()).expect("a rod");
    let problem = Problem::new(rod, end, 1e-13)
        .expect("a problem")
        .with_path(Path::Spatial);
    let centre = Vector3::new(0.6 * aside, -0.8 * aside, height);
    let sphere = Obstacle::sphere(centre, 0.1, false).expect("a sphere");
    among(
        problem,
        vec![Surface::new(sphere, 0.02).expect("a surface")],
    )
}

/// Catches a missing term -R eta.H eta: the rod slips off a sphere whose centre has passed its axis, and is neutral
/// where it lies on the axis. The force at the offset 0.05 is an elliptic integral.
#[test]
fn sphere_pushes_a_rod_until_it_slips_off() {
    // The middle of the rod comes nearer to the clamp by half of what the guided end does.
    let height = 0.5 * (1.0 - 0.01184003747853);
    let found = pushed(0.05, height).solve(None).expect("an equilibrium");
    near(
        "twice the height",
        found.end.position.z,
        2.0 * height,
        1e-11,
    );
    let touch = &found.touches[0];
    near("reaction", touch.reaction, 13.717276133014664, 1e-9);
    near(
        "direction",
        (touch.normal - Vector3::new(-0.6, 0.8, 0.0)).norm(),
        0.0,
        1e-9,
    );
    assert_eq!((found.index, found.neutral), (Some(0), 0));
    let mut last = pushed(0.001, 0.48).solve(None).expect("an equilibrium");
    for (aside, index, neutral) in [(1e-4, 0, 0), (0.0, 0, 1), (-1e-3, 1, 0)] {
        last = pushed(aside, 0.48)
            .solve(Some(&guess_of(&last)))
            .expect("an equilibrium");
        assert_eq!(
            (last.index, last.neutral),
            (Some(index), neutral),
            "at {aside}"
        );
    }
}

/// Catches a touch that is missed between two sections: pegs a ten-thousandth thick, anywhere along a straight rod
/// that takes a handful of steps of integration, and deep by a hundredth of that.
#[test]
fn no_thin_peg_is_missed() {
    let none = EndConditions::load(Vector3::zeros(), Vector3::zeros());
    let problem = Problem::new(along_x(), none, 1e-12).expect("a problem");
    for k in 1..40 {
        let x = 0.1 + 0.85 * (f64::from(k) * 0.618_033_988_749_895).fract();
        let centre = Vector2::new(x, 0.99e-4);
        let peg = Obstacle::disc(centre, 1e-4, false).expect("a disc");
        let problem = among(
            problem.clone(),
            vec![Surface::new(peg, 0.0).expect("a surface")],
        );
        let found = problem.solve(None).expect("an equilibrium");
        let [touch] = found.touches[..] else {
            panic!("the peg at {x} is missed: {:?}", found.touches)
        };
        near("place", touch.s, x, 1e-5);
        // Linear beam: R x^3/3 = depth.
        near(
            "reaction",
            touch.reaction * x.powi(3) / 3.0 / 1e-6,
            1.0,
            1e-3,
        );
    }
}

/// Catches a path that does not turn back where a touch is met on an unstable sheet. An arch under a growing load goes
/// over its fold, and meets a disc while the load falls: the load must grow again, and the index fall by one.
#[test]
fn corner_folds_on_the_way_over_an_arch() {
    let turn = along_x().clamp_pose().rotation;
    let at = |load: f64| {
        let end = EndConditions {
            position: [Some(0.97), None, Some(0.0)],
            orientation: Some(turn),
            force: Vector3::new(0.0, -load, 0.0),
            ..EndConditions::load(Vector3::zeros(), Vector3::zeros())
        };
        let problem = Problem::new(along_x(), end, 1e-13)?.with_path(Path::Planar);
        let disc = Obstacle::disc(Vector2::new(0.75, 0.0), 0.05, false)?;
        ContactProblem::new(
            problem,
            vec![Surface::new(disc, 0.01)?],
            ContactOptions::default(),
        )
    };
    let mut base = at(0.0)
        .and_then(|p| p.problem().solve(None))
        .expect("an arch")
        .base;
    // Upwards.
    if base[2] < 0.0 {
        (base[2], base[4]) = (-base[2], -base[4]);
    }
    let start = ContactGuess {
        base,
        touches: Vec::new(),
    };
    let range = Options {
        max_step: 2.0,
        tolerance: 1e-11,
        max_points: 46,
        ..Options::between(0.0, 30.0)
    };
    let branch = ContactBranch::follow(at, &start, 0.0, range).expect("a branch");
    let kinds: Vec<_> = branch
        .events
        .iter()
        .map(|event| event.kind)
        .take(4)
        .collect();
    use ContactEventKind::{BranchPoint, Corner, Fold, Touch};
    assert_eq!(kinds, [BranchPoint, Fold, Touch, Corner]);
    let corner = &branch.events[3];
    assert_eq!(corner.index, (Some(2), Some(1)));
    let beyond = branch
        .points
        .iter()
        .skip_while(|point| point.equilibrium.touches.is_empty());
    let beyond: Vec<_> = beyond.take(5).collect();
    assert!(beyond.windows(2).all(|pair| pair[0].p < pair[1].p));
    assert!(
        beyond
            .iter()
            .all(|point| point.equilibrium.touches[0].reaction > 0.0)
    );
}

/// Catches bad data without a message, and messages without advice.
#[test]
fn refusals_name_their_reason() {
    let none = EndConditions::load(Vector3::zeros(), Vector3::zeros());
    let problem = |rod: Rod, end: EndConditions| Problem::new(rod, end, 1e-12).expect("a problem");
    let refused = |problem: Problem, surfaces: Vec<Surface>| -> Error {
        ContactProblem::new(problem, surfaces, ContactOptions::default()).expect_err("a refusal")
    };
    let says = |why: &Error, words: &str| {
        assert!(why.is_domain() && why.to_string().contains(words), "{why}");
    };
    let ground = Obstacle::plane(Vector3::zeros(), Vector3::y()).expect("a plane");
    let sharp = Obstacle::cuboid(
        Vector3::z(),
        Vector3::repeat(0.1),
        nalgebra::Rotation3::identity(),
    );
    says(
        &Surface::new(sharp.expect("a box"), 0.0).expect_err("an edge"),
        "sharp edge",
    );
    for offset in [-1e-3, f64::NAN, f64::INFINITY] {
        says(
            &Surface::new(ground.clone(), offset).expect_err("an offset"),
            "offset",
        );
    }
    // The clamp below the floor by half of the rod's thickness.
    let thick = Surface::new(ground, 0.01).expect("a surface");
    says(
        &refused(problem(along_x(), none), vec![thick]),
        "the clamp lies inside obstacle 1, by 1.0",
    );
    let shearing = law().with_shear([50.0, 50.0]).expect("a law");
    let shearing = problem(Rod::new(1.0, shearing).expect("a rod"), none);
    says(&refused(shearing, vec![plane(-1.0, 1.0)]), "shear");
    let follows = EndConditions::follower(Vector3::x(), Vector3::zeros());
    says(
        &refused(problem(along_x(), follows), vec![plane(-1.0, 1.0)]),
        "follower",
    );
    let ball = EndConditions::ball(Vector3::new(0.9, -0.2, 0.0));
    let why = refused(problem(along_x(), ball), vec![plane(-0.1, 1.0)]);
    says(&why, "the held end lies inside obstacle 1, by 1.0");
    let pull = EndConditions {
        position: [Some(0.0), Some(0.0), None],
        ..EndConditions::load(Vector3::new(0.0, 0.0, 1000.0), Vector3::zeros())
    };
    let sphere = Obstacle::sphere(Vector3::new(0.05, 0.0, 0.4), 0.1, false).expect("a sphere");
    let sphere = Surface::new(sphere, 0.0).expect("a surface");
    let taut = among(
        problem(Rod::new(1.0, law()).expect("a rod"), pull),
        vec![sphere],
    );
    let why = taut.solve(None).expect_err("a rod that is pulled too hard");
    assert!(why.to_string().contains("lam"), "{why}");
}
