//! Equivalence of cheap computation paths with the general one, on scenes that both can run.

use super::pairs::{end, pairs};
use snaprod::scene::Scene;
use snaprod::study::plan;

/// Largest accepted distance of end positions, in lengths: the bound of the runs' own error.
const WITHIN: f64 = 1e-9;

/// Would catch a cheap path that is another model: a closed form that differs from its integration, a planar model
/// that differs from the spatial one.
#[test]
#[ignore = "second tier: 13 s"]
fn cheap_paths_are_the_general_ones() {
    for pair in pairs() {
        let (cheap, general) = (end(&pair.cheap).0, end(&pair.general).0);
        let apart = (cheap - general).norm();
        assert!(cheap.norm() > 0.1, "{}: {cheap}", pair.leaves_out);
        assert!(apart <= WITHIN, "{}: {apart:.1e} apart", pair.leaves_out);
    }
}

/// Would catch a plan whose counts of numbers differ from those of the motion, or are missing for some scene.
#[test]
fn plans_of_all_scenes() {
    // By hand: a chart, a velocity and three integrals; two rods, a point and three integrals; 300 cells; a wrench;
    // two rods and a rigid body.
    let sizes = [
        ("snap", 7),
        ("wire", 21),
        ("pulse", 600),
        ("lateral", 6),
        ("arch", 18),
    ];
    for entry in std::fs::read_dir("scenes").unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let scene = Scene::read(&path).unwrap();
        let plan = plan(&scene, 0.0).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert!(
            plan.size() > 0 && !plan.left_out.is_empty() && plan.trial.is_none(),
            "{name}"
        );
        if let Some((_, size)) = sizes.iter().find(|(known, _)| *known == name) {
            assert_eq!(plan.size(), *size, "{name}");
        }
        let said = plan.text();
        assert!(
            plan.left_out.iter().all(|part| said.contains(&part.why)),
            "{name}"
        );
    }
}

/// Would catch a trial run that differs from the run. For a short scene the trial is the whole run, with its work; for
/// a long one the steps per time predict the whole.
#[test]
fn trials_are_runs() {
    let pair = &pairs()[0];
    let scene = Scene::parse(&pair.cheap).unwrap();
    let trial = plan(&scene, 60.0).unwrap().trial.unwrap();
    assert_eq!(trial.fraction, 1.0);
    assert_eq!(trial.work.unwrap()[1], end(&pair.cheap).1);
    assert_eq!(trial.expected(), Some(trial.seconds));
    let long = pair.cheap.replace("duration = 2", "duration = 2000000");
    let trial = plan(&Scene::parse(&long).unwrap(), 0.05)
        .unwrap()
        .trial
        .unwrap();
    assert!(trial.fraction < 1.0 && trial.reason.is_none());
    let expected = trial.expected().unwrap();
    assert!(expected > 10.0 * trial.seconds && expected.is_finite());
}
