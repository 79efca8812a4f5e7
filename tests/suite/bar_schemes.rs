//! Schemes of the thesis: agreement with the original data (tests/data/waves), stability limits, and the program's
//! warnings.

use crate::bar_laws::mooney;
use crate::bar_waves::{AREA, LENGTH, bounds, loaded, pulse, sine, volumes};
use crate::support::{assert_close, json, number, rows};
use snaprod::bar::{Bar, BarMotion, End, Law1d, Scheme, Snapshot, growth, motion, stable_limit};
use snaprod::body::History;

/// Mean difference of the stress of a scheme on 60 elements from that of finer finite volumes, averaged around each
/// point.
fn gap(state: &Snapshot, fine: &Snapshot) -> f64 {
    let n = fine.x.len();
    let h = LENGTH / 60.0;
    let gaps = state.x.iter().zip(&state.stress).map(|(x, stress)| {
        let place = |x: f64| ((x / LENGTH * n as f64).round() as usize).min(n);
        let cells = &fine.stress[place((x - 0.5 * h).max(0.0))..place(x + 0.5 * h)];
        (stress - cells.iter().sum::<f64>() / cells.len() as f64).abs()
    });
    gaps.sum::<f64>() / state.x.len() as f64
}

/// Catches deviations from the schemes of the thesis: given data of these schemes on 60 elements.
#[test]
fn schemes_of_the_thesis_fail_as_they_did() {
    let data = json("waves/rod_examples_given.json");
    let names = [
        ("stretch form, printed (q^n)", Scheme::StretchTaylor),
        (
            "stretch form, sequential (q^{n+1})",
            Scheme::StretchSequential,
        ),
        ("central differences, lumped", Scheme::CentralLumped),
        ("central differences, consistent", Scheme::CentralConsistent),
    ];
    for (bar, example) in [(pulse(2.0), "pulse_2lb"), (sine(), "sine_1.7lb")] {
        let mut compared = 0;
        for row in rows(&data[example], "seed_schemes", 10) {
            let Some((_, scheme)) = names.iter().find(|(name, _)| row["scheme"] == *name) else {
                continue;
            };
            let mut lattice = motion(&bar, *scheme, 60, Some(number(row, "dt")), true).unwrap();
            for state in rows(row, "states", 4) {
                // After the jump of the load the schemes respond at different times.
                if state["t"].is_null()
                    || (example == "pulse_2lb" && number(state, "t") > 0.002)
                    || number(state, "t") > 0.0031
                {
                    break;
                }
                if lattice.advance(number(state, "t")).is_err() {
                    panic!("{scheme:?} {state} blew up");
                }
                let (low, high) = bounds(&lattice.snapshot().stress);
                let what = format!("{example} {scheme:?} {state}");
                assert_close(high, number(state, "max"), 2e-3, 10.0, &what);
                assert_close(low, number(state, "min"), 2e-3, 100.0, &what);
                compared += 1;
            }
        }
        assert!(compared > 15);
    }
    let fine = volumes(&sine(), 1920, 0.003).snapshot();
    let error = |scheme, dt| {
        let mut motion = motion(&sine(), scheme, 60, dt, false).unwrap();
        motion.advance(0.003).unwrap();
        gap(&motion.snapshot(), &fine)
    };
    let dt = Some(2e-6);
    let found = [
        error(Scheme::StretchSequential, dt),
        error(Scheme::CentralLumped, dt),
        error(Scheme::FiniteVolume, None),
        error(Scheme::LaxWendroff, dt),
    ];
    assert!(
        found[0] < 4.0 && found[1] > 15.0 && found[2] < 1.5 && found[3] > 5.0,
        "{found:?}"
    );
    // The front of the pulse has come to X = 1.763 at 1 ms; the elements next to it are its smeared foot.
    let ahead = |scheme| {
        let mut motion = motion(&pulse(2.0), scheme, 60, dt, false).unwrap();
        motion.advance(0.001).unwrap();
        let now = motion.snapshot();
        let ahead = now.x.iter().zip(&now.stress).filter(|(x, _)| **x < 1.65);
        ahead.map(|(_, stress)| stress.abs()).fold(0.0, f64::max)
    };
    let (consistent, lumped) = (
        ahead(Scheme::CentralConsistent),
        ahead(Scheme::CentralLumped),
    );
    assert!(consistent > 5.0 && lumped < 1.5, "{consistent} {lumped}");
}

