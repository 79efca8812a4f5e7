//! What is written of branches: tables, special points, text.

use super::super::equilibrium::{halves, list, quaternion};
use super::super::files::exact;
use super::follow::{Curve, Located, Row, signed};
use serde_json::{Value, json};
use snaprod::solve::special::Status;
use std::fmt::Write;

/// branch.csv, or fold_curve.csv where rows have a second parameter.
pub fn table(rows: &[Row]) -> String {
    let on_folds = rows.first().is_some_and(|row| row.q.is_some());
    let mut text = String::from(match on_folds {
        true => "curve,parameter,second,",
        false => "branch,parameter,",
    });
    text.push_str(
        "arclength,x,y,z,qw,qx,qy,qz,base_fx,base_fy,base_fz,base_mx,base_my,base_mz,tip_fx,tip_fy,tip_fz,tip_mx,tip_my,tip_mz,energy,index,residual,label\n",
    );
    for row in rows {
        let end = &row.state.end;
        let (couple, force) = halves(&row.state.base);
        let numbers = std::iter::once(row.p)
            .chain(row.q)
            .chain([row.arclength])
            .chain(list(&end.position))
            .chain(quaternion(end))
            .chain(list(&force))
            .chain(list(&couple))
            .chain(list(&end.force))
            .chain(list(&end.couple))
            .chain([end.energy]);
        let mut cells = vec![row.curve.to_string()];
        cells.extend(numbers.map(exact));
        cells.push(row.index.map_or_else(String::new, |i| i.to_string()));
        cells.push(exact(row.state.residual));
        cells.push(row.label.clone());
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

impl<const N: usize> Located<N> {
    /// Arclengths between which it lies, in the scene's measure, in order.
    fn interval(&self) -> [f64; 2] {
        let (a, b) = self.special.interval;
        let (a, b) = (signed(self.backward, a), signed(self.backward, b));
        [a.min(b), a.max(b)]
    }

    /// Index before and after, in the direction of growing arclength.
    fn indices(&self) -> [Option<usize>; 2] {
        let (before, after) = self.special.index;
        match self.backward {
            true => [after, before],
            false => [before, after],
        }
    }

    fn status(&self) -> (&'static str, Option<&String>) {
        match &self.special.status {
            Status::Converged => ("converged", None),
            Status::Guess(why) => ("guess", Some(why)),
        }
    }

    /// On a branch.
    pub fn json(&self) -> Value {
        let (status, reason) = self.status();
        let special = &self.special;
        let [before, after] = self.indices();
        json!({
            "label": self.label,
            "kind": special.kind.to_string(),
            "branch": self.curve,
            "status": status,
            "reason": reason,
            "parameter": special.point.p,
            "arclength": signed(self.backward, special.point.arclength),
            "interval": self.interval(),
            "precision": {
                "parameter": special.error_p,
                "arclength": signed(false, special.error_s),
            },
            "index_before": before,
            "index_after": after,
        })
    }

    /// On a fold curve: the special point's own parameter is the second one.
    pub fn fold_json(&self) -> Value {
        let (status, reason) = self.status();
        let special = &self.special;
        let kind = match self.label.starts_with("TP") {
            true => "turning point".to_owned(),
            false => special.kind.to_string(),
        };
        json!({
            "label": self.label,
            "kind": kind,
            "curve": self.curve,
            "status": status,
            "reason": reason,
            "parameter": special.point.x[N - 1],
            "second": special.point.p,
            "arclength": signed(self.backward, special.point.arclength),
            "interval": self.interval(),
            "precision": {
                "second": special.error_p,
                "arclength": signed(false, special.error_s),
            },
        })
    }

    /// One line of text.
    pub fn line(&self, text: &mut String) {
        let special = &self.special;
        let doubt = match &special.status {
            Status::Converged => String::new(),
            Status::Guess(why) => format!(" (a guess: {why})"),
        };
        let _ = if self.label.starts_with(['C', 'T']) {
            writeln!(
                text,
                "{:<5} {:<17} at {}, {}{doubt}",
                self.label,
                if self.label.starts_with('C') {
                    "cusp"
                } else {
                    "turning point"
                },
                exact(special.point.x[N - 1]),
                exact(special.point.p),
            )
        } else {
            let [before, after] = self.indices().map(count);
            writeln!(
                text,
                "{:<5} {:<17} at {} +- {:.0e}, index {before} -> {after}{doubt}",
                self.label,
                special.kind.to_string(),
                exact(special.point.p),
                special.error_p,
            )
        };
    }
}

fn count(index: Option<usize>) -> String {
    index.map_or_else(|| "?".to_owned(), |i| i.to_string())
}

/// Branches or fold curves.
pub fn curves(curves: &[Curve], rows: &[Row]) -> Value {
    let one = |(number, curve): (usize, &Curve)| {
        json!({
            "number": number,
            "from": curve.origin,
            "points": rows.iter().filter(|row| row.curve == number).count(),
            "ends": curve.ends,
            "complete": curve.complete,
        })
    };
    curves.iter().enumerate().map(one).collect()
}
