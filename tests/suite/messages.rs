//! Error messages of scenes, in the scene's own units.

use snaprod::error::{Cause, Stuck};
use snaprod::scene::{Scales, Scene, Units};
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table, branch, equilibrium};

/// A strip of length `l` and stiffness `b` with the mass `m`, and its natural units.
struct Strip {
    b: f64,
    units: Units,
    k: Scales,
}

impl Strip {
    fn new(l: f64, b: f64, m: f64, units: Units) -> Self {
        let k = Scales::new(l, b, m);
        Self { b, units, k }
    }

    fn head(&self, model: &str, rod: &str) -> String {
        let units = match self.units {
            Units::Si => "units = \"si\"\n",
            Units::Dimensionless => "",
        };
        let length = self.k.length;
        format!("{units}[rod]\nmodel = \"{model}\"\nlength = {length:?}\n{rod}\n")
    }

    /// The rest of a scene of motion.
    fn moved(&self, body: &str, start: &str, loads: &str) -> String {
        let (m, t) = (self.k.mass, self.k.time);
        format!(
            "[body]\nmass = {m:?}\n{body}\n[start]\n{start}\n[loads]\n{loads}\n[run]\nduration = {:?}",
            1e-3 * t
        )
    }

    fn planar(&self, damping: f64, start: &str, loads: &str) -> String {
        let rod = format!(
            "bending_stiffness = {:?}\ndamping = {:?}",
            self.b,
            damping * self.k.viscosity()
        );
        self.head("elastica", &rod) + &self.moved("", start, loads)
    }

    fn section(&self) -> String {
        let b = self.b;
        format!(
            "section = {{ bending = [{b:?}, {:?}], torsion = {:?} }}",
            b,
            0.7 * b
        )
    }

    fn spatial(&self, body: &str, start: &str) -> String {
        let rod = format!(
            "{}\ndamping = {{ proportional = {:?} }}",
            self.section(),
            0.05 * self.k.time
        );
        self.head("cosserat", &rod) + &self.moved(body, start, "")
    }

    fn statics(&self, rest: &str) -> String {
        let force = [1.0, 0.0, -1.0].map(|f| f * self.k.force);
        self.head("cosserat", &self.section()) + &format!("[end]\nforce = {force:?}\n{rest}")
    }

    fn guess(&self, wrench: [f64; 6]) -> String {
        let (m, n) = (self.k.energy, self.k.force);
        let [a, b, c, d, e, f] = wrench;
        let wrench = [a * m, b * m, c * m, d * n, e * n, f * n];
        self.statics(&format!(
            "[start]\nwrench = {wrench:?}\n[solve]\npath = \"spatial\""
        ))
    }

    /// Size of the unit named by a symbol, or by the quantity of a list.
    fn size(&self, unit: &str) -> f64 {
        let k = &self.k;
        match unit {
            "m" => k.length,
            "s" => k.time,
            "m/s" => k.velocity,
            "rad/s" => 1.0 / k.time,
            "rad/m" => 1.0 / k.length,
            "N" | "force" => k.force,
            "N m" | "couple" => k.energy,
            _ => 1.0,
        }
    }
}

/// Message of a scene of motion that fails, or of one without an equivalent spring and dashpot.
fn motion(text: &str) -> String {
    let scene = Scene::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let ready = Prepared::new(&scene).and_then(|prepared| {
        drop(prepared.motion()?);
        Ok(prepared)
    });
    match ready {
        Err(e) => e.to_string(),
        Ok(prepared) => {
            let mut tables: Vec<Table> = Vec::new();
            let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
            record.spring.unwrap().unwrap_err()
        }
    }
}

/// Message of a scene of statics without solution, or the remarks of its branch.
fn statics(text: &str) -> String {
    let scene = Scene::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    match scene.continuation {
        None => equilibrium(&scene).unwrap_err().to_string(),
        Some(_) => branch(&scene, &mut Silent).unwrap().remarks.join("\n"),
    }
}

/// The numbers of a message with their unit symbols; a list or number without one has the word before it.
fn numbers(text: &str) -> Vec<(f64, String)> {
    const SYMBOLS: [&str; 7] = ["m/s", "rad/s", "rad/m", "N m", "N", "m", "s"];
    let symbol = |after: &str| {
        let after = after.strip_prefix(' ')?;
        let fits = |symbol: &&&str| {
            let rest = after.strip_prefix(**symbol);
            rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '/'))
        };
        SYMBOLS.iter().find(fits).map(|symbol| symbol.to_string())
    };
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = text[at..].find(|c: char| c.is_ascii_digit()) {
        let start = at + start;
        let end = text[start..]
            .find(|c: char| !(c.is_ascii_digit() || ".e-".contains(c)))
            .map_or(text.len(), |end| start + end);
        let digits = text[start..end].trim_end_matches(['.', 'e', '-']);
        at = start + digits.len();
        let negative = text[..start].ends_with('-') && !text[..start].ends_with("e-");
        let value: f64 = digits
            .parse()
            .unwrap_or_else(|_| panic!("{digits} in {text}"));
        // The unit of a list follows its closing bracket; the word precedes the opening bracket.
        let (before, after) = match (text[..start].rfind('['), text[at..].find(']')) {
            (Some(open), Some(close)) if !text[open..start].contains(']') => {
                (&text[..open], &text[at + close + 1..])
            }
            _ => (&text[..start], &text[at..]),
        };
        let word = before.trim_end_matches(['-', ' ']).rsplit(' ').next();
        let word = word.filter(|word| ["couple", "force"].contains(word));
        let unit = symbol(&text[at..]).or_else(|| symbol(after));
        let unit = unit.or_else(|| word.map(str::to_owned)).unwrap_or_default();
        found.push((if negative { -value } else { value }, unit));
    }
    found
}

