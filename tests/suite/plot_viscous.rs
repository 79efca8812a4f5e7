//! Figures of viscous runs: marks at the data, labels, bad data.

use crate::plot_viscous_data::*;
use roxmltree::{Document, Node};
use snaprod::plot::*;
use snaprod::{Error, Result};

type Pixel = (f64, f64);

fn number(node: &Node, name: &str) -> f64 {
    let value = node.attribute(name).and_then(|v| v.parse().ok());
    value.unwrap_or(f64::NAN)
}

fn points(node: &Node) -> Vec<Pixel> {
    let text = node.attribute("points").expect("points");
    let pair = |pair: &str| {
        let (x, y) = pair.split_once(',').expect("a pair");
        (x.parse().expect("a number"), y.parse().expect("a number"))
    };
    text.split_whitespace().map(pair).collect()
}

/// Lines of a colour and a width in tenths of a pixel.
fn lines_of(document: &Document, colour: &str, width: f64) -> Vec<Vec<Pixel>> {
    let fits = |n: &Node| {
        n.attribute("stroke") == Some(colour) && (number(n, "stroke-width") - width).abs() < 0.5
    };
    let lines = document
        .descendants()
        .filter(|n| n.has_tag_name("polyline"));
    lines.filter(fits).map(|n| points(&n)).collect()
}

fn polygons(document: &Document) -> Vec<(String, Vec<Pixel>)> {
    let nodes = document.descendants().filter(|n| n.has_tag_name("polygon"));
    nodes
        .map(|n| (n.attribute("fill").expect("a fill").to_string(), points(&n)))
        .collect()
}

fn words<'a>(document: &'a Document) -> Vec<&'a str> {
    let texts = document.descendants().filter(|n| n.has_tag_name("text"));
    texts.filter_map(|n| n.text()).map(str::trim).collect()
}

/// Left, top, right, bottom of the panels, in the order drawn.
fn frames(document: &Document) -> Vec<[f64; 4]> {
    let closed = |l: &Vec<Pixel>| l.len() == 5 && l[0] == l[4] && l[2].0 - l[0].0 > 1500.0;
    lines_of(document, "#262626", 9.0)
        .into_iter()
        .filter(closed)
        .map(|l| [l[0].0, l[0].1, l[2].0, l[2].1])
        .collect()
}

/// Winding number of a closed line about a point.
fn winding(ring: &[Pixel], p: Pixel) -> i32 {
    let mut turns = 0;
    for (k, a) in ring.iter().enumerate() {
        let b = ring[(k + 1) % ring.len()];
        if (a.1 <= p.1) != (b.1 <= p.1) {
            let x = a.0 + (p.1 - a.1) / (b.1 - a.1) * (b.0 - a.0);
            if x > p.0 {
                turns += if b.1 > a.1 { 1 } else { -1 };
            }
        }
    }
    turns
}

/// The fill colour at a point.
fn colour_at(polygons: &[(String, Vec<Pixel>)], p: Pixel) -> &str {
    let top = polygons
        .iter()
        .rev()
        .find(|(_, ring)| winding(ring, p) != 0);
    top.map_or("none", |t| &t.0)
}

