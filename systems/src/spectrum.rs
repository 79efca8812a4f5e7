//! Eigenvalues of nonsymmetric matrices, by Francis' double-shift QR.
//!
//! The matrix is balanced and brought to Hessenberg form; double-shift steps then split off one or two eigenvalues at
//! a time, as in LAPACK's `dlahqr`. Eigenvalues of high multiplicity, such as the rates of dashpots, can make the
//! usual shifts cycle, which exceptional shifts break. Entries below the diagonal are dropped if they change the two
//! eigenvalues beside them by no more than rounding (Ahues and Tisseur, 1997).

use nalgebra::linalg::{Hessenberg, balancing::balance_parlett_reinsch};
use nalgebra::{Complex, DMatrix};

/// Largest number of steps until eigenvalues split off; there are seldom more than three.
const MOST: usize = 300;
/// Number of steps between exceptional shifts, by turns from the lower and from the upper end.
const EXCEPTIONAL: usize = 10;

/// All eigenvalues; None if the method does not converge.
pub(crate) fn eigenvalues(mut matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.nrows() < 2 {
        return Some(matrix.iter().map(|x| Complex::from(*x)).collect());
    }
    balance_parlett_reinsch(&mut matrix);
    let mut h = Hessenberg::new(matrix).unpack_h();
    let mut all = Vec::with_capacity(h.nrows());
    let (mut end, mut steps) = (h.nrows(), 0);
    while end > 0 {
        let start = split(&mut h, end);
        match end - start {
            1 => all.push(Complex::from(h[(start, start)])),
            2 => all.extend(pair(&h, start)),
            _ if steps == MOST => return None,
            _ => {
                steps += 1;
                let [one, other] = shifts(&h, start, end, steps);
                step(&mut h, start, end, one, other);
                continue;
            }
        }
        (end, steps) = (start, 0);
    }
    Some(all)
}

/// First row of the last unreduced block before `end`.
fn split(h: &mut DMatrix<f64>, end: usize) -> usize {
    for k in (1..end).rev() {
        let below = h[(k, k - 1)].abs();
        let (here, before) = (h[(k, k)], h[(k - 1, k - 1)]);
        let mut beside = here.abs() + before.abs();
        if beside == 0.0 {
            beside = h.column(k - 1).amax().max(h.row(k).amax());
        }
        if below <= f64::MIN_POSITIVE || below <= f64::EPSILON * beside {
            let above = h[(k - 1, k)].abs();
            let (much, little) = (below.max(above), below.min(above));
            let apart = (before - here).abs();
            let (far, near) = (here.abs().max(apart), here.abs().min(apart));
            let sum = far + much;
            let bound = (f64::EPSILON * near * (far / sum)).max(f64::MIN_POSITIVE);
            if sum == 0.0 || little * (much / sum) <= bound {
                h[(k, k - 1)] = 0.0;
                return k;
            }
        }
    }
    0
}

/// Eigenvalues of the two rows from `k` on.
fn pair(h: &DMatrix<f64>, k: usize) -> [Complex<f64>; 2] {
    let block = [h[(k, k)], h[(k, k + 1)], h[(k + 1, k)], h[(k + 1, k + 1)]];
    of_two(block)
}

/// Eigenvalues of a 2 x 2 matrix. The larger of two real ones gives the other, without cancellation.
fn of_two([a, b, c, d]: [f64; 4]) -> [Complex<f64>; 2] {
    let size = a.abs() + b.abs() + c.abs() + d.abs();
    if size == 0.0 {
        return [Complex::from(0.0); 2];
    }
    let [a, b, c, d] = [a, b, c, d].map(|x| x / size);
    let half = 0.5 * (a - d);
    let square = half * half + b * c;
    let root = square.abs().sqrt();
    if square < 0.0 {
        let mean = 0.5 * (a + d);
        return [root, -root].map(|im| Complex::new(mean, im) * size);
    }
    let far = half + root.copysign(half);
    let near = if far == 0.0 { 0.0 } else { b * c / far };
    [d + far, d - near].map(|x| Complex::from(x * size))
}

/// The two shifts of a step in the block: the eigenvalues of its last two rows or, if real, twice the one nearer to
/// the last entry.
fn shifts(h: &DMatrix<f64>, start: usize, end: usize, step: usize) -> [Complex<f64>; 2] {
    let last = h[(end - 1, end - 1)];
    if step.is_multiple_of(EXCEPTIONAL) {
        let (corner, size) = match step % (2 * EXCEPTIONAL) {
            0 => (last, h[(end - 1, end - 2)].abs()),
            _ => (h[(start, start)], h[(start + 1, start)].abs()),
        };
        let corner = corner + 0.75 * size;
        return of_two([corner, -0.4375 * size, size, corner]);
    }
    let [one, other] = pair(h, end - 2);
    match one.im == 0.0 {
        true if (one.re - last).abs() <= (other.re - last).abs() => [one; 2],
        true => [other; 2],
        false => [one, other],
    }
}

