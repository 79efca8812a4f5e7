//! Linear memory of a straight viscoelastic rod: wrench on the end for small motions, in the components of the end
//! joint.

mod table;

pub use table::{KernelEntry, POINTS, entries, table, times};

use crate::error::{Error, Result};
use crate::scene::{FrictionLaw, Scene, SceneKind, Units};
use crate::section::rate::Viscoelastic;
use crate::viscoelastic::kernel::MemoryKernel;
use nalgebra::Matrix6;
use serde_json::{Value, json};

/// Joint between rod end and body, with the dimension of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndJoint {
    /// A point mass on an end free to turn, in the plane of the elastica.
    Planar,
    /// A point mass on an end free to turn, in space.
    Ball,
    /// A rigid body welded to the end.
    Welded,
}

impl EndJoint {
    /// "planar", "ball" or "weld".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Planar => "planar",
            Self::Ball => "ball",
            Self::Welded => "weld",
        }
    }
}

/// A term weight exp(-rate t) of the relaxation function R.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxationTerm {
    /// Relaxation rate, per time.
    pub rate: f64,
    /// Weight, a wrench per displacement.
    pub weight: Matrix6<f64>,
    /// Largest ratio of a diagonal entry of the weight to that of R(0).
    pub share: f64,
}

/// Relative size of rounding.
pub const ROUNDING: f64 = 1e-12;
/// Relative drop of R, up to which relaxation has not begun.
const EARLY: f64 = 0.01;
/// Relative distance of R and J from the limits at which relaxation has ended.
const LATE: f64 = 1e-3;
/// Largest exponent of the decades of time.
const FARTHEST: i32 = 300;

/// Linear response of the end of the scene's rod, in the components loaded by the body.
///
/// # Errors
/// A scene without internal friction; a section without a memory kernel.
pub fn memory(scene: &Scene) -> Result<MemoryRecord> {
    scene.refuse_functions("memory")?;
    match scene.kind {
        SceneKind::Rod => {}
        SceneKind::Bar(_) | SceneKind::Flow(_) | SceneKind::Inflation(_) | SceneKind::Wall(_) => {
            scene.body().map(drop)?
        }
        SceneKind::Assembly(_) => {
            return Err(Error::domain(
                "the memory told here is that of one rod and its end: write it as [rod] with [clamp], [body], [start] and [run] in place of [[rod]] and [[body]]",
            ));
        }
    }
    let Some(body) = &scene.body else {
        return Err(Error::domain(
            "a scene of statics has no internal friction, and the memory is that of friction: give [rod] damping, as in \
             damping = { proportional = 0.05 }, and [body], [start] and [run] in place of [end]",
        ));
    };
    let end = match (scene.is_planar(), body.joint.is_weld()) {
        (true, _) => EndJoint::Planar,
        (false, true) => EndJoint::Welded,
        (false, false) => EndJoint::Ball,
    };
    let damping = scene.rod.damping.as_ref();
    let nonlinear = damping.is_some_and(|damping| damping.law != FrictionLaw::Linear);
    MemoryRecord::new(
        &scene.viscoelastic()?,
        scene.rod.length,
        end,
        scene.units,
        nonlinear,
    )
}

/// The linearised response of an end.
#[derive(Debug, Clone)]
pub struct MemoryRecord {
    /// Relaxation, memory kernel and creep as matrices of functions of time.
    pub kernel: MemoryKernel,
    /// Joint between rod end and body.
    pub end: EndJoint,
    /// The units of every quantity.
    pub units: Units,
    /// Indices of the components of (z, r) that the end can move in and load, in the order of the output.
    pub shown: Vec<usize>,
    /// Terms of R by rate, slowest first; rates equal up to rounding are merged.
    pub terms: Vec<RelaxationTerm>,
    /// Number of Maxwell branches of the section.
    pub branches: usize,
    /// True for a friction law other than H e_t, which was linearised.
    pub nonlinear: bool,
}

