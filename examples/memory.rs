//! Memory kernel of the end of a viscoelastic rod, in closed form: shear with flexure, a Maxwell branch, and no
//! memory.
//!
//! `cargo run --release --example memory`

use nalgebra::Matrix6;
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Maxwell, Viscoelastic, Viscosity};
use snaprod::viscoelastic::kernel::{MemoryKernel, commuting};
use std::sync::Arc;

fn assert_near(got: f64, want: f64, what: &str) {
    println!("{what:<44}{got:.12}");
    assert!((got / want - 1.0).abs() < 1e-11, "{what}: {got}, {want}");
}

fn main() -> snaprod::Result<()> {
    // A cantilever of length L, welded to its body, that bends and shears: flexure retards at x_b, shear at x_s.
    let length: f64 = 0.4;
    let (bending, shear) = (2.0, 90.0);
    let (flexural, shearing) = (0.25, 1.5);
    let elastic = Linear::diagonal([bending; 2], 1.0)?.with_shear([shear; 2])?;
    let viscosity = Viscosity::diagonal([flexural; 2], 0.1)?.with_shear([shearing; 2])?;
    let rod = Viscoelastic::new(Arc::new(elastic), Arc::new(KelvinVoigt::new(viscosity)))?;
    assert!(!commuting(&rod, length)?.holds);
    let kernel = MemoryKernel::new(&rod, length)?;
    // One exponential in each plane, with a rate between the two.
    let (x_b, x_s) = (bending / flexural, shear / shearing);
    let (g_b, g_s) = (length.powi(3) / 12.0 / flexural, length / shearing);
    let rate = (x_s * g_b + x_b * g_s) / (g_b + g_s);
    println!("flexure retards at {x_b}, shear at {x_s}:");
    assert_eq!(kernel.modes().len(), 2);
    for mode in kernel.modes() {
        assert_near(mode.rate, rate, "  rate of the memory");
    }
    // The dashpot follows from the viscosities alone, the spring from the stiffnesses.
    let spring = (length.powi(3) / 12.0 / bending + length / shear).recip();
    assert_near(
        kernel.instantaneous()[(3, 3)],
        (g_b + g_s).recip(),
        "  dashpot",
    );
    assert_near(kernel.relaxed()[(3, 3)], spring, "  spring");
    // The wrench after a step of the displacement r1 starts from R(0) = dashpot^2 (x_b g_b + x_s g_s), and relaxes.
    let glassy = (x_b * g_b + x_s * g_s) / (g_b + g_s).powi(2);
    assert_near(kernel.glassy()[(3, 3)], glassy, "  R(0)");
    let t = 0.02;
    let after = spring + (glassy - spring) * (-rate * t).exp();
    assert_near(kernel.wrench_after_step(t)[(3, 3)], after, "  R(0.02)");

    // The planar elastica with a Maxwell branch, its end free to turn: R(t) = 3 (EI + E exp(-t/time)).
    let planar = Linear::diagonal([1.0; 2], 1.0)?;
    let friction = Viscosity::diagonal([0.1; 2], 0.1)?;
    let plain = Viscoelastic::new(Arc::new(planar), Arc::new(KelvinVoigt::new(friction)))?;
    let mut modulus = Matrix6::zeros();
    modulus[(0, 0)] = 1.5;
    let branched = plain.clone().with_branch(Maxwell::new(modulus, 4.0)?)?;
    let lateral = [false, false, false, false, true, false];
    let kernel = MemoryKernel::carrying(&branched, 1.0, lateral)?;
    println!("the elastica with a Maxwell branch:");
    assert_eq!(kernel.modes().len(), 1);
    assert_near(kernel.modes()[0].rate, 0.25, "  rate of the memory");
    let after = 3.0 * (1.0 + 1.5 * (-0.25_f64 * 2.0).exp());
    assert_near(kernel.wrench_after_step(2.0)[(4, 4)], after, "  R(2)");

    // Without a branch the elastica responds to small motions as a spring and a dashpot in parallel.
    let kernel = MemoryKernel::carrying(&plain, 1.0, lateral)?;
    println!("and without:");
    assert!(kernel.commuting().holds && kernel.modes().is_empty());
    assert_near(kernel.relaxed()[(4, 4)], 3.0, "  spring 3 EI/L^3");
    assert_near(kernel.instantaneous()[(4, 4)], 0.3, "  dashpot 3 eta/L^3");
    Ok(())
}
