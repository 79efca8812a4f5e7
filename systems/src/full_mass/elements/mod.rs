//! Rods with mass as chains of elements, for motions at an engineer's accuracy.
//!
//! A rod is cut into elements of degree p, with p + 1 Lobatto nodes each. A node has a position and a rotation, and
//! the mass of its weight. Strains are taken at p Gauss points, so that thin rods bend without locking
//! (`strain_at_point`). Forces act between the nodes of one element only: right-hand sides and factors cost in
//! proportion to the nodes (`block_lu`).
//!
//! Nodes at the ends are those of bodies, the ground or supports where the rod is tied to them. What has its own
//! position or rotation is a *site*; the state has positions, quaternions and twists of all sites (`system`).
//!
//! Strains that the section law holds rigid are held by springs here, and so is what a joint with axes holds
//! (`axis_joint`). A run chooses their stiffness by the loads ([`ElementAssembly::give_under_loads`]).

mod axis_joint;
mod barrier;
mod block_lu;
mod descent;
mod hold;
mod linear;
mod refined;
mod rest;
mod sample;
mod strain_at_point;
mod system;

pub use barrier::{BarrierContact, BarrierStrength, Missed, NearestPlace, Touched, Touching};
pub use descent::equilibrium;
pub use linear::{ElementFactor, ElementLinear};
pub use system::{ElementMoment, INTEGRALS};

use super::assembly::{HeavyAssembly, Tie};
use super::law::Law;
use super::rod::RodDescription;
use super::turning_load::TurningLoad;
use crate::assembly::{AttachedTo, BodyMotion};
use crate::body::{Mass, RigidBody, Support};
use crate::error::{Error, Result};
use crate::math::gauss::{Rule, legendre, lobatto};
use crate::math::se3::{Turn, product};
use axis_joint::AxisJoint;
use barrier::Barrier;
use block_lu::Pattern;
use hold::Hold;
use nalgebra::{DMatrix, Isometry3, Vector3};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Give of a strain that is held rigid: bending stiffness over the stiffness of its spring. For a shear or stretch the
/// bending stiffness is taken over length squared.
const GIVE: f64 = 1e-6;
/// Radius of gyration, over the distance of the nodes, of sections without rotary inertia.
const SLENDER: f64 = 1e-2;
/// Distance between a node at the end of an element and the place of its mass density, over the element's length: a
/// density may jump between two elements.
const ASIDE: f64 = 1e-12;

/// Carrier of a node's position or rotation: a place on the ground, or a site, by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Carrier {
    Ground(usize),
    Site(usize),
}

/// A node of a rod. The carrier `shift` determines the position, the carrier `turn` the rotation.
#[derive(Debug, Clone)]
struct ElementNode {
    shift: Carrier,
    turn: Carrier,
    /// Position in the frame of `shift`, and rotation in the frame of `turn`.
    place: Isometry3<f64>,
    rotation: Turn,
}

/// Mass of a piece of a rod of which the rotary inertia alone rides on a carrier, since its place slides.
const SLIDING: f64 = 1e-30;

/// A place on the ground or on a support.
#[derive(Debug, Clone)]
struct ElementGround {
    support: Option<Box<Support<3>>>,
    /// Piece of a rod at a place on it.
    riding: Option<Mass>,
    place: Isometry3<f64>,
}

/// Something that moves by itself.
#[derive(Debug, Clone)]
struct ElementSite {
    masses: Vec<Mass>,
    turns: bool,
    shifts: bool,
}

/// Values and derivatives of the polynomials of an element at its Gauss points; derivatives over the element's length.
#[derive(Debug)]
struct GaussTable {
    /// Gauss points on [0, 1], and weights.
    points: Vec<f64>,
    weights: Vec<f64>,
    /// Rows are points, columns nodes.
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
    /// Nodes on [0, 1].
    nodes: Vec<f64>,
    /// Slopes of the polynomials at the nodes: rows are nodes, columns polynomials.
    at_nodes: Vec<Vec<f64>>,
    /// Last two Legendre coefficients of the polynomial through values at the nodes.
    tails: [Vec<f64>; 2],
    /// Coefficients of the polynomials in 2 x - 1: rows are powers, columns nodes.
    powers: Vec<Vec<f64>>,
}

