//! Phase portrait of the pendulum with the sheets (AMV Fig. 3.12).

use super::pairs;
use crate::manifold::{Sheet, Sign};
use std::f64::consts::{FRAC_PI_2, PI};

/// Curves in the phase plane (psi, psi_s/lam) of psi'' + lam^2 sin psi = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct PhasePlane {
    /// Closed orbits.
    pub orbits: Vec<Vec<[f64; 2]>>,
    /// The two halves of the separatrix.
    pub separatrix: [Vec<[f64; 2]>; 2],
    /// Angle psi = -alpha at the clamp of all arcs.
    pub clamp: f64,
    /// Solutions with this alpha on one orbit, from the clamp to the free end with psi_s = 0.
    pub arcs: Vec<PhaseArc>,
    /// Points A and C, where an arc may begin, and B and D, where it may end.
    pub ends: [(char, [f64; 2]); 4],
}

/// A solution as an arc of an orbit.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseArc {
    /// Sheet of the solution.
    pub sheet: Sheet,
    /// Points passed by the arc: "ABCD".
    pub path: String,
    /// The arc.
    pub points: Vec<[f64; 2]>,
}

/// Orbits, and on one of them an arc for each sheet of the modes.
pub fn phase_plane(modes: &[u32]) -> PhasePlane {
    const K: f64 = 0.75;
    const CLAMP: f64 = -0.7;
    // sin(psi/2) = k sin phi and psi_s/lam = 2 k cos phi: clockwise as phi grows.
    let on = |k: f64, phi: f64| [2.0 * (k * phi.sin()).asin(), 2.0 * k * phi.cos()];
    let run = |k: f64, from: f64, to: f64| -> Vec<[f64; 2]> {
        let points = (0..=300).map(|i| on(k, from + (to - from) * f64::from(i) / 300.0));
        points.collect()
    };
    let a = ((0.5 * CLAMP).sin() / K).asin();
    let c = PI - a;
    let arcs = pairs(modes).map(|sheet| {
        // Arcs pass both ends, B and D, in turn: S_j^+ starts at A and S_j^- at C.
        let plus = sheet.sign == Sign::Plus;
        let (from, first) = if plus { (a, FRAC_PI_2) } else { (c, 1.5 * PI) };
        let letters = if plus { ["AB", "CD"] } else { ["CD", "AB"] };
        PhaseArc {
            sheet,
            path: (0..=sheet.mode).map(|i| letters[i as usize % 2]).collect(),
            points: run(K, from, first + PI * f64::from(sheet.mode)),
        }
    });
    let separatrix = |side: f64| {
        let psi = (0..=200).map(|i| PI * (f64::from(i) / 100.0 - 1.0));
        psi.map(|psi| [psi, side * 2.0 * (0.5 * psi).cos()])
            .collect()
    };
    PhasePlane {
        orbits: [0.25, 0.5, 0.75, 0.93]
            .map(|k| run(k, 0.0, 2.0 * PI))
            .into(),
        separatrix: [1.0, -1.0].map(separatrix),
        clamp: CLAMP,
        arcs: arcs.collect(),
        ends: [('A', a), ('B', FRAC_PI_2), ('C', c), ('D', 1.5 * PI)]
            .map(|(name, phi)| (name, on(K, phi))),
    }
}