fn all_figures() -> Vec<(&'static str, Result<String>, Vec<&'static str>, usize)> {
    let time = "time t (√(μℓ³/EI))";
    let si = StrainMap {
        title: "A snap".into(),
        strain_label: "twist u₃ (1/m)".into(),
        window: Some([1.6, 1.9]),
        units: AxisUnits::si(1.0),
        ..strain_map_data(100, 12)
    };
    vec![
        (
            "strain map",
            strain_map(&strain_map_data(400, 60), &Paper::SCREEN),
            vec![
                time,
                "arclength s (ℓ)",
                "curvature (1/ℓ)",
                "dissipation density (√((EI)³/μℓ⁷))",
                "snap",
                "−5.0",
                "5.0",
                "0.0",
                "10⁻⁴",
                "10⁻¹",
            ],
            1_000_000,
        ),
        (
            "strain map, zoomed",
            strain_map(&si, &Paper::SCREEN),
            vec![
                "A snap",
                "time t (s)",
                "arclength s (m)",
                "twist u₃ (1/m)",
                "dissipation density (W/m)",
            ],
            300_000,
        ),
        (
            "layer",
            layer(&layer_data(), &Paper::SCREEN),
            vec![
                "x (ℓ)",
                "y (ℓ)",
                "T (1/EI)",
                "fold",
                "landing",
                "end, held by the body",
                "elastic",
                "dissipated",
                "released in the elastic limit",
                "η = 0.1 √(μEI ℓ³)",
                "η = 10⁻⁴ √(μEI ℓ³)",
                "energy (EI/ℓ)",
                "stretched time T = (t − t_peak)/η (1/EI)",
            ],
            150_000,
        ),
        (
            "convergence",
            lines(&convergence_data(), &Paper::SCREEN),
            vec![
                "on the sheet",
                "after the third fold",
                "1",
                "2/3",
                "10⁻⁸",
                "10⁻⁷",
                "10⁻¹",
                "viscosity η (√(EI·μℓ³))",
                "error of r(1) (ℓ)",
            ],
            100_000,
        ),
        (
            "losses",
            dissipated_against_released(&losses_data(), &Paper::SCREEN),
            vec![
                "released in the elastic limit (EI/ℓ)",
                "dissipated in the layer (EI/ℓ)",
                "relative difference",
                "dissipated = released",
                "η = 0.01",
                "10⁻²",
                "5",
            ],
            100_000,
        ),
        (
            "losses over time",
            losses_over_time(&losses_over_time_data(), &Paper::SCREEN),
            vec![
                time,
                "energy lost so far (EI/ℓ)",
                "released in the elastic limit",
                "dissipated, η = 10⁻³",
            ],
            100_000,
        ),
        (
            "kernel",
            kernel(&kernel_data(), &Paper::SCREEN),
            vec![
                time,
                "relaxation function",
                "creep function (inverse units)",
                "m₁–φ₁ (EI/ℓ)",
                "n₂–r₂ (EI/ℓ³)",
                "instantaneous (left), relaxed (right)",
                "10⁻⁴",
                "10³",
            ],
            100_000,
        ),
    ]
}

/// Catches a label lost or cut off by the edge of the page, NaN or infinite numbers, oversized files, and a figure
/// that differs from one call to the next.
#[test]
fn figures_are_whole_labelled_and_the_same_each_time() {
    for ((name, svg, wanted, size), again) in all_figures().into_iter().zip(all_figures()) {
        let svg = svg.unwrap();
        assert!(svg == again.1.unwrap(), "{name}: not the same bytes");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(svg.len() < size, "{name}: {} bytes", svg.len());
        let document = Document::parse(&svg).unwrap();
        let found = words(&document);
        for word in wanted {
            assert!(found.contains(&word), "{name}: no {word:?} in {found:?}");
        }
        let root = document.root_element();
        let page = (
            10.0 * number(&root, "width"),
            10.0 * number(&root, "height"),
        );
        for node in document.descendants().filter(|n| n.has_tag_name("text")) {
            let text = node.text().unwrap_or("").trim();
            // Average width of this font's letters.
            let long = 0.56 * number(&node, "font-size") * text.chars().count() as f64;
            let (at, end) = match node.attribute("transform") {
                Some(_) => (page.1 - number(&node, "y"), page.1),
                None => (number(&node, "x"), page.0),
            };
            let from = match node.attribute("text-anchor") {
                Some("middle") => at - 0.5 * long,
                Some("end") => at - long,
                _ => at,
            };
            assert!(
                from > -20.0 && from + long < end + 20.0,
                "{name}: {text:?} leaves the page"
            );
        }
        for (x, y) in polygons(&document).into_iter().flat_map(|p| p.1) {
            assert!((0.0..=page.0).contains(&x) && (0.0..=page.1).contains(&y));
        }
    }
}

