//! Unpacks gzip and zlib streams, once it is known how much is to be unpacked.

use std::io::{self, Read};
use std::path::Path;

use flate2::bufread::{GzDecoder, MultiGzDecoder, ZlibDecoder};

use super::InputError;

/// DEFLATE packs no more bytes than this into one.
const MOST_COMPRESSION: usize = 1032;
/// How every stream of gzip begins.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// No more bytes than this may follow the data.
const MOST_AFTER: usize = 1 << 26;

/// A compressed file, for errors.
#[derive(Clone, Copy)]
pub(crate) struct Packed<'a> {
    /// The file.
    pub path: &'a Path,
    /// Name of its format.
    pub format: &'static str,
}

impl Packed<'_> {
    /// Checks that so many packed bytes can hold as much as a header states, and returns the memory
    /// that unpacking takes.
    pub fn check(&self, length: usize, packed: &[u8]) -> Result<u64, InputError> {
        let most = MOST_COMPRESSION.saturating_mul(packed.len());
        if length > most {
            return Err(InputError::Truncated {
                path: self.path.into(),
                expected: length as u64,
                found: most as u64,
            });
        }
        Ok((length + MOST_AFTER.min(length)) as u64)
    }

    /// The first bytes of a file of gzip streams.
    pub fn start(&self, bytes: &[u8], length: usize) -> Result<Vec<u8>, InputError> {
        let mut unpacked = Vec::new();
        let mut all = MultiGzDecoder::new(bytes).take(length as u64);
        let read = all.read_to_end(&mut unpacked);
        read.map_err(|error| self.failure(&error, length, unpacked.len()))?;
        Ok(unpacked)
    }

    /// The first bytes of gzip streams, all of which are unpacked, so that their checksums are
    /// verified.
    pub fn gzip(&self, bytes: &[u8], length: usize) -> Result<Vec<u8>, InputError> {
        // No more than is needed: vectors that grow take up to twice their length.
        let mut unpacked = Vec::with_capacity(length);
        let mut rest = bytes;
        // Several streams may follow each other; what follows the last is padding.
        while rest.starts_with(&GZIP) {
            let mut stream = GzDecoder::new(rest);
            self.append(&mut stream, length, &mut unpacked)?;
            rest = stream.into_inner();
        }
        unpacked.truncate(length);
        Ok(unpacked)
    }

    /// The first bytes of a zlib stream, all of which is unpacked.
    pub fn zlib(&self, bytes: &[u8], length: usize) -> Result<Vec<u8>, InputError> {
        let mut unpacked = Vec::with_capacity(length);
        self.append(&mut ZlibDecoder::new(bytes), length, &mut unpacked)?;
        unpacked.truncate(length);
        Ok(unpacked)
    }

    fn append(
        &self,
        stream: &mut impl Read,
        length: usize,
        unpacked: &mut Vec<u8>,
    ) -> Result<(), InputError> {
        let most = length + MOST_AFTER - unpacked.len();
        let read = stream.take(most as u64 + 1).read_to_end(unpacked);
        let read = read.map_err(|error| self.failure(&error, length, unpacked.len()))?;
        if read > most {
            let reason = format!("it has more than the {length} bytes that its header states");
            return Err(self.malformed(reason));
        }
        Ok(())
    }

    fn failure(&self, error: &io::Error, expected: usize, found: usize) -> InputError {
        if error.kind() == io::ErrorKind::UnexpectedEof {
            InputError::Truncated {
                path: self.path.into(),
                expected: expected as u64,
                found: found as u64,
            }
        } else {
            self.malformed(error.to_string())
        }
    }

    /// The error for bytes that do not follow the format.
    pub fn malformed(&self, reason: impl Into<String>) -> InputError {
        InputError::Malformed {
            path: self.path.into(),
            format: self.format,
            reason: reason.into(),
        }
    }
}
