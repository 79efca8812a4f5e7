//! Taut rods of an assembly: the chart is the force n(0), and the attachments give the pose of the end.
//!
//! Beyond sqrt(n.r L/B) of about ten the base wrench loses digits of the end's position, ten times as many at twice
//! that value. The force n still charts the rod if its end is held as the attachment says, turned or without couple.
//! Then r(1), m(0) and m(1) follow from [`crate::rod::Rod::taut`] and its derivatives. The six numbers of the chart
//! stay the base wrench (m(0), n), but the couple is dependent; its place in the equations is
//! ```text
//! m(0) of the chart = m(0)(n, turn of the end),     place of the end = r(1)(n, turn of the end).
//! ```
//!
//! With its end held in position a rod is stable longer than under its force. Before it comes to its fold it is
//! neutral under its force, which turns back there and is no chart. Between the two a spring beside the end separates
//! equilibria that have the same force. The given quantity is f = n + k (r(1) - place of the attachment), which is n
//! as long as the end is where it is held. With C = d r(1)/dn, the rod beside the spring gives way by C (1 + k C)^-1.
//! That is regular where C is infinite and singular where C is 0, as before. It is also singular where C is -1/k: k
//! is kept away from that ([`Link::better_spring`]). Then, w and v being turn and velocity of the attachment,
//! ```text
//! dr(1)/df f' + dr(1)/dturn w = v,     f' = n' + k v.
//! ```

use super::attachment::Joint;
use super::rod_element::{EndKind, Link, LinkEnd, LinkPoint, LoadTerms, RodChart};
use crate::error::{Error, Result};
use crate::math::se3::halves;
use crate::rod::{RodSection, Spring, Taut, TautLoad, Tip, Wrench};
use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Vector3};
use std::sync::Arc;

/// Pull (L/B) n.r(1) above which a rod is charted as taut, and below which as slack again; without and with known
/// mass. The mass needs squares of the end's sensitivities, and loses twice the digits.
const TAUT: [f64; 2] = [100.0, 36.0];
const SLACK: [f64; 2] = [64.0, 25.0];
/// Pull above which a rod at rest under a load along it is charted as taut: its force is greatest at the ends.
const LOADED: f64 = 49.0;

/// Number of sample points of the force along a rod.
const PARTS: usize = 16;

/// In motion a solution counts as another equilibrium beyond these bounds: on the distance of its end, in rod
/// lengths, and on the difference of its base couple from that of the chart, over sqrt(n B).
const OTHER_EQUILIBRIUM: (f64, f64) = (1e-3, 0.03);

impl Link {
    /// Pull (L/B) n.r(1) of a rod with its end at `held`. Under a load along the rod, gathered from the base to
    /// x = s/L in B/L^2 (`gathered`), the square of the mean root of |n(s)|: a heavy rod hangs along its own force, and
    /// errors at the base grow by the exponential of that mean.
    fn pull(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        gathered: Option<&dyn Fn(f64) -> Vector3<f64>>,
    ) -> f64 {
        let n = halves(q).1;
        gathered.map_or_else(
            || n.dot(&held.translation.vector) / self.rod.length(),
            |gathered| {
                let root = |k: usize| {
                    let x = (k as f64 + 0.5) / PARTS as f64;
                    (n - gathered(x)).norm().sqrt()
                };
                let mean = (0..PARTS).map(root).sum::<f64>() / PARTS as f64;
                mean * mean
            },
        )
    }

    /// Best stiffness of the spring beside the end of a taut rod: [`Spring::better`].
    fn better_spring(&self, end: &LinkEnd) -> f64 {
        let own = if end.is_taut() {
            self.chart.spring()
        } else {
            0.0
        };
        // d r(1)/d(force given), with the end held as it is.
        let block = |i: usize, j: usize| end.jacobian.fixed_view::<3, 3>(i, j).into_owned();
        let of_turn = block(0, 0).lu().solve(&block(0, 3)).unwrap_or_default();
        let give = (block(3, 3) - block(3, 0) * of_turn) / self.rod.length();
        let length = end
            .pose
            .translation
            .vector
            .norm()
            .max(1e-3 * self.rod.length());
        let string = end.force.norm() / self.units()[3] * self.rod.length() / length;
        Spring::best_stiffness(&give, own, string)
    }

