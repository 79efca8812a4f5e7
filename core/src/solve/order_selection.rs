//! Choice between the orders 9 and 13 of implicit steps: the cheaper one, found by occasional trials of the other.

use super::radau_stages::Order;

/// Largest error of steps at which order 13 is tried at all: above, it is rarely worth the cost of a trial.
const FINEST: f64 = 2e-11;
/// Order 13 is tried if the contraction of Newton's iteration is below this, in the mean of about MEAN steps. The
/// error then bounds the steps, and those of the higher order are longer.
const EASY: f64 = 0.08;
const MEAN: f64 = 8.0;
/// Contraction of the iteration beyond which order 13 is left at once: more stages then gain nothing.
const HARD: f64 = 0.2;
/// Steps of a trial, and those at its beginning that do not count, since their length is still that of the other
/// order.
const TRIAL: u32 = 12;
const SETTLING: u32 = 4;
/// Largest cost of the trial order, relative to the current one, for a change.
const BETTER: f64 = 0.9;
/// Steps from one trial to the next, at first and at most: each trial doubles them.
const PATIENCE: u32 = 48;
const PATIENCE_LIMIT: u32 = 512;

/// Fading sums over steps: number, work and length.
#[derive(Debug, Clone, Copy, Default)]
struct FadingSums {
    count: f64,
    work: f64,
    length: f64,
}

impl FadingSums {
    fn fade(&mut self) {
        for sum in [&mut self.count, &mut self.work, &mut self.length] {
            *sum -= *sum / MEAN;
        }
    }

    fn add(&mut self, work: f64, length: f64) {
        self.count += 1.0;
        self.work += work;
        self.length += length;
    }

    /// Work per unit of length.
    fn cost(&self) -> f64 {
        self.work / self.length
    }
}

/// The current order, with statistics for the choice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orders {
    now: Order,
    /// True if another order may be tried.
    free: bool,
    /// Mean logarithm of the contraction of Newton's iteration.
    ease: f64,
    /// Statistics of the last steps of this order.
    last: FadingSums,
    /// During a trial, the cost of a unit of length with the other order.
    other: Option<f64>,
    /// Steps until a trial is decided, or until the other order may be tried.
    left: u32,
    /// Length of the steps of order 9 when order 13 was last tried.
    short: f64,
    patience: u32,
}

impl Orders {
    /// The order that suits the tolerance, without statistics.
    pub(super) fn for_tolerance(tolerance: f64) -> Self {
        Self {
            now: Order::for_tolerance(tolerance),
            free: tolerance <= FINEST,
            ease: 0.0,
            last: FadingSums::default(),
            other: None,
            left: PATIENCE,
            short: f64::INFINITY,
            patience: PATIENCE,
        }
    }

    /// A fixed order.
    #[cfg(test)]
    pub(super) fn only(now: Order) -> Self {
        Self {
            now,
            ..Self::for_tolerance(1.0)
        }
    }

    /// Disables trials of the other order.
    pub(super) fn fix_order(&mut self) {
        self.free = false;
    }

    /// The order in use.
    pub(super) fn now(&self) -> Order {
        self.now
    }

    /// Records a failure of Newton's iteration.
    pub(super) fn record_failure(&mut self) {
        self.ease -= self.ease / MEAN;
    }

    /// Records a step of the given length and work, with the contraction of its iteration.
    pub(super) fn record_step(&mut self, contraction: f64, work: f64, length: f64) {
        self.ease += (contraction.max(f64::EPSILON).ln() - self.ease) / MEAN;
        self.left = self.left.saturating_sub(1);
        match self.other {
            Some(_) if self.left >= TRIAL - SETTLING => return,
            Some(_) => {}
            None => self.last.fade(),
        }
        self.last.add(work, length);
    }

    /// Chooses the order of the next step, which would have the length `h`. If the order changes, returns the length
    /// of the step with the new order.
    pub(super) fn choose(&mut self, h: f64) -> Option<f64> {
        if !self.free {
            return None;
        }
        let other = match self.now {
            Order::Thirteen => Order::Nine,
            _ => Order::Thirteen,
        };
        let hard = self.now == Order::Thirteen && self.ease > HARD.ln();
        if self.left > 0 && !hard {
            return None;
        }
        let before = self.other.take();
        let worse = before.is_some_and(|before| !(self.last.cost() < BETTER * before));
        if worse || hard {
            self.begin(other, self.patience);
            return Some(self.fit(h));
        }
        if before.is_some() {
            self.left = self.patience;
            return None;
        }
        if self.now != Order::Thirteen && !(self.ease < EASY.ln()) {
            return None;
        }
        if other == Order::Thirteen {
            self.short = self.last.length / self.last.count;
        }
        self.other = Some(self.last.cost());
        self.patience = (2 * self.patience).min(PATIENCE_LIMIT);
        self.begin(other, TRIAL);
        Some(self.fit(h))
    }

    /// First length with the current order, where the other had `h`: order 9 returns to its previous length.
    fn fit(&self, h: f64) -> f64 {
        match self.now {
            Order::Thirteen => h,
            _ => h.min(self.short),
        }
    }

    fn begin(&mut self, order: Order, left: u32) {
        (self.now, self.last, self.left) = (order, FadingSums::default(), left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fraction of steps of order 13, if these are `longer` times as long and Newton's iteration contracts by
    /// `contraction`.
    fn share(longer: f64, contraction: f64) -> f64 {
        let mut orders = Orders::for_tolerance(1e-12);
        let (mut count, mut h) = (0.0, 1.0);
        for _ in 0..4000 {
            h = orders.choose(h).unwrap_or(h);
            let (work, length) = match orders.now() {
                Order::Thirteen => (7.0, longer),
                _ => (5.0, 1.0),
            };
            h += 0.5 * (length - h);
            count += f64::from(orders.now() == Order::Thirteen) / 4000.0;
            orders.record_step(contraction, work, h);
        }
        count
    }

    /// Catches a costlier order that is kept, endless trials, and trials where none is allowed.
    #[test]
    fn the_order_that_costs_less_is_kept() {
        for (longer, contraction, expected) in [
            (1.0, 0.01, 0.0..0.05),
            (1.5, 0.01, 0.0..0.05),
            (1.7, 0.01, 0.95..1.0),
            (3.0, 0.01, 0.95..1.0),
            (3.0, 0.1, 0.0..1e-9),
            (3.0, 0.5, 0.0..1e-9),
        ] {
            let found = share(longer, contraction);
            assert!(
                expected.contains(&found),
                "{longer} times as long, {contraction}: {found}"
            );
        }
        let mut kept = Orders::for_tolerance(1e-12);
        kept.fix_order();
        for mut orders in [Orders::for_tolerance(1e-10), kept] {
            for _ in 0..1000 {
                assert_eq!(orders.choose(1.0), None);
                orders.record_step(0.01, 5.0, 1.0);
            }
        }
    }
}
