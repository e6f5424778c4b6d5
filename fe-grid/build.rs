//! Tells the library whether it is compiled for speed.
//!
//! Kernels are compiled for every instruction set. Builds for development leave out the copies for vectors of
//! 512 bits, a tenth of the time of compilation; all sets give the same bits. Debug assertions would not tell
//! the two kinds of builds apart: this workspace switches them off in tests, too.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(fully_optimised)");
    if std::env::var("OPT_LEVEL").is_ok_and(|level| level == "3") {
        println!("cargo::rustc-cfg=fully_optimised");
    }
}