    /// True if the present pull suits the chart of a taut rod, with hysteresis.
    pub fn suits_taut(&self, q: &Wrench, point: &LinkPoint) -> bool {
        if self.is_pinned() || self.in_time.is_some() || self.has_turning() {
            return false;
        }
        let borders = if self.chart.is_taut() { SLACK } else { TAUT };
        let unit = self.rod.length() / self.units()[3];
        let gathered = self.distributed().map(|load| {
            move |x: f64| point.base.pose.rotation.inverse() * (load.integral_to(x) * unit)
        });
        let gathered = gathered.as_ref().map(|gathered| gathered as _);
        self.pull(q, &point.held(), gathered) > borders[usize::from(self.mass.is_some())]
    }

    /// Chart that suits the present pull, with the best spring or slider.
    pub fn suited_chart(&self, q: &Wrench, point: &LinkPoint) -> RodChart {
        if self.suits_taut(q, point) {
            let spring = self.better_spring(&point.end);
            return RodChart::Taut { spring };
        }
        let slider = self.suited_slider(&point.end);
        slider.map_or(RodChart::BaseWrench, RodChart::OnSlider)
    }

    pub(super) fn is_taut(&self, q: &Wrench, held: &Isometry3<f64>) -> bool {
        if self.is_pinned() || self.in_time.is_some() || self.has_turning() {
            return false;
        }
        let pull = || {
            let unit = self.rod.length() / self.units()[3];
            let gathered = (self.borne()).map(|load| move |x: f64| load.integral_to(x) * unit);
            self.pull(q, held, gathered.as_ref().map(|gathered| gathered as _))
        };
        match self.chart {
            RodChart::ByPull { .. } => {
                let from = TAUT[usize::from(self.mass.is_some())];
                pull()
                    > if self.is_loaded() {
                        from.min(LOADED)
                    } else {
                        from
                    }
            }
            chart => chart.is_taut(),
        }
    }

