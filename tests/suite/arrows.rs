//! Layering of the modules: a module uses only modules to its left.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules from left to right; modules of one group do not use each other.
const ORDER: [&[&str]; 16] = [
    &["error"],
    &["math"],
    &["solve"],
    &["obstacle"],
    &["section"],
    &["manifold"],
    &["elastica"],
    &["rod"],
    &["body"],
    &["contact"],
    &["viscoelastic"],
    &["assembly"],
    &["full_mass"],
    &["motion"],
    &["scene"],
    &["study"],
];

fn rank(module: &str) -> Option<usize> {
    ORDER.iter().position(|group| group.contains(&module))
}

fn sources(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("src") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// Catches a use of a module further right by `use crate::` or a path, for example a figure with computations.
#[test]
fn no_arrow_points_back() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for root in ["src", "core/src", "systems/src"] {
        sources(&here.join(root), &mut files);
    }
    assert!(files.len() > 200, "only {} files", files.len());
    let mut faults = Vec::new();
    for file in files {
        let inside = file.strip_prefix(here).expect("below the root");
        let inside = inside
            .strip_prefix("core/src")
            .or_else(|_| inside.strip_prefix("systems/src"))
            .or_else(|_| inside.strip_prefix("src"))
            .expect("below src");
        let first = inside
            .iter()
            .next()
            .and_then(|c| c.to_str())
            .expect("a name");
        // lib.rs re-exports; main.rs and cli stand rightmost.
        let Some(here) = rank(first.trim_end_matches(".rs")) else {
            continue;
        };
        let text = fs::read_to_string(&file).expect("readable");
        for part in text.split("crate::").skip(1) {
            let module: String = part
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            let neighbour = module != first.trim_end_matches(".rs");
            if rank(&module).is_some_and(|there| there > here || there == here && neighbour) {
                faults.push(format!("{} uses crate::{module}", inside.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Figures are a separate crate, which could use all of the core: of the core only its errors are allowed.
#[test]
fn figures_compute_nothing() {
    let mut files = Vec::new();
    sources(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("plot/src"),
        &mut files,
    );
    for file in files {
        let text = fs::read_to_string(&file).expect("readable");
        for part in text.split("snaprod_core::").skip(1) {
            assert!(
                part.starts_with("error"),
                "{} uses snaprod_core::{}",
                file.display(),
                &part[..part.len().min(30)]
            );
        }
    }
}
