//! The picture: named layers of `f32`, and the sums that they are made of.

use super::plan::Plan;
use super::settings::{Pass, RayClass};
use super::surface::SurfacePoint;
use super::tile::{TILE_PIXELS, Tile};
use crate::ray::{VisitCounts, bit};
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// Reflectance of every surface in the picture that is meant for the eye.
const ALBEDO: f64 = 0.8;
/// Its ambient light, as a part of the mean irradiance that the lights give without shadows.
const AMBIENT_SHARE: f64 = 0.2;

/// Named layers of one size. Values are row by row from the upper left pixel.
///
/// Where a pixel sees surfaces, all layers but the first are means over the camera samples that
/// see one; where it sees none, they are 0 and `depth` is infinite.
///
/// - no name, `R G B A`: a picture for the eye. Light from a surface of albedo 0.8 under the
///   `irradiance` and a grey ambient light that `ao` attenuates (a fifth of the mean irradiance
///   without shadows; pi where no light is rendered). Premultiplied by `A`, the share of camera
///   samples that see a surface.
/// - `ao`, `ao-unbounded`, `Y`: the share of rays that nothing stops, 0 to 1.
/// - `shadow.<light>`, `Y`: the share of the light's irradiance that arrives, 0 to 1; 0 where the
///   surface is turned away from it. `shadow`, `Y`: the same of the luminance of all lights.
/// - `irradiance`, `R G B`: what arrives of all lights.
/// - `depth`, `Z`: distance from the eye in scene units. `normal`, `X Y Z`: unit geometric normal
///   towards the eye.
/// - `nodes`, `Y`: tree nodes visited per shadow ray, in counting runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: [u32; 2],
    layers: Vec<Layer>,
}

/// A named group of channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Empty for the picture that viewers show first.
    pub name: String,
    /// Its channels.
    pub channels: Vec<Channel>,
}

/// One value for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// A letter by OpenEXR's habit: `R G B A` colour, `Y` a single value, `Z` depth, `X Y Z` a
    /// vector.
    pub name: &'static str,
    /// Row by row from the upper left pixel.
    pub values: Vec<f32>,
}

impl Film {
    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// All layers.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The film with one more layer of one channel, `Y`.
    ///
    /// # Panics
    /// If there is not one value for each pixel.
    #[must_use]
    pub fn with_layer(mut self, name: &str, values: Vec<f32>) -> Self {
        let pixels = self.size.map(|n| n as usize);
        assert_eq!(values.len(), pixels[0] * pixels[1], "one value for each pixel");
        let channels = vec![Channel { name: "Y", values }];
        self.layers.push(Layer { name: name.to_string(), channels });
        self
    }

    /// The values of a channel, such as `("ao", "Y")`.
    pub fn channel(&self, layer: &str, channel: &str) -> Option<&[f32]> {
        let layer = self.layers.iter().find(|l| l.name == layer)?;
        layer.channels.iter().find(|c| c.name == channel).map(|c| c.values.as_slice())
    }
}

/// What the camera samples of a tile's pixels see.
#[derive(Clone, Debug)]
pub(super) struct PrimarySums {
    pub(super) hits: [u32; TILE_PIXELS],
    distance: [f64; TILE_PIXELS],
    normal: [DVec3; TILE_PIXELS],
}

impl Default for PrimarySums {
    fn default() -> Self {
        Self {
            hits: [0; TILE_PIXELS],
            distance: [0.0; TILE_PIXELS],
            normal: [DVec3::ZERO; TILE_PIXELS],
        }
    }
}

impl PrimarySums {
    pub(super) fn add(&mut self, slot: u8, surface: &SurfacePoint) {
        let slot = usize::from(slot);
        self.hits[slot] += 1;
        self.distance[slot] += surface.distance;
        self.normal[slot] += surface.normal;
    }
}

