//! The three examples of the thesis: comparison with closed forms of simple waves and shocks, and with finite volumes
//! of another program (tests/data/waves).

use crate::bar_laws::mooney;
use crate::support::{assert_close, json, list, number, rows};
use snaprod::bar::breaking::{self, AccelerationWave};
use snaprod::bar::{Bar, BarMotion, End, FiniteVolumes, Law1d, Material, Shock, Stress, shocks};
use snaprod::body::History;
use std::f64::consts::TAU;

pub const AREA: f64 = 0.0314;
pub const LENGTH: f64 = 3.0;

pub fn loaded(history: History) -> Bar {
    Bar::new(mooney(), LENGTH, AREA, [End::Wall, End::Loaded(history)]).expect("a bar")
}

/// A force for 2 ms.
pub fn pulse(force: f64) -> Bar {
    loaded(History::Table(vec![[0.002, force], [0.002 + 1e-12, 0.0]]))
}

pub fn sine() -> Bar {
    loaded(History::sine(1.7, TAU / 0.002, 0.0))
}

pub fn volumes(bar: &Bar, cells: usize, until: f64) -> FiniteVolumes {
    let mut volumes = FiniteVolumes::new(bar, cells).expect("cells");
    volumes.advance(until).expect("a motion");
    volumes
}

pub fn bounds(values: &[f64]) -> (f64, f64) {
    let fold = |start, f: fn(f64, f64) -> f64| values.iter().copied().fold(start, f);
    (
        fold(f64::INFINITY, f64::min),
        fold(f64::NEG_INFINITY, f64::max),
    )
}

fn only(found: Vec<Shock>) -> Shock {
    assert_eq!(found.len(), 1, "{found:?}");
    found[0]
}

/// Catches a wrong shock speed, ringing, a wrong reflection: the unloading shock of the pulse and the plateau at the
/// wall.
#[test]
pub fn pulse_unloads_by_its_shock() {
    let given = &json("waves/rod_exact_given.json")["step_load_on_rod_at_rest"][1];
    let shock = &given["unload_to_zero_shock"];
    let speed = number(shock, "speed");
    let bar = pulse(2.0);
    for (cells, tolerance) in [(60, 1e-2), (150, 1e-3)] {
        let mut volumes = volumes(&bar, cells, 0.0024);
        let before = only(shocks(&bar, &volumes.snapshot()));
        volumes.advance(0.003).unwrap();
        let after = only(shocks(&bar, &volumes.snapshot()));
        let travelled = (before.position - after.position) / 0.0006;
        assert_close(travelled, speed, tolerance, 0.0, &format!("{cells} cells"));
        assert_close(-after.speed, speed, 1e-3, 0.0, "by its states");
        assert_close(
            after.loss_rate,
            AREA * number(shock, "energy_loss_rate_per_area_lb_in_s_in2"),
            1e-2,
            0.0,
            "loss",
        );
    }
    let mut volumes = volumes(&bar, 150, 0.0022);
    assert!(bounds(&volumes.snapshot().stress).0 > -2.5);
    volumes.advance(0.0024).unwrap();
    for t in [0.0024, 0.00241, 0.00242] {
        volumes.advance(t).unwrap();
        let (low, high) = bounds(&volumes.snapshot().stress);
        assert!(low > -0.5 && high < 64.0, "{low} {high} at {t}");
    }
    let mut fine = self::volumes(&bar, 600, 0.0024);
    // Speed of the end under the load, from its displacement.
    let way = fine.snapshot().ends[1].position - LENGTH;
    assert_close(
        way,
        0.002 * number(given, "end_velocity_in_s"),
        5e-3,
        0.0,
        "way of the end",
    );
    fine.advance(0.0045).unwrap();
    assert_close(
        fine.snapshot().ends[0].stress,
        number(given, "wall_sigma_psi"),
        1e-3,
        0.0,
        "wall",
    );
    assert_close(
        fine.extremes()[0].max,
        number(given, "wall_sigma_psi"),
        1e-3,
        0.0,
        "wall",
    );
}

