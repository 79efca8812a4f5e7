//! Data for every figure, sampled from the closed form: for tests of `plot` and its gallery.

use snaprod::elastica::chart::Integrals;
use snaprod::plot::*;
use std::f64::consts::PI;

/// Data of one equilibrium for figures.
#[derive(Clone, Copy)]
pub struct Point {
    pub lam: f64,
    pub alpha: f64,
    pub tip: f64,
    pub r: [f64; 2],
    pub energy: f64,
}

pub fn at(p: f64, w: f64) -> Point {
    let i = Integrals::new(p, w);
    let alpha = -2.0 * (i.kap * i.c).atan2(i.d);
    let (x, y) = (2.0 * i.de() / i.lam - 1.0, 2.0 * i.kap * i.s / i.lam);
    let (s, c) = alpha.sin_cos();
    Point {
        lam: i.lam,
        alpha,
        tip: alpha + 2.0 * i.kap.asin(),
        r: [c * x - s * y, s * x + c * y],
        energy: 2.0 * i.lam * i.kap * i.kap * i.b,
    }
}

/// d(x, y)/d(p, w) by differences, and its determinant.
fn tangent(p: f64, w: f64) -> ([[f64; 2]; 2], f64) {
    let h = 1e-6;
    let (a, b) = (at(p + h, w).r, at(p - h, w).r);
    let (c, d) = (at(p, w + h).r, at(p, w - h).r);
    let m = [
        [(a[0] - b[0]) / (2.0 * h), (c[0] - d[0]) / (2.0 * h)],
        [(a[1] - b[1]) / (2.0 * h), (c[1] - d[1]) / (2.0 * h)],
    ];
    (m, m[0][0] * m[1][1] - m[0][1] * m[1][0])
}

fn w_of(p: f64, lam: f64) -> f64 {
    let (mut lo, mut hi) = (1e-9, 20.0);
    for _ in 0..60 {
        let mid = 0.5 * (lo + hi);
        if at(p, mid).lam < lam {
            lo = mid
        } else {
            hi = mid
        }
    }
    lo
}

/// The first `n` zeros in w of the determinant at p. Steps are equal in lam: dw = D dlam.
fn folds_at(p: f64, n: usize) -> Vec<f64> {
    let sign = |w: f64| tangent_in_lam(p, w);
    let mut found = Vec::new();
    let mut w = w_of(p, 2.0);
    let mut before = sign(w);
    while found.len() < n && w < 20.0 {
        let next = w + 0.02 * Integrals::new(p, w).d;
        let now = sign(next);
        if before * now < 0.0 {
            let (mut lo, mut hi) = (w, next);
            for _ in 0..40 {
                let mid = 0.5 * (lo + hi);
                if sign(mid) * before > 0.0 {
                    lo = mid
                } else {
                    hi = mid
                }
            }
            found.push(0.5 * (lo + hi));
        }
        before = now;
        w = next;
    }
    found
}

/// The determinant with a step in w that suits the scale D.
fn tangent_in_lam(p: f64, w: f64) -> f64 {
    let (h, g) = (1e-5, 1e-5 * Integrals::new(p, w).d);
    let (a, b) = (at(p + h, w).r, at(p - h, w).r);
    let (c, d) = (at(p, w + g).r, at(p, w - g).r);
    (a[0] - b[0]) * (c[1] - d[1]) - (c[0] - d[0]) * (a[1] - b[1])
}

/// Values of p from -top to top, graded as sinh.
fn graded(n: usize, top: f64) -> Vec<f64> {
    let reach = (top / 0.5).asinh();
    (0..n)
        .map(|i| 0.5 * (reach * (2.0 * i as f64 / (n - 1) as f64 - 1.0)).sinh())
        .collect()
}

