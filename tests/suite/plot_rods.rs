//! Figures of branches and of rods in space: positions of marks and style changes, labels, bad data.

use crate::plot_rods_data::*;
use roxmltree::{Document, Node};
use snaprod::plot::*;
use snaprod::{Error, Result};

/// Parsed parts of a figure; coordinates in tenths of a pixel.
struct Drawing<'a> {
    nodes: Vec<Node<'a, 'a>>,
    size: (f64, f64),
}

fn number(node: &Node, name: &str) -> f64 {
    node.attribute(name)
        .and_then(|v| v.parse().ok())
        .unwrap_or(f64::NAN)
}

impl<'a> Drawing<'a> {
    fn new(document: &'a Document) -> Self {
        let root = document.root_element();
        let view: Vec<f64> = root
            .attribute("viewBox")
            .expect("a viewBox")
            .split(' ')
            .map(|n| n.parse().expect("a number"))
            .collect();
        Self {
            nodes: root.descendants().filter(Node::is_element).collect(),
            size: (view[2], view[3]),
        }
    }

    fn tagged(&self, tag: &'static str) -> impl Iterator<Item = &Node<'a, 'a>> {
        self.nodes.iter().filter(move |n| n.has_tag_name(tag))
    }

    fn words(&self) -> Vec<&str> {
        self.tagged("text")
            .filter_map(|n| n.text())
            .map(str::trim)
            .collect()
    }

    /// Corners of lines of a colour and width (in tenths of a pixel).
    fn lines(&self, colour: &str, width: f64) -> Vec<Vec<(f64, f64)>> {
        let fits =
            |n: &&Node| n.attribute("stroke") == Some(colour) && number(n, "stroke-width") == width;
        self.tagged("polyline")
            .filter(fits)
            .map(|n| points(n))
            .collect()
    }

    /// Middles of discs of a colour inside the page, legend excluded by `below`.
    fn discs(&self, colour: &str, below: f64) -> Vec<(f64, f64)> {
        let mut at: Vec<(f64, f64)> = self
            .tagged("circle")
            .filter(|n| n.attribute("fill") == Some(colour))
            .map(|n| (number(n, "cx"), number(n, "cy")))
            .filter(|p| p.1 > below)
            .collect();
        at.dedup();
        at
    }
}

fn points(node: &Node) -> Vec<(f64, f64)> {
    let text = node.attribute("points").expect("points");
    text.split_whitespace()
        .map(|pair| {
            let (x, y) = pair.split_once(',').expect("a pair");
            (x.parse().expect("a number"), y.parse().expect("a number"))
        })
        .collect()
}

