//! Runs the command and turns its outcome into an exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(bagreel::cli::run(std::env::args_os()))
}