/// Fold curves 1..=n in the chart: for each p the w of each, p refined where a curve runs fast.
fn fold_chart(n: usize, samples: usize) -> Vec<(f64, Vec<f64>)> {
    let ps = graded(2 * samples, 7.0);
    let mut rows: Vec<(f64, Vec<f64>)> = ps.into_iter().map(|p| (p, folds_at(p, n))).collect();
    for _ in 0..8 {
        let mut finer = Vec::new();
        for pair in rows.windows(2) {
            finer.push(pair[0].clone());
            let far = pair[0].1.iter().zip(&pair[1].1).any(|(&a, &b)| {
                let (a, b) = (at(pair[0].0, a).r, at(pair[1].0, b).r);
                (a[0] - b[0]).hypot(a[1] - b[1]) > 0.03
            });
            if far && pair[0].0 * pair[1].0 > 0.0 {
                let p = 0.5 * (pair[0].0 + pair[1].0);
                finer.push((p, folds_at(p, n)));
            }
        }
        finer.extend(rows.pop());
        rows = finer;
    }
    rows
}

/// The w at which the mean of w / w_end and lam / lam_end is u: fair to taut rods and to loops.
fn w_between(p: f64, end: f64, u: f64) -> f64 {
    let full = at(p, end).lam;
    let (mut lo, mut hi) = (0.0, end);
    for _ in 0..45 {
        let mid = 0.5 * (lo + hi);
        if 0.5 * (mid / end + at(p, mid).lam / full) < u {
            lo = mid
        } else {
            hi = mid
        }
    }
    hi
}

pub fn fold_curves(n: usize, samples: usize) -> Vec<Vec<Curve>> {
    let chart = fold_chart(n, samples);
    (0..n)
        .map(|k| {
            let half = |sign: f64| {
                let part = chart.iter().filter(|(p, _)| p * sign > 0.0);
                Curve::new(part.map(|(p, ws)| match ws.get(k) {
                    Some(&w) => at(*p, w).r,
                    None => [f64::NAN; 2],
                }))
            };
            vec![half(-1.0), half(1.0)]
        })
        .collect()
}

const NAMES: [[&str; 2]; 2] = [["S₀⁺", "S₀⁻"], ["S₁⁺", "S₁⁻"]];

/// S_j^+-: mode j in w, the sign from theta'(0) ~ kap sd(lam), so kap (-1)^j > 0 for plus.
fn sheets(
    rows: usize,
    columns: usize,
    top: f64,
    show: impl Fn(f64, f64) -> [f64; 3],
) -> Vec<Patch> {
    let mut patches = Vec::new();
    for (j, names) in NAMES.iter().enumerate() {
        for (sign, name) in names.iter().enumerate() {
            let positive = (sign == 0) == (j == 0);
            let patch = Patch::sample(name, 2 * j + sign, rows, columns, |a, b| {
                let t = a as f64 / (rows - 1) as f64;
                // From kap = 0 towards kap = 1, graded; in one order for both signs.
                let t = if positive { t } else { 1.0 - t };
                let p = top * (0.12 * t + 0.88 * t * t);
                let p = if positive { p } else { -p };
                let u = b as f64 / (columns - 1) as f64;
                let u = 0.5 - 0.5 * (PI * u).cos();
                show(p, PI * (j as f64 + 1e-4 + (1.0 - 2e-4) * u))
            });
            patches.push(patch);
        }
    }
    patches
}

pub fn sheets_lam(rows: usize, columns: usize) -> Sheets {
    Sheets {
        patches: sheets(rows, columns, 8.0, |p, w| {
            let q = at(p, w);
            [q.lam, q.alpha, q.tip]
        }),
        bounds: Some([[0.0, 10.0], [-PI, PI], [-2.0 * PI, 2.0 * PI]]),
        ..Sheets::default()
    }
}

pub fn sheets_disc(rows: usize, columns: usize) -> Sheets {
    Sheets {
        patches: sheets(rows, columns, 9.0, over_disc),
        curves: fold_in_space(1, rows),
        ..Sheets::default()
    }
}

fn over_disc(p: f64, w: f64) -> [f64; 3] {
    let q = at(p, w);
    [q.r[0], q.r[1], q.tip]
}

