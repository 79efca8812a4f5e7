//! The elastica catapult (Armanini et al. 2017): the clamp of a loaded column is turned until the column snaps back.
//!
//! `cargo run --release --example catapult`

use nalgebra::{UnitQuaternion, Vector3};
use snaprod::rod::{EndConditions, Problem, Rod, RodFamily, Statical};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Item, Options};
use snaprod::solve::special_points::SpecialKind;
use std::f64::consts::PI;

fn main() -> snaprod::Result<()> {
    // Length 1, bending stiffness 1 in the plane of z and x, stiff out of it. Euler's load of the column is pi^2/4.
    let euler = 0.25 * PI * PI;
    println!("P/Pcr   snap-back at (deg)   end slope there (deg)");
    for (ratio, snap, slope) in [
        (1.5, 13.534_475_980_3, 58.138_642_016_9),
        (3.0, 62.715_628_570_4, 95.840_238_350_1),
    ] {
        // A weight at the free end of a rod on a clamp turned by the angle phi about y.
        let column = |phi: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * phi);
            let rod = Rod::new(1.0, Linear::diagonal([40.0, 1.0], 40.0)?)?
                .with_clamp(Vector3::zeros(), turn);
            let weight = EndConditions::load(Vector3::z() * (-ratio * euler), Vector3::zeros());
            Problem::new(rod, weight, 1e-12)
        };

        // The upright column is buckled; then the clamp turns away from the side to which the column leans, up to a
        // fold.
        let buckled = column(0.0)?.solve(None)?;
        assert_eq!(buckled.index, 0);
        let away = -buckled.end.position.x.signum();
        let family = RodFamily::new(|phi: f64| column(away * phi), false, PI);
        let x = family.unknowns(&buckled.base, 0.0)?;
        let fold = Continuation::new(&family, x, 0.0, Options::between(0.0, PI))?
            .find_map(|item| match item {
                Item::Special(special) if special.kind == SpecialKind::Fold => Some(special),
                _ => None,
            })
            .expect("a snap-back");
        assert_eq!(fold.index, (Some(0), Some(1)));

        let at = family.state(&fold.point.x, fold.point.p)?;
        let d3 = at.end.directors.column(2).into_owned();
        let (phi, end) = (fold.point.p.to_degrees(), d3.z.acos().to_degrees());
        println!("{ratio:>5}   {phi:18.10}   {end:21.10}");
        assert!((phi / snap - 1.0).abs() < 1e-10);
        assert!((end / slope - 1.0).abs() < 1e-10);
    }
    Ok(())
}
