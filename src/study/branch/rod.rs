//! Branches of a single rod.

use super::FINEST;
use super::follow::TYPICAL_WRENCH;
use super::subject::{BranchState, GeneralPoint, INDEX, LoadClass, Subject, VariedScene};
use crate::error::{Error, Message, Quantity, Result};
use crate::full_mass::held_vibrations::{Sweep, resistance};
use crate::rod::{Chart, Problem, RodFamily, RodSection, Spatial, Statical, Wrench, ZeroMode};
use crate::scene::{Continue, Scales, Scene};
use crate::solve::arclength::Point;
use crate::solve::parametrised_problem::Family;
use crate::study::neglected_mass::{FoldAtRest, MassEffect, MassOrigin, standing};
use crate::study::stations::{self, StationValues};
use crate::study::tendons::TendonsRecord;
use crate::study::{Column, space};
use nalgebra::DVector;

/// Step in the unknowns along the branch from a fold, by which its critical direction is found.
const ASIDE: f64 = 1e-4;
/// Sections of a shape.
pub const SECTIONS: usize = 121;

/// A single rod in a chart valid on whole branches.
pub struct SingleRod<'a, C> {
    pub scene: &'a Scene,
    pub chart: C,
    /// True if branches end where the rod becomes too taut for the chart.
    pub while_slack: bool,
}

impl<C: Chart + Clone> SingleRod<'_, C> {
    /// State of the rod for fixed parameters.
    fn at(&self, problem: &Problem, x: &DVector<f64>) -> Result<crate::rod::BranchEquilibrium> {
        let chart = self.chart.clone();
        RodFamily::in_chart(|_| Ok(problem.clone()), false, 1.0, chart).state(x, 0.0)
    }
}

impl<C: Chart + Clone + 'static> Subject for SingleRod<'_, C> {
    fn family<'s>(&'s self, scenes: VariedScene<'s>, span: f64) -> Box<dyn Family + 's> {
        let changes_rods = scenes.changes_rods;
        let problem = move |p: f64| (scenes.at)(p)?.problem();
        let chart = self.chart.clone();
        Box::new(RodFamily::in_chart(problem, changes_rods, span, chart))
    }

