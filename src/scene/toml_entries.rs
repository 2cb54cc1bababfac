//! The tables of a scene file as serde reads them. Whether the values make sense is seen to after.

use super::{Camera, InvalidValue, LightShape};
use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use std::fmt;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneEntry {
    pub(super) name: Option<String>,
    #[serde(default)]
    pub(super) mesh_folders: Vec<String>,
    pub(super) origin: Option<String>,
    pub(super) size: Option<Numbers<2>>,
    pub(super) camera: Option<CameraEntry>,
    pub(super) ambient_occlusion: Option<AmbientOcclusionEntry>,
    pub(super) animation: Option<AnimationEntry>,
    #[serde(default)]
    pub(super) geometry: Vec<GeometryEntry>,
    /// None if no word is said about lights, empty if there shall be none.
    pub(super) light: Option<Vec<LightEntry>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraEntry {
    eye: Numbers<3>,
    look_at: Numbers<3>,
    up: Option<Numbers<3>>,
    fov_degrees: Option<f64>,
}

impl From<&CameraEntry> for Camera {
    fn from(entry: &CameraEntry) -> Self {
        Self {
            eye: entry.eye.vec3(),
            look_at: entry.look_at.vec3(),
            up: entry.up.as_ref().map_or(Vec3::Y, Numbers::vec3),
            fov_degrees: entry.fov_degrees.unwrap_or(45.0) as f32,
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AmbientOcclusionEntry {
    pub(super) radius: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnimationEntry {
    pub(super) frames: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GeometryEntry {
    pub(super) file: Option<String>,
    /// First and last number of a sequence.
    pub(super) keys: Option<Numbers<2>>,
    pub(super) generator: Option<String>,
    pub(super) seed: Option<u64>,
    pub(super) translate: Option<Numbers<3>>,
    pub(super) rotate_degrees: Option<Numbers<3>>,
    pub(super) scale: Option<NumberOrThree>,
    pub(super) matrix: Option<Numbers<16>>,
    pub(super) key: Option<Vec<KeyEntry>>,
}

/// A transform at a time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeyEntry {
    pub(super) time: f64,
    pub(super) translate: Option<Numbers<3>>,
    pub(super) rotate_degrees: Option<Numbers<3>>,
    pub(super) scale: Option<NumberOrThree>,
}

/// Every key that any type of light has; [`LIGHT_TYPES`] says which go together.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightEntry {
    pub(super) name: Option<String>,
    r#type: String,
    corner: Option<Numbers<3>>,
    edge_u: Option<Numbers<3>>,
    edge_v: Option<Numbers<3>>,
    center: Option<Numbers<3>>,
    normal: Option<Numbers<3>>,
    position: Option<Numbers<3>>,
    direction: Option<Numbers<3>>,
    radius: Option<f64>,
    angular_diameter_degrees: Option<f64>,
    radiance: Option<NumberOrThree>,
    irradiance: Option<NumberOrThree>,
    intensity: Option<NumberOrThree>,
}

/// The sun's and the moon's, about.
const DEFAULT_ANGULAR_DIAMETER_DEGREES: f64 = 0.53;

/// A type of light: what it needs, what it may have beside, and how it becomes a shape.
struct LightType {
    name: &'static str,
    needs: &'static [&'static str],
    may_have: &'static [&'static str],
    shape: fn(&LightEntry) -> Option<LightShape>,
}

static LIGHT_TYPES: &[LightType] = &[
    LightType {
        name: "quad",
        needs: &["corner", "edge_u", "edge_v"],
        may_have: &["radiance"],
        shape: |l| {
            let (edge_u, edge_v) = (l.edge_u.as_ref()?.vec3(), l.edge_v.as_ref()?.vec3());
            Some(LightShape::Quad { corner: l.corner.as_ref()?.vec3(), edge_u, edge_v })
        },
    },
    LightType {
        name: "disk",
        needs: &["center", "normal", "radius"],
        may_have: &["radiance"],
        shape: |l| {
            let (center, normal) = (l.center.as_ref()?.vec3(), l.normal.as_ref()?.unit());
            Some(LightShape::Disk { center, normal, radius: l.radius? as f32 })
        },
    },
    LightType {
        name: "sphere",
        needs: &["center", "radius"],
        may_have: &["radiance"],
        shape: |l| {
            let center = l.center.as_ref()?.vec3();
            Some(LightShape::Sphere { center, radius: l.radius? as f32 })
        },
    },
    LightType {
        name: "directional",
        needs: &["direction"],
        may_have: &["angular_diameter_degrees", "irradiance"],
        shape: |l| {
            let degrees = l.angular_diameter_degrees.unwrap_or(DEFAULT_ANGULAR_DIAMETER_DEGREES);
            Some(LightShape::Directional {
                direction: l.direction.as_ref()?.unit(),
                angular_diameter_degrees: degrees as f32,
            })
        },
    },
    LightType {
        name: "point",
        needs: &["position"],
        may_have: &["intensity"],
        shape: |l| Some(LightShape::Point { position: l.position.as_ref()?.vec3() }),
    },
];

impl LightEntry {
    /// The shape, if the type exists and has the keys it needs and no others.
    pub(super) fn shape(&self) -> Result<LightShape, InvalidValue> {
        let names: Vec<_> = LIGHT_TYPES.iter().map(|t| t.name).collect();
        let Some(light_type) = LIGHT_TYPES.iter().find(|t| t.name == self.r#type) else {
            let message = format!("{:?} is none of {}", self.r#type, names.join(", "));
            return Err(InvalidValue::new("type", message));
        };
        let (name, needs) = (light_type.name, light_type.needs);
        let given = self.given();
        if let Some(missing) = needs.iter().find(|key| !given.contains(key)) {
            return Err(InvalidValue::new(
                *missing,
                format!("is missing; a {name} light needs it"),
            ));
        }
        let belongs = |key| needs.contains(key) || light_type.may_have.contains(key);
        if let Some(odd) = given.iter().find(|key| !belongs(key)) {
            let keys = [needs, light_type.may_have].concat().join(", ");
            let message = format!("does not belong to a {name} light, which has {keys}");
            return Err(InvalidValue::new(*odd, message));
        }
        (light_type.shape)(self).ok_or_else(|| InvalidValue::new("type", "a key is missing"))
    }

    /// The strength, by whichever name it goes for this type.
    pub(super) fn strength(&self) -> Option<Vec3> {
        let strength = self.radiance.as_ref().or(self.irradiance.as_ref());
        strength.or(self.intensity.as_ref()).map(|s| s.0.as_vec3())
    }

    fn given(&self) -> Vec<&'static str> {
        [
            ("corner", self.corner.is_some()),
            ("edge_u", self.edge_u.is_some()),
            ("edge_v", self.edge_v.is_some()),
            ("center", self.center.is_some()),
            ("normal", self.normal.is_some()),
            ("position", self.position.is_some()),
            ("direction", self.direction.is_some()),
            ("radius", self.radius.is_some()),
            ("angular_diameter_degrees", self.angular_diameter_degrees.is_some()),
            ("radiance", self.radiance.is_some()),
            ("irradiance", self.irradiance.is_some()),
            ("intensity", self.intensity.is_some()),
        ]
        .into_iter()
        .filter_map(|(key, given)| given.then_some(key))
        .collect()
    }
}

/// Exactly `N` numbers, integers or floats. (Serde's own arrays would not mind a number too many.)
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers<const N: usize>(pub(super) [f64; N]);

impl Numbers<3> {
    pub(super) fn dvec3(&self) -> DVec3 {
        DVec3::from_array(self.0)
    }

    fn vec3(&self) -> Vec3 {
        self.dvec3().as_vec3()
    }

    /// Unit length; as given if it has no direction, for the checks to refuse.
    fn unit(&self) -> Vec3 {
        self.dvec3().try_normalize().unwrap_or(self.dvec3()).as_vec3()
    }
}

/// One number for all three, or three.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberOrThree(pub(super) DVec3);

struct NumbersVisitor<const N: usize> {
    one_for_all: bool,
}

impl<'de, const N: usize> Visitor<'de> for NumbersVisitor<N> {
    type Value = [f64; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = if self.one_for_all { "a number or " } else { "" };
        write!(f, "{one}an array of {N} numbers")
    }

    fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Self::Value, E> {
        if self.one_for_all {
            Ok([x; N])
        } else {
            Err(E::invalid_type(serde::de::Unexpected::Float(x), &self))
        }
    }

    fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Self::Value, E> {
        self.visit_f64(x as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        while let Some(x) = sequence.next_element()? {
            if let Some(number) = numbers.get_mut(count) {
                *number = x;
            }
            count += 1;
        }
        if count == N { Ok(numbers) } else { Err(A::Error::invalid_length(count, &self)) }
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumbersVisitor { one_for_all: false }).map(Self)
    }
}

impl<'de> Deserialize<'de> for NumberOrThree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = deserializer.deserialize_any(NumbersVisitor { one_for_all: true })?;
        Ok(Self(DVec3::from_array(numbers)))
    }
}
