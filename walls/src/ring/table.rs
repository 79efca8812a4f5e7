//! The tube law of a ring as a table of Chebyshev series, for flows that ask for it a million times a second.

use super::{Contact, ROUNDING, Ring};
use crate::chebyshev::Pieces;
use snaprod_core::{Error, Result};

/// Error allowed in a table, relative to the largest pressure of the open branch.
const ERROR: f64 = 1e-13;

/// P and dP/dalpha over the area, and the area over P, exact to 1e-12. The law of contact along a line is a
/// closed form.
#[derive(Debug, Clone)]
pub struct RingTable {
    open: Stage,
    /// The contact at a point; `None` for modes whose branch ends there.
    point: Option<Stage>,
    /// P alpha^(3/2) in contact along a line; NaN where there is none.
    line_law: f64,
    /// Energies over pi at touch and at contact along a line.
    energies: [f64; 2],
}

/// One smooth part of the branch.
#[derive(Debug, Clone)]
struct Stage {
    areas: [f64; 2],
    pressures: [f64; 2],
    pressure: Pieces,
    area: Pieces,
}

impl Stage {
    fn new(ring: &Ring, areas: [f64; 2], pressures: [f64; 2]) -> Result<Self> {
        let [wide, narrow] = areas;
        let [low, high] = pressures;
        let mut pressure_of = |area: f64| Ok(ring.at_area(area)?.pressure);
        let mut area_of = |pressure: f64| Ok(ring.at_pressure(pressure)?.area);
        Ok(Self {
            areas,
            pressures,
            pressure: Pieces::new((narrow, wide), ERROR * high, &mut pressure_of)?,
            area: Pieces::new((low, high), ERROR * wide, &mut area_of)?,
        })
    }
}

impl RingTable {
    /// Tabulates the branch of an inextensible ring.
    ///
    /// # Errors
    /// An extensible ring, whose round branch the table does not have.
    pub fn new(ring: &Ring) -> Result<Self> {
        if ring.compliance > 0.0 {
            return Err(Error::domain(
                "tables are of the inextensible ring; ask the extensible ring itself",
            ));
        }
        let (buckling, touch) = (ring.buckling(), ring.touch());
        let areas = [buckling.area, touch.area];
        let open = Stage::new(ring, areas, [buckling.pressure, touch.pressure])?;
        let point = match ring.line() {
            Some(line) => {
                let pressures = [touch.pressure, line.pressure];
                Some(Stage::new(ring, [touch.area, line.area], pressures)?)
            }
            None => None,
        };
        let line_law = ring
            .line()
            .map_or(f64::NAN, |line| line.pressure * line.area.powf(1.5));
        let all = |stage: &Stage| stage.pressure.jet(stage.areas[0])[0];
        let touching = all(&open);
        let flat = touching + point.as_ref().map_or(0.0, all);
        Ok(Self {
            open,
            point,
            line_law,
            energies: [touching, flat],
        })
    }

    /// P and dP/dalpha at the area `area` of a buckled section; NaN outside of the branch.
    #[inline]
    pub fn pressure(&self, area: f64) -> (f64, f64) {
        if !(0.0 < area && area <= self.open.areas[0]) {
            return (f64::NAN, f64::NAN);
        }
        if area >= self.open.areas[1] {
            return self.open.pressure.at(area);
        }
        match &self.point {
            Some(point) if area >= point.areas[1] => point.pressure.at(area),
            _ => {
                let pressure = self.line_law / (area * area.sqrt());
                (pressure, -1.5 * pressure / area)
            }
        }
    }

    /// \[energy, P, dP/dalpha, d2P/dalpha2\] at the area `area` of a buckled section; NaN outside of the branch. The
    /// energy is over pi: its derivative by alpha is -P, and it vanishes for the round ring.
    pub fn jet(&self, area: f64) -> [f64; 4] {
        if !(0.0 < area && area <= self.open.areas[0]) {
            return [f64::NAN; 4];
        }
        let of = |stage: &Stage, energy: f64| {
            let [integral, pressure, slope, bend] = stage.pressure.jet(area);
            [energy - integral, pressure, slope, bend]
        };
        if area >= self.open.areas[1] {
            return of(&self.open, self.energies[0]);
        }
        match &self.point {
            Some(point) if area >= point.areas[1] => of(point, self.energies[1]),
            _ => {
                let narrow = self.point.as_ref().map_or(f64::NAN, |point| point.areas[1]);
                let root = area.sqrt();
                let pressure = self.line_law / (area * root);
                [
                    self.energies[1] + 2.0 * self.line_law * (1.0 / root - 1.0 / narrow.sqrt()),
                    pressure,
                    -1.5 * pressure / area,
                    3.75 * pressure / (area * area),
                ]
            }
        }
    }

    /// Areas at which the branch begins, touches at a point, and touches along a line; those of modes that end at
    /// the touch are the first two.
    pub fn junctions(&self) -> Vec<f64> {
        let line = self.point.as_ref().map(|point| point.areas[1]);
        self.open.areas.into_iter().chain(line).collect()
    }

    /// The area of the buckled section under P; NaN below buckling and past the end of the branch.
    #[inline]
    pub fn area(&self, pressure: f64) -> f64 {
        if !(self.open.pressures[0]..f64::INFINITY).contains(&pressure) {
            return f64::NAN;
        }
        let [_, touch] = self.open.pressures;
        if pressure <= touch || self.point.is_none() && pressure <= touch * (1.0 + ROUNDING) {
            return self.open.area.at(pressure).0;
        }
        match &self.point {
            Some(point) if pressure <= point.pressures[1] => point.area.at(pressure).0,
            _ => (self.line_law / pressure).cbrt().powi(2),
        }
    }

    /// Contact of the section of the area `area`.
    pub fn contact(&self, area: f64) -> Contact {
        if area > self.open.areas[1] {
            return Contact::None;
        }
        match &self.point {
            Some(point) if area <= point.areas[1] => Contact::Line,
            _ => Contact::Point,
        }
    }
}