    /// End at the chart point q with the attachment at `held`, both relative to the base.
    ///
    /// # Errors
    /// As [`crate::rod::Rod::end`] and [`crate::rod::Rod::taut`].
    pub fn held(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<LinkEnd> {
        if !self.is_taut(q, held) {
            return self.end(q, tolerance);
        }
        let found = self.solve_taut(q, held, tolerance)?;
        Ok(self.taut_end(q, held, found))
    }

    /// [`Link::held`] of a rod that differs little from the evaluated one `known` at the same chart point, for
    /// differences: a taut rod to first order, without derivatives.
    ///
    /// # Errors
    /// As [`Link::held`].
    pub(super) fn held_beside(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        known: &LinkEnd,
        tolerance: f64,
    ) -> Result<LinkEnd> {
        let Some(taut) = known.taut() else {
            return self.held(q, held, tolerance);
        };
        let base = q.component_mul(&self.units());
        let (tip, spring) = (self.taut_tip(held), self.spring_beside(held));
        let load = self.taut_load();
        let found = self
            .rod
            .taut_to_first_order(&base, &tip, &spring, load, taut)?;
        Ok(self.taut_end(q, held, Arc::new(found)))
    }

    fn taut_end(&self, q: &Wrench, held: &Isometry3<f64>, found: Arc<Taut>) -> LinkEnd {
        let units = self.units();
        let (couple, force) = (units[0], units[3]);
        let (by_force, by_tip) = (&found.by_force, &found.by_tip);
        let beside = Matrix3::identity() - by_force.position * self.spring_beside(held).stiffness;
        let mut resultants = SMatrix::<f64, 9, 6>::zeros();
        let mut turned = None;
        let mut tangent = Matrix6::zeros();
        let mut jacobian = Matrix6::zeros();
        let mut drive = Matrix6::identity();
        for (row, by) in [
            (0, &by_force.base_couple),
            (3, &beside),
            (6, &by_force.couple),
        ] {
            resultants
                .fixed_view_mut::<3, 3>(row, 3)
                .copy_from(&(by * force));
        }
        for (row, by) in [(0, &by_force.turn), (3, &by_force.position)] {
            tangent
                .fixed_view_mut::<3, 3>(row, 3)
                .copy_from(&(by * force));
        }
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(couple);
        jacobian
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(by_force.base_couple * -force));
        jacobian
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(by_force.position * force));
        drive.fixed_rows_mut::<3>(0).fill(0.0);
        let stiffness = self.spring_beside(held).stiffness;
        drive
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(by_force.base_couple * stiffness));
        drive.fixed_view_mut::<3, 3>(3, 3).copy_from(&beside);
        if self.joint() == Joint::Weld {
            let mut by_turn = SMatrix::<f64, 9, 3>::zeros();
            for (row, by) in [(0, &by_tip.base_couple), (6, &by_tip.couple)] {
                by_turn.fixed_view_mut::<3, 3>(row, 0).copy_from(by);
            }
            turned = Some(by_turn);
            for (row, by) in [(0, by_tip.base_couple), (3, -by_tip.position)] {
                drive.fixed_view_mut::<3, 3>(row, 0).copy_from(&by);
            }
        }
        let (m, n) = halves(&found.base);
        let along = self.borne().map(|_| {
            let total = n - found.end.force;
            let mut along = LoadTerms {
                total,
                dead: total,
                potential: found.potential,
                turned: SMatrix::zeros(),
                force_turned: -total.cross_matrix(),
                taken: SMatrix::zeros(),
                power: None,
                base: SMatrix::zeros(),
                prescribed: SMatrix::zeros(),
            };
            if let Some(by) = &found.by_turn {
                for (row, by) in [(0, by.turn), (3, by.position), (6, by.couple)] {
                    along.turned.fixed_rows_mut::<3>(row).copy_from(&by);
                }
                for (row, by) in [(0, by.base_couple), (3, by.position * -stiffness)] {
                    along.base.fixed_rows_mut::<3>(row).copy_from(&by);
                }
                for (row, by) in [(0, -by.base_couple), (3, by.position)] {
                    along.prescribed.fixed_rows_mut::<3>(row).copy_from(&by);
                }
            }
            along
        });
        LinkEnd {
            pose: found.end.pose(),
            base_couple: m,
            couple: found.end.couple,
            force: n,
            along,
            energy: found.end.energy,
            tangent,
            resultants,
            jacobian,
            drive,
            kind: EndKind::Taut {
                slack: m - halves(q).0 * couple,
                rod: found,
                turned,
                pulled: self.chart.spring() / self.rod.length(),
            },
        }
    }

    fn taut_tip(&self, held: &Isometry3<f64>) -> Tip {
        match self.joint() {
            Joint::Weld => Tip::Turned(*held.rotation.to_rotation_matrix().matrix()),
            Joint::Ball => Tip::Loaded {
                couple: Vector3::zeros(),
                arm: Vector3::zeros(),
            },
        }
    }

    fn taut_load(&self) -> Option<TautLoad<'_>> {
        self.borne().map(|along| TautLoad {
            along,
            turns: self.base_turns(),
        })
    }

    fn spring_beside(&self, held: &Isometry3<f64>) -> Spring {
        Spring {
            stiffness: self.chart.spring() * self.units()[3] / self.rod.length(),
            at: held.translation.vector,
        }
    }

    /// Taut equilibrium, started from the last one found.
    pub(super) fn solve_taut(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Arc<Taut>> {
        let tip = self.taut_tip(held);
        let base = q.component_mul(&self.units());
        let spring = self.spring_beside(held);
        let last = self.last_taut.last();
        let load = self.taut_load();
        let begun = |start: Option<&Taut>| {
            let found = self
                .rod
                .taut_beside(&base, &tip, &spring, load, start, tolerance)?;
            let off = (found.end.position - held.translation.vector).norm();
            let units = self.units();
            let couple = (halves(&found.base).0 / units[0] - halves(q).0).norm();
            let scale = (halves(q).1.norm()).sqrt();
            let same = off <= OTHER_EQUILIBRIUM.0 * self.rod.length()
                && couple <= OTHER_EQUILIBRIUM.1 * scale;
            if self.chart.is_taut() && !same {
                return Err(Error::no_convergence(
                    "only another equilibrium of a taut rod was found than that it moves through",
                ));
            }
            Ok(found)
        };
        let found = match begun(last.as_deref()) {
            Err(_) if last.is_some() => begun(None)?,
            found => found?,
        };
        let found = Arc::new(found);
        self.last_taut.keep(&found);
        Ok(found)
    }

    /// Sections at the arclengths `at`, in growing order, in the directors of the base, of the rod with its
    /// attachment at `held`.
    ///
    /// # Errors
    /// As [`Link::held`].
    pub fn shape(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<RodSection>> {
        if self.is_taut(q, held) {
            let found = self.solve_taut(q, held, tolerance)?;
            return self.rod.taut_shape(&found, at, tolerance);
        }
        let base = q.component_mul(&self.units());
        if self.is_loaded() {
            let at: Vec<f64> = at.iter().map(|s| s / self.rod.length()).collect();
            return self.base_wrench_problem(tolerance)?.sections(&base, &at);
        }
        self.rod.shape(&base, at, tolerance)
    }
}