/// An element of a rod.
#[derive(Debug, Clone)]
struct RodElement {
    /// Nodes, by their numbers in the rod.
    nodes: Range<usize>,
    /// From and to, in parts of the rod.
    from: f64,
    to: f64,
}

/// A rod in elements.
#[derive(Debug, Clone)]
struct ElementRod {
    given: RodDescription,
    elements: Vec<RodElement>,
    nodes: Vec<ElementNode>,
    /// Places of the nodes, in parts of the rod.
    places: Vec<f64>,
    /// Springs of the strains held rigid.
    springs: Vec<(usize, f64)>,
    /// Loads without a potential on the nodes; none on a rod without such loads.
    turning: Vec<TurningLoad>,
    /// True if something holds or rides on the end.
    is_held: bool,
}

/// Numbers of elements between the breaks of the rods, and their degree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mesh {
    /// For each rod, for each interval between its breaks.
    pub elements: Vec<Vec<usize>>,
    /// Degree of the polynomials of all elements.
    pub degree: usize,
}

/// Motions that the state can make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freedoms {
    /// All.
    Space,
    /// In the plane normal to this axis.
    Plane(usize),
}

/// Bodies, and rods in elements.
#[derive(Debug, Clone)]
pub struct ElementAssembly {
    sites: Vec<ElementSite>,
    grounds: Vec<ElementGround>,
    rods: Vec<ElementRod>,
    /// Springs in place of constraints; none in motion.
    holds: Vec<Hold>,
    joints: Vec<AxisJoint>,
    /// Obstacles, if there are any.
    barrier: Option<Barrier>,
    /// Stiffness of all springs over that of the first ones.
    hold: f64,
    /// Number of the bodies of the list, the first sites.
    bodies: usize,
    mesh: Mesh,
    freedoms: Freedoms,
    table: Arc<GaussTable>,
    pattern: Arc<Pattern>,
    damped: bool,
}

impl GaussTable {
    fn new(degree: usize) -> Self {
        let (nodes, _) = lobatto(degree + 1);
        let rule = Rule::new(degree);
        let weight = |i: usize| -> f64 {
            let others = (0..=degree).filter(|j| *j != i);
            1.0 / others.map(|j| nodes[i] - nodes[j]).product::<f64>()
        };
        let weights: Vec<f64> = (0..=degree).map(weight).collect();
        let value = |x: f64, i: usize| -> f64 {
            let others = (0..=degree).filter(|j| *j != i);
            weights[i] * others.map(|j| x - nodes[j]).product::<f64>()
        };
        let slope = |x: f64, i: usize| -> f64 {
            let without = |k: usize| -> f64 {
                let others = (0..=degree).filter(|j| *j != i && *j != k);
                others.map(|j| x - nodes[j]).product::<f64>()
            };
            weights[i] * (0..=degree).filter(|k| *k != i).map(without).sum::<f64>()
        };
        let at = |f: &dyn Fn(f64, usize) -> f64| -> Vec<Vec<f64>> {
            let points = rule.nodes.iter();
            points
                .map(|x| (0..=degree).map(|i| f(*x, i)).collect())
                .collect()
        };
        let modes = DMatrix::from_fn(degree + 1, degree + 1, |i, k| {
            legendre(2.0 * nodes[i] - 1.0, degree + 1)[k]
        });
        let modes = modes
            .try_inverse()
            .unwrap_or_else(|| DMatrix::zeros(degree + 1, degree + 1));
        let tail = |k: usize| modes.row(k).iter().copied().collect();
        let powers = DMatrix::from_fn(degree + 1, degree + 1, |i, k| {
            (2.0 * nodes[i] - 1.0).powi(k as i32)
        });
        let powers = powers
            .try_inverse()
            .unwrap_or_else(|| DMatrix::zeros(degree + 1, degree + 1));
        let rows = powers.row_iter();
        let powers = rows.map(|row| row.iter().copied().collect()).collect();
        Self {
            powers,
            values: at(&value),
            slopes: at(&slope),
            tails: [tail(degree - 1), tail(degree)],
            at_nodes: (nodes.iter())
                .map(|x| (0..=degree).map(|i| slope(*x, i)).collect())
                .collect(),
            points: rule.nodes,
            weights: rule.weights,
            nodes,
        }
    }
}

