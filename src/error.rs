//! The one error type of the library: every variant prints as a single line that names the file,
//! line or key at fault.

use std::path::{Path, PathBuf};

/// What can go wrong between a command line and an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", shown(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file was read, but what it says cannot be used.
    #[error("{}{}: {message}", shown(path), line.map(|n| format!(":{n}")).unwrap_or_default())]
    Input {
        /// The file.
        path: PathBuf,
        /// One-based line, where there is one.
        line: Option<usize>,
        /// What is wrong, naming the key where there is one.
        message: String,
    },
    /// A scene file names a mesh that is in none of the folders where it may be. Apart from
    /// [`Error::Input`] so that tests can skip a scene whose meshes were not fetched.
    #[error(
        "{}{}: mesh {} is absent: looked in {}; {hint}",
        shown(scene),
        line.map(|n| format!(":{n}")).unwrap_or_default(),
        shown(mesh),
        looked_in.iter().map(|p| shown(p)).collect::<Vec<_>>().join(", ")
    )]
    MissingMesh {
        /// The scene file.
        scene: PathBuf,
        /// One-based line of the `file` key.
        line: Option<usize>,
        /// The mesh file as the scene names it.
        mesh: PathBuf,
        /// Every folder tried, in order.
        looked_in: Vec<PathBuf>,
        /// How to provide it: the environment variable, and where the scene says to get it.
        hint: String,
    },
    /// A command-line value or a backend spec that does not exist; the message lists the choices.
    #[error("{0}")]
    Usage(String),
    /// A backend could not be made or has failed.
    #[error("backend {backend}: {message}")]
    Backend {
        /// The backend's spec as given.
        backend: String,
        /// What went wrong.
        message: String,
    },
    /// A check that was asked for did not hold (`--require-agreement`).
    #[error("{0}")]
    CheckFailed(String),
}

/// `std::result::Result` with [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Io`] for `path`; shaped for `map_err`.
    pub fn io(path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// An [`Error::Input`] for a whole file.
    pub fn input(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Input { path: path.as_ref().to_path_buf(), line: None, message: message.into() }
    }

    /// An [`Error::Input`] for one line of a file.
    pub fn input_line(path: impl AsRef<Path>, line: usize, message: impl Into<String>) -> Self {
        Self::Input { path: path.as_ref().to_path_buf(), line: Some(line), message: message.into() }
    }

    /// The process exit status that stands for this error: 1 error, 2 usage, 3 failed check.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::CheckFailed(_) => 3,
            _ => 1,
        }
    }
}

/// A path on one line, whatever its name holds.
fn shown(path: &Path) -> String {
    one_line(&path.display().to_string())
}

/// `text` with control characters escaped, for messages that must stay on one line.
pub(crate) fn one_line(text: &str) -> String {
    let escape = |c: char| {
        let printed = (!c.is_control()).then_some(c);
        printed.into_iter().chain(c.escape_default().filter(move |_| c.is_control()))
    };
    text.chars().flat_map(escape).collect()
}
