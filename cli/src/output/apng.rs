//! Animations as PNG files (APNG), which browsers show and every PNG reader takes for a picture.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::OutputError;
use shapespace_picture::Canvas;

/// Frames a second.
const RATE: u16 = 20;
/// Duration of both ends, in frames.
const PAUSE: u16 = 14;

/// Writes frames of one size that run back and forth without end.
///
/// # Errors
/// [`OutputError::Unwritable`], also for frames of different sizes and for none.
pub fn write_animation(path: &Path, frames: &[Canvas]) -> Result<(), OutputError> {
    let file = File::create(path).map_err(OutputError::at(path))?;
    let mut writer = BufWriter::new(file);
    animation_to(&mut writer, frames)
        .and_then(|()| writer.flush())
        .map_err(OutputError::at(path))
}

/// The same into any writer.
///
/// # Errors
/// Those of the writer, and [`io::ErrorKind::InvalidData`] for frames of different sizes and for
/// none.
pub fn animation_to(writer: impl Write, frames: &[Canvas]) -> io::Result<()> {
    let size = frames.first().map_or([0; 2], Canvas::size);
    if size.contains(&0) || frames.iter().any(|frame| frame.size() != size) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidData,
            "an animation needs frames of one size",
        ));
    }
    let order = forth_and_back(frames.len());
    let mut encoder = png::Encoder::new(writer, size[0] as u32, size[1] as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    // Flat colours compress best without a filter.
    encoder.set_filter(png::Filter::NoFilter);
    if order.len() > 1 {
        encoder.set_animated(order.len() as u32, 0)?;
    }
    let mut writer = encoder.write_header()?;
    for &index in &order {
        if order.len() > 1 {
            let at_end = index == 0 || index + 1 == frames.len();
            writer.set_frame_delay(if at_end { PAUSE } else { 1 }, RATE)?;
        }
        writer.write_image_data(&frames[index].bytes())?;
    }
    Ok(writer.finish()?)
}

/// Positions from the first to the last and back; both ends once.
fn forth_and_back(count: usize) -> Vec<usize> {
    (0..count).chain((1..count.max(1) - 1).rev()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_run_forth_and_back() {
        assert_eq!(forth_and_back(4), [0, 1, 2, 3, 2, 1]);
        assert_eq!(forth_and_back(2), [0, 1]);
        assert_eq!(forth_and_back(1), [0]);
        let mut frames = vec![Canvas::new(30, 20); 3];
        frames[1].blend(7, 5, [0.0; 3], 1.0);
        let mut bytes = Vec::new();
        animation_to(&mut bytes, &frames).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (4, 0));
        let mut dark = Vec::new();
        for _ in 0..4 {
            let mut frame = vec![0; 30 * 20 * 3];
            reader.next_frame(&mut frame).unwrap();
            dark.push(frame[3 * (5 * 30 + 7)] == 0);
        }
        assert_eq!(dark, [false, true, false, true]);
    }

    #[test]
    fn frames_that_do_not_fit_are_refused() {
        assert!(animation_to(Vec::new(), &[]).is_err());
        let frames = [Canvas::new(3, 3), Canvas::new(3, 4)];
        assert!(animation_to(Vec::new(), &frames).is_err());
        assert!(animation_to(Vec::new(), &frames[..1]).is_ok());
    }
}