fn fold_in_space(n: usize, samples: usize) -> Vec<SpaceCurve> {
    let chart = fold_chart(n, samples);
    (0..n)
        .flat_map(|k| {
            [-1.0, 1.0].map(|sign| {
                let part = chart.iter().filter(|(p, _)| p * sign > 0.0);
                let at = part.filter_map(|(p, ws)| ws.get(k).map(|&w| over_disc(*p, w)));
                SpaceCurve {
                    name: "fold".into(),
                    points: at.collect(),
                    straight: false,
                }
            })
        })
        .collect()
}

/// The stable part of the chart, over the disc.
fn stable_patches(rows: usize, columns: usize) -> Vec<Patch> {
    [(1.0, "bent to the left", 0), (-1.0, "bent to the right", 1)]
        .map(|(sign, name, colour)| {
            let ps: Vec<f64> = (0..rows)
                .map(|a| {
                    let t = a as f64 / (rows - 1) as f64;
                    let t = if sign > 0.0 { t } else { 1.0 - t };
                    sign * (1e-3 + 7.0 * (0.12 * t + 0.88 * t * t))
                })
                .collect();
            let ends: Vec<f64> = ps.iter().map(|&p| folds_at(p, 1)[0]).collect();
            Patch::sample(name, colour, rows, columns, |a, b| {
                let u = b as f64 / (columns - 1) as f64;
                over_disc(ps[a], w_between(ps[a], ends[a], 1e-3 + (1.0 - 1e-3) * u))
            })
        })
        .into()
}

/// A short motion with a snap, by Runge and Kutta's method in the chart: mu = 1, a dead load.
pub struct Motion {
    pub t: Vec<f64>,
    pub q: Vec<[f64; 2]>,
    pub v: Vec<[f64; 2]>,
    pub lost: Vec<f64>,
    /// Index of the first state after the snap.
    pub snap: usize,
}

const LOAD: [f64; 2] = [-3.0, 2.0];

fn rate(y: [f64; 4]) -> [f64; 4] {
    let (m, det) = tangent(y[0], y[1]);
    let q = at(y[0], y[1]);
    let pull = q.lam * q.lam;
    [
        (m[1][1] * y[2] - m[0][1] * y[3]) / det,
        (m[0][0] * y[3] - m[1][0] * y[2]) / det,
        pull * q.alpha.cos() + LOAD[0],
        pull * q.alpha.sin() + LOAD[1],
    ]
}

pub fn motion(end: f64) -> Motion {
    let p: f64 = 0.6f64.atanh();
    let mut y = [p, w_of(p, 6.3), 0.0, -0.5];
    let mut out = Motion {
        t: vec![0.0],
        q: vec![[y[0], y[1]]],
        v: vec![[y[2], y[3]]],
        lost: vec![0.0],
        snap: 0,
    };
    let (mut t, mut lost) = (0.0, 0.0);
    let mut since = 0.0;
    while t < end {
        let k1 = rate(y);
        let speed = k1.iter().map(|k| k * k).sum::<f64>().sqrt();
        let h = (0.004 / speed).min(5e-4);
        let add = |k: [f64; 4], s: f64| std::array::from_fn(|i| y[i] + s * h * k[i]);
        let k2 = rate(add(k1, 0.5));
        let k3 = rate(add(k2, 0.5));
        let k4 = rate(add(k3, 1.0));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        t += h;
        since += h;
        let snapping = out.snap == 0 && tangent(y[0], y[1]).1.abs() < 3e-3;
        if since >= 2e-3 || snapping {
            since = 0.0;
            out.push(t, y, lost);
        }
        if snapping {
            let before = at(y[0], y[1]);
            let mut q = [-0.629404651, w_of(-0.629404651, 3.35099035)];
            for _ in 0..40 {
                let r = at(q[0], q[1]).r;
                let (m, det) = tangent(q[0], q[1]);
                let e = [before.r[0] - r[0], before.r[1] - r[1]];
                q[0] += 0.5 * (m[1][1] * e[0] - m[0][1] * e[1]) / det;
                q[1] += 0.5 * (m[0][0] * e[1] - m[1][0] * e[0]) / det;
            }
            lost = before.energy - at(q[0], q[1]).energy;
            y = [q[0], q[1], y[2], y[3]];
            out.snap = out.t.len();
            out.push(t, y, lost);
        }
    }
    out
}

