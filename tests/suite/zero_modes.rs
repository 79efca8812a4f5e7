//! Isotropic rods that turn about their clamp for nothing: the zero mode is told, and left out of the index
//! (`tools/ref_wire.py`). Heavy rods along branches in their load.

use crate::support::{assert_close, json, number, rows};
use nalgebra::{UnitQuaternion, Vector3};
use snaprod::rod::{DistributedLoad, EndConditions, Problem, Rod};
use snaprod::scene::Scene;
use snaprod::section::Linear;
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
