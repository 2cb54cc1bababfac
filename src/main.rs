//! The `sato` command.

fn main() -> std::process::ExitCode {
    sato::cli::run()
}
