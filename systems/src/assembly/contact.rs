//! Self-contact of a rod and contact between rods (theory 3.7).
//!
//! Rods touch if two centrelines come within the mean of their contact diameters, at a pair of points that is a local
//! minimum of the distance: both tangents are across the connecting vector, or a point is an end. Neighbours on one
//! rod are no such pair as long as the rod is nowhere bent to a radius below half its diameter.

use super::attachment::{AttachedTo, Attachment};
use super::body::Body;
use super::configuration::Configuration;
use super::network::Assembly;
use super::rod_element::Link;
use crate::error::{Error, Message, Quantity};
use crate::rod::{RodSection, Wrench};
use nalgebra::{Isometry3, Matrix2, Vector2, Vector3};

/// Tolerances of the centrelines: in the search for contacts, and at a contact found.
const COARSE: f64 = 1e-6;
const FINE: f64 = 1e-12;
/// Approximate number of sample points on a rod with which the search begins.
const PLACES: usize = 48;
/// Sample points on a taut rod, which is bent little, between which its centreline is interpolated.
const TAUT: usize = 17;
/// Sample points for the motion of a rod.
const MARKS: usize = 9;
/// Newton steps to the nearest pair.
const STEPS: usize = 30;
/// Fall of half the squared distance in one more step, over the square of the lengths, at which a pair is nearest.
const SETTLED: f64 = 1e-14;
/// Intervals into which a rod with an exact centreline is divided.
const TRACED: usize = 64;
/// Gap below which pairs are near, in distances between sample points.
const REACH: f64 = 2.0;
/// Gaps smaller than this, in rod lengths, are evaluated on the fine centrelines.
const NEAR: f64 = 1e-2;

/// Closest pair of points of two rods, or of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Numbers of the two rods; equal for self-contact.
    pub rods: [usize; 2],
    /// Arclengths from their bases, in the unloaded rods.
    pub at: [f64; 2],
    /// Distance less the mean of the diameters.
    pub gap: f64,
}

/// Closest approach of rods at a state.
#[derive(Debug, Clone)]
pub struct Nearness {
    /// Closest pair, if any is near.
    pub contact: Option<Contact>,
    /// Lower bound of the gaps of all pairs that are not near.
    beyond: f64,
    marks: Vec<Vector3<f64>>,
}

impl Default for Nearness {
    fn default() -> Self {
        Self {
            contact: None,
            beyond: f64::INFINITY,
            marks: Vec::new(),
        }
    }
}

impl Nearness {
    /// Gap of the closest pair; infinite if none is near.
    pub fn gap(&self) -> f64 {
        self.contact.map_or(f64::INFINITY, |contact| contact.gap)
    }

    /// Lower bound of the gap of every pair.
    pub fn least_gap(&self) -> f64 {
        self.gap().min(self.beyond)
    }

    /// Largest displacement of a sample point of a rod between two states.
    pub fn moved(&self, to: &Self) -> f64 {
        let pairs = self.marks.iter().zip(&to.marks);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }
}

/// r, r_s, r_ss.
type Jet = [Vector3<f64>; 3];

/// Centreline of a rod with a contact diameter.
pub struct Tube<'a> {
    rod: usize,
    diameter: f64,
    /// Carrier of the base, and of the end if that is held.
    held: Vec<&'a AttachedTo>,
    curve: Centreline,
    /// Exact centreline at an arclength.
    exact: Box<dyn Fn(f64) -> Option<Jet> + 'a>,
}

impl<'a> Tube<'a> {
    /// The rod of this number. `exact` gives r, r_s, r_ss at any arclength up to `length`; None if it has no shape.
    pub fn new(
        rod: usize,
        diameter: f64,
        held: Vec<&'a AttachedTo>,
        length: f64,
        exact: impl Fn(f64) -> Option<Jet> + 'a,
    ) -> Option<Self> {
        let knots = (0..=TRACED).map(|k| length * k as f64 / TRACED as f64);
        let knots: Vec<f64> = knots.collect();
        let jets = knots.iter().map(|s| exact(*s));
        let jets = jets.collect::<Option<Vec<Jet>>>()?;
        Some(Self {
            rod,
            diameter,
            held,
            curve: Centreline::through(knots, jets),
            exact: Box::new(exact),
        })
    }

    /// Carrier of the end at the arclength `s`; None for an inner point or a free end.
    fn holder(&self, s: f64) -> Option<&AttachedTo> {
        let ends = [0.0, self.curve.length()];
        let end = ends.iter().position(|end| *end == s)?;
        self.held.get(end).copied()
    }
}

