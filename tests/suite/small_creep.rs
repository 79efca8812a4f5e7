//! Small motions of a body on a rod with friction: eigenvalues against closed forms of the straight rod, and against
//! the ring-down of runs.

use crate::support::{frequencies, modes_of};
use nalgebra::{Complex, Matrix3, Vector3};
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{ModesRecord, Silent, Table};

type Eigenvalue = Complex<f64>;

fn eigenvalues(record: &ModesRecord) -> Vec<Eigenvalue> {
    record.motions.eigenvalues.clone().expect("eigenvalues")
}

/// Asserts that a list has exactly the given numbers with Im >= 0, with their multiplicities.
fn assert_same(found: &[Eigenvalue], want: &[Eigenvalue], tolerance: f64, what: &str) {
    let mut left = found.to_vec();
    for s in want {
        let nearest = (0..left.len()).min_by(|i, j| {
            let far = |k: &usize| (left[*k] - s).norm();
            far(i).total_cmp(&far(j))
        });
        let Some(k) = nearest else {
            panic!("{what}: {s} is missing in {found:?}");
        };
        let off = (left[k] - s).norm() / s.norm();
        assert!(off <= tolerance, "{what}: {s} is {off:e} off in {found:?}");
        left.remove(k);
    }
    assert!(left.is_empty(), "{what}: {left:?} are too many");
}

/// Roots of s^2 + square (1 + time s) = 0 with Im s >= 0.
fn roots(square: f64, time: f64) -> Vec<Eigenvalue> {
    let half = 0.5 * square * time;
    let inner = half * half - square;
    if inner < 0.0 {
        vec![Complex::new(-half, (-inner).sqrt())]
    } else {
        vec![
            Complex::from(-half - inner.sqrt()),
            Complex::from(-square / (half + inner.sqrt())),
        ]
    }
}

fn plane(rod: &str, more: &str) -> String {
    format!(
        "[rod]\nmodel = \"elastica\"\nlength = 2.0\nbending_stiffness = 5.0\n{rod}\n[body]\nmass = 0.5\n[run]\nduration = 1.0\n[start]\n\
         rest = \"straight\"\n{more}"
    )
}

/// A rigid body on a rod in space.
fn space(section: &str, rod: &str, more: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 2.0\nsection = {{ bending = [8.0, 1.0], torsion = 2.0{section} }}\n{rod}\n\
         [body]\nmass = 0.5\ninertia = [0.2, 0.3, 0.1]\noffset = [0.0, 0.0, 0.3]\n[run]\nduration = 1.0\n{more}"
    )
}

/// Catches friction omitted, scaled wrongly, or of the wrong section, and rates of the rod's own among those of the
/// body: on the straight rod K(s) = (1 + tau s) K, oscillating and overdamped, rigid and elastic in shear and stretch.
#[test]
fn proportional_friction_of_a_straight_rod() {
    for time in [1e-3, 0.3, 2.0, 50.0] {
        let damping = format!("damping = {{ proportional = {time:?} }}");
        let found = modes_of(&plane(&damping, ""));
        let square = 3.0 * 5.0 / (0.5 * 8.0);
        let what = format!("in the plane, tau = {time}");
        assert_same(&eigenvalues(&found), &roots(square, time), 1e-9, &what);
        let also = format!("damping = {:?}", 5.0 * time);
        assert_same(
            &eigenvalues(&modes_of(&plane(&also, ""))),
            &roots(square, time),
            1e-9,
            &what,
        );
        for (section, count) in [("", 5), (", shear = [40.0, 60.0], axial = 300.0", 6)] {
            let found = modes_of(&space(section, &damping, ""));
            let squares = frequencies(&found);
            assert_eq!(squares.len(), count);
            let want: Vec<Eigenvalue> = squares.iter().flat_map(|w| roots(w * w, time)).collect();
            let what = format!("in space{section}, tau = {time}");
            assert_same(&eigenvalues(&found), &want, 1e-7, &what);
            assert!(found.motions.stable);
        }
    }
}

/// Catches lost memory, and friction other than at rest: roots of s^2 + omega^2 (1 + tau s + sum k T s/(1 + T s)) = 0,
/// and a Carreau law at its plateau. Two branches of an isotropic rod have rates of high multiplicity, on which
/// eigenvalue methods stall.
#[test]
fn memory_and_friction_at_rest() {
    let square = 3.0 * 5.0 / (0.5 * 8.0);
    let branch =
        "damping = { proportional = 0.05 }\n[[rod.relaxation]]\nstiffness = 2.5\ntime = 0.4\n";
    let found = eigenvalues(&modes_of(&plane(branch, "")));
    let oscillates: Vec<_> = found.iter().filter(|s| s.im > 0.0).collect();
    assert_eq!(oscillates.len(), 1, "{found:?}");
    for s in oscillates {
        let memory = s * 0.5 * 0.4 / (s * 0.4 + 1.0);
        let left = s * s + (s * 0.05 + memory + 1.0) * square;
        assert!(left.norm() <= 1e-9 * square, "{s} leaves {left}");
    }
    let two = |time: [f64; 2]| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 0.8 }}\ndamping = {{ proportional = 0.02 }}\n\
             relaxation = [{{ stiffness = {{ proportional = 0.5 }}, time = {:?} }}, {{ stiffness = {{ proportional = 0.3 }}, time = {:?} }}]\n\
             [body]\nmass = 1.0\ninertia = [0.01, 0.01, 0.01]\n[run]\nduration = 1.0\n[start]\nsettled = true\n",
            time[0], time[1]
        )
    };
    for time in [[2.0, 20.0], [0.2, 1.5]] {
        let found = modes_of(&two(time));
        let squares: Vec<f64> = frequencies(&found).iter().map(|w| w * w).collect();
        let all = eigenvalues(&found);
        assert!(all.iter().any(|s| s.im > 0.0), "{all:?}");
        for s in all.iter().filter(|s| s.im > 0.0) {
            let [a, b] = [(0.5, time[0]), (0.3, time[1])].map(|(k, t)| s * k * t / (s * t + 1.0));
            let left = |square: &f64| (s * s + (s * 0.02 + a + b + 1.0) * *square).norm() / square;
            let least = squares.iter().map(left).fold(f64::INFINITY, f64::min);
            assert!(least <= 1e-9, "{s} leaves {least:e}");
        }
    }
    let plain = modes_of(&plane("damping = 0.7", ""));
    let carreau = modes_of(&plane(
        "damping = { viscosity = 0.7, exponent = 0.5, rate = 2.0 }",
        "",
    ));
    assert_same(
        &eigenvalues(&carreau),
        &eigenvalues(&plain),
        1e-9,
        "Carreau",
    );
}

