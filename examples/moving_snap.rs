//! README's animated picture: the reference snap as an animated SVG, which any page shows as an image.
//!
//! The rod follows its mass to the fold, falls through the shapes of its viscous layer, in which time stands still,
//! and flies on. Every frame is a shape computed at its time; none is interpolated.
//! `cargo run --release --example moving_snap -- figures` writes `snap_moving.svg` there; without a directory it only
//! checks.

use snaprod::elastica::fold_curve;
use snaprod::motion::{Event, Outcome};
use snaprod::scene::Scene;
use snaprod::study::film::{PictureRole, Still, film};
use snaprod::study::{Silent, run};
use std::fmt::Write;

type Failure = Box<dyn std::error::Error>;

/// Duration shown, in the scene's time.
const DURATION: f64 = 0.8;
const PICTURES: usize = 90;
/// Display times in seconds: of a frame, of the last frame, and of the two sides of the snap.
const BRIEF: f64 = 0.05;
const LONG: f64 = 0.6;
/// Pixels per length of the rod, and the position of the clamp.
const SCALE: f64 = 330.0;
const CLAMP: [f64; 2] = [48.0, 60.0];
const SIZE: [f64; 2] = [420.0, 420.0];

fn main() -> Result<(), Failure> {
    let mut scene = Scene::parse(include_str!("../scenes/snap.toml"))?;
    if let Some(run) = &mut scene.run {
        run.duration = DURATION;
    }
    let prepared = run::Prepared::new(&scene)?;
    let mut motion = prepared.motion()?;
    let snap = loop {
        match motion.advance() {
            Some(Event::Snap(snap)) => break snap.t,
            Some(Event::Stop(Outcome::EndOfTime)) | None => return Err("it does not snap".into()),
            Some(_) => {}
        }
    };
    let film = film(&prepared, &[], &[snap], [PICTURES, 2], &mut Silent)?;
    let stills = &film.stills;
    for still in stills {
        let end = still.rods[0].last().ok_or("no rod")?;
        let off = (end.translation.vector - still.now.bodies[0].pose.translation.vector).norm();
        // Shapes of the layer are as accurate as the choice of the landing requires.
        let bound = if still.place == PictureRole::Layer {
            1e-3
        } else {
            1e-9
        };
        assert!(
            off < bound,
            "the end is {off:e} from the mass at t = {}",
            still.now.t
        );
    }
    assert!(
        stills
            .iter()
            .filter(|still| still.place == PictureRole::Layer)
            .count()
            > 8
    );
    // Steps are longer than the interval of frames, so frames must also be taken within steps.
    assert!(stills.len() > PICTURES, "{} pictures", stills.len());
    let svg = animated(stills)?;
    assert!(svg.len() < 150_000, "{} bytes", svg.len());
    if let Some(directory) = std::env::args().nth(1) {
        std::fs::write(format!("{directory}/snap_moving.svg"), svg)?;
    }
    Ok(())
}

/// A point in pixels, to a tenth.
fn pixel(x: f64, y: f64) -> String {
    format!("{:.1},{:.1}", CLAMP[0] + SCALE * x, CLAMP[1] - SCALE * y)
}

