//! The one error type of the library: every variant prints as a single line that names the file,
//! line or key at fault.

use std::path::{Path, PathBuf};

/// What can go wrong between a command line and an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file was read, but what it says cannot be used.
    #[error("{}{}: {message}", path.display(), line.map(|n| format!(":{n}")).unwrap_or_default())]
    Input {
        /// The file.
        path: PathBuf,
        /// One-based line, where there is one.
        line: Option<usize>,
        /// What is wrong, naming the key where there is one.
        message: String,
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
