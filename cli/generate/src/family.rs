//! Families: shapes of one kind that vary in one way.

use crate::blob::Blob;
use crate::hand::Hand;
use crate::implicit::Implicit;
use crate::letter::{Letter, letter};
use crate::member::Member;
use crate::parts::parts;
use crate::random::Random;
use crate::solid::{Bar, Cross, Ellipsoid, Star};

/// A family of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Family {
    /// A straight bar and a bent one.
    Bars,
    /// Disks of radius .2 and .3.
    Disks,
    /// Crosses whose side arms bend independently.
    Crosses,
    /// Stars with one pin at different places.
    Stars,
    /// The three drawings of the letter B.
    Letters,
    /// Smooth random shapes.
    Blobs,
    /// Hands whose fingers have different directions and lengths.
    Hands,
    /// Bars of two labelled parts that meet at different places, as label images.
    Parts,
}

/// The shapes of a family that exists in every dimension, or `None` for 2D families in 3D.
pub fn family<const D: usize>(family: Family, seed: u64) -> Option<Vec<Member<D>>> {
    Some(match family {
        Family::Bars => numbered("bar", [180.0, 118.0], |angle| {
            Box::new(Bar::new(0.6, 0.12, angle))
        }),
        Family::Disks => numbered("disk", [0.2, 0.3], |radius| {
            Box::new(Ellipsoid { radii: [radius; D] })
        }),
        Family::Crosses => {
            let bends = [[-35.0, 20.0], [0.0, -30.0], [30.0, 30.0], [15.0, -10.0]];
            numbered("cross", bends, |bend| {
                Box::new(Cross {
                    arm: 0.33,
                    width: 0.11,
                    bend,
                })
            })
        }
        Family::Stars => numbered("star", [-20.0, 0.0, 20.0], |first_pin| {
            Box::new(Star {
                pins: 5,
                radius: 0.17,
                reach: 0.34,
                width: 0.07,
                first_pin,
            })
        }),
        Family::Blobs => {
            let mut seeds = Random::new(seed);
            let seeds: Vec<u64> = (0..5).map(|_| (seeds.uniform() * 1e15) as u64).collect();
            numbered("blob", seeds, |seed| {
                Box::new(Blob::<D>::new(0.24, 0.3, seed))
            })
        }
        Family::Hands => {
            let hands = [
                ([-40.0, -9.0, -3.0, 3.0, 9.0], [1.0; 5]),
                ([-60.0, -18.0, -6.0, 6.0, 22.0], [1.0; 5]),
                (
                    [-48.0, -14.0, -10.0, 12.0, 16.0],
                    [0.9, 0.95, 1.0, 1.0, 0.9],
                ),
                ([-32.0, -16.0, -4.0, 2.0, 8.0], [1.1, 1.0, 1.05, 1.05, 1.0]),
                ([-54.0, -8.0, 2.0, 8.0, 26.0], [1.0, 0.8, 0.9, 0.95, 1.1]),
            ];
            numbered("hand", hands, |(angles, lengths)| {
                Box::new(Hand { angles, lengths })
            })
        }
        Family::Parts => parts(),
        Family::Letters => return None,
    })
}

/// The three drawings of the letter B.
pub fn letters() -> Vec<Member<2>> {
    numbered(
        "letter",
        [Letter::B, Letter::SerifB, Letter::LightB],
        |which| Box::new(letter(which)),
    )
}

fn numbered<const D: usize, P>(
    name: &str,
    parameters: impl IntoIterator<Item = P>,
    shape: impl Fn(P) -> Box<dyn Implicit<D>>,
) -> Vec<Member<D>> {
    parameters
        .into_iter()
        .enumerate()
        .map(|(i, parameter)| Member {
            name: format!("{name}_{i:03}"),
            shape: shape(parameter),
            parts: Vec::new(),
        })
        .collect()
}