/// A unit required in the message, and the failing computation.
type Case<'a> = (&'a str, &'a dyn Fn(&Strip) -> String);

/// Catches a message with numbers in the units of the rod, or of the motion's own time, instead of the scene's. The
/// same failures of one strip, in steel, 0.3 m long, and in its natural units, to the printed digits.
#[test]
#[ignore = "second tier: 17 s"]
fn messages_are_in_the_units_of_the_scene() {
    let steel = Strip::new(0.3, 0.04375, 0.05, Units::Si);
    let rod = Strip::new(1.0, 1.0, 1.0, Units::Dimensionless);
    let vector = |x: [f64; 2], unit: f64| format!("{:?}", x.map(|x| x * unit));
    let along = |s: &Strip| format!("velocity = {}", vector([0.5, 0.1], s.k.velocity));
    let dead = |s: &Strip, x: [f64; 2]| format!("dead = {}", vector(x, s.k.force));
    let inertia = |s: &Strip| {
        let j = 1e-3 * s.k.mass * s.k.length.powi(2);
        format!("inertia = {:?}", [j; 3])
    };
    let cases: [Case<'_>; 13] = [
        ("m/s", &|s| {
            motion(&s.planar(0.0, &format!("rest = \"straight\"\n{}", along(s)), ""))
        }),
        ("N", &|s| {
            motion(&s.planar(0.0, "rest = \"straight\"", &dead(s, [-3.0, 0.1])))
        }),
        ("N", &|s| {
            motion(&s.planar(0.0, "rest = \"straight\"", &dead(s, [1e9, 0.1])))
        }),
        ("N", &|s| {
            motion(&s.planar(0.1, "settled = true", &dead(s, [-3.0, 0.0])))
        }),
        ("N", &|s| {
            motion(&s.planar(0.1, "settled = true", &dead(s, [1e9, 1.0])))
        }),
        ("m/s", &|s| {
            motion(&s.planar(0.1, &format!("rest = \"straight\"\n{}", along(s)), ""))
        }),
        ("m/s", &|s| {
            let v = [0.0, 0.3, 0.5].map(|v| v * s.k.velocity);
            motion(&s.spatial("joint = \"ball\"", &format!("velocity = {v:?}")))
        }),
        ("rad/m", &|s| {
            let u1 = 0.5 / s.k.length;
            motion(&s.spatial(&inertia(s), &format!("strain = {{ u1 = [{u1:?}] }}")))
        }),
        ("m", &|s| {
            let offset = format!("offset = [0.0, {:?}, 0.0]", 0.1 * s.k.length);
            motion(&s.spatial(&format!("{}\n{offset}", inertia(s)), ""))
        }),
        ("rad/s", &|s| {
            let w = [0.5, 0.0, 0.1].map(|w| w / s.k.time);
            motion(&s.spatial(&inertia(s), &format!("angular_velocity = {w:?}")))
        }),
        ("couple", &|s| {
            // An early stop: the position is printed as zero, with rounding only.
            statics(&s.guess([1e12, 0.0, 0.0, 1e12, 0.0, 0.0]))
        }),
        ("force", &|s| {
            statics(&s.guess([30.0, 5.0, 0.0, -20.0, 0.0, 1.0]))
        }),
        ("N m", &|s| {
            statics(&s.statics(
                "[continue]\nparameter = \"end.load\"\nfrom = 0.0\nto = 0.1\ndeflate = true",
            ))
        }),
    ];
    for (needed, case) in cases {
        let (own, plain) = (case(&steel), case(&rod));
        let (a, b) = (numbers(&own), numbers(&plain));
        let what = format!("{own}\n{plain}");
        assert!(a.len() == b.len(), "{what}");
        assert!(a.iter().any(|(_, unit)| unit == needed), "{needed}: {what}");
        for ((x, unit), (y, _)) in a.iter().zip(&b) {
            let expected = y * steel.size(unit);
            // At least five digits are printed; zeros agree up to rounding.
            let scaled = (x - expected).abs() <= 1e-4 * expected.abs() + 1e-12 * steel.size(unit);
            assert!(scaled, "{x} {unit} for {expected}: {what}");
        }
    }
    let cause = Cause::StepCollapsed {
        next: 2.5e-13,
        tolerance: 1e-10,
    };
    let stuck = Stuck::new(0.5, cause, "raise the tolerance");
    let told = stuck.message().in_units(&steel.k.of_messages(Units::Si));
    let next = 2.5e-13 * steel.k.time;
    let expected = format!("(next step {next:.1e} s, tolerance 1.0e-10)");
    assert!(told.to_string().contains(&expected), "{told}");
}