impl Motion {
    fn push(&mut self, t: f64, y: [f64; 4], lost: f64) {
        self.t.push(t);
        self.q.push([y[0], y[1]]);
        self.v.push([y[2], y[3]]);
        self.lost.push(lost);
    }

    fn r(&self, i: usize) -> [f64; 2] {
        at(self.q[i][0], self.q[i][1]).r
    }
}

/// The rod's axis, integrated from the free end.
fn shape(p: f64, w: f64) -> Curve {
    let q = at(p, w);
    let n = 100;
    let h = 1.0 / n as f64;
    let bend = |a: f64| -q.lam * q.lam * (a - q.alpha).sin();
    let (mut theta, mut rate) = (q.tip, 0.0);
    let mut angles = vec![theta];
    for _ in 0..n {
        // Leapfrog towards the clamp.
        rate -= 0.5 * h * bend(theta);
        theta -= h * rate;
        rate -= 0.5 * h * bend(theta);
        angles.push(theta);
    }
    angles.reverse();
    let mut at = [0.0, 0.0];
    let mut points = vec![at];
    for pair in angles.windows(2) {
        let (s, c) = (0.5 * (pair[0] + pair[1])).sin_cos();
        at = [at[0] + h * c, at[1] + h * s];
        points.push(at);
    }
    Curve::new(points)
}

pub fn snapshots_data(m: &Motion) -> Snapshots {
    let end = *m.t.last().unwrap();
    let mut picks: Vec<usize> = (0..9)
        .map(|i| {
            m.t.partition_point(|&t| t < end * i as f64 / 8.0)
                .min(m.t.len() - 1)
        })
        .collect();
    picks.extend([m.snap - 1, m.snap]);
    picks.sort_unstable();
    picks.dedup();
    Snapshots {
        shapes: picks
            .into_iter()
            .map(|i| DrawnShape {
                time: m.t[i],
                axis: shape(m.q[i][0], m.q[i][1]),
            })
            .collect(),
        path: Curve::new((0..m.t.len()).map(|i| m.r(i))),
        folds: fold_curves(1, 150).remove(0),
        snaps: vec![m.r(m.snap)],
        ..Snapshots::default()
    }
}

pub fn energies_data(m: &Motion) -> Energies {
    let n = m.t.len();
    let kinetic: Vec<f64> =
        m.v.iter()
            .map(|v| 0.5 * (v[0] * v[0] + v[1] * v[1]))
            .collect();
    let elastic: Vec<f64> = m.q.iter().map(|q| at(q[0], q[1]).energy).collect();
    let potential: Vec<f64> = (0..n)
        .map(|i| -LOAD[0] * m.r(i)[0] - LOAD[1] * m.r(i)[1])
        .collect();
    let total: Vec<f64> = (0..n)
        .map(|i| kinetic[i] + elastic[i] + potential[i])
        .collect();
    Energies {
        time: m.t.clone(),
        error: (0..n).map(|i| total[i] + m.lost[i] - total[0]).collect(),
        dissipated: m.lost.clone(),
        work: vec![0.0; n],
        snaps: vec![m.t[m.snap]],
        kinetic,
        rod_kinetic: Vec::new(),
        elastic,
        potential,
        total,
        ..Energies::default()
    }
}

pub fn path_data(m: &Motion, rows: usize, columns: usize) -> PathOnSurface {
    let point = |i: usize| over_disc(m.q[i][0], m.q[i][1]);
    let mut path: Vec<[f64; 3]> = (0..m.t.len()).map(point).collect();
    path.insert(m.snap, [f64::NAN; 3]);
    PathOnSurface {
        sheets: Sheets {
            patches: stable_patches(rows, columns),
            curves: fold_in_space(1, rows),
            ..Sheets::default()
        },
        path,
        jumps: vec![[point(m.snap - 1), point(m.snap)]],
    }
}

