//! The command line: one file per subcommand, and what they share.

mod animate;
mod bench;
mod compare;
mod converge;
mod list;
mod options;
mod progress;
mod rays;
mod render;
mod scene;
mod stress;

use crate::Result;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "sato", version, about, long_about = LONG_ABOUT, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const LONG_ABOUT: &str = "\
Shadow rays on CPUs: renders ambient occlusion and soft shadows with native bounding volume \
hierarchies under any traversal order, or with Intel Embree, and measures both on the same rays.

Scenes are TOML scene files, OBJ files (plain or .zst), or the names of generators. `sato list` \
prints the backends with their keys, and the generators.

SATO_PORTABLE=1 in the environment keeps the vector kernels to what every processor has; answers \
are the same.

Exit status: 0; 1 error; 2 usage; 3 when a check that was asked for fails.";

#[derive(Subcommand)]
enum Command {
    /// Render ambient occlusion and soft shadows to OpenEXR and PNG
    Render(render::Arguments),
    /// Time backends on the same recorded rays and show where they disagree
    Compare(compare::Arguments),
    /// Follow a moving scene with backends: what updates take beside tracing, frame by frame
    Animate(animate::Arguments),
    /// Run the paper's experiments (order times, speed-ups, similarity, limits), or race Embree
    Bench(bench::Arguments),
    /// Error against samples and time of renderers: backend, sampler, light sampling, skipping
    Converge(converge::Arguments),
    /// Hold every backend's answers on nasty geometry and rays against exact arithmetic
    Stress(stress::Arguments),
    /// Record shadow rays to a file, or give recorded rays to backends
    #[command(subcommand)]
    Rays(rays::Command),
    /// Look at a scene's geometry, or write it as OBJ
    #[command(subcommand)]
    Scene(scene::Command),
    /// Print every backend, builder, traversal order, experiment, stress case and scene generator
    List,
}

/// Parses the command line, does what it says, and prints an error as a single line.
pub fn run() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Animate(arguments) => animate::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Converge(arguments) => converge::run(&arguments),
        Command::Stress(arguments) => stress::run(&arguments),
        Command::Rays(command) => rays::run(&command),
        Command::Scene(command) => scene::run(&command),
        Command::List => list::run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sato: {error}");
            ExitCode::from(error.exit_status())
        }
    }
}

/// Image metadata that names the program, the command, the scene and the backend.
fn metadata(
    scene: &crate::scene::Scene,
    spec: &crate::backend::BackendSpec,
) -> Vec<(String, String)> {
    [
        ("sato:version", env!("CARGO_PKG_VERSION").to_string()),
        ("sato:command", crate::report::command_line().join(" ")),
        ("sato:scene", scene.name.clone()),
        ("sato:backend", spec.full()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .into()
}

/// Prints to standard output; a reader that has gone away (`sato list | head`) is no error.
fn print(text: &str) -> Result<()> {
    use std::io::Write;
    match writeln!(std::io::stdout(), "{}", text.trim_end()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(crate::Error::io("standard output")(error))
        }
        _ => Ok(()),
    }
}
