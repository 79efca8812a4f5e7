//! Flux of volume and momentum between two states of the flow.

use super::{FlowLaw, FlowState, FlowTube, Place};
use snaprod_core::{Error, Result};
use snaprod_waves::law1d::Law1d;

/// Largest jump of the area, relative, and of the velocity over the speed of waves, for which mean speeds suffice.
const WEAK: f64 = 0.05;
/// Largest relative jump across a bend of the law for which bounds of the speeds suffice.
const FAINT: f64 = 1e-2;
/// Relative distance from a bend at which the speed beside the bend is taken.
const BESIDE: f64 = 1e-9;

/// Flow of volume, and of momentum over the density.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Flux {
    pub volume: f64,
    pub momentum: f64,
}

/// A state of the flow with the numbers that the flux needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sided {
    pub area: f64,
    pub flow: f64,
    pub velocity: f64,
    pub speed: f64,
    pub flux: Flux,
}

impl FlowTube {
    /// The state of the area `area` A and the flow `flow` at a place.
    #[inline]
    pub(super) fn sided(&self, place: &Place, area: f64, flow: f64) -> Sided {
        let alpha = area / place.area;
        let wall = self.law.at(alpha);
        let unit = place.stiffness / self.density;
        let velocity = flow / area;
        Sided {
            area,
            flow,
            velocity,
            speed: (unit * alpha * wall.slope).sqrt(),
            flux: Flux {
                volume: flow,
                momentum: flow * velocity + place.area * unit * wall.thrust(alpha),
            },
        }
    }

    /// The flux between two states at a place, and the greatest speed of a wave.
    ///
    /// Between weak jumps the speeds of the states bound those of the waves (HLL). Across a bend of the law they do
    /// not, and the scheme would converge to jumps that are not admissible: the Riemann problem is solved exactly
    /// there, and at strong jumps. Across faint jumps the speeds beside the bend are bounds.
    ///
    /// # Errors
    /// A Riemann problem without a solution.
    #[inline]
    pub(super) fn flux(&self, place: &Place, left: &Sided, right: &Sided) -> Result<(Flux, f64)> {
        let mut low = (left.velocity - left.speed).min(right.velocity - right.speed);
        let mut high = (left.velocity + left.speed).max(right.velocity + right.speed);
        let middle =
            (high * right.area - low * left.area - (right.flow - left.flow)) / (high - low);
        let jump = ((right.velocity - left.velocity).abs() / left.speed.min(right.speed))
            .max((right.area - left.area).abs() / left.area);
        let bent = self.bent(place, [left.area, right.area, middle]);
        if !(jump <= WEAK && middle > 0.0) || bent && jump > FAINT {
            return self.exact_flux(place, left, right);
        }
        if bent {
            let speed = self.fastest_beside(
                place,
                left.area.min(right.area).min(middle),
                left.area.max(right.area).max(middle),
            );
            low = left.velocity.min(right.velocity) - speed;
            high = left.velocity.max(right.velocity) + speed;
        }
        let top = high.abs().max(low.abs());
        if low >= 0.0 {
            return Ok((left.flux, top));
        }
        if high <= 0.0 {
            return Ok((right.flux, top));
        }
        let mixed =
            |l: f64, r: f64, jump: f64| (high * l - low * r + low * high * jump) / (high - low);
        let flux = Flux {
            volume: mixed(left.flux.volume, right.flux.volume, right.area - left.area),
            momentum: mixed(
                left.flux.momentum,
                right.flux.momentum,
                right.flow - left.flow,
            ),
        };
        Ok((flux, top))
    }

    /// True if a bend of the law lies between the areas.
    #[inline]
    pub(super) fn bent(&self, place: &Place, areas: [f64; 3]) -> bool {
        let bends = self.law.bends();
        if bends.is_empty() {
            return false;
        }
        let least = areas
            .iter()
            .fold(f64::INFINITY, |least, area| least.min(*area));
        let most = areas.iter().fold(0.0, |most: f64, area| most.max(*area));
        let (low, high) = (place.area / most, place.area / least);
        bends.iter().any(|bend| low <= *bend && *bend <= high)
    }

    /// The greatest speed of waves between two areas, on both sides of every bend there.
    fn fastest_beside(&self, place: &Place, least: f64, most: f64) -> f64 {
        let (low, high) = (place.area / most, place.area / least);
        let inner = self
            .law
            .bends()
            .iter()
            .filter(|bend| low <= **bend && **bend <= high);
        let beside = inner.flat_map(|bend| [1.0 - BESIDE, 1.0 + BESIDE].map(|part| bend * part));
        let speeds = beside
            .chain([low, high])
            .map(|lam| self.law.speed(lam) * lam);
        speeds.filter(|speed| speed.is_finite()).fold(0.0, f64::max) * self.unit_speed(place)
    }

    fn exact_flux(&self, place: &Place, left: &Sided, right: &Sided) -> Result<(Flux, f64)> {
        let unit = self.unit_speed(place);
        let state = |side: &Sided| FlowState {
            area: side.area / place.area,
            velocity: side.velocity / unit,
        };
        let star = self.law.riemann(state(left), state(right))?;
        let at = self.law.sample(&star, 0.0);
        let waves = star.left.iter().chain(&star.right);
        let waves = waves.map(|wave| wave.head.abs().max(wave.tail.abs()));
        let resting = [left, right].map(|side| (side.velocity.abs() + side.speed) / unit);
        let top = waves.fold(resting[0].max(resting[1]), f64::max);
        let found = self.sided(
            place,
            at.area * place.area,
            at.area * at.velocity * place.area * unit,
        );
        Ok((found.flux, top * unit))
    }
}

impl FlowLaw {
    /// An error with the place where it arose.
    pub(super) fn at_place(error: &Error, x: f64) -> Error {
        Error::unreachable(format!("at x = {x}: {error}"))
    }
}
