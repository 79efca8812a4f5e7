//! Ring-down fit: bending stiffness and damping of a strip with a mass at its end, from films of its release.
//!
//! The films are synthetic: the motion of known values at 50 pictures a second with normal errors of 0.3 mm along x
//! and 0.5 mm along y, some pictures unusable. Each film is fitted without knowledge of its noise. Three properties
//! are checked: the fit finds the values, its standard errors are the scatter of the estimates, and its intervals
//! contain the true values as often as stated.
//!
//! `cargo run --release --example ring_down`; half a minute.

use snaprod::scene::Scene;
use snaprod::study::run::{Prepared, samples};
use snaprod::study::{Data, Fit, Silent, Vary};
use std::f64::consts::TAU;
use std::fmt::Write;

type Failure = Box<dyn std::error::Error>;

/// Length in metres, mass in kilograms; the parameters to be fitted have wrong values.
const SCENE: &str = r#"
[rod]
model = "elastica"
length = 0.2
bending_stiffness = 0.03
damping = 0.002
[body]
mass = 0.1
[start]
lambda = 3.0
p = 0.5
[run]
duration = 1.0
"#;
const TRUTH: [(&str, f64); 2] = [("rod.bending_stiffness", 0.05), ("rod.damping", 5e-4)];
const RANGES: [&str; 2] = [
    "rod.bending_stiffness=0.02:0.1",
    "rod.damping=log:1e-4:1e-2",
];
const ERRORS: [f64; 2] = [3e-4, 5e-4];
const PICTURES: usize = 51;
const FILMS: u64 = 5;

fn main() -> Result<(), Failure> {
    let set = TRUTH.map(|(path, value)| format!("{path}={value:e}"));
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    let truth = Prepared::new(&Scene::parse_with(SCENE, &set)?)?;
    let times: Vec<f64> = (0..PICTURES).map(|k| 0.02 * k as f64).collect();
    let seen = samples(&truth, &times, &mut Silent)?;
    let (mut held, mut scatter) = (0, [0.0; 2]);
    for film in 0..FILMS {
        let mut chance = Chance(film);
        let mut data = "t,x,y\n".to_owned();
        for (k, t) in times.iter().enumerate() {
            let mut place = ["x", "y"].map(|name| seen.reals(name)[k]);
            for (x, sigma) in place.iter_mut().zip(ERRORS) {
                *x += sigma * chance.normal();
            }
            if chance.uniform() < 0.1 {
                writeln!(data, "{t},,{}", place[1])?
            } else {
                writeln!(data, "{t},{},{}", place[0], place[1])?
            }
        }
        let free: Result<Vec<Vary>, _> = RANGES.iter().map(|text| Vary::free(text)).collect();
        let fit = Fit::new(
            SCENE.to_owned(),
            Vec::new(),
            free?,
            Data::parse(&data)?,
            &[],
            &[],
        )?;
        let found = fit.search(&fit.start(0, 0), &mut Silent)?;
        let record = fit.best(found.into_iter().collect(), 1, &mut Silent)?;
        for (i, (one, (_, truth))) in record.parameters.iter().zip(TRUTH).enumerate() {
            let error = one.standard_error.ok_or("no standard error")?;
            let [low, high] = one.interval.ok_or("no interval")?;
            held += usize::from((low..high).contains(&truth));
            scatter[i] += ((one.value - truth) / error).powi(2) / FILMS as f64;
            print!("{} = {:.6} +- {error:.1e}  ", one.path, one.value);
            // Well within a thousandth of a stiffness and half a hundredth of a damping.
            let bound = [2e-3, 1e-2][i];
            assert!((one.value / truth - 1.0).abs() < bound, "{one:?}");
        }
        println!();
        for (one, sigma) in record.columns.iter().zip(ERRORS) {
            // Estimated from some 50 numbers, to 10 % standard error.
            assert!((one.noise / sigma - 1.0).abs() < 0.4, "{}", one.noise);
        }
    }
    println!(
        "{held} of {} intervals of 95 % hold the truth; errors by standard error (rms): {:.2}, {:.2}",
        2 * FILMS,
        scatter[0].sqrt(),
        scatter[1].sqrt()
    );
    // With correct intervals 8 or more of 10 hold in 99 of 100 sets of films; an rms of 5 lies between 0.3 and 2 as
    // often.
    assert!(held >= 8);
    assert!(scatter.iter().all(|square| (0.1..4.0).contains(square)));
    Ok(())
}

/// Pseudo-random numbers without a crate: splitmix64.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A normal number of mean 0 and variance 1, by Box and Muller.
    fn normal(&mut self) -> f64 {
        let (a, b) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
    }
}
