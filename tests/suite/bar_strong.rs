//! Strong and compound waves by finite volumes, light bodies, metal bars: comparison with exact Riemann problems.

use crate::support::assert_close;
use snaprod::bar::breaking;
use snaprod::bar::{
    Bar, BarMotion, End, FiniteVolumes, Law1d, Material, Spectral, Stress, WaveKind,
};
use snaprod::body::{History, Pulse};

fn law(stress: Stress) -> Material {
    Material::new(&stress, 1.0).expect("a law")
}

/// A unit bar on a wall at X = 0, started with this stretch and velocity.
fn unit(law: Material, tip: End, start: [f64; 2]) -> Bar {
    let bar = Bar::new(law, 1.0, 1.0, [End::Wall, tip]).expect("a bar");
    bar.started(move |_| start)
}

fn pulled(force: f64) -> End {
    End::Loaded(History::Constant(force))
}

/// Relative L1 error of the stretch for a constant end load, when the front has passed 0.9 of the bar.
fn error(law: &Material, ahead: f64, behind: f64, cells: usize) -> f64 {
    let waves = law.waves(ahead, behind);
    let t = 0.9 / waves[0].head;
    let bar = unit(law.clone(), pulled(law.stress(behind)), [ahead, 0.0]);
    let mut volumes = FiniteVolumes::new(&bar, cells).expect("cells");
    volumes.advance(t).expect("a motion");
    let exact = |x: f64| {
        let speed = (1.0 - x) / t;
        let Some(wave) = waves.iter().find(|wave| speed >= wave.tail) else {
            return behind;
        };
        if speed >= wave.head || wave.kind == WaveKind::Shock {
            return wave.from;
        }
        let (mut a, mut b) = (wave.from, wave.to);
        for _ in 0..50 {
            let lam = 0.5 * (a + b);
            if law.speed(lam) > speed {
                a = lam
            } else {
                b = lam
            }
        }
        a
    };
    let state = volumes.snapshot();
    let gaps = state.x.iter().zip(&state.stretch);
    let sum: f64 = gaps.map(|(x, lam)| (lam - exact(*x)).abs()).sum();
    sum / (cells as f64 * (behind - ahead).abs())
}

/// Catches a scheme that keeps a jump although the hull of the stress has a fan and a shock: the error then stays at 2
/// % for any number of cells. Catches also one that overshoots the edge of a law.
#[test]
fn compound_waves_converge_to_their_hulls() {
    for (coefficients, ahead, behind) in [
        (vec![1.0, 0.0, 9.0], 0.6, 1.55),
        (vec![1.0, -3.0, 4.0], 1.0, 1.6),
        (vec![1.0, 0.0, 9.0], 1.5, 0.5),
        (vec![1.0, 0.0, 1.0], 0.5, 1.8),
        (vec![1.0, 0.7065, 6.0762, -24.7318, 6.3597], 0.8564, 1.2467),
        (vec![1.0, -1.0988], 0.544, 1.4287),
    ] {
        let law = law(Stress::Polynomial(coefficients.clone()));
        let [coarse, fine] = [100, 400].map(|cells| error(&law, ahead, behind, cells));
        assert!(
            fine < 0.01 && fine < 0.4 * coarse,
            "{coefficients:?} {ahead} to {behind}: {coarse} {fine}"
        );
    }
}

/// Catches step sizes that ignore the waves at the ends, which may be the fastest: blows on a wall, and loads that
/// compress a bar to a thirtieth of its length.
#[test]
fn blows_and_heavy_loads_go_on() {
    let neo = law(Stress::NeoHookean(1.0));
    for speed in [1.0, 5.0, 10.0] {
        let bar = unit(neo.clone(), pulled(0.0), [1.0, -speed]);
        let mut volumes = FiniteVolumes::new(&bar, 100).expect("cells");
        volumes.advance(0.05).expect("a motion");
        let wall = neo.stress(neo.behind(1.0, -speed).expect("a state"));
        let got = volumes.snapshot().ends[0].stress;
        assert_close(got, wall, 5e-3, 0.0, &format!("blow {speed}"));
    }
    for force in [-20.0, -100.0, -1000.0] {
        let behind = neo.stretch(force).expect("a stretch");
        let bar = unit(neo.clone(), pulled(force), [1.0, 0.0]);
        let mut volumes = FiniteVolumes::new(&bar, 50).expect("cells");
        let t = 0.5 / neo.chord_speed(1.0, behind);
        volumes.advance(t).expect("a motion");
        let (ledger, what) = (volumes.ledger(), format!("force {force}"));
        let velocity = volumes.snapshot().ends[1].velocity;
        assert_close(velocity, neo.velocity_jump(1.0, behind).0, 1e-2, 0.0, &what);
        let lost = t * neo.dissipation(1.0, behind);
        assert_close(ledger.lost, lost, 0.15, 0.0, &what);
        assert_close(ledger.dissipated, ledger.lost, 0.05, 0.0, &what);
    }
}

/// Catches step sizes that ignore the end body: a very light body overtakes the bar that pulls it.
#[test]
fn light_bodies_tend_to_a_free_end() {
    for mass in [0.0048, 1e-9] {
        let force = History::Constant(0.1);
        let linear = law(Stress::Linear(1.0));
        let bar = unit(linear, End::Mass { mass, force }, [1.0, 0.0]);
        let mut volumes = FiniteVolumes::new(&bar, 50).expect("cells");
        volumes.advance(0.9).expect("a motion");
        let (tip, ledger) = (volumes.snapshot().ends[1], volumes.ledger());
        let what = format!("mass {mass}");
        assert!(volumes.extremes()[1].max < 0.104, "{what}");
        assert_close(tip.stress, 0.1, 1e-3, 0.0, &what);
        assert_close(tip.velocity, 0.1, 1e-2, 0.0, &what);
        assert_close(ledger.momentum, ledger.impulse, 1e-12, 1.0, &what);
    }
}

/// Catches a tolerance in the units of the scene: a steel bar in metres was held to digits below rounding and never
/// ended. The bar in its own units must move equally.
#[test]
fn spectral_bars_do_not_know_their_units() {
    let moved = |modulus: f64, density: f64, area: f64| {
        let material = Material::new(&Stress::Linear(modulus), density).expect("a law");
        let time = (density / modulus).sqrt();
        let force = History::Pulse(Pulse {
            at: 4.0 * time,
            width: 8.0 * time,
            amplitude: 4.76e-4 * modulus * area,
        });
        let mass = 12.7 * density * area;
        let ends = [End::Wall, End::Mass { mass, force }];
        let bar = Bar::new(material, 1.0, area, ends).expect("a bar");
        let mut element = Spectral::new(&bar, 24, 1e-13).expect("nodes");
        element.go(16.0 * time, 4000).expect("a motion");
        assert!(element.time() >= 16.0 * time, "4000 steps do not do");
        element.snapshot().ends[1].position
    };
    let steel = moved(210e9, 7850.0, 1e-4);
    assert_close(steel, moved(1.0, 1.0, 1.0), 1e-11, 0.0, "steel");
}

/// Catches a first shock that is reported only if the end is the faster state: beyond an inflection a compound wave
/// contains a shock from the start.
#[test]
fn compound_waves_break_at_once() {
    let law = law(Stress::Polynomial(vec![1.0, 0.0, 9.0]));
    let bar = unit(law, pulled(-1.625), [1.5, 0.0]);
    let first = breaking::first(&bar, 0.1).expect("a shock");
    assert_eq!((first.time, first.position), (0.0, 1.0));
}