/// Catches losses that do not add up: energies of the given data, the rate of loss, momentum to rounding.
#[test]
fn ledgers_close() {
    let data = json("waves/rod_examples_given.json");
    for (bar, name, least) in [
        (pulse(2.0), "pulse_2lb", 6),
        (sine(), "sine_1.7lb", 10),
        (pulse(0.228), "pulse_0.228lb", 4),
    ] {
        let mut volumes = FiniteVolumes::new(&bar, 600).unwrap();
        let given = &data[name]["finite_volume"];
        let mut lost = 0.0;
        for state in rows(given, "states", least) {
            let t = number(state, "t");
            while volumes.time() < t {
                volumes.advance((volumes.time() + 2e-5).min(t)).unwrap();
                let now = volumes.ledger();
                assert!(
                    now.lost >= lost - 1e-7 * now.work.abs(),
                    "{name} {t}: {} after {lost}",
                    now.lost
                );
                lost = now.lost;
            }
            let ledger = volumes.ledger();
            let work = number(state, "work");
            let near = |got: f64, key: &str| {
                assert_close(
                    got,
                    number(state, key),
                    5e-3,
                    work,
                    &format!("{name} {t} {key}"),
                )
            };
            near(ledger.kinetic, "kinetic");
            near(ledger.strain, "strain");
            near(ledger.work, "work");
            near(ledger.lost, "lost");
            assert_close(
                ledger.dissipated,
                ledger.lost,
                0.05,
                0.01 * work,
                "sum over the faces",
            );
            assert_close(ledger.momentum, ledger.impulse, 1e-12, 0.004, name);
            assert_close(
                ledger.momentum,
                number(state, "momentum"),
                2e-3,
                0.004,
                "momentum",
            );
            for (x, stress) in state["sigma_at_X"].as_object().expect("stresses") {
                // Fronts are left out: the data belong to other cells.
                let at: f64 = x.parse().unwrap();
                let now = volumes.snapshot();
                let i = (at / volumes.width()) as usize;
                let (low, high) = bounds(&now.stress[i - 6..i + 6]);
                let want = stress.as_f64().unwrap();
                assert!(
                    low - 0.3 <= want && want <= high + 0.3,
                    "{name} {t} at {x}: {want} not in {low}..{high}"
                );
            }
        }
    }
    let mut volumes = volumes(&pulse(2.0), 600, 0.0021);
    let before = volumes.ledger().lost;
    volumes.advance(0.0029).unwrap();
    assert_close(
        (volumes.ledger().lost - before) / 0.0008,
        82.17,
        1e-2,
        0.0,
        "rate of loss",
    );
}

/// The stretch of the simple wave from the end, at X and t, before it breaks.
fn simple_wave(law: &Material, x: f64, t: f64) -> f64 {
    let emitted = |tau: f64| {
        law.stretch(1.7 * (TAU * tau / 0.002).sin() / AREA)
            .expect("a stretch")
    };
    let (mut low, mut high) = (0.0, t);
    if LENGTH - x >= law.speed(1.0) * t {
        return 1.0;
    }
    for _ in 0..60 {
        let tau = 0.5 * (low + high);
        if law.speed(emitted(tau)) * (t - tau) > LENGTH - x {
            low = tau
        } else {
            high = tau
        }
    }
    emitted(low)
}

