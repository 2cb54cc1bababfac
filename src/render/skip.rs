//! What need not be computed, because the picture is the same without it.

use crate::{Error, Result};

/// One reason to leave work out. None changes a bit of the picture, if the backend answers exactly: what
/// shafts say is true of each ray, and `mode=fast` errs now and then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skip {
    /// Samples that bring nothing: below the surface's horizon or on a light's dark side.
    Weightless,
    /// Lights that lie below a surface's horizon as a whole, or turn their dark side to it.
    DarkLights,
    /// Rays to a light that nothing stops, as nothing lies between.
    LitShafts,
    /// Rays to a light that one triangle stops, all of them.
    BlockedShafts,
    /// Ambient-occlusion rays of points that nothing is near to.
    OpenHemispheres,
    /// The upper part of the tree, where rays of a tile can start below it.
    EntryPoints,
    /// The tree, for rays that are stopped by what stopped others of their light, or of their kind, in
    /// this tile or the ones before it.
    LastOccluders,
    /// Geometry that no ray of the picture can meet: by [`seen_part`](super::seen_part), before
    /// anything is built.
    UnseenGeometry,
}

impl Skip {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Weightless,
        Self::DarkLights,
        Self::LitShafts,
        Self::BlockedShafts,
        Self::OpenHemispheres,
        Self::EntryPoints,
        Self::LastOccluders,
        Self::UnseenGeometry,
    ];
    /// Those that ask the backend's tree about many rays at once.
    pub(super) const SHAFTS: [Self; 4] =
        [Self::LitShafts, Self::BlockedShafts, Self::OpenHemispheres, Self::EntryPoints];

    /// As typed and as in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Weightless => "weightless",
            Self::DarkLights => "dark-lights",
            Self::LitShafts => "lit-shafts",
            Self::BlockedShafts => "blocked-shafts",
            Self::OpenHemispheres => "open-hemispheres",
            Self::EntryPoints => "entry-points",
            Self::LastOccluders => "last-occluders",
            Self::UnseenGeometry => "unseen-geometry",
        }
    }

    /// What it leaves out, in a line.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Weightless => "rays of samples below the horizon or on a light's dark side",
            Self::DarkLights => "lights wholly below a point's horizon, or turned away from it",
            Self::LitShafts => "rays to a light where nothing lies between, by tile and pixel",
            Self::BlockedShafts => "rays to a light where one triangle stops all, likewise",
            Self::OpenHemispheres => "ambient-occlusion rays where nothing is near, likewise",
            Self::EntryPoints => "the top of the tree, where a tile's rays can start below it",
            Self::LastOccluders => {
                "the tree, for rays that triangles stop which stopped others of their light or kind"
            }
            Self::UnseenGeometry => {
                "triangles that no ray of the picture can meet: not built (render)"
            }
        }
    }
}

/// Which work is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skips(u32);

impl Skips {
    /// Everything is computed.
    pub const NONE: Self = Self(0);
    /// Nothing is that need not be: the default.
    pub const ALL: Self = Self((1 << Skip::ALL.len()) - 1);

    /// Whether this is left out.
    #[inline]
    pub const fn has(self, skip: Skip) -> bool {
        self.0 >> skip as u32 & 1 == 1
    }

    /// These and one more.
    #[must_use]
    pub const fn with(self, skip: Skip) -> Self {
        Self(self.0 | 1 << skip as u32)
    }

    /// These but those that ask the backend's tree about many rays at once.
    #[must_use]
    pub fn without_shafts(self) -> Self {
        Skip::SHAFTS.into_iter().fold(self, Self::without)
    }

    /// These but one.
    #[must_use]
    pub const fn without(self, skip: Skip) -> Self {
        Self(self.0 & !(1 << skip as u32))
    }
}

impl Default for Skips {
    fn default() -> Self {
        Self::ALL
    }
}

impl std::fmt::Display for Skips {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::ALL => f.write_str("all"),
            Self::NONE => f.write_str("none"),
            some => {
                let names: Vec<_> =
                    Skip::ALL.into_iter().filter(|s| some.has(*s)).map(Skip::name).collect();
                f.write_str(&names.join(","))
            }
        }
    }
}

impl std::str::FromStr for Skips {
    type Err = Error;

    /// `all`, `none`, or names with commas between.
    fn from_str(text: &str) -> Result<Self> {
        match text {
            "all" => return Ok(Self::ALL),
            "none" => return Ok(Self::NONE),
            _ => {}
        }
        text.split(',').try_fold(Self::NONE, |skips, name| {
            let skip = Skip::ALL.into_iter().find(|skip| skip.name() == name).ok_or_else(|| {
                let names = Skip::ALL.map(Skip::name).join(", ");
                Error::Usage(format!("nothing to skip is called {name:?}: all, none, {names}"))
            })?;
            Ok(skips.with(skip))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_written_as_they_are_read() {
        for text in ["all", "none", "dark-lights", "weightless"] {
            assert_eq!(text.parse::<Skips>().unwrap().to_string(), text);
        }
        let all = Skip::ALL.map(Skip::name).join(",");
        assert_eq!(all.parse::<Skips>().unwrap(), Skips::ALL);
        for (place, skip) in Skip::ALL.into_iter().enumerate() {
            assert_eq!(skip as usize, place);
            assert!(Skips::ALL.has(skip) && !Skips::ALL.without(skip).has(skip));
        }
        let error = "weightles".parse::<Skips>().unwrap_err().to_string();
        assert!(error.contains("\"weightles\"") && error.contains("dark-lights"), "{error}");
    }
}