/// Catches a stability limit that is not sharp, and bounds of the thesis that are insufficient.
#[test]
fn stability_limits_are_those_of_the_schemes() {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for (scheme, limit) in [
        (Scheme::CentralLumped, 1.0),
        (Scheme::CentralConsistent, 1.0 / 3f64.sqrt()),
        (Scheme::StretchSequential, golden),
        (Scheme::LaxWendroff, 1.0),
    ] {
        let found = stable_limit(scheme, 2e-4).unwrap();
        assert!((found - limit).abs() < 1.5e-3, "{scheme:?}: {found}");
    }
    for (r, steps) in [(0.2, 20_000), (0.4, 4000), (0.6, 1000)] {
        let grown = growth(Scheme::StretchTaylor, r, steps).unwrap() - 1.0;
        let wanted = (1.0 + 4.0 * f64::powi(r, 4)).sqrt() - 1.0;
        assert_close(grown, wanted, 1e-2, 0.0, &format!("growth at {r}"));
    }
    assert!(
        growth(Scheme::FiniteVolume, 0.5, 10)
            .unwrap_err()
            .is_domain()
    );
    // (5.34) and (5.28) with the fastest wave of a smooth run, at stretch 0.9977 or so.
    let gentle = loaded(History::Pulse(snaprod::body::Pulse {
        at: 0.001,
        width: 0.002,
        amplitude: -0.01,
    }));
    let law = mooney();
    let fastest = law.speed(law.stretch(-0.02 / AREA).unwrap());
    for (scheme, r) in [
        (Scheme::CentralLumped, 0.5f64.sqrt()),
        (Scheme::CentralConsistent, 1.0 / 6f64.sqrt()),
    ] {
        let mut lattice = motion(
            &gentle,
            scheme,
            60,
            Some(r * LENGTH / 60.0 / fastest),
            false,
        )
        .unwrap();
        lattice.advance(0.01).unwrap();
        let ledger = lattice.ledger();
        assert!(
            ledger.lost.abs() < 2e-2 * ledger.work,
            "{scheme:?} {ledger:?}"
        );
    }
}

/// Catches the unstable scheme run without a warning, and an unexplained blow-up.
#[test]
fn printed_scheme_is_refused_and_explains_itself() {
    let refused = motion(&sine(), Scheme::StretchTaylor, 60, None, false)
        .err()
        .expect("a refusal");
    assert!(
        refused.is_domain() && refused.to_string().contains("|g|^2 = 1 + m^4/4"),
        "{refused}"
    );
    let mut lattice = motion(&sine(), Scheme::StretchTaylor, 60, Some(1e-5), true).unwrap();
    let stuck = lattice.advance(0.0025).expect_err("a blow-up");
    assert!(
        stuck.at < 0.0025 && stuck.to_string().contains("unstable at every step"),
        "{stuck}"
    );
    let heavy = End::Mass {
        mass: 1.0,
        force: History::Constant(0.0),
    };
    let heavy = Bar::new(mooney(), 1.0, 1.0, [End::Wall, heavy]).unwrap();
    for scheme in [Scheme::StretchSequential, Scheme::LaxWendroff] {
        assert!(
            motion(&heavy, scheme, 60, None, false)
                .err()
                .expect("a refusal")
                .is_domain()
        );
    }
    for (cells, step) in [(1, None), (60, Some(-1.0)), (60, Some(f64::NAN))] {
        assert!(motion(&sine(), Scheme::CentralLumped, cells, step, false).is_err());
        assert!(motion(&sine(), Scheme::FiniteVolume, cells, step, false).is_err());
    }
}
