//! Spheres and discs with mass, in a run.

use super::{
    InflationEnd, InflationMoment, InflationRecord, Moving, NO_STEP, Oscillation, SnapPressure,
};
use crate::error::Result;
use crate::membrane::breathing::{SphereEnd, SphereMotion};
use crate::membrane::rings::{DiscMotion, MembraneLedger};
use crate::membrane::{Filling, sphere};
use crate::motion::Ledger;
use serde_json::json;

/// Relative difference of turns up to which a motion counts as periodic.
const PERIODIC: f64 = 1e-8;

fn ledger(of: MembraneLedger) -> Ledger {
    Ledger {
        kinetic: of.kinetic,
        elastic: of.stored,
        potential: of.gas,
        work: of.work,
        ..Ledger::default()
    }
}

impl Moving for SphereMotion {
    fn go(&mut self, t: f64, steps: usize) -> std::result::Result<(), InflationEnd> {
        for _ in 0..steps {
            if SphereMotion::time(self) >= t {
                break;
            }
            self.step(t).map_err(|end| match end {
                SphereEnd::Burst(t) => InflationEnd::Burst(t),
                SphereEnd::Collapse(t) => InflationEnd::Implosion(t),
                SphereEnd::Stuck(t) => InflationEnd::Stuck(t, NO_STEP.to_owned()),
            })?;
        }
        Ok(())
    }

    fn time(&self) -> f64 {
        self.time()
    }

    fn moment(&mut self, t: f64) -> Result<InflationMoment> {
        Ok(InflationMoment {
            time: t,
            height: self.radius(),
            stretch: self.stretch(),
            volume: self.volume(),
            pressure: self.pressure(),
            piston: None,
            velocity: self.velocity(),
            ledger: ledger(self.ledger()),
        })
    }

    fn finish(&self, record: &mut InflationRecord) {
        record.max_height = self.highest();
        record.work = self.work();
        if let [.., a, b, c] = self.turns() {
            let repeats = (c.stretch - a.stretch).abs() <= PERIODIC * a.stretch;
            record.oscillation = repeats.then(|| Oscillation {
                period: c.time - a.time,
                min: a.stretch.min(b.stretch),
                max: a.stretch.max(b.stretch),
            });
        }
        let passages = self.passages().iter();
        record.events.extend(passages.map(|at| {
            json!({ "kind": "fold", "t": at.time, "stretch": at.stretch, "outward": at.outward })
        }));
        let slack = self
            .compressed()
            .map(|t| json!({ "kind": "wrinkle", "t": t }));
        record.events.extend(slack);
        if let Filling::Pressure(_) = self.filling() {
            let balloon = self.sphere();
            let unit = balloon.thickness / balloon.radius;
            let dynamic =
                sphere::dynamic_snap(&balloon.rubber).map(|(pressure, stretch)| SnapPressure {
                    pressure: pressure * unit,
                    stretch,
                });
            let limit = balloon
                .limit_points()
                .ok()
                .and_then(|found| found.first().copied());
            let limit = limit.map(|at| SnapPressure {
                pressure: at.pressure,
                stretch: at.stretch,
            });
            record.snaps_at = Some([dynamic, limit]);
        }
    }
}

impl Moving for DiscMotion {
    fn go(&mut self, t: f64, steps: usize) -> std::result::Result<(), InflationEnd> {
        for _ in 0..steps {
            if DiscMotion::time(self) >= t {
                break;
            }
            self.step(t).map_err(InflationEnd::Collapse)?;
        }
        Ok(())
    }

    fn time(&self) -> f64 {
        self.time()
    }

    fn moment(&mut self, t: f64) -> Result<InflationMoment> {
        Ok(InflationMoment {
            time: t,
            height: self.height(),
            stretch: self.stretch(),
            volume: self.volume(),
            pressure: self.pressure(),
            piston: None,
            velocity: self.velocity(),
            ledger: ledger(self.ledger()),
        })
    }

    fn profile(&self) -> Vec<[f64; 3]> {
        let rims = self.unloaded_radii().zip(self.rims());
        rims.map(|(s, [r, z])| [s, *r, *z]).collect()
    }

    fn finish(&self, record: &mut InflationRecord) {
        record.max_height = self.highest();
        record.work = [self.steps(); 2];
        record.events.extend(self.wrinkle().map(|at| {
            json!({ "kind": "wrinkle", "t": at.time, "ring": at.ring, "direction": at.direction.to_string() })
        }));
    }
}
