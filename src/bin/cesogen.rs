//! The `cesogen` drop-in command.
fn main() {}
