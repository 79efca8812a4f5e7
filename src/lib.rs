//! Reduced-order dynamics of light rods that carry heavy rigid bodies.
//!
//! A light rod is clamped at one end and carries a heavy body at the other. The rod's inertia is left out: at every
//! instant the rod is in equilibrium between clamp and body, so that only the body moves. Several rod shapes can
//! share one position of the body; where a shape ceases to exist the rod **snaps** to another. A rod with internal
//! friction does not snap at once: it **creeps**. This crate computes both motions, the equilibria behind them and
//! their stability, for planar rods in closed form and for rods in space.
//!
//! # A snap
//!
//! A mass on an elastic rod in the plane pushes its rod over a fold. The run is an iterator of events; position and
//! velocity are continuous through the snap, and the energy that the rod releases is dissipated.
//!
//! ```
//! use nalgebra::Vector2;
//! use snaprod::body::PointMass;
//! use snaprod::elastica::{Elastica, Equilibrium};
//! use snaprod::motion::{Event, Options, Run};
//!
//! // The start: an equilibrium with the force lambda^2 = 6.3^2 in the rod, and the mass thrown downwards.
//! let start = Equilibrium::from_lambda_kappa(6.3, 0.6)?;
//! let mass = PointMass::new(1.0)?;
//! let velocity = Vector2::new(0.0, -0.5);
//! let mut run = Run::new(&Elastica, &mass, Vector2::new(start.p, start.w), velocity, Options::new(1.0)?)?;
//! let energy = run.now().ledger.total();
//! for event in &mut run {
//!     if let Event::Snap(snap) = event {
//!         assert!((snap.t - 0.025570197858).abs() < 1e-10);
//!         assert!((snap.released - 10.263064640).abs() < 1e-7);
//!     }
//! }
//! assert!((run.now().ledger.total() / energy - 1.0).abs() < 1e-6); // the ledger counts what the snap dissipated
//! # Ok::<(), snaprod::Error>(())
//! ```
//!
//! # A branch
//!
//! A straight column under a growing thrust, followed through the load at which it loses its stability: statics in
//! space, with the Morse index of every point and the special points located. A study takes a scene, written in the
//! program's input format, and returns records.
//!
//! ```
//! # #[cfg(feature = "scene")] {
//! use snaprod::scene::Scene;
//! use snaprod::study::{Silent, branch};
//!
//! let column = Scene::parse(
//!     r#"
//!     [rod]
//!     model = "cosserat"
//!     length = 1.0
//!     section = { bending = [5.0, 1.0], torsion = 1.0 }
//!     [end]
//!     force = [0.0, 0.0, -1.0]
//!     [continue]
//!     parameter = "end.load"
//!     from = 0.0
//!     to = 4.0
//!     "#,
//! )?;
//! let record = branch(&column, &mut Silent)?;
//! let buckling = &record.branches.specials[0];
//! assert!((buckling.parameter - std::f64::consts::PI.powi(2) / 4.0).abs() < 1e-8); // Euler's load
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Creep
//!
//! A mass on a planar rod with friction, which starts in a shape that is no equilibrium: theta' = 1.5 - 1.5 s. The
//! rows of the tables of a run go to a sink, here into memory; the record holds all other results.
//!
//! ```
//! # #[cfg(feature = "scene")] {
//! use snaprod::scene::Scene;
//! use snaprod::study::{Silent, Table, run};
//!
//! let scene = Scene::parse(
//!     r#"
//!     [rod]
//!     model = "elastica"
//!     length = 1.0
//!     bending_stiffness = 1.0
//!     damping = 0.1
//!     [body]
//!     mass = 1.0
//!     [start]
//!     curvature = [1.5, -1.5]
//!     velocity = [0.0, -1.0]
//!     [run]
//!     duration = 3.0
//!     tolerance = 1e-10
//!     "#,
//! )?;
//! let mut tables: Vec<Table> = Vec::new();
//! let prepared = run::Prepared::new(&scene)?;
//! let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent)?;
//! assert_eq!(record.outcome(), "end_of_time");
//! let end = &record.last().last; // of the last branch, the last moment
//! assert!((end.position().x - 0.9100385606).abs() < 1e-9 && (end.position().y - 0.3763304412).abs() < 1e-9);
//! assert!((end.ledger.dissipated - 0.6255343792).abs() < 1e-8);
//! assert_eq!(tables[0].columns[1].name, "x");
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! Each module uses only modules above it in the table:
//!
//! | module | contents |
//! | --- | --- |
//! | [`error`] | the one error type |
//! | [`math`] | elliptic integrals and functions by the complementary modulus |
//! | [`solve`] | general algorithms: Newton, bracketed roots, DOP853 with events, Radau IIA, continuation |
//! | [`obstacle`] | obstacles as signed distances with two derivatives |
//! | [`section`] | laws of a cross-section: stored energy, friction, relaxation |
//! | [`manifold`] | trait of equilibrium manifolds, inversion near a guess; smallest example: the von Mises truss |
//! | [`elastica`] | planar elastica in closed form: labels, folds, cusps, index, all equilibria at a point, landings |
//! | [`rod`] | Cosserat rods in space: equilibria, branches, stability |
//! | [`body`] | the mass, or the rigid body, and its loads |
//! | [`contact`] | shapes of bodies, impacts with friction, contact forces |
//! | [`viscoelastic`] | viscoelastic rods: strains on Gauss nodes, wrench of a moving end, memory of small motions |
//! | [`assembly`] | several rods and bodies: equilibria, stability, equations of motion, landings, contact |
//! | [`full_mass`] | rods of full mass: kinematics, balance, equilibria, vibrations |
//! | [`bar`] | longitudinal waves and shocks in hyperelastic bars |
//! | [`ring`], [`tube`] | sections of tubes under pressure: buckling, contact, wall laws |
//! | [`membrane`] | inflated spheres and discs at rest and in motion, gas, a piston |
//! | [`motion`] | runs: motion on a sheet, snaps, ledger; viscoelastic motion; exact reductions |
//! | `scene` | scenes in TOML (feature `scene`) |
//! | `study` | the program's commands as functions: scene in, records out (feature `scene`) |
//! | `plot` | SVG figures from plain data (feature `plot`) |
//!
//! # Features
//!
//! | feature | adds | needs |
//! | --- | --- | --- |
//! | none | the numerical core | nalgebra, gauss-quad, num-dual |
//! | `scene` | scenes in TOML, read with every fault at its line | toml, serde |
//! | `plot` | SVG figures | plotters |
//! | `png` | PNG beside every SVG | resvg |
//! | `pdf` | PDF beside every SVG | svg2pdf |
//! | `cli` (default) | the program `snaprod` | clap, csv, ... |
//!
//! `cargo add snaprod --no-default-features` gives the core alone.
//!
//! # Units
//!
//! The library counts in units of the rod: its length is 1 and a bending stiffness EI is 1. With the mass mu that it
//! carries,
//!
//! | quantity | unit |
//! | --- | --- |
//! | force, couple | EI/L^2, EI/L |
//! | energy | EI/L |
//! | time | sqrt(mu L^3/EI) |
//! | viscosity of flexure | EI times the unit of time |
//!
//! Statics of rods in space ([`rod`]) takes any consistent units. Scenes may be in SI or any consistent units, and
//! are scaled once.
//!
//! # Glossary
//!
//! * **Director**: one of the orthonormal d1, d2, d3 that a cross-section carries; d3 is along an unsheared rod.
//! * **Resultant, couple, wrench**: the force n and the moment m across a section; the pair (m, n).
//! * **Strain**: flexure and twist u = (u1, u2, u3), shear and stretch v = (v1, v2, v3), along the directors.
//! * **Pose**: position of the end of the rod, or position and rotation.
//! * **Chart**: coordinates q of all equilibria together. Pose, wrench, energy and shape are smooth functions of q,
//!   though one pose can have several q. The chart of the planar elastica is (p, w); of rods in space, the wrench at
//!   the clamp.
//! * **Sheet**: a part of the surface of equilibria on which the pose determines q. S_1^- is a sheet of the planar
//!   elastica: the curvature changes sign once along the rod, and is negative at the clamp.
//! * **Fold**: common boundary of two sheets; the derivative of the pose by q is singular. **Cusp**: point where two
//!   folds meet.
//! * **Index** (Morse index): the number of independent changes of shape, with the end held, that lower the energy. 0
//!   is stable.
//! * **Branch**: a curve of equilibria as a parameter of the problem moves.
//! * **Taut**: an inextensible rod pulled straight. The force grows without bound as the end comes to full reach; a
//!   moving body bounces.
//! * **Layer**: a fast passage of a rod with friction from far away to near equilibrium while the body hardly moves,
//!   such as a snap.
//! * **Landing**: the equilibrium on which a rod comes to rest after a snap, or after the layer.
//! * **Ledger**: kinetic + elastic + potential + dissipated - work of the loads. The sum is computed, never imposed;
//!   its drift measures the accuracy of the run.
//! * **Memory**: the dependence of the end's force on past motion, beyond the present place and velocity.
//! * **Overstress**: the resultants minus those of the stored energy and the relaxing branches; it drives the creep.
//!
//! # Theory
//!
//! Comments cite `docs/theory.md` of the repository as "theory 2.5", and S. S. Antman, R. S. Marlow, C. P. Vlahacos,
//! *The complicated dynamics of heavy rigid bodies attached to deformable rods*, Quart. Appl. Math. 56 (1998)
//! 431-460, as AMV with its equation numbers.
#![warn(missing_docs)]

#[cfg(feature = "cli")]
extern crate self as snaprod;

// The numerics are two crates, compiled side by side at full optimisation; figures are a third with little
// optimisation. Scenes, studies and the program run for milliseconds and are not optimised. A change
// recompiles nothing to its left in this list.
#[doc(inline)]
pub use snaprod_motion as motion;
#[doc(inline)]
pub use snaprod_systems::{
    assembly, body, contact, elastica, error, full_mass, manifold, math, obstacle, rod, section,
    solve, viscoelastic,
};
#[doc(inline)]
pub use snaprod_walls::{flow, membrane, ring, tube};
#[doc(inline)]
pub use snaprod_waves::bar;

#[cfg(feature = "plot")]
#[doc(inline)]
pub use snaprod_plot as plot;

// The program is compiled with the library, so that no generic code is instantiated twice. It names the library
// `snaprod`, as any other user does.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

#[cfg(feature = "scene")]
pub mod scene;
#[cfg(feature = "scene")]
pub mod study;

pub use error::{Error, Result};

/// The program of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
