//! Figures: deterministic, well-formed, labelled; broken data give an error, never a panic.

use crate::plot_data::*;
use snaprod::plot::*;
use snaprod::{Error, Result};

/// A figure's name, a way to make it, words it must contain and its largest size in kB.
type Case = (
    &'static str,
    Box<dyn Fn() -> Result<String>>,
    &'static [&'static str],
    usize,
);

fn cases() -> Vec<Case> {
    vec![
        (
            "snapshots",
            Box::new(|| snapshots(&snapshots_data(&motion(0.3)))),
            &[
                "x (ℓ)",
                "y (ℓ)",
                "time t (√(μℓ³/EI))",
                "fold",
                "snap",
                "path of the mass",
                "−0.5",
            ],
            150,
        ),
        (
            "energies",
            Box::new(|| energies(&energies_data(&motion(0.3)))),
            &[
                "energy (EI/ℓ)",
                "|error| (EI/ℓ)",
                "time t",
                "kinetic",
                "elastic",
                "potential",
                "dissipated",
                "work",
                "total",
            ],
            150,
        ),
        (
            "path_on_surface",
            Box::new(|| path_on_surface(&path_data(&motion(0.3), 20, 24))),
            &["x (ℓ)", "y (ℓ)", "θ(1) (rad)", "motion", "snap"],
            1000,
        ),
        (
            "phase_portrait",
            Box::new(|| phase_portrait(&portrait_data())),
            &["ψ = θ − α", "ψₛ / λ", "ABCD: S₁⁺", "−π/2"],
            150,
        ),
        (
            "sheets_lambda_alpha",
            Box::new(|| sheets_lambda_alpha(&[sheets_lam(48, 32)])),
            &["λ", "α (rad)", "θ(1) (rad)", "S₀⁺", "S₁⁻"],
            1000,
        ),
        (
            "sheets_over_disc",
            Box::new(|| sheets_over_disc(&[sheets_disc(48, 32)])),
            &["x (ℓ)", "y (ℓ)", "θ(1) (rad)", "S₀⁻", "S₁⁺", "fold"],
            1000,
        ),
        (
            "fold_map",
            Box::new(|| fold_map(&fold_map_data(61, 40))),
            &["x (ℓ)", "y (ℓ)", "1st fold", "cusp", "2 stable equilibria"],
            300,
        ),
        (
            "energy_landscape",
            Box::new(|| energy_landscape(&landscape_data(61, 40))),
            &["x (ℓ)", "y (ℓ)", "elastic energy (EI/ℓ)", "lowest stable"],
            300,
        ),
        (
            "lines",
            Box::new(|| lines(&lines_data())),
            &[
                "evaluations of the force",
                "error of r(1), relative",
                "10⁻⁸",
                "RK4",
            ],
            150,
        ),
    ]
}

#[test]
fn figures_are_deterministic_well_formed_and_labelled() {
    for (name, make, words, size) in cases() {
        let svg = make().unwrap();
        assert!(svg == make().unwrap(), "{name}: not the same bytes");
        assert!(svg.len() < 1000 * size, "{name}: {} bytes", svg.len());
        let document = roxmltree::Document::parse(&svg).unwrap();
        let root = document.root_element();
        let number = |a: &str| root.attribute(a).unwrap().parse::<f64>().unwrap();
        let view: Vec<f64> = root
            .attribute("viewBox")
            .unwrap()
            .split(' ')
            .map(|n| n.parse().unwrap())
            .collect();
        assert_eq!(
            [view[2], view[3]],
            [10.0 * number("width"), 10.0 * number("height")]
        );
        let texts: Vec<&str> = document
            .descendants()
            .filter_map(|n| n.text())
            .map(str::trim)
            .collect();
        for word in words {
            assert!(
                texts.iter().any(|t| t.contains(word)),
                "{name}: no {word:?} in {texts:?}"
            );
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        let family = document
            .descendants()
            .find_map(|n| n.attribute("font-family"));
        assert_eq!(family, Some("DejaVu Sans, sans-serif"));
    }
}

fn refused(result: Result<String>) {
    assert!(result.as_ref().is_err_and(Error::is_domain), "{result:?}");
}

#[test]
fn nothing_to_show_is_an_error() {
    refused(snapshots(&Snapshots::default()));
    refused(energies(&Energies::default()));
    refused(path_on_surface(&PathOnSurface::default()));
    refused(phase_portrait(&Portrait::default()));
    refused(sheets_lambda_alpha(&[Sheets::default()]));
    refused(sheets_over_disc(&[]));
    refused(fold_map(&FoldMap::default()));
    refused(energy_landscape(&EnergyLandscape::default()));
    refused(lines(&Lines::default()));
}

/// Numbers that must not break anything.
const BAD: [f64; 6] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e300,
    -1e300,
    0.0,
];

