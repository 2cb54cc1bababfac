//! What to render: size, samples, passes.

use super::adaptive::Adaptive;
use super::light_sampling::LightSampling;
use super::plan::Plan;
use super::sampler::SamplerEntry;
use crate::{Error, Result};

/// A kind of shadow rays that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pass {
    /// Ambient occlusion up to a radius.
    AmbientOcclusion,
    /// Ambient occlusion without a limit.
    AmbientOcclusionUnbounded,
    /// Rays to every light of the scene.
    Shadow,
}

impl Pass {
    /// All passes, in the order in which they are rendered.
    pub const ALL: [Self; 3] =
        [Self::AmbientOcclusion, Self::AmbientOcclusionUnbounded, Self::Shadow];

    /// All passes that have rays in `scene`: shadows need a light.
    pub fn all_of(scene: &crate::scene::Scene) -> Vec<Self> {
        let has = |pass: &Self| *pass != Self::Shadow || !scene.lights.is_empty();
        Self::ALL.into_iter().filter(has).collect()
    }

    /// As typed and as in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::AmbientOcclusion => "ao",
            Self::AmbientOcclusionUnbounded => "ao-unbounded",
            Self::Shadow => "shadow",
        }
    }

    /// What it is, in a line.
    pub const fn about(self) -> &'static str {
        match self {
            Self::AmbientOcclusion => "ambient occlusion up to a radius",
            Self::AmbientOcclusionUnbounded => "ambient occlusion without a limit",
            Self::Shadow => "soft shadows of the scene's lights",
        }
    }
}

impl std::str::FromStr for Pass {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|pass| pass.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::Usage(format!("no pass {name:?}: choose from {names}"))
        })
    }
}

/// A class of shadow rays: rays that are alike enough to be measured together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayClass {
    /// Cosine-weighted rays of a finite length.
    AmbientOcclusion,
    /// Cosine-weighted rays without end.
    AmbientOcclusionUnbounded,
    /// Rays to one light.
    Shadow {
        /// Its index in the scene.
        light: usize,
    },
}

impl RayClass {
    /// The pass it belongs to.
    pub const fn pass(self) -> Pass {
        match self {
            Self::AmbientOcclusion => Pass::AmbientOcclusion,
            Self::AmbientOcclusionUnbounded => Pass::AmbientOcclusionUnbounded,
            Self::Shadow { .. } => Pass::Shadow,
        }
    }
}

/// What to render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels, at least 1 each.
    pub size: [u32; 2],
    /// Shadow rays of each class for one camera sample, at least 1; powers of two are best. On the
    /// mean where sampling is adaptive.
    pub spp: u32,
    /// Camera rays in a pixel: 1 goes through its centre, more are spread over it.
    pub camera_samples: u32,
    /// Seed of all samples.
    pub seed: u64,
    /// Length of finite ambient-occlusion rays in scene units, positive and finite.
    pub ao_radius: f32,
    /// Which rays to trace; at least one, in any order.
    pub passes: Vec<Pass>,
    /// Where samples come from.
    pub sampler: &'static SamplerEntry,
    /// How points on lights are chosen.
    pub light_sampling: LightSampling,
    /// Whether pixels get as many samples as they need; else all get `spp`.
    pub adaptive: Option<Adaptive>,
    /// Names of the layers to make, `picture` for the one without a name; all if `None`. What no
    /// such layer needs is not computed, and the others have the same bits. (`nodes` is not
    /// chosen here: counting runs have it.)
    pub layers: Option<Vec<String>>,
}

impl RenderSettings {
    /// Longest side of an image, in pixels: what PNG and OpenEXR readers in the field take.
    pub const MAX_SIDE: u32 = 65_535;
    /// Most pixels of an image.
    pub const MAX_PIXELS: u64 = 1 << 28;
    /// Shadow rays of one class for a camera ray, unless asked otherwise.
    pub const DEFAULT_SPP: u32 = 16;
    /// Most shadow rays of one class in a pixel.
    pub const MAX_SAMPLES: u64 = 1 << 24;

    /// Settings for a scene's own size and radius: one camera ray, 16 samples, finite ambient
    /// occlusion and shadows.
    pub fn of_scene(scene: &crate::scene::Scene) -> Self {
        Self {
            size: scene.defaults.size,
            spp: Self::DEFAULT_SPP,
            camera_samples: 1,
            seed: 0,
            ao_radius: scene.defaults.ao_radius,
            passes: vec![Pass::AmbientOcclusion, Pass::Shadow],
            sampler: SamplerEntry::sobol(),
            light_sampling: LightSampling::SolidAngle,
            adaptive: None,
            layers: None,
        }
    }

