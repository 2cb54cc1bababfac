//! What makes a value usable: one set of checks for scene files, generators and the command line.

use glam::Vec3;

/// A value that cannot be used, by its key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {message}")]
pub struct InvalidValue {
    /// The key as a scene file spells it, such as `fov_degrees` or `light[0].radius`.
    pub key: String,
    /// What is wrong with it.
    pub message: String,
}

impl From<InvalidValue> for String {
    fn from(value: InvalidValue) -> Self {
        value.to_string()
    }
}

impl InvalidValue {
    /// `message` about `key`.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { key: key.into(), message: message.into() }
    }

    /// The same fault seen from the table around it: `radius` in `light[0]` is `light[0].radius`.
    #[must_use]
    pub fn within(self, table: &str) -> Self {
        Self { key: format!("{table}.{}", self.key), message: self.message }
    }
}

/// Every component is a finite number.
pub(super) fn finite(key: &str, v: Vec3) -> Result<(), InvalidValue> {
    if v.is_finite() {
        Ok(())
    } else {
        Err(InvalidValue::new(key, format!("must be finite, not {}", numbers(v))))
    }
}

/// Finite, and long enough that its direction survives normalising in `f32`.
pub(super) fn direction(key: &str, v: Vec3) -> Result<(), InvalidValue> {
    finite(key, v)?;
    let length = v.as_dvec3().length();
    if (1e-15..1e19).contains(&length) {
        Ok(())
    } else {
        Err(InvalidValue::new(key, format!("must have a direction, not {}", numbers(v))))
    }
}

/// Finite and above zero.
pub(super) fn positive(key: &str, x: f32) -> Result<(), InvalidValue> {
    if x > 0.0 && x.is_finite() {
        Ok(())
    } else {
        Err(InvalidValue::new(key, format!("must be above 0 and finite, not {x}")))
    }
}

/// `v` as a scene file writes it.
pub(super) fn numbers(v: Vec3) -> String {
    format!("[{}, {}, {}]", v.x, v.y, v.z)
}

/// A name that can be part of an OpenEXR layer name and of a file name.
pub(super) fn layer_name(key: &str, name: &str) -> Result<(), InvalidValue> {
    let usable = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.len() <= 64 && name.chars().all(usable) {
        return Ok(());
    }
    let message = format!("must be 1 to 64 letters, digits, `_` or `-`, not {name:?}");
    Err(InvalidValue::new(key, message))
}