/// True for two ends on one holder. Such ends may be close, and no contact is sought between the two.
fn are_joined([one, other]: [&Tube<'_>; 2], at: [f64; 2]) -> bool {
    let holders = one.holder(at[0]).zip(other.holder(at[1]));
    holders.is_some_and(|(a, b)| a.moves_with(b))
}

impl Nearness {
    /// Closest approach of the rods of an assembly with a contact diameter to themselves and to each other.
    pub fn at(assembly: &Assembly, t: f64, now: &Configuration) -> Self {
        Self::of(&tubes(assembly, t, now, None))
    }

    /// Closest approach of rods to themselves and to each other.
    pub fn of(tubes: &[Tube<'_>]) -> Self {
        let mut found = Self::default();
        for (i, one) in tubes.iter().enumerate() {
            let length = one.curve.length();
            let marks = (0..MARKS).map(|k| length * k as f64 / (MARKS - 1) as f64);
            found.marks.extend(marks.map(|s| one.curve.at(s)[0]));
            for other in &tubes[i..] {
                let spacing = one.curve.spacing().max(other.curve.spacing());
                found.beyond = found.beyond.min(REACH * spacing);
                let near = nearest_of([one, other]);
                let near = near.and_then(|contact| {
                    if contact.gap < NEAR * length {
                        contact.between([one, other])
                    } else {
                        Some(contact)
                    }
                });
                if near.is_some_and(|contact| contact.gap < found.gap()) {
                    found.contact = near;
                }
            }
        }
        found
    }
}

impl Contact {
    /// This contact in the present state, by exact centrelines from the last arclengths; None if it is lost.
    pub fn now(&self, tubes: &[Tube<'_>]) -> Option<Self> {
        let tube = |rod: usize| tubes.iter().find(|tube| tube.rod == rod);
        self.between([tube(self.rods[0])?, tube(self.rods[1])?])
    }

    /// The contact in a configuration of the assembly; None if lost.
    pub fn at(&self, assembly: &Assembly, t: f64, now: &Configuration) -> Option<Self> {
        self.now(&tubes(assembly, t, now, Some(self)))
    }

    /// Error for a start in which rods overlap; `name` labels a rod in messages.
    pub fn at_start(&self, name: impl Fn(usize) -> String) -> Error {
        let ([a, b], [s, at]) = (self.rods.map(name), self.at);
        let pair = Message::from(format!("{a} at s = "))
            .number(s, Quantity::Length)
            .words(format!(" and {b} at s = "))
            .number(at, Quantity::Length);
        Error::domain(pair.words(
            " are nearer to each other at the start than their contact diameters, by "
        )
        .number(-self.gap, Quantity::Length)
        .words(
            ": start elsewhere, or, where that does not matter, set contact_diameter = 0 in the rod",
        ))
    }

    fn between(&self, [a, b]: [&Tube<'_>; 2]) -> Option<Self> {
        let lengths = [a.curve.length(), b.curve.length()];
        let (at, distance) = nearest(self.at, lengths, |s| {
            Some([(a.exact)(s[0])?, (b.exact)(s[1])?])
        })?;
        (!are_joined([a, b], at)).then_some(Self {
            at,
            gap: distance - 0.5 * (a.diameter + b.diameter),
            ..*self
        })
    }
}

/// Centreline in pieces of degree 5 between the steps of an integration.
struct Centreline {
    knots: Vec<f64>,
    jets: Vec<Jet>,
    places: Vec<f64>,
    points: Vec<Vector3<f64>>,
}

impl Centreline {
    fn new(sections: &[RodSection], base: &Isometry3<f64>) -> Self {
        Self::through(
            sections.iter().map(|section| section.s).collect(),
            sections.iter().map(|section| jet(section, base)).collect(),
        )
    }

    fn through(knots: Vec<f64>, jets: Vec<Jet>) -> Self {
        let each = PLACES.div_ceil(knots.len().max(2) - 1);
        let mut curve = Self {
            knots,
            jets,
            places: Vec::new(),
            points: Vec::new(),
        };
        for pair in curve.knots.windows(2) {
            let inside = (0..each).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / each as f64);
            curve.places.extend(inside);
        }
        curve.places.extend(curve.knots.last());
        curve.points = curve.places.iter().map(|s| curve.at(*s)[0]).collect();
        curve
    }

    fn at(&self, s: f64) -> Jet {
        let k = self.knots.partition_point(|knot| *knot <= s);
        let k = k.clamp(1, self.knots.len() - 1) - 1;
        let h = self.knots[k + 1] - self.knots[k];
        let u = (s - self.knots[k]) / h;
        let ([r0, d0, e0], [r1, d1, e1]) = (self.jets[k], self.jets[k + 1]);
        let (d0, e0, d1, e1, rise) = (d0 * h, e0 * (h * h), d1 * h, e1 * (h * h), r1 - r0);
        let c3 = rise * 10.0 - d0 * 6.0 - d1 * 4.0 - e0 * 1.5 + e1 * 0.5;
        let c4 = rise * -15.0 + d0 * 8.0 + d1 * 7.0 + e0 * 1.5 - e1;
        let c5 = rise * 6.0 - (d0 + d1) * 3.0 - (e0 - e1) * 0.5;
        [
            r0 + (d0 + (e0 * 0.5 + (c3 + (c4 + c5 * u) * u) * u) * u) * u,
            (d0 + (e0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * u)) * u) * u) * u) / h,
            (e0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * u)) * u) * u) / (h * h),
        ]
    }

    fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// Largest distance between two neighbouring points.
    fn spacing(&self) -> f64 {
        let pairs = self.points.windows(2);
        pairs
            .map(|pair| (pair[1] - pair[0]).norm())
            .fold(0.0, f64::max)
    }
}

