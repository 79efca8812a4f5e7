//! What an integration costs.

/// Counts of what an integration cost; a method leaves at 0 what it does not have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Cost {
    /// Slopes evaluated, all purposes.
    pub evaluations: u64,
    /// Steps accepted, all.
    pub steps: u64,
    /// Steps of Radau IIA among them.
    pub implicit_steps: u64,
    /// Steps tried and given up.
    pub rejected: u64,
    /// Jacobians evaluated.
    pub jacobians: u64,
    /// Sets of matrices factored, a real one and one complex one, at order 9 two, at order 13 three.
    pub factorisations: u64,
    /// Newton iterations: a slope for every stage, and a solution with every matrix.
    pub iterations: u64,
    /// Interpolants built and samples computed inside steps.
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
