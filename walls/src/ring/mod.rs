//! The cross-section of a tube under pressure: a closed elastica as an equilibrium manifold of dimension 1.
//!
//! The wall has no inertia. Pose is the area A, wrench the pressure, dU = -P dA. Along the branch of mode n the
//! section is round, has n lobes, touches itself at a point, and for n = 2 along a line (docs/tubes.md 1):
//! ```text
//! kappa'' = P - sigma kappa - kappa^3/2,   P = (p_e - p)/Kp,   Kp = D/R^3,
//! buckling at P = n^2 - 1,   P = 0.99060 alpha^(-3/2) in line contact,   alpha = A/(pi R^2).
//! ```
//! Lengths are in R, the radius of the round middle line; energies in D/R per axial length, 0 for the round ring at no
//! pressure. Numbers are exact to about 1e-14, slopes to 1e-11.
//!
//! ```
//! # use snaprod_walls as snaprod;
//! use snaprod::ring::{Contact, Ring};
//! let ring = Ring::new(2)?;
//! let section = ring.at_pressure(5.0)?;
//! assert!((section.area - 0.31700787634598865).abs() < 1e-13);
//! assert_eq!(ring.at_area(0.1)?.contact, Contact::Line);
//! # Ok::<(), snaprod_core::Error>(())
//! ```

mod lobe;
mod shape;
mod table;

pub use table::RingTable;

use lobe::{D, END, Lobe, M, Numbers, solve};
use nalgebra::{Matrix1, Matrix4, Vector1, Vector4};
use num_dual::Dual64;
use snaprod_core::manifold::{EquilibriumManifold, ManifoldPoint};
use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::{FRAC_PI_2, PI};

/// Greatest mode: of higher ones no lobe is resolved by the rule of integration.
const MOST_LOBES: u32 = 12;
/// Nodes of the rule of integration over half a lobe.
const NODES: usize = 64;
/// Relative error up to which a number counts as equal to the number of the last section.
const ROUNDING: f64 = 1e-12;
/// Amplitude d of the curvature below which slopes are continued from larger ones: the branch is even in d.
const NEARLY_ROUND: f64 = 1e-3;

/// Contact of the wall with itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// The section is open.
    None,
    /// Opposite walls press on each other at one point, or the walls of each lobe touch at one point.
    Point,
    /// Opposite walls lie flat on each other between the lobes.
    Line,
}

impl Contact {
    /// The word for the contact in scenes and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Point => "point",
            Self::Line => "line",
        }
    }
}

/// A section in equilibrium.
#[derive(Debug, Clone)]
pub struct Section {
    /// Pressure P outside less inside, in Kp.
    pub pressure: f64,
    /// Area alpha, in pi R^2.
    pub area: f64,
    /// Stored energy per axial length, in D/R; 0 for the round ring at no pressure.
    pub energy: f64,
    /// dP/dalpha; minus infinity for the round inextensible ring.
    pub slope: f64,
    /// Contact of the wall with itself.
    pub contact: Contact,
    /// Curvature at the tip of a lobe, in 1/R.
    pub curvature_tip: f64,
    /// Curvature between lobes, or at the end of the free wall in contact, in 1/R.
    pub curvature_trough: f64,
    /// Distance from the centre to the tip of a lobe.
    pub tip: f64,
    /// Distance from the centre to the wall between lobes; 0 in contact of mode 2.
    pub trough: f64,
    /// Force per axial length with which the walls press on each other at a point, in D/R^2; 0 in other states.
    pub contact_force: f64,
    /// Half of the length along which the walls lie on each other.
    pub contact_half_length: f64,
    mode: u32,
    wall: Wall,
}

/// The wall of a section, as input of the shape.
#[derive(Debug, Clone, Copy)]
enum Wall {
    Round { radius: f64 },
    Lobed { lobe: Lobe<f64>, scale: f64 },
}

impl Section {
    /// Number of lobes.
    pub fn mode(&self) -> u32 {
        self.mode
    }

    /// C^2 = -alpha dP/dalpha: the square of the speed of pulses in the tube, in Kp/rho.
    pub fn wave_speed_squared(&self) -> f64 {
        -self.area * self.slope
    }
}

