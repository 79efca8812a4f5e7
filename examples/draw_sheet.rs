//! The sheet S_0^+: samples, a check against two closed forms, and a drawing to the SVG file named, if any.
//!
//! cargo run --release --example draw_sheet -- sheet.svg

use snaprod::elastica::{fold_at, sheet_grid};
use snaprod::manifold::{Sheet, Sign};
use snaprod::math::elliptic::{complete_e, complete_k};
use snaprod::plot::{Paper, Patch, Sheets, sheets_over_disc};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sheet = Sheet {
        mode: 0,
        sign: Sign::Plus,
    };
    let grid = sheet_grid(sheet, 40, 56)?;

    // The last column is the seam w = pi, with an inflection at the clamp. There lam = 2K, and in axes turned by
    // alpha = 2 asin k the end lies at (2E/K - 1, 0) (AMV (3.17)).
    for q in grid
        .points
        .chunks(grid.columns)
        .map(|row| row[grid.columns - 1])
    {
        let kc = 1.0 / q.p.cosh();
        let along = 2.0 * complete_e(kc)? / complete_k(kc)? - 1.0;
        assert!((q.x.hypot(q.y) - along.abs()).abs() < 1e-12);
    }
    // The first fold of the nearly straight rod, beyond the end of S_0 at lam = pi.
    let fold = fold_at(1, 1e-8)?.equilibrium;
    assert!((fold.lambda - 6.017_591_002_824_488).abs() < 1e-12);

    if let Some(path) = std::env::args().nth(1) {
        let points = grid.points.iter().map(|q| [q.x, q.y, q.theta1]);
        let patch = Patch {
            name: "S₀⁺".into(),
            colour: 0,
            rows: grid.rows,
            columns: grid.columns,
            points: points.collect(),
            ..Patch::default()
        };
        let data = Sheets {
            patches: vec![patch],
            ..Sheets::default()
        };
        std::fs::write(path, sheets_over_disc(&[data], &Paper::SCREEN)?)?;
    }
    Ok(())
}
