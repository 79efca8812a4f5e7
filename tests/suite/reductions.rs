//! Exact reductions of a rod with a body to ordinary differential equations.