/// Rates of pressure and area along the branch.
#[derive(Debug, Clone, Copy)]
struct Rates {
    pressure: f64,
    area: f64,
}

impl Rates {
    /// dP/dalpha.
    fn slope(self) -> f64 {
        self.pressure / self.area
    }
}

/// The branch of sections of one mode.
#[derive(Debug, Clone)]
pub struct Ring {
    mode: u32,
    compliance: f64,
    rule: Rule,
    /// Open sections at growing amplitude d, as first guesses.
    open: Vec<Numbers>,
    /// Sections that touch at a point, at growing angle phi.
    touching: Vec<Numbers>,
    buckling: Section,
    touch: Section,
    line: Option<Section>,
}

impl Ring {
    /// The inextensible ring of `mode` lobes.
    ///
    /// # Errors
    /// A mode outside 2 to 12.
    pub fn new(mode: u32) -> Result<Self> {
        Self::with_compliance(mode, 0.0)
    }

    /// The ring of `mode` lobes whose wall has the stiffness `stiffness` k against stretching along itself, in D/R^2:
    /// 12 (R/h)^2 for a wall of the thickness h.
    ///
    /// # Errors
    /// A mode outside 2 to 12; a stiffness too small for the ring to buckle into the mode.
    pub fn extensible(mode: u32, stiffness: f64) -> Result<Self> {
        if !(0.0 < stiffness && stiffness < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the stiffness k = {stiffness} of an extensible ring must be finite and > 0: 12 (R/h)^2 for a wall of \
                 the thickness h"
            )));
        }
        Self::with_compliance(mode, 1.0 / stiffness)
    }

    fn with_compliance(mode: u32, compliance: f64) -> Result<Self> {
        if !(2..=MOST_LOBES).contains(&mode) {
            return Err(Error::domain(format!(
                "mode = {mode} must be from 2 to {MOST_LOBES}: it is the number of lobes into which the tube buckles"
            )));
        }
        let mut ring = Self {
            mode,
            compliance,
            rule: Rule::new(NODES),
            open: Vec::new(),
            touching: Vec::new(),
            buckling: round(mode, compliance, 0.0),
            touch: round(mode, compliance, 0.0),
            line: None,
        };
        ring.follow_open()?;
        if mode == 2 {
            ring.follow_touching()?;
        }
        Ok(ring)
    }

    /// True if the wall stretches along itself.
    pub fn is_extensible(&self) -> bool {
        self.compliance > 0.0
    }

    /// The round section at the buckling pressure.
    pub fn buckling(&self) -> &Section {
        &self.buckling
    }

    /// The section at which the wall first touches itself.
    pub fn touch(&self) -> &Section {
        &self.touch
    }

    /// The section of mode 2 at which the point of contact becomes a line; `None` for other modes.
    pub fn line(&self) -> Option<&Section> {
        self.line.as_ref()
    }

    /// The last section that is computed: `None` for the inextensible ring of mode 2, which has no last one. Other
    /// modes end where the walls of a lobe touch, the extensible ring where the contact becomes a line.
    pub fn last(&self) -> Option<&Section> {
        match &self.line {
            Some(_) if self.compliance == 0.0 => None,
            Some(line) => Some(line),
            None => Some(&self.touch),
        }
    }

    /// The section under the pressure P, outside less inside.
    ///
    /// # Errors
    /// A pressure that no section has, with the largest; NaN; an infinite pressure.
    pub fn at_pressure(&self, pressure: f64) -> Result<Section> {
        if !pressure.is_finite() {
            return Err(Error::domain(format!(
                "the pressure P = {pressure} must be finite"
            )));
        }
        if pressure <= self.buckling.pressure {
            return self.round_at_pressure(pressure);
        }
        if let Some(last) = self.last().filter(|last| pressure >= last.pressure) {
            if pressure <= last.pressure * (1.0 + ROUNDING) {
                return Ok(last.clone());
            }
            return Err(Error::domain(format!(
                "the pressure P = {pressure} is above {}, the largest of this ring: {}",
                last.pressure,
                self.end_of_branch()
            )));
        }
        self.on_branch(pressure, |section| section.pressure)
    }

    /// The section of the area `area` alpha. The round inextensible ring, alpha = 1, has every pressure up to
    /// buckling; the result is that at buckling.
    ///
    /// # Errors
    /// An area that no section has, with the allowed ones; NaN.
    pub fn at_area(&self, area: f64) -> Result<Section> {
        if !(0.0 < area && area < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the area alpha = {area} must be finite and > 0"
            )));
        }
        if area == self.buckling.area {
            return Ok(self.buckling.clone());
        }
        if area > self.buckling.area {
            if self.compliance == 0.0 {
                return Err(Error::domain(format!(
                    "the area alpha = {area} must be at most 1, that of the round ring, which does not stretch; \
                     an extensible ring or another wall law has larger ones"
                )));
            }
            let radius = area.sqrt();
            return self.round_at_pressure((1.0 - radius) / (radius * self.compliance));
        }
        if let Some(last) = self.last().filter(|last| area <= last.area) {
            if area >= last.area * (1.0 - ROUNDING) {
                return Ok(last.clone());
            }
            return Err(Error::domain(format!(
                "the area alpha = {area} is below {}, the least of this ring: {}",
                last.area,
                self.end_of_branch()
            )));
        }
        self.on_branch(area, |section| section.area)
    }

    /// Reason for the end of the branch; None for a branch without a last section.
    pub fn end_of_branch(&self) -> &'static str {
        if self.mode == 2 {
            "the extensible ring is followed up to contact along a line; law = \"ring\" goes on"
        } else {
            "there the walls of each lobe touch, and what follows is not computed; mode = 2 goes on"
        }
    }

    /// The round section under `pressure`.
    fn round_at_pressure(&self, pressure: f64) -> Result<Section> {
        if !(1.0 + pressure * self.compliance > 0.0) {
            return Err(Error::domain(format!(
                "the pressure P = {pressure} must be above {}: the round ring bursts there",
                -1.0 / self.compliance
            )));
        }
        Ok(round(self.mode, self.compliance, pressure))
    }

    /// The section past buckling whose `number`, monotone along the branch, is `value`.
    fn on_branch(&self, value: f64, number: fn(&Section) -> f64) -> Result<Section> {
        let failed = || Error::no_convergence(format!("no section was found at {value}"));
        let grows = number(&self.touch) > number(&self.buckling);
        let past = |section: &Section| (value >= number(section)) == grows;
        let over = |section: Option<Section>| section.map_or(f64::NAN, |at| number(&at) - value);
        if !past(&self.touch) {
            // In the square of d both numbers are smooth at buckling.
            let greatest = self.open[self.open.len() - 1][D].powi(2);
            let without_slope = |numbers| self.section(&numbers, Contact::None);
            let off = |square: f64| over(self.open_numbers(square.sqrt()).map(without_slope));
            let from = (0.0, number(&self.buckling) - value);
            let to = (greatest, number(&self.touch) - value);
            let square = chandrupatla(off, from, to, 0.0).ok_or_else(failed)?;
            return self.open_section(square.sqrt()).ok_or_else(failed);
        }
        let line = self.line.as_ref().ok_or_else(failed)?;
        if !past(line) {
            let greatest = self.touching[self.touching.len() - 1][END];
            let off = |end: f64| over(self.touching_section(end).map(|(section, _)| section));
            let from = (PI, number(&self.touch) - value);
            let to = (greatest, number(line) - value);
            let end = chandrupatla(off, from, to, 0.0).ok_or_else(failed)?;
            return self
                .touching_section(end)
                .map(|(section, _)| section)
                .ok_or_else(failed);
        }
        let scale = if grows {
            (line.pressure / value).cbrt()
        } else {
            (value / line.area).sqrt()
        };
        Ok(self.flat_section(line, scale))
    }

    /// Half a lobe of the given length and turn that fulfils two conditions more, with the Jacobian there.
    fn half_lobe(
        &self,
        more: &dyn Fn(&Lobe<Dual64>) -> [Dual64; 2],
        guess: &Numbers,
    ) -> Option<(Numbers, Matrix4<f64>)> {
        let share = PI / f64::from(self.mode);
        let conditions = |lobe: &Lobe<Dual64>| {
            let sums = lobe.integrals(&self.rule);
            let [third, fourth] = more(lobe);
            [sums.length - share, sums.turn - share, third, fourth]
        };
        solve(&conditions, guess, self.compliance)
    }

    /// The open section of the amplitude `d`, by its neighbour among the known ones.
    fn open_numbers(&self, d: f64) -> Option<Numbers> {
        let mut guess = *nearest(&self.open, &|numbers| (numbers[D] - d).abs())?;
        guess[D] = d;
        let pinned = |lobe: &Lobe<Dual64>| [lobe.end - PI, lobe.d - d];
        self.half_lobe(&pinned, &guess).map(|(numbers, _)| numbers)
    }

    fn open_section(&self, d: f64) -> Option<Section> {
        let numbers = self.open_numbers(d)?;
        let mut section = self.section(&numbers, Contact::None);
        let slope = |d: f64| self.open_rates(d).map(|rates| rates.slope());
        section.slope = if d < NEARLY_ROUND {
            // Linear in d^2.
            let (near, far) = (slope(NEARLY_ROUND)?, slope(2.0 * NEARLY_ROUND)?);
            near + (far - near) * ((d / NEARLY_ROUND).powi(2) - 1.0) / 3.0
        } else {
            slope(d)?
        };
        Some(section)
    }

    /// Rates of an open section by its amplitude `d`.
    fn open_rates(&self, d: f64) -> Option<Rates> {
        let pinned = |lobe: &Lobe<Dual64>| [lobe.end - PI, lobe.d - d];
        let (numbers, jacobian) = self.half_lobe(&pinned, &self.open_numbers(d)?)?;
        self.rates(&numbers, &jacobian)
    }

    /// The section in contact at a point whose free wall ends at the angle `end`, and its rates by this angle.
    fn touching_section(&self, end: f64) -> Option<(Section, Rates)> {
        let distance = |numbers: &Numbers| (numbers[END] - end).abs();
        let mut guess = *nearest(&self.touching, &distance)?;
        guess[END] = end;
        let pinned = |lobe: &Lobe<Dual64>| [no_pull_at_end(lobe), lobe.end - end];
        let (numbers, jacobian) = self.half_lobe(&pinned, &guess)?;
        let mut section = self.section(&numbers, Contact::Point);
        let rates = self.rates(&numbers, &jacobian)?;
        section.slope = rates.slope();
        Some((section, rates))
    }

    /// The section past buckling at the point `q` of the chart, and dalpha/dq there; `None` outside of the chart.
    fn at_chart(&self, q: f64) -> Option<(Section, f64)> {
        let touch = self.open[self.open.len() - 1][D];
        if !(q >= 0.0) {
            return None;
        }
        if q <= touch {
            return Some((self.open_section(q)?, self.open_rates(q)?.area));
        }
        let line = self.line.as_ref()?;
        let end = PI + (q - touch);
        let greatest = self.touching[self.touching.len() - 1][END];
        if end <= greatest {
            return (self.touching_section(end)).map(|(section, rates)| (section, rates.area));
        }
        let scale = 1.0 - (end - greatest);
        let exists = self.compliance == 0.0 && scale > 0.0;
        exists.then(|| (self.flat_section(line, scale), -2.0 * line.area * scale))
    }

    /// The section in contact along a line; the lobes of the section `line` shrink by `scale`.
    fn flat_section(&self, line: &Section, scale: f64) -> Section {
        let flat = FRAC_PI_2 * (1.0 - scale);
        let area = line.area * scale * scale;
        let pressure = line.pressure / scale.powi(3);
        let wall = match line.wall {
            Wall::Lobed { lobe, .. } => Wall::Lobed { lobe, scale },
            round @ Wall::Round { .. } => round,
        };
        Section {
            pressure,
            area,
            energy: (line.energy + PI) / scale - PI,
            slope: -1.5 * pressure / area,
            contact: Contact::Line,
            curvature_tip: line.curvature_tip / scale,
            curvature_trough: 0.0,
            tip: line.tip * scale + flat,
            trough: 0.0,
            contact_force: 0.0,
            contact_half_length: flat,
            mode: self.mode,
            wall,
        }
    }

    /// A section with the numbers of its lobe, without slope.
    fn section(&self, numbers: &Numbers, contact: Contact) -> Section {
        let lobe = Lobe::new(numbers, self.compliance);
        let sums = lobe.integrals(&self.rule);
        let pressure = lobe.pressure();
        let lobes = f64::from(self.mode);
        let (tip, end) = (lobe.place(0.0), lobe.place(lobe.end));
        // The centre of the forces lies on the axis of the lobe, off the middle by shear over P.
        let shear = -lobe.d * lobe.end.sin() * end.speed;
        let touches = contact == Contact::Point && self.mode == 2;
        Section {
            pressure,
            area: lobes * sums.pull / (PI * pressure),
            energy: 2.0 * lobes * sums.energy - PI,
            slope: f64::NAN,
            contact,
            curvature_tip: tip.curvature,
            curvature_trough: end.curvature,
            tip: (shear - tip.pull) / pressure,
            trough: if touches { 0.0 } else { -end.pull / pressure },
            contact_force: if touches { 2.0 * shear } else { 0.0 },
            contact_half_length: 0.0,
            mode: self.mode,
            wall: Wall::Lobed { lobe, scale: 1.0 },
        }
    }

    /// Rates of pressure and area by the number that the last condition pins.
    fn rates(&self, numbers: &Numbers, jacobian: &Matrix4<f64>) -> Option<Rates> {
        let tangent = jacobian.lu().solve(&Vector4::w())?;
        let lobe = Lobe::along(numbers, &tangent, self.compliance);
        let pressure = lobe.pressure();
        let area = lobe.integrals(&self.rule).pull / pressure * (f64::from(self.mode) / PI);
        Some(Rates {
            pressure: pressure.eps,
            area: area.eps,
        })
    }

    /// Finds open sections from the round one to the first contact.
    fn follow_open(&mut self) -> Result<()> {
        let lobes = f64::from(self.mode);
        let failed = |what: &str| {
            Error::no_convergence(format!(
                "the ring of mode {} was not followed {what}; its wall may be too soft along itself",
                lobes
            ))
        };
        self.open
            .push(Numbers::new(1.0, 0.0, lobes * lobes - 1.5, PI));
        let round = self
            .open_numbers(0.0)
            .ok_or_else(|| failed("to buckling"))?;
        self.open[0] = round;
        self.buckling = self.section(&round, Contact::None);
        self.buckling.slope = self
            .open_section(0.0)
            .ok_or_else(|| failed("past buckling"))?
            .slope;
        let step = 0.1 * lobes;
        for k in 1..100 {
            let d = step * f64::from(k);
            let numbers = self
                .open_numbers(d)
                .ok_or_else(|| failed("to its contact"))?;
            let gap = self.clearance(&numbers);
            if gap > 0.0 {
                self.open.push(numbers);
                continue;
            }
            let before = self.open[self.open.len() - 1];
            let off = |d: f64| {
                self.open_numbers(d)
                    .map_or(f64::NAN, |numbers| self.clearance(&numbers))
            };
            let d = chandrupatla(off, (before[D], self.clearance(&before)), (d, gap), 0.0);
            let numbers = d
                .and_then(|d| self.open_numbers(d))
                .ok_or_else(|| failed("to its contact"))?;
            let open = self
                .open_section(numbers[D])
                .ok_or_else(|| failed("to its contact"))?;
            self.touch = Section {
                contact: Contact::Point,
                ..open
            };
            if self.mode == 2 {
                self.touch.trough = 0.0;
            }
            self.open.push(numbers);
            return Ok(());
        }
        Err(failed("to its contact"))
    }

    /// Finds the sections in contact at a point, up to contact along a line.
    fn follow_touching(&mut self) -> Result<()> {
        let failed =
            || Error::no_convergence("the ring in contact was not followed to line contact");
        self.touching.push(self.open[self.open.len() - 1]);
        for k in 1..=100 {
            let mut guess = self.touching[self.touching.len() - 1];
            let end = PI + 0.1 * f64::from(k);
            guess[END] = end;
            let pinned = |lobe: &Lobe<Dual64>| [no_pull_at_end(lobe), lobe.end - end];
            let found = self.half_lobe(&pinned, &guess).map(|(numbers, _)| numbers);
            let numbers = found.ok_or_else(failed)?;
            if numbers[M] + numbers[D] * numbers[END].cos() < 0.0 {
                self.touching.push(numbers);
                continue;
            }
            // No pull and no curvature at the end: sigma = 0.
            let flat = |lobe: &Lobe<Dual64>| [lobe.sigma, lobe.place(lobe.end).curvature];
            let (numbers, _) = self.half_lobe(&flat, &numbers).ok_or_else(failed)?;
            self.touching.push(numbers);
            let (mut line, _) = self.touching_section(numbers[END]).ok_or_else(failed)?;
            line.contact = Contact::Line;
            self.line = Some(line);
            return Ok(());
        }
        Err(failed())
    }

    /// Distance of the wall from the axis of its lobe where the wall runs along the axis, at the neck of the lobe;
    /// for two lobes that of the trough from the centre. Without a neck 1.
    fn clearance(&self, numbers: &Numbers) -> f64 {
        let lobe = Lobe::new(numbers, self.compliance);
        let place = if self.mode == 2 {
            lobe.place(PI)
        } else {
            let turned = |end: f64| Lobe { end, ..lobe }.integrals(&self.rule).turn - FRAC_PI_2;
            if !(lobe.m < lobe.d) {
                return 1.0;
            }
            let widest = (-lobe.m / lobe.d).acos();
            let Some(neck) = chandrupatla(turned, (widest, turned(widest)), (PI, turned(PI)), 0.0)
            else {
                return 1.0;
            };
            lobe.place(neck)
        };
        -place.pull / lobe.pressure()
    }
}

