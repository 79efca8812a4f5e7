//! Error messages: words, and numbers with their physical quantity, which a scene converts to its own units.

use std::fmt;

/// Physical quantity of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A number without a unit: a stretch, an angle, a share.
    Ratio,
    /// A time.
    Time,
    /// A length.
    Length,
    /// A mass.
    Mass,
    /// A velocity.
    Velocity,
    /// An acceleration.
    Acceleration,
    /// An angular velocity.
    AngularVelocity,
    /// A rate of change, per time; a frequency.
    Rate,
    /// A mass times a length squared.
    Inertia,
    /// A force.
    Force,
    /// A force per length.
    Distributed,
    /// A force per time.
    ForceRate,
    /// A couple, or an energy.
    Couple,
    /// A couple per time.
    CoupleRate,
    /// A force per velocity.
    Drag,
    /// A couple per angular velocity; an angular momentum has the same unit.
    RotationalDrag,
    /// A curvature or a twist.
    Curvature,
    /// The rate of a curvature.
    CurvatureRate,
    /// A stiffness between the strains i and j of (u1, .. v3).
    Stiffness(usize, usize),
    /// A viscosity between the strains i and j.
    Viscosity(usize, usize),
}

impl Quantity {
    /// Quantity of a strain, by its index in (u1, u2, u3, v1, v2, v3).
    pub fn of_strain(i: usize) -> Self {
        if i < 3 { Self::Curvature } else { Self::Ratio }
    }

    /// Quantity of a component of (angular velocity, velocity).
    pub fn of_twist(i: usize) -> Self {
        if i < 3 {
            Self::AngularVelocity
        } else {
            Self::Velocity
        }
    }

    /// Unit of the rod as written: of its length L, its bending stiffness EI and the mass it carries.
    fn of_rod(self) -> &'static str {
        match self {
            Self::Force => "EI/L^2",
            Self::Couple => "EI/L",
            _ => "",
        }
    }
}

/// Units for messages: size of one unit of the rod, and symbol.
pub type InUnits<'a> = &'a dyn Fn(Quantity) -> (f64, &'static str);

/// Words and numbers of a message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Message(Vec<MessagePart>);

#[derive(Debug, Clone, PartialEq)]
enum MessagePart {
    Words(String),
    /// A number, rounded to the given number of digits.
    Number(f64, Quantity, usize),
    List(Vec<(f64, Quantity)>),
}

/// Digits of a number that a reader compares, and of one with a meaningful size only.
pub(super) const DIGITS: usize = 6;
const ROUGH: usize = 2;

impl Message {
    /// Appends words.
    pub fn words(mut self, words: impl Into<String>) -> Self {
        self.0.push(MessagePart::Words(words.into()));
        self
    }

    /// Appends a number in units of the rod.
    pub fn number(mut self, value: f64, of: Quantity) -> Self {
        self.0.push(MessagePart::Number(value, of, DIGITS));
        self
    }

    /// Appends a number with a meaningful size only.
    pub fn size(mut self, value: f64, of: Quantity) -> Self {
        self.0.push(MessagePart::Number(value, of, ROUGH));
        self
    }

    /// Appends numbers in brackets; `of` gives the quantity by index.
    pub fn list(mut self, values: &[f64], of: impl Fn(usize) -> Quantity) -> Self {
        let values = values.iter().enumerate();
        let list = values.map(|(i, x)| (*x, of(i))).collect();
        self.0.push(MessagePart::List(list));
        self
    }

    /// Appends another message.
    pub fn then(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// This message with all numbers converted to the given units, as text.
    #[must_use]
    pub fn in_units(&self, units: InUnits<'_>) -> Self {
        self.text_in_units(units).into()
    }

    fn text_in_units(&self, units: InUnits<'_>) -> String {
        self.0
            .iter()
            .map(|part| part.text_in_units(units))
            .collect()
    }
}

impl MessagePart {
    fn text_in_units(&self, units: InUnits<'_>) -> String {
        let number = |value: f64, of, digits| {
            let (size, symbol) = units(of);
            (format_rounded(value * size, digits), symbol)
        };
        match self {
            Self::Words(words) => words.clone(),
            Self::Number(value, of, digits) => {
                let (text, symbol) = number(*value, *of, *digits);
                join_unit(text, symbol)
            }
            Self::List(list) => {
                let numbers = list.iter().map(|(value, of)| number(*value, *of, DIGITS));
                let numbers: Vec<(String, &str)> = numbers.collect();
                let common = numbers.first().map_or("", |(_, symbol)| symbol);
                let same = numbers.iter().all(|(_, symbol)| *symbol == common);
                let each = |(text, symbol): &(String, &'static str)| {
                    if same {
                        text.clone()
                    } else {
                        join_unit(text.clone(), symbol)
                    }
                };
                let texts: Vec<String> = numbers.iter().map(each).collect();
                let list = format!("[{}]", texts.join(", "));
                join_unit(list, if same { common } else { "" })
            }
        }
    }
}

/// A number, or a list of numbers, with its unit.
fn join_unit(text: String, symbol: &str) -> String {
    match symbol {
        "" => text,
        _ => format!("{text} {symbol}"),
    }
}

/// A rounded number, with an exponent if very small or large.
pub(super) fn format_rounded(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    if x == 0.0 || !x.is_finite() || (1e-3..1e6).contains(&x.abs()) {
        format!("{}", rounded + 0.0)
    } else {
        format!("{rounded:e}")
    }
}

impl From<String> for Message {
    fn from(words: String) -> Self {
        Self(vec![MessagePart::Words(words)])
    }
}

impl From<&str> for Message {
    fn from(words: &str) -> Self {
        words.to_owned().into()
    }
}

/// The message in units of the rod.
impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text_in_units(&|of| (1.0, of.of_rod())))
    }
}
