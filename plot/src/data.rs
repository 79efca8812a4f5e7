//! Input data of the figures: plain numbers.

use super::canvas::Pen;
use super::legend::{Key, Mark, PlottedCurve, mark};
use super::palette::category;
use snaprod_core::error::{Error, Result};

/// Units written on the axes, empty for none, and the rod's length.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisUnits {
    /// The unit of length.
    pub length: String,
    /// The unit of time.
    pub time: String,
    /// The unit of energy.
    pub energy: String,
    /// The unit of force.
    pub force: String,
    /// The unit of couple.
    pub couple: String,
    /// The rod's length in the unit of length: the radius of the disc of its free end.
    pub rod: f64,
}

impl Default for AxisUnits {
    /// Length ℓ, time √(μℓ³/EI), energy and couple EI/ℓ, force EI/ℓ².
    fn default() -> Self {
        Self::new(["ℓ", "√(μℓ³/EI)", "EI/ℓ", "EI/ℓ²", "EI/ℓ"], 1.0)
    }
}

impl AxisUnits {
    fn new(names: [&str; 5], rod: f64) -> Self {
        let [length, time, energy, force, couple] = names.map(String::from);
        Self {
            length,
            time,
            energy,
            force,
            couple,
            rod,
        }
    }

    /// Metres, seconds, joules, newtons, newton metres, for a rod of the given length in metres.
    pub fn si(rod: f64) -> Self {
        Self::new(["m", "s", "J", "N", "N m"], rod)
    }

    /// Numbers without units, for a rod of the given length.
    pub fn unnamed(rod: f64) -> Self {
        Self::new([""; 5], rod)
    }

    /// "name (unit of length)", or the name alone.
    pub(crate) fn length_of(&self, name: &str) -> String {
        with_unit(name, &self.length)
    }

    pub(crate) fn time_of(&self, name: &str) -> String {
        with_unit(name, &self.time)
    }

    pub(crate) fn energy_of(&self, name: &str) -> String {
        with_unit(name, &self.energy)
    }

    /// The unit of power per length.
    pub(crate) fn power_density(&self) -> String {
        self.derived(
            "√((EI)³/μℓ⁷)",
            "W/m",
            format!("{}/({}·{})", self.energy, self.length, self.time),
        )
    }

    /// The unit of (time / viscosity).
    pub(crate) fn stretched_time(&self) -> String {
        self.derived(
            "1/EI",
            "1/(N m²)",
            format!("1/({}·{})", self.energy, self.length),
        )
    }

    /// The unit of viscosity: energy x length x time.
    pub(crate) fn viscosity(&self) -> String {
        self.derived(
            "√(μEI ℓ³)",
            "N m² s",
            format!("{}·{}·{}", self.energy, self.length, self.time),
        )
    }

    /// A unit derived from the others, in a short form if there is one.
    fn derived(&self, scaled: &str, si: &str, other: String) -> String {
        let own = [&self.length, &self.time, &self.energy];
        let same = |u: &Self| own == [&u.length, &u.time, &u.energy];
        match () {
            () if same(&Self::unnamed(1.0)) => String::new(),
            () if same(&Self::default()) => scaled.into(),
            () if same(&Self::si(1.0)) => si.into(),
            () => other,
        }
    }

    /// "curvature (1 / unit of length)".
    pub(crate) fn curvature(&self) -> String {
        match self.length.as_str() {
            "" => "curvature".to_owned(),
            length => format!("curvature (1/{length})"),
        }
    }

    /// The rod's length; 1 if it is not positive and finite.
    pub(crate) fn radius(&self) -> f64 {
        if self.rod > 0.0 && self.rod < 1e100 {
            self.rod
        } else {
            1.0
        }
    }
}

/// "name (unit)", or the name alone.
pub(crate) fn with_unit(name: &str, unit: &str) -> String {
    match unit {
        "" => name.to_owned(),
        _ => format!("{name} ({unit})"),
    }
}

/// A curve in the plane; a point that is not finite breaks it. About 500 points are smooth; more are thinned
/// to a tenth of a pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates, as many.
    pub y: Vec<f64>,
}

