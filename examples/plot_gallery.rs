//! Draws every figure of `snaprod::plot` from closed-form data into the directory given (default: `.`).
//!
//!     cargo run --release --no-default-features --features png --example plot_gallery -- out

#[path = "../tests/suite/plot_data.rs"]
mod plot_data;

use plot_data::*;
use snaprod::plot::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    std::fs::create_dir_all(&directory)?;
    let m = motion(1.0);
    let figures = [
        ("snapshots", snapshots(&snapshots_data(&m))?),
        ("energies", energies(&energies_data(&m))?),
        ("path_on_surface", path_on_surface(&path_data(&m, 40, 56))?),
        ("phase_portrait", phase_portrait(&portrait_data())?),
        (
            "sheets_lambda_alpha",
            sheets_lambda_alpha(&[sheets_lam(48, 32)])?,
        ),
        (
            "sheets_over_disc",
            sheets_over_disc(&[sheets_disc(48, 32)])?,
        ),
        ("fold_map", fold_map(&fold_map_data(241, 200))?),
        (
            "energy_landscape",
            energy_landscape(&landscape_data(241, 200))?,
        ),
        ("lines", lines(&lines_data())?),
    ];
    for (name, svg) in figures {
        println!("{name}: {} kB", svg.len() / 1000);
        #[cfg(feature = "png")]
        std::fs::write(format!("{directory}/{name}.png"), png(&svg, 2.0)?)?;
        std::fs::write(format!("{directory}/{name}.svg"), svg)?;
    }
    Ok(())
}