/// Catches cells in the wrong place, rows upside down, an asymmetric scale, a wrong or clipped colour, a filled gap, a
/// floor at the wrong decade. Each cell's colour is looked up in the colour bar, and the position there is compared
/// with the number.
#[test]
fn cells_have_the_colours_of_their_values() {
    let time = [0.0, 0.5, 0.6, 1.0, 3.0, 4.0];
    let s = [0.1, 0.3, 0.8, 0.95];
    let (gap, largest) = ((2, 1), 4.0);
    let strain = |i: usize, j: usize| match (i, j) {
        _ if (i, j) == gap => f64::NAN,
        (1, 3) => -largest,
        _ => 2.7 * ((3 * i + 5 * j) as f64).sin(),
    };
    let power = |i: usize, j: usize| match (i, j) {
        (4, 2) => 0.0,
        (0, 0) => 3e-9,
        (3, 1) => 50.0,
        _ => 10f64.powf(3.0 * ((7 * i + 2 * j) as f64).sin() - 1.5),
    };
    let over = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..6).map(|i| (0..4).map(|j| f(i, j)).collect()).collect()
    };
    let data = StrainMap {
        time: time.to_vec(),
        s: s.to_vec(),
        strain: over(&strain),
        dissipation: over(&power),
        decades: Some(5.0),
        snaps: vec![0.55, 9.0],
        ..StrainMap::default()
    };
    let svg = strain_map(&data, &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let (frames, polygons) = (frames(&document), polygons(&document));
    assert_eq!(frames.len(), 2);
    let edges = |v: &[f64], lo: f64, hi: f64| -> Vec<f64> {
        let inner = v.windows(2).map(|p| 0.5 * (p[0] + p[1]));
        std::iter::once(lo).chain(inner).chain([hi]).collect()
    };
    let (across, up) = (edges(&time, 0.0, 4.0), edges(&s, 0.0, 1.0));
    for (k, [l, t, r, b]) in frames.into_iter().enumerate() {
        // Strips of the bar, from the bottom up.
        let bar: Vec<&String> = polygons
            .iter()
            .filter(|(_, ring)| ring.len() >= 4 && ring.iter().all(|p| p.0 > r + 100.0))
            .filter(|(_, ring)| ring.iter().all(|p| p.1 > t - 5.0 && p.1 < b + 5.0))
            .map(|p| &p.0)
            .collect();
        assert_eq!(bar.len(), 65);
        for i in 0..6 {
            for j in 0..4 {
                // Near each corner of the cell, to detect a shifted edge.
                for (fx, fy) in [(0.02, 0.03), (0.98, 0.97), (0.5, 0.5)] {
                    let x = across[i] + fx * (across[i + 1] - across[i]);
                    let y = up[j] + fy * (up[j + 1] - up[j]);
                    let p = (l + (r - l) * x / 4.0, b - (b - t) * y);
                    let seen = colour_at(&polygons, p);
                    if k == 0 && (i, j) == gap {
                        assert_eq!(seen, "#BCBCBC");
                        continue;
                    }
                    let level = if k == 0 {
                        0.5 + 0.5 * strain(i, j) / largest
                    } else {
                        1.0 + (power(i, j) / 50.0).log10() / 5.0
                    };
                    let band = (65.0 * level.clamp(0.0, 0.999)).floor() as usize;
                    assert_eq!(seen, bar[band], "panel {k}, cell ({i}, {j})");
                }
            }
        }
        // The snap within; the other lies beyond the last time.
        let dashes = lines_of(&document, "#262626", 9.0);
        let at = l + (r - l) * 0.55 / 4.0;
        let inside = dashes.iter().filter(|d| {
            d.iter()
                .all(|p| p.1 > t + 20.0 && p.1 < b - 20.0 && p.0 > l + 5.0 && p.0 < r - 5.0)
        });
        let places: Vec<f64> = inside.map(|d| d[0].0).collect();
        assert!(places.len() > 10 && places.iter().all(|x| (x - at).abs() < 1.0));
    }
}

