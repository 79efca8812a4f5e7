//! Landing of a light rod with joints that has lost its equilibrium, with the carriers of its joints held (theory 2.6).
//!
//! The strains relax as in [`super::landing`], with the wrench w of the attachment on the end. The joints have no mass
//! and no friction, so that w does as much work on their motions as their laws. The coordinates of the joints are y. D
//! is the twist of the end's attachment relative to the base's attachment by y. L is the wrench of a load along the rod
//! about the base. Then
//! ```text
//! e_T = e^(Q w) - e,    int Q^T e_T - D y_T = -2 (end - attachment),    D^T w = laws + (motions of the base)^T L.
//! ```
//! Coordinates of axes with friction stay.

use super::body::BodyMotion;
use super::configuration::Evaluated;
use super::joined_rods::JoinedRods;
use super::network::Assembly;
use super::rod_element::Link;
use super::stiffness::relative_by_twists;
use super::viscous_layer::{RodLayer, fall_from, split};
use crate::error::{Error, Result};
use crate::manifold::{energy_allows_landing, fold_kernel};
use crate::math::se3::join;
use crate::rod::Wrench;
use crate::viscoelastic::kinematics::Kinematics;
use crate::viscoelastic::space::Space;
use nalgebra::{DMatrix, DVector, Matrix6, SVector, UnitQuaternion, Vector3, Vector6};

/// Chart step of the differences that give the strains' derivatives.
const ASIDE: f64 = 1e-4;
/// Largest change of strains and joints in the push off the fold, tried in order.
const PUSHES: [f64; 3] = [0.3, 0.03, 0.003];
/// Rounds of Newton's method for the wrench and the rates of the joints, and the residual that ends it.
const ROUNDS: usize = 20;
const BALANCED: f64 = 1e-9;
/// Relative error of energies, as a multiple of the tolerance of the integration along the rod.
const ENERGY_ERROR: f64 = 10.0;

/// Landing of a rod with joints.
#[derive(Debug, Clone)]
pub struct JointedLanding {
    /// Chart of the rod.
    pub chart: Wrench,
    /// All bodies, with the nodes of the rod's joints where they land.
    pub bodies: Vec<BodyMotion>,
    /// Energy lost in the fall, springs of the joints included.
    pub released: f64,
}

/// The fall of a rod: strains and joints.
struct Fall<'a> {
    rod: JoinedRods<'a>,
    link: &'a Link,
    layer: RodLayer<6>,
    /// Load along the rod at the nodes, along the directors of the base at the fold.
    load: Option<Vec<Vector3<f64>>>,
    /// Rotation of the base at the fold.
    base: UnitQuaternion<f64>,
    t: f64,
    bodies: Vec<BodyMotion>,
    /// Number of strains.
    strains: usize,
    rates: DVector<f64>,
}