#[test]
fn bad_numbers_never_panic() {
    for bad in BAD {
        let curve = Curve {
            x: vec![0.0, bad, 0.5],
            y: vec![bad, 0.1, 0.2, 0.3],
        };
        let patch = |n: usize| Patch {
            name: "a < b & \"c\"".into(),
            rows: n,
            columns: 2,
            points: vec![
                [0.0, 0.1, 0.2],
                [0.5, bad, 0.4],
                [0.3, 0.3, bad],
                [bad, 0.0, 0.1],
            ],
            ..Patch::default()
        };
        let units = AxisUnits {
            rod: bad,
            ..AxisUnits::default()
        };
        let field = Field {
            x: [-1.0, 1.0],
            y: [-1.0, 1.0],
            columns: 2,
            rows: 3,
            values: vec![0.0, bad, 1.0, 2.0, bad, 3.0],
        };
        let figures = [
            snapshots(&Snapshots {
                shapes: vec![
                    Shape {
                        time: 0.0,
                        axis: curve.clone(),
                    },
                    Shape {
                        time: bad,
                        axis: curve.clone(),
                    },
                ],
                path: curve.clone(),
                folds: vec![curve.clone()],
                snaps: vec![[bad, 0.0]],
                walls: vec![[[bad, 0.0], [1.0, bad]]],
                units: units.clone(),
            }),
            energies(&Energies {
                time: vec![0.0, 1.0, bad],
                kinetic: vec![bad, 1.0],
                error: vec![0.0, bad, 1.0],
                snaps: vec![bad],
                ..Energies::default()
            }),
            path_on_surface(&PathOnSurface {
                sheets: Sheets {
                    patches: vec![patch(2), patch(usize::MAX)],
                    view: Some(View {
                        azimuth: bad,
                        elevation: bad,
                    }),
                    units: units.clone(),
                    ..Sheets::default()
                },
                path: vec![[0.0; 3], [bad; 3], [0.2, 0.2, 0.1]],
                jumps: vec![[[bad; 3], [0.0; 3]]],
            }),
            sheets_lambda_alpha(&[Sheets {
                patches: vec![patch(2), patch(0)],
                bounds: Some([[0.0, bad], [0.0, 1.0], [0.0, 1.0]]),
                ..Sheets::default()
            }]),
            sheets_lambda_alpha(&[Sheets {
                patches: vec![patch(2)],
                ..Sheets::default()
            }]),
            phase_portrait(&Portrait {
                orbits: vec![curve.clone()],
                verticals: vec![bad],
                arcs: vec![Arc {
                    name: String::new(),
                    curve: curve.clone(),
                }],
                points: vec![Named {
                    name: "A".into(),
                    at: [bad, bad],
                }],
                ..Portrait::default()
            }),
            fold_map(&FoldMap {
                counts: field.clone(),
                folds: vec![vec![curve.clone()]; 9],
                cusps: vec![[bad, bad]],
                units: units.clone(),
            }),
            energy_landscape(&EnergyLandscape {
                panels: vec![(String::new(), field.clone())],
                folds: vec![curve.clone()],
                scale: Scale::Log,
                range: Some([bad, 2.0]),
                units: units.clone(),
            }),
            lines(&Lines {
                series: vec![Series {
                    x: curve.x.clone(),
                    y: curve.y.clone(),
                    ..Series::default()
                }],
                equal: true,
                ..Lines::default()
            }),
            lines(&Lines {
                series: vec![Series {
                    x: vec![1.0, 2.0],
                    y: vec![3.0, bad],
                    ..Series::default()
                }],
                x_log: true,
                y_log: true,
                ..Lines::default()
            }),
        ];
        for svg in figures.iter().flatten() {
            assert!(roxmltree::Document::parse(svg).is_ok());
            assert!(!svg.contains("NaN"));
        }
        for wrong in [field.columns + 1, 0, usize::MAX] {
            let counts = Field {
                columns: wrong,
                ..field.clone()
            };
            refused(fold_map(&FoldMap {
                counts,
                ..FoldMap::default()
            }));
        }
    }
}

#[cfg(feature = "png")]
#[test]
fn png_has_the_size_asked_for() {
    let svg = lines(&lines_data()).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let root = document.root_element();
    let side = |a: &str| root.attribute(a).unwrap().parse::<f32>().unwrap();
    for scale in [1.0, 2.5] {
        let bytes = png(&svg, scale).unwrap();
        assert_eq!(&bytes[1..4], b"PNG");
        let word = |i: usize| u32::from_be_bytes(bytes[i..i + 4].try_into().unwrap());
        assert_eq!(word(16), (scale * side("width")).round() as u32);
        assert_eq!(word(20), (scale * side("height")).round() as u32);
        // The letters are there: without a font the picture would be much smaller.
        assert!(bytes.len() > 20_000, "{}", bytes.len());
    }
    for (svg, scale) in [
        ("no drawing", 1.0),
        (&svg, 0.0),
        (&svg, f32::NAN),
        (&svg, 1e9),
        (&svg, -1.0),
    ] {
        assert!(png(svg, scale).is_err_and(|e| e.is_domain()));
    }
}
