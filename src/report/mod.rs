//! Reports: plain records with the units in their field names. JSON is the record; the table and
//! CSV are views of it.

mod compare;
mod csv;
mod judgement;
mod table;

pub use self::csv::write_csv;
pub use compare::{
    AgreementReport, BackendReport, ClassReport, ClassResult, CompareReport, PrimaryReport,
    SceneReport,
};
pub use judgement::{BackendJudgement, JudgementReport};
pub use table::compare_text;
pub(crate) use table::table;

use crate::output::write_atomically;
use crate::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// Grows when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 1;

/// What produced a report, and on what.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The command line.
    pub command: Vec<String>,
    /// Version of this program.
    pub sato_version: &'static str,
    /// The processor as the system names it; "unknown" where it does not.
    pub cpu: String,
    /// Operating system and instruction set of this build, as `linux-x86_64`.
    pub platform: String,
    /// Threads that built and traced.
    pub threads: usize,
    /// Seed of all samples and of random orders.
    pub seed: u64,
}

impl Provenance {
    /// Of this process.
    pub fn new(threads: usize, seed: u64) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            command: command_line(),
            sato_version: env!("CARGO_PKG_VERSION"),
            cpu: cpu_name().unwrap_or_else(|| "unknown".into()),
            platform: format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH),
            threads,
            seed,
        }
    }
}

/// The arguments of this process, the program by its bare name.
pub fn command_line() -> Vec<String> {
    let mut arguments = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
    arguments.next();
    std::iter::once("sato".to_string()).chain(arguments).collect()
}

/// The processor as the system names it.
pub fn cpu_name() -> Option<String> {
    let text = if cfg!(target_os = "linux") {
        std::fs::read_to_string("/proc/cpuinfo").ok()?
    } else {
        let sysctl = std::process::Command::new("sysctl")
            .args(["-n", "machdep.cpu.brand_string"])
            .output()
            .ok()?;
        format!("model name: {}", String::from_utf8(sysctl.stdout).ok()?)
    };
    let line = text.lines().find(|l| l.starts_with("model name") || l.starts_with("Model"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_string())
}

/// Writes any record as indented JSON.
///
/// # Errors
/// [`Error::Io`] naming the file.
pub fn write_json(path: &Path, record: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(record)
        .map_err(|e| Error::io(path)(std::io::Error::other(e)))?;
    write_atomically(path, |out| {
        use std::io::Write;
        writeln!(out, "{text}")
    })
}
