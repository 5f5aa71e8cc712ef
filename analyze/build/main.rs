//! Gives the program the hash of its sources, as the variable `TIPWATCH_SOURCES` of the compiler.

mod sources;

use std::path::Path;

#[expect(clippy::print_stdout, reason = "cargo reads standard output")]
fn main() -> std::io::Result<()> {
    let tree = Path::new("..");
    for place in sources::places(tree) {
        println!("cargo::rerun-if-changed={}", place.display());
    }
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rustc-env=TIPWATCH_SOURCES={}", sources::hash(tree)?);
    Ok(())
}