impl Assembly {
    /// The equilibrium to which rod `k` falls from its fold with the carriers of its joints held.
    ///
    /// # Errors
    /// A taut rod; no simple fold; a flow that does not settle, or gains energy.
    pub fn settle_jointed(
        &self,
        k: usize,
        at: &Evaluated,
        tolerance: f64,
    ) -> Result<JointedLanding> {
        let rod = (self.joined_with(k)).ok_or_else(|| Error::domain("the rod has no joints"))?;
        if rod.is_frame() {
            return Err(Error::domain(format!(
                "{} snap together, joined without a body: the fall of several rods is not followed; give the node between them a small mass and \
                 inertia, or the rods their mass in full (inertia = \"full\")",
                self.rods_joined_with(k).join(", ")
            )));
        }
        let link = &self.links[k];
        let (t, point, q) = (at.integrals.time, &at.points[k], &at.now.charts[k]);
        if point.end.is_taut() {
            return Err(Error::domain(format!(
                "{} is taut where it snaps: the fall of a taut rod with a joint other than weld and ball is not followed; give the rod its \
                 mass in full, inertia = \"full\"",
                self.rod_name(k)
            )));
        }
        let equations = rod.equations_at(at);
        let kernel = fold_kernel(&equations.matrix)?;
        let seen = link.seen_at(t, &point.base.pose.rotation)?;
        let held = point.held();
        let layer = seen.layer::<6>(&held);
        let here = seen.strains(&layer.grid, q, &held, tolerance)?;
        let along = kernel.fixed_rows::<6>(0).into_owned() * ASIDE;
        let [ahead, behind] =
            [q + along, q - along].map(|q| seen.strains(&layer.grid, &q, &held, tolerance));
        let mut push = (ahead? - behind?) / (2.0 * ASIDE);
        let (strains, count) = (here.len(), rod.count);
        push = push.resize_vertically(strains + count, 0.0);
        push.rows_mut(strains, count)
            .copy_from(&kernel.rows(6, count));
        push /= push.amax();
        let start = here.resize_vertically(strains + count, 0.0);
        let scale = link.units();
        let wrench = join(
            &(point.end.couple / scale[0]),
            &(point.end.tip_force() / scale[3]),
        );
        let mut fall = Fall {
            load: layer.load.clone(),
            base: point.base.pose.rotation,
            layer,
            t,
            bodies: at.now.bodies.clone(),
            strains,
            rates: DVector::zeros(count),
            rod,
            link,
        };
        let energy = self.energy_of_rod(k, at);
        let mut found: Option<(f64, JointedLanding)> = None;
        let mut lost = None;
        for size in PUSHES {
            for side in [size, -size] {
                fall.layer.wrench = wrench;
                fall.rates.fill(0.0);
                let rates = |y: &DVector<f64>, out: &mut DVector<f64>| fall.rates(y, out);
                let Some(landed) = fall_from(rates, &start, &(&push * side), &mut |_| ()) else {
                    continue;
                };
                let landing = fall.charted(&landed).and_then(|(q, bodies)| {
                    let (q, bodies) = self.polished_jointed(k, (t, &bodies), &q, tolerance)?;
                    let mut there = at.clone();
                    there.points[k] = self.links[k].point(t, &bodies, &q, tolerance)?;
                    there.now.bodies.clone_from(&bodies);
                    let after = self.energy_of_rod(k, &there);
                    if !energy_allows_landing(energy, after, ENERGY_ERROR * tolerance) {
                        return Err(Error::no_convergence(format!(
                            "{} left its fold and came to rest with more energy than it had there: lower the tolerance",
                            self.rod_name(k)
                        )));
                    }
                    let landing = JointedLanding {
                        chart: q,
                        bodies,
                        released: energy - after,
                    };
                    Ok((after, landing))
                });
                match landing {
                    Ok(landing) => {
                        if found.as_ref().is_none_or(|(lowest, _)| landing.0 < *lowest) {
                            found = Some(landing);
                        }
                    }
                    Err(why) => lost = Some(why),
                }
            }
            if found.is_some() {
                break;
            }
        }
        found.map(|(_, landing)| landing).ok_or_else(|| {
            lost.unwrap_or_else(|| {
                Error::no_convergence(format!(
                    "{} with its joints does not come to rest after its fold",
                    self.rod_name(k)
                ))
            })
        })
    }

    /// Energy of rod `k`, of the load along the rod and of the joints at both ends.
    fn energy_of_rod(&self, k: usize, at: &Evaluated) -> f64 {
        let (t, bodies) = (at.integrals.time, &at.now.bodies);
        let rod = self.joined_with(k);
        let joints: f64 = (rod.iter().flat_map(JoinedRods::joints))
            .map(|(_, guide, node)| {
                guide.potential(&guide.frame(t, bodies), &bodies[node.number].pose)
            })
            .sum();
        at.points[k].end.energy + at.points[k].potential() + joints
    }
}