    /// Refuses settings that have no image.
    ///
    /// # Errors
    /// [`Error::Usage`] with the value at fault and what is allowed.
    pub fn check(&self) -> Result<()> {
        let [width, height] = self.size;
        let pixels = u64::from(width) * u64::from(height);
        let samples = u64::from(self.spp) * u64::from(self.camera_samples);
        let refuse = |message: String| Err(Error::Usage(message));
        if pixels == 0 {
            return refuse(format!("image size {width} x {height} has no pixels"));
        }
        if width.max(height) > Self::MAX_SIDE || pixels > Self::MAX_PIXELS {
            let (side, most) = (Self::MAX_SIDE, Self::MAX_PIXELS);
            return refuse(format!(
                "image size {width} x {height} is too large: at most {side} a side and {most} pixels"
            ));
        }
        if self.spp == 0 {
            return refuse("samples per pixel must be at least 1".into());
        }
        if self.camera_samples == 0 {
            return refuse("camera samples must be at least 1".into());
        }
        if samples > Self::MAX_SAMPLES {
            let (spp, camera, most) = (self.spp, self.camera_samples, Self::MAX_SAMPLES);
            return refuse(format!(
                "{camera} camera samples of {spp} samples are too many: at most {most} in a pixel"
            ));
        }
        if !(self.ao_radius > 0.0 && self.ao_radius.is_finite()) {
            let radius = self.ao_radius;
            return refuse(format!("ambient-occlusion radius {radius} is not positive and finite"));
        }
        if self.passes.is_empty() {
            let names = Pass::ALL.map(Pass::name).join(", ");
            return refuse(format!("no pass to render: choose from {names}"));
        }
        self.adaptive.map_or(Ok(()), |adaptive| adaptive.check(self))
    }

    /// Refuses settings that have no image of `scene`: also those that [`check`](Self::check) does.
    ///
    /// # Errors
    /// [`Error::Usage`] with the value at fault and what is allowed.
    pub fn check_for(&self, scene: &crate::scene::Scene) -> Result<()> {
        Plan::new(scene, self).map(drop)
    }

    /// The settings as image metadata, names and values.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let passes: Vec<_> = self.passes.iter().map(|pass| pass.name()).collect();
        let mut metadata = vec![
            ("sato:seed", self.seed.to_string()),
            ("sato:spp", self.spp.to_string()),
            ("sato:camera-samples", self.camera_samples.to_string()),
            ("sato:ao-radius", self.ao_radius.to_string()),
            ("sato:passes", passes.join(",")),
            ("sato:sampler", self.sampler.name.into()),
            ("sato:light-sampling", self.light_sampling.name().into()),
        ];
        if let Some(Adaptive { most }) = self.adaptive {
            metadata.push(("sato:adaptive", most.to_string()));
        }
        metadata.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> RenderSettings {
        RenderSettings {
            size: [640, 480],
            spp: 16,
            camera_samples: 1,
            seed: 0,
            ao_radius: 1.0,
            passes: vec![Pass::AmbientOcclusion],
            sampler: SamplerEntry::sobol(),
            light_sampling: LightSampling::SolidAngle,
            adaptive: None,
            layers: None,
        }
    }

    #[test]
    fn settings_without_an_image_are_refused() {
        good().check().unwrap();
        type Spoil = fn(&mut RenderSettings);
        let cases: [(&str, Spoil); 14] = [
            ("0 x 480 has no pixels", |s| s.size[0] = 0),
            ("640 x 0 has no pixels", |s| s.size[1] = 0),
            ("too large", |s| s.size = [u32::MAX; 2]),
            ("too large", |s| s.size = [60_000; 2]),
            ("samples per pixel", |s| s.spp = 0),
            ("camera samples", |s| s.camera_samples = 0),
            ("too many", |s| (s.spp, s.camera_samples) = (u32::MAX, u32::MAX)),
            ("radius NaN", |s| s.ao_radius = f32::NAN),
            ("no pass", |s| s.passes.clear()),
            ("1 camera sample, not 2", |s| {
                (s.adaptive, s.camera_samples) = (Some(Adaptive { most: 64 }), 2);
            }),
            ("multiple of 4 samples, not 18", |s| {
                (s.adaptive, s.spp) = (Some(Adaptive { most: 64 }), 18);
            }),
            ("up to 15 samples: 16, the mean", |s| s.adaptive = Some(Adaptive { most: 15 })),
            ("up to 0 samples", |s| s.adaptive = Some(Adaptive { most: 0 })),
            ("up to 16777217 samples", |s| s.adaptive = Some(Adaptive { most: (1 << 24) + 1 })),
        ];
        for (message, spoil) in cases {
            let mut settings = good();
            spoil(&mut settings);
            let error = settings.check().unwrap_err();
            assert!(matches!(error, Error::Usage(_)));
            assert!(error.to_string().contains(message), "{error}");
        }
        for radius in [0.0, -1.0, f32::INFINITY] {
            assert!(RenderSettings { ao_radius: radius, ..good() }.check().is_err());
        }
    }

    #[test]
    fn passes_are_found_by_name() {
        for pass in Pass::ALL {
            assert_eq!(pass.name().parse::<Pass>().unwrap(), pass);
        }
        let error = "aoo".parse::<Pass>().unwrap_err().to_string();
        assert_eq!(error, "no pass \"aoo\": choose from ao, ao-unbounded, shadow");
    }
}
