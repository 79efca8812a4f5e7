//! A mass that pushes its rod over a fold: the snap, its energy, and the bounces after it.
//!
//! `cargo run --release --example snap`

use nalgebra::Vector2;
use snaprod::body::PointMass;
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::motion::{Event, Options, Run};

fn main() -> snaprod::Result<()> {
    let body = PointMass::new(1.0)?;
    let start = Equilibrium::from_lambda_kappa(6.3, 0.6)?;
    let options = Options::new(3.0)?.with_tolerance(1e-12)?;
    let q = Vector2::new(start.p, start.w);
    let mut run = Run::new(&Elastica, &body, q, Vector2::new(0.0, -0.5), options)?;
    let energy = run.now().ledger.total();

    for event in &mut run {
        if let Event::Snap(snap) = event {
            let [from, to] = [&snap.from, &snap.to]
                .map(|end| end.sheet.expect("sheets of the elastica have names"));
            println!(
                "snap at t = {:.12} from {from} to {to}: {:.9} released",
                snap.t, snap.released
            );
            // The reference run, from an independent code with energy error < 1e-10.
            assert!((snap.t - 0.025570197858).abs() < 1e-11);
            assert!((snap.released - 10.263064640).abs() < 1e-8);
        }
    }

    let end = run.now();
    println!(
        "at t = 3: r = {:?}, v = {:?}",
        end.pose.as_slice(),
        end.phase.v.as_slice()
    );
    println!("ledger off by {:.1e}", end.ledger.total() - energy);
    assert!((end.pose - Vector2::new(0.7925457, -0.1708947)).norm() < 1e-6);
    assert!((end.phase.v - Vector2::new(-1.3784564, 0.9055015)).norm() < 1e-6);
    assert!((end.ledger.total() / energy - 1.0).abs() < 1e-11);
    Ok(())
}
