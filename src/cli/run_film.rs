//! Films of runs: a moving SVG, a GIF, or an MP4 that the program ffmpeg makes.

use super::Refusal;
use super::page::scene_text;
use super::progress::Progress;
use super::rod_figures;
use super::run::RunArgs;
use super::run_page::sized;
use nalgebra::{Isometry3, Vector3};
use snaprod::plot::{FilmFigure, FilmFrame, SpaceBody, SpaceRod, film as drawn, moving};
use snaprod::study::film::{Film, PictureRole, Still, film};
use snaprod::study::run::{Prepared, RunHeader, RunRecord};
use snaprod::study::{outline, outline_in_plane};
use std::path::Path;
use std::process::{Command, Stdio};

/// Number of frames, without those of snaps, and of points of the paths.
const FRAMES: usize = 150;
const POINTS: usize = 2000;
/// Number of snaps around which frames are denser.
const MOMENTS: usize = 20;
/// Seconds that a frame is shown: on the way, in a layer, at each side of a snap, and at the end.
const BRIEF: f64 = 0.04;
const LAYER: f64 = 0.08;
const SIDE: f64 = 0.6;
const END: f64 = 1.2;
/// Frames a second of an MP4.
const RATE: f64 = 25.0;
/// Length of the arrow of the hardest contact, in lengths of the rod.
const PUSH: f64 = 0.2;

/// The formats of films.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilmFormat {
    Svg,
    Gif,
    Mp4,
}

impl FilmFormat {
    /// The format by the name of a file; refuses a format beyond this program.
    pub fn of(file: &Path) -> Result<Self, Refusal> {
        let named = |why: &str| Refusal(format!("--film {}: {why}", file.display()));
        let end = file.extension().and_then(|end| end.to_str());
        let format = match end.map(str::to_lowercase).as_deref() {
            Some("svg") => return Ok(Self::Svg),
            Some("gif") => Self::Gif,
            Some("mp4") => Self::Mp4,
            _ => {
                return Err(named(
                    "give a file that ends in .svg, .gif or .mp4, such as film.svg",
                ));
            }
        };
        if !cfg!(feature = "png") {
            return Err(named(
                "this program was built without PNG; build it with `cargo build --release --features png`, or give a file that ends in .svg",
            ));
        }
        if format == Self::Mp4 && !has_ffmpeg() {
            return Err(named(
                "the program ffmpeg is not found; install it, or give a file that ends in .gif or .svg",
            ));
        }
        Ok(format)
    }
}

fn has_ffmpeg() -> bool {
    let mut ask = Command::new("ffmpeg");
    ask.arg("-version")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    ask.status().is_ok_and(|status| status.success())
}

/// Follows the motion again, and writes its film.
pub fn write(
    args: &RunArgs,
    file: &Path,
    prepared: &Prepared,
    record: &RunRecord,
) -> Result<(), Refusal> {
    let format = FilmFormat::of(file)?;
    let mut marks: Vec<f64> = record.line().snaps.iter().map(|(t, _)| *t).collect();
    marks.sort_by(f64::total_cmp);
    marks.truncate(MOMENTS);
    let forks = record.lineage().into_iter().skip(1);
    let forks: Vec<usize> = forks.map(|branch| branch.fork).collect();
    let mut progress = Progress::new(args.output.speaks());
    let film = film(prepared, &forks, &marks, [FRAMES, POINTS], &mut progress)?;
    progress.finish();
    let sized = sized(&scene_text(&args.scene));
    let figure = figure(&film, &record.header, &sized);
    let frames = drawn(&figure, &args.output.figures.print.paper())?;
    let seconds: Vec<f64> = figure.frames.iter().map(|frame| frame.seconds).collect();
    let bytes = match format {
        FilmFormat::Svg => moving(&frames, &seconds)?.into_bytes(),
        FilmFormat::Gif => as_gif(&frames, &seconds)?,
        FilmFormat::Mp4 => return as_mp4(file, &frames, &seconds),
    };
    std::fs::write(file, bytes)
        .map_err(|e| Refusal(format!("cannot write {}: {e}", file.display())))
}

/// A body whose size the scene does not give: no larger than a tenth of the rod, as on pages.
fn smaller(mut body: SpaceBody, length: f64) -> SpaceBody {
    let edges = body.half_edges.iter().flatten();
    let reach = edges.map(|x| x * x).sum::<f64>().sqrt();
    let size = (0.1 * length / reach).min(1.0);
    body.half_edges = body.half_edges.map(|edge| edge.map(|x| x * size));
    body
}

