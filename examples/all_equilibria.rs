//! All equilibria of a rod with a given end position: number and stability.
//!
//! `cargo run --release --example all_equilibria`

use snaprod::elastica::{equilibria_at, fold_at};

fn main() -> snaprod::Result<()> {
    // Held at the clamp itself, the end makes closed loops: 2E = K, once, twice, three times around,
    // each with its mirror image. B2 gives k = .908908557548541 for the once-closed figure.
    let closed = equilibria_at(0.0, 0.0, 14.0)?;
    println!("at the clamp:");
    for f in &closed {
        let e = &f.equilibrium;
        println!(
            "  {}  lambda {:.9}  k {:.12}  energy {:9.6}  index {}",
            e.sheet, e.lambda, e.k, e.energy, f.index
        );
        assert!((e.k - 0.908908557548541).abs() < 1e-13);
    }
    assert_eq!(closed.len(), 6);
    // Bending energy of n figures on a rod of length 1 grows like n^2.
    let ratio = closed[2].equilibrium.energy / closed[0].equilibrium.energy;
    assert!((ratio - 4.0).abs() < 1e-9);

    // On the first fold two equilibria merge; a step inwards there are both, a step outwards neither.
    let fold = fold_at(1, 0.4)?.equilibrium;
    let moved = |step: f64| equilibria_at(fold.x * (1.0 + step), fold.y * (1.0 + step), 7.0);
    let counts = [moved(-1e-6)?.len(), moved(0.0)?.len(), moved(1e-6)?.len()];
    println!(
        "across the fold at ({:.6}, {:.6}): {counts:?} equilibria with lambda < 7",
        fold.x, fold.y
    );
    assert_eq!(counts[0], counts[1] + 1);
    assert_eq!(counts[1], counts[2] + 1);
    Ok(())
}