/// Centreline at a section. Along the directors, r_s and r_ss are v and u x v, if the strains v hardly change.
fn jet(section: &RodSection, base: &Isometry3<f64>) -> Jet {
    let e = section.strain;
    let (u, v) = (
        Vector3::new(e[0], e[1], e[2]),
        Vector3::new(e[3], e[4], e[5]),
    );
    let turn = base.rotation.to_rotation_matrix();
    let along = |x: Vector3<f64>| turn * (section.directors * x);
    let r = base.translation.vector + turn * section.position;
    [r, along(v), along(u.cross(&v))]
}

/// Closest pair of points of two curves, of lengths `lengths`, from `start`, with the distance; None if a curve has no
/// shape there, or if no pair is found.
fn nearest(
    start: [f64; 2],
    lengths: [f64; 2],
    mut jets: impl FnMut([f64; 2]) -> Option<[Jet; 2]>,
) -> Option<([f64; 2], f64)> {
    let size = lengths[0] + lengths[1];
    let mut s = Vector2::from(start);
    let mut step = Vector2::zeros();
    let mut before: Option<(Vector2<f64>, f64)> = None;
    let mut settled = false;
    for _ in 0..STEPS {
        let [[a, a1, a2], [b, b1, b2]] = jets([s.x, s.y])?;
        let way = b - a;
        let distance = way.norm();
        if let Some((last, nearer)) = before
            && !settled
            && distance >= nearer
        {
            // The step was too long, as it is across the valley of two parallel rods.
            step *= 0.5;
            s = moved(&last, &step, lengths);
            continue;
        }
        let gradient = Vector2::new(-way.dot(&a1), way.dot(&b1));
        let mixed = -a1.dot(&b1);
        let mut hessian = Matrix2::new(
            a1.norm_squared() - way.dot(&a2),
            mixed,
            mixed,
            b1.norm_squared() + way.dot(&b2),
        );
        // A coordinate at an end is fixed if descent leads past the end.
        let mut free = gradient;
        for i in 0..2 {
            let over =
                (s[i] <= 0.0 && gradient[i] > 0.0) || (s[i] >= lengths[i] && gradient[i] < 0.0);
            if over {
                free[i] = 0.0;
                hessian[(i, 1 - i)] = 0.0;
                hessian[(1 - i, i)] = 0.0;
            }
        }
        step = match hessian.cholesky() {
            Some(factors) => factors.solve(&free),
            // Not convex here: go downhill.
            None => Vector2::new(free.x / a1.norm_squared(), free.y / b1.norm_squared()),
        };
        // At most a tenth of the length at once: the pair next to the start is sought.
        let most = 0.1 * lengths[0].min(lengths[1]);
        step *= most / step.norm().max(most);
        let next = moved(&s, &step, lengths);
        settled = free.dot(&step) <= SETTLED * size * size;
        before = Some((s, distance));
        let way = (next - s).norm();
        s = next;
        if way <= 1e-14 * size {
            break;
        }
    }
    let (_, distance) = before?;
    (settled && distance.is_finite()).then_some(([s.x, s.y], distance))
}

/// A pair of arclengths after a step, within the rods.
fn moved(s: &Vector2<f64>, step: &Vector2<f64>, lengths: [f64; 2]) -> Vector2<f64> {
    Vector2::from_fn(|i, _| (s[i] - step[i]).clamp(0.0, lengths[i]))
}

