//! A panel: a frame with two axes, into which data are drawn.

use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::{Pixel, clip, thin};
use super::legend::{Mark, draw_mark};
use super::palette::{Colour, FAINT, INK};
use super::text;
use super::ticks::{self, Tick};

/// Font sizes in pixels.
pub(crate) const TITLE: f64 = 14.0;
pub(crate) const LABEL: f64 = 13.0;
pub(crate) const SMALL: f64 = 11.5;

/// Length of a tick mark in the plane.
const MARK: f64 = 5.0;
/// Length of a tick mark in space.
pub(crate) const MARK_3D: f64 = 4.0;

/// Mapping of numbers to an axis or to colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Square roots: small values are separated better.
    #[default]
    Sqrt,
    /// Logarithms; the range must be positive.
    Log,
}

impl Scale {
    /// The mapped value, laid out in equal steps; NaN if a logarithm has no value.
    pub(crate) fn apply(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            // Not `max`, which would turn NaN into 0.
            Self::Sqrt if value < 0.0 => 0.0,
            Self::Sqrt => value.sqrt(),
            Self::Log if value > 0.0 => value.ln(),
            Self::Log => f64::NAN,
        }
    }
}

/// A range of numbers laid along an edge of a panel.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    pub lo: f64,
    pub hi: f64,
    pub scale: Scale,
    pub label: String,
    /// True if the marks carry numbers.
    pub numbered: bool,
    pub ticks: Vec<Tick>,
    /// Approximate number of marks; 0 if the marks are particular ones.
    pub wanted: usize,
}

impl Axis {
    /// An axis in equal steps of the scale from lo to hi, with about `wanted` marks.
    pub(crate) fn scaled(scale: Scale, lo: f64, hi: f64, label: &str, wanted: usize) -> Self {
        Self {
            lo,
            hi,
            scale,
            label: label.to_string(),
            numbered: true,
            ticks: match scale {
                Scale::Linear => ticks::linear(lo, hi, wanted),
                Scale::Sqrt => ticks::roots(lo, hi, wanted),
                Scale::Log => ticks::log(lo, hi, wanted),
            },
            wanted,
        }
    }

    /// Renews the marks of an axis whose length changes by the factor `times`.
    pub(crate) fn stretch(&mut self, times: f64) {
        if self.wanted > 0 {
            let wanted = (self.wanted as f64 * times).round().max(3.0) as usize;
            let (numbered, label) = (self.numbered, std::mem::take(&mut self.label));
            *self = Self::scaled(self.scale, self.lo, self.hi, &label, wanted);
            self.numbered = numbered;
        }
    }

    /// A linear axis from lo to hi.
    pub(crate) fn linear(lo: f64, hi: f64, label: &str, wanted: usize) -> Self {
        Self::scaled(Scale::Linear, lo, hi, label, wanted)
    }

    /// A logarithmic axis from lo > 0 to hi.
    pub(crate) fn log(lo: f64, hi: f64, label: &str, wanted: usize) -> Self {
        Self::scaled(Scale::Log, lo, hi, label, wanted)
    }

    /// Widens a linear axis about the middle to at least this span.
    pub(crate) fn widen(&mut self, span: f64) {
        let extra = 0.5 * (span - (self.hi - self.lo));
        if extra > 1e-9 * span {
            let wanted = if self.wanted == 0 {
                5
            } else {
                self.wanted.min(5)
            };
            *self = Self::linear(self.lo - extra, self.hi + extra, &self.label, wanted);
        }
    }

    /// An axis for all finite values, with a margin of a twentieth; `None` without values.
    pub(crate) fn fit<'a>(
        values: impl IntoIterator<Item = &'a f64>,
        log: bool,
        label: &str,
        wanted: usize,
    ) -> Option<Self> {
        let (lo, hi) = extent(values.into_iter().filter(|v| !log || **v > 0.0))?;
        if log {
            let factor = 10f64.powf((0.05 * (hi / lo).log10()).max(0.15));
            let (lo, hi) = ((lo / factor).max(1e-300), (hi * factor).min(1e300));
            return Some(Self::log(lo, hi, label, wanted));
        }
        let span = if hi > lo {
            hi - lo
        } else {
            lo.abs().max(1.0) * 0.2
        };
        let margin = 0.05 * span;
        Some(Self::linear(lo - margin, hi + margin, label, wanted))
    }

    /// An axis over the given range, or else one that holds the values. A spread of mere roundoff is not magnified.
    pub(crate) fn over(
        values: &[f64],
        range: Option<[f64; 2]>,
        label: &str,
        wanted: usize,
    ) -> Option<Self> {
        if let Some([lo, hi]) = range.filter(|[lo, hi]| lo < hi && (hi - lo).is_finite()) {
            return Some(Self::linear(lo, hi, label, wanted));
        }
        let (lo, hi) = extent(values)?;
        if !(hi - lo > 1e-9 * lo.abs().max(hi.abs())) {
            return Self::fit(&[0.5 * lo + 0.5 * hi], false, label, wanted);
        }
        Self::fit(values, false, label, wanted)
    }

    /// The axis without numbers and name, for a panel that shares the axis of the one below.
    pub(crate) fn bare(&self) -> Self {
        Self {
            label: String::new(),
            numbered: false,
            ..self.clone()
        }
    }

    /// Position of `value` on the axis: 0 at lo, 1 at hi; NaN if a logarithm has no value.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let [value, lo, hi] = [value, self.lo, self.hi].map(|v| self.scale.apply(v));
        (value - lo) / (hi - lo)
    }

    /// Width of the tick labels of a vertical axis.
    pub(crate) fn label_width(&self) -> f64 {
        self.ticks
            .iter()
            .filter_map(|tick| tick.label.as_deref())
            .map(|label| text::width(label, SMALL))
            .fold(0.0, f64::max)
    }
}

