//! Lagrange polynomials: 1 at one node and 0 at the others.

/// Values at `x` of the Lagrange polynomials of the nodes.
pub(crate) fn lagrange<const N: usize>(nodes: &[f64; N], x: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let others = (0..N).filter(|j| *j != i);
        others
            .map(|j| (x - nodes[j]) / (nodes[i] - nodes[j]))
            .product()
    })
}

/// Value at `x` of the Lagrange polynomial of node j, for the nodes and 0.
pub(super) fn lagrange_from_zero(nodes: &[f64], j: usize, x: f64) -> f64 {
    let c = nodes[j];
    let others = (0..nodes.len()).filter(|k| *k != j);
    others.fold(x / c, |product, k| {
        product * (x - nodes[k]) / (c - nodes[k])
    })
}

/// Derivative of [`lagrange_from_zero`].
pub(super) fn slope_of_lagrange_from_zero(nodes: &[f64], j: usize, x: f64) -> f64 {
    let roots: Vec<f64> = std::iter::once(0.0)
        .chain((0..nodes.len()).filter(|k| *k != j).map(|k| nodes[k]))
        .collect();
    let without = |left: usize| -> f64 {
        let others = roots.iter().enumerate().filter(|(k, _)| *k != left);
        others
            .map(|(_, root)| (x - root) / (nodes[j] - root))
            .product()
    };
    (0..roots.len())
        .map(|k| without(k) / (nodes[j] - roots[k]))
        .sum()
}