/// Interpolated centreline of a rod of an assembly with this base, its end at `held` relative to the base.
fn traced(
    link: &Link,
    t: f64,
    [base, held]: &[Isometry3<f64>; 2],
    q: &Wrench,
) -> Option<Centreline> {
    let link = link.seen_at(t, &base.rotation).ok()?;
    let sections = if link.is_taut(q, held) || link.is_loaded() {
        let at = (0..TAUT).map(|k| link.rod.length() * k as f64 / (TAUT - 1) as f64);
        link.shape(q, held, &at.collect::<Vec<f64>>(), COARSE)
    } else {
        link.rod.trace(&q.component_mul(&link.units()), COARSE)
    };
    Some(Centreline::new(&sections.ok()?, base))
}

/// Exact centreline of a rod of an assembly at an arclength.
fn exact(
    link: &Link,
    t: f64,
    [base, held]: &[Isometry3<f64>; 2],
    q: &Wrench,
    s: f64,
) -> Option<Jet> {
    let seen = link.seen_at(t, &base.rotation).ok()?;
    let sections = seen.shape(q, held, &[s], FINE).ok()?;
    Some(jet(sections.first()?, base))
}

/// Centrelines of the rods of an assembly that have a contact diameter, or of the rods of a contact.
fn tubes<'a>(
    assembly: &'a Assembly,
    t: f64,
    now: &'a Configuration,
    of: Option<&Contact>,
) -> Vec<Tube<'a>> {
    let all = assembly.links().iter().zip(&now.charts).enumerate();
    let tubes = all.filter_map(|(rod, (link, q))| {
        let diameter = link.diameter?;
        of.is_none_or(|contact| contact.rods.contains(&rod))
            .then_some(())?;
        let held = held_in(assembly, t, now, rod)?;
        Some(Tube {
            rod,
            diameter,
            held: vec![holder(assembly, &link.from), holder(assembly, &link.to)],
            curve: traced(link, t, &held, q)?,
            exact: Box::new(move |s| exact(link, t, &held, q, s)),
        })
    });
    tubes.collect()
}

/// Carrier of an attachment; for a joint with axes, the carrier of the joint.
fn holder<'a>(assembly: &'a Assembly, site: &'a Attachment) -> &'a AttachedTo {
    let node = site.carried_by().map(|node| &assembly.carriers()[node]);
    match node.and_then(Body::joint) {
        Some(guide) => &guide.on().on,
        None => &site.on,
    }
}

/// Base of rod `k` (between two ball joints turned along its chord), and pose of the end's attachment relative to the
/// base.
fn held_in(
    assembly: &Assembly,
    t: f64,
    now: &Configuration,
    k: usize,
) -> Option<[Isometry3<f64>; 2]> {
    let link = &assembly.links()[k];
    let [base, tip] = if link.is_pinned() {
        let point = assembly.placed(t, now, k, FINE).ok()?;
        [point.base.pose, point.tip.pose]
    } else {
        [&link.from, &link.to].map(|site| site.at(t, &now.bodies).pose)
    };
    Some([base, base.inv_mul(&tip)])
}

/// Closest pair of two centrelines, if it is near.
fn nearest_of([one, other]: [&Tube<'_>; 2]) -> Option<Contact> {
    let (a, b) = (&one.curve, &other.curve);
    let rods = [one.rod, other.rod];
    let thick = 0.5 * (one.diameter + other.diameter);
    let same = rods[0] == rods[1];
    let reach = thick + REACH * a.spacing().max(b.spacing());
    let (last_a, last_b) = (a.points.len() - 1, b.points.len() - 1);
    let square = |i: usize, j: usize| (a.points[i] - b.points[j]).norm_squared();
    let mut best: Option<Contact> = None;
    for i in 0..=last_a {
        for j in if same { i + 2 } else { 0 }..=last_b {
            let here = square(i, j);
            if !(here < reach * reach) {
                continue;
            }
            if are_joined([one, other], [a.places[i], b.places[j]]) {
                continue;
            }
            let rows = i.saturating_sub(1)..=(i + 1).min(last_a);
            let lowest = rows.into_iter().all(|k| {
                let columns = j.saturating_sub(1)..=(j + 1).min(last_b);
                columns.into_iter().all(|l| here <= square(k, l))
            });
            if !lowest {
                continue;
            }
            let start = [a.places[i], b.places[j]];
            let lengths = [a.length(), b.length()];
            let jets = |s: [f64; 2]| Some([a.at(s[0]), b.at(s[1])]);
            let Some((at, distance)) = nearest(start, lengths, jets) else {
                continue;
            };
            // Neighbours along one rod are not in contact.
            if same && at[1] - at[0] < thick || are_joined([one, other], at) {
                continue;
            }
            let gap = distance - thick;
            if best.as_ref().is_none_or(|best| gap < best.gap) {
                best = Some(Contact { rods, at, gap });
            }
        }
    }
    best
}
