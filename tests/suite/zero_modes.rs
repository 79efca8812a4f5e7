//! Isotropic rods that turn about their clamp for nothing: the zero mode is told, and left out of the index
//! (`tools/ref_wire.py`). Heavy rods along branches in their load.

use crate::support::{assert_close, json, number, rows};
use nalgebra::{UnitQuaternion, Vector3};
use snaprod::rod::{DistributedLoad, EndConditions, Path, Problem, Rod, RodFamily, Wrench};
use snaprod::scene::Scene;
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options};
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{BranchRecord, Silent, branch, equilibrium};

fn wire(bending: [f64; 2], torsion: f64, (from, to): (f64, f64)) -> BranchRecord {
    let [a, b] = bending;
    let scene = format!(
        r#"
        [rod]
        model = "cosserat"
        length = 1.0
        section = {{ bending = [{a}, {b}], torsion = {torsion} }}
        [end]
        position = [0.0, 0.0, {from}]
        rotation = {{ axis = [0, 0, 1], angle = 0.0 }}
        [solve]
        path = "planar"
        [continue]
        parameter = "end.position.z"
        to = {to}
        max_step = 0.05
        "#
    );
    branch(&Scene::parse(&scene).unwrap(), &mut Silent).unwrap()
}

/// Catches a zero mode that is counted, or that flickers with rounding: a wire pushed together between coaxial clamps
/// has one branch point out of its plane, whatever its torsion. Where both clamps meet, the closed wire slides through
/// itself, a branch point in the plane.
#[test]
fn a_wire_between_coaxial_clamps_has_one_branch_point_out_of_its_plane() {
    let data = json("rod_wire.json");
    for case in rows(&data, "cases", 6) {
        assert!(number(case, "uncertainty") < 1e-10, "{case}");
        let torsion = number(case, "torsion");
        let whole = torsion == 0.8;
        let range = if whole { (0.99, -0.5) } else { (0.6, 0.1) };
        let nearly = [1.0, 1.0 + 1e-9];
        let laws = if whole {
            vec![[1.0; 2], nearly]
        } else {
            vec![[1.0; 2]]
        };
        for bending in laws {
            let found = wire(bending, torsion, range);
            let specials = &found.branches.specials;
            assert_eq!(
                specials.len(),
                1 + usize::from(whole),
                "{case}: {specials:?}"
            );
            assert_close(specials[0].parameter, number(case, "z"), 1e-9, 1.0, "z");
            assert_eq!(specials[0].index, [Some(0), Some(1)], "{case}");
            if whole {
                assert_close(specials[1].parameter, 0.0, 1e-9, 1.0, "clamps that meet");
                assert_eq!(specials[1].index, [Some(1), Some(2)]);
            }
            let told = found
                .remarks
                .iter()
                .any(|remark| remark.contains("for nothing"));
            assert_eq!(told, bending == [1.0; 2], "{:?}", found.remarks);
        }
    }
}

/// The wire between coaxial clamps as an assembly without bodies, alone and beside a rod that turns with its body.
/// Catches a spin whose equations stay singular, for no body balances the rod: the branch was refused at its start.
#[test]
fn a_wire_of_an_assembly_without_bodies_has_its_branch_point() {
    let data = json("rod_wire.json");
    let cases = rows(&data, "cases", 6);
    let case = cases.iter().find(|case| number(case, "torsion") == 0.8);
    let place = number(case.unwrap(), "z");
    let rod = |name: &str, from: &str, to: &str, length: f64| {
        format!(
            r#"
            [[rod]]
            name = "{name}"
            model = "cosserat"
            length = {length}
            section = {{ bending = [1.0, 1.0], torsion = 0.8 }}
            from = {{ {from} }}
            to = {{ {to} }}
            "#
        )
    };
    let at = |z: f64| format!("position = [0.0, 0.0, {z}]");
    let middle = r#"body = "middle""#;
    let alone = rod("wire", &at(0.0), &at(0.9), 1.0);
    let beside = [
        rod("left", &at(3.0), middle, 0.5),
        rod("right", middle, &at(3.9), 0.5),
    ];
    let body = "[[body]]\nname = \"middle\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n";
    let continued = "[continue]\nparameter = \"rod.wire.to.position.z\"\nto = 0.1\n";
    let scenes = [
        format!("{alone}{continued}"),
        format!("{alone}{}{body}{continued}", beside.concat()),
    ];
    for scene in &scenes {
        let found = branch(&Scene::parse(scene).unwrap(), &mut Silent).unwrap();
        let specials = &found.branches.specials;
        assert_eq!(specials.len(), 1, "{specials:?}");
        assert_close(specials[0].parameter, place, 1e-9, 1.0, "z");
        assert_eq!(specials[0].index, [Some(0), Some(1)]);
        assert!(found.remarks.iter().any(|told| told.contains("spins")));
    }
}

