//! Links the layer so that it stays where it is once it is loaded.

fn main() {
    // The loader closes layers with the last instance; a program that makes another one goes on counting its calls.
    println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
    println!("cargo::rerun-if-changed=build.rs");
}
