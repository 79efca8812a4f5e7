//! HTML pages: content of the file, and behaviour in a browser.

use crate::program::Place;
use nalgebra::Vector2;
use serde_json::{Value, json};
use snaprod::body::PointMass;
use snaprod::elastica::{DraggedRod, Elastica, Equilibrium};
use snaprod::manifold::Multivalued;
use snaprod::motion::{Event, Options, Run};
use snaprod::scene::Scene;
use snaprod::study::{Silent, film, run};
use std::path::Path;
use std::process::Command;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");

/// The page of a scene, run into `out`, with its text checked.
fn page(place: &Place, command: &str, scene: &str, more: &[&str]) -> String {
    let given = [command, scene, "--out", "out", "--html"];
    let answer = place.run(&[&given, more].concat());
    assert_eq!((answer.code, answer.stderr.as_str()), (0, ""));
    let text = place.read(&format!("out/{command}.html"));
    is_one_file(&text);
    text
}

/// The page is small, and requests no other files.
#[track_caller]
fn is_one_file(text: &str) {
    assert!(text.len() < 300_000, "{} bytes", text.len());
    for outside in [
        "http:", "https:", "src=", "url(", "@import", "fetch(", "import(",
    ] {
        assert!(!text.contains(outside), "{outside}");
    }
    assert_eq!(text.matches("</script>").count(), 2);
}

/// The data of a page.
fn data(page: &str) -> Value {
    let begin = "<script type=\"application/json\" id=\"data\">";
    let (_, rest) = page.split_once(begin).unwrap();
    let (text, _) = rest.split_once("</script>").unwrap();
    serde_json::from_str(text).unwrap()
}

/// Numbers of the page, and their resolution.
fn reals(value: &Value) -> (Vec<f64>, f64) {
    let (mid, step) = (
        value["mid"].as_f64().unwrap(),
        value["step"].as_f64().unwrap(),
    );
    let bytes = decoded(value["q"].as_str().unwrap());
    let whole = bytes
        .chunks(2)
        .map(|two| i16::from_le_bytes([two[0], two[1]]));
    let real = |q: i16| match q {
        i16::MIN => f64::NAN,
        q => mid + step * f64::from(q),
    };
    (whole.map(real).collect(), step)
}

fn decoded(text: &str) -> Vec<u8> {
    const LETTERS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let bits = text
        .trim_end_matches('=')
        .chars()
        .map(|c| LETTERS.find(c).unwrap());
    let (mut bytes, mut held, mut count) = (Vec::new(), 0, 0);
    for six in bits {
        (held, count) = (held << 6 | six, count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((held >> count) as u8);
        }
    }
    bytes
}