impl Fall<'_> {
    /// Bodies with the nodes moved by the coordinates of a state.
    fn moved(&self, state: &DVector<f64>) -> Vec<BodyMotion> {
        let mut bodies = self.bodies.clone();
        let by = state.rows(self.strains, self.rod.count);
        let by = by.component_mul(&self.rod.units());
        self.rod.move_by(self.t, &mut bodies, &by);
        bodies
    }

    /// Rates of strains and joints; None where a law refuses.
    fn rates(&mut self, state: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let bodies = self.moved(state);
        let link = self.link;
        let length = link.rod().length();
        let [base, tip] = [link.from(), link.to()].map(|site| site.at(self.t, &bodies).pose);
        self.layer.held = base.inv_mul(&tip);
        self.layer.held.translation.vector /= length;
        let back = base.rotation.inverse();
        let turn = back * self.base;
        let load = self.load.as_ref();
        self.layer.load = load.map(|load| load.iter().map(|f| turn * f).collect());
        let strains = split(&state.rows(0, self.strains).into_owned());
        let space = Space::<6, 6>::new();
        let curve = space.shape(&self.layer.grid, &strains)?;
        let off = self.layer.off(curve.end());
        let borne = self.layer.borne(&curve, strains.len());
        let about_base = self.layer.load_about_base(&curve);
        // D, and the laws with the load in each coordinate.
        let count = self.rod.count;
        let units = self.rod.units();
        let mut motions = DMatrix::zeros(6, count);
        let mut laws = DVector::zeros(count);
        let relative = relative_by_twists(&base, &tip);
        for (end, guide, node) in self.rod.joints() {
            let (frame, first) = (guide.frame(self.t, &bodies), node.first);
            let own = guide.twists(&frame, &bodies[node.number].pose);
            let actions = guide.actions(&frame, &bodies[node.number].pose);
            for a in 0..own.ncols() {
                let twist: Vector6<f64> = own.column(a) * units[first + a];
                let mut motion = relative.fixed_columns::<6>(6 * end) * twist;
                for i in 3..6 {
                    motion[i] /= length;
                }
                motions.set_column(first + a, &motion);
                laws[first + a] = actions[a] * units[first + a] / link.units()[0];
                if end == 0 {
                    let (spin, shift) = crate::math::se3::halves(&twist);
                    let seen = join(&(back * spin), &(back * shift / length));
                    laws[first + a] += seen.dot(&about_base);
                }
            }
        }
        let free: Vec<usize> = self.rod.free().iter().map(|i| i - 6).collect();
        let motions = motions.select_columns(&free);
        let law = &self.layer.law;
        let linear = law.uniform_linear().is_some();
        for round in 0..ROUNDS {
            let mut missing: SVector<f64, 6> = off * 2.0;
            let mut give = Matrix6::<f64>::zeros();
            let nodes = self.layer.grid.nodes().iter();
            let nodes = nodes.zip(self.layer.grid.weights()).zip(&strains);
            for (i, ((s, weight), e)) in nodes.enumerate() {
                let transfer = space.transfer(&curve, i);
                let resultants = transfer * self.layer.wrench + borne[i];
                let asked = law.inverse(*s, &resultants).ok()?;
                let rate = asked.strain - e;
                out.fixed_rows_mut::<6>(6 * i).copy_from(&rate);
                missing += transfer.tr_mul(&rate) * *weight;
                give += transfer.tr_mul(&(asked.compliance.matrix() * transfer)) * *weight;
            }
            let rates = DVector::from_iterator(free.len(), free.iter().map(|i| self.rates[*i]));
            missing -= &motions * &rates;
            let mut left = DVector::zeros(6 + free.len());
            left.rows_mut(0, 6).copy_from(&missing);
            let unbalanced = motions.tr_mul(&self.layer.wrench);
            for (i, k) in free.iter().enumerate() {
                left[6 + i] = unbalanced[i] - laws[*k];
            }
            if round > 0 && (linear || left.amax() < BALANCED) {
                let mut rates = out.rows_mut(self.strains, count);
                rates.copy_from(&self.rates);
                return out.iter().all(|x| x.is_finite()).then_some(());
            }
            let mut whole = DMatrix::zeros(6 + free.len(), 6 + free.len());
            whole.view_mut((0, 0), (6, 6)).copy_from(&give);
            whole
                .view_mut((0, 6), (6, free.len()))
                .copy_from(&-&motions);
            whole
                .view_mut((6, 0), (free.len(), 6))
                .copy_from(&motions.transpose());
            let change = whole.full_piv_lu().solve(&left)?;
            self.layer.wrench -= change.fixed_rows::<6>(0);
            for (i, k) in free.iter().enumerate() {
                self.rates[*k] -= change[6 + i];
            }
        }
        None
    }

    /// Chart and bodies of the rest point of the flow.
    fn charted(&self, state: &DVector<f64>) -> Result<(Wrench, Vec<BodyMotion>)> {
        let strains = split(&state.rows(0, self.strains).into_owned());
        let curve = Space::<6, 6>::new().shape(&self.layer.grid, &strains);
        let curve = curve
            .ok_or_else(|| Error::no_convergence("the layer ended in strains without a shape"))?;
        let (m, n) = crate::math::se3::halves(&self.layer.wrench);
        let about = join(&(m + curve.end().translation.vector.cross(&n)), &n);
        Ok((
            about + self.layer.load_about_base(&curve),
            self.moved(state),
        ))
    }
}
