//! The `snaprod` program: parses, calls the library, writes.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
