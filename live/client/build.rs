//! Linking of the library: the name by which programs ask for it, which changes when a function does; and no symbols of the
//! crates in it, which could meet those of another library in the program.
#![allow(clippy::print_stdout, reason = "cargo reads the standard output")]

fn main() {
    println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libtipwatch_client.so.0");
    println!("cargo:rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
    println!("cargo:rerun-if-changed=build.rs");
}