/// One step with two shifts, both real or conjugate, in the block. Only the block is transformed: eigenvectors are
/// not needed.
fn step(h: &mut DMatrix<f64>, start: usize, end: usize, one: Complex<f64>, other: Complex<f64>) {
    let first = |h: &DMatrix<f64>, m: usize| {
        let (here, next) = (h[(m, m)], h[(m + 1, m + 1)]);
        let below = h[(m + 1, m)];
        let size = (here - other.re).abs() + other.im.abs() + below.abs();
        let below = if size > 0.0 { below / size } else { 0.0 };
        let shifted = if size > 0.0 {
            (here - one.re) * ((here - other.re) / size) - one.im * (other.im / size)
        } else {
            0.0
        };
        let column = [
            below * h[(m, m + 1)] + shifted,
            below * (here + next - one.re - other.re),
            below * h[(m + 2, m + 1)],
        ];
        let sum: f64 = column.iter().map(|x| x.abs()).sum();
        column.map(|x| if sum > 0.0 { x / sum } else { x })
    };
    // If two consecutive entries below the diagonal are small, the step can begin there.
    let mut from = end - 3;
    let mut column = first(h, from);
    while from > start {
        let diagonal =
            h[(from - 1, from - 1)].abs() + h[(from, from)].abs() + h[(from + 1, from + 1)].abs();
        let leak = h[(from, from - 1)].abs() * (column[1].abs() + column[2].abs());
        if leak <= f64::EPSILON * column[0].abs() * diagonal {
            break;
        }
        from -= 1;
        column = first(h, from);
    }
    for k in from..end - 1 {
        let rows = (end - k).min(3);
        if k > from {
            column = [h[(k, k - 1)], h[(k + 1, k - 1)], 0.0];
            if rows == 3 {
                column[2] = h[(k + 2, k - 1)];
            }
        }
        let Some((beta, scale, mirror)) = reflection(column) else {
            continue;
        };
        if k > from {
            h[(k, k - 1)] = beta;
            h.view_mut((k + 1, k - 1), (rows - 1, 1)).fill(0.0);
        } else if from > start {
            h[(k, k - 1)] *= 1.0 - scale;
        }
        for j in k..end {
            let sum: f64 = (0..rows).map(|i| mirror[i] * h[(k + i, j)]).sum();
            for i in 0..rows {
                h[(k + i, j)] -= scale * sum * mirror[i];
            }
        }
        for j in start..end.min(k + 4) {
            let sum: f64 = (0..rows).map(|i| mirror[i] * h[(j, k + i)]).sum();
            for i in 0..rows {
                h[(j, k + i)] -= scale * sum * mirror[i];
            }
        }
    }
}

/// (b, s, u) with (1 - s u u^T) x = (b, 0, 0), u_0 = 1; None if x is (b, 0, 0) as it is.
fn reflection([x, y, z]: [f64; 3]) -> Option<(f64, f64, [f64; 3])> {
    let rest = y.hypot(z);
    if rest == 0.0 {
        return None;
    }
    let beta = -x.hypot(rest).copysign(x);
    let lead = x - beta;
    Some((beta, -lead / beta, [1.0, y / lead, z / lead]))
}

#[cfg(test)]
mod tests {
    use super::eigenvalues;
    use nalgebra::{Complex, DMatrix};

    /// Catches shifts that cycle, as the usual ones do for a permutation (its eigenvalues are the roots of 1). They
    /// also cycle for equal sections with two dashpots each, whose rates have high multiplicity: the roots of
    /// s + a = b/(1 + 2 s) + c/(1 + 20 s). No eigenvalue may be lost.
    #[test]
    fn rates_that_are_many_times_the_same() {
        let count = 6;
        let turning = DMatrix::from_fn(count, count, |i, j| f64::from(i == (j + 1) % count));
        let found = eigenvalues(turning).unwrap();
        assert_eq!(found.len(), count);
        assert!(
            found.iter().all(|s| (s.powu(6) - 1.0).norm() < 1e-13),
            "{found:?}"
        );
        assert!(found.iter().sum::<Complex<f64>>().norm() < 1e-13);

        let (a, b, c, alike) = (90.0, 25.0, 15.0, 30);
        let section = DMatrix::from_row_slice(3, 3, &[-a, b, c, 0.5, -0.5, 0.0, 0.05, 0.0, -0.05]);
        let found = eigenvalues(section.kronecker(&DMatrix::identity(alike, alike))).unwrap();
        let left = |s: f64| {
            (s + a) * (1.0 + 2.0 * s) * (1.0 + 20.0 * s)
                - b * (1.0 + 20.0 * s)
                - c * (1.0 + 2.0 * s)
        };
        for [low, high] in [[-91.0, -89.0], [-0.5, -0.1], [-0.05, 0.0]] {
            let own = found.iter().filter(|s| low < s.re && s.re < high);
            assert_eq!(own.clone().count(), alike);
            // By sign changes: a step of 1e-12 to either side crosses the root.
            assert!(
                own.clone().all(|s| {
                    let step = 1e-12 * (1.0 + s.re.abs());
                    s.im.abs() < step && left(s.re - step) * left(s.re + step) < 0.0
                }),
                "{found:?}"
            );
        }
    }
}