impl Curve {
    /// A curve through points.
    pub fn new(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let (x, y) = points.into_iter().map(|[x, y]| (x, y)).unzip();
        Self { x, y }
    }

    /// The finite points of the curve.
    pub(crate) fn points(&self) -> impl DoubleEndedIterator<Item = (f64, f64)> {
        let count = self.x.len().min(self.y.len());
        let points = (0..count).map(|i| (self.x[i], self.y[i]));
        points.filter(|p| p.0.is_finite() && p.1.is_finite())
    }

    pub(crate) fn has_points(&self) -> bool {
        self.points().next().is_some()
    }
}

/// Line style of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineStyle {
    /// A line.
    #[default]
    Line,
    /// A dashed line.
    Dashed,
    /// A line with marks.
    LineMarks,
    /// A dashed line with marks.
    DashedMarks,
    /// Small dots, for thousands of points.
    Dots,
}

/// One named curve; points that are not finite break the curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates, as many.
    pub y: Vec<f64>,
    /// Line style.
    pub trace: LineStyle,
    /// Index of the palette's colour (and mark); by default the index in the list.
    pub colour: Option<usize>,
}

impl Series {
    /// The drawn form of the i-th series of a list.
    pub(crate) fn drawn(&self, i: usize, width: f64) -> PlottedCurve {
        let look = self.colour.unwrap_or(i);
        let pen = Pen::new(category(look), width);
        let key = match self.trace {
            LineStyle::Line => Key::Line(pen),
            LineStyle::Dashed => Key::Line(pen.dashed(6.0, 4.0)),
            LineStyle::Dots => Key::Mark(Mark::Dot, pen.colour),
            LineStyle::LineMarks => Key::LineMark(pen, mark(look)),
            LineStyle::DashedMarks => Key::LineMark(pen.dashed(6.0, 4.0), mark(look)),
        };
        PlottedCurve::new(key, &self.name, &self.x, &self.y)
    }
}

/// A function sampled on a rectangular grid of equal steps; NaN where it has no value.
///
/// 241 x 241 points over the disc are enough: level lines are interpolated, but edges of the function's
/// domain follow the grid, and show its steps if it is coarser.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Field {
    /// The x range, first and last grid point.
    pub x: [f64; 2],
    /// The y range, first and last grid point.
    pub y: [f64; 2],
    /// Number of points along x.
    pub columns: usize,
    /// Number of points along y.
    pub rows: usize,
    /// Row by row from the lowest y: the value at column i of row j is `values[j * columns + i]`.
    pub values: Vec<f64>,
}

impl Field {
    /// Samples `f(x, y)` on n x n points of the square [-radius, radius]^2.
    pub fn over_disc(n: usize, radius: f64, mut f: impl FnMut(f64, f64) -> f64) -> Self {
        let n = n.max(2);
        let at = |i: usize| radius * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
        let values = (0..n * n).map(|m| f(at(m % n), at(m / n))).collect();
        Self {
            x: [-radius, radius],
            y: [-radius, radius],
            columns: n,
            rows: n,
            values,
        }
    }

    /// True if the numbers make a grid.
    pub(crate) fn is_sound(&self) -> bool {
        let rises = |r: [f64; 2]| r[1] > r[0] && (r[1] - r[0]).is_finite();
        self.columns > 1
            && self.rows > 1
            && self.columns.checked_mul(self.rows) == Some(self.values.len())
            && rises(self.x)
            && rises(self.y)
    }

    pub(crate) fn point(&self, i: f64, j: f64) -> (f64, f64) {
        let along = |r: [f64; 2], t: f64| r[0] + (r[1] - r[0]) * t;
        (
            along(self.x, i / (self.columns - 1) as f64),
            along(self.y, j / (self.rows - 1) as f64),
        )
    }
}

