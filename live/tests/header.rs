//! The C header of the wire, as it stands in the repository.

use std::process::Command;

use tipwatch_live::wire::c_header::c_header;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include/tipwatch_live.h");

#[test]
fn the_header_is_up_to_date() {
    let committed = std::fs::read_to_string(PATH).unwrap();
    assert!(
        committed == c_header(),
        "run: tipwatch-live header > live/include/tipwatch_live.h"
    );
}

#[test]
fn c_and_cpp_compilers_agree_with_its_sizes() {
    for (compiler, language) in [("cc", "c"), ("c++", "c++")] {
        let checked = Command::new(compiler)
            .args(["-fsyntax-only", "-Wall", "-Werror", "-x", language, PATH])
            .output();
        match checked {
            Ok(output) => assert!(
                output.status.success(),
                "{}",
                String::from_utf8_lossy(&output.stderr)
            ),
            Err(error) => eprintln!("skipped: {compiler}: {error}"),
        }
    }
}
