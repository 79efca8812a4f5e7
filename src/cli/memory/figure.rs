//! kernel.svg: the relaxation function and the creep function.

use snaprod::plot::{self, KernelCurve, KernelFigure};
use snaprod::scene::Units;
use snaprod::study::memory::{EndJoint, KernelEntry, MemoryRecord};

/// Relative difference below which two curves look the same, or one curve looks constant.
const SAME: f64 = 1e-6;
/// Ratio of values from which an axis is logarithmic.
const WIDE: f64 = 300.0;

/// Drawn entries of the kernel. The entries of a welded end have different units: then the diagonal is drawn, relative
/// to the spring.
pub fn data(response: &MemoryRecord, times: &[f64], entries: &[KernelEntry]) -> KernelFigure {
    let kernel = &response.kernel;
    let mixed = response.end == EndJoint::Welded;
    let (relaxed, glassy) = (kernel.relaxed(), kernel.glassy());
    let longest = kernel.creep(f64::MAX);
    let curve = |function: char, place: (usize, usize)| {
        let found = |entry: &&KernelEntry| entry.function == function && entry.place == place;
        let entry = entries.iter().find(found)?;
        let (last, first) = match function {
            'R' => (&relaxed, Some(&glassy)),
            _ => (&longest, None),
        };
        let scale = if mixed { last[place] } else { 1.0 };
        let mut curve = KernelCurve {
            name: String::new(),
            values: entry.values.iter().map(|x| x / scale).collect(),
            instantaneous: first.map(|matrix| matrix[place] / scale),
            relaxed: Some(last[place] / scale),
        };
        level(&mut curve);
        Some(curve)
    };
    // Components that look the same in both panels are drawn once.
    let mut drawn: Vec<(String, [Option<KernelCurve>; 2])> = Vec::new();
    for (k, &i) in response.shown.iter().enumerate() {
        for &j in &response.shown[k..] {
            let pair = [curve('R', (i, j)), curve('J', (i, j))];
            if pair == [None, None] || mixed && i != j {
                continue;
            }
            let name = if i == j {
                response.name(i).to_owned()
            } else {
                format!("{} {}", response.name(i), response.name(j))
            };
            let twin = drawn.iter_mut().find(|(_, other)| {
                let mut panels = other.iter().zip(&pair);
                panels.all(|(a, b)| same(a.as_ref(), b.as_ref()))
            });
            match twin {
                Some((names, _)) => *names = format!("{names}, {name}"),
                None => drawn.push((name, pair)),
            }
        }
    }
    let panel = |k: usize| -> Vec<KernelCurve> {
        let named = |(name, pair): &(String, [Option<KernelCurve>; 2])| {
            let name = name.clone();
            pair[k].clone().map(|curve| KernelCurve { name, ..curve })
        };
        drawn.iter().filter_map(named).collect()
    };
    let (relaxation, creep) = (panel(0), panel(1));
    let si = response.units == Units::Si;
    let unit = |name: &str, inverse: bool| match (mixed, si) {
        (true, _) if inverse => format!("{name} / J(∞)"),
        (true, _) => format!("{name} / R(∞)"),
        (_, true) => format!("{name} ({})", response.unit(3, 3, inverse)),
        (_, false) => name.to_owned(),
    };
    let units = if si {
        plot::AxisUnits::si(1.0)
    } else {
        plot::AxisUnits {
            length: "unit of length".into(),
            time: "unit of time".into(),
            energy: "unit of energy".into(),
            ..plot::AxisUnits::unnamed(1.0)
        }
    };
    KernelFigure {
        title: "Small motions of the end of the straight rod".into(),
        time: times.to_vec(),
        log: wide(&relaxation),
        relaxation,
        creep,
        relaxation_label: unit("relaxation R", false),
        creep_label: unit("creep J", true),
        units,
    }
}

/// True if two curves look the same.
fn same(a: Option<&KernelCurve>, b: Option<&KernelCurve>) -> bool {
    let (Some(a), Some(b)) = (a, b) else {
        return a.is_none() && b.is_none();
    };
    let size = a.values.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let mut pairs = a.values.iter().zip(&b.values);
    pairs.all(|(x, y)| (x - y).abs() <= SAME * size)
}

/// Removes rounding from a constant curve.
fn level(curve: &mut KernelCurve) {
    let Some(last) = curve.relaxed else { return };
    if (curve.values.iter()).all(|x| (x - last).abs() <= SAME * last.abs()) {
        curve.values.fill(last);
        curve.instantaneous = curve.instantaneous.map(|_| last);
    }
}

/// True if all values are positive and their ratio is large.
fn wide(curves: &[KernelCurve]) -> bool {
    let values = || {
        curves
            .iter()
            .flat_map(|c| c.values.iter().chain(&c.relaxed))
    };
    let least = values().copied().fold(f64::INFINITY, f64::min);
    let most = values().copied().fold(0.0, f64::max);
    least > 0.0 && most > WIDE * least
}
