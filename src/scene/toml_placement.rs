//! A geometry entry of a scene file: where its triangles come from, where they go, how they move.

use super::generate::{self, GENERATORS, Generated};
use super::pose::{TransformKey, TransformKeys};
use super::sequence::{MAX_KEYS, Pattern};
use super::toml_entries::{GeometryEntry, KeyEntry, NumberOrThree, Numbers};
use super::{InvalidValue, transform};
use glam::{DAffine3, DVec3};

/// Where a geometry entry's triangles come from.
pub(super) enum Source<'a> {
    File(&'a str),
    /// Names of files.
    Sequence(Vec<String>),
    Made(Box<Generated>),
}

/// Where the triangles of `entry` come from; a generator is run.
pub(super) fn source(entry: &GeometryEntry) -> Result<Source<'_>, InvalidValue> {
    match (&entry.file, &entry.generator) {
        (Some(_), None) if entry.seed.is_some() => {
            Err(InvalidValue::new("seed", "goes with a generator, not with a file"))
        }
        (Some(file), None) if file.is_empty() => Err(InvalidValue::new("file", "is empty")),
        (Some(file), None) => match &entry.keys {
            None => Ok(Source::File(file)),
            Some(keys) => Ok(Source::Sequence(sequence(file, keys)?)),
        },
        (None, Some(_)) if entry.keys.is_some() => {
            Err(InvalidValue::new("keys", "goes with a file, not with a generator"))
        }
        (None, Some(name)) => {
            let generator = generate::find(name).ok_or_else(|| {
                let names: Vec<_> = GENERATORS.iter().map(|entry| entry.name).collect();
                let message = format!("{name:?} is none of {}", names.join(", "));
                InvalidValue::new("generator", message)
            })?;
            Ok(Source::Made(Box::new((generator.generate)(entry.seed.unwrap_or(0)))))
        }
        (None, None) => {
            Err(InvalidValue::new("file", "is missing: a file or a generator is needed"))
        }
        (Some(_), Some(_)) => {
            Err(InvalidValue::new("generator", "cannot stand beside a file: use two entries"))
        }
    }
}

/// Where they go.
pub(super) fn placement(entry: &GeometryEntry) -> Result<DAffine3, InvalidValue> {
    let (translate, rotate) = (entry.translate, entry.rotate_degrees);
    if let Some(matrix) = &entry.matrix {
        if translate.is_some() || rotate.is_some() || entry.scale.is_some() {
            let message = "cannot stand beside translate, rotate_degrees or scale";
            return Err(InvalidValue::new("matrix", message));
        }
        let transform = transform::from_rows(&matrix.0)?;
        transform::check(&transform, "matrix")?;
        return Ok(transform);
    }
    let [translate, rotate, scale] = parts(translate, rotate, entry.scale)?;
    let transform = transform::from_parts(translate, rotate, scale);
    transform::check(&transform, "scale")?;
    Ok(transform)
}

/// Translation, rotation and scale, finite.
fn parts(
    translate: Option<Numbers<3>>,
    rotate: Option<Numbers<3>>,
    scale: Option<NumberOrThree>,
) -> Result<[DVec3; 3], InvalidValue> {
    let translate = translate.map_or(DVec3::ZERO, |t| t.dvec3());
    let rotate = rotate.map_or(DVec3::ZERO, |r| r.dvec3());
    let scale = scale.map_or(DVec3::ONE, |s| s.0);
    for (key, value) in [("translate", translate), ("rotate_degrees", rotate), ("scale", scale)] {
        if !value.is_finite() {
            return Err(InvalidValue::new(key, "must be finite"));
        }
    }
    Ok([translate, rotate, scale])
}

/// The names of a sequence's files.
fn sequence(file: &str, keys: &Numbers<2>) -> Result<Vec<String>, InvalidValue> {
    let pattern = Pattern::parse(file).map_err(|message| InvalidValue::new("file", message))?;
    let [first, last] = keys.0;
    let whole = |number: f64| number.fract() == 0.0 && (0.0..=999_999_999.0).contains(&number);
    if !whole(first) || !whole(last) || first >= last || last - first >= MAX_KEYS as f64 {
        let message = format!(
            "must be the first and the last of 2 to {MAX_KEYS} whole numbers from 0 up, not \
             [{first}, {last}]"
        );
        return Err(InvalidValue::new("keys", message));
    }
    Ok((first as usize..=last as usize).map(|number| pattern.name(number)).collect())
}

/// The transforms over time, if there are any.
pub(super) fn transform_keys(entry: &GeometryEntry) -> Result<Option<TransformKeys>, InvalidValue> {
    let Some(entries) = &entry.key else { return Ok(None) };
    if entries.len() < 2 {
        let message = format!("there must be none or at least two, not {}", entries.len());
        return Err(InvalidValue::new("key", message));
    }
    let mut keys: Vec<TransformKey> = Vec::new();
    for (i, entry) in entries.iter().enumerate() {
        let after = keys.last().map(|last| last.time);
        keys.push(transform_key(entry, after).map_err(|f| f.within(&format!("key[{i}]")))?);
    }
    Ok(Some(TransformKeys(keys)))
}

fn transform_key(entry: &KeyEntry, after: Option<f64>) -> Result<TransformKey, InvalidValue> {
    let time = entry.time;
    if !(0.0..=1.0).contains(&time) {
        let message = format!("must be from 0, the first frame, to 1, the last, not {time}");
        return Err(InvalidValue::new("time", message));
    }
    if let Some(after) = after.filter(|&after| time <= after) {
        let message = format!("must be after that of the key before, {after}, not {time}");
        return Err(InvalidValue::new("time", message));
    }
    let [translate, rotate_degrees, scale] =
        parts(entry.translate, entry.rotate_degrees, entry.scale)?;
    let key = TransformKey { time, scale, rotate_degrees, translate };
    transform::check(&key.transform(), "scale")?;
    Ok(key)
}
