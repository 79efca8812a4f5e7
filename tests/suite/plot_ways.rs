//! Figures of ways in space, and of sweeps over one field.

use snaprod::plot::*;

/// Catches a path in a coordinate plane drawn as a sliver in a spatial box, a groove without label, and a labelled
/// groove where none exists.
#[test]
fn a_way_in_a_plane_is_drawn_in_it() {
    let time: Vec<f64> = (0..=40).map(|k| f64::from(k) / 40.0).collect();
    let point = |t: &f64| [0.01 * t * t, 0.0, *t];
    let way = SpaceWay {
        points: time.iter().map(point).collect(),
        time,
        ..SpaceWay::default()
    };
    let bent = SpaceWay {
        points: way
            .points
            .iter()
            .map(|p| [p[0], p[2] * p[2], p[2]])
            .collect(),
        groove: way.points.clone(),
        ..way.clone()
    };
    let words = |way: &SpaceWay, word: &str| {
        let svg = space_way(way, &Paper::SCREEN).unwrap();
        svg.matches(&format!(">\n{word}\n<")).count()
    };
    // Each coordinate of the plane has a panel and an axis; the constant coordinate stands in the title.
    assert_eq!(
        ["x (ℓ)", "y (ℓ)", "z (ℓ)"].map(|word| words(&way, word)),
        [2, 0, 2]
    );
    assert_eq!([&way, &bent].map(|way| words(way, "y = 0 ℓ")), [1, 0]);
    assert_eq!(
        ["x (ℓ)", "y (ℓ)", "z (ℓ)"].map(|word| words(&bent, word)),
        [2, 2, 2]
    );
    assert_eq!([&way, &bent].map(|way| words(way, "groove")), [0, 1]);
}

/// Catches curves of a sweep that connect points on both sides of a snap, or lose colours and names.
#[test]
fn curves_of_a_sweep_break_where_the_outcome_changes() {
    let data = SweptCurves {
        x: SweptAxis {
            label: "load (N)".into(),
            values: vec![1.0, 2.0, 3.0, 4.0],
            log: false,
        },
        curves: vec![("x at the end (m)".into(), vec![0.0, 0.1, 0.7, f64::NAN])],
        words: ["0", "0", "1", "1"].map(String::from).to_vec(),
        ..SweptCurves::default()
    };
    let alike = SweptCurves {
        words: Vec::new(),
        ..data.clone()
    };
    let drawn = |data: &SweptCurves| swept_curves(data, &Paper::SCREEN).unwrap();
    let (marked, plain) = (drawn(&data), drawn(&alike));
    for word in ["load (N)", "x at the end (m)", "0", "1"] {
        assert!(marked.contains(&format!(">\n{word}\n<")), "{word}");
    }
    let lines = |svg: &str| svg.matches("<polyline").count();
    // One line less, over the gap to the third point; the legend has no lines.
    assert_eq!(lines(&plain) - lines(&marked), 1);
    let short = SweptCurves {
        words: vec!["0".into()],
        ..data
    };
    let refused = swept_curves(&short, &Paper::SCREEN).unwrap_err();
    assert!(
        refused.to_string().contains("words has 1 entries"),
        "{refused}"
    );
}
