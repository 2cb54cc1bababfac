//! Any bytes as an OBJ file.
#![no_main]

mod file;

libfuzzer_sys::fuzz_target!(|data: &[u8]| file::check_scene("x.obj", data));