impl MemoryRecord {
    fn new(
        section: &Viscoelastic,
        length: f64,
        end: EndJoint,
        units: Units,
        nonlinear: bool,
    ) -> Result<Self> {
        let kernel = match end {
            // u1 bends towards d2.
            EndJoint::Planar => {
                MemoryKernel::carrying(section, length, [false, false, false, false, true, false])?
            }
            EndJoint::Ball => MemoryKernel::free_to_turn(section, length)?,
            EndJoint::Welded => MemoryKernel::new(section, length)?,
        };
        let shown: Vec<usize> = (0..6).filter(|i| kernel.moves()[*i]).collect();
        let mut response = Self {
            terms: Vec::new(),
            kernel,
            end,
            units,
            shown,
            branches: section.branches.len(),
            nonlinear,
        };
        response.terms = response.gathered();
        Ok(response)
    }

    fn gathered(&self) -> Vec<RelaxationTerm> {
        let mut terms: Vec<RelaxationTerm> = Vec::new();
        for mode in self.kernel.modes() {
            let weight = mode.force * mode.force.transpose() / mode.rate;
            match terms.last_mut() {
                Some(last) if mode.rate - last.rate <= ROUNDING * mode.rate => {
                    last.weight += weight
                }
                _ => terms.push(RelaxationTerm {
                    rate: mode.rate,
                    weight,
                    share: 0.0,
                }),
            }
        }
        let glassy = self.kernel.glassy();
        for term in &mut terms {
            let part = |i: &usize| term.weight[(*i, *i)] / glassy[(*i, *i)];
            term.share = self.shown.iter().map(part).fold(0.0, f64::max);
        }
        terms.retain(|term| term.share > ROUNDING);
        terms
    }