/// Catches frames that are not states of the motion: an end off the mass, a rod of another length, a snap without its
/// two sides, a layer that does not fall from one side to the other; and texts of the scene that break the page.
#[test]
fn a_page_holds_the_motion() {
    let place = Place::new("page");
    let scene = std::fs::read_to_string(format!("{SCENES}/snap.toml")).unwrap();
    place.write("snap.toml", &format!("# </script> @@data@@ <b>\n{scene}"));
    let text = page(&place, "run", "snap.toml", &[]);
    assert!(text.contains("# &lt;/script&gt; @@data@@ &lt;b&gt;"));
    assert!(text.contains("<title>snap") && text.contains("snapshots.svg"));
    let data = data(&text);

    let t: Vec<f64> = serde_json::from_value(data["t"].clone()).unwrap();
    assert!((380..440).contains(&t.len()) && t[0] == 0.0 && t[t.len() - 1] == 3.0);
    let letters = data["place"].as_str().unwrap();
    assert_eq!(letters.len(), t.len());
    let (fold, landing) = (letters.find('f').unwrap(), letters.find('l').unwrap());
    assert!(landing - fold > 8 && letters[fold + 1..landing].chars().all(|c| c == 'y'));
    let snap = place.json("out/events.json")[0].clone();
    assert!((fold..=landing).all(|i| (t[i] - snap["t"].as_f64().unwrap()).abs() < 1e-11));
    // Frames are denser around the snap.
    let close = t.iter().filter(|t| **t < 0.1).count();
    assert!(close > 2 * t.len() / 30, "{close}");

    let rod = &data["rods"][0];
    let sections = rod["sections"].as_u64().unwrap() as usize;
    let (places, fine) = reals(&rod["at"]);
    let body = &data["bodies"][0]["at"];
    let [x, y] = [0, 1].map(|i| reals(&body[i]));
    assert!(fine < 1e-4 && x.1 < 1e-4);
    let (mut longest, mut shortest) = (0.0_f64, 2.0_f64);
    for (i, rod) in places.chunks(2 * sections).enumerate() {
        let end = &rod[2 * sections - 2..];
        let off = (end[0] - x.0[i]).hypot(end[1] - y.0[i]);
        // In the layer the end of a rod is held to the tolerance of the layer's steps.
        let held = if letters[i..].starts_with('y') {
            2e-3
        } else {
            0.0
        };
        assert!(off <= 2.0 * fine + held, "picture {i}: {off:e}");
        let pairs = rod.chunks(2).zip(rod.chunks(2).skip(1));
        let long: f64 = pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        (longest, shortest) = (longest.max(long), shortest.min(long));
    }
    assert!(
        longest < 1.0 + 1e-3 && shortest > 0.99,
        "{shortest} {longest}"
    );

    let energy = |name: &str| {
        let all = data["energies"].as_array().unwrap();
        reals(&all.iter().find(|one| one["name"] == name).unwrap()["values"])
    };
    let ((elastic, fine), (total, _)) = (energy("elastic"), energy("total with losses and work"));
    assert!((fold..landing).all(|i| elastic[i + 1] < elastic[i]));
    let released = elastic[fold] - elastic[landing];
    assert!((released - snap["released"].as_f64().unwrap()).abs() < 2.0 * fine);
    assert!(total.iter().all(|e| (e - total[0]).abs() < 1e-6));
    // The path lies on the sheets: its end has the position of the planar motion.
    let path = [0, 1].map(|i| reals(&data["sheet"]["path"][i]).0);
    assert!((0..t.len()).all(|i| letters[i..].starts_with('y')
        || (path[0][i] - x.0[i]).hypot(path[1][i] - y.0[i]) < 1e-4));
}

/// Catches frames of another motion: states changed by observation, ends of rods off their bodies, missing or
/// superfluous frames, gaps in the trace, lost energy.
#[test]
fn a_film_is_the_motion() {
    for name in ["snap", "viscous", "flywheel"] {
        let text = std::fs::read_to_string(format!("{SCENES}/{name}.toml")).unwrap();
        let prepared = run::Prepared::new(&Scene::parse(&text).unwrap()).unwrap();
        let found = film::film(&prepared, &[], &[], [60, 200], &mut Silent).unwrap();
        assert!(
            (45..85).contains(&found.stills.len()),
            "{}",
            found.stills.len()
        );
        assert!(
            (140..230).contains(&found.trace.len()),
            "{}",
            found.trace.len()
        );
        let times: Vec<f64> = found.stills.iter().map(|at| at.now.t).collect();
        assert!(times.is_sorted() && found.trace.is_sorted_by(|a, b| a.t <= b.t));
        let last = times[times.len() - 1];
        assert_eq!(found.trace[found.trace.len() - 1].t, last);
        let total = found.trace[0].ledger.total();
        for at in &found.trace {
            assert!((at.ledger.total() - total).abs() < 1e-7 * total, "{name}");
        }
        // At a snap the study of shapes returns one of the two sides.
        let way = found.stills.iter();
        let way = way.filter(|at| at.place == film::PictureRole::Way);
        let way: Vec<_> = way.step_by(9).collect();
        let asked: Vec<f64> = way.iter().map(|at| at.now.t).collect();
        let shapes = run::shapes(&prepared, &asked, 41, &mut Silent).unwrap();
        for (still, shape) in way.iter().zip(&shapes) {
            let (rod, other) = (&still.rods[0], &shape[0]);
            assert_eq!(rod.len(), other.len());
            for (a, b) in rod.iter().zip(other) {
                let off = (a.translation.vector - b.1.translation.vector).norm();
                assert!(off < 1e-8, "{name} at t = {}: {off:e}", still.now.t);
            }
            let end = rod[rod.len() - 1].translation.vector;
            let off = (end - still.now.bodies[0].pose.translation.vector).norm();
            assert!(off < 1e-8, "{name}: the end is {off:e} from the body");
        }
    }
}

