//! Measured data against the model fitted to them.

use super::axes::Axis;
use super::canvas::Pen;
use super::data::{as_many, with_unit};
use super::legend::{Key, Mark, PlottedCurve, mark, named};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{GREY, category};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// One quantity: measured and modelled values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FittedCurve {
    /// Name of the quantity.
    pub name: String,
    /// Unit; may be empty.
    pub unit: String,
    /// Measured values, one for each place of the figure; NaN for none.
    pub data: Vec<f64>,
    /// Values of the model, as many.
    pub model: Vec<f64>,
    /// Values of the model at the places `between` of the figure, as many.
    pub curve: Vec<f64>,
}

/// Data and model over time, or over a varied parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FitFigure {
    /// Title over the figure; may be empty.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// The places, in any order.
    pub x: Vec<f64>,
    /// Places at which the model is drawn as a line, in order; empty: the model is drawn by marks at `x`.
    pub between: Vec<f64>,
    /// The quantities, a panel each.
    pub curves: Vec<FittedCurve>,
}

/// Draws every quantity with its data as dots and the model as a line or as marks, and the residuals below, as SVG.
///
/// Fails if the lists differ in length, or if there is nothing to show.
pub fn fit(figure: &FitFigure, paper: &Paper) -> Result<String> {
    const FIGURE: &str = "figure of a fit";
    let nothing = || Error::domain(format!("{FIGURE}: nothing to show"));
    let x = Axis::fit(&figure.x, false, &figure.x_label, 8).ok_or_else(nothing)?;
    let mut blocks = Vec::new();
    let mut legend = Vec::new();
    for (i, curve) in figure.curves.iter().enumerate() {
        let (places, fine) = (figure.x.len(), figure.between.len());
        for (name, list, count, with) in [
            ("data", &curve.data, places, "x"),
            ("model", &curve.model, places, "x"),
            ("curve", &curve.curve, fine, "between"),
        ] {
            let field = format!("curves[{i}].{name}");
            as_many(FIGURE, &field, list.len(), count, with)?;
        }
        let left = curve.data.iter().zip(&curve.model);
        let left: Vec<f64> = left.map(|(x, m)| x - m).collect();
        let all = curve.data.iter().chain(&curve.model).chain(&curve.curve);
        let y =
            Axis::fit(all, false, &with_unit(&curve.name, &curve.unit), 5).ok_or_else(nothing)?;
        let below = Axis::fit(&left, false, &with_unit("data − model", &curve.unit), 4);
        let dots = |name: &str, y: &[f64]| {
            PlottedCurve::new(Key::Mark(Mark::Dot, category(0)), name, &figure.x, y)
        };
        let model = if figure.between.is_empty() {
            let key = Key::Mark(mark(1), category(1));
            PlottedCurve::new(key, "model", &figure.x, &curve.model)
        } else {
            let key = Key::Line(Pen::new(category(1), 1.5));
            PlottedCurve::new(key, "model", &figure.between, &curve.curve)
        };
        let curves = vec![model, dots("measured", &curve.data)];
        if legend.is_empty() {
            legend = named(&curves);
        }
        blocks.push(PageBlock::plane(
            x.clone(),
            y,
            Height::Pixels(190.0),
            curves,
        ));
        if let Some(y) = below {
            let ends = [x.lo, x.hi];
            let zero = Pen::new(GREY, 1.0);
            let left = PageBlock::plane(x.clone(), y, Height::Pixels(90.0), vec![dots("", &left)]);
            blocks
                .push(left.under(move |canvas, panel| panel.line(canvas, &ends, &[0.0; 2], zero)));
        }
    }
    if blocks.is_empty() {
        return Err(nothing());
    }
    let page = Page::new(
        "Measurements and the model fitted to them",
        &figure.title,
        vec![legend],
    );
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}