/// Sums over the rays of one class in a tile, each pixel's in the order of its samples.
#[derive(Clone, Debug)]
pub(super) struct ClassSums {
    /// Weight of the rays that nothing stops.
    lit: [f64; TILE_PIXELS],
    /// Weight of all rays.
    all: [f64; TILE_PIXELS],
}

/// What there is to know of a tile's pixels.
pub(super) struct TileSums {
    classes: Vec<ClassSums>,
    rays: [u64; TILE_PIXELS],
    nodes: [u64; TILE_PIXELS],
}

impl TileSums {
    pub(super) fn new(plan: &Plan) -> Self {
        let zero = ClassSums { lit: [0.0; TILE_PIXELS], all: [0.0; TILE_PIXELS] };
        Self {
            classes: vec![zero; plan.classes.len()],
            rays: [0; TILE_PIXELS],
            nodes: [0; TILE_PIXELS],
        }
    }

    /// Adds the answers to a batch. `weights` is empty where all are 1.
    pub(super) fn add(&mut self, class: usize, slots: &[u8], weights: &[f32], occluded: &[u64]) {
        let ClassSums { lit, all } = &mut self.classes[class];
        for (ray, &slot) in slots.iter().enumerate() {
            let weight = weights.get(ray).map_or(1.0, |&weight| f64::from(weight));
            all[usize::from(slot)] += weight;
            if !bit(occluded, ray) {
                lit[usize::from(slot)] += weight;
            }
        }
    }

    /// Adds samples of one pixel that are all lit, or all not. `weights` is empty where all are 1.
    pub(super) fn add_known(
        &mut self,
        class: usize,
        slot: u8,
        count: u32,
        weights: &[f32],
        is_lit: bool,
    ) {
        let ClassSums { lit, all } = &mut self.classes[class];
        let (lit, all) = (&mut lit[usize::from(slot)], &mut all[usize::from(slot)]);
        // One after the other, as if they had been traced: the same bits.
        let mut add = |weight: f64| {
            *all += weight;
            if is_lit {
                *lit += weight;
            }
        };
        if weights.is_empty() {
            add(f64::from(count));
        } else {
            weights.iter().for_each(|&weight| add(f64::from(weight)));
        }
    }

    /// Adds what the rays of a batch visited.
    pub(super) fn add_visits(&mut self, slots: &[u8], counts: &[VisitCounts]) {
        for (&slot, count) in slots.iter().zip(counts) {
            self.rays[usize::from(slot)] += 1;
            self.nodes[usize::from(slot)] += u64::from(count.nodes);
        }
    }
}

/// A film under way.
pub(super) struct FilmBuilder<'a> {
    plan: &'a Plan,
    counted: bool,
    film: Film,
    /// Luminance of the irradiance without shadows, each pixel.
    unshadowed: Vec<f32>,
}

impl<'a> FilmBuilder<'a> {
    pub(super) fn new(plan: &'a Plan, counted: bool) -> Self {
        let size = plan.grid.size();
        let pixels = size[0] as usize * size[1] as usize;
        let mut layers = Vec::new();
        let mut layer = |name: &str, channels: &[&'static str], background: f32| {
            let channel = |&name| Channel { name, values: vec![background; pixels] };
            let channels = channels.iter().map(channel).collect();
            layers.push(Layer { name: name.to_owned(), channels });
        };
        layer("", &["R", "G", "B", "A"], 0.0);
        if plan.has(Pass::Shadow) {
            layer("shadow", &["Y"], 0.0);
        }
        for class in &plan.classes {
            layer(&class.name, &["Y"], 0.0);
        }
        if plan.has(Pass::Shadow) {
            layer("irradiance", &["R", "G", "B"], 0.0);
        }
        layer("depth", &["Z"], f32::INFINITY);
        layer("normal", &["X", "Y", "Z"], 0.0);
        if counted {
            layer("nodes", &["Y"], 0.0);
        }
        Self { plan, counted, film: Film { size, layers }, unshadowed: vec![0.0; pixels] }
    }

