//! The `snaprod` program.

fn main() -> std::process::ExitCode {
    snaprod::cli::main()
}
