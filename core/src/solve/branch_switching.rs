//! Branch switching: starts on the other branches through a branch point.

use super::arclength::{BranchStart, Options};
use super::elimination::{Place, Svd};
use super::newton_on_branch::{DirectedPlace, Finish, Space};
use super::parametrised_problem::{Family, check_size};
use super::special_points::Special;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// Method that found the directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SwitchMethod {
    /// The algebraic bifurcation equation: both tangents of a simple branch point.
    Quadratic,
    /// Solutions on a small circle or sphere in the kernel, by Newton from many samples. Directions
    /// may be missing.
    Sampled,
}

/// Starts on the other branches through a branch point.
#[derive(Debug, Clone, PartialEq)]
pub struct Switch {
    /// Starts on the branches, pointing away from the branch point: two for each branch.
    pub starts: Vec<BranchStart>,
    /// Method that found the directions.
    pub method: SwitchMethod,
    /// Dimension of the kernel of [F_x F_p], less one: 1 at a simple branch point.
    pub corank: usize,
    /// Remarks for the caller: continuous families, possible gaps.
    pub remarks: Vec<String>,
    /// Reasons, one for each tangent of a branch along which no solution was found.
    pub lost: Vec<String>,
    /// Evaluations of F.
    pub evaluations: usize,
}

/// Starts on the other branches through a located branch point (or a stability change of higher multiplicity), at
/// about `distance` (> 0, in the units of arclength) from it.
///
/// At a simple branch point both tangents solve the algebraic bifurcation equation, its second derivatives taken by
/// differences of the Jacobian. If this equation is degenerate, and at a higher corank, solutions on a circle
/// (sphere) of this radius in the kernel are sought from samples.
///
/// # Errors
/// Options or `distance` outside their sets; no branch point at the place; F undefined nearby.
pub fn switch(
    family: &dyn Family,
    special: &Special,
    distance: f64,
    options: &Options,
) -> Result<Switch> {
    options.check()?;
    if !(0.0 < distance && distance < f64::INFINITY) {
        return Err(Error::domain(format!(
            "branch switching: distance = {distance} must be positive"
        )));
    }
    check_size(family, "the branch point", &special.point.x)?;
    let weight = options.rounded_weight();
    let space = Space::new(family, weight, options.tolerance, 10);
    let DirectedPlace { place, tangent } = special.place_and_tangent(weight);
    let undefined = || {
        Error::no_convergence(format!(
            "branch switching at p = {}: F is undefined nearby",
            special.point.p
        ))
    };
    let n = place.x.len();
    let (matrix, _) = space.matrix(&place).ok_or_else(undefined)?;
    let svd = Svd::new(&matrix);
    // All of [F_x F_p] may vanish at the point: its usual size is taken a little farther on.
    let usual = space
        .matrix(&(&place + &tangent * distance))
        .map_or(0.0, |(beside, _)| Svd::new(&beside).values[0]);
    let small = usual.max(svd.values[0]) * (100.0 * special.error_s / distance).clamp(1e-6, 1e-2);
    let corank = (0..n).filter(|&k| !(svd.values[k] > small)).count();
    if corank == 0 {
        return Err(Error::domain(format!(
            "branch switching at p = {}: no branch point, the least singular value of [F_x F_p] is {:e} of the largest",
            special.point.p,
            svd.values[n - 1] / usual.max(svd.values[0])
        )));
    }
    let kernel: Vec<Place> = (n - corank..=n)
        .map(|k| Place::from_slice(svd.right.column(k).as_slice()))
        .collect();
    let known = project_onto(&kernel, &tangent);
    let mut this = Switch {
        starts: Vec::new(),
        method: SwitchMethod::Quadratic,
        corank,
        remarks: Vec::new(),
        lost: Vec::new(),
        evaluations: 0,
    };
    let quadratic = if corank == 1 {
        let left = svd.left.column(n - 1).into_owned();
        other_tangent(&space, &place, &kernel, &left, &known).ok_or_else(undefined)?
    } else {
        None
    };
    if let Some(other) = quadratic {
        this.follow_tangent(&space, &place, &other, distance);
    } else {
        this.method = SwitchMethod::Sampled;
        this.sample(&space, &place, &kernel, &known, distance);
    }
    this.evaluations = space.evaluations.get();
    Ok(this)
}

/// The part of `v` within the span, of unit length.
fn project_onto(kernel: &[Place], v: &Place) -> Place {
    kernel
        .iter()
        .map(|k| k * k.dot(v))
        .reduce(|a, b| a + b)
        .unwrap_or_else(|| v.clone())
        .unit()
}

/// The second root of a11 c^2 + 2 a12 c s + a22 s^2 = 0 for the direction c v1 + s v2, with a_ij = left . D^2 F
/// [v_i, v_j]. None inside if the form has no two distinct real roots; None outside if F is
/// undefined.
fn other_tangent(
    space: &Space<'_>,
    place: &Place,
    kernel: &[Place],
    left: &DVector<f64>,
    known: &Place,
) -> Option<Option<Place>> {
    let column = |v: &Place| {
        DVector::from_iterator(
            v.x.len() + 1,
            v.x.iter().copied().chain(std::iter::once(v.p)),
        )
    };
    let mut a = DMatrix::zeros(2, 2);
    for i in 0..2 {
        let row = left.transpose() * space.bend_along(place, &kernel[i])?;
        for j in 0..2 {
            a[(i, j)] = (&row * column(&kernel[j]))[0];
        }
    }
    let (a11, a12, a22) = (a[(0, 0)], 0.5 * (a[(0, 1)] + a[(1, 0)]), a[(1, 1)]);
    let discriminant = a12 * a12 - a11 * a22;
    let size = a11.abs().max(a12.abs()).max(a22.abs());
    if !(size > 1e-5 && discriminant > 1e-5 * size * size) {
        return Some(None);
    }
    let q = a12 + discriminant.sqrt().copysign(a12);
    let roots = [(-q, a11), (-a22, q)].map(|(c, s)| (&kernel[0] * c + &kernel[1] * s).unit());
    let aligned = |root: &Place| root.dot(known).abs();
    let [first, second] = roots;
    Some(Some(if aligned(&first) > aligned(&second) {
        second
    } else {
        first
    }))
}