    /// Name of a component of the motion of the end.
    pub fn name(&self, i: usize) -> &'static str {
        match self.end {
            EndJoint::Planar => "y",
            _ => ["z1", "z2", "z3", "r1", "r2", "r3"][i],
        }
    }

    /// Name of a component of the wrench on the end.
    pub fn load(&self, i: usize) -> &'static str {
        match self.end {
            EndJoint::Planar => "n_y",
            _ => ["m1", "m2", "m3", "n1", "n2", "n3"][i],
        }
    }

    /// Name of the entry (i, j) of a matrix.
    pub fn entry(&self, i: usize, j: usize) -> String {
        format!("{}{}", self.name(i), self.name(j))
    }

    /// Fraction of R(0) that relaxes.
    pub fn forgotten(&self, i: usize) -> f64 {
        let glassy = self.kernel.glassy()[(i, i)];
        let part = |term: &RelaxationTerm| term.weight[(i, i)] / glassy;
        self.terms.iter().map(part).sum()
    }

    /// True if no component of the end has a memory.
    pub fn forgets_all(&self) -> bool {
        self.terms.is_empty()
    }

    /// Decades of time that contain the relaxation: from before its start until R and J have reached their limits to
    /// drawing accuracy.
    pub fn decades(&self) -> [f64; 2] {
        let kernel = &self.kernel;
        let (glassy, relaxed) = (kernel.glassy(), kernel.relaxed());
        let longest = kernel.creep(f64::MAX);
        let all = |holds: &dyn Fn(usize) -> bool| self.shown.iter().all(|&i| holds(7 * i));
        let early = |t: f64| {
            let (after, creep) = (kernel.wrench_after_step(t), kernel.creep(t));
            all(&|ii| {
                after[ii] >= (1.0 - EARLY) * glassy[ii] && creep[ii] <= 2.0 * EARLY * longest[ii]
            })
        };
        let late = |t: f64| {
            let (after, creep) = (kernel.wrench_after_step(t), kernel.creep(t));
            all(&|ii| {
                after[ii] <= (1.0 + LATE) * relaxed[ii] && creep[ii] >= (1.0 - LATE) * longest[ii]
            })
        };
        // Starting point: order of magnitude of the relaxation time.
        let ii = self.shown.first().map_or(0, |&i| 7 * i);
        let middle = (kernel.instantaneous()[ii] / glassy[ii]).log10().round() as i32;
        let decade = |k: &i32| 10.0_f64.powi(*k);
        let (least, most) = (-FARTHEST, FARTHEST);
        let middle = middle.clamp(least, most);
        let last = (middle..most).find(|k| late(decade(k))).unwrap_or(most);
        let first = (least..last)
            .rev()
            .find(|k| early(decade(k)))
            .unwrap_or(least);
        [decade(&first), decade(&last)]
    }

    /// Sentence on the verdict about (6.15).
    pub fn meaning(&self) -> String {
        let verdict = match (self.forgets_all(), self.branches) {
            (true, _) => {
                "to first order the end has no memory: it behaves as a spring and a dashpot in parallel"
            }
            (false, 0) => {
                "parts of the rod retard at different rates, so the wrench depends on the history of the end"
            }
            (false, 1) => {
                "the Maxwell branch relaxes, so the wrench depends on the history of the end"
            }
            (false, _) => {
                "the Maxwell branches relax, so the wrench depends on the history of the end"
            }
        };
        let why = match (self.forgets_all(), self.end) {
            (true, EndJoint::Planar) => {
                " (the rod bends only, and its retardation time is the same all along; large deflections do have a memory)"
            }
            (true, _) => " (large deflections may have a memory)",
            _ => "",
        };
        format!("{verdict}{why}")
    }

    /// Entries of the shown components, row by row.
    pub fn rows(&self, matrix: &Matrix6<f64>) -> Vec<Vec<f64>> {
        let row = |&i: &usize| self.shown.iter().map(|&j| matrix[(i, j)]).collect();
        self.shown.iter().map(row).collect()
    }

    /// Unit of the entry (i, j) of a matrix of wrenches per displacement, or of their inverse.
    pub fn unit(&self, i: usize, j: usize, inverse: bool) -> &'static str {
        if self.units == Units::Dimensionless {
            return "";
        }
        match ((i > 2) as u8 + (j > 2) as u8, inverse) {
            (0, false) => "N m",
            (1, false) => "N",
            (_, false) => "N/m",
            (0, true) => "1/(N m)",
            (1, true) => "1/N",
            (_, true) => "m/N",
        }
    }

    /// Unit of the entry (i, j) of a matrix of wrenches per velocity.
    pub fn dashpot_unit(&self, i: usize, j: usize) -> &'static str {
        match (self.unit(i, j, false), self.units) {
            (_, Units::Dimensionless) => "",
            ("N m", _) => "N m s",
            ("N", _) => "N s",
            _ => "N s/m",
        }
    }

    /// JSON form without the functions of time.
    pub fn summary(&self) -> Value {
        let kernel = &self.kernel;
        let found = kernel.commuting();
        let (dashpot, spring) = (kernel.instantaneous(), kernel.relaxed());
        let names = |name: &dyn Fn(usize) -> &'static str| -> Vec<_> {
            self.shown.iter().map(|&i| name(i)).collect()
        };
        let terms: Vec<Value> = self
            .terms
            .iter()
            .map(|term| {
                json!({
                    "rate": term.rate,
                    "time": term.rate.recip(),
                    "share": term.share,
                    "weight": self.rows(&term.weight),
                })
            })
            .collect();
        let directions: Vec<Value> = self
            .shown
            .iter()
            .map(|&i| {
                let forgotten = self.forgotten(i);
                json!({
                    "component": self.name(i),
                    "memory": forgotten > ROUNDING,
                    "forgotten": forgotten,
                    "spring": spring[(i, i)],
                    "dashpot": dashpot[(i, i)],
                    "retardation_time": dashpot[(i, i)] / spring[(i, i)],
                })
            })
            .collect();
        json!({
            "units": self.units,
            "end": self.end.as_str(),
            "linearised_at": "the straight unloaded rod, at rate zero",
            "friction_linearised": self.nonlinear,
            "components": names(&|i| self.name(i)),
            "wrench": names(&|i| self.load(i)),
            "condition_6_15": { "holds": found.holds, "defect": found.defect, "at": found.at },
            "memory": !self.forgets_all(),
            "meaning": self.meaning(),
            "instantaneous": self.rows(&dashpot),
            "glassy": self.rows(&kernel.glassy()),
            "relaxed": self.rows(&spring),
            "modes": terms,
            "directions": directions,
            "accuracy": kernel.accuracy(),
        })
    }
}
