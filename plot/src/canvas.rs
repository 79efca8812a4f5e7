//! A sheet of paper in pixels, on plotters' SVG backend.
//!
//! The backend knows whole pixels only, so everything is drawn ten times too large and the first
//! tag then shows it at its true size: a resolution of a tenth of a pixel.

use super::geometry::{Pixel, finite};
use super::palette::{Colour, INK, WHITE};
use plotters::element::{DashedPathElement, Drawable};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const OVERSAMPLING: f64 = 10.0;
const FAMILY: &str = "DejaVu Sans, sans-serif";
/// Factor by which plotters divides font sizes in SVG.
const FONT_FACTOR: f64 = 1.24;

/// Style of a line; widths and dashes in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pen {
    pub colour: Colour,
    pub width: f64,
    pub alpha: f64,
    /// Dash pattern: length drawn, length left out.
    pub dash: Option<(f64, f64)>,
}

impl Pen {
    pub(crate) const fn new(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            alpha: 1.0,
            dash: None,
        }
    }

    pub(crate) const fn dashed(self, on: f64, off: f64) -> Self {
        Self {
            dash: Some((on, off)),
            ..self
        }
    }

    pub(crate) const fn alpha(self, alpha: f64) -> Self {
        Self { alpha, ..self }
    }
}

/// Alignment of a text at its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The text begins at (or hangs below) the point.
    Start,
    /// The text is centred at the point.
    Middle,
    /// The text ends at (or stands above) the point.
    End,
}

/// Style of a text; size in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Type {
    pub size: f64,
    pub colour: Colour,
    pub across: Side,
    pub down: Side,
    /// Reading upwards.
    pub upright: bool,
}

impl Type {
    pub(crate) fn new(size: f64, across: Side, down: Side) -> Self {
        Self {
            size,
            colour: INK,
            across,
            down,
            upright: false,
        }
    }

    pub(crate) fn upwards(self) -> Self {
        Self {
            upright: true,
            ..self
        }
    }

    pub(crate) fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}

/// The drawing area; coordinates in pixels, y downwards.
pub(crate) struct Canvas<'a> {
    backend: SVGBackend<'a>,
}

/// A figure of `width` by `height` pixels as SVG with a title and a description, painted by `paint` on white.
/// `millimetres`: the printed size of a pixel; by default a pixel of the screen.
pub(crate) fn draw(
    [width, height]: [f64; 2],
    millimetres: Option<f64>,
    words: &[String; 2],
    paint: impl FnOnce(&mut Canvas),
) -> String {
    let (width, height) = (width.round(), height.round());
    let size = (whole(width) as u32, whole(height) as u32);
    let mut svg = String::new();
    let mut canvas = Canvas {
        backend: SVGBackend::with_string(&mut svg, size),
    };
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
    canvas.polygon(&corners, WHITE, 1.0);
    paint(&mut canvas);
    canvas.backend.present().ok();
    drop(canvas);
    let shown = [width, height].map(|side| match millimetres {
        Some(pixel) => format!("{:.2}mm", side * pixel),
        None => side.to_string(),
    });
    tidy(&svg, size, &shown, words)
}

/// Shows the tenfold drawing at its true size and drops attributes that equal the defaults of SVG.
fn tidy(svg: &str, size: (u32, u32), shown: &[String; 2], [title, said]: &[String; 2]) -> String {
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    let meant = format!(
        "<svg width=\"{}\" height=\"{}\" fill=\"none\" stroke-linejoin=\"round\" \
         stroke-linecap=\"round\"",
        shown[0], shown[1]
    );
    let svg = svg
        .replace(" fill=\"none\"", "")
        .replacen(&drawn, &meant, 1)
        .replace(" opacity=\"1\"", "")
        .replace(" \"/>", "\"/>");
    let words = format!(
        "<title>{}</title>\n<desc>{}</desc>\n",
        escaped(title),
        escaped(said)
    );
    // The first tag ends at the first line's end.
    match svg.split_once('\n') {
        Some((first, rest)) => format!("{first}\n{words}{rest}"),
        None => svg,
    }
}

/// Escapes text for use between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

fn whole(pixels: f64) -> i32 {
    (pixels * OVERSAMPLING).round().clamp(-1e7, 1e7) as i32
}

fn style(colour: Colour, alpha: f64, width: f64) -> ShapeStyle {
    ShapeStyle {
        color: RGBColor(colour.0, colour.1, colour.2).mix((100.0 * alpha).round() / 100.0),
        filled: true,
        stroke_width: whole(width).max(1) as u32,
    }
}