impl ElementRod {
    fn law(&self) -> &Law {
        &self.given.law
    }

    /// The rod with the section law of the time `t`; None where the law is not defined.
    fn seen_at(&self, t: f64) -> Option<Cow<'_, Self>> {
        let mut seen = Cow::Borrowed(self);
        if self.law().varies_in_time() {
            seen.to_mut().given.law = self.law().seen_at(t)?.into_owned();
        }
        Some(seen)
    }

    /// Length of an element.
    fn length(&self, element: &RodElement) -> f64 {
        (element.to - element.from) * self.law().length()
    }
}

/// Why a motion is left to the strains at Gauss nodes.
fn only_strains(why: &str) -> Error {
    Error::domain(format!("elements do not follow {why}"))
}

impl ElementAssembly {
    /// The bodies and rods of `given` on a mesh.
    ///
    /// # Errors
    /// Grooves, Maxwell branches: what elements do not follow. Obstacles that are too thin for the rods.
    pub fn new(given: &HeavyAssembly, mesh: Mesh) -> Result<Self> {
        if given.carriers.iter().any(|body| body.groove().is_some()) {
            return Err(only_strains("bodies in grooves"));
        }
        let table = Arc::new(GaussTable::new(mesh.degree));
        let mut made = Self {
            sites: Vec::new(),
            grounds: Vec::new(),
            rods: Vec::new(),
            holds: Vec::new(),
            joints: Vec::new(),
            barrier: None,
            hold: 1.0,
            bodies: given.carriers.len(),
            freedoms: Freedoms::Space,
            pattern: Arc::new(Pattern::new(0, &[])),
            damped: false,
            table,
            mesh,
        };
        for body in &given.carriers {
            made.sites.push(ElementSite {
                masses: vec![body.mass().clone()],
                turns: body.turns(),
                shifts: true,
            });
        }
        for (k, link) in given.links.iter().enumerate() {
            made.push_rod(k, &link.rod.given, &link.from, link.to.as_ref())?;
        }
        made.renew_pattern();
        if let Some(obstacles) = given.obstacles() {
            let lengths = made.rods.iter().map(|rod| rod.law().length());
            let (length, mass) = (lengths.sum(), made.mass());
            let rods = made.rods.iter();
            let elements = rods.flat_map(|rod| rod.elements.iter().map(|one| rod.length(one)));
            let longest = elements.fold(0.0, f64::max);
            let nodes = &made.table.nodes;
            let mut barrier = Barrier::new(obstacles.clone(), nodes, (mass, length), longest)?;
            barrier.joined = made.joined_ends(&barrier);
            made.barrier = Some(barrier);
        }
        made.damped = made.rods.iter().any(|rod| rod.law().is_damped());
        Ok(made)
    }

    /// Pairs of sites that forces join.
    fn renew_pattern(&mut self) {
        let clique = |nodes: &[ElementNode]| {
            let sites = nodes.iter().flat_map(|node| [node.shift, node.turn]);
            let mut clique: Vec<usize> = sites.filter_map(Carrier::site).collect();
            clique.sort_unstable();
            clique.dedup();
            clique
        };
        let mut cliques = Vec::new();
        for rod in &self.rods {
            let elements = rod.elements.iter();
            cliques.extend(elements.map(|element| clique(&rod.nodes[element.nodes.clone()])));
        }
        for joint in &self.joints {
            let carried = self.rods[joint.rod].nodes[joint.node].clone();
            cliques.push(clique(&[joint.holder.clone(), carried]));
        }
        cliques.extend(self.near_elements().iter().map(|pair| {
            let nodes = pair.iter().flat_map(|(rod, element)| {
                let rod = &self.rods[*rod];
                rod.nodes[rod.elements[*element].nodes.clone()].to_vec()
            });
            clique(&nodes.collect::<Vec<_>>())
        }));
        let holds = self.holds.iter();
        cliques.extend(holds.filter_map(|hold| Some(vec![hold.site, hold.carrier()?])));
        self.pattern = Arc::new(Pattern::new(self.sites.len(), &cliques));
    }

