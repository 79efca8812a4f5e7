//! Energy that the mass of a rod takes from a taut bounce, against the number reported by runs (theory 2.8).

use snaprod::elastica::equilibria_at;
use snaprod::scene::Scene;
use snaprod::study::{Silent, Table, run};

/// A mass thrown outwards by a bent rod and reversed by the pull at lambda = 29.
const THROWN: &str = "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\nmass = 1e-3\ninertia = \"none\"\n[body]\nmass = 1.0\n\
                      [start]\nlambda = 2.0\nkappa = 0.3\nvelocity = [1.0, 2.0]\n[run]\nduration = 0.05\n";

fn prepared(set: &[String]) -> run::Prepared {
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    run::Prepared::new(&Scene::parse_with(THROWN, &set).unwrap()).unwrap()
}

/// Largest excess of the full rod's energy, over the given times, above the equilibrium with the same end position:
/// the stored energy of vibrations of the held rod, and of slow bending by the rod's own mass.
fn rings(eps: f64, times: &[f64]) -> Vec<f64> {
    let full = prepared(&[
        "rod.inertia=\"full\"".to_owned(),
        format!("rod.mass={eps:e}"),
        "rod.nodes=32".to_owned(),
        "rod.damping={ proportional = 1e-5 }".to_owned(),
        "run.tolerance=1e-5".to_owned(),
    ]);
    let table = run::samples(&full, times, &mut Silent).unwrap();
    let [x, y, stored] = ["x", "y", "elastic"].map(|name| table.reals(name));
    let beyond = (0..times.len()).map(|k| {
        let found = equilibria_at(x[k], y[k], 14.0).unwrap();
        let stable = found.iter().filter(|at| at.stable());
        let each = stable.map(|at| stored[k] - at.equilibrium.energy);
        each.fold(f64::INFINITY, |a, b| if b.abs() < a.abs() { b } else { a })
    });
    beyond.collect()
}

/// Catches a wrong number of the rod's mass. Below 1 a bounce excites no vibrations, at 2 a thousandth of its energy,
/// at 4 a hundredth, at 9 a third; never more than 4e-3 number^4/lambda (docs/validation/mass.md). Before the bounce
/// there are almost none.
#[test]
fn a_bounce_leaves_vibrations_as_its_number_says() {
    let light = prepared(&[]);
    let mut tables: Vec<Table> = Vec::new();
    let light = run::run(&light, run::Fields::None, &mut tables, &mut Silent).unwrap();
    let light = light.summary();
    let bounce = |path: &str| light.pointer(path).and_then(|x| x.as_f64()).unwrap();
    let [t, energy, lambda] =
        ["t", "elastic", "lam"].map(|name| bounce(&format!("/bounces/first/0/{name}")));
    let unit = bounce("/validity/bounces/0/inertia_number") / 1e-3_f64.sqrt();
    // Slack intervals: up to two thirds of the time to the bounce, and as long after it.
    let places =
        |from: f64, to: f64| (0..20).map(move |k| (from + (to - from) * f64::from(k) / 19.0) * t);
    let times: Vec<f64> = places(0.1, 0.65).chain(places(1.4, 2.5)).collect();
    for (eps, [least, most]) in [
        (1e-3, [0.0, 1e-5]),
        (5e-3, [5e-4, 1.5e-3]),
        (2e-2, [0.01, 0.03]),
        (0.1, [0.3, 0.45]),
    ] {
        let number = unit * f64::sqrt(eps);
        let found = rings(eps, &times);
        let [before, after] = [&found[..20], &found[20..]]
            .map(|part| part.iter().fold(0.0, |most: f64, x| most.max(*x)) / energy);
        assert!((least..most).contains(&after), "{number}: {after:e}");
        assert!(
            before < 0.07 * after.max(1e-4),
            "{number}: {before:e}, then {after:e}"
        );
        let bound = 4e-3 * number.powi(4) / lambda;
        assert!(
            eps > 0.05 || after < bound,
            "{number}: {after:e} > {bound:e}"
        );
    }
}

/// Position at the time `t` of the end, thrown so fast that the rod reverses it at lambda = 53.
fn end(inertia: &str, t: f64) -> [f64; 2] {
    let mut set = vec![
        "start.velocity=[1.4, 2.8]".to_owned(),
        "rod.mass=0.01".to_owned(),
        "run.duration=0.2".to_owned(),
        format!("rod.inertia=\"{inertia}\""),
    ];
    if inertia == "full" {
        set.push("rod.nodes=24".to_owned());
        set.push("rod.damping={ proportional = 1e-6 }".to_owned());
        set.push("run.tolerance=1e-5".to_owned());
    }
    let table = run::samples(&prepared(&set), &[t], &mut Silent).unwrap();
    ["x", "y"].map(|name| table.reals(name)[0])
}

/// Catches a mass switched off or wrong on the taut rod. After a hard bounce with the number 3.7 the end differs from
/// that of the full rod by a tenth of the difference without mass.
#[test]
fn the_mass_to_first_order_counts_in_a_hard_bounce() {
    let [none, first, full] = ["none", "first-order", "full"].map(|inertia| end(inertia, 0.2));
    let off = |of: [f64; 2]| (of[0] - full[0]).hypot(of[1] - full[1]);
    assert!(off(first) < 1.2e-3, "{:e}", off(first));
    assert!(
        off(none) > 5.0 * off(first),
        "{:e} {:e}",
        off(none),
        off(first)
    );
}
