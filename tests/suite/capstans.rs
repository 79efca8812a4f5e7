//! Rods wound on a drum with friction, as all of the contact slips.

use crate::impacts::near;
use snaprod::rod::contact::Capstan;

/// Catches friction or a point reaction that is left out where the rod leaves the drum: given rows of another program
/// (radius, turn, friction, held tension; pull, lift-off angles, point reactions, wrapped angle).
#[test]
fn all_of_a_rod_slips_at_the_given_pull() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let rows = [
        (
            [1.0, PI, 0.3, 4.0],
            9.581396121464413,
            [0.5053605102841573, 0.3244834523343571],
            [1.9364916731037085, 3.054733396135318],
            2.311748690971279,
        ),
        (
            [0.5, FRAC_PI_2, 0.2, 30.0],
            40.53029178651128,
            [0.36720802055783713, 0.3154586167100674],
            [10.770329614269007, 12.574623936565462],
            0.888129689526992,
        ),
        (
            [1.0, PI, 0.0, 4.0],
            4.0,
            [0.5053605102841573; 2],
            [1.9364916731037085; 2],
            2.1308716330214788,
        ),
    ];
    for ([radius, turn, friction, held], pull, angles, reactions, wrapped) in rows {
        // Another unit of force: the pulls scale with the stiffness.
        for stiffness in [1.0, 7.0] {
            let rod = Capstan::new(stiffness, radius, turn, friction).expect("a capstan");
            let slip = rod.slip(held * stiffness).expect("slip");
            near(slip.pulled.pull / stiffness, pull, 1e-13);
            near(slip.wrapped, wrapped, 1e-13);
            for (side, k) in [(slip.held, 0), (slip.pulled, 1)] {
                near(side.lift_off, angles[k], 1e-13);
                near(side.reaction / stiffness, reactions[k], 1e-13);
            }
        }
    }
}

/// Catches a state of slip where there is none.
#[test]
fn rods_that_cannot_slip_round_a_drum_are_refused() {
    let words = |made: snaprod::Result<snaprod::rod::contact::CapstanSlip>| {
        made.expect_err("refused").to_string()
    };
    let rod = |turn: f64, friction: f64| Capstan::new(1.0, 1.0, turn, friction).expect("a rod");
    let loose = words(rod(3.0, 0.3).slip(0.25));
    assert!(loose.contains("a looser rod"), "{loose}");
    let point = words(rod(0.5, 0.3).slip(4.0));
    assert!(point.contains("at a point"), "{point}");
    for bad in [f64::NAN, -1.0, 0.0] {
        assert!(Capstan::new(1.0, bad, 1.0, 0.0).is_err());
    }
    assert!(Capstan::new(1.0, 1.0, 1.0, f64::NAN).is_err());
}
