//! The `skiagraph` command.

fn main() {}
