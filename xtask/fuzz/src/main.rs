//! libFuzzer on the reader that `SHAPESPACE_FUZZ` names. It begins with the seeds of the reader, which are
//! written to the folder `SHAPESPACE_CORPUS`.

#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use shapespace::fuzz::{Target, find, seeds};

static TARGET: OnceLock<Target> = OnceLock::new();

fn start() -> Target {
    let name = std::env::var("SHAPESPACE_FUZZ").unwrap_or_default();
    let Some(target) = find(&name) else {
        eprintln!("SHAPESPACE_FUZZ is no target: '{name}'");
        std::process::exit(2);
    };
    if let Some(folder) = std::env::var_os("SHAPESPACE_CORPUS").map(PathBuf::from) {
        let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("corpus/{name}.txt"));
        let text = fs::read_to_string(&file).expect("the target has seeds");
        for (number, seed) in seeds(&text).iter().enumerate() {
            fs::write(folder.join(format!("seed_{number:03}")), seed).expect("the folder exists");
        }
    }
    target
}

fuzz_target!(
    init: {
        TARGET.get_or_init(start);
    },
    |bytes: &[u8]| {
        let _ = TARGET.get_or_init(start).run(bytes);
    }
);
