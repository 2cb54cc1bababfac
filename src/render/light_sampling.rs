//! How points on lights are chosen.

use crate::{Error, Result};

/// A way to choose points on lights that have an extent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightSampling {
    /// Uniform in the solid angle in which the light is seen, where a map is known.
    #[default]
    SolidAngle,
    /// Uniform over the light's surface.
    Area,
}

impl LightSampling {
    /// All ways, the default first.
    pub const ALL: [Self; 2] = [Self::SolidAngle, Self::Area];

    /// As typed and as in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SolidAngle => "solid-angle",
            Self::Area => "area",
        }
    }

    /// What it is, in a line.
    pub const fn about(self) -> &'static str {
        match self {
            Self::SolidAngle => {
                "uniform in solid angle for quads with right angles and spheres, else in area"
            }
            Self::Area => "uniform over the light's surface, for comparison",
        }
    }
}

impl std::str::FromStr for LightSampling {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|way| way.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::Usage(format!("no way to sample lights {name:?}: choose from {names}"))
        })
    }
}
