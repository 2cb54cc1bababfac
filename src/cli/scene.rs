//! `sato scene`: look at a scene's geometry, or write it as OBJ.

use super::options::load_scene;
use super::print;
use crate::Result;
use crate::report::write_json;
use crate::scene::{SceneInfo, export};
use clap::Subcommand;
use std::path::PathBuf;

#[derive(Subcommand, Debug)]
pub(super) enum Command {
    /// Print counts, bounds, triangle sizes, defects, motion, camera and lights
    Info {
        /// Scene file (.toml), mesh (.obj, .obj.zst) or the name of a generator
        scene: String,
        /// Frame of a moving scene, counted from 0 [default: the first]
        #[arg(long, value_name = "N")]
        frame: Option<usize>,
        /// Write the figures as JSON to FILE
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Write all triangles as one OBJ file
    Export {
        /// Scene file (.toml), mesh (.obj, .obj.zst) or the name of a generator
        scene: String,
        /// Frame of a moving scene, counted from 0 [default: the first]
        #[arg(long, value_name = "N")]
        frame: Option<usize>,
        /// The file to write (.obj or .obj.zst)
        #[arg(long, short, value_name = "FILE")]
        output: PathBuf,
    },
}

pub(super) fn run(command: &Command) -> Result<()> {
    match command {
        Command::Info { scene, frame, json } => {
            let info = SceneInfo::of(&load_scene(scene, *frame, false)?);
            if let Some(path) = json {
                write_json(path, &info)?;
            }
            print(&info.to_string())
        }
        Command::Export { scene, frame, output } => {
            let scene = load_scene(scene, *frame, false)?;
            export(&scene, output)?;
            print(&format!("{} triangles in {}", scene.mesh.len(), output.display()))
        }
    }
}