/// Catches a free turn that counts as unstable: a hose of any weight hangs over an exactly upright clamp, and turns
/// about the vertical. On a clamp that leans it does not.
#[test]
fn a_hose_on_an_upright_clamp_turns_for_nothing() {
    for (weight, lean) in [(1e3, 0.0), (3e5, 0.0), (1e7, 0.0), (3e5, 0.1)] {
        let law = Linear::diagonal([1.0, 1.0], 0.8).unwrap();
        let clamp = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean);
        let rod = Rod::new(1.0, law)
            .unwrap()
            .with_clamp(Vector3::zeros(), clamp);
        let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        let load = DistributedLoad::constant(Vector3::z() * -weight).unwrap();
        let problem = Problem::new(rod, free, 1e-10)
            .unwrap()
            .with_distributed(&load);
        let found = problem.solve(None).unwrap();
        assert_eq!(found.index, 0, "{weight}");
        assert!(found.end.position.z < -0.9, "{weight}");
        let told = problem.zero_modes(&found.base);
        assert_eq!(told.len(), usize::from(lean == 0.0), "{weight}, {lean}");
        for mode in told {
            assert_close((mode.axis - Vector3::z()).norm(), 0.0, 1e-12, 1.0, "axis");
        }
    }
}

/// Catches a branch in the load of a heavy rod that creeps, or that another chart ends: from 1 % of the weight to all
/// of it and back, its last point the equilibrium.
#[test]
#[ignore = "second tier: 4 s"]
fn branches_in_the_load_of_a_heavy_rod_reach_its_end() {
    for (from, to) in [(0.01, 1.0), (1.0, 0.01)] {
        let scene = |load: f64| {
            format!(
                r#"
                units = "si"
                [rod]
                model = "cosserat"
                length = 1.2
                material = {{ E = 2e6, nu = 0.49, density = 1100 }}
                section = {{ tube = {{ diameter = 0.010, thickness = 0.002 }} }}
                [clamp]
                rotation = {{ axis = [0, 1, 0], angle_degrees = 90 }}
                [end]
                position = [0.8, 0.0, 0.2]
                [loads]
                gravity = [0.0, 0.0, -9.81]
                load = {load}
                "#
            )
        };
        let follow = "[continue]\nparameter = \"loads.load\"\n";
        let task = format!("{}{follow}to = {to}\n", scene(from));
        let found = branch(&Scene::parse(&task).unwrap(), &mut Silent).unwrap();
        let curve = &found.branches.curves[0];
        assert!(curve.complete, "{curve:?}");
        assert!(
            found.branches.specials.is_empty(),
            "{:?}",
            found.branches.specials
        );
        let at = |name: &str| found.branches.points.reals(name);
        let loads = at("parameter");
        assert!(loads.len() < 100, "{} points", loads.len());
        let last = loads.len() - 1;
        assert_eq!(loads[last], to);
        let rest = equilibrium(&Scene::parse(&scene(to)).unwrap()).unwrap();
        for (name, value) in [
            ("base_my", rest.found.base[1]),
            ("base_fx", rest.found.base[3]),
            ("base_fz", rest.found.base[5]),
        ] {
            assert_close(at(name)[last], value, 1e-9, 0.01, name);
        }
    }
}

/// Catches equations in space without a phase: the branch of the wire between coaxial clamps as six equations, its
/// plane turned to no axis of the data. They are singular at the two branch points alone, and the plane stays.
#[test]
fn a_branch_in_space_keeps_the_phase_of_its_free_turn() {
    let held = |z: f64| {
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 0.8)?)?;
        let end = EndConditions::pose(Vector3::new(0.0, 0.0, z), UnitQuaternion::identity());
        Problem::new(rod, end, 1e-12)
    };
    let start = held(0.9).unwrap().with_path(Path::Planar).solve(None);
    let base = start.unwrap().base;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
    let [m, n] = [0, 3].map(|row| turn * base.fixed_rows::<3>(row).into_owned());
    let family = RodFamily::new(held, false, 1.4);
    let x = family.unknowns(&Wrench::new(m.x, m.y, m.z, n.x, n.y, n.z), 0.9);
    let options = Options {
        max_step: 0.5,
        weight: 10.0,
        ..Options::between(0.95, -0.5)
    };
    let trace = Continuation::new(&family, x.unwrap(), 0.9, options)
        .unwrap()
        .trace();
    let found = trace.specials.iter();
    let found: Vec<_> = found.map(|at| (at.kind, at.point.p, at.index)).collect();
    let data = json("rod_wire.json");
    let case = rows(&data, "cases", 6)
        .iter()
        .find(|case| number(case, "torsion") == 0.8)
        .unwrap();
    let [(first, z, out), (second, closed, within)] = found[..] else {
        panic!("{found:?}");
    };
    assert_eq!([first, second], [SpecialKind::BranchPoint; 2]);
    assert_close(z, number(case, "z"), 1e-11, 0.0, "z");
    assert_close(closed, 0.0, 1e-11, 1.0, "clamps that meet");
    assert_eq!([out, within], [(Some(0), Some(1)), (Some(1), Some(2))]);
    let last = trace.points.last().unwrap();
    assert_eq!(last.p, -0.5);
    let phase = |m: &[f64]| m[1].atan2(m[0]);
    let turned = (phase(last.x.as_slice()) - phase(m.as_slice())).sin();
    assert_close(turned, 0.0, 1e-8, 1.0, "phase");
}

