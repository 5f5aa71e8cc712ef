//! The name by which programs ask for the library: it changes when a function does.
#![allow(clippy::print_stdout, reason = "cargo reads the standard output")]

fn main() {
    println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libtipwatch_client.so.0");
    println!("cargo:rerun-if-changed=build.rs");
}
