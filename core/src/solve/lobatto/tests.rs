use super::*;
use nalgebra::Vector3;

/// x'' = -x with a force that is rough by `noise`, like a small difference of large terms: x, v and t.
struct Rough {
    noise: f64,
}

impl Rough {
    fn force(&self, x: f64) -> f64 {
        let scattered = x.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11;
        self.noise * (scattered as f64 / (1_u64 << 52) as f64 - 1.0) - x
    }
}

impl Sweeps for Rough {
    const PLACES: usize = 1;
    const ROWS: usize = 3;

    fn changing(&self) -> usize {
        3
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn begin(&mut self) {}

    fn forces<S: Simd>(&mut self, _: S, at: &NodeRows, slopes: &mut NodeRows) -> bool {
        for i in 0..8 {
            slopes.0[1][i] = self.force(at.0[0][i]);
            slopes.0[2][i] = 1.0;
        }
        true
    }

    fn moves<S: Simd>(&mut self, _: S, at: &NodeRows, slopes: &mut NodeRows) {
        slopes.0[0] = at.0[1];
    }
}

impl Eightwise<Vector3<f64>> for Rough {
    fn row(&self, state: &Vector3<f64>) -> Row {
        let mut row = [0.0; 8];
        row[..3].copy_from_slice(state.as_slice());
        row
    }

    fn state(&self, row: &Row) -> Vector3<f64> {
        Vector3::from_column_slice(&row[..3])
    }

    fn states(&self, at: &NodeRows) -> [Vector3<f64>; 8] {
        std::array::from_fn(|i| Vector3::new(at.0[0][i], at.0[1][i], at.0[2][i]))
    }

    fn solve(&mut self, step: &Unsolved, to: &mut Solved) -> Result<(), StepFailure> {
        solve(self, step, to)
    }
}

/// Catches parts of a step that are not solved although the step was, if rounding in the forces is about as large as
/// the error left by sweeps: convergence is then chance. A run could not end inside such a step, nor be sampled
/// there.
#[test]
fn parts_of_a_step_are_solved_where_the_step_was() {
    let tolerance = 1e-9;
    let (mut taken, mut parts) = (0, 0);
    for k in 0..8 {
        let motion = &mut Rough {
            noise: tolerance * (0.1 + 0.02 * f64::from(k)),
        };
        let (mut state, mut cost) = (Vector3::new(1.0, 0.0, 0.0), Cost::default());
        let mut steps = Lobatto::new(0.3, tolerance);
        for _ in 0..40 {
            let slope = Vector3::new(state[1], motion.force(state[0]), 1.0);
            let Some(step) = steps.step(&state, &slope, motion, 1.0, &mut cost) else {
                continue;
            };
            taken += 1;
            assert!(step.halves(motion, &mut cost).is_some(), "{k}: {taken}");
            for i in 1..50 {
                let h = step.h * f64::from(i) / 50.0;
                let part = step.redo(motion, h, &mut cost);
                let to = part.expect("the step was solved").to;
                let (sin, cos) = h.sin_cos();
                let [x, v] = [state[0], state[1]];
                let off =
                    (to - Vector3::new(x * cos + v * sin, v * cos - x * sin, state[2] + h)).norm();
                assert!(off < tolerance, "{k}: off by {off:e} after {h}");
                parts += 1;
            }
            state = step.to;
        }
    }
    assert!(taken > 160 && parts == 49 * taken, "{taken}");
}
