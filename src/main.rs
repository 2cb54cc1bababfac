//! The `sato` command.
fn main() {}
