//! Accelerations of an assembly, linearised at a stage of an implicit step with gaps between rods and attachments.
//!
//! The chart q of a rod is not a variable of such a step: it follows from the pose of the end, the less accurately
//! the stiffer the rod. Newton's iteration has both as unknowns. At a stage with a `gap` between end and attachment
//! the rod is brought there to first order, by J^-1 gap, and follows displacements of the bodies by J^-1 drive: the
//! tangents are known, and exact.

use super::network::Assembly;
use super::stiffness::{carried, lever_turned};
use crate::math::se3::halves;
use crate::rod::Wrench;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// Step of the differences that linearise the bodies' own laws.
const ASIDE: f64 = 1e-6;

/// Linearisation of an assembly at a stage of an implicit step. The bodies' velocities, and displacements along them,
/// are numbered as in [`Assembly::slots`].
#[derive(Debug, Clone)]
pub struct LinearisedStage {
    /// Rates of the state; 0 for the charts.
    pub rates: DVector<f64>,
    /// Charts corrected onto their attachments.
    pub charts: Vec<Wrench>,
    /// Largest gap before the correction, in radians and rod lengths.
    pub gap: f64,
    /// det J of each rod.
    pub dets: Vec<f64>,
    /// Derivative of the bodies' accelerations by their displacements. Spins have none: they are left to the
    /// iteration.
    pub by_place: DMatrix<f64>,
    /// Derivative of the bodies' accelerations by their velocities.
    pub by_velocity: DMatrix<f64>,
    /// Derivatives of the charts by the displacements, six rows a rod.
    pub charts_by_place: DMatrix<f64>,
}