    fn push_rod(
        &mut self,
        number: usize,
        given: &RodDescription,
        from: &Tie,
        to: Option<&Tie>,
    ) -> Result<()> {
        let law = &given.law;
        if !law.branches().is_empty() {
            return Err(only_strains("Maxwell branches"));
        }
        let moves = given.grain.support().is_some_and(|clamp| !clamp.is_fixed());
        if moves && given.turning.is_some() {
            return Err(only_strains("loads that turn with a rod on a moving clamp"));
        }
        let degree = self.mesh.degree;
        let breaks = given.breaks();
        let ends: Vec<f64> = [0.0].iter().chain(&breaks).chain(&[1.0]).copied().collect();
        let counts = self.mesh.elements[number].clone();
        let mut elements = Vec::new();
        let mut places = vec![0.0];
        for (pair, count) in ends.windows(2).zip(counts) {
            for i in 0..count {
                let at = |i: usize| pair[0] + (pair[1] - pair[0]) * i as f64 / count as f64;
                let (from, to) = (at(i), at(i + 1));
                let first = places.len() - 1;
                let inner = self.table.nodes[1..].iter();
                places.extend(inner.map(|x| from + (to - from) * x));
                elements.push(RodElement {
                    nodes: first..first + degree + 1,
                    from,
                    to,
                });
            }
        }
        let (_, lobatto_weights) = lobatto(degree + 1);
        // A node between two elements has mass from both: the density may jump there.
        let mut parts = vec![Vec::with_capacity(2); places.len()];
        for element in &elements {
            let h = element.to - element.from;
            for (i, weight) in lobatto_weights.iter().enumerate() {
                let node = element.nodes.start + i;
                let inside = places[node].clamp(element.from + ASIDE * h, element.to - ASIDE * h);
                parts[node].push((inside, weight * h));
            }
        }
        let last = places.len() - 1;
        let mut nodes = Vec::with_capacity(places.len());
        let mut turning = Vec::new();
        let mut base = from.clone();
        base.on.place = given.curve.base(&base.on.place);
        for (i, parts) in parts.iter().enumerate() {
            let tie = match i {
                0 => Some(&base),
                _ if i == last => to,
                _ => None,
            };
            let weight: f64 = parts.iter().map(|(_, weight)| weight).sum();
            let piece = given.piece(parts, SLENDER * weight * law.length())?;
            let piece = piece.with_dead_force(given.force_at_place(places[i]))?;
            turning.extend(given.turning_on(parts, places[i]));
            nodes.push(match tie {
                None => self.free_node(piece),
                Some(tie) => {
                    let (holder, node) = self.tied_node(tie, &piece)?;
                    if !tie.axes.is_empty() {
                        let rod = (bending(law)?, law.length());
                        let joint = AxisJoint::new(holder, (number, i), &tie.axes, rod);
                        self.joints.push(joint);
                    }
                    node
                }
            });
            if let (true, Some(body)) = (i == last, &given.body) {
                self.sites[nodes[i].site()].masses.push(body.clone());
            }
        }
        let springs = self.springs(law)?;
        self.rods.push(ElementRod {
            given: given.clone(),
            elements,
            nodes,
            places,
            springs,
            turning,
            is_held: to.is_some(),
        });
        Ok(())
    }

    /// Springs of the strains that the law holds rigid.
    fn springs(&self, law: &Law) -> Result<Vec<(usize, f64)>> {
        let rigid: Vec<usize> = (0..6).filter(|k| !law.active().contains(k)).collect();
        if rigid.is_empty() {
            return Ok(Vec::new());
        }
        let bending = bending(law)?;
        let spring = |k: usize| match k {
            0..3 => bending / GIVE,
            _ => bending / (GIVE * law.length().powi(2)),
        };
        Ok(rigid.into_iter().map(|k| (k, spring(k))).collect())
    }

