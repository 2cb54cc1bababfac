//! Records as a CSV file.

use crate::Result;
use crate::output::write_atomically;
use serde::Serialize;
use std::io;
use std::path::Path;

/// Writes records, one a line, under one line with the names of their fields; no record, an empty
/// file. Fields are plain values: absent ones are empty, nested records are refused.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) naming the file.
pub fn write_csv(path: &Path, records: impl IntoIterator<Item = impl Serialize>) -> Result<()> {
    write_atomically(path, |out| {
        let mut writer = csv::Writer::from_writer(out);
        for record in records {
            writer.serialize(record).map_err(io::Error::from)?;
        }
        writer.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[derive(Serialize)]
    struct Record<'a> {
        scene: &'a str,
        trace_ms: f64,
        nodes_per_ray: Option<f64>,
    }

    #[test]
    fn one_header_and_quotes_where_needed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/x.csv");
        let records = [
            Record { scene: "a,b \"c\"", trace_ms: 1.5, nodes_per_ray: None },
            Record { scene: "ship", trace_ms: 0.1, nodes_per_ray: Some(27.0) },
        ];
        write_csv(&path, &records).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let wanted = "scene,trace_ms,nodes_per_ray\n\"a,b \"\"c\"\"\",1.5,\nship,0.1,27.0\n";
        assert_eq!(text, wanted);
        write_csv(&path, Vec::<Record>::new()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "");
    }

    #[test]
    fn records_that_are_not_flat_leave_the_old_file() {
        #[derive(Serialize)]
        struct Nested {
            inner: std::collections::BTreeMap<u8, u8>,
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        fs::write(&path, "old").unwrap();
        let error = write_csv(&path, [Nested { inner: [(1, 2)].into() }]).unwrap_err();
        assert!(error.to_string().contains("x.csv"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    }
}
