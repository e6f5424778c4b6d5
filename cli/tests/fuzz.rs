//! Every reader reads its seeds, and mutations of them, without a panic. `cargo xtask fuzz` runs libFuzzer on
//! the same readers, and what it finds becomes a seed.
//!
//! A program of its own: the targets limit the memory of inputs for the whole process.

use std::fs;
use std::path::Path;

use shapespace::fuzz::{TARGETS, Target, seeds};

/// Mutations of the seeds of a reader.
const MUTATIONS: usize = 1000;

/// A generator of Marsaglia (2003).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

fn seeds_of(target: &Target) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../xtask/fuzz/corpus");
    let text = fs::read_to_string(folder.join(format!("{}.txt", target.name)));
    seeds(&text.unwrap())
}

/// One to four changes: bytes, repetitions, deletions, parts of other seeds.
fn mutated(all: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    const EDGES: [u8; 8] = [0, 1, b'-', b'9', 0x7f, 0x80, 0xfe, 0xff];
    let mut bytes = all[random.below(all.len())].clone();
    for _ in 0..=random.below(4) {
        let place = random.below(bytes.len() + 1);
        let end = (place + random.below(9)).min(bytes.len());
        match random.below(6) {
            0 => bytes.truncate(place),
            1 => drop(bytes.drain(place..end)),
            2 => {
                let part = bytes[place..end].to_vec();
                bytes.splice(place..place, part);
            }
            3 => {
                let other = &all[random.below(all.len())];
                let from = random.below(other.len() + 1);
                let to = (from + random.below(33)).min(other.len());
                bytes.splice(place..end, other[from..to].iter().copied());
            }
            4 => bytes[place..end].fill(EDGES[random.below(EDGES.len())]),
            _ => {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte ^= 1 << random.below(8);
                }
            }
        }
    }
    bytes
}

#[test]
fn readers_stand_their_seeds_and_mutations_of_them() {
    for (number, target) in TARGETS.iter().enumerate() {
        let all = seeds_of(target);
        assert!(target.run(&all[0]), "{}: its first seed", target.name);
        for seed in &all {
            target.run(seed);
        }
        let mut random = Random(0x9e37_79b9 + number as u64);
        let mut read = 0;
        for _ in 0..MUTATIONS {
            let bytes = mutated(&all, &mut random);
            let printed = bytes.escape_ascii().to_string();
            // The bytes are known where it panics.
            let outcome = std::panic::catch_unwind(|| target.run(&bytes));
            read += usize::from(outcome.unwrap_or_else(|_| panic!("{}: {printed}", target.name)));
        }
        println!("{}: {read} of {MUTATIONS} mutations are read", target.name);
    }
}
