//! Published numbers of rods: the library's values, those of independent scripts, those in print.
//!
//! `cargo run --release --example published` prints the table of docs/validation/rods.md.

mod numbers;

fn main() -> snaprod::Result<()> {
    println!(
        "| case | quantity | ours | computed apart | distance | printed | source | distance |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut worst = 0.0_f64;
    for number in numbers::all()? {
        println!("{number}");
        assert!(number.distance() < numbers::BAR, "{number}");
        worst = worst.max(number.distance());
    }
    println!("\nLargest distance to the numbers computed apart: {worst:.1e}");
    Ok(())
}