/// The frames in sequence, repeated.
fn animated(stills: &[Still]) -> Result<String, Failure> {
    let seconds = |k: usize| match stills[k].place {
        _ if k + 1 == stills.len() => 2.0 * LONG,
        PictureRole::Fold | PictureRole::Landing => LONG,
        PictureRole::Way | PictureRole::Layer => BRIEF,
    };
    let whole: f64 = (0..stills.len()).map(seconds).sum();
    let mut begun = 0.0;
    let mut times = Vec::new();
    for k in 0..stills.len() {
        times.push(format!("{:.5}", begun / whole));
        begun += seconds(k);
    }
    let (times, shown) = (times.join(";"), format!("{whole:.2}s"));
    let animate = |what: &str, values: Vec<String>| {
        format!(
            "<animate attributeName=\"{what}\" dur=\"{shown}\" repeatCount=\"indefinite\" calcMode=\"discrete\" keyTimes=\"{times}\" values=\"{}\"/>",
            values.join(";")
        )
    };
    let rod = |still: &Still| -> String {
        let places = still.rods[0].iter().map(|at| at.translation.vector);
        places
            .map(|at| pixel(at.x, at.y))
            .collect::<Vec<_>>()
            .join(" ")
    };
    let mass = |still: &Still| still.now.bodies[0].pose.translation.vector;
    let falls = |still: &Still| matches!(still.place, PictureRole::Fold | PictureRole::Layer);
    let each = |of: &dyn Fn(&Still) -> String| stills.iter().map(of).collect::<Vec<_>>();
    let across = each(&|still| format!("{:.1}", CLAMP[0] + SCALE * mass(still).x));
    let down = each(&|still| format!("{:.1}", CLAMP[1] - SCALE * mass(still).y));
    let colours = each(&|still| if falls(still) { "#D55E00" } else { "#0072B2" }.to_owned());
    let word = |says: &'static str, when: &dyn Fn(&Still) -> bool| {
        let seen = stills
            .iter()
            .map(|still| if when(still) { "1" } else { "0" }.to_owned());
        let first = if when(&stills[0]) { 1 } else { 0 };
        format!(
            "<text x=\"405\" y=\"410\" text-anchor=\"end\" opacity=\"{first}\">{says}{}</text>\n",
            animate("opacity", seen.collect())
        )
    };
    let folded = stills.iter().position(falls).unwrap_or(stills.len());
    let before = stills
        .get(folded)
        .map_or(f64::INFINITY, |still| still.now.t);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" font-family=\"DejaVu Sans, sans-serif\" font-size=\"15\" fill=\"#262626\">\n\
         <title>A rod snaps</title>\n<desc>A rod, clamped at the left, carries a mass at its end. The mass reaches the fold, a dashed line, where the shape of the rod ceases to \
         exist; the rod falls to another shape while the mass stands still, and both fly on.</desc>\n<rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>\n",
        SIZE[0], SIZE[1], SIZE[0], SIZE[1]
    );
    let half = fold_curve(1, 0.01, 8.0, 0.05)?;
    let fold = half
        .iter()
        .map(|at| pixel(at.equilibrium.x, at.equilibrium.y));
    // The curve begins and ends at the straight rod, without a loop and with a vanishing loop.
    let straight = || std::iter::once(pixel(1.0, 0.0));
    let fold: Vec<String> = straight().chain(fold).chain(straight()).collect();
    writeln!(
        svg,
        "<circle cx=\"{}\" cy=\"{}\" r=\"{SCALE}\" fill=\"none\" stroke=\"#BBBBBB\"/>\n\
         <polyline points=\"{}\" fill=\"none\" stroke=\"#C8102E\" stroke-dasharray=\"5 4\"/>",
        CLAMP[0],
        CLAMP[1],
        fold.join(" ")
    )?;
    let path: Vec<String> = stills
        .iter()
        .map(|still| pixel(mass(still).x, mass(still).y))
        .collect();
    writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#999999\" stroke-width=\"0.8\"/>\n\
         <path d=\"M{} {}v48\" stroke=\"#262626\" stroke-width=\"4\"/>",
        path.join(" "),
        CLAMP[0] - 2.0,
        CLAMP[1] - 24.0
    )?;
    // The radius of the circle is the scale of the figure.
    for (x, y, colour, name) in [
        (190, 293, "#C8102E", "fold"),
        (302, 316, "#777777", "full reach, ℓ"),
        (164, 168, "#777777", "path of the mass"),
    ] {
        writeln!(
            svg,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"12\" fill=\"{colour}\">{name}</text>"
        )?;
    }
    writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#0072B2\" stroke-width=\"4\" stroke-linecap=\"round\" stroke-linejoin=\"round\">{}{}</polyline>",
        rod(&stills[0]),
        animate("points", each(&rod)),
        animate("stroke", colours)
    )?;
    writeln!(
        svg,
        "<circle cx=\"{}\" cy=\"{}\" r=\"11\" fill=\"#262626\">{}{}</circle>",
        across[0],
        down[0],
        animate("cx", across.clone()),
        animate("cy", down.clone())
    )?;
    svg += &word("the mass moves towards the fold", &|still| {
        still.now.t < before
    });
    svg += &word("the rod falls; the mass stands still", &|still| {
        falls(still)
    });
    svg += &word("on another sheet", &|still| {
        !falls(still) && still.now.t >= before
    });
    Ok(svg + "</svg>\n")
}