impl LinearisedStage {
    /// Linearises a state of an implicit step; None outside the domain of a law, and for a rod at its fold.
    pub fn at(assembly: &Assembly, state: &DVector<f64>, tolerance: f64) -> Option<Self> {
        let at = assembly.evaluated(state, tolerance)?;
        let (bodies, t) = (&at.now.bodies, at.integrals.time);
        let (starts, total) = assembly.freedoms();
        let mut wrenches = vec![Vector6::zeros(); bodies.len()];
        // Derivatives of the wrenches on the bodies, and of the charts, by the bodies' twists.
        let mut by_twists = DMatrix::zeros(6 * bodies.len(), 6 * bodies.len());
        let mut charts_by_twists = DMatrix::zeros(6 * at.points.len(), 6 * bodies.len());
        let (mut charts, mut gap, mut dets) = (Vec::new(), 0.0_f64, Vec::new());
        let mut moving = Vec::new();
        for (k, (link, point)) in assembly.links().iter().zip(&at.points).enumerate() {
            let factors = link.regular(&point.end)?;
            let scale = link.gap_scale(&point.end);
            let missing = factors.solve(&(scale * point.gap()))?;
            let follows = factors.solve(&(scale * point.drive_by_twists()))?;
            let by_chart = point.wrenches_by_chart();
            let by = by_chart * follows + point.wrenches_by_turns();
            let more = by_chart * missing;
            // The chart as given: the gap of a taut rod includes the couple.
            let given = Wrench::from_column_slice(&state.as_slice()[assembly.chart_slots(k)]);
            charts.push(given + missing);
            moving.push(factors.solve(&(scale * point.drive()))?);
            gap = gap.max(link.apart(point));
            dets.push(point.end.jacobian.determinant());
            let levers = link.levers(bodies);
            let sites = [link.from(), link.to()];
            for (i, (lever, wrench)) in levers.iter().zip(point.wrenches()).enumerate() {
                let Some((row, arm)) = lever else { continue };
                let wrench: Vector6<f64> = wrench + more.fixed_rows::<6>(6 * i);
                wrenches[*row] += sites[i].moved(bodies, &wrench);
                let onto = carried(arm).transpose();
                let mut add = |column: usize, block: &Matrix6<f64>| {
                    let mut view = by_twists.view_mut((6 * row, 6 * column), (6, 6));
                    view += block;
                };
                add(*row, &lever_turned(arm, &halves(&wrench).1));
                for (j, lever) in levers.iter().enumerate() {
                    if let Some((column, other)) = lever {
                        let block = by.fixed_view::<6, 6>(6 * i, 6 * j) * carried(other);
                        add(*column, &(onto * block));
                    }
                }
                let mut view = charts_by_twists.view_mut((6 * k, 6 * row), (6, 6));
                view += follows.fixed_columns::<6>(6 * i) * carried(arm);
            }
        }
        let with_rods = if assembly.feels_rods() {
            Some(assembly.feel_rods(&at, tolerance, &mut wrenches)?)
        } else {
            None
        };
        let mut rates = DVector::zeros(state.len());
        let mut twists = DMatrix::zeros(6 * bodies.len(), total);
        let mut by_wrench = DMatrix::zeros(total, 6 * bodies.len());
        let mut by_place = DMatrix::zeros(total, total);
        let mut by_velocity = DMatrix::zeros(total, total);
        let (mut power, mut loss) = (assembly.power_on_rods(&at.points), 0.0);
        power += with_rods.as_ref().map_or(0.0, |with| with.power);
        let turning = at.points.iter().zip(&moving);
        power += turning
            .map(|(point, rates)| point.load_power(rates, 1.0))
            .sum::<f64>();
        let spins = with_rods.as_ref().map_or(&[][..], |with| &with.spins);
        assembly.write_spin_rates(state, &at.points, &moving, spins, 1.0, &mut rates);
        let length = assembly.scales().0;
        for (body, (first, carrier)) in assembly.starts().enumerate() {
            let (own, count) = (starts[body], carrier.freedoms());
            let slots = first..first + carrier.numbers();
            let numbers = &state.as_slice()[slots.clone()];
            let moving = numbers.len() - count;
            let (driven, lost) = carrier.write_rates(
                t,
                numbers,
                &wrenches[body],
                1.0,
                &mut rates.as_mut_slice()[slots.clone()],
            );
            power += driven;
            loss += lost;
            let acceleration = rates.rows(first + moving, count).into_owned();
            let mut out = vec![0.0; numbers.len()];
            let mut change = |numbers: &[f64], wrench: &Vector6<f64>| {
                carrier.write_rates(t, numbers, wrench, 1.0, &mut out);
                DVector::from_column_slice(&out[moving..]) - &acceleration
            };
            for i in 0..6 {
                // Accelerations are linear in the wrench.
                let unit = Vector6::ith(i, 1.0);
                let column = change(numbers, &(wrenches[body] + unit));
                by_wrench
                    .view_mut((own, 6 * body + i), (count, 1))
                    .copy_from(&column);
            }
            for i in 0..count {
                let mut along = numbers.to_vec();
                along[moving..].fill(0.0);
                along[moving + i] = 1.0;
                twists
                    .view_mut((6 * body, own + i), (6, 1))
                    .copy_from(&carrier.read(&along).twist);
                let mut way = vec![0.0; numbers.len()];
                carrier.write_rates(t, &along, &Vector6::zeros(), 1.0, &mut way);
                let unit = if carrier.turns() && i < 3 {
                    1.0
                } else {
                    length
                };
                let mut aside = numbers.to_vec();
                for (x, way) in aside[..moving].iter_mut().zip(&way) {
                    *x += ASIDE * unit * way;
                }
                let column = change(&aside, &wrenches[body]) / (ASIDE * unit);
                by_place
                    .view_mut((own, own + i), (count, 1))
                    .copy_from(&column);
                let mut faster = numbers.to_vec();
                let by = ASIDE * (unit + faster[moving + i].abs());
                faster[moving + i] += by;
                let column = change(&faster, &wrenches[body]) / by;
                by_velocity
                    .view_mut((own, own + i), (count, 1))
                    .copy_from(&column);
            }
        }
        by_place += by_wrench * (by_twists * &twists);
        if let Some(together) = with_rods {
            // The inertia of the rods themselves changes little during the step: the iteration takes care of that
            // change.
            by_place = &together.shared * by_place;
            by_velocity = together.shared * by_velocity;
        }
        let mut charts_by_place = charts_by_twists * twists;
        let spinning: usize = assembly.spin_slots().map(|(_, slots)| slots.len()).sum();
        let all = total + spinning;
        for matrix in [&mut by_place, &mut by_velocity] {
            matrix.resize_mut(all, all, 0.0);
        }
        charts_by_place.resize_mut(6 * at.points.len(), all, 0.0);
        let time = assembly.time_slot();
        rates.as_mut_slice()[time..].copy_from_slice(&[1.0, power, loss]);
        let finite = rates.iter().chain(by_place.iter()).all(|x| x.is_finite());
        finite.then_some(Self {
            rates,
            charts,
            gap,
            dets,
            by_place,
            by_velocity,
            charts_by_place,
        })
    }
}
