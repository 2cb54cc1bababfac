//! Where results go: files in one folder, and the rows of the record.

use crate::Result;
use crate::chart::{Body, Chart};
use crate::output::write_atomically;
use crate::report::{command_line, cpu_name, write_csv};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// The results' folder, and what has been written there.
#[derive(Debug)]
pub struct Output {
    folder: PathBuf,
    scenes: Vec<String>,
    footnote: String,
    rows: serde_json::Map<String, serde_json::Value>,
    files: Vec<String>,
}

impl Output {
    /// Nothing is written yet. `scenes` are the names of what is measured.
    pub fn new(folder: PathBuf, scenes: &[String]) -> Self {
        let cpu = cpu_name().unwrap_or_else(|| "unknown processor".into());
        Self {
            folder,
            scenes: scenes.to_vec(),
            footnote: format!("{} · {cpu}", command_line().join(" ")),
            rows: serde_json::Map::new(),
            files: Vec::new(),
        }
    }

    /// The names of the scenes, in order.
    pub fn scenes(&self) -> &[String] {
        &self.scenes
    }

    /// Puts rows into the record under a name and into `name.csv`.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) naming the file.
    pub fn rows(&mut self, name: &str, rows: &[impl Serialize]) -> Result<()> {
        let file = format!("{name}.csv");
        write_csv(&self.folder.join(&file), rows)?;
        self.files.push(file);
        let value = serde_json::to_value(rows).expect("rows are plain records");
        self.rows.insert(name.to_string(), value);
        Ok(())
    }

    /// Draws a chart as `name.png` and `name.svg`.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) naming the file.
    pub fn chart(&mut self, name: &str, title: &str, subtitle: &str, body: Body) -> Result<()> {
        self.made(title, subtitle, body).write(&self.folder.join(name))?;
        self.files.extend([format!("{name}.png"), format!("{name}.svg")]);
        Ok(())
    }

    /// Draws a chart as `name.png` only: of pictures.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) naming the file.
    pub fn pictures(&mut self, name: &str, title: &str, subtitle: &str, body: Body) -> Result<()> {
        self.made(title, subtitle, body).write_png(&self.folder.join(name))?;
        self.files.push(format!("{name}.png"));
        Ok(())
    }

    fn made(&self, title: &str, subtitle: &str, body: Body) -> Chart {
        let footnote = self.footnote.clone();
        Chart { title: title.into(), subtitle: subtitle.into(), footnote, body }
    }

    /// Writes `text` and an end of line as the file `name`.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) naming the file.
    pub fn write_text(&mut self, name: &str, text: &str) -> Result<()> {
        write_atomically(self.folder.join(name), |out| writeln!(out, "{text}"))?;
        self.files.push(name.to_string());
        Ok(())
    }

    /// The rows by name, and the files.
    pub fn into_record(self) -> (serde_json::Map<String, serde_json::Value>, Vec<String>) {
        (self.rows, self.files)
    }
}
