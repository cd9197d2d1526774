//! The `alveole` command.
fn main() {}