/// Catches wrong shapes of branch points: an end off the position given by the parameter, or a special point without a
/// shape.
#[test]
fn a_page_holds_the_branch() {
    let place = Place::new("branch-page");
    let text = page(&place, "branch", &format!("{SCENES}/lateral.toml"), &[]);
    let data = data(&text);
    let rows: Vec<usize> = serde_json::from_value(data["pictures"]["rows"].clone()).unwrap();
    let rod = &data["pictures"]["rods"][0];
    let sections = rod["sections"].as_u64().unwrap() as usize;
    let ((places, fine), (parameter, step)) = (reals(&rod["at"]), reals(&data["at"]));
    assert_eq!(places.len(), 3 * sections * rows.len());
    for (row, rod) in rows.iter().zip(places.chunks(3 * sections)) {
        let end = &rod[3 * sections - 3..];
        assert!((end[0] - parameter[*row]).abs() < fine + step, "row {row}");
        assert!(end[1].abs() < fine && (end[2] - 0.6).abs() < fine);
    }
    let specials = data["specials"].as_array().unwrap();
    let kinds: Vec<&str> = specials
        .iter()
        .map(|at| at["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["stability change", "fold"]);
    let shown = |at: &Value| rows.contains(&(at["row"].as_u64().unwrap() as usize));
    assert!(specials.iter().all(shown));
    let fold = specials[1]["row"].as_u64().unwrap() as usize;
    assert!((parameter[fold] + 0.612021928).abs() < step);
}

/// Catches equilibria in another order than the list, and shapes that are not theirs: stable ones come first, by
/// energy, and every rod ends where it is held.
#[test]
fn a_page_holds_the_equilibria() {
    let place = Place::new("equilibria-page");
    let scene = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [40.0, 1.0], torsion = 30.0 }\n\
                 [end]\nposition = [0.35, 0.0, 0.3]\n";
    place.write("held.toml", scene);
    let text = page(&place, "equilibria", "held.toml", &[]);
    let data = data(&text);
    let states = data["states"].as_array().unwrap();
    assert!(states.len() > 2, "{}", states.len());
    let key = |state: &Value| (state["index"] != 0, state["energy"].as_f64().unwrap());
    assert!(states.windows(2).all(|pair| key(&pair[0]) <= key(&pair[1])));
    for state in states {
        let (places, fine) = reals(&state["rods"][0]["at"]);
        let end = &places[places.len() - 3..];
        for (x, wanted) in end.iter().zip([0.35, 0.0, 0.3]) {
            assert!((x - wanted).abs() < fine, "{end:?}");
        }
    }
}

/// Catches rods off their nodes, and counts in conflict with the map.
#[test]
fn a_page_holds_the_sheets() {
    let place = Place::new("sheets-page");
    let answer = place.run(&["sheets", "--html", "--out", "out"]);
    assert!(answer.text().contains("sheets.html"));
    let text = place.read("out/sheets.html");
    is_one_file(&text);
    let data = data(&text);
    let sheets = data["nodes"].as_array().unwrap();
    assert_eq!(sheets.len(), 4);
    for sheet in sheets {
        let part = |name: &str| reals(&sheet[name]);
        let ((shape, fine), (x, _), (y, _)) = (part("shape"), part("x"), part("y"));
        let sections = sheet["sections"].as_u64().unwrap() as usize;
        assert_eq!(shape.len(), 2 * sections * x.len());
        let off = shape
            .chunks(2 * sections)
            .zip(x.iter().zip(&y))
            .map(|(rod, end)| {
                let tip = &rod[2 * sections - 2..];
                (tip[0] - end.0).abs().max((tip[1] - end.1).abs())
            });
        let held = off.clone().filter(|off| *off < 2.0 * fine).count();
        // A rod with a tiny loop has no shape on the page.
        assert!(
            held + 1 >= x.len() && off.clone().count() == x.len(),
            "{held}"
        );
    }
    let counts = decoded(data["map"]["counts"].as_str().unwrap());
    let n = data["map"]["points"].as_u64().unwrap() as usize;
    // (0.3, 0.2) and (-0.5, 0): three stable equilibria and two.
    assert_eq!((counts[n * 72 + 78], counts[n * 60 + 30]), (3, 2));
    let Some(report) = looked_at(&place, &text, WALK) else {
        return;
    };
    is_sound(&report, 4);
    assert_eq!(report["walked"], serde_json::json!([1, 14]), "{report}");
}

/// Script: moves over a page of sheets by keys.
const WALK: &str = r#"
show({ sheet: 0, node: 0 });
["ArrowRight", "ArrowUp", "ArrowRight", "]", "w", "-"].forEach(press);
report.walked = [chosen.sheet, chosen.node];
report.drawn = drawn();
done();
"#;

/// Script added to every page in a browser: reads all canvases and writes a report.
const LOOK: &str = r#"<script>
const report = { errors: window.faults };
const inked = (canvas) => {
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let k = 0; k < pixels.length; k += 4) if (pixels[k + 3] && pixels[k] + pixels[k + 1] + pixels[k + 2] < 600) count++;
  return count;
};
const press = (key) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
const drawn = () => [...document.querySelectorAll(".board canvas")].map(inked);
const done = () => {
  report.requests = performance.getEntriesByType("resource").length;
  const pre = document.createElement("pre");
  pre.id = "report"; pre.textContent = JSON.stringify(report);
  document.body.append(pre);
};
"#;

