//! The picture: named layers of `f32`, and the sums that they are made of.

use super::layers::{Content, LayerPlan, ambient_of_picture};
use super::plan::Plan;
use super::settings::RayClass;
use super::surface::SurfacePoint;
use super::tile::TILE_PIXELS;
use crate::ray::{VisitCounts, bit};
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_1_PI, PI};
use std::ops::Range;

/// Reflectance of every surface in the picture that is meant for the eye.
const ALBEDO: f64 = 0.8;
/// Its ambient light, as a part of the mean irradiance that the lights give without shadows.
const AMBIENT_SHARE: f64 = 0.2;

/// Named layers of one size. Values are row by row from the upper left pixel. It has those of the
/// following that [`RenderSettings::layers`](super::RenderSettings::layers) asks for.
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
/// - `samples.<class>`, `Y`: how many samples of the class the pixel got, where
///   [`Adaptive`](super::Adaptive) sampling chose; 0 where it sees no surface.
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

    /// Whether there is a picture for the eye: the layer without a name.
    pub fn has_picture(&self) -> bool {
        self.channel("", "A").is_some()
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
    /// Adds what the pixels in these slots see, as far as the plan has layers of it.
    pub(super) fn add<'a>(
        &mut self,
        plan: &Plan,
        seen: impl Iterator<Item = (u8, &'a SurfacePoint)>,
    ) {
        let [depth, normal] = [Content::Depth, Content::Normal].map(|layer| plan.makes(layer));
        for (slot, surface) in seen {
            let slot = usize::from(slot);
            self.hits[slot] += 1;
            if depth {
                self.distance[slot] += surface.distance;
            }
            if normal {
                self.normal[slot] += surface.normal;
            }
        }
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
        // Run by run of rays of a pixel.
        let mut first = 0;
        while let Some(&slot) = slots.get(first) {
            let rays = first..first + run_of(slot, &slots[first..]);
            first = rays.end;
            let slot = usize::from(slot);
            if weights.is_empty() {
                // Whole numbers: the same as one after the other.
                all[slot] += rays.len() as f64;
                lit[slot] += f64::from(rays.len() as u32 - bits_set(occluded, rays));
                continue;
            }
            let (mut lit_sum, mut all_sum) = (lit[slot], all[slot]);
            for ray in rays {
                let weight = f64::from(weights[ray]);
                all_sum += weight;
                // Adding zero to a sum that is not negative leaves it as it is.
                lit_sum += if bit(occluded, ray) { 0.0 } else { weight };
            }
            (lit[slot], all[slot]) = (lit_sum, all_sum);
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

/// How many of the first slots are this one.
fn run_of(slot: u8, slots: &[u8]) -> usize {
    const AT_ONCE: usize = 64;
    let (chunks, _) = slots.as_chunks::<AT_ONCE>();
    let whole = AT_ONCE * chunks.iter().take_while(|chunk| **chunk == [slot; AT_ONCE]).count();
    whole + slots[whole..].iter().take_while(|other| **other == slot).count()
}

/// How many bits are set among those of a range.
fn bits_set(words: &[u64], range: Range<usize>) -> u32 {
    let (mut count, mut at) = (0, range.start);
    while at < range.end {
        let len = (64 - at % 64).min(range.end - at);
        count += (words[at / 64] >> (at % 64) << (64 - len)).count_ones();
        at += len;
    }
    count
}

/// A film under way.
pub(super) struct FilmBuilder<'a> {
    plan: &'a Plan,
    plans: Vec<LayerPlan>,
    film: Film,
    /// Luminance of the irradiance without shadows, each pixel; empty where there is no picture.
    unshadowed: Vec<f32>,
}

impl<'a> FilmBuilder<'a> {
    pub(super) fn new(plan: &'a Plan, counted: bool) -> Self {
        let size = plan.grid.size();
        let pixels = size[0] as usize * size[1] as usize;
        let mut plans = plan.choice.layers.clone();
        if counted {
            let content = Content::Nodes;
            plans.push(LayerPlan { name: "nodes".into(), content, is_kept: true });
        }
        let layer = |plan: &LayerPlan| {
            let values = || vec![plan.content.background(); pixels];
            let channels = plan.content.channels().iter();
            let channels = channels.map(|&name| Channel { name, values: values() }).collect();
            Layer { name: plan.name.clone(), channels }
        };
        let layers = plans.iter().map(layer).collect();
        let unshadowed = if plan.makes(Content::Picture) { pixels } else { 0 };
        Self { plan, plans, film: Film { size, layers }, unshadowed: vec![0.0; unshadowed] }
    }

    /// Sets the pixels of tile `tile`.
    pub(super) fn set_tile(&mut self, tile: usize, primary: &PrimarySums, sums: &TileSums) {
        let width = self.film.size[0] as usize;
        for (slot, [x, y]) in self.plan.grid.tile(tile).pixels() {
            if primary.hits[slot] > 0 {
                self.set_pixel(y as usize * width + x as usize, [tile, slot], primary, sums);
            }
        }
    }

    fn set_pixel(
        &mut self,
        pixel: usize,
        [tile, slot]: [usize; 2],
        primary: &PrimarySums,
        sums: &TileSums,
    ) {
        let hits = f64::from(primary.hits[slot]);
        let share = |lit: f64, all: f64| if all > 0.0 { lit / all } else { 0.0 };
        let (mut irradiance, mut lit_luminance, mut all_luminance) = (DVec3::ZERO, 0.0, 0.0);
        for (index, (class, sums)) in self.plan.classes.iter().zip(&sums.classes).enumerate() {
            if let RayClass::Shadow { .. } = class.class {
                let samples = hits * f64::from(self.plan.samples(tile, index, slot));
                irradiance += class.strength.as_dvec3() * (sums.lit[slot] / samples);
                let luminance = luminance(class.strength);
                lit_luminance += luminance * (sums.lit[slot] / samples);
                all_luminance += luminance * (sums.all[slot] / samples);
            }
        }
        if let Some(unshadowed) = self.unshadowed.get_mut(pixel) {
            *unshadowed = all_luminance as f32;
        }
        for (layer, plan) in self.film.layers.iter_mut().zip(&self.plans) {
            let mut put = |channel: usize, value: f64| {
                layer.channels[channel].values[pixel] = value as f32;
            };
            match plan.content {
                // Colour waits for all pixels.
                Content::Picture => put(3, hits / f64::from(self.plan.settings.camera_samples)),
                Content::Shadow => put(0, share(lit_luminance, all_luminance)),
                Content::Class(class) => {
                    let class = &sums.classes[class];
                    put(0, share(class.lit[slot], class.all[slot]));
                }
                Content::Irradiance => (0..3).for_each(|axis| put(axis, irradiance[axis])),
                Content::Depth => put(0, primary.distance[slot] / hits),
                Content::Normal => {
                    (0..3).for_each(|axis| put(axis, primary.normal[slot][axis] / hits));
                }
                Content::Samples(class) => {
                    put(0, f64::from(self.plan.samples(tile, class, slot)));
                }
                Content::Nodes => put(0, share(sums.nodes[slot] as f64, sums.rays[slot] as f64)),
            }
        }
    }

    /// The film with the picture for the eye in its first layer, without what only that needed.
    pub(super) fn finish(self) -> Film {
        let Self { plan, plans, mut film, unshadowed } = self;
        if plan.makes(Content::Picture) {
            paint(&mut film.layers, &plans, plan, &unshadowed);
        }
        let mut plans = plans.iter();
        film.layers.retain(|_| plans.next().is_some_and(|plan| plan.is_kept));
        film
    }
}

/// Colours the picture, the first of the layers.
fn paint(layers: &mut [Layer], plans: &[LayerPlan], plan: &Plan, unshadowed: &[f32]) {
    let (first, rest) = layers.split_at_mut(1);
    let [red, green, blue, alpha] = first[0].channels.as_mut_slice() else {
        unreachable!("the first layer is made with four channels")
    };
    let find = |content: Content| {
        plans.iter().position(|plan| plan.content == content).map(|place| &rest[place - 1])
    };
    let irradiance = find(Content::Irradiance);
    let ao = ambient_of_picture(&plan.classes).and_then(|class| find(Content::Class(class)));
    let covered = alpha.values.iter().filter(|&&a| a > 0.0).count().max(1);
    let mean = unshadowed.iter().map(|&v| f64::from(v)).sum::<f64>() / covered as f64;
    let ambient = if mean > 0.0 { AMBIENT_SHARE * mean } else { PI };
    for pixel in 0..unshadowed.len() {
        let coverage = f64::from(alpha.values[pixel]);
        let ambient = ao.map_or(0.0, |ao| ambient * f64::from(ao.channels[0].values[pixel]));
        for (axis, channel) in [&mut *red, &mut *green, &mut *blue].into_iter().enumerate() {
            let direct = irradiance.map_or(0.0, |i| f64::from(i.channels[axis].values[pixel]));
            let radiance = ALBEDO * FRAC_1_PI * (direct + ambient);
            channel.values[pixel] = (radiance * coverage) as f32;
        }
    }
}

/// Relative luminance of linear RGB with the primaries of ITU-R BT.709.
pub(crate) fn luminance(rgb: Vec3) -> f64 {
    let rgb = rgb.as_dvec3();
    0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_their_bits() {
        let mut slots = [3; 300];
        for len in [0, 1, 63, 64, 65, 128, 200, 299, 300] {
            slots[..len].fill(7);
            slots[len..].fill(3);
            assert_eq!(run_of(7, &slots), len);
        }
        let words = [0x8000_0000_0000_0001, u64::MAX, 0x0f0f_0000_0000_1234];
        for start in 0..192 {
            for end in start..=192 {
                let expected = (start..end).filter(|&i| bit(&words, i)).count() as u32;
                assert_eq!(bits_set(&words, start..end), expected, "{start}..{end}");
            }
        }
    }
}
