//! Quantities of bytes on the command line and in messages.

/// Units of bytes, and their sizes.
const UNITS: [(&str, f64); 13] = [
    ("tib", 1_099_511_627_776.0),
    ("gib", 1_073_741_824.0),
    ("mib", 1_048_576.0),
    ("kib", 1024.0),
    ("tb", 1e12),
    ("gb", 1e9),
    ("mb", 1e6),
    ("kb", 1e3),
    ("t", 1_099_511_627_776.0),
    ("g", 1_073_741_824.0),
    ("m", 1_048_576.0),
    ("k", 1024.0),
    ("b", 1.0),
];

/// Fewer bytes than this need a unit: `4` is meant as GiB.
const LEAST_PLAIN: f64 = 1_048_576.0;

/// Reads a quantity of bytes: `4GiB`, `500 MB`, `2g`, `1000000`.
///
/// # Errors
/// What is expected instead.
pub fn bytes(text: &str) -> Result<u64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let (number, unit) = UNITS
        .iter()
        .find_map(|(name, unit)| Some((lower.strip_suffix(name)?, *unit)))
        .unwrap_or((&lower, 1.0));
    let number: f64 = number
        .trim_end()
        .parse()
        .map_err(|_| "a number of bytes is needed, such as 4GiB or 500MB".to_string())?;
    let plain = lower.ends_with(|c: char| c.is_ascii_digit());
    if plain && (1.0..LEAST_PLAIN).contains(&number) {
        return Err(format!(
            "{number} bytes are meant? give a unit, such as {number}GiB"
        ));
    }
    let bytes = number * unit;
    if bytes >= 1.0 && bytes < 2f64.powi(63) {
        Ok(bytes as u64)
    } else {
        Err("at least one byte, and fewer than 8 million TiB".into())
    }
}

/// A quantity of bytes as text.
pub fn format_bytes(bytes: u64) -> String {
    let size = bytes as f64;
    let mib = 1_048_576.0;
    match size {
        ..1024.0 => format!("{size} B"),
        ..1_048_576.0 => format!("{:.1} KiB", size / 1024.0),
        ..1_073_741_824.0 => format!("{:.1} MiB", size / mib),
        _ => format!("{:.1} GiB", size / (1024.0 * mib)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_of_bytes_are_read() {
        for (text, expected) in [
            ("4GiB", 4 << 30),
            ("1.5 gib", 3 << 29),
            ("500MB", 500_000_000),
            ("2g", 2 << 30),
            ("64k", 65536),
            ("2000000", 2_000_000),
            ("7 B", 7),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for wrong in [
            "", "GiB", "-1GB", "nan", "inf", "0", "4 gigs", "1e40", "1x", "4", "1000",
        ] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_written_can_be_read() {
        for size in [1, 300 << 10, 1 << 20, 300 << 20, 5 << 30] {
            assert_eq!(bytes(&format_bytes(size).replace(' ', "")), Ok(size));
        }
    }
}