    /// Sets the pixels of a tile.
    pub(super) fn set_tile(&mut self, tile: Tile, primary: &PrimarySums, sums: &TileSums) {
        let width = self.film.size[0] as usize;
        for (slot, [x, y]) in tile.pixels() {
            let hits = primary.hits[slot];
            if hits > 0 {
                self.set_pixel(y as usize * width + x as usize, slot, primary, sums);
            }
        }
    }

    fn set_pixel(&mut self, pixel: usize, slot: usize, primary: &PrimarySums, sums: &TileSums) {
        let hits = f64::from(primary.hits[slot]);
        let share = |lit: f64, all: f64| if all > 0.0 { lit / all } else { 0.0 };
        let (mut irradiance, mut lit_luminance, mut all_luminance) = (DVec3::ZERO, 0.0, 0.0);
        for (class, sums) in self.plan.classes.iter().zip(&sums.classes) {
            if let RayClass::Shadow { .. } = class.class {
                let samples = hits * f64::from(class.samples);
                irradiance += class.strength.as_dvec3() * (sums.lit[slot] / samples);
                let luminance = luminance(class.strength);
                lit_luminance += luminance * (sums.lit[slot] / samples);
                all_luminance += luminance * (sums.all[slot] / samples);
            }
        }
        self.unshadowed[pixel] = all_luminance as f32;
        // In the order of the layers, after the colour of the first: that waits for all pixels.
        let mut planes = self.film.layers.iter_mut().flat_map(|layer| &mut layer.channels).skip(3);
        let mut put = |value: f64| {
            if let Some(channel) = planes.next() {
                channel.values[pixel] = value as f32;
            }
        };
        let shadow = self.plan.has(Pass::Shadow);
        put(hits / f64::from(self.plan.settings.camera_samples));
        if shadow {
            put(share(lit_luminance, all_luminance));
        }
        for class in &sums.classes {
            put(share(class.lit[slot], class.all[slot]));
        }
        if shadow {
            irradiance.to_array().into_iter().for_each(&mut put);
        }
        put(primary.distance[slot] / hits);
        (primary.normal[slot] / hits).to_array().into_iter().for_each(&mut put);
        if self.counted {
            put(share(sums.nodes[slot] as f64, sums.rays[slot] as f64));
        }
    }

    /// The film with the picture for the eye in its first layer.
    pub(super) fn finish(self) -> Film {
        let Self { mut film, unshadowed, .. } = self;
        let pixels = unshadowed.len();
        let (first, rest) = film.layers.split_at_mut(1);
        let [red, green, blue, alpha] = first[0].channels.as_mut_slice() else {
            unreachable!("the first layer is made with four channels")
        };
        let find = |name: &str| rest.iter().find(|layer| layer.name == name);
        let irradiance = find("irradiance");
        let ao = find(Pass::AmbientOcclusion.name());
        let ao = ao.or_else(|| find(Pass::AmbientOcclusionUnbounded.name()));
        let covered = alpha.values.iter().filter(|&&a| a > 0.0).count().max(1);
        let mean = unshadowed.iter().map(|&v| f64::from(v)).sum::<f64>() / covered as f64;
        let ambient = if mean > 0.0 { AMBIENT_SHARE * mean } else { PI };
        for pixel in 0..pixels {
            let coverage = f64::from(alpha.values[pixel]);
            let ambient = ao.map_or(0.0, |ao| ambient * f64::from(ao.channels[0].values[pixel]));
            for (axis, channel) in [&mut *red, &mut *green, &mut *blue].into_iter().enumerate() {
                let direct = irradiance.map_or(0.0, |i| f64::from(i.channels[axis].values[pixel]));
                let radiance = ALBEDO * FRAC_1_PI * (direct + ambient);
                channel.values[pixel] = (radiance * coverage) as f32;
            }
        }
        film
    }
}

/// Relative luminance of linear RGB with the primaries of ITU-R BT.709.
pub(crate) fn luminance(rgb: Vec3) -> f64 {
    let rgb = rgb.as_dvec3();
    0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z
}