/// A piece of a surface: a grid of points in space.
///
/// **Resolution.** 48 x 32 points for each of four sheets give a figure of 0.5 to 0.8 MB; more make the file larger
/// and nothing clearer. Spend the points where the outline bends: a rim is drawn through them. Grade the parameters
/// so that the quadrilaterals are of about equal size in the figure (a sheet of the elastica is stretched towards kap
/// = +-1 and lam = 0). A point that is not finite is a hole. The surface is cut exactly at the figure's box, so
/// sample past it rather than up to it.
///
/// **Orientation.** The front is where the first parameter, the second and the eye are right-handed; the back is
/// drawn paler. Give all patches their parameters in the same order and sense.
///
/// **Order.** Of two patches closer than 0.6 % of the box, the first in the list is visible.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patch {
    /// Name in the legend; patches of the same name share one entry.
    pub name: String,
    /// Index of the palette's colour.
    pub colour: usize,
    /// Number of points along the first parameter.
    pub rows: usize,
    /// Number of points along the second parameter.
    pub columns: usize,
    /// The points, row by row: point (i, j) is `points[i * columns + j]`.
    pub points: Vec<[f64; 3]>,
    /// For each point true if its equilibrium is unstable; a face with such a corner is nearly grey. Empty: unknown.
    pub unstable: Vec<bool>,
}

impl Patch {
    /// Samples `f(i, j)` for i < rows, j < columns.
    pub fn sample(
        name: &str,
        colour: usize,
        rows: usize,
        columns: usize,
        mut f: impl FnMut(usize, usize) -> [f64; 3],
    ) -> Self {
        let points = (0..rows * columns)
            .map(|m| f(m / columns, m % columns))
            .collect();
        Self {
            name: name.into(),
            colour,
            rows,
            columns,
            points,
            unstable: Vec::new(),
        }
    }

    pub(crate) fn is_sound(&self) -> bool {
        self.rows > 1
            && self.columns > 1
            && self.rows.checked_mul(self.columns) == Some(self.points.len())
    }

    /// Indices of the corners of a face with its first corner in this row and column.
    fn corners(&self, row: usize, column: usize) -> [usize; 4] {
        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| (row + i) * self.columns + column + j)
    }

    /// True if a corner of the face is unstable.
    pub(crate) fn is_greyed(&self, row: usize, column: usize) -> bool {
        let mut corners = self.corners(row, column).into_iter();
        corners.any(|at| self.unstable.get(at) == Some(&true))
    }

    /// True if some face has the colour of stable (or else of unstable) equilibria.
    pub(crate) fn shows(&self, stable: bool) -> bool {
        let faces = |row| (0..self.columns - 1).map(move |column| (row, column));
        let drawn = |(row, column)| {
            let mut corners = self.corners(row, column).into_iter();
            corners.all(|at| self.points[at].iter().all(|c| c.is_finite()))
        };
        self.is_sound()
            && (0..self.rows - 1)
                .flat_map(faces)
                .any(|face| drawn(face) && self.is_greyed(face.0, face.1) != stable)
    }
}

/// Viewpoint of a surface, in degrees; parallel projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Direction of the eye in the horizontal plane, from the first axis towards the second.
    pub azimuth: f64,
    /// Height of the eye above the horizontal plane.
    pub elevation: f64,
}

/// A box [[x0, x1], [y0, y1], [z0, z1]].
pub type Bounds = [[f64; 2]; 3];

/// Fails unless a list has as many entries as there are `of` something.
pub(crate) fn as_many(
    figure: &str,
    field: &str,
    entries: usize,
    wanted: usize,
    of: &str,
) -> Result<()> {
    if entries == wanted {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{figure}: {field} has {entries} entries for {wanted} {of}; it needs as many"
    )))
}

/// The ends of a list that must be finite, must not fall and must have a span.
pub(crate) fn rising(figure: &str, field: &str, values: &[f64]) -> Result<(f64, f64)> {
    let fault = |what: String| Error::domain(format!("{figure}: {field} {what}"));
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else {
        return Err(fault("is empty; it needs two values at least".into()));
    };
    if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
        return Err(fault(format!(
            "has an entry {bad}; it needs finite numbers"
        )));
    }
    if let Some(pair) = values.windows(2).find(|p| p[1] < p[0]) {
        return Err(fault(format!(
            "falls from {} to {}; it must rise",
            pair[0], pair[1]
        )));
    }
    if !(last > first && (last - first).is_finite()) {
        return Err(fault(format!("spans nothing from {first} to {last}")));
    }
    Ok((first, last))
}
