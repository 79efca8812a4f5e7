//! Tables of collocation rules with at most nine nodes on [-1, 1], by Legendre polynomials, at compile time.

/// Legendre polynomials P_0 .. P_8 at x.
pub(crate) const fn legendre(x: f64) -> [f64; 9] {
    let mut p = [1.0, x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut k = 1;
    while k < 8 {
        let n = k as f64;
        p[k + 1] = ((2.0 * n + 1.0) * x * p[k] - n * p[k - 1]) / (n + 1.0);
        k += 1;
    }
    p
}

/// Contributions, by `[j][k]`, of the value at node j to the coefficient of P_k. Nine nodes are those of Lobatto's
/// rule, fewer those of Gauss's rule.
pub(crate) const fn mode_table<const N: usize>(
    nodes: &[f64; N],
    weights: &[f64; N],
) -> [[f64; N]; N] {
    let mut modes = [[0.0; N]; N];
    let mut j = 0;
    while j < N {
        let p = legendre(nodes[j]);
        let mut k = 0;
        while k < N {
            // Lobatto's rule gives 1/4 for the integral of P_8^2.
            let size = if k == 8 { 4.0 } else { k as f64 + 0.5 };
            modes[j][k] = size * weights[j] * p[k];
            k += 1;
        }
        j += 1;
    }
    modes
}

/// Integrals a_ij, by `[j][i]`, up to place i of the polynomial of node j on [0, 1]: int_{-1}^x P_k = (P_{k+1} -
/// P_{k-1})/(2k + 1), half of it on [0, 1].
pub(crate) const fn integral_table<const N: usize>(
    modes: &[[f64; N]; N],
    places: &[f64; 8],
) -> [[f64; 8]; N] {
    let mut integrals = [[0.0; 8]; N];
    let mut j = 0;
    while j < N {
        let mut i = 0;
        while i < 8 {
            let x = places[i];
            let p = legendre(x);
            let ninth = (17.0 * x * p[8] - 8.0 * p[7]) / 9.0;
            let mut sum = modes[j][0] * (1.0 + x);
            let mut k = 1;
            while k < N {
                let next = if k == 8 { ninth } else { p[k + 1] };
                sum += modes[j][k] * (next - p[k - 1]) / (2 * k + 1) as f64;
                k += 1;
            }
            integrals[j][i] = 0.5 * sum;
            i += 1;
        }
        j += 1;
    }
    integrals
}