impl Canvas<'_> {
    /// Draws a line through the points; points that are not finite break the line.
    pub(crate) fn line(&mut self, points: &[Pixel], pen: Pen) {
        let style = style(pen.colour, pen.alpha, pen.width);
        for run in points.split(|p| !finite(p)).filter(|run| run.len() > 1) {
            let mut path: Vec<(i32, i32)> = run.iter().map(|p| (whole(p.0), whole(p.1))).collect();
            path.dedup();
            if let Some((on, off)) = pen.dash {
                // The round caps are taken off the length of a dash.
                let (on, off) = ((on - pen.width).max(0.1), (off + pen.width).max(0.5));
                let (on, off) = (whole(on), whole(off));
                let dashes = DashedPathElement::new(path.iter().copied(), on, off, style);
                dashes
                    .draw(path.iter().copied(), &mut self.backend, (0, 0))
                    .ok();
            } else {
                path.extend((path.len() == 1).then(|| path[0]));
                self.backend.draw_path(path, &style).ok();
            }
        }
    }

    /// Fills a polygon; nothing is drawn if a corner is not finite.
    pub(crate) fn polygon(&mut self, corners: &[Pixel], fill: Colour, alpha: f64) {
        if corners.len() > 2 && corners.iter().all(finite) {
            let path: Vec<_> = corners.iter().map(|p| (whole(p.0), whole(p.1))).collect();
            let style = style(fill, alpha, 0.0);
            self.backend.fill_polygon(path, &style).ok();
        }
    }

    /// Fills one area bounded by several rings, holes running the other way round. The rings are strung on
    /// there-and-back bridges to the first point, which enclose nothing.
    pub(crate) fn region(&mut self, rings: &[Vec<Pixel>], fill: Colour, alpha: f64) {
        let Some(&home) = rings.iter().find_map(|ring| ring.first()) else {
            return;
        };
        let mut path = Vec::new();
        for ring in rings.iter().filter(|ring| ring.len() > 2) {
            path.extend_from_slice(ring);
            path.push(ring[0]);
            path.push(home);
        }
        self.polygon(&path, fill, alpha);
    }

    /// Fills a circle.
    pub(crate) fn disc(&mut self, centre: Pixel, radius: f64, fill: Colour, alpha: f64) {
        self.round(centre, radius, style(fill, alpha, 0.1), true);
    }

    /// Draws a circle's line.
    pub(crate) fn circle(&mut self, centre: Pixel, radius: f64, pen: Pen) {
        self.round(
            centre,
            radius,
            style(pen.colour, pen.alpha, pen.width),
            false,
        );
    }

    fn round(&mut self, centre: Pixel, radius: f64, style: ShapeStyle, filled: bool) {
        if finite(&centre) {
            let at = (whole(centre.0), whole(centre.1));
            let radius = whole(radius).max(0) as u32;
            self.backend.draw_circle(at, radius, &style, filled).ok();
        }
    }

    /// Draws a line of text.
    pub(crate) fn text(&mut self, at: Pixel, text: &str, font: Type) {
        if text.is_empty() || !finite(&at) {
            return;
        }
        let across = match font.across {
            Side::Start => HPos::Left,
            Side::Middle => HPos::Center,
            Side::End => HPos::Right,
        };
        let down = match font.down {
            Side::Start => VPos::Top,
            Side::Middle => VPos::Center,
            Side::End => VPos::Bottom,
        };
        // The backend centres the small letters; centre the figures and capitals instead.
        let drop = if font.down == Side::Middle && !font.upright {
            0.09 * font.size
        } else {
            0.0
        };
        let turn = if font.upright {
            FontTransform::Rotate270
        } else {
            FontTransform::None
        };
        let ink = RGBColor(font.colour.0, font.colour.1, font.colour.2);
        let style = TextStyle::from((FAMILY, font_size(font.size)).into_font().transform(turn))
            .color(&ink)
            .pos(Pos::new(across, down));
        let place = (whole(at.0), whole(at.1 + drop));
        self.backend.draw_text(text, &style, place).ok();
    }

    /// Draws text on a white halo, for labels that lie on a drawing.
    pub(crate) fn halo_text(&mut self, at: Pixel, text: &str, font: Type) {
        for (dx, dy) in [(-1.2, 0.0), (1.2, 0.0), (0.0, -1.2), (0.0, 1.2)] {
            self.text((at.0 + dx, at.1 + dy), text, font.colour(WHITE));
        }
        self.text(at, text, font);
    }
}

/// The number that plotters' division turns into the whole tenfold size.
fn font_size(size: f64) -> f64 {
    let wanted = (size * OVERSAMPLING).round();
    let guess = wanted * FONT_FACTOR;
    [guess, guess.next_up(), guess.next_down()]
        .into_iter()
        .find(|s| s / FONT_FACTOR == wanted)
        .unwrap_or(guess)
}
