//! Any text as a scene file. Generators are left out: they make millions of triangles each time.
#![no_main]

mod file;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if !data.windows(9).any(|word| word == b"generator") {
        file::check_scene("x.toml", data);
    }
});