/// Script: steps, turns and plays a page of a motion.
const PLAY: &str = r#"
// The end of the one rod on the one body; of several the scene says what is where.
const off = (i) => {
  if (rods.length + bodies.length > 2) return 0;
  const rod = rods[0], body = bodies[0], end = section(rod, i, rod.sections - 1);
  return Math.hypot(...end.map((x, k) => x - body.at[k][i]));
};
report.end = 0;
for (let i = 0; i < data.t.length; i++) if (!"y".includes(data.place[i])) report.end = Math.max(report.end, off(i));
press("End"); report.last = player.frame;
press("Home"); report.first = player.frame;
press("]"); report.snap = player.frame;
press("ArrowRight"); report.next = player.frame;
press("d"); press("+"); press("g");
report.drawn = drawn();
press("Home"); press(" ");
setTimeout(() => { report.frame = player.frame; done(); }, 1800);
"#;

/// Script: steps a page of branches through the special points, and moves the pointer to them.
const POINT: &str = r#"
press("Home"); press("]"); report.snap = chosen;
press("]"); report.next = chosen;
press("d"); press("f");
report.drawn = drawn();
const canvas = diagram.board.canvas, box = canvas.getBoundingClientRect();
const [x, y] = [diagram.axes.px(at[rows[5]]) + box.left + 1, diagram.axes.py(diagram.column.values[rows[5]]) + box.top];
canvas.dispatchEvent(new PointerEvent("pointerdown", { clientX: x, clientY: y }));
report.pointed = chosen;
done();
"#;

/// The report of the page in an installed browser; `None`, with a note on the error stream, without a browser.
fn looked_at(place: &Place, page: &str, act: &str) -> Option<Value> {
    looked_at_with(place, page, act, &[])
}

/// The report of the page in a browser with more options.
fn looked_at_with(place: &Place, page: &str, act: &str, options: &[&str]) -> Option<Value> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let paths = std::env::var_os("PATH")?;
    let found = std::env::split_paths(&paths)
        .flat_map(|directory| names.map(|name| directory.join(name)))
        .find(|path| path.is_file());
    let Some(browser) = found else {
        eprintln!("no Chromium is installed: the page was not looked at");
        return None;
    };
    let watch = "<head><script>window.faults = []; addEventListener(\"error\", (e) => window.faults.push(e.message));</script>";
    let watched = page.replacen("<head>", watch, 1).replacen(
        "</body>",
        &format!("{LOOK}{{{act}}}</script></body>"),
        1,
    );
    place.write("looked.html", &watched);
    // On a busy machine the browser may exit before the page is done; retry.
    (0..3)
        .find_map(|_| report_of(place, &browser, options))
        .or_else(|| panic!("no report: the script broke off"))
}

