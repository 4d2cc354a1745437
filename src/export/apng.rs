//! The animation as APNG: indexed colours, and only the pixels that change.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use super::indexed::{self, IndexedAnimation};
use super::{DrawnFrame, Pack, Packet, Started};
use crate::base::error::Result;
use crate::export::palette::{self, Area, Palette};
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::Target;

/// The file, shared with the writer, which does not return it.
struct Shared<W>(Arc<Mutex<W>>);

impl<W: Write> Write for Shared<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut out = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Begins the animation.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    indexed::start::<Animation<OutputSink>>(sequence, target)
}

/// The packet of the area that differs from the previous frame; one pixel if nothing does, as a frame cannot be empty.
#[expect(clippy::unnecessary_wraps, reason = "other formats can fail")]
fn pack(frame: &DrawnFrame<'_>) -> Result<Packet> {
    if frame.before.is_empty() {
        return Ok(Packet::Bytes(frame.indices.to_vec()));
    }
    let pixel = Area {
        x: 0,
        y: 0,
        width: 1,
        height: 1,
    };
    let width = frame.pixels.width as usize;
    let area = palette::difference(frame.before, frame.indices, width).unwrap_or(pixel);
    let clear = u8::try_from(frame.palette.colours().len()).unwrap_or(u8::MAX);
    let pixels = palette::patch(frame.before, frame.indices, width, area, clear);
    Ok(Packet::Patch(area, pixels))
}

/// An APNG in progress. The number of frames is stated first, so equal frames are not joined.
struct Animation<W: Write> {
    out: Arc<Mutex<W>>,
    writer: png::Writer<Shared<W>>,
}

impl<W: Write> IndexedAnimation<W> for Animation<W> {
    const PACK: Pack = pack;

    fn new(out: W, size: (u32, u32), palette: &Palette, frames: usize) -> io::Result<Self> {
        let frames = u32::try_from(frames).unwrap_or(u32::MAX);
        let out = Arc::new(Mutex::new(out));
        let mut colours = palette.bytes();
        colours.extend([0; 3]);
        let mut opacity = vec![255; palette.colours().len()];
        opacity.push(0);
        let mut encoder = png::Encoder::new(Shared(Arc::clone(&out)), size.0, size.1);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(colours);
        encoder.set_trns(opacity);
        // Filters do not help indexed pixels, and `Fast` writes 27 times the bytes. The highest level is slow, but few
        // pixels change, and only it comes close to GIF.
        encoder.set_filter(png::Filter::NoFilter);
        encoder.set_deflate_compression(png::DeflateCompression::Level(9));
        encoder.set_animated(frames, 0).map_err(to_io)?;
        encoder.set_blend_op(png::BlendOp::Over).map_err(to_io)?;
        let writer = encoder.write_header().map_err(to_io)?;
        Ok(Self { out, writer })
    }

    fn add(&mut self, packet: Packet, ms: u32) -> io::Result<()> {
        let (delay, parts) = delay(ms);
        self.writer.set_frame_delay(delay, parts).map_err(to_io)?;
        let pixels = match packet {
            Packet::Patch(area, pixels) => {
                self.place(area).map_err(to_io)?;
                pixels
            }
            Packet::Bytes(pixels) => pixels,
            _ => return Ok(()),
        };
        self.writer.write_image_data(&pixels).map_err(to_io)
    }

    fn finish(self) -> io::Result<W> {
        self.writer.finish().map_err(to_io)?;
        let out = Arc::into_inner(self.out).ok_or(io::ErrorKind::ResourceBusy)?;
        Ok(out.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<W: Write> Animation<W> {
    /// Sets the area of the next pixels.
    fn place(&mut self, area: Area) -> Result<(), png::EncodingError> {
        // Positions inside an image whose sides are u32.
        let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        self.writer.set_frame_position(0, 0)?;
        self.writer
            .set_frame_dimension(number(area.width), number(area.height))?;
        self.writer
            .set_frame_position(number(area.x), number(area.y))
    }
}

/// A delay as a fraction of a second: in milliseconds, or in seconds if those do not fit.
fn delay(ms: u32) -> (u16, u16) {
    match u16::try_from(ms) {
        Ok(ms) => (ms, 1000),
        Err(_) => (u16::try_from(ms / 1000).unwrap_or(u16::MAX), 1),
    }
}

fn to_io(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::encoder::testing::packed;

    const SIZE: (u32, u32) = (40, 30);

    /// A white frame with one dot of colour 1 at `x`.
    fn dot(x: usize) -> Vec<u8> {
        let mut frame = vec![0; 1200];
        frame[x] = 1;
        frame
    }

    fn written(frames: &[(Vec<u8>, u32)]) -> Vec<u8> {
        let palette = Palette::new(vec![[255; 3], [200, 30, 30]]);
        let mut animation = Animation::new(Vec::new(), SIZE, &palette, frames.len()).unwrap();
        let mut before: &[u8] = &[];
        for (frame, ms) in frames {
            let packet = packed(&palette, before, frame, (40, 30), pack);
            animation.add(packet, *ms).unwrap();
            before = frame;
        }
        animation.finish().unwrap()
    }

    /// The frames as a decoder reads them: delays in milliseconds and the position of the dot.
    fn played(bytes: &[u8]) -> Vec<(u16, usize)> {
        let mut reader = png::Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let frames = reader.info().animation_control().unwrap().num_frames;
        let mut canvas = vec![9; 1200];
        let mut shown = Vec::new();
        for _ in 0..frames {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            let control = *reader.info().frame_control().unwrap();
            let columns = control.width as usize;
            for i in 0..columns * control.height as usize {
                let row = control.y_offset as usize + i / columns;
                if pixels[i] != 2 {
                    canvas[row * 40 + control.x_offset as usize + i % columns] = pixels[i];
                }
            }
            let dot = canvas.iter().position(|p| *p == 1).unwrap();
            assert_eq!(canvas.iter().filter(|p| **p != 0).count(), 1);
            shown.push((control.delay_num, dot));
        }
        shown
    }

    #[test]
    fn frames_round_trip() {
        let bytes = written(&[(dot(3), 500), (dot(700), 250), (dot(700), 40), (dot(9), 7)]);
        assert_eq!(played(&bytes), [(500, 3), (250, 700), (40, 700), (7, 9)]);
    }
}
