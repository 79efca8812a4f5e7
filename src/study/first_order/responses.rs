//! Stiffness and compliance of an equilibrium at ends, stations and bodies.

use super::by_fields::fine;
use crate::assembly::AssemblyEquilibrium;
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::rod::{Chart, Equilibrium, RodFamily, Spatial};
use crate::scene::{AssemblySetup, LoadPlace, RodLoad, Scene};
use crate::solve::extrapolated_slope::Slope;
use crate::solve::implicit_derivative::response;
use crate::study::stations::placed;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector6};
use serde_json::{Map, Value, json};

/// Least singular value, relative to the largest, of a stiffness that has an inverse.
const SINGULAR: f64 = 1e-12;
/// Tolerance of the integration along the rods of an assembly.
const ALONG: f64 = 1e-13;
/// Largest change of the unknowns over the first step of a difference, relative to 1 + |x|.
const CHANGE: f64 = 0.02;

/// Linear relation of a change of the wrench on a place of an equilibrium and the change of pose of the place, in the
/// scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct EndResponse {
    /// Free motions of the place as columns (rotation, translation) in the world; `None` for all six.
    pub twists: Option<DMatrix<f64>>,
    /// Wrench (couple, force) by pose (rotation vector, place), along the free motions.
    pub stiffness: Option<DMatrix<f64>>,
    /// Pose by wrench, likewise.
    pub compliance: Option<DMatrix<f64>>,
    /// Reason why a matrix is missing.
    pub why: Option<String>,
}

/// Responses of an equilibrium.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Responses {
    /// The end of one rod with its clamp held. The end condition of the scene has no part.
    pub end: Option<EndResponse>,
    /// Stations inside one rod, under the end condition of the scene.
    pub stations: Vec<(String, EndResponse)>,
    /// Bodies of an assembly, all others moving freely.
    pub bodies: Vec<(String, EndResponse)>,
}

fn rows(matrix: &DMatrix<f64>) -> Value {
    let rows = matrix.row_iter();
    rows.map(|row| row.iter().copied().collect::<Value>())
        .collect()
}

impl EndResponse {
    fn missing(why: &Error) -> Self {
        Self {
            twists: None,
            stiffness: None,
            compliance: None,
            why: Some(why.to_string()),
        }
    }

    fn json(&self) -> Value {
        let mut object = json!({
            "stiffness": self.stiffness.as_ref().map(rows),
            "compliance": self.compliance.as_ref().map(rows),
        });
        if let Some(twists) = &self.twists {
            object["twists"] = rows(&twists.transpose());
        }
        if let Some(why) = &self.why {
            object["reason"] = why.as_str().into();
        }
        object
    }
}

impl Responses {
    /// Adds `responses`.
    pub(super) fn put_into(self, summary: &mut Value) {
        let named = |all: &[(String, EndResponse)]| -> Map<String, Value> {
            let all = all.iter();
            all.map(|(name, one)| (name.clone(), one.json())).collect()
        };
        let mut object = Map::new();
        object.extend(self.end.map(|end| ("end".to_owned(), end.json())));
        for (name, all) in [("stations", &self.stations), ("bodies", &self.bodies)] {
            if !all.is_empty() {
                object.insert(name.to_owned(), named(all).into());
            }
        }
        summary["responses"] = object.into();
    }
}

/// The inverse of a matrix of couples and forces; `None` where it is singular. `sizes` makes rotations and lengths
/// comparable.
fn inverse(matrix: &DMatrix<f64>, sizes: &[f64]) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * sizes[i] * sizes[j]);
    let values = scaled.singular_values();
    let inverse = scaled.try_inverse()?;
    (values.min() > SINGULAR * values.max())
        .then(|| DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * sizes[i] * sizes[j]))
}

/// Responses of one rod.
///
/// # Errors
/// Obstacles.
pub(super) fn of_rod(scene: &Scene, found: &Equilibrium) -> Result<Responses> {
    if !scene.obstacles.is_empty() {
        return Err(Error::domain(
            "stiffness and compliance are not computed for rods among obstacles; leave out [[obstacle]]",
        ));
    }
    let problem = fine(scene.clone()).problem()?;
    let end = match problem.end_response(&found.base) {
        Err(why) => EndResponse::missing(&why),
        Ok(known) => {
            let dynamic =
                |matrix: Matrix6<f64>| DMatrix::from_column_slice(6, 6, matrix.as_slice());
            let why = match (&known.stiffness, &known.compliance) {
                (None, _) => Some(
                    "the end, held, is at a fold, or cannot move in every way: it has no stiffness",
                ),
                (_, None) => Some("the end, loaded, is at a fold: it has no compliance"),
                _ => None,
            };
            EndResponse {
                twists: None,
                stiffness: known.stiffness.map(dynamic),
                compliance: known.compliance.map(dynamic),
                why: why.map(str::to_owned),
            }
        }
    };
    let inside = placed(scene)
        .into_iter()
        .filter(|station| station.place > 0.0 && station.place < 1.0);
    let taut = problem.is_taut(&found.base, &found.end);
    let stations = inside.map(|station| {
        let compliance = if taut {
            Err(Error::ill_conditioned(
                "the rod is too taut for its base wrench",
            ))
        } else {
            station_compliance(scene, found, station.place)
        };
        let response = match compliance {
            Err(why) => EndResponse::missing(&why),
            Ok(compliance) => {
                let length = scene.rod.length;
                let sizes = [1.0, 1.0, 1.0, length, length, length].map(f64::recip);
                let stiffness = inverse(&compliance, &sizes);
                EndResponse {
                    twists: None,
                    why: stiffness.is_none().then(|| {
                        "the station cannot move in every way: it has no stiffness".to_owned()
                    }),
                    stiffness,
                    compliance: Some(compliance),
                }
            }
        };
        (station.name, response)
    });
    Ok(Responses {
        end: Some(end),
        stations: stations.collect(),
        bodies: Vec::new(),
    })
}