/// The report of the page as written; `None` if cut off.
fn report_of(place: &Place, browser: &Path, options: &[&str]) -> Option<Value> {
    let out = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
        ])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=2500",
            "--dump-dom",
        ])
        .args(options)
        .arg(format!(
            "--user-data-dir={}",
            place.join("browser").display()
        ))
        .arg(format!("file://{}", place.join("looked.html").display()))
        .output()
        .unwrap();
    let (dom, log) = (
        String::from_utf8_lossy(&out.stdout),
        String::from_utf8_lossy(&out.stderr),
    );
    let said: Vec<&str> = log
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(said.is_empty(), "{said:?}");
    let (_, rest) = dom.split_once("<pre id=\"report\">")?;
    let (report, _) = rest.split_once("</pre>").unwrap();
    Some(serde_json::from_str(report).unwrap())
}

/// Catches scripts that fail, request files, or draw nothing on a canvas.
#[track_caller]
fn is_sound(report: &Value, boards: usize) {
    assert_eq!(report["errors"], serde_json::json!([]), "{report}");
    assert_eq!(report["requests"], 0, "{report}");
    let inked: Vec<u64> = serde_json::from_value(report["drawn"].clone()).unwrap();
    assert_eq!(inked.len(), boards);
    assert!(inked.iter().all(|n| *n > 400), "{report}");
}

/// Catches pages of motions that do not move, or show the end of the rod off the mass.
#[test]
fn a_browser_plays_the_page() {
    let place = Place::new("browser");
    for (scene, boards) in [("snap", 4), ("platform", 3)] {
        let scene = format!("{SCENES}/{scene}.toml");
        let text = page(&place, "run", &scene, &["--no-figures"]);
        let Some(report) = looked_at(&place, &text, PLAY) else {
            return;
        };
        is_sound(&report, boards);
        let number = |name: &str| report[name].as_f64().unwrap();
        assert_eq!(number("first"), 0.0, "{report}");
        assert!(number("end") < 1e-4 && number("last") > 300.0, "{report}");
        let next = (number("snap") + 1.0).min(number("last"));
        assert_eq!(number("next"), next, "{report}");
        assert!(number("frame") > 0.0, "{report}");
    }
}

/// Script: drags the mass of the playable page through a snap by pointer, and moves it by keys.
const DRAG: &str = r#"
ready.then(() => {
  const seen = () => asked(core.state());
  report.states = [seen()];
  const box = canvas.getBoundingClientRect();
  const at = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { clientX: box.left + px(x), clientY: box.top + py(y), pointerId: 1 }));
  at("pointerdown", now.x, now.y);
  for (const [x, y] of [[0.85, -0.2], [0.85, -0.47], [-1.5, -0.4]]) { at("pointermove", x, y); report.states.push(seen()); }
  at("pointerup", now.x, now.y);
  at("pointermove", 0, 0);
  ["ArrowRight", "ArrowUp"].forEach((key) => { press(key); report.states.push(seen()); });
  report.released = snap.released;
  report.fell = falling.shapes.length;
  report.end = Math.hypot(shape.at(-2) - now.x, shape.at(-1) - now.y);
  press("r"); seek(); report.others = others.length;
  press("n"); falling = null; draw();
  report.drawn = drawn();
  // The page shows an arch by itself, drawn down until the arch snaps.
  press("r"); shown = 1; show(3400, 0);
  report.shown = [count, snap.y, shown === null || falling !== null];
  falling = null; shown = null; press("r"); falling = null;
  let v = [0, 1.5], snaps = 0;
  for (let k = 0; k < 200; k++) {
    const [vx, vy, ...more] = asked(core.swing(...v, 0, DRAG, 0.01));
    [v, snaps] = [[vx, vy], snaps + more.length / 7];
  }
  report.swung = [...seen().slice(4, 6), ...v, snaps];
  document.getElementById("swing").click(); report.swings = velocity !== null;
  document.getElementById("reset").click(); report.held = velocity === null && count === 0;
  document.getElementById("other").click(); report.other = asked(core.state())[0] !== START[0];
  done();
});
"#;

