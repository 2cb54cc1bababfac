//! What the program writes, read again.

use std::collections::BTreeMap;
use std::path::Path;

/// All channels of an OpenEXR file, by name.
pub fn channels(file: &Path) -> BTreeMap<String, Vec<f32>> {
    let image = exr::prelude::read_all_flat_layers_from_file(file).unwrap();
    let all = image.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
    all.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

/// The rows of a table, each by the names in its header.
pub fn table(file: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(file).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}