/// Compliance of the place s/length under the end condition of the scene: the answer to a dead couple or force there.
fn station_compliance(scene: &Scene, found: &Equilibrium, place: f64) -> Result<DMatrix<f64>> {
    let scene = fine(scene.clone());
    let problem = scene.problem()?;
    let (couple, force) = problem.rod().units();
    let s = place * scene.rod.length;
    let turned = problem.sections(&found.base, &[place])?[0].directors;
    let mut compliance = DMatrix::zeros(6, 6);
    for j in 0..6 {
        let with_load = |h: f64| {
            let mut scene = scene.clone();
            let mut load = RodLoad {
                number: scene.rod.loads.len(),
                place: LoadPlace::Station { s },
                force: [0.0; 3],
                couple: [0.0; 3],
                follows: false,
                factor: h,
            };
            if j < 3 {
                load.couple[j] = couple;
            } else {
                load.force[j - 3] = force;
            }
            scene.rod.loads.push(load);
            scene.problem()
        };
        let family = RodFamily::new(with_load, true, 1.0);
        let x = family.unknowns(&found.base, 0.0)?;
        let here = response(&family, &x, 0.0)?;
        let short = CHANGE * (1.0 + x.norm()) / here.by.value.norm().max(f64::MIN_POSITIVE);
        let pose = Slope::at(here.step.min(short), &mut |h| {
            let x = &here.x + &here.by.value * h;
            let at = &Spatial.sections(&with_load(h)?, &x, &[place])?[0];
            let turn: Matrix3<f64> = at.directors * turned.transpose();
            // The quaternion keeps all digits of a small angle; the trace of a matrix keeps half of them.
            let turn = Rotation3::from_matrix_unchecked(turn);
            let turn = UnitQuaternion::from_rotation_matrix(&turn).scaled_axis();
            let moved: Vector6<f64> = join(&turn, &at.position);
            Ok(DVector::from_column_slice(moved.as_slice()))
        })?;
        let unit = if j < 3 { couple } else { force };
        compliance.set_column(j, &(pose.value / unit));
    }
    Ok(compliance)
}

/// Responses of the bodies of an assembly.
///
/// # Errors
/// A scene that cannot be lowered; a rod whose integration fails.
pub(super) fn of_assembly(scene: &Scene, found: &AssemblyEquilibrium) -> Result<Responses> {
    let setup = AssemblySetup::new(scene)?;
    let (assembly, now, k) = (&setup.assembly, &found.now, &setup.scales);
    let points = assembly.points(0.0, &now.bodies, &now.charts, ALONG)?;
    let bodies = scene.assembly().into_iter().flat_map(|given| &given.bodies);
    let matrix = match assembly.stiffness(0.0, &now.bodies, &points) {
        Ok(stiffness) => stiffness.matrix,
        Err(why) => {
            let why = scene.in_own_units(why);
            let none =
                |body: &crate::scene::AssemblyBody| (body.name.clone(), EndResponse::missing(&why));
            return Ok(Responses {
                bodies: bodies.map(none).collect(),
                ..Responses::default()
            });
        }
    };
    let own = assembly.own_twists(&now.bodies);
    let (starts, total) = assembly.freedoms();
    let each = bodies.zip(own).zip(starts).map(|((body, own), start)| {
        let count = own.ncols();
        let mine: Vec<usize> = (start..start + count).collect();
        let others: Vec<usize> = (0..total).filter(|i| !mine.contains(i)).collect();
        let block =
            |rows: &[usize], columns: &[usize]| matrix.select_rows(rows).select_columns(columns);
        let condensed = if others.is_empty() {
            Some(block(&mine, &mine))
        } else {
            let rest = block(&others, &others);
            let unit = vec![1.0; others.len()];
            let inverse = inverse(&rest, &unit);
            inverse.map(|inverse| {
                block(&mine, &mine) - block(&mine, &others) * inverse * block(&others, &mine)
            })
        };
        let turns = |i: usize| halves(&Vector6::from(own.column(i))).0.norm() > 0.0;
        let lengths: Vec<f64> = (0..count)
            .map(|i| if turns(i) { 1.0 } else { k.length })
            .collect();
        let unit = vec![1.0; count];
        let compliance = condensed.as_ref().and_then(|matrix| inverse(matrix, &unit));
        let why = match (&condensed, &compliance) {
            (None, _) => Some("the other bodies are at a fold while this one is held"),
            (_, None) => Some("the equilibrium is at a fold: it has no compliance"),
            _ => None,
        };
        let outward = |matrix: DMatrix<f64>, power: i32| {
            DMatrix::from_fn(count, count, |i, j| {
                let unit = k.energy / (lengths[i] * lengths[j]);
                matrix[(i, j)] * unit.powi(power)
            })
        };
        let is_free = count == 6 && own == Matrix6::identity();
        let response = EndResponse {
            twists: (!is_free).then(|| DMatrix::from_fn(6, count, |i, j| own[(i, j)])),
            stiffness: condensed.map(|matrix| outward(matrix, 1)),
            compliance: compliance.map(|matrix| outward(matrix, -1)),
            why: why.map(str::to_owned),
        };
        (body.name.clone(), response)
    });
    Ok(Responses {
        bodies: each.collect(),
        ..Responses::default()
    })
}
