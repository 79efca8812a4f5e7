//! Euler's loads and the cantilever beyond them, read off the chart of equilibria.
//!
//! `cargo run --release --example euler_buckling`

use snaprod::elastica::Equilibrium;
use std::f64::consts::PI;

fn main() -> snaprod::Result<()> {
    // A cantilever under a dead axial load: alpha = 0, that is w = pi/2, 3 pi/2, ...; as kap -> 0 the
    // load lambda^2 tends to the Euler load (pi/2)^2 = 2.4674011003 and its odd multiples squared.
    for (mode, euler) in [(0, 0.25 * PI * PI), (1, 2.25 * PI * PI)] {
        let buckled = Equilibrium::new(1e-6, (f64::from(mode) + 0.5) * PI)?;
        let load = buckled.lambda.powi(2);
        println!("clamped-free, mode {mode}: P = {load:.10}");
        assert!((load / euler - 1.0).abs() < 1e-11);
    }

    // The end held on the axis (clamped-pinned): y = 0 just after buckling, lambda = 4.4934094579.
    let (mut low, mut high) = (4.4, 4.6);
    while high - low > 1e-12 {
        let middle = 0.5 * (low + high);
        let y = |lambda| Equilibrium::from_lambda_kappa(lambda, 1e-6).map(|e| e.y);
        if y(middle)? * y(low)? > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    println!("clamped-pinned: P = {:.10}", low * low);
    assert!((low * low / 20.190_728_556_4 - 1.0).abs() < 1e-9);

    // Beyond the Euler load: tip slope 2 asin kap, load P/Pcr, tip position (benchmark B2).
    let table = [
        (20.0, 1.015396866, 0.9697309074, 0.2194130424),
        (60.0, 1.15171962, 0.7410196061, 0.5932076462),
        (100.0, 1.518388793, 0.3489893004, 0.7915394965),
        (140.0, 2.54225837, -0.1069232376, 0.7503883661),
        (176.0, 9.116218298, -0.5772111094, 0.4214422961),
    ];
    println!("tip slope  P/Pcr         x             y");
    for (degrees, load, x, y) in table {
        let kappa = (0.5 * f64::to_radians(degrees)).sin();
        let e = Equilibrium::new(kappa.atanh(), 0.5 * PI)?;
        let relative = e.lambda.powi(2) / (0.25 * PI * PI);
        println!("{degrees:>9}  {relative:.9}  {:+.10} {:.10}", e.x, e.y);
        assert!((relative / load - 1.0).abs() < 1e-9);
        assert!((e.x - x).abs() < 1e-9 && (e.y - y).abs() < 1e-9);
    }
    Ok(())
}