    fn in_general(&self, scene: &Scene, x: &DVector<f64>) -> Result<Option<GeneralPoint<'_>>> {
        let problem = scene.problem()?;
        let state = self.at(&problem, x)?;
        if problem.is_taut(&state.base, &state.end) {
            return Ok(None);
        }
        let subject = SingleRod {
            scene: self.scene,
            chart: Spatial,
            while_slack: false,
        };
        let wrench = self.chart.wrench(&problem, x)?;
        Ok(Some(GeneralPoint {
            subject: Box::new(subject),
            x: DVector::from_column_slice(wrench.as_slice()),
        }))
    }

    fn finest(&self) -> f64 {
        FINEST
    }

    fn state(&self, scene: &Scene, x: &DVector<f64>, _: f64) -> Result<BranchState> {
        let problem = scene.problem()?;
        let state = self.at(&problem, x)?;
        let end = &state.end;
        let potential = if self.scene.is_loaded_along() {
            Some(problem.potential(&state.base)?)
        } else {
            None
        };
        let law = scene.rod.tendon_law()?;
        let sections = |at: &[f64]| self.chart.sections(&problem, x, at);
        let tendons = law.map(|law| TendonsRecord::of(&law, scene.rod.length, sections));
        let tendons = tendons.transpose()?;
        let pulled = tendons.as_ref().map_or(0.0, TendonsRecord::potential);
        let lengths = tendons.iter().flat_map(|tendons| &tendons.each);
        let stations = stations::at_rest(scene, |_, places| {
            let sections = self.chart.sections(&problem, x, places)?;
            Ok(sections.iter().map(StationValues::at_rest).collect())
        })?;
        let numbers = space::pose(end)
            .chain(space::wrench(&state.base))
            .chain(space::tip_wrench(end))
            .chain([end.energy - pulled])
            .chain(potential)
            .chain(lengths.map(|tendon| tendon.length))
            .chain(stations::numbers(&stations));
        Ok(BranchState {
            numbers: numbers.collect(),
            left_over: state.residual,
            left: self.while_slack && problem.is_taut(&state.base, end),
        })
    }

    fn mass(&self, scene: &Scene, x: &DVector<f64>) -> Option<MassEffect> {
        scene.rod.mass()?;
        let state = self.at(&scene.problem().ok()?, x).ok()?;
        standing(scene, &state.base)
    }

    /// At a fold the tangent of the branch is the critical direction.
    fn fold(&self, scene: &Scene, wanted: &Continue, at: &Point) -> Result<Option<FoldAtRest>> {
        if scene.rod.mass().is_none() {
            return Ok(None);
        }
        let mut scene = scene.clone();
        scene.solve.tolerance = FINEST;
        let parameter = wanted.parameter;
        let problem = |p: f64| scene.with(&parameter, p).problem();
        let here = problem(at.p)?;
        let rod = here.rod();
        let state = self.at(&here, &at.x)?;
        let in_chart = |far: f64| &at.x + &at.tangent_x * far;
        let wrench = |far: f64| self.chart.wrench(&here, &in_chart(far));
        let turn = (wrench(ASIDE)? - wrench(-ASIDE)?) / (2.0 * ASIDE);
        let span = wanted.to - wanted.from;
        let there = scene.with(&parameter, at.p);
        let massive = there.rod.massive(rod, &Scales::new(1.0, 1.0, 1.0))?;
        let Some(massive) = massive else {
            return Ok(None);
        };
        let couple = rod.units().0;
        let scale = 1.0 + rod.inward(&state.base).norm();
        let (form, against) = if here.is_taut(&state.base, &state.end) {
            // The base wrench resolves a taut rod poorly; the unknowns of its chart do better.
            let unit = 1.0 / turn.norm();
            let along =
                |far: f64, at: &[f64]| self.chart.sections(&here, &in_chart(far * unit), at);
            let along = Sweep::new(&along, scale)?;
            let [force, place] = along.end()?;
            let turn = rod.clamp_pose().rotation.inverse();
            let end = [turn * force / rod.units().1, turn * place / rod.length()];
            let chart = self.chart.clone();
            let family = RodFamily::in_chart(problem, parameter.changes_rod(), span, chart);
            let form = family.fold_in_chart(&at.x, &(&at.tangent_x * unit), at.p, &end)?;
            (form, resistance(&massive, &along, None, None)?)
        } else {
            let b = rod.inward(&state.base);
            let z = turn.normalize();
            let family = RodFamily::new(problem, parameter.changes_rod(), span);
            let fold = family.fold(&b, &z, at.p)?;
            let moved = |by: Wrench| {
                let here = &here;
                move |far: f64, at: &[f64]| {
                    here.sections(&here.rod().outward_wrench(&(b + by * far)), at)
                }
            };
            let (along, against) = (moved(z), moved(fold.against));
            let along = Sweep::new(&along, scale)?;
            let other = (fold.against != z).then(|| Sweep::new(&against, scale));
            let other = other.transpose()?;
            let against = resistance(&massive, &along, other.as_ref(), None)?;
            ([fold.drive, fold.bend], against)
        };
        let form = form.map(|x| x * couple);
        let resistances = [against.mass, against.proportional];
        FoldAtRest::new(form, resistances, MassOrigin::Rod)
            .map(Some)
            .ok_or_else(|| Error::domain("friction would feed the motion out of it"))
    }

    fn zero_modes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<String>> {
        let problem = scene.problem()?;
        let b = self.chart.wrench(&problem, x)?;
        let modes = problem.zero_modes(&problem.rod().outward_wrench(&b));
        Ok(modes.iter().map(ZeroMode::to_string).collect())
    }

    fn is_planar(&self) -> bool {
        self.chart.is_planar()
    }

    fn columns(&self) -> (Vec<Column>, Column) {
        let units = self.scene.units;
        let energy = Column::reals("energy", units.energy(), "elastic energy of the rod");
        let potential = Column::reals(
            "potential",
            units.energy(),
            "potential of the load along the rod",
        );
        let columns = space::pose_columns(units)
            .chain(space::wrench_columns("base", units))
            .chain(space::wrench_columns("tip", units))
            .chain([energy])
            .chain(self.scene.is_loaded_along().then_some(potential))
            .chain((0..self.scene.rod.tendons.len()).map(|k| {
                Column::reals(
                    format!("tendon_{k}_length"),
                    units.length(),
                    "length of the tendon",
                )
            }))
            .chain(stations::columns(
                &stations::placed(self.scene),
                units,
                false,
            ));
        let meaning = "size of the equations left over, in units of the rod";
        (columns.collect(), Column::reals("residual", "", meaning))
    }

    fn index(&self) -> Column {
        Column::integers("index", INDEX)
    }

    fn shown(&self) -> usize {
        12
    }

    fn loads(&self, scene: &Scene) -> Result<LoadClass> {
        let problem = scene.problem()?;
        Ok(LoadClass::new(
            problem.is_conservative(),
            problem.is_followed(),
        ))
    }

    fn shapes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<Vec<RodSection>>> {
        let last = SECTIONS - 1;
        let at: Vec<f64> = (0..=last).map(|i| i as f64 / last as f64).collect();
        Ok(vec![self.chart.sections(&scene.problem()?, x, &at)?])
    }

    /// A guess in both directions along each unknown.
    fn guesses(&self) -> Vec<DVector<f64>> {
        let size = self.chart.size();
        let along = |k: usize, way: f64| {
            DVector::from_fn(size, |i, _| if i == k { way * TYPICAL_WRENCH } else { 0.0 })
        };
        let both = |k: usize| [along(k, 1.0), along(k, -1.0)];
        (0..size).flat_map(both).collect()
    }

    fn wrench_size(&self, size: f64) -> f64 {
        self.chart.reach(size)
    }

    fn search_description(&self, size: f64) -> String {
        let stiffness = self
            .scene
            .cosserat_rod()
            .map(|rod| rod.reference_stiffness());
        let couple = self.chart.reach(size) * stiffness.unwrap_or(f64::NAN) / self.scene.rod.length;
        let force = couple / self.scene.rod.length;
        let units = |of| (1.0, self.scene.units.symbol(of));
        Message::from("base wrenches up to a couple of ")
            .number(couple, Quantity::Couple)
            .words(" or a force of ")
            .number(force, Quantity::Force)
            .in_units(&units)
            .to_string()
    }

    fn start(&self) -> &'static str {
        "another [start]"
    }
}