/// Catches a page whose core is out of date with the library (`tools/build_play.sh` renews it), or does not follow the
/// pointer, snap, or stay within the length of the rod.
#[test]
fn a_browser_drags_the_rod() {
    let place = Place::new("browser-play");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/play.html");
    let text = std::fs::read_to_string(path).unwrap();
    is_one_file(&text);
    let Some(report) = looked_at(&place, &text, DRAG) else {
        return;
    };
    is_sound(&report, 1);
    let states: Vec<[f64; 11]> = serde_json::from_value(report["states"].clone()).unwrap();
    let mut rod = DraggedRod::new(Vector2::new(states[0][0], states[0][1])).unwrap();
    let mut released = Vec::new();
    for (step, there) in states.iter().enumerate() {
        let snaps = rod.drag_to(&Vector2::new(there[4], there[5])).unwrap();
        released.extend(snaps.iter().map(|snap| (step, snap.released)));
        let q = rod.chart();
        let e = Equilibrium::new(q[0], q[1]).unwrap();
        let own = [
            e.p, e.w, e.lambda, e.theta1, e.x, e.y, e.energy, e.force[0], e.force[1],
        ];
        for (own, page) in own.iter().zip(there) {
            assert!(
                (own - page).abs() < 1e-9 * (1.0 + own.abs()),
                "{step}: {own} {page}"
            );
        }
        // The search for all equilibria includes the rod shown.
        let stable = Elastica.stable_at(&Vector2::new(e.x, e.y)).unwrap();
        assert!(stable.iter().any(|one| (one - q).norm() < 1e-6), "{step}");
    }
    let number = |name: &str| report[name].as_f64().unwrap();
    assert!(released.len() == 1 && released[0].0 == 2, "{released:?}");
    assert!(
        (released[0].1 - number("released")).abs() < 1e-6,
        "{report}"
    );
    assert!(
        number("fell") > 20.0 && number("end") < 1e-9 && report["others"] == 2,
        "{report}"
    );
    // The page shows one snap, at the fold below the arch, and its buttons work.
    assert_eq!(
        (&report["shown"][0], &report["shown"][2]),
        (&json!(1), &json!(true))
    );
    assert!(
        (report["shown"][1].as_f64().unwrap() + 0.425).abs() < 1e-3,
        "{report}"
    );
    assert!(
        ["swings", "held", "other"]
            .iter()
            .all(|name| report[name] == true),
        "{report}"
    );
    let swung: [f64; 5] = serde_json::from_value(report["swung"].clone()).unwrap();
    let alone = swings_of_the_library(&states[0]);
    // The page throws a taut mass back a little early: places are near, velocities behind a bounce less so.
    for ((page, own), bound) in swung.iter().zip(&alone).zip([5e-3, 5e-3, 0.1, 0.1, 0.5]) {
        assert!((page - own).abs() < bound, "{swung:?} {alone:?}");
    }
    let far = states[3][4].hypot(states[3][5]);
    assert!((far - 0.995).abs() < 1e-9, "{far}");
}

/// Place, velocity and number of snaps of the library's own motion of the mass that swings on the page, from the state
/// of the page.
fn swings_of_the_library(state: &[f64; 11]) -> [f64; 5] {
    let body = PointMass::new(1.0).unwrap().with_drag(0.15).unwrap();
    let (q, v) = (Vector2::new(state[0], state[1]), Vector2::new(0.0, 1.5));
    let mut run = Run::new(&Elastica, &body, q, v, Options::new(2.0).unwrap()).unwrap();
    let snaps = run.by_ref().filter(|event| matches!(event, Event::Snap(_)));
    let snaps = snaps.count();
    let [r, v] = [run.now().pose, run.now().phase.v];
    [r.x, r.y, v.x, v.y, snaps as f64]
}

