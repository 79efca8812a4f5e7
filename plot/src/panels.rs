//! Several states of the same rods, a numbered panel for each.

use super::data::AxisUnits;
use super::legend::{Entry, Key};
use super::page::{Page, PageBlock, Width};
use super::painter::Painter;
use super::palette::category;
use super::paper::Paper;
use super::scenery::{Scenery, SpaceBody, SpaceRod, pen};
use super::spread::Spread;
use snaprod_core::error::{Error, Result};

/// States of rods, side by side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RodPanels {
    /// Title over the figure.
    pub title: String,
    /// The states, each with the words over its panel.
    pub panels: Vec<RodPanel>,
    /// Units.
    pub units: AxisUnits,
}

/// One state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RodPanel {
    /// Words over the panel.
    pub title: String,
    /// The rods, with their supports on the ground; unstable ones are dashed.
    pub rods: Vec<SpaceRod>,
    /// Bodies that the rods carry.
    pub bodies: Vec<SpaceBody>,
}

/// Draws every state as SVG, all seen from one side and to one scale.
///
/// Fails if there is no state with a finite point.
pub fn rod_panels(data: &RodPanels, paper: &Paper) -> Result<String> {
    const PANEL: f64 = 300.0;
    let none = || Error::domain("figure of states: no state with a finite point to show");
    let points = (data.panels.iter()).flat_map(|panel| &panel.rods);
    let view = Spread::new(points.flat_map(|rod| &rod.points)).ok_or_else(none)?;
    let view = view.view();
    let scenery = |panel: &RodPanel| {
        let mut scenery = Scenery::new(&panel.rods, 0.0, false, false)?;
        let corners = panel.bodies.iter().filter_map(SpaceBody::corners);
        scenery.hold(&corners.flatten().collect::<Vec<_>>());
        scenery.view = Some(view);
        Ok(scenery)
    };
    let sceneries = data.panels.iter().map(scenery);
    let mut sceneries: Vec<Scenery> = sceneries.collect::<Result<_>>()?;
    Scenery::share(&mut sceneries);
    let columns = match data.panels.len() {
        n @ 0..=2 => n,
        4 => 2,
        _ => 3,
    };
    let mut blocks: Vec<Vec<PageBlock>> = (0..columns).map(|_| Vec::new()).collect();
    for (i, (panel, scenery)) in data.panels.iter().zip(&sceneries).enumerate() {
        let stage = |place: [f64; 4]| scenery.stage(&data.units, place);
        let needed = stage([0.0, 0.0, PANEL, PANEL]).height();
        let mut block = PageBlock::space(needed.clamp(140.0, PANEL), stage, |canvas, stage| {
            let mut painter = Painter::new(stage, !scenery.plane);
            for body in &panel.bodies {
                painter.body(body, category(body.colour.unwrap_or(1)));
            }
            for (k, rod) in panel.rods.iter().enumerate() {
                painter.rod(rod, category(rod.colour.unwrap_or(k)), scenery);
            }
            painter.paint(canvas);
        });
        block.title = &panel.title;
        blocks[i % columns].push(block);
    }
    let keys = [(false, "stable"), (true, "unstable")].map(|(unstable, word)| {
        let rod = SpaceRod {
            unstable,
            ..SpaceRod::default()
        };
        Entry::new(Key::Line(pen(&rod, category(0))), word)
    });
    let page = Page::new("Equilibria", &data.title, vec![keys.to_vec()]);
    let page = blocks.into_iter().fold(page, |page, blocks| {
        page.column(Width::Panels(PANEL), blocks)
    });
    page.draw(paper)
}
