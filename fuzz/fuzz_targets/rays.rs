//! Any bytes as a file of recorded rays; what is read is written and read again to the bit.
#![no_main]

mod file;

use sato::ray_set::RayFile;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let path = file::written("x.rays", data);
    match RayFile::read(&path) {
        Ok(rays) => {
            let again = path.with_extension("again");
            rays.write(&again).expect("written");
            let read = RayFile::read(&again).expect("what is written is read");
            let bits = |file: &RayFile| -> Vec<_> {
                let rays = file.classes.iter().flat_map(|(_, set)| set.rays());
                rays.map(|r| [r.origin.to_array(), r.direction.to_array(), [r.t_min, r.t_max, 0.0]])
                    .flat_map(|r| r.map(|v| v.map(f32::to_bits)))
                    .collect()
            };
            assert_eq!(bits(&read), bits(&rays));
        }
        Err(error) => file::check_error(&error),
    }
});
