//! Any bytes as a compressed OBJ file.
#![no_main]

mod file;

libfuzzer_sys::fuzz_target!(|data: &[u8]| file::check_scene("x.obj.zst", data));