    /// A free node with a part of the rod's mass.
    fn free_node(&mut self, piece: RigidBody) -> ElementNode {
        let site = self.push_site(Mass::Rigid(piece), true, true);
        ElementNode {
            shift: site,
            turn: site,
            place: Isometry3::identity(),
            rotation: Turn::new(1.0, 0.0, 0.0, 0.0),
        }
    }

    /// The node of a rod end under a tie, after the node that would be welded there. `piece` is the node's part of the
    /// rod's mass. An end that slides has its position, one that turns its rotation as a site of its own.
    fn tied_node(&mut self, tie: &Tie, piece: &RigidBody) -> Result<(ElementNode, ElementNode)> {
        let place = tie.on.place;
        let turns = tie.is_turning();
        let slides = tie.axes.iter().any(|axis| !axis.turns);
        let carrier = match &tie.on.on {
            AttachedTo::Body(body) => {
                let turn = place.rotation.to_rotation_matrix();
                let inertia = turn.matrix() * piece.inertia() * turn.matrix().transpose();
                // Of a piece on a ball joint only the mass rides on the body.
                let inertia = if turns { inertia * 1e-6 } else { inertia };
                let at_point = place.translation.vector == Vector3::zeros() && turns;
                let riding = match (slides, at_point) {
                    (true, _) if turns => None,
                    (true, _) => Some(Mass::Rigid(RigidBody::new(SLIDING, inertia)?)),
                    (false, true) => Some(Mass::Point(piece.centre().clone())),
                    (false, false) => Some(Mass::Rigid(
                        RigidBody::new(piece.mass(), inertia)?
                            .with_centre(place.translation.vector)?
                            .with_dead_force(*piece.centre().constant())?,
                    )),
                };
                self.sites[*body].masses.extend(riding);
                Carrier::Site(*body)
            }
            ground => {
                let support = match ground {
                    AttachedTo::Support(support) => Some(support.clone()),
                    _ => None,
                };
                let riding = if !slides {
                    Some(Mass::Rigid(piece.clone()))
                } else if turns {
                    None
                } else {
                    Some(Mass::Rigid(RigidBody::new(SLIDING, *piece.inertia())?))
                };
                self.grounds.push(ElementGround {
                    support,
                    riding,
                    place,
                });
                Carrier::Ground(self.grounds.len() - 1)
            }
        };
        let p = place.rotation.quaternion();
        let holder = ElementNode {
            shift: carrier,
            turn: carrier,
            place,
            rotation: Turn::new(p.w, p.i, p.j, p.k),
        };
        let mut node = holder.clone();
        if turns || slides {
            let mass = if turns {
                Mass::Rigid(piece.clone())
            } else {
                Mass::Point(piece.centre().clone())
            };
            let site = self.push_site(mass, turns, slides);
            if turns {
                node.turn = site;
                node.rotation = Turn::new(1.0, 0.0, 0.0, 0.0);
            }
            if slides {
                node.shift = site;
                node.place = Isometry3::identity();
            }
        }
        Ok((holder, node))
    }