/// A rod with friction, released straight under a distributed load. Catches modes about the start instead of the final
/// equilibrium.
#[test]
fn let_go_straight_under_a_load_along_it() {
    let about = |start: &str| {
        modes_of(&space(
            "",
            "damping = { proportional = 0.3 }",
            &format!("[start]\n{start}\n[loads]\ndistributed = [0.2, 0.0, -0.1]\n"),
        ))
    };
    let (straight, settled) = (about("rest = \"straight\""), about("settled = true"));
    assert!(!straight.of_start && settled.of_start);
    assert_same(
        &eigenvalues(&straight),
        &eigenvalues(&settled),
        1e-9,
        "straight",
    );
}

/// The eigenvalue of the last part of a ring-down x, samples `step` apart: x_(j+1) = a x_j + b x_(j-1) + c by least
/// squares.
fn rung_down(x: &[f64], step: f64) -> Eigenvalue {
    let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::zeros());
    // Relative to the middle sample, to keep the digits of the normal equations.
    let middle = x[x.len() / 2];
    for three in x.windows(3) {
        let row = Vector3::new(three[1] - middle, three[0] - middle, 1e-5);
        normal += row * row.transpose();
        right += row * (three[2] - middle);
    }
    let found = normal.full_piv_lu().solve(&right).expect("a fit");
    let (a, b) = (found.x, found.y);
    let root = Complex::new(0.5 * a, (-b - 0.25 * a * a).sqrt());
    root.ln() / step
}

/// The eigenvalue by the second half of a run's record, in the coordinate `of`.
fn measured(text: &str, (duration, samples): (f64, usize), from: f64, of: &str) -> Eigenvalue {
    let text = text.replace(
        "duration = 1.0",
        &format!("duration = {duration:?}\nsamples = {samples}\ntolerance = 1e-12"),
    );
    let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let prepared = Prepared::new(&scene).expect("a start");
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::default(), &mut tables, &mut Silent).expect("a run");
    assert_eq!(record.reason(), None);
    let (t, x) = (tables[0].reals("t"), tables[0].reals(of));
    let first = t.iter().position(|t| *t >= from).expect("samples");
    rung_down(&x[first..], duration / (samples - 1) as f64)
}

/// Catches a geometric stiffness omitted or multiplied with the friction. A rod bent by the weight of its body rings
/// down, in the plane and in space. Frequency and decay of its last oscillations are those of the slowest eigenvalue.
#[test]
fn a_bent_rod_rings_down_at_its_eigenvalue() {
    let slowest = |text: &str| {
        let mut all = eigenvalues(&modes_of(text));
        all.retain(|s| s.im > 0.0);
        all.sort_by(|a, b| b.re.total_cmp(&a.re));
        all[0]
    };
    let bent = plane(
        "damping = { proportional = 0.25 }",
        "[loads]\ngravity = [0.0, -4.0]\n",
    );
    let straight = slowest(&plane("damping = { proportional = 0.25 }", ""));
    // Small enough that quadratic terms stay below the tolerance: at six times the speed they are 1.4e-5 of the decay.
    let weight = "[start]\nsettled = true\nvelocity = [5e-5, 0.0, 2e-5]\n[loads]\ngravity = [0.0, 1.0, -5.0]\n";
    let on_side = "[clamp]\nrotation = { axis = [0.2, 1.0, 0.0], angle = 1.3 }\n";
    let section = ", shear = [40.0, 60.0], axial = 300.0";
    let turned = space(
        section,
        "damping = { proportional = 0.6 }",
        &format!("{on_side}{weight}"),
    );
    for (text, time, from, coordinate) in [
        (&bent, (36.0, 145), 26.0, "y"),
        (&turned, (40.0, 101), 22.0, "z"),
    ] {
        let (want, found) = (slowest(text), measured(text, time, from, coordinate));
        let off = [
            (found.re / want.re - 1.0).abs(),
            (found.im / want.im - 1.0).abs(),
        ];
        let motions = modes_of(text).motions;
        let (creep, all) = (
            motions.creep.expect("friction"),
            motions.eigenvalues.expect("eigenvalues"),
        );
        assert!(
            creep.change <= 1e-8,
            "eigenvalues move by {:e}",
            creep.change
        );
        let oscillating = all.iter().filter(|s| s.im > 0.0).count();
        assert_eq!(
            all.len() + oscillating + creep.among,
            2 * motions.modes.len()
        );
        assert!(
            off[0] <= 1e-5 && off[1] <= 1e-5,
            "{found} for {want}: {off:?}"
        );
    }
    // The effect of the load is much larger than the tolerance.
    assert!((slowest(&bent) / straight - 1.0).norm() > 0.05);
}