pub fn portrait_data() -> Portrait {
    let v = |k: f64, psi: f64| 2.0 * (k * k - (0.5 * psi).sin().powi(2)).max(0.0).sqrt();
    // Clockwise from the crossing of psi = start with psi_s > 0, by the amplitude.
    let orbit = |k: f64, from: f64, to: f64| {
        Curve::new((0..=300).map(|i| {
            let f = from + (to - from) * i as f64 / 300.0;
            let psi = 2.0 * (k * f.sin()).asin();
            [psi, v(k, psi).copysign(f.cos())]
        }))
    };
    let k: f64 = 0.75;
    let start: f64 = -0.7;
    let a = ((0.5 * start).sin() / k).asin();
    let (b, c, d) = (0.5 * PI, PI - a, 1.5 * PI);
    let names = [
        ("AB: S₀⁺", a, b),
        ("CD: S₀⁻", c, d),
        ("ABCD: S₁⁺", a, d),
        ("CDAB: S₁⁻", c, b + 2.0 * PI),
    ];
    let point = |name: &str, f: f64| {
        let psi = 2.0 * (k * f.sin()).asin();
        NamedPoint {
            name: name.into(),
            at: [psi, v(k, psi).copysign(f.cos())],
        }
    };
    let separatrix = |s: f64| {
        Curve::new((0..=200).map(|i| {
            let psi = -PI + 2.0 * PI * i as f64 / 200.0;
            [psi, s * v(1.0, psi)]
        }))
    };
    Portrait {
        orbits: [0.25, 0.5, 0.75, 0.93]
            .iter()
            .map(|&k| orbit(k, 0.0, 2.0 * PI))
            .collect(),
        separatrix: vec![separatrix(1.0), separatrix(-1.0)],
        verticals: vec![start],
        arcs: names
            .map(|(name, from, to)| Arc {
                name: name.into(),
                curve: orbit(k, from, to),
            })
            .into(),
        points: vec![
            point("A", a),
            point("B", b),
            point("C", c),
            NamedPoint {
                name: "D".into(),
                at: [-2.0 * k.asin(), 0.0],
            },
        ],
    }
}