    fn push_site(&mut self, mass: Mass, turns: bool, shifts: bool) -> Carrier {
        self.sites.push(ElementSite {
            masses: vec![mass],
            turns,
            shifts,
        });
        Carrier::Site(self.sites.len() - 1)
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Motions that the state can make.
    pub fn freedoms(&self) -> Freedoms {
        self.freedoms
    }

    /// Restricts the motion to a plane, or lifts the restriction.
    #[must_use]
    pub fn with_freedoms(mut self, freedoms: Freedoms) -> Self {
        self.freedoms = freedoms;
        self
    }

    /// Adds springs in place of constraints.
    #[must_use]
    fn with_holds(mut self, holds: Vec<Hold>) -> Self {
        self.holds = holds;
        self.renew_pattern();
        self
    }

    /// Stiffness of all springs over that of the first ones.
    pub fn hold(&self) -> f64 {
        self.hold
    }

    /// Sets [`ElementAssembly::hold`].
    #[must_use]
    pub fn with_hold(mut self, hold: f64) -> Self {
        let factor = hold / self.hold;
        let springs = self.rods.iter_mut().flat_map(|rod| &mut rod.springs);
        springs.for_each(|(_, spring)| *spring *= factor);
        let joints = self.joints.iter_mut();
        joints.for_each(|joint| joint.stiffen(factor));
        self.hold = hold;
        self
    }

    /// Number of nodes of the rod that has most.
    pub fn most_nodes(&self) -> usize {
        self.rods
            .iter()
            .map(|rod| rod.nodes.len())
            .max()
            .unwrap_or(0)
    }

    /// Number of things that move by themselves.
    pub fn sites(&self) -> usize {
        self.sites.len()
    }

    /// Mass of all that moves.
    fn mass(&self) -> f64 {
        let masses = self.sites.iter().flat_map(|site| &site.masses);
        masses.map(Mass::mass).sum()
    }

    /// True if springs hold rigid strains, or joints with axes.
    pub fn has_springs(&self) -> bool {
        !self.joints.is_empty() || self.rods.iter().any(|rod| !rod.springs.is_empty())
    }

    /// Number of rods.
    pub fn rods(&self) -> usize {
        self.rods.len()
    }

    /// Length of rod `k`.
    pub fn length(&self, k: usize) -> f64 {
        self.rods[k].law().length()
    }

    /// Places of the nodes of rod `k`, in parts of it.
    pub fn places(&self, k: usize) -> &[f64] {
        &self.rods[k].places
    }

    /// First time after `t` at which a load or the motion of a clamp is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        let masses = self.sites.iter().flat_map(|site| &site.masses);
        let supports = self
            .grounds
            .iter()
            .filter_map(|ground| ground.support.as_ref());
        masses
            .map(|mass| mass.next_break(t))
            .chain(supports.map(|support| support.next_break(t)))
            .chain(self.rods.iter().map(|rod| rod.law().next_break(t)))
            .fold(f64::INFINITY, f64::min)
    }

    /// True if the end of rod `k` turns freely on its attachment.
    fn turns_at_end(&self, k: usize) -> bool {
        let last = self.rods[k].nodes.last();
        last.is_some_and(|node| node.turn != node.shift)
    }

    /// Sites of the nodes of the rods' own, given by motions of all nodes rod by rod and of the listed bodies.
    fn of_nodes(&self, bodies: &[BodyMotion], rods: &[Vec<BodyMotion>]) -> Vec<BodyMotion> {
        let mut sites = vec![BodyMotion::at_rest(Isometry3::identity()); self.sites.len()];
        sites[..bodies.len()].copy_from_slice(bodies);
        for (rod, motions) in self.rods.iter().zip(rods) {
            for (node, motion) in rod.nodes.iter().zip(motions) {
                let own = [node.turn, node.shift].into_iter();
                for site in own.filter_map(Carrier::site) {
                    if site >= self.bodies {
                        sites[site] = *motion;
                    }
                }
            }
        }
        sites
    }
}

/// Largest bending or torsional stiffness of a law at the base, unloaded.
fn bending(law: &Law) -> Result<f64> {
    let rest = law.unloaded(0.0)?;
    let stiffness = law.stiffness(0.0, &rest, &crate::section::Strain::zeros());
    let stiffness = stiffness.ok_or_else(|| only_strains("a law without a stiffness at rest"))?;
    let each = (0..3).map(|k| stiffness.by_strain[(k, k)]);
    Ok(each.fold(0.0, f64::max))
}

impl Carrier {
    fn site(self) -> Option<usize> {
        match self {
            Self::Site(site) => Some(site),
            Self::Ground(_) => None,
        }
    }
}

impl ElementNode {
    /// The site of a node of the rod's own.
    fn site(&self) -> usize {
        self.turn.site().unwrap_or(0)
    }

    /// Rotation of the node on a carrier with the rotation `carrier`.
    fn turned(&self, carrier: &Turn) -> Turn {
        product(carrier, &self.rotation)
    }
}
