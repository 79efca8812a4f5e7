//! Sets of numbers allowed in fields.

/// A set of numbers. `holds` is false for NaN.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    /// Allowed numbers; completes "must be ...".
    pub allowed: &'static str,
    /// Membership.
    pub holds: fn(f64) -> bool,
    /// Advice on a number outside the set.
    pub hint: fn(f64) -> Option<&'static str>,
}

pub(super) const SILENT: fn(f64) -> Option<&'static str> = |_| None;

pub(super) static FINITE: Rule = Rule {
    allowed: "a finite number",
    holds: f64::is_finite,
    hint: SILENT,
};
pub(super) static POSITIVE: Rule = Rule {
    allowed: "a finite number > 0",
    holds: |x| 0.0 < x && x < f64::INFINITY,
    hint: SILENT,
};
pub(super) static NON_NEGATIVE: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: |x| (0.0..f64::INFINITY).contains(&x),
    hint: SILENT,
};
pub(super) static STRETCH: Rule = Rule {
    allowed: "a finite number >= 1",
    holds: |x| (1.0..f64::INFINITY).contains(&x),
    hint: |x| {
        (0.0..1.0)
            .contains(&x)
            .then_some("a compressed membrane wrinkles")
    },
};
/// Bounds on sizes within which all derived scales neither over- nor underflow.
pub(super) const SIZES: (f64, f64) = (1e-40, 1e40);
/// A number whose square is finite.
pub(super) static PART: Rule = Rule {
    allowed: "a number from 0 to 1",
    holds: |x| (0.0..=1.0).contains(&x),
    hint: SILENT,
};
pub(super) static VALUE: Rule = Rule {
    allowed: "a finite number",
    holds: |x| x.abs() <= SIZES.1,
    hint: |x| {
        let large = x.is_finite() && !(x.abs() <= SIZES.1);
        large.then_some("its size is above 1e40: choose units nearer to the rod's size")
    },
};
/// A number > 0 from which scales are made.
pub(super) static SIZE: Rule = Rule {
    allowed: "a finite number > 0",
    holds: |x| (SIZES.0..=SIZES.1).contains(&x),
    hint: |x| {
        let extreme = 0.0 < x && x < f64::INFINITY && !(SIZES.0..=SIZES.1).contains(&x);
        extreme.then_some("it is not in [1e-40, 1e40]: choose units nearer to the rod's size")
    },
};
/// A size, or 0.
pub(super) static SIZE_OR_0: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: |x| x == 0.0 || (SIZE.holds)(x),
    hint: SIZE.hint,
};
pub(super) static STIFFNESS: Rule = Rule {
    allowed: SIZE.allowed,
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some(
            "with a zero stiffness the load determines no strain; a strain that cannot occur is \"rigid\"",
        ),
        _ if x < 0.0 => Some("with a negative stiffness the law is not convex"),
        f64::INFINITY => Some("a strain that cannot occur is \"rigid\""),
        _ => (SIZE.hint)(x),
    },
};
pub(super) static LAMBDA: Rule = Rule {
    allowed: "a number in (0, 1e4]",
    holds: |x| 0.0 < x && x <= 1e4,
    hint: SILENT,
};
pub(super) static KAPPA: Rule = Rule {
    allowed: "a number in (-1, 1), not 0",
    holds: |x| -1.0 < x && x < 1.0 && x != 0.0,
    hint: |x| match x.abs() {
        0.0 => Some("kappa = 0 is the straight rod, whatever lambda: bend it a little"),
        1.0 => {
            Some("kappa = 1 is the infinitely taut rod; write p, kappa = tanh p, for a rod near it")
        }
        _ => None,
    },
};
pub(super) static P: Rule = Rule {
    allowed: "a number in [-1e4, 1e4], not 0",
    holds: |x| (-1e4..=1e4).contains(&x) && x != 0.0,
    hint: |x| (x == 0.0).then_some("p = 0 is the straight rod, whatever lambda: bend it a little"),
};
/// An angle in radians, small but well above rounding.
pub(super) static IMPERFECTION: Rule = Rule {
    allowed: "a number in [-0.5, 0.5], 0 or at least 1e-9 in size",
    holds: |x| x == 0.0 || (1e-9..=0.5).contains(&x.abs()),
    hint: SILENT,
};
pub(super) static TOLERANCE: Rule = Rule {
    allowed: "a number in [1e-14, 1e-2]",
    holds: |x| (1e-14..=1e-2).contains(&x),
    hint: SILENT,
};
pub(super) static SOLVE_TOLERANCE: Rule = Rule {
    allowed: "a number in [1e-13, 1e-4]",
    holds: |x| (1e-13..=1e-4).contains(&x),
    hint: SILENT,
};
pub(super) static POISSON: Rule = Rule {
    allowed: "a number in (-1, 0.5]",
    // The bound above -1 keeps E / (2 (1 + nu)) finite.
    holds: |x| (-1.0 + 1e-9..=0.5).contains(&x),
    hint: SILENT,
};
pub(super) static SHEAR_FACTOR: Rule = Rule {
    allowed: "a number in (0, 1]",
    holds: |x| SIZES.0 <= x && x <= 1.0,
    hint: SILENT,
};
/// Outside this interval the inverse of the friction law loses digits.
pub(super) static EXPONENT: Rule = Rule {
    allowed: "a number in [0.1, 10]",
    holds: |x| (0.1..=10.0).contains(&x),
    hint: |x| {
        (x == 0.0)
            .then_some("friction that does not grow with the rate is dry: not a law of this kind")
    },
};
pub(super) static ETA: Rule = Rule {
    allowed: "a finite number >= 0, stiffness times time; or a table such as \
              { viscosity = 0.1, exponent = 0.5, rate = 1.0 } or { proportional = 0.05 }",
    holds: NON_NEGATIVE.holds,
    hint: |x| {
        (x < 0.0).then_some("friction that feeds energy to the rod has no solution that lasts")
    },
};
/// A number > 0, for a damping written in a table, where 0 is not allowed.
pub(super) static POSITIVE_DAMPING: Rule = Rule {
    allowed: POSITIVE.allowed,
    holds: POSITIVE.holds,
    hint: |x| (x == 0.0).then_some("an elastic rod has no damping: leave it out"),
};
pub(super) static STEP: Rule = Rule {
    allowed: "a number in (0, 1], a fraction of the way from `from` to `to`",
    holds: |x| 0.0 < x && x <= 1.0,
    hint: SILENT,
};
pub(super) static MOMENT: Rule = Rule {
    allowed: "a finite number > 0",
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some(
            "without a moment about an axis nothing says how the body turns about it: a needle has that of its thickness, \
             mass * diameter^2 / 8; a body without extension is a point mass: leave the inertia out, and write joint = \"ball\" where a rod holds it",
        ),
        _ => (SIZE.hint)(x),
    },
};
/// Diagonal entries of viscosities.
pub(super) static VISCOSITY: Rule = Rule {
    allowed: "a finite number > 0 where the section does not hold the strain rigid",
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some("without viscosity a strain has no rate; it must be > 0, however small"),
        _ => (SIZE.hint)(x),
    },
};
/// Diagonal entries of Maxwell branches.
pub(super) static MODULUS: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: |x| VALUE_RANGE.contains(&x),
    hint: VALUE.hint,
};
pub(super) const VALUE_RANGE: std::ops::RangeInclusive<f64> = 0.0..=1e40;