/// Catches a zoom with other times, or with a scale by hidden columns.
#[test]
fn a_window_shows_its_times_alone() {
    let data = StrainMap {
        time: vec![0.0, 1.0, 2.0, 3.0],
        s: vec![0.0, 1.0],
        strain: vec![
            vec![90.0; 2],
            vec![1.0, -2.0],
            vec![0.5, 0.0],
            vec![90.0; 2],
        ],
        window: Some([0.8, 2.2]),
        ..StrainMap::default()
    };
    let svg = strain_map(&data, &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let found = words(&document);
    assert!(
        found.contains(&"−2") || found.contains(&"−2.0"),
        "{found:?}"
    );
    assert!(!found.iter().any(|w| w.contains("50")), "{found:?}");
    let [l, t, r, b] = frames(&document)[0];
    let polygons = polygons(&document);
    // The edge between the columns 1 and 2 is in the middle of 0.8 to 2.2 + 0.1.
    let edge = l + (r - l) * 0.7 / 1.4;
    let high = t + 0.25 * (b - t);
    let (before, after) = ((edge - 5.0, high), (edge + 5.0, high));
    // -2 is the lowest end of the scale, 0 its middle.
    assert_eq!(colour_at(&polygons, before), "#16306E");
    assert_eq!(colour_at(&polygons, after), "#F7F6F3");
}

/// Catches unequal scales, a held end off the shapes' ends, the released energy at the wrong height, and energies
/// drawn on another axis than the released energy.
#[test]
fn a_layer_keeps_its_end_and_its_energies() {
    let data = layer_data();
    let svg = layer(&data, &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let frames = frames(&document);
    assert_eq!(frames.len(), 2);
    let fold = lines_of(&document, "#262626", 30.0);
    let landing = lines_of(&document, "#C81E3C", 30.0);
    let longest = |lines: &[Vec<Pixel>]| lines.iter().max_by_key(|l| l.len()).cloned().unwrap();
    let (fold, landing) = (longest(&fold), longest(&landing));
    let end = *fold.last().unwrap();
    assert!((end.0 - landing.last().unwrap().0).abs() < 1.5);
    let scale = (end.0 - fold[0].0) / 0.72;
    let down = (end.1 - fold[0].1) / 0.08;
    assert!((scale / down - 1.0).abs() < 0.02, "{scale} {down}");
    // The black square; the first of its colour stands in the legend.
    let square = polygons(&document)
        .into_iter()
        .filter(|p| p.0 == "#262626")
        .nth(1)
        .unwrap()
        .1;
    let middle = (
        0.5 * (square[0].0 + square[2].0),
        0.5 * (square[0].1 + square[2].1),
    );
    assert!((middle.0 - end.0).abs() < 1.5 && (middle.1 - end.1).abs() < 1.5);

    let [l, t, r, b] = frames[1];
    let released: Vec<f64> = lines_of(&document, "#262626", 11.0)
        .iter()
        .filter(|d| d[0].1 > t)
        .map(|d| d[0].1)
        .collect();
    assert!(released.len() > 20 && released.iter().all(|y| (y - released[0]).abs() < 1.0));
    // The thinnest run: its elastic energy falls by as much as the final line lies above zero.
    let elastic = longest(&lines_of(&document, "#009E73", 16.0));
    let (first, last) = (elastic[0], *elastic.last().unwrap());
    assert!((first.0 - l).abs() < 1.0 && (last.0 - r).abs() < 1.0);
    let fall = last.1 - first.1;
    // Zero: 2.84 below the last elastic energy, of 10.26 in all.
    let zero = last.1 + fall * 2.84 / 10.26;
    assert!((zero - released[0] - fall).abs() < 0.01 * fall && zero < b);
}

/// Catches guides with another slope than they say, and guides over data or over one another.
#[test]
fn guides_have_their_slopes_and_cover_nothing() {
    let svg = lines(&convergence_data(), &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let [l, t, r, b] = frames(&document)[0];
    let marks: Vec<Pixel> = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"]
        .iter()
        .flat_map(|c| lines_of(&document, c, 15.0))
        .filter(|line| line[0].1 > t && line[0].0 > l)
        .flatten()
        .collect();
    assert!(marks.len() >= 8, "no curves found");
    let guides = lines_of(&document, "#696969", 10.0);
    assert_eq!(guides.len(), 2);
    // By the data eta spans 7 decades and errors a range given by their formula, both with the same margin.
    let data = convergence_data();
    let errors = || data.series.iter().flat_map(|s| s.y.iter().copied());
    let spread = (errors().fold(0.0, f64::max) / errors().fold(1.0, f64::min)).log10();
    let across = (r - l) / (1.1 * 7.0);
    let up = (b - t) / (1.1 * spread);
    for (guide, order) in guides.iter().zip([1.0, 2.0 / 3.0]) {
        let (dx, dy) = (guide[2].0 - guide[0].0, guide[0].1 - guide[2].1);
        let slope = (dy / up) / (dx / across);
        assert!((slope / order - 1.0).abs() < 0.03, "{slope} for {order}");
        let (lo, hi) = (guide[0].0.min(guide[2].0), guide[0].0.max(guide[2].0));
        let (top, bottom) = (guide[2].1.min(guide[0].1), guide[0].1.max(guide[2].1));
        let covered = |p: &&Pixel| p.0 > lo && p.0 < hi && p.1 > top && p.1 < bottom;
        // A mark may lie in the corner of the triangle's box outside the triangle.
        let inside = |p: &&Pixel| covered(p) && winding(&guide[..3], **p) != 0;
        assert!(marks.iter().find(inside).is_none());
        assert!(lo > l && hi < r && top > t && bottom < b);
    }
}

/// Catches steps of the limit at other times than its snaps, and a wrong diagonal.
#[test]
fn losses_step_at_snaps_and_the_diagonal_is_one() {
    let svg = losses_over_time(&losses_over_time_data(), &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let [l, _, r, _] = frames(&document)[0];
    let stairs = lines_of(&document, "#BEBEBE", 50.0).pop().unwrap();
    let rises: Vec<f64> = stairs
        .windows(2)
        .filter(|p| (p[0].1 - p[1].1).abs() > 100.0)
        .map(|p| {
            assert_eq!(p[0].0, p[1].0);
            6.0 * (p[0].0 - l) / (r - l)
        })
        .collect();
    assert_eq!(rises.len(), 3);
    for (rise, snap) in rises.iter().zip([1.1, 2.9, 4.4]) {
        assert!((rise - snap).abs() < 2e-3, "{rise} for {snap}");
    }

    let svg = dissipated_against_released(&losses_data(), &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let [l, t, r, b] = frames(&document)[0];
    let diagonal = lines_of(&document, "#969696", 12.0).pop().unwrap();
    assert_eq!(diagonal, [(l, b), (r, t)]);
    // Once each, though three groups have them; halos are white.
    let texts = document.descendants().filter(|n| n.has_tag_name("text"));
    let black = texts.filter(|n| n.attribute("fill") == Some("#262626"));
    let numbers: Vec<&str> = black.filter_map(|n| n.text()).map(str::trim).collect();
    for k in 1..=5 {
        let label = k.to_string();
        assert_eq!(numbers.iter().filter(|n| **n == label).count(), 1);
    }
}

/// Catches limits at other heights than their curves' ends, or at the wrong side.
#[test]
fn limits_of_a_kernel_meet_their_curves() {
    let svg = kernel(&kernel_data(), &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let frames = frames(&document);
    for colour in ["#0072B2", "#D55E00", "#009E73"] {
        for [l, t, r, b] in &frames {
            let curves = lines_of(&document, colour, 17.0);
            let curve = curves.iter().find(|c| c[0].1 > *t && c[0].1 < *b).unwrap();
            let (first, last) = (curve[0], curve[curve.len() - 1]);
            let dashes = lines_of(&document, colour, 10.0);
            let near = |y: f64| dashes.iter().filter(move |d| (d[0].1 - y).abs() < 25.0);
            let (left, right): (Vec<_>, Vec<_>) = (near(first.1).collect(), near(last.1).collect());
            let mid = 0.5 * (l + r);
            assert!(left.len() > 10 && left.iter().all(|d| d[0].0 < mid));
            assert!(right.len() > 10 && right.iter().all(|d| d[0].0 > mid - 1.0));
        }
    }
}

fn refused(result: Result<String>, about: &str) {
    let error = result.expect_err(about);
    assert!(
        error.is_domain() && error.to_string().contains(about),
        "{error}"
    );
}

/// Catches bad data drawn silently; each message must name the fault.
#[test]
fn bad_data_are_refused_by_name() {
    let map = |change: fn(&mut StrainMap)| {
        let mut data = strain_map_data(20, 5);
        change(&mut data);
        strain_map(&data, &Paper::SCREEN)
    };
    refused(
        strain_map(&StrainMap::default(), &Paper::SCREEN),
        "time is empty",
    );
    refused(map(|m| m.time[3] = f64::NAN), "time has an entry NaN");
    refused(map(|m| m.time[3] = 7.0), "time falls");
    refused(map(|m| m.s.truncate(1)), "s spans nothing");
    refused(
        map(|m| m.strain.truncate(19)),
        "strain has 19 entries for 20 times",
    );
    refused(map(|m| m.strain[7].truncate(4)), "strain[7] has 4 entries");
    refused(map(|m| m.dissipation.truncate(2)), "dissipation has 2");
    refused(map(|m| m.strain_range = Some(0.0)), "strain_range is 0");
    refused(map(|m| m.strain_range = Some(f64::NAN)), "strain_range");
    refused(map(|m| m.decades = Some(f64::NAN)), "decades");
    refused(map(|m| m.decades = Some(0.5)), "decades is 0.5");
    refused(map(|m| m.window = Some([2.0, 1.0])), "window");
    refused(map(|m| m.window = Some([8.0, 9.0])), "window");
    refused(map(|m| m.window = Some([f64::NAN, 3.0])), "window");
    refused(
        map(|m| m.strain.iter_mut().for_each(|c| c.fill(f64::INFINITY))),
        "no strain",
    );
    refused(
        map(|m| m.dissipation.iter_mut().for_each(|c| c.fill(-1.0))),
        "no dissipation",
    );

    refused(layer(&LayerFigure::default(), &Paper::SCREEN), "no shape");
    let snap = |change: fn(&mut LayerFigure)| {
        let mut data = layer_data();
        change(&mut data);
        layer(&data, &Paper::SCREEN)
    };
    refused(
        snap(|d| d.runs[1].elastic.truncate(7)),
        "runs[1].elastic has 7",
    );
    refused(
        snap(|d| d.runs[0].dissipated.push(0.0)),
        "runs[0].dissipated",
    );
    refused(
        snap(|d| d.runs[2].stretched[4] = f64::NAN),
        "runs[2].stretched",
    );

    refused(lines(&Lines::default(), &Paper::SCREEN), "no point");
    let orders = |change: fn(&mut Lines)| {
        let mut data = convergence_data();
        change(&mut data);
        lines(&data, &Paper::SCREEN)
    };
    refused(orders(|d| d.series[2].y.truncate(3)), "series[2].y has 3");
    refused(orders(|d| d.slopes[0].order = f64::NAN), "slopes[0]");
    refused(orders(|d| d.slopes[1].series = Some(4)), "slopes[1]");
    refused(orders(|d| d.y_log = false), "slopes[0]");
    refused(
        orders(|d| d.series.iter_mut().for_each(|s| s.y.fill(-1.0))),
        "no point",
    );

    refused(
        dissipated_against_released(&SnapLosses::default(), &Paper::SCREEN),
        "no snap",
    );
    let losses = |change: fn(&mut LossGroup)| {
        let mut data = losses_data();
        change(&mut data.groups[1]);
        dissipated_against_released(&data, &Paper::SCREEN)
    };
    refused(
        losses(|g| g.dissipated.truncate(1)),
        "groups[1].dissipated has 1",
    );
    refused(losses(|g| g.labels.truncate(1)), "groups[1].labels has 1");

    refused(
        losses_over_time(&LossesOverTime::default(), &Paper::SCREEN),
        "no run",
    );
    let stairs = |change: fn(&mut LossesOverTime)| {
        let mut data = losses_over_time_data();
        change(&mut data);
        losses_over_time(&data, &Paper::SCREEN)
    };
    refused(stairs(|d| d.released.truncate(2)), "released has 2");
    refused(stairs(|d| d.snaps[1] = f64::NAN), "snaps");
    refused(stairs(|d| d.snaps[1] = 0.0), "snaps must not fall");
    refused(stairs(|d| d.runs[0].x[1] = -1.0), "runs[0].x falls");
    refused(stairs(|d| d.runs[0].y.truncate(1)), "runs[0].y");

    refused(kernel(&KernelFigure::default(), &Paper::SCREEN), "time");
    let memory = |change: fn(&mut KernelFigure)| {
        let mut data = kernel_data();
        change(&mut data);
        kernel(&data, &Paper::SCREEN)
    };
    refused(
        memory(|d| d.creep[2].values.truncate(9)),
        "creep[2].values has 9",
    );
    refused(memory(|d| d.time.fill(0.0)), "time");
    refused(
        memory(|d| {
            d.creep.clear();
            d.relaxation.clear();
        }),
        "no component",
    );
}

/// Catches a panic or a NaN on the page for numbers at the ends of the range of doubles.
#[test]
fn bad_numbers_never_panic() {
    for bad in [
        f64::NAN,
        f64::INFINITY,
        -f64::INFINITY,
        1e308,
        -1e308,
        1e-310,
        0.0,
    ] {
        let mut map = strain_map_data(20, 5);
        (map.strain[3][2], map.dissipation[4][1], map.snaps[0]) = (bad, bad, bad);
        map.units.rod = bad;
        let mut late = map.clone();
        (late.time[19], late.s[4]) = (bad, bad);
        let mut flat = map.clone();
        flat.strain.iter_mut().for_each(|c| c.fill(bad));
        flat.dissipation.iter_mut().for_each(|c| c.fill(bad));
        let mut snap = layer_data();
        (
            snap.fold.x[3],
            snap.shapes[1].time,
            snap.shapes[2].axis.y[7],
        ) = (bad, bad, bad);
        (snap.released, snap.runs[0].eta, snap.runs[1].elastic[5]) = (Some(bad), bad, bad);
        let mut point = snap.clone();
        point.shapes.clear();
        point.landing = Curve::default();
        point.fold = Curve::new([[bad, 0.0], [0.3, 0.3]]);
        let mut orders = convergence_data();
        (orders.series[0].x[0], orders.series[1].y[2]) = (bad, bad);
        orders.slopes[0].order = bad;
        let mut losses = losses_data();
        (losses.groups[0].released[1], losses.groups[1].dissipated[2]) = (bad, bad);
        let mut stairs = losses_over_time_data();
        (stairs.runs[0].y[5], stairs.runs[1].x[1200]) = (bad, bad);
        let mut memory = kernel_data();
        memory.relaxation[0].values[3] = bad;
        (memory.creep[0].relaxed, memory.time[0]) = (Some(bad), bad);
        let mut logged = memory.clone();
        logged.log = true;
        let figures = [
            strain_map(&map, &Paper::SCREEN),
            strain_map(&late, &Paper::SCREEN),
            strain_map(&flat, &Paper::SCREEN),
            layer(&snap, &Paper::SCREEN),
            layer(&point, &Paper::SCREEN),
            lines(&orders, &Paper::SCREEN),
            dissipated_against_released(&losses, &Paper::SCREEN),
            losses_over_time(&stairs, &Paper::SCREEN),
            kernel(&memory, &Paper::SCREEN),
            kernel(&logged, &Paper::SCREEN),
        ];
        for (k, figure) in figures.iter().enumerate() {
            match figure {
                Ok(svg) => {
                    assert!(Document::parse(svg).is_ok());
                    assert!(!svg.contains("NaN") && !svg.contains(">inf"), "{k}: {bad}");
                }
                Err(error) => assert!(Error::is_domain(error)),
            }
        }
    }
}
