//! What is compared: a backend with the sampling and the skipping around it, in one grammar.

use crate::backend::BackendSpec;
use crate::render::{LightSampling, SamplerEntry, Skips};
use crate::{Error, Result};
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// A way to render: `BACKEND [sampler=NAME] [light-sampling=NAME] [skip=NAMES]`, words with blanks
/// between, or the name of a [`Preset`] and what is to be otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct RendererSpec {
    /// As given, which is what tables and charts call it.
    pub label: String,
    /// What traces.
    pub backend: BackendSpec,
    /// Where samples come from.
    pub sampler: &'static SamplerEntry,
    /// How points on lights are chosen.
    pub light_sampling: LightSampling,
    /// What is left out.
    pub skip: Skips,
}

/// A renderer with a name.
#[derive(Debug)]
pub struct Preset {
    /// As typed in place of a backend.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// What it stands for in this build of the program.
    pub spec: fn() -> String,
}

/// Renderers with names, those that are compared unless others are named. Each differs from the one
/// before in one respect, so that the ratios between them are the shares of a whole.
pub static PRESETS: &[&Preset] = &[
    &Preset {
        name: "plain",
        about: "single rays (Embree's, if it is in this program), independent area samples, all rays",
        spec: || plain("sampler=independent light-sampling=area"),
    },
    &Preset {
        name: "plain-best-samples",
        about: "the same with Sobol points, spread over the solid angle of lights",
        spec: || plain("sampler=sobol light-sampling=solid-angle"),
    },
    &Preset {
        name: "native-all-rays",
        about: "the same samples, traced by bvh8",
        spec: || "bvh8 sampler=sobol light-sampling=solid-angle skip=none".into(),
    },
    &Preset {
        name: "native",
        about: "the same, without what cannot change the picture",
        spec: || "bvh8 sampler=sobol light-sampling=solid-angle skip=all".into(),
    },
];

fn plain(sampling: &str) -> String {
    let embree = "embree:quality=high,width=1";
    let has_embree =
        embree.parse::<BackendSpec>().is_ok_and(|spec| spec.entry().unavailable.is_none());
    format!("{} {sampling} skip=none", if has_embree { embree } else { "bvh2" })
}

impl RendererSpec {
    /// Every setting, written out.
    pub fn full(&self) -> String {
        let Self { backend, sampler, light_sampling, skip, .. } = self;
        let (backend, sampler, light) = (backend.full(), sampler.name, light_sampling.name());
        format!("{backend} sampler={sampler} light-sampling={light} skip={skip}")
    }

    /// Whether both take the same samples, so that their pictures should be the same.
    pub fn has_samples_of(&self, other: &Self) -> bool {
        self.sampler == other.sampler && self.light_sampling == other.light_sampling
    }
}

impl FromStr for RendererSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let refused = |why: String| Error::Usage(format!("renderer '{}': {why}", text.trim()));
        let mut words = text.split_whitespace();
        let first = words.next().ok_or_else(|| {
            refused("expected BACKEND [sampler=NAME] [light-sampling=NAME] [skip=NAMES]".into())
        })?;
        let preset = PRESETS.iter().find(|p| p.name == first);
        let mut spec = match preset {
            Some(preset) => (preset.spec)().parse()?,
            None => Self {
                label: String::new(),
                backend: first.parse().map_err(|error: Error| {
                    let names: Vec<_> = PRESETS.iter().map(|p| p.name).collect();
                    refused(format!("{error}, nor is it one of: {}", names.join(", ")))
                })?,
                sampler: SamplerEntry::sobol(),
                light_sampling: LightSampling::default(),
                skip: Skips::default(),
            },
        };
        let mut given = Vec::new();
        for word in words {
            let (key, value) = word
                .split_once('=')
                .ok_or_else(|| refused(format!("expected key=value, got '{word}'")))?;
            if given.contains(&key) {
                return Err(refused(format!("'{key}' is given twice")));
            }
            given.push(key);
            let because = |error: Error| refused(error.to_string());
            match key {
                "sampler" => spec.sampler = SamplerEntry::find(value).map_err(because)?,
                "light-sampling" => spec.light_sampling = value.parse().map_err(because)?,
                "skip" => spec.skip = value.parse().map_err(because)?,
                _ => {
                    let keys = "one of: sampler, light-sampling, skip";
                    return Err(refused(format!("no key '{key}' ({keys})")));
                }
            }
        }
        spec.label = text.split_whitespace().collect::<Vec<_>>().join(" ");
        Ok(spec)
    }
}

impl fmt::Display for RendererSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// As printed, and written out.
impl Serialize for RendererSpec {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let mut record = serializer.serialize_struct("RendererSpec", 2)?;
        record.serialize_field("name", &self.label)?;
        record.serialize_field("spec", &self.full())?;
        record.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::catalogue::BACKENDS;

    #[test]
    fn presets_can_be_had_and_changed() {
        for preset in PRESETS {
            let spec: RendererSpec = preset.name.parse().unwrap();
            assert_eq!(spec.label, preset.name);
            assert_eq!(spec.full().parse::<RendererSpec>().unwrap().full(), spec.full());
            assert!(BACKENDS.iter().all(|b| b.name != preset.name));
        }
        let native: RendererSpec = "native".parse().unwrap();
        let changed: RendererSpec = "native  skip=none ".parse().unwrap();
        assert_eq!((changed.label.as_str(), changed.skip), ("native skip=none", Skips::NONE));
        assert!(changed.has_samples_of(&native) && changed.backend == native.backend);
        assert!(!native.has_samples_of(&"plain".parse().unwrap()));
    }

    #[test]
    fn what_does_not_exist_is_refused_in_one_line() {
        for (text, part) in [
            ("", "expected BACKEND"),
            ("bvh3", "plain-best-samples"),
            ("bvh8 quickly", "key=value"),
            ("bvh8 sampler=halton", "sobol"),
            ("bvh8 light-sampling=no", "solid-angle"),
            ("bvh8 skip=everything", "none"),
            ("bvh8 colour=red", "light-sampling"),
            ("plain skip=all skip=none", "twice"),
        ] {
            let error = text.parse::<RendererSpec>().unwrap_err();
            let message = error.to_string();
            assert!(error.exit_status() == 2 && message.contains(part), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
    }
}
