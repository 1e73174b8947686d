//! lookmatch
fn main() {}