/// Catches a loss of order: second on the smooth simple wave, first with a shock.
#[test]
fn finite_volumes_converge() {
    let law = mooney();
    let smooth = |cells: usize| {
        let now = volumes(&sine(), cells, 0.0014).snapshot();
        let third = 0.6f64.sqrt() * 0.5 * LENGTH / cells as f64;
        let gaps = now.x.iter().zip(&now.stretch).map(|(x, got)| {
            let [a, b, c] = [-third, 0.0, third].map(|step| simple_wave(&law, x + step, 0.0014));
            (got - (5.0 * a + 8.0 * b + 5.0 * c) / 18.0).abs()
        });
        gaps.sum::<f64>() / cells as f64
    };
    let order = (smooth(300) / smooth(600)).log2();
    assert!(order > 1.9, "order {order}");
    // At 2.4 ms the fan has not reached the wall, and the shock is exact: mean error of the stretch.
    let given = &json("waves/rod_exact_given.json")["step_load_on_rod_at_rest"][1];
    let (top, speed) = (
        number(given, "lam"),
        number(&given["unload_to_zero_shock"], "speed"),
    );
    let broken = |cells: usize| {
        let now = volumes(&pulse(2.0), cells, 0.0024).snapshot();
        let gaps = now.x.iter().zip(&now.stretch).map(|(x, got)| {
            let from_end = LENGTH - x;
            let pace = from_end / 0.0024;
            let want = if from_end < speed * 0.0004 || pace > law.speed(1.0) {
                1.0
            } else if pace < law.speed(top) {
                top
            } else {
                fan(&law, pace, top)
            };
            (got - want).abs()
        });
        gaps.sum::<f64>() / cells as f64
    };
    let errors = [300, 600, 1200].map(broken);
    for pair in errors.windows(2) {
        let factor = pair[0] / pair[1];
        assert!((1.7..2.5).contains(&factor), "{errors:?}");
    }
}

/// The stretch whose speed is `pace`, between 1 and `top`.
fn fan(law: &Material, pace: f64, top: f64) -> f64 {
    let (mut low, mut high) = (1.0, top);
    for _ in 0..60 {
        let lam = 0.5 * (low + high);
        if law.speed(lam) > pace {
            low = lam
        } else {
            high = lam
        }
    }
    low
}

/// Catches a wrong envelope, and shocks that are missed or misplaced when they pass through each other.
#[test]
fn sine_breaks_and_its_shocks_meet() {
    let data = json("waves/rod_exact_given.json");
    let load = &data["sinus_load"];
    let first = breaking::first(&sine(), 0.006).expect("a shock");
    assert_close(first.time, number(load, "t_cr_s"), 1e-8, 0.0, "time");
    assert_close(
        LENGTH - first.position,
        number(load, "X_cr_from_loaded_end_in"),
        1e-6,
        0.0,
        "place",
    );
    assert_close(
        first.emitted,
        number(load, "first_crossing_emitted_at_s"),
        1e-5,
        0.0,
        "emission",
    );
    // Compression first: the front itself breaks, as an acceleration wave.
    let law = mooney();
    let pushed = loaded(History::sine(-1.7, TAU / 0.002, 0.0));
    let front = breaking::first(&pushed, 0.006).expect("a shock");
    let wave = AccelerationWave::new(
        &law,
        1.0,
        law.speed(1.0) * 1.7 * TAU / 0.002 / AREA / law.jet(1.0)[2],
    )
    .unwrap();
    assert_close(front.time, wave.blow_up, 1e-6, 0.0, "front");
    let unloaded = breaking::first(&pulse(2.0), 0.006).expect("a shock");
    assert_close(unloaded.time, 0.002, 1e-8, 0.0, "unloading");
    assert!(breaking::first(&loaded(History::Constant(2.0)), 0.006).is_none());

    let given = &data["acceleration_wave"];
    let wave = AccelerationWave::new(&law, 1.0, number(given, "a0_in_s2")).unwrap();
    assert_close(
        wave.blow_up,
        number(given, "t_blow_up_s"),
        1e-12,
        0.0,
        "blow-up",
    );
    assert_close(
        wave.distance,
        number(given, "X_blow_up_in"),
        1e-12,
        0.0,
        "blow-up",
    );
    assert_close(
        wave.at(0.5 * wave.blow_up),
        2.0 * wave.start,
        1e-12,
        0.0,
        "growth",
    );
    let spread = AccelerationWave::new(&law, 1.0, -1e6).unwrap();
    assert_close(spread.at(wave.blow_up), -0.5e6, 1e-12, 0.0, "decay");

    let bar = sine();
    let mut fine = volumes(&bar, 900, 0.0016);
    assert!(
        shocks(&bar, &fine.snapshot()).is_empty(),
        "{:?}",
        shocks(&bar, &fine.snapshot())
    );
    fine.advance(0.0046).unwrap();
    let found = shocks(&bar, &fine.snapshot());
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        (found[0].position - 1.143).abs() < 0.01 && (found[1].position - 1.233).abs() < 0.01,
        "{found:?}"
    );
    // The two shocks have just crossed.
    assert!(found[0].speed < 0.0 && found[1].speed > 0.0, "{found:?}");
    let wall = fine.extremes()[0];
    assert_close(wall.min, -105.7, 1e-2, 0.0, "wall");
    assert_close(wall.max, 78.0, 1e-2, 0.0, "wall");
}

