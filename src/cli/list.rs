//! `sato list`: every catalogue, as text.

use super::print;
use crate::Result;
use crate::backend::catalogue::BACKENDS;
use crate::bench::EXPERIMENTS;
use crate::converge::PRESETS;
use crate::render::{LightSampling, SAMPLERS, Skip};
use crate::scene::FORMATS;
use crate::scene::generate::GENERATORS;
use crate::stress::CASES;
use std::fmt::Write;

pub(super) fn run() -> Result<()> {
    let mut text = String::from("Backends: --backend NAME[:KEY=VALUE[,KEY=VALUE...]]\n");
    for entry in BACKENDS {
        let _ = writeln!(text, "\n  {:<8} {}", entry.name, entry.about);
        if let Some(why) = entry.unavailable {
            let _ = writeln!(text, "  {:<8} not in this program: {why}", "");
        }
        for key in entry.all_keys() {
            let _ = writeln!(text, "      {}=  {}", key.name, key.about);
            let choices = (key.choices)();
            let width = choices.iter().map(|choice| choice.name.len()).max().unwrap_or(0);
            for choice in choices {
                let mark = if choice.name == key.default { " (default)" } else { "" };
                let _ = writeln!(text, "          {:<width$} {}{mark}", choice.name, choice.about);
            }
        }
    }
    text.push_str("\nScenes: a file of one of these formats, or a generator's name\n\n");
    for format in FORMATS {
        let _ = writeln!(text, "  {:<15} {}", format.extensions.join(", "), format.about);
    }
    text.push('\n');
    for generator in GENERATORS {
        let _ = writeln!(text, "  {:<15} {}", generator.name, generator.about);
    }
    text.push_str("\nSamplers: --sampler NAME\n\n");
    for sampler in SAMPLERS {
        let _ = writeln!(text, "  {:<15} {}", sampler.name, sampler.about);
    }
    text.push_str("\nPoints on lights: --light-sampling NAME\n\n");
    for way in LightSampling::ALL {
        let _ = writeln!(text, "  {:<15} {}", way.name(), way.about());
    }
    text.push_str("\nLeft out where the picture is the same without it: --skip NAME,...\n\n");
    for skip in Skip::ALL {
        let _ = writeln!(text, "  {:<15} {}", skip.name(), skip.about());
    }
    text.push_str("\nExperiments: sato bench EXPERIMENT\n\n");
    for experiment in EXPERIMENTS {
        let mark = if experiment.of_the_paper { "" } else { " (only if named)" };
        let _ = writeln!(text, "  {:<15} {}{mark}", experiment.name, experiment.about);
    }
    text.push_str("\nRenderers: sato converge --renderer NAME, or what they stand for\n\n");
    for preset in PRESETS {
        let _ = writeln!(text, "  {:<19} {}", preset.name, preset.about);
        let _ = writeln!(text, "  {:<19} {}", "", (preset.spec)());
    }
    text.push_str("\nStress cases: sato stress --case NAME\n\n");
    for case in CASES {
        let _ = writeln!(text, "  {:<19} {}", case.name, case.about);
    }
    print(&text)
}