/// A script of a hand without a keyboard: buttons, touches, and the state that the page keeps.
const TOUCH: &str = r#"
const button = (name) => document.querySelector(`[data-act="${name}"]`);
press("Home"); button("ArrowRight").click(); report.next = player.frame;
button("]").click(); report.snap = player.frame; report.address = location.hash;
button("[").click(); report.back = player.frame;
const sheet = pictureOf("words");
report.picture = [sheet.width, inked(sheet)];
// A rod of 41 sections as a curve: no corner of more than two degrees between its chords.
const curve = shape(rods[0], 150), turn = (k) => Math.atan2(curve[k + 1][1] - curve[k][1], curve[k + 1][0] - curve[k][0]);
report.points = curve.length;
report.corner = Math.max(...curve.slice(2).map((_, k) => Math.abs(Math.sin(turn(k + 1) - turn(k)))));
// Where two faces cross the nearer one is seen, and a line behind both is hidden.
const space = views.at(-1).space;
space.begin();
const tilted = (by) => [[-1, -1, 0], [1, -1, 0], [1, 1, by], [-1, 1, by]].map((p) => p.map((x, i) => space.centre[i] + (0.2 * x) / space.scale[i]));
space.face(tilted(1), FRONT); space.face(tilted(-1), BACK); space.fill();
report.hidden = !space.sees(...space.place(space.centre.map((x, i) => x - space.sight[i] / space.scale[i])), 0);
report.free = space.sees(...space.place(space.centre.map((x, i) => x + space.sight[i] / space.scale[i])), 0);
// Samples are not joined where the velocities do not explain the way between.
report.joined = joins([0, 0.1, 0.2, 5], [[0, 0.1, 0.2, 0.3]], [[1, 1, 1, -4]]);
report.wide = document.documentElement.scrollWidth - innerWidth;
report.dark = dark.matches && getComputedStyle(document.body).backgroundColor === "rgb(22, 24, 27)";
report.drawn = drawn();
done();
"#;

/// Catches buttons that differ from keys, a picture without its drawing, and rods with corners. Catches faces that
/// hide by their order instead of their depth, chords between samples far apart, and a page wider than a phone.
#[test]
fn a_browser_has_buttons_and_depth_on_a_dark_phone() {
    let place = Place::new("browser-phone");
    let scene = format!("{SCENES}/snap.toml");
    let text = page(&place, "run", &scene, &["--no-figures"]);
    let dark = [
        "--window-size=500,900",
        "--blink-settings=preferredColorScheme=0",
    ];
    let Some(report) = looked_at_with(&place, &text, TOUCH, &dark) else {
        return;
    };
    assert_eq!(report["errors"], json!([]), "{report}");
    assert_eq!(
        (&report["next"], &report["back"]),
        (&json!(1), &json!(0)),
        "{report}"
    );
    let snap = report["snap"].as_u64().unwrap();
    assert_eq!(report["address"], format!("#{}", snap + 1), "{report}");
    assert!(report["picture"][1].as_u64().unwrap() > 4000, "{report}");
    assert!(report["points"].as_u64().unwrap() > 100, "{report}");
    assert!(report["corner"].as_f64().unwrap() < 0.12, "{report}");
    for name in ["hidden", "free", "dark"] {
        assert_eq!(report[name], true, "{name}: {report}");
    }
    assert_eq!(
        report["joined"],
        json!([false, true, true, false]),
        "{report}"
    );
    assert!(report["wide"].as_i64().unwrap() <= 0, "{report}");
}

/// Catches pages of branches without their special points, or with the wrong point under the pointer.
#[test]
fn a_browser_points_at_the_branch() {
    let place = Place::new("browser-branch");
    let scene = format!("{SCENES}/lateral.toml");
    let text = page(&place, "branch", &scene, &["--no-figures"]);
    let Some(report) = looked_at(&place, &text, POINT) else {
        return;
    };
    is_sound(&report, 2);
    assert!(
        report["snap"].as_u64() < report["next"].as_u64(),
        "{report}"
    );
    assert_eq!(report["pointed"], 5, "{report}");
}

/// Catches events on a page labelled by keys of files, or without units.
#[test]
fn events_of_a_page_have_words_and_units() {
    let place = Place::new("page_events");
    let scene = std::fs::read_to_string(format!("{SCENES}/snap.toml")).unwrap();
    place.write("si.toml", &format!("units = \"si\"\n{scene}"));
    let text = page(&place, "run", "si.toml", &["--set", "run.duration=0.05"]);
    let events = text.split("<h2>Events</h2>").nth(1).unwrap();
    let events = events.split("</section>").next().unwrap();
    for words in [
        "<th>time (s)</th>",
        "<td>snap</td>",
        "from S_1^-",
        "energy released 10.2631 J",
        " m/s",
    ] {
        assert!(events.contains(words), "{words} not in {events}");
    }
    assert!(!["vx", "released 10.2631,", "_"].iter().any(|key| {
        // Names of sheets have their index.
        events.replace("S_", "S").contains(key)
    }));
}