/// The numbers at the least distance.
fn nearest<'a>(known: &'a [Numbers], distance: &dyn Fn(&Numbers) -> f64) -> Option<&'a Numbers> {
    known
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// 2 sigma + kappa^2 at the end of the lobe: zero where the wall bears no pull, as at a point of contact.
fn no_pull_at_end(lobe: &Lobe<Dual64>) -> Dual64 {
    let curvature = lobe.place(lobe.end).curvature;
    lobe.sigma * 2.0 + curvature * curvature
}

/// The round section under `pressure`, P = (1 - rho)/(c rho) for the radius rho.
fn round(mode: u32, compliance: f64, pressure: f64) -> Section {
    let radius = 1.0 / (1.0 + pressure * compliance);
    let slope = if compliance == 0.0 {
        f64::NEG_INFINITY
    } else {
        -1.0 / (2.0 * compliance * radius.powi(3))
    };
    Section {
        pressure,
        area: radius * radius,
        // k (rho - 1)^2 / 2 around, with 1 - rho = c P rho.
        energy: PI * compliance * (pressure * radius).powi(2),
        slope,
        contact: Contact::None,
        curvature_tip: 1.0 / radius,
        curvature_trough: 1.0 / radius,
        tip: radius,
        trough: radius,
        contact_force: 0.0,
        contact_half_length: 0.0,
        mode,
        wall: Wall::Round { radius },
    }
}

/// Chart of the sections past buckling: the amplitude d up to the first contact, then d + phi - pi, then one more by
/// 1 - scale. Pose is the area A in R^2, force the pressure. The inextensible ring of mode 2 alone has all of it.
impl EquilibriumManifold<1> for Ring {
    fn point(&self, q: &Vector1<f64>) -> Option<ManifoldPoint<1>> {
        let (section, area_slope) = self.at_chart(q[0])?;
        Some(ManifoldPoint {
            pose: Vector1::new(PI * section.area),
            force: Vector1::new(section.pressure),
            energy: section.energy,
            jacobian: Matrix1::new(PI * area_slope),
            pace: 1.0,
        })
    }

    fn index(&self, q: &Vector1<f64>) -> Result<usize> {
        let outside = || Error::domain(format!("q = {} lies outside the chart", q[0]));
        // With the area held the branch of least energy at its area is stable.
        self.at_chart(q[0]).map(|_| 0).ok_or_else(outside)
    }
}