fn all_figures() -> Vec<(&'static str, Result<String>, Vec<&'static str>)> {
    let axes = || vec!["x (ℓ)", "y (ℓ)", "z (ℓ)"];
    let with = |more: &[&'static str]| [axes(), more.to_vec()].concat();
    vec![
        (
            "branches",
            branch_diagram(&pitchfork(), &Paper::SCREEN),
            vec![
                "end force λ² (EI/ℓ²)",
                "deflection x(1) (ℓ)",
                "stable (index 0)",
                "index 1",
                "index 2",
                "index ≥ 3",
                "index unknown",
                "fold",
                "branch point",
                "stability change",
                "end",
                "first mode",
                "LP1",
                "LP4",
                "BP2",
                "SC2",
                "EP1",
            ],
        ),
        (
            "two panels",
            branch_diagram(&pitchfork_energy(), &Paper::SCREEN),
            vec!["energy (EI/ℓ)", "deflection x(1) (ℓ)", "LP1"],
        ),
        (
            "helix",
            rod_shapes(&one(helix(2.5, 241), 0.05), &Paper::SCREEN),
            with(&["d₁", "d₂", "d₃"]),
        ),
        (
            "knot",
            rod_shapes(&one(knot(), 0.0), &Paper::SCREEN),
            axes(),
        ),
        (
            "family",
            rod_shapes(&family(), &Paper::SCREEN),
            with(&["stable", "unstable", "end force (EI/ℓ²)"]),
        ),
        (
            "twisted",
            rod_shapes(&twisted_family(), &Paper::SCREEN),
            with(&["end rotation (deg)"]),
        ),
        (
            "ring",
            rod_shapes(&one(ring(), 0.06), &Paper::SCREEN),
            axes(),
        ),
        (
            "straight",
            rod_shapes(&one(bent(0.0, 0, 1), 0.0), &Paper::SCREEN),
            axes(),
        ),
        (
            "state",
            rod_state(&state(), &Paper::SCREEN),
            with(&[
                "couple (EI/ℓ)",
                "force (EI/ℓ²)",
                "curvature (1/ℓ)",
                "strain",
                "s (ℓ)",
                "m₁",
                "n₂ = 0",
                "v₁ = v₂ = 0",
                // |(0, 1.5, -14.8)| = 14.876, |(2, 1, 3.1)| = 3.822.
                "end force |n| = 14.9 EI/ℓ²",
                "end couple |m| = 3.82 EI/ℓ",
                "n",
                "m",
            ]),
        ),
        (
            "plane state",
            rod_state(&plane_state(), &Paper::SCREEN),
            with(&["m₁ = m₃ = 0", "v₁ to v₃ − 1 = 0", "end couple m = 0"]),
        ),
    ]
}

/// Catches a label lost or cut off by the edge of the page, NaN or infinite numbers, and a figure that differs from
/// one call to the next.
#[test]
fn figures_are_whole_labelled_and_the_same_each_time() {
    let again = all_figures();
    for ((name, svg, words), (_, second, _)) in all_figures().into_iter().zip(again) {
        let svg = svg.unwrap();
        assert!(svg == second.unwrap(), "{name}: not the same bytes");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(svg.len() < 150_000, "{name}: {} bytes", svg.len());
        let document = Document::parse(&svg).unwrap();
        let drawing = Drawing::new(&document);
        let found = drawing.words();
        for word in words {
            assert!(found.contains(&word), "{name}: no {word:?} in {found:?}");
        }
        for node in drawing.tagged("text") {
            let text = node.text().unwrap_or("").trim();
            // Average width of this font's letters.
            let long = 0.56 * number(node, "font-size") * text.chars().count() as f64;
            let turned = node.attribute("transform").is_some();
            let (at, across, page, cross) = if turned {
                let y = drawing.size.1 - number(node, "y");
                (y, number(node, "x"), drawing.size.1, drawing.size.0)
            } else {
                (
                    number(node, "x"),
                    number(node, "y"),
                    drawing.size.0,
                    drawing.size.1,
                )
            };
            let from = match node.attribute("text-anchor") {
                Some("middle") => at - 0.5 * long,
                Some("end") => at - long,
                _ => at,
            };
            assert!(
                from > -20.0 && from + long < page + 20.0 && 0.0 < across && across < cross,
                "{name}: {text:?} leaves the page"
            );
        }
        for node in drawing.tagged("polyline").chain(drawing.tagged("polygon")) {
            for (x, y) in points(node) {
                let inside = 0.0 <= x && x <= drawing.size.0 && 0.0 <= y && y <= drawing.size.1;
                assert!(inside, "{name}: ink at {x}, {y}");
            }
        }
    }
}

/// A diagram on a panel of known pixels: x and y from 0 to 1 with ticks at 0 and 1.
fn fold_diagram(index: Vec<Option<usize>>) -> BranchDiagram {
    // The fold at (0.8, 0.5) lies between two points of the branch.
    let y: Vec<f64> = (0..8).map(|i| (i as f64 + 0.5) / 8.0).collect();
    let x = y
        .iter()
        .map(|y| 0.8 - 2.0 * (y - 0.5) * (y - 0.5))
        .collect();
    BranchDiagram {
        x_label: "p".into(),
        x_range: Some([0.0, 1.0]),
        panels: vec![BranchPanel {
            y_label: "q".into(),
            y_range: Some([0.0, 1.0]),
            branches: vec![BranchLine {
                x,
                y,
                index,
                ..BranchLine::default()
            }],
            specials: vec![Special {
                x: 0.8,
                y: 0.5,
                kind: SpecialKind::Fold,
                label: "LP1".into(),
            }],
        }],
        ..BranchDiagram::default()
    }
}

/// The frame of the only panel: the polyline of five points that closes.
fn frame(drawing: &Drawing) -> [f64; 4] {
    let frame = drawing
        .tagged("polyline")
        .map(points)
        .find(|p| p.len() == 5 && p[0] == p[4])
        .expect("a frame");
    [frame[0].0, frame[0].1, frame[2].0, frame[2].1]
}

/// Catches a mark off the point, and a line solid past the fold or dashed before.
#[test]
fn the_fold_is_marked_and_the_style_changes_there() {
    let index = [0, 0, 0, 0, 1, 1, 1, 1].map(Some).to_vec();
    let svg = branch_diagram(&fold_diagram(index), &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let drawing = Drawing::new(&document);
    let [l, t, r, b] = frame(&drawing);
    let fold = (l + 0.8 * (r - l), 0.5 * (t + b));
    let near = |p: (f64, f64), tolerance: f64| (p.0 - fold.0).hypot(p.1 - fold.1) < tolerance;
    let marks = drawing.discs("#262626", t);
    assert!(
        marks.len() == 1 && near(marks[0], 2.0),
        "{marks:?} {fold:?}"
    );
    // Stable: one line 2.4 px wide whose last point is the fold; y grows upwards.
    let solid = drawing.lines("#0072B2", 24.0);
    assert_eq!(solid.len(), 1);
    assert!(near(*solid[0].last().unwrap(), 2.0), "{solid:?}");
    assert!(solid[0].iter().all(|p| p.1 >= fold.1 - 1.0));
    // Unstable: dashes that begin at the fold.
    let dashes = drawing.lines("#0072B2", 16.0);
    assert!(dashes.len() > 5, "{}", dashes.len());
    assert!(near(dashes[0][0], 2.0), "{dashes:?}");
    assert!(dashes.iter().flatten().all(|p| p.1 <= fold.1 + 1.0));
    // The label stands near its mark and covers no line.
    let label = drawing
        .tagged("text")
        .find(|n| n.text().is_some_and(|t| t.trim() == "LP1"));
    let label = label.expect("a label");
    let at = (number(label, "x"), number(label, "y"));
    assert!(near(at, 400.0) && at.0 > fold.0, "{at:?} {fold:?}");
}

/// Catches an index that changes the number of dashes the wrong way: none for stable, shorter for higher.
#[test]
fn dashes_tell_the_index() {
    let count = |index: Option<usize>, colour: &str, width: f64| {
        let svg = branch_diagram(&fold_diagram(vec![index; 8]), &Paper::SCREEN).unwrap();
        let document = Document::parse(&svg).unwrap();
        Drawing::new(&document).lines(colour, width).len()
    };
    let blue = "#0072B2";
    assert_eq!(count(Some(0), blue, 24.0), 1);
    let (one, two) = (count(Some(1), blue, 16.0), count(Some(2), blue, 16.0));
    let (three, nine) = (count(Some(3), blue, 19.0), count(Some(9), blue, 19.0));
    assert!(
        5 < one && one < two && two < three && three == nine,
        "{one} {two} {three} {nine}"
    );
    // Legend and branch.
    assert_eq!(count(None, "#969696", 9.0), 2);
}

/// Catches labels on top of one another where many special points crowd.
#[test]
fn crowded_labels_do_not_meet() {
    let mut diagram = fold_diagram(vec![Some(0); 8]);
    diagram.panels[0].specials = (0..6)
        .map(|i| Special {
            x: 0.4 + 0.02 * i as f64,
            y: 0.5 + 0.005 * i as f64,
            label: format!("BP{i}"),
            kind: SpecialKind::BranchPoint,
        })
        .collect();
    let svg = branch_diagram(&diagram, &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let drawing = Drawing::new(&document);
    let mut at = Vec::new();
    for i in 0..6 {
        let word = format!("BP{i}");
        // The last of the copies is the ink on its halo.
        let all = drawing
            .tagged("text")
            .filter(|n| n.text().is_some_and(|t| t.trim() == word));
        let label = all.last().expect("a label");
        at.push((number(label, "x"), number(label, "y")));
    }
    for (i, a) in at.iter().enumerate() {
        for b in &at[..i] {
            let apart = (a.0 - b.0).abs() > 200.0 || (a.1 - b.1).abs() > 115.0;
            assert!(apart, "{at:?}");
        }
    }
}

/// Catches unstable rods drawn like stable ones, and a break that is bridged.
#[test]
fn rods_are_whole_dashed_or_broken() {
    let blue = "#0072B2";
    let strokes = |rod: SpaceRod| {
        let svg = rod_shapes(&one(rod, 0.0), &Paper::SCREEN).unwrap();
        let document = Document::parse(&svg).unwrap();
        let drawing = Drawing::new(&document);
        let ink = |n: &&Node| n.attribute("stroke") == Some(blue);
        let lines: Vec<_> = drawing.tagged("polyline").filter(ink).map(points).collect();
        let step = |p: &[(f64, f64)]| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1);
        lines
            .iter()
            .flat_map(|l| l.windows(2))
            .map(step)
            .sum::<f64>()
    };
    let whole = strokes(bent(1.0, 0, 2));
    let dashed = strokes(SpaceRod {
        unstable: true,
        ..bent(1.0, 0, 2)
    });
    // On 6, off 3.6, less the round caps.
    assert!((0.35..0.7).contains(&(dashed / whole)), "{dashed} {whole}");
    let mut broken = bent(1.0, 0, 2);
    broken.points[40..60].fill([f64::NAN; 3]);
    let left = strokes(broken);
    assert!((0.74..0.84).contains(&(left / whole)), "{left} {whole}");
}

/// Catches scales that differ, or a nearly face-on camera that distorts: a circle in the plane x z is
/// seen as an ellipse of the ratio that the view's angles give.
#[test]
fn a_circle_stays_round() {
    let mut data = one(ring(), 0.0);
    data.clamp = false;
    data.triads = false;
    data.view = Some(View {
        azimuth: -90.0,
        elevation: 0.0,
    });
    let svg = rod_shapes(&data, &Paper::SCREEN).unwrap();
    let document = Document::parse(&svg).unwrap();
    let drawing = Drawing::new(&document);
    let ink = |n: &&Node| n.attribute("stroke") == Some("#0072B2");
    let all: Vec<_> = drawing
        .tagged("polyline")
        .filter(ink)
        .flat_map(points)
        .collect();
    let span = |f: fn(&(f64, f64)) -> f64| {
        let v = all.iter().map(f);
        v.clone().fold(f64::MIN, f64::max) - v.fold(f64::MAX, f64::min)
    };
    let (w, h) = (span(|p| p.0), span(|p| p.1));
    assert!(w > 2000.0 && (w - h).abs() < 0.005 * w, "{w} {h}");
}

fn refused(result: Result<String>, word: &str) {
    let error = result.expect_err("nothing to show");
    assert!(
        Error::is_domain(&error) && error.to_string().contains(word),
        "{error}"
    );
}

#[test]
fn nothing_to_show_is_an_error() {
    refused(
        branch_diagram(&BranchDiagram::default(), &Paper::SCREEN),
        "no panel",
    );
    let mut half = pitchfork();
    half.panels.push(BranchPanel::default());
    refused(branch_diagram(&half, &Paper::SCREEN), "panel 2");
    refused(rod_shapes(&RodShapes::default(), &Paper::SCREEN), "no rod");
    let holes = SpaceRod {
        points: vec![[f64::NAN; 3]; 3],
        ..SpaceRod::default()
    };
    refused(rod_shapes(&one(holes, 0.0), &Paper::SCREEN), "no rod");
    refused(rod_state(&RodState::default(), &Paper::SCREEN), "no rod");
    let mut short = state();
    short.forces.pop();
    refused(
        rod_state(&short, &Paper::SCREEN),
        "forces has 160 entries for 161",
    );
}

/// Catches panics, endless loops and NaN on points, directors, loads and ranges that are not sound.
#[test]
fn bad_numbers_never_panic() {
    for bad in [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e300,
        -1e300,
        1e-300,
        0.0,
    ] {
        let rod = |points: Vec<[f64; 3]>| SpaceRod {
            name: "a < b & \"c\"".into(),
            directors: vec![[[bad; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]; points.len()],
            points,
            value: Some(bad),
            ..SpaceRod::default()
        };
        let sets = [
            vec![[0.3, 0.2, 0.1]],
            vec![[bad, 0.0, 0.0]],
            vec![[0.0; 3], [bad; 3], [1.0, 0.0, 0.0]],
            vec![[0.0; 3], [0.5, bad, 0.0], [1.0, 0.2, bad]],
            vec![[bad; 3]; 4],
            vec![[1e-160, 0.0, 0.0], [2e-160, 0.0, bad]],
        ];
        let view = Some(View {
            azimuth: bad,
            elevation: bad,
        });
        let mut figures = Vec::new();
        for points in sets {
            let shapes = RodShapes {
                rods: vec![
                    rod(points.clone()),
                    SpaceRod {
                        unstable: true,
                        ..rod(points.clone())
                    },
                ],
                ribbon: bad,
                ..RodShapes::default()
            };
            figures.push(rod_shapes(&shapes, &Paper::SCREEN));
            figures.push(rod_shapes(&RodShapes { view, ..shapes }, &Paper::SCREEN));
            figures.push(rod_state(
                &RodState {
                    rod: rod(points),
                    end_force: Some([bad, 1.0, 0.0]),
                    end_couple: Some([bad; 3]),
                    s: vec![0.0, bad],
                    couples: vec![[bad; 3], [1.0, bad, 0.0]],
                    stretches: vec![[0.0, bad, 1.0]; 2],
                    view,
                    ..RodState::default()
                },
                &Paper::SCREEN,
            ));
        }
        let mut diagram = fold_diagram(vec![Some(0), None, Some(2)]);
        diagram.x_range = Some([bad, 1.0]);
        diagram.panels[0].y_range = Some([0.0, bad]);
        diagram.panels[0].branches[0].x[3] = bad;
        diagram.panels[0].branches[0].y[5] = bad;
        diagram.panels[0].specials[0].y = bad;
        figures.push(branch_diagram(&diagram, &Paper::SCREEN));
        let point = BranchPanel {
            branches: vec![BranchLine {
                x: vec![bad],
                y: vec![bad],
                ..BranchLine::default()
            }],
            ..BranchPanel::default()
        };
        figures.push(branch_diagram(
            &BranchDiagram {
                panels: vec![point],
                ..BranchDiagram::default()
            },
            &Paper::SCREEN,
        ));
        for svg in figures.iter().flatten() {
            assert!(Document::parse(svg).is_ok());
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
            assert!(svg.len() < 1_000_000);
        }
    }
}

/// One point, a straight rod along any axis, no extent at all: still figures.
#[test]
fn points_and_straight_rods_are_drawn() {
    for points in [
        vec![[0.3, 0.2, 0.1]],
        vec![[0.0; 3], [0.0; 3]],
        vec![[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]],
        vec![[0.0; 3], [1.0, 0.0, 0.0]],
        vec![[1e6, 0.0, 0.0], [1e6, 3.0, 0.0]],
    ] {
        let rod = SpaceRod {
            points,
            ..SpaceRod::default()
        };
        let svg = rod_shapes(&one(rod.clone(), 0.1), &Paper::SCREEN).unwrap();
        assert!(svg.contains("#0072B2") && !svg.contains("NaN"));
        rod_state(
            &RodState {
                rod,
                ..RodState::default()
            },
            &Paper::SCREEN,
        )
        .unwrap();
    }
}

/// Catches labels of directors that cover each other or the rods, and an invisible mode that only turns the ends.
#[test]
fn directors_of_modes_stand_where_they_tell_something() {
    let triad = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let rod = |x: f64, moved: [f64; 3], turned: f64| SpaceRod {
        points: vec![[x, 0.0, 0.0], [x, moved[1], 1.0]],
        directors: vec![triad.map(|d| d.map(|c| c * turned)); 2],
        ..SpaceRod::default()
    };
    let moves = |by: f64, turned: f64| SpaceRod {
        points: vec![[0.0; 3], [by, 0.0, 0.0]],
        directors: vec![[[0.0, turned, 0.0], [-turned, 0.0, 0.0], [0.0; 3]]; 2],
        ..SpaceRod::default()
    };
    let names = |rods: usize, by: f64, turned: f64| {
        let data = ModeShapes {
            rods: (0..rods)
                .map(|i| rod(i as f64, [0.0, 0.2, 0.0], 1.0))
                .collect(),
            modes: vec![ModeShape {
                title: "mode 1".into(),
                rods: vec![moves(by, turned); rods],
            }],
            ..ModeShapes::default()
        };
        let svg = mode_shapes(&data, &Paper::SCREEN).unwrap();
        let document = Document::parse(&svg).unwrap();
        let named = document
            .descendants()
            .filter(|n| n.text().is_some_and(|word| word.trim() == "d₁"));
        // The white ones make room for the name.
        let inked = named.filter(|n| n.is_element() && n.attribute("fill") != Some("#FFFFFF"));
        inked.count()
    };
    assert_eq!(names(1, 1.0, 1.0), 1);
    assert_eq!(names(3, 1.0, 1.0), 0);
    assert_eq!(names(3, 1e-3, 1.0), 3);
}
