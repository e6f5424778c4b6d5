//! Everything that reads bytes of others, by name, for fuzzing: `cargo xtask fuzz` runs libFuzzer on it,
//! and a test replays the seeds of `xtask/fuzz/corpus`, with seeded mutations of them.
//!
//! A target reads bytes as the program does, and goes on with what it has read up to where the computation
//! begins. It may refuse them; it may not panic, hang, or take more memory than an input may.

mod archive;
mod folders;
mod images;

use shapespace_input::memory;

/// Bytes that an input may take while it is read.
const MOST_MEMORY: u64 = 256 << 20;

/// A reader.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name, and that of the file of its seeds.
    pub name: &'static str,
    read: fn(&[u8]) -> bool,
}

impl Target {
    /// Reads bytes; returns whether they are what is expected.
    pub fn run(&self, bytes: &[u8]) -> bool {
        memory::set_limit(Some(MOST_MEMORY));
        (self.read)(bytes)
    }
}

/// All readers.
pub const TARGETS: [Target; 21] = [
    target("npy", images::npy),
    target("png", images::png),
    target("pnm", |bytes| images::picture(bytes, "a.pnm")),
    target("bmp", |bytes| images::picture(bytes, "a.bmp")),
    target("jpeg", |bytes| images::picture(bytes, "a.jpg")),
    target("tiff", |bytes| images::picture(bytes, "a.tif")),
    target("nifti", |bytes| images::picture(bytes, "a.nii")),
    target("nifti_gz", images::nifti_gz),
    target("analyze", folders::analyze),
    target("nrrd", |bytes| images::picture(bytes, "a.nrrd")),
    target("metaimage", |bytes| images::picture(bytes, "a.mha")),
    target("stl", |bytes| images::surface(bytes, "a.stl")),
    target("ply", |bytes| images::surface(bytes, "a.ply")),
    target("obj", |bytes| images::surface(bytes, "a.obj")),
    target("vtk", |bytes| images::surface(bytes, "a.vtk")),
    target("vtp", |bytes| images::surface(bytes, "a.vtp")),
    target("svg", |bytes| images::outline(bytes, "a.svg")),
    target("csv", |bytes| images::outline(bytes, "a.csv")),
    target("config", folders::config),
    target("checkpoint", folders::checkpoint),
    target("result", folders::result),
];

const fn target(name: &'static str, read: fn(&[u8]) -> bool) -> Target {
    Target { name, read }
}

/// The target of a name.
pub fn find(name: &str) -> Option<Target> {
    TARGETS.into_iter().find(|target| target.name == name)
}

/// The seeds in a text: one a line, with `\n`, `\\`, `\xff` and the like for bytes that are no printable
/// characters, as `slice::escape_ascii` writes them, and `$VERSION` for the version of the program. Lines that
/// begin with `#`, and empty ones, are left out.
pub fn seeds(text: &str) -> Vec<Vec<u8>> {
    let text = text.replace("$VERSION", env!("CARGO_PKG_VERSION"));
    let lines = text.lines();
    let seeds = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    seeds.map(unescaped).collect()
}

fn unescaped(line: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = line.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'\\' {
            match rest.next() {
                Some(b'n') => b'\n',
                Some(b'r') => b'\r',
                Some(b't') => b'\t',
                Some(b'x') => {
                    let mut digit = || rest.next().and_then(|c| char::from(c).to_digit(16));
                    let (high, low) = (digit().unwrap_or(0), digit().unwrap_or(0));
                    (16 * high + low) as u8
                }
                Some(other) => other,
                None => b'\\',
            }
        } else {
            byte
        });
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_what_they_were_before_they_were_escaped() {
        let all: Vec<u8> = (0..=255).collect();
        let text = format!("# all\n\n{}\na\\n\n", all.escape_ascii());
        assert_eq!(seeds(&text), [all, b"a\n".to_vec()]);
    }
}