/// Catches a branch of a twisted wire, which no plane contains, that creeps or drifts round the axis: one clamp turns
/// by more than half a turn. The work of its couple is the gain of energy.
#[test]
fn a_wire_between_coaxial_clamps_is_twisted_in_space() {
    let text = r#"
        [rod]
        model = "cosserat"
        length = 1.0
        section = { bending = [1.0, 1.0], torsion = 0.8 }
        [end]
        position = [0.0, 0.0, 0.6]
        rotation = { axis = [0, 0, 1], angle = 0.0 }
        [continue]
        parameter = "end.rotation.angle"
        to = 4.0
        max_step = 0.1
        points = 500
        "#;
    let found = branch(&Scene::parse(text).unwrap(), &mut Silent).unwrap();
    assert!(
        found.branches.curves[0].complete,
        "{:?}",
        found.branches.curves
    );
    assert!(
        found.branches.specials.is_empty(),
        "{:?}",
        found.branches.specials
    );
    let told = |remark: &String| remark.contains("for nothing");
    assert!(found.remarks.iter().any(told), "{:?}", found.remarks);
    let [angle, couple, energy] =
        ["parameter", "tip_mz", "energy"].map(|name| found.branches.points.reals(name));
    let pairs = angle.windows(2).zip(couple.windows(2));
    let work: f64 = pairs
        .map(|(a, m)| 0.5 * (m[0] + m[1]) * (a[1] - a[0]))
        .sum();
    let gain = energy.last().unwrap() - energy[0];
    assert_close(work, gain, 1e-3, 1.0, "work of the clamp");
}

/// Catches a branch that is lost where a round column buckles: both ways along one member of the family of planes are
/// followed. The end under P = 3 is 2 k/sqrt(P) aside, K(k) = sqrt(P) (known).
#[test]
fn a_round_column_buckles_to_one_plane_of_its_family() {
    let text = r#"
        [rod]
        model = "cosserat"
        length = 1.0
        section = { bending = [1.0, 1.0], torsion = 0.8 }
        [end]
        force = [0.0, 0.0, -1.0]
        [continue]
        parameter = "end.load"
        from = 0.0
        to = 3.0
        switch = true
        "#;
    let found = branch(&Scene::parse(text).unwrap(), &mut Silent).unwrap();
    assert!(found.is_complete(), "{:?}", found.lost);
    let [p, x, y] = ["parameter", "x", "y"].map(|name| found.branches.points.reals(name));
    let aside: Vec<f64> = (0..p.len())
        .filter(|k| p[*k] == 3.0)
        .map(|k| x[k].hypot(y[k]))
        .filter(|aside| *aside > 0.1)
        .collect();
    assert_eq!(aside.len(), 2, "{:?}", found.branches.curves);
    // K(k) = pi/2 over the arithmetic-geometric mean of 1 and sqrt(1 - k^2).
    let complete = |k: f64| {
        let (mut a, mut b) = (1.0_f64, (1.0 - k * k).sqrt());
        for _ in 0..30 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        std::f64::consts::FRAC_PI_2 / a
    };
    let (mut low, mut high) = (0.0, 0.99);
    for _ in 0..60 {
        let k = 0.5 * (low + high);
        if complete(k) < 3.0_f64.sqrt() {
            low = k;
        } else {
            high = k;
        }
    }
    for there in aside {
        assert_close(there, 2.0 * low / 3.0_f64.sqrt(), 1e-9, 0.0, "aside");
    }
}

