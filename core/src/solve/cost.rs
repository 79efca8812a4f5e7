//! Cost counters of an integration.

/// Cost counters of an integration; counters that a method lacks stay 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Cost {
    /// Evaluations of slopes, for all purposes.
    pub evaluations: u64,
    /// Accepted steps, of all methods.
    pub steps: u64,
    /// Accepted steps of Radau IIA.
    pub implicit_steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Jacobians evaluated.
    pub jacobians: u64,
    /// Factorised sets of matrices: one real and one complex matrix, at order 9 two complex ones, at order 13 three.
    pub factorisations: u64,
    /// Newton iterations: each takes a slope for every stage, and a solution with every matrix.
    pub iterations: u64,
    /// Interpolants built, and samples computed inside steps.
    pub samples: u64,
    /// Changes of method.
    pub switches: u64,
}

impl std::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            evaluations: self.evaluations + other.evaluations,
            steps: self.steps + other.steps,
            implicit_steps: self.implicit_steps + other.implicit_steps,
            rejected: self.rejected + other.rejected,
            jacobians: self.jacobians + other.jacobians,
            factorisations: self.factorisations + other.factorisations,
            iterations: self.iterations + other.iterations,
            samples: self.samples + other.samples,
            switches: self.switches + other.switches,
        }
    }
}
