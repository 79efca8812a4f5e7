//! Colours: readable with colour-blind eyes and in grey print.

/// A colour, 8 bits each of red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Colour(pub u8, pub u8, pub u8);

pub(crate) const BLACK: Colour = Colour(0, 0, 0);
pub(crate) const WHITE: Colour = Colour(255, 255, 255);
/// Colour of text and frames.
pub(crate) const INK: Colour = Colour(38, 38, 38);
/// Colour of auxiliary lines.
pub(crate) const GREY: Colour = Colour(150, 150, 150);
/// Grid lines.
pub(crate) const FAINT: Colour = Colour(225, 225, 225);
/// Colour of the most important things: snaps, the motion's path on a surface.
pub(crate) const ALARM: Colour = Colour(200, 30, 60);

/// Okabe and Ito's palette without its yellow, which is lost on white paper, followed by dark and dull
/// colours of different lightness.
const CATEGORIES: [Colour; 10] = [
    Colour(0, 114, 178),
    Colour(213, 94, 0),
    Colour(0, 158, 115),
    Colour(204, 121, 167),
    Colour(230, 159, 0),
    Colour(86, 180, 233),
    Colour(90, 90, 90),
    Colour(120, 70, 40),
    Colour(80, 45, 140),
    Colour(150, 150, 30),
];

/// The i-th colour for things without an order; repeats after ten.
pub(crate) fn category(i: usize) -> Colour {
    CATEGORIES[i % CATEGORIES.len()]
}

/// Viridis at nine equal steps.
const VIRIDIS: [Colour; 9] = [
    Colour(68, 1, 84),
    Colour(71, 44, 122),
    Colour(59, 81, 139),
    Colour(44, 113, 142),
    Colour(33, 144, 141),
    Colour(39, 173, 129),
    Colour(92, 200, 99),
    Colour(170, 220, 50),
    Colour(253, 231, 37),
];

/// An ordered colour at t in [0, 1], dark to light, for areas.
pub(crate) fn sequential(t: f64) -> Colour {
    along(&VIRIDIS, t)
}

/// As `sequential`, for thin lines on white: stops before the yellow.
pub(crate) fn sequential_line(t: f64) -> Colour {
    sequential(0.86 * t.clamp(0.0, 1.0))
}

/// Blue through near white to red at seven equal steps; both ends about as dark.
const DIVERGING: [Colour; 7] = [
    Colour(22, 48, 110),
    Colour(62, 122, 184),
    Colour(161, 203, 227),
    Colour(247, 246, 243),
    Colour(246, 188, 150),
    Colour(209, 96, 62),
    Colour(112, 18, 36),
];

/// A colour at t in [0, 1] for numbers of both signs, the middle for zero.
pub(crate) fn diverging(t: f64) -> Colour {
    along(&DIVERGING, t)
}

fn along(steps: &[Colour], t: f64) -> Colour {
    let at = t.clamp(0.0, 1.0) * (steps.len() - 1) as f64;
    let i = (at.floor() as usize).min(steps.len() - 2);
    steps[i].mix(steps[i + 1], at - i as f64)
}

impl Colour {
    /// Mixes this colour with the part `t` in [0, 1] of another.
    pub(crate) fn mix(self, other: Colour, t: f64) -> Colour {
        let part = |a: u8, b: u8| (f64::from(a) + t * (f64::from(b) - f64::from(a))).round() as u8;
        Colour(
            part(self.0, other.0),
            part(self.1, other.1),
            part(self.2, other.2),
        )
    }

    /// Variant of this colour for unstable equilibria: nearly grey, duller than the pale back of stable sheets.
    pub(crate) fn unstable(self) -> Colour {
        self.mix(Colour(125, 125, 125), 0.66)
    }

    /// A paler version; 0 leaves it, 1 is white.
    pub(crate) fn tint(self, t: f64) -> Colour {
        self.mix(WHITE, t)
    }

    /// A darker version; 0 leaves it, 1 is black.
    pub(crate) fn shade(self, t: f64) -> Colour {
        self.mix(BLACK, t)
    }
}
