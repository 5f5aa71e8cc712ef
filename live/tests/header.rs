//! The C header in the repository.

use std::process::Command;

use tipwatch_live::wire::c_header::c_header;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include/tipwatch_live.h");

#[test]
fn header_is_current() {
    let committed = std::fs::read_to_string(PATH).unwrap();
    assert!(
        committed == c_header(),
        "run: tipwatch-live header > live/include/tipwatch_live.h"
    );
}

/// The header's static assertions check the sizes of all messages.
fn assert_compiles(compiler: &str, language: &str) {
    let checked = Command::new(compiler)
        .args(["-fsyntax-only", "-Wall", "-Werror", "-x", language, PATH])
        .output()
        .unwrap_or_else(|error| panic!("{compiler}: {error}"));
    let messages = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{messages}");
}

#[test]
fn c_compiler_agrees_with_the_sizes() {
    assert_compiles("cc", "c");
}

mod needs_cpp {
    #[test]
    #[ignore = "needs a C++ compiler"]
    fn cpp_compiler_agrees_with_the_sizes() {
        super::assert_compiles("c++", "c++");
    }
}