impl Switch {
    fn add(&mut self, weight: f64, place: &Place, direction: &Place) {
        self.starts.push(BranchStart {
            x: place.x.clone(),
            p: place.p / weight,
            direction_x: direction.x.clone(),
            direction_p: direction.p / weight,
        });
    }

    /// Starts both ways along a tangent, nearer if the branch bends too fast.
    fn follow_tangent(&mut self, space: &Space<'_>, place: &Place, tangent: &Place, distance: f64) {
        for way in [1.0, -1.0] {
            let direction = tangent * way;
            let found = (0..6).find_map(|k| {
                let reach = distance * 0.4_f64.powi(k);
                let guess = place + &direction * reach;
                let finish = Finish::Evaluated;
                space.correct(&guess, &direction, 0.5 * reach, finish).ok()
            });
            match found {
                Some(on) => self.add(space.weight, &on.place, &on.tangent),
                None => self.lost.push(format!(
                    "no solution was found along a tangent with dp/ds = {:.3e}; a smaller distance may help",
                    direction.p
                )),
            }
        }
    }

    /// Solutions z with |K (z - place)| = radius, K projecting on the kernel.
    fn sample(
        &mut self,
        space: &Space<'_>,
        place: &Place,
        kernel: &[Place],
        known: &Place,
        radius: f64,
    ) {
        let mut found: Vec<(Place, Place)> = Vec::new();
        let mut singular = 0;
        for sample in samples(kernel) {
            let guess = place + sample * radius;
            let Some((z, tangent, isolated)) = on_sphere(space, place, kernel, guess, radius)
            else {
                continue;
            };
            let away = project_onto(kernel, &(&z - place));
            let old = away.dot(known).abs() > 1.0 - 1e-3;
            let again = found.iter().any(|(f, _)| (f - &z).norm() < 1e-2 * radius);
            if old || again {
                continue;
            }
            singular += usize::from(!isolated);
            found.push((
                z,
                if isolated {
                    tangent.towards(&away)
                } else {
                    away
                },
            ));
        }
        const MOST: usize = 16;
        if singular > 0 {
            self.remarks.push(format!(
                "{singular} of {} solutions are not isolated: the branches form a continuous family, as under a continuous symmetry; \
                 at most {MOST} of its members are tried",
                found.len()
            ));
        }
        self.remarks.push(format!(
            "directions come from {} samples of the kernel's sphere of dimension {}: some may be missing",
            samples(kernel).len(),
            kernel.len() - 1
        ));
        for (z, direction) in found.iter().take(MOST) {
            self.add(space.weight, z, direction);
        }
    }
}

/// Directions spread over the unit sphere of the kernel, to both sides (on a circle each with its opposite).
fn samples(kernel: &[Place]) -> Vec<Place> {
    match kernel {
        [u, v] => (0..32)
            .map(|k| TAU * (f64::from(k) + 0.25) / 32.0)
            .map(|a| u * a.cos() + v * a.sin())
            .collect(),
        [u, v, rest @ ..] => {
            // A spiral over the sphere of the first three; the others are taken in turn as the pole.
            let golden = PI * (3.0 - 5.0_f64.sqrt());
            let count = 80;
            rest.iter()
                .flat_map(|w| {
                    (0..count).map(move |k| {
                        let height = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
                        let ring = (1.0 - height * height).sqrt();
                        let a = golden * f64::from(k);
                        u * (ring * a.cos()) + v * (ring * a.sin()) + w * height
                    })
                })
                .collect()
        }
        _ => Vec::new(),
    }
}

/// Newton on F = 0, |K (z - centre)| = radius: (z, tangent, whether the solution is isolated).
fn on_sphere(
    space: &Space<'_>,
    centre: &Place,
    kernel: &[Place],
    mut z: Place,
    radius: f64,
) -> Option<(Place, Place, bool)> {
    let mut before = f64::INFINITY;
    for _ in 0..25 {
        let (residual, eliminated) = space.evaluate(&z).ok()?;
        let (null, _) = eliminated.null();
        let offset = &z - centre;
        let inside = kernel
            .iter()
            .map(|k| k * k.dot(&offset))
            .reduce(|a, b| a + b)?;
        let excess = inside.norm() - radius;
        let normal = inside.unit();
        let slant = normal.dot(&null);
        let any = eliminated.solve(&-&residual);
        // Parallel to the sphere: the solution is one of a family; take the least correction.
        let isolated = slant.abs() > 1e-4 && eliminated.regularity() > 1e-6;
        let step = if slant.abs() > 1e-8 {
            let slide = (excess + normal.dot(&any)) / slant;
            any - &null * slide
        } else {
            let slide = null.dot(&any);
            any - &null * slide
        };
        let length = step.norm();
        if !length.is_finite() {
            return None;
        }
        let moved = &z + step * (0.4 * radius / length).min(1.0);
        let at = std::mem::replace(&mut z, moved);
        if (&z - centre).norm() > 4.0 * radius {
            return None;
        }
        let rounded = || {
            let across = if isolated { &normal } else { &null };
            length > 0.5 * before && space.is_rounding(length, &at, &residual, &eliminated, across)
        };
        if length <= space.tolerance * (1.0 + z.norm()) || rounded() {
            return Some((z, null, isolated));
        }
        before = length;
    }
    None
}