/// Catches finite volumes that choose a wave forbidden by the hull: Riemann problems with compound waves, and impacts
/// on walls.
#[test]
fn compound_waves_are_found_by_finite_volumes() {
    let law = Material::new(
        &Stress::Biderman([0.208e6, -0.0024e6, 0.0005e6, 0.0233e6]),
        1000.0,
    )
    .unwrap();
    let data = json("waves/riemann_given.json");
    let mut compared = 0;
    for row in rows(&data, "cases", 13)
        .iter()
        .filter(|row| row["material"] == "biderman")
    {
        let [left, right] = ["L", "R"].map(|side| {
            let state = list(&row[side]);
            [state[0], state[1]]
        });
        let free = || End::Loaded(History::Constant(0.0));
        let bar = Bar::new(law.clone(), 2.0, 1.0, [free(), free()]).unwrap();
        let bar = bar.started(move |x| if x < 1.0 { left } else { right });
        let exact = law.riemann(left, right).unwrap();
        let t = 0.3
            / exact
                .left
                .iter()
                .chain(&exact.right)
                .map(|wave| wave.head)
                .fold(0.0, f64::max);
        let now = volumes(&bar, 800, t).snapshot();
        // Between the waves the star state holds; the mean shows the strength of every wave.
        let inner = now
            .x
            .iter()
            .zip(&now.stretch)
            .filter(|(x, _)| (0.7..1.3).contains(*x));
        let inner: Vec<(f64, f64)> = inner.map(|(x, lam)| (*x, *lam)).collect();
        let wanted = |x: f64| {
            let (waves, side) = if x < 1.0 {
                (&exact.left, left)
            } else {
                (&exact.right, right)
            };
            let pace = (x - 1.0).abs() / t;
            let mut lam = side[0];
            for wave in waves {
                if pace > wave.head {
                    break;
                }
                lam = if pace < wave.tail {
                    wave.to
                } else {
                    within(&law, pace, wave.from, wave.to)
                };
            }
            lam
        };
        let gap = inner
            .iter()
            .map(|(x, lam)| (lam - wanted(*x)).abs())
            .sum::<f64>()
            / inner.len() as f64;
        let scale = (left[0] - exact.stretch)
            .abs()
            .max((right[0] - exact.stretch).abs());
        assert!(gap < 0.02 * scale, "{left:?} {right:?}: {gap} of {scale}");
        compared += 1;
    }
    assert!(compared >= 7);
    // A bar thrown at a wall: one shock.
    for case in rows(&json("waves/rod_exact_given.json"), "wall_impact", 3) {
        let v = number(case, "impact_speed_in_s");
        let bar = Bar::new(
            mooney(),
            LENGTH,
            AREA,
            [End::Wall, End::Loaded(History::Constant(0.0))],
        )
        .unwrap();
        let bar = bar.started(move |_| [1.0, -v]);
        let found = volumes(&bar, 200, 0.001);
        assert_close(
            found.snapshot().ends[0].stress,
            number(case, "sigma_psi"),
            1e-3,
            0.0,
            "wall",
        );
        let shock = only(
            shocks(&bar, &found.snapshot())
                .into_iter()
                .filter(|shock| shock.speed > 0.0)
                .collect(),
        );
        assert_close(
            shock.speed,
            number(case, "shock_speed_in_s"),
            3e-3,
            0.0,
            "shock",
        );
    }
}

/// The stretch inside a fan whose speed is `pace`.
fn within(law: &Material, pace: f64, from: f64, to: f64) -> f64 {
    let (mut fast, mut slow) = (from, to);
    for _ in 0..60 {
        let lam = 0.5 * (fast + slow);
        if law.speed(lam) > pace {
            fast = lam
        } else {
            slow = lam
        }
    }
    fast
}
