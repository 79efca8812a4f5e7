//! Draws every figure of `snaprod::plot` from closed-form or made-up data into the directory given (default: `.`).
//!
//!     cargo run --release --no-default-features --features png --example plot_gallery -- out

#[path = "../tests/suite/plot_data.rs"]
mod plot_data;
#[path = "../tests/suite/plot_rods_data.rs"]
mod plot_rods_data;
#[path = "../tests/suite/plot_viscous_data.rs"]
mod plot_viscous_data;

use plot_data::*;
use plot_rods_data::*;
use plot_viscous_data::*;
use snaprod::plot::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    std::fs::create_dir_all(&directory)?;
    let m = motion(1.0);
    let figures = [
        ("snapshots", snapshots(&snapshots_data(&m), &Paper::SCREEN)?),
        ("energies", energies(&energies_data(&m), &Paper::SCREEN)?),
        (
            "path_on_surface",
            path_on_surface(&path_data(&m, 40, 56), &Paper::SCREEN)?,
        ),
        (
            "phase_portrait",
            phase_portrait(&portrait_data(), &Paper::SCREEN)?,
        ),
        (
            "sheets_lambda_alpha",
            sheets_lambda_alpha(&[sheets_lam(48, 32)], &Paper::SCREEN)?,
        ),
        (
            "sheets_over_disc",
            sheets_over_disc(&[sheets_disc(48, 32)], &Paper::SCREEN)?,
        ),
        (
            "fold_map",
            fold_map(&fold_map_data(241, 200), &Paper::SCREEN)?,
        ),
        (
            "energy_landscape",
            energy_landscape(&landscape_data(241, 200), &Paper::SCREEN)?,
        ),
        ("lines", lines(&lines_data(), &Paper::SCREEN)?),
        ("branches", branch_diagram(&pitchfork(), &Paper::SCREEN)?),
        (
            "branches_energy",
            branch_diagram(&pitchfork_energy(), &Paper::SCREEN)?,
        ),
        (
            "rods_helix",
            rod_shapes(&one(helix(2.5, 241), 0.05), &Paper::SCREEN)?,
        ),
        ("rods_knot", rod_shapes(&one(knot(), 0.0), &Paper::SCREEN)?),
        ("rods_plane", rod_shapes(&family(), &Paper::SCREEN)?),
        (
            "rods_twisted",
            rod_shapes(&twisted_family(), &Paper::SCREEN)?,
        ),
        (
            "rods_floor",
            rod_shapes(&one(bent(2.6, 0, 1), 0.0), &Paper::SCREEN)?,
        ),
        ("rods_ring", rod_shapes(&one(ring(), 0.06), &Paper::SCREEN)?),
        (
            "rods_straight",
            rod_shapes(&one(bent(0.0, 0, 1), 0.0), &Paper::SCREEN)?,
        ),
        ("rod_state", rod_state(&state(), &Paper::SCREEN)?),
        (
            "strain_map",
            strain_map(&strain_map_data(400, 60), &Paper::SCREEN)?,
        ),
        ("layer", layer(&layer_data(), &Paper::SCREEN)?),
        ("convergence", lines(&convergence_data(), &Paper::SCREEN)?),
        (
            "dissipated_against_released",
            dissipated_against_released(&losses_data(), &Paper::SCREEN)?,
        ),
        (
            "losses_over_time",
            losses_over_time(&losses_over_time_data(), &Paper::SCREEN)?,
        ),
        ("kernel", kernel(&kernel_data(), &Paper::SCREEN)?),
        (
            "rod_state_plane",
            rod_state(&plane_state(), &Paper::SCREEN)?,
        ),
    ];
    for (name, svg) in figures {
        println!("{name}: {} kB", svg.len() / 1000);
        #[cfg(feature = "png")]
        std::fs::write(format!("{directory}/{name}.png"), png(&svg, 2.0)?)?;
        std::fs::write(format!("{directory}/{name}.svg"), svg)?;
    }
    Ok(())
}