/// A rod of an assembly from one ball joint on the ground to another.
fn between_balls(bending: &str, end: &str, more: &str) -> Scene {
    let scene = format!(
        r#"
        [[rod]]
        name = "a"
        model = "cosserat"
        length = 1.0
        section = {{ bending = {bending}, torsion = 0.8 }}
        from = {{ joint = "ball" }}
        to = {{ position = {end}, joint = "ball" }}
        {more}
        "#
    );
    Scene::parse(&scene).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Catches a motion of an assembly that costs nothing and is not told, is told of a scene without the symmetry, or is
/// counted by the index.
#[test]
fn assemblies_tell_their_zero_modes() {
    let spin = "rod \"a\" spins about its own centreline for nothing";
    let turn = "the assembly turns for nothing about the axis (0, 0, 1) through (0, 0, 0)";
    let heavy = "mass = 400.0\n[loads]\ngravity = [0.0, 0.0, -1.0]";
    let hose = Scene::parse(
        r#"
        [[rod]]
        name = "a"
        model = "cosserat"
        length = 1.0
        mass = 500.0
        section = { bending = [1.0, 1.0], torsion = 0.8 }
        from = { position = [0.0, 0.0, 0.0] }
        to = { body = "m" }
        [loads]
        gravity = [0.0, 0.0, -1.0]
        [[body]]
        name = "m"
        "#,
    );
    let cases = [
        (
            between_balls("[1.0, 1.0]", "[0.0, 0.0, 0.5]", ""),
            vec![spin, turn],
        ),
        (
            between_balls("[1.0, 2.0]", "[0.0, 0.0, 0.5]", ""),
            vec![turn],
        ),
        (
            between_balls("[1.0, 1.0]", "[0.8, 0.0, 0.2]", heavy),
            vec![spin],
        ),
        (
            between_balls("[1.0, 2.0]", "[0.8, 0.0, 0.2]", heavy),
            vec![],
        ),
        (hose.unwrap_or_else(|faults| panic!("{faults}")), vec![turn]),
    ];
    for (scene, expected) in cases {
        let found = snaprod::study::assembly::equilibrium(&scene).expect("an equilibrium");
        assert_eq!(found.zero_modes, expected);
        assert_eq!(found.index, 0);
    }
}

/// Catches a branch that cannot begin, or stops, because the rod turns about its chord and spins for nothing. Closed
/// form: distance/L = 2 E/K - 1 and P = 4 K^2 B/L^2, by mpmath.
#[test]
fn a_rod_between_ball_joints_is_pushed_together_in_space() {
    let path = "[continue]\nparameter = \"rod.a.to.position.z\"\nto = -0.55\nat = [0.5, -0.5]";
    let scene = between_balls("[1.0, 1.0]", "[0.0, 0.0, 0.9]", path);
    let found = branch(&scene, &mut Silent).expect("a branch");
    assert!(found.is_complete(), "{:?}", found.branches.curves);
    let points = &found.branches.points;
    for (z, push) in [(0.5, 13.31852814906083), (-0.5, 65.14533265517706)] {
        let row = points.reals("parameter").iter().position(|at| *at == z);
        let row = row.expect("a point at this distance");
        let [x, y, z] = ["a.base_fx", "a.base_fy", "a.base_fz"].map(|name| points.reals(name)[row]);
        assert_close(z, -push, 1e-9, 1.0, "push");
        assert_close(x.hypot(y), 0.0, 1e-7, 1.0, "force across");
    }
    let told = |remark: &String| remark.contains("spins about its own centreline");
    assert!(found.remarks.iter().any(told), "{:?}", found.remarks);
}

/// Catches a slide along frictionless rails that makes special points, or hides them. A column between two sliders
/// across it sways at P (1 - P/EA) = pi^2 EI/L^2, at the distance 1 - P/EA of its ends.
#[test]
fn a_column_between_rails_sways_at_its_critical_load() {
    let axial = 200.0_f64;
    let slider = "joint = \"slider\", axis = [1.0, 0.0, 0.0]";
    let text = format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\n\
         section = {{ bending = [5.0, 1.0], torsion = 0.8, axial = {axial:?} }}\nfrom = {{ {slider} }}\n\
         to = {{ position = [0.0, 0.0, 1.0], {slider} }}\n\
         [continue]\nparameter = \"rod.a.to.position.z\"\nto = 0.9\n"
    );
    let load = (axial - (axial * (axial - 4.0 * std::f64::consts::PI.powi(2))).sqrt()) / 2.0;
    let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let found = branch(&scene, &mut Silent).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let specials = &found.branches.specials;
    assert_eq!(specials.len(), 1, "{specials:?}");
    assert_close(
        specials[0].parameter,
        1.0 - load / axial,
        1e-10,
        1.0,
        "sway",
    );
    assert_eq!(specials[0].index, [Some(0), Some(1)]);
}
