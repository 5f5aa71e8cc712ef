//! Packs plotly.js for the pages: the script comes with the crate `plotly`, whose figures it draws, and is too large
//! to stand in every page as it is.

use std::error::Error;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::GzEncoder;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let scripts = plotly::Plot::offline_js_sources();
    // plotly.js is the first script, that of formulas follows
    let library = scripts
        .split_once('>')
        .and_then(|(_, rest)| rest.split_once("</script>"))
        .map(|(library, _)| library)
        .ok_or("expected plotly.js in the first script element of the crate plotly")?;
    let folder = std::env::var_os("OUT_DIR").ok_or("expected OUT_DIR from cargo")?;
    let file = File::create(PathBuf::from(folder).join("plotly.min.js.gz"))?;
    let mut packed = GzEncoder::new(file, Compression::best());
    packed.write_all(library.as_bytes())?;
    packed.finish()?.sync_all()?;
    Ok(())
}