/// Energies of all stable equilibria over an n x n grid, sorted.
pub fn stable_energies(n: usize) -> Vec<Vec<f64>> {
    let mut found = vec![[Vec::new(), Vec::new()]; n * n];
    let mut ps = graded(500, 400.0);
    ps.extend(fold_chart(1, 60).into_iter().map(|(p, _)| p));
    ps.sort_by(f64::total_cmp);
    let (rows, columns) = (ps.len(), 140);
    let grid: Vec<Vec<([f64; 2], f64)>> = ps
        .iter()
        .map(|&p| {
            let end = folds_at(p.clamp(-12.0, 12.0), 1)[0];
            (0..columns)
                .map(|b| {
                    let u = b as f64 / (columns - 1) as f64;
                    let q = at(p, w_between(p, end, 1e-5 + (1.0 - 1e-5) * u));
                    (q.r, q.energy)
                })
                .collect()
        })
        .collect();
    let mut cover = |half: usize, a: ([f64; 2], f64), b: ([f64; 2], f64), c: ([f64; 2], f64)| {
        let scale = 0.5 * (n - 1) as f64;
        let px = |r: [f64; 2]| {
            [
                (r[0] + 1.0) * scale + 1.234e-5,
                (r[1] + 1.0) * scale + 2.345e-5,
            ]
        };
        let (pa, pb, pc) = (px(a.0), px(b.0), px(c.0));
        let area = (pb[0] - pa[0]) * (pc[1] - pa[1]) - (pb[1] - pa[1]) * (pc[0] - pa[0]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let lo = |i: usize| pa[i].min(pb[i]).min(pc[i]).ceil().max(0.0) as usize;
        let hi =
            |i: usize| (pa[i].max(pb[i]).max(pc[i]).floor().max(-1.0) as i64).min(n as i64 - 1);
        for j in lo(1) as i64..=hi(1) {
            for i in lo(0) as i64..=hi(0) {
                let (x, y) = (i as f64, j as f64);
                let side = |p: [f64; 2], q: [f64; 2]| {
                    (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
                };
                let (u, v, w) = (
                    side(pb, pc) / area,
                    side(pc, pa) / area,
                    side(pa, pb) / area,
                );
                if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                    found[j as usize * n + i as usize][half].push(u * a.1 + v * b.1 + w * c.1);
                }
            }
        }
    };
    for i in 0..rows - 1 {
        for j in 0..columns - 1 {
            let (a, b, c, d) = (
                grid[i][j],
                grid[i + 1][j],
                grid[i + 1][j + 1],
                grid[i][j + 1],
            );
            let half = usize::from(ps[i] + ps[i + 1] > 0.0);
            cover(half, a, b, c);
            cover(half, a, c, d);
        }
    }
    let merge = |halves: [Vec<f64>; 2]| {
        let mut all = Vec::new();
        for mut list in halves {
            list.sort_by(f64::total_cmp);
            // Slivers of neighbouring cells may cover a point twice.
            list.dedup_by(|b, a| *b - *a < 0.003 * *b);
            all.extend(list);
        }
        all.sort_by(f64::total_cmp);
        all
    };
    found.into_iter().map(merge).collect()
}

pub fn fold_map_data(n: usize, samples: usize) -> FoldMap {
    let found = stable_energies(n);
    let mut m = 0;
    let counts = Field::over_disc(n, 1.0, |x, y| {
        m += 1;
        // The samples miss a sliver at the edge of the disc.
        if x.hypot(y) > 0.975 {
            f64::NAN
        } else {
            found[m - 1].len() as f64
        }
    });
    FoldMap {
        counts,
        folds: fold_curves(3, samples),
        cusps: vec![
            [-0.1366, -0.157],
            [-0.1366, 0.157],
            [0.188, -0.088],
            [0.188, 0.088],
        ],
        units: AxisUnits::default(),
    }
}

pub fn landscape_data(n: usize, samples: usize) -> EnergyLandscape {
    let found = stable_energies(n);
    let field = |k: usize| {
        let mut m = 0;
        Field::over_disc(n, 1.0, |x, y| {
            m += 1;
            let value = found[m - 1].get(k).filter(|_| x.hypot(y) < 0.98);
            value.copied().unwrap_or(f64::NAN)
        })
    };
    EnergyLandscape {
        panels: vec![
            ("lowest stable".into(), field(0)),
            ("second stable".into(), field(1)),
        ],
        folds: fold_curves(1, samples).remove(0),
        range: Some([0.0, 60.0]),
        ..EnergyLandscape::default()
    }
}

pub fn lines_data() -> Lines {
    let tolerances: Vec<f64> = (4..14).map(|n| 10f64.powi(-n)).collect();
    let series = |name: &str, order: f64, cost: f64, trace| Series {
        name: name.into(),
        x: tolerances
            .iter()
            .map(|t| cost * t.powf(-1.0 / order))
            .collect(),
        y: tolerances
            .iter()
            .enumerate()
            .map(|(i, t)| t * (2.0 + (i as f64).sin()))
            .collect(),
        trace,
        colour: None,
    };
    Lines {
        title: "Motion W: error against work".into(),
        x_label: "evaluations of the force".into(),
        y_label: "error of r(1), relative".into(),
        x_log: true,
        y_log: true,
        series: vec![
            series("DOP853, desingularised", 8.0, 900.0, LineStyle::LineMarks),
            series("DOP853, plain", 7.0, 1500.0, LineStyle::LineMarks),
            series("RK4", 4.0, 500.0, LineStyle::LineMarks),
        ],
        ..Lines::default()
    }
}