/// The data of the film; `sized` says of each body whether the scene gives its size.
fn figure(film: &Film, header: &RunHeader, sized: &[bool]) -> FilmFigure {
    let length = header.scales.length;
    let count = film.stills.len();
    let contacts = film.stills.iter().flat_map(pushes);
    let hardest = contacts.map(|(_, force)| force.norm()).fold(0.0, f64::max);
    let frame = |(k, still): (usize, &Still)| {
        let seconds = match still.place {
            _ if k + 1 == count => END,
            PictureRole::Fold | PictureRole::Landing => SIDE,
            PictureRole::Layer => LAYER,
            PictureRole::Way => BRIEF,
        };
        let note = match still.place {
            PictureRole::Way => "",
            PictureRole::Fold => ": at the fold",
            PictureRole::Layer => ": the rod falls, time stands still",
            PictureRole::Landing => ": after the snap",
        };
        let unit = header.units.time();
        let words = format!("t = {:.4} {unit}", still.now.t);
        let rods = still.rods.iter().zip(&header.rods);
        let bodies = still.now.bodies.iter().zip(&header.bodies);
        let arrow = |(at, force): (Vector3<f64>, Vector3<f64>)| {
            [at.into(), (at + force * (PUSH * length / hardest)).into()]
        };
        FilmFrame {
            words: words.trim_end().to_owned() + note,
            seconds,
            rods: rods
                .map(|(rod, about)| SpaceRod {
                    directors: Vec::new(),
                    ..rod_figures::posed(smooth(rod).iter(), &about.grounds)
                })
                .collect(),
            bodies: bodies
                .zip(sized.iter().chain(std::iter::repeat(&false)))
                .map(|((body, about), sized)| {
                    let drawn = rod_figures::body(&about.solid, &body.pose, None, None);
                    if *sized {
                        drawn
                    } else {
                        smaller(drawn, length)
                    }
                })
                .collect(),
            forces: pushes(still).map(arrow).collect(),
            falls: matches!(still.place, PictureRole::Fold | PictureRole::Layer),
        }
    };
    let path = |k: usize| {
        let poses = film.trace.iter().map(|at| &at.bodies[k].pose);
        let solid = &header.bodies[k].solid;
        poses.map(|pose| solid.centre(pose).into()).collect()
    };
    let groove = |k: usize| {
        let poses = film.trace.iter().map(|at| &at.bodies[k].pose);
        header.bodies[k].solid.groove_around(poses, length)
    };
    let bodies = 0..header.bodies.len();
    FilmFigure {
        frames: film.stills.iter().enumerate().map(frame).collect(),
        paths: bodies.clone().map(path).collect(),
        grooves: bodies.map(groove).collect(),
        obstacles: obstacles(film, header),
        planar: !header.in_space(),
        units: rod_figures::scaled(header.units, &header.scales),
    }
}

/// Contacts of a frame: the place of each, and the force on the body.
fn pushes(still: &Still) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
    let contacts = still.now.contact.iter().flat_map(|all| &all.contacts);
    contacts.map(|at| (at.point, at.normal * at.normal_force + at.friction))
}

/// Lines on the obstacles.
fn obstacles(film: &Film, header: &RunHeader) -> Vec<Vec<[f64; 3]>> {
    let all = header.obstacles.iter();
    if header.in_space() {
        let bodies = film.stills.iter().flat_map(|still| &still.now.bodies);
        let places: Vec<_> = bodies.map(|body| body.pose.translation.vector).collect();
        return all.flat_map(|each| outline(each, &places)).collect();
    }
    let clamp = film.stills.first();
    let centre = clamp.map_or_else(Vector3::zeros, |at| at.now.clamp.translation.vector);
    let lines = all.flat_map(|each| outline_in_plane(each, &centre, header.scales.length));
    let raised = |line: Vec<[f64; 2]>| line.into_iter().map(|[x, y]| [x, y, 0.0]).collect();
    lines.map(raised).collect()
}

/// A rod with a section between each two: on the cubic that has their places and their directors d3.
fn smooth(rod: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let Some(first) = rod.first() else {
        return Vec::new();
    };
    let mut all = vec![*first];
    for pair in rod.windows(2) {
        let [a, b] = [pair[0].translation.vector, pair[1].translation.vector];
        let [from, to] = [pair[0], pair[1]].map(|at| at.rotation * Vector3::z());
        let middle = 0.5 * (a + b) + (from - to) * (0.125 * (b - a).norm());
        let turned = pair[0].rotation.nlerp(&pair[1].rotation, 0.5);
        all.extend([Isometry3::from_parts(middle.into(), turned), pair[1]]);
    }
    all
}

#[cfg(feature = "png")]
fn as_gif(frames: &[String], seconds: &[f64]) -> Result<Vec<u8>, Refusal> {
    Ok(snaprod::plot::gif(frames, seconds, 1.0)?)
}

#[cfg(not(feature = "png"))]
fn as_gif(_: &[String], _: &[f64]) -> Result<Vec<u8>, Refusal> {
    unreachable!("refused by FilmFormat::of")
}

/// Sends the frames to ffmpeg as PNG, each as often as it is shown.
#[cfg(feature = "png")]
fn as_mp4(file: &Path, frames: &[String], seconds: &[f64]) -> Result<(), Refusal> {
    use std::io::Write;
    let broken = |why: String| Refusal(format!("ffmpeg: {why}"));
    let rate = RATE.to_string();
    let mut ffmpeg = Command::new("ffmpeg")
        .args([
            "-y",
            "-loglevel",
            "error",
            "-f",
            "image2pipe",
            "-c:v",
            "png",
        ])
        .args(["-framerate", &rate, "-i", "-"])
        // Sides of an H.264 film are even.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"])
        .args(["-pix_fmt", "yuv420p", "-movflags", "+faststart"])
        .arg(file)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| broken(e.to_string()))?;
    if let Some(mut pipe) = ffmpeg.stdin.take() {
        for (svg, seconds) in frames.iter().zip(seconds) {
            let picture = snaprod::plot::png(svg, 2.0)?;
            for _ in 0..(seconds * RATE).round().max(1.0) as usize {
                // ffmpeg itself says why it stopped reading.
                if pipe.write_all(&picture).is_err() {
                    break;
                }
            }
        }
    }
    let end = ffmpeg
        .wait_with_output()
        .map_err(|e| broken(e.to_string()))?;
    if end.status.success() {
        return Ok(());
    }
    Err(broken(
        String::from_utf8_lossy(&end.stderr).trim().to_owned(),
    ))
}

#[cfg(not(feature = "png"))]
fn as_mp4(_: &Path, _: &[String], _: &[f64]) -> Result<(), Refusal> {
    let _ = RATE;
    unreachable!("refused by FilmFormat::of")
}
