//! Consistency of the documents: cited sections exist, and every data file has a recipe.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn rust_files(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("a directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// Number at the start of `text`, such as 2.5.
fn section(text: &str) -> Option<String> {
    let number: String = text
        .chars()
        .take_while(|c| c.is_ascii_digit() || *c == '.')
        .collect();
    let number = number.trim_end_matches('.').to_owned();
    (!number.is_empty()).then_some(number)
}

/// Catches a citation of a missing section of the theory, or of a missing benchmark.
#[test]
fn citations_lead_to_headings() {
    let mut headings = Vec::new();
    for chapter in fs::read_dir(root().join("docs/theory")).expect("the chapters") {
        let text = read(&chapter.expect("a chapter").path());
        let titles = text.lines().filter(|line| line.starts_with('#'));
        headings.extend(titles.filter_map(|line| section(line.trim_start_matches(['#', ' ']))));
    }
    let benchmarks = read(&root().join("docs/validation/rods.md"));
    let mut files = Vec::new();
    for directory in [
        "src",
        "core/src",
        "core/tests",
        "systems/src",
        "waves/src",
        "walls/src",
        "motion/src",
        "tests",
        "examples",
        "benches",
    ] {
        rust_files(&root().join(directory), &mut files);
    }
    let mut cited = 0;
    for path in files {
        let text = read(&path);
        for (at, _) in text.match_indices("theory ") {
            let rest = &text[at + "theory ".len()..];
            let rest = rest.strip_prefix("Sec. ").unwrap_or(rest);
            if let Some(number) = section(rest) {
                cited += 1;
                assert!(
                    headings.contains(&number),
                    "{}: theory {number} is not in docs/theory",
                    path.display()
                );
            }
        }
        for (at, _) in text.match_indices("benchmark B") {
            let name: String = text[at + "benchmark ".len()..]
                .chars()
                .take_while(char::is_ascii_alphanumeric)
                .collect();
            assert!(
                benchmarks.contains(&format!("| {name} |")),
                "{}: benchmark {name} is not in docs/validation/rods.md",
                path.display()
            );
        }
    }
    assert!(cited >= 15, "only {cited} citations found");
}

/// Catches reference data without a recipe, and a recipe that tools/README.md does not put in order.
#[test]
fn data_and_tools_are_listed() {
    let list = read(&root().join("tools/README.md"));
    for directory in ["tests/data", "tools"] {
        for entry in fs::read_dir(root().join(directory)).expect("a directory") {
            let entry = entry.expect("an entry");
            let name = entry.file_name().into_string().expect("a name");
            // Cache directory of Python.
            if name != "README.md" && name != "__pycache__" {
                assert!(
                    list.contains(&format!("`{name}`")),
                    "tools/README.md has no line for {directory}/{name}"
                );
            }
        }
    }
}

/// Catches file names in the design document that are out of date.
#[test]
fn design_names_files_that_exist() {
    let mut documents = vec![root().join("DESIGN.md")];
    for entry in fs::read_dir(root().join("docs/decisions")).expect("docs/decisions") {
        documents.push(entry.expect("an entry").path());
    }
    let rooms = [
        "src/",
        "core/",
        "systems/",
        "waves/",
        "walls/",
        "motion/",
        "plot/",
        "python/",
        "play/",
        "benches/",
        "examples/",
        "docs/",
        "tests/",
        "tools/",
    ];
    let mut named = 0;
    for document in documents {
        let text = read(&document);
        for name in text.split('`').skip(1).step_by(2) {
            if rooms.iter().any(|room| name.starts_with(room)) {
                named += 1;
                assert!(
                    root().join(name).exists(),
                    "{}: there is no {name}",
                    document.display()
                );
            }
        }
    }
    assert!(named > 80, "only {named} names");
}