/// The least and the largest of the finite values.
pub(crate) fn extent<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|v| v.is_finite());
    let ends = finite.fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    (ends.0 <= ends.1).then_some(ends)
}

/// A rectangle of the canvas with its axes.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: Axis,
    pub y: Axis,
}

impl Panel {
    /// The pixel of a data point; not finite if the point is not.
    pub(crate) fn at(&self, x: f64, y: f64) -> Pixel {
        (
            self.left + self.width * self.x.place(x),
            self.top + self.height * (1.0 - self.y.place(y)),
        )
    }

    pub(crate) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Pixels of a curve.
    pub(crate) fn pixels(&self, x: &[f64], y: &[f64]) -> Vec<Pixel> {
        x.iter().zip(y).map(|(&x, &y)| self.at(x, y)).collect()
    }

    /// Draws a curve, cut at the frame.
    pub(crate) fn line(&self, canvas: &mut Canvas, x: &[f64], y: &[f64], pen: Pen) {
        self.pixel_line(canvas, &self.pixels(x, y), pen);
    }

    /// Draws a line given in pixels, cut at the frame and thinned to what can be seen.
    pub(crate) fn pixel_line(&self, canvas: &mut Canvas, points: &[Pixel], pen: Pen) {
        for run in clip(points, self.edges()) {
            canvas.line(&thin(&run, 0.06), pen);
        }
    }

    /// Draws a line from the lower to the upper edge.
    pub(crate) fn upright(&self, canvas: &mut Canvas, x: f64, pen: Pen) {
        self.line(canvas, &[x; 2], &[self.y.lo, self.y.hi], pen);
    }

    /// Draws a line from the left to the right edge.
    pub(crate) fn level(&self, canvas: &mut Canvas, y: f64, pen: Pen) {
        self.line(canvas, &[self.x.lo, self.x.hi], &[y; 2], pen);
    }

    /// Draws a mark at a pixel in the frame; nothing outside.
    pub(crate) fn mark(&self, canvas: &mut Canvas, at: Pixel, mark: Mark, r: f64, colour: Colour) {
        if self.holds(at) {
            draw_mark(canvas, at, mark, r, colour);
        }
    }

    /// The edges [left, top, right, bottom].
    pub(crate) fn edges(&self) -> [f64; 4] {
        [self.left, self.top, self.right(), self.bottom()]
    }

    /// The corners, the first again at the end.
    pub(crate) fn ring(&self) -> [Pixel; 5] {
        let [l, t, r, b] = self.edges();
        [(l, t), (r, t), (r, b), (l, b), (l, t)]
    }

    /// True if the pixel lies in the frame.
    pub(crate) fn holds(&self, p: Pixel) -> bool {
        let [l, t, r, b] = self.edges();
        (l - 0.5..=r + 0.5).contains(&p.0) && (t - 0.5..=b + 0.5).contains(&p.1)
    }

    /// Draws faint lines at the labelled ticks, under the data.
    pub(crate) fn grid(&self, canvas: &mut Canvas) {
        let pen = Pen::new(FAINT, 0.7);
        let [l, t, r, b] = self.edges();
        for tick in self.x.ticks.iter().filter(|t| t.label.is_some()) {
            let x = self.at(tick.value, self.y.lo).0;
            canvas.line(&[(x, t), (x, b)], pen);
        }
        for tick in self.y.ticks.iter().filter(|t| t.label.is_some()) {
            let y = self.at(self.x.lo, tick.value).1;
            canvas.line(&[(l, y), (r, y)], pen);
        }
    }

    /// Draws frame, tick marks, numbers and names, over the data.
    pub(crate) fn frame(&self, canvas: &mut Canvas) {
        let pen = Pen::new(INK, 0.9);
        let [l, t, r, b] = self.edges();
        canvas.line(&self.ring(), pen);
        let mark = |tick: &Tick| {
            if tick.label.is_some() {
                MARK
            } else {
                0.55 * MARK
            }
        };
        let below = Type::new(SMALL, Side::Middle, Side::Start);
        for tick in &self.x.ticks {
            let x = self.at(tick.value, self.y.lo).0;
            canvas.line(&[(x, b), (x, b + mark(tick))], pen);
            if let (Some(label), true) = (&tick.label, self.x.numbered) {
                canvas.text((x, b + MARK + 3.0), label, below);
            }
        }
        let beside = Type::new(SMALL, Side::End, Side::Middle);
        for tick in &self.y.ticks {
            let y = self.at(self.x.lo, tick.value).1;
            canvas.line(&[(l - mark(tick), y), (l, y)], pen);
            if let Some(label) = &tick.label {
                canvas.text((l - MARK - 3.0, y), label, beside);
            }
        }
        let name = Type::new(LABEL, Side::Middle, Side::Start);
        let at = (0.5 * (l + r), b + MARK + 3.0 + SMALL + 6.0);
        canvas.text(at, &self.x.label, name);
        let name = Type::new(LABEL, Side::Middle, Side::End).upwards();
        let beside = l - MARK - 3.0 - self.y.label_width() - 5.0;
        canvas.text((beside, 0.5 * (t + b)), &self.y.label, name);
    }
}

/// Width left of a panel for its y axis.
pub(crate) fn room_left(y: &Axis) -> f64 {
    MARK + 3.0 + y.label_width() + 5.0 + LABEL + 12.0
}

/// Height under a panel for its x axis.
pub(crate) const ROOM_BELOW: f64 = MARK + 3.0 + SMALL + 6.0 + LABEL + 9.0;
