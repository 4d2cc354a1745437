//! The animation as GIF: one palette for all frames, and only the pixels that change.

use std::io::{self, Write};

use super::{DrawnFrame, Encoder, Needs, Pack, Packet, Started, Written};
use crate::base::error::{Error, Result};
use crate::export::palette::{self, Area, Palette};
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::sink::OutputSink;
use crate::export::target::Target;

/// The shortest time a frame is shown, in GIF's units of 10 ms: browsers slow down anything faster.
const SHORTEST: u64 = 2;
/// The longest time a frame is shown, in the same units.
const LONGEST: u64 = 65_535;

/// Begins the animation.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    target.must_be_one("an animation contains all windows")?;
    Ok(Box::new(GifFile {
        target: target.clone(),
        sink: Some(OutputSink::create(target, sequence.options.max_bytes)?),
        animation: None,
    }))
}

struct GifFile {
    target: Target,
    /// The file, until the first frame.
    sink: Option<OutputSink>,
    animation: Option<Animation<OutputSink>>,
}

impl GifFile {
    fn error(&self) -> impl FnOnce(io::Error) -> Error + use<> {
        Error::io("write", self.target.path())
    }

    /// Refuses sizes in pixels that GIF cannot represent.
    fn check(&self, (width, height): (u32, u32)) -> Result<()> {
        if width.max(height) <= u16::MAX.into() {
            return Ok(());
        }
        let reason = format!("{width} by {height} pixels exceed GIF's limit");
        let hint = "give a `--size` below 65,536 pixels, or write `{n}.png`";
        Err(Error::output(self.target.path(), reason, hint))
    }
}

impl Encoder for GifFile {
    fn needs(&self) -> Needs {
        Needs::Indices
    }

    fn pack(&self) -> Pack {
        pack
    }

    fn begin(&mut self, size: (u32, u32), palette: &Palette) -> Result<()> {
        if let Some(sink) = self.sink.take() {
            self.check(size)?;
            let animation = Animation::new(sink, size, palette);
            self.animation = Some(animation.map_err(self.error())?);
        }
        Ok(())
    }

    fn take(&mut self, frame_time: FrameTime, packet: Packet) -> Result<()> {
        let failed = self.error();
        match &mut self.animation {
            Some(animation) => animation.add(packet, frame_time.ms).map_err(failed),
            None => Ok(()),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        let failed = self.error();
        let mut written = Written::to(&self.target);
        if let Some(animation) = self.animation.take() {
            written.add(animation.finish().map_err(failed)?.commit()?);
        }
        Ok(written)
    }
}

/// The frame compressed for GIF: all of it, or the area that differs from the previous frame.
#[expect(clippy::unnecessary_wraps, reason = "other formats can fail")]
fn pack(frame: &DrawnFrame<'_>) -> Result<Packet> {
    let width = frame.pixels.width as usize;
    let clear = clear(frame.palette);
    let (area, pixels) = if frame.before.is_empty() {
        let area = Area {
            x: 0,
            y: 0,
            width,
            height: frame.pixels.height as usize,
        };
        (area, frame.indices.to_vec())
    } else {
        let Some(area) = palette::difference(frame.before, frame.indices, width) else {
            return Ok(Packet::Nothing);
        };
        let patch = palette::patch(frame.before, frame.indices, width, area, clear);
        (area, patch)
    };
    Ok(Packet::Patch(area, compressed(pixels)))
}

/// The index after the last colour, for unchanged pixels.
fn clear(palette: &Palette) -> u8 {
    u8::try_from(palette.colours().len()).unwrap_or(u8::MAX)
}

fn compressed(pixels: Vec<u8>) -> Vec<u8> {
    let mut frame = gif::Frame {
        buffer: pixels.into(),
        ..gif::Frame::default()
    };
    frame.make_lzw_pre_encoded();
    frame.buffer.into_owned()
}

/// A GIF in progress. A frame waits until the next one differs, since its duration is only known then.
struct Animation<W: Write> {
    encoder: gif::Encoder<W>,
    clear: u8,
    waiting: Option<gif::Frame<'static>>,
    /// When the waiting frame began and when the next begins, in milliseconds.
    began: u64,
    now: u64,
}

impl<W: Write> Animation<W> {
    /// Begins an endless loop; the palette has at most 255 colours.
    fn new(out: W, size: (u32, u32), palette: &Palette) -> io::Result<Self> {
        let mut colours = palette.bytes();
        colours.extend([0; 3]);
        let narrow = |pixels: u32| u16::try_from(pixels).map_err(io::Error::other);
        let encoder = gif::Encoder::new(out, narrow(size.0)?, narrow(size.1)?, &colours);
        let mut encoder = encoder.map_err(to_io)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(to_io)?;
        Ok(Self {
            encoder,
            clear: clear(palette),
            waiting: None,
            began: 0,
            now: 0,
        })
    }

    /// Shows a frame for `ms` milliseconds; an unchanged one prolongs the previous one.
    fn add(&mut self, packet: Packet, ms: u32) -> io::Result<()> {
        if let Packet::Patch(area, bytes) = packet {
            let is_first = self.waiting.is_none();
            let next = patch(area, bytes, (!is_first).then_some(self.clear))?;
            self.write_waiting()?;
            self.waiting = Some(next);
        }
        self.now += u64::from(ms);
        Ok(())
    }

    fn finish(mut self) -> io::Result<W> {
        self.write_waiting()?;
        self.encoder.into_inner().map_err(to_io)
    }

    /// Writes the waiting frame, as often as its time needs.
    fn write_waiting(&mut self) -> io::Result<()> {
        let Some(mut frame) = self.waiting.take() else {
            return Ok(());
        };
        // Whole hundredths, rounded from the start, so that errors do not add up.
        let hundredths = |ms: u64| (ms + 5) / 10;
        let mut left = (hundredths(self.now) - hundredths(self.began)).max(SHORTEST);
        self.began = self.now;
        while left > 0 {
            let part = left.min(LONGEST);
            frame.delay = u16::try_from(part).unwrap_or(u16::MAX);
            let written = self.encoder.write_lzw_pre_encoded_frame(&frame);
            written.map_err(to_io)?;
            left -= part;
            if left > 0 {
                let pixel = Area {
                    x: 0,
                    y: 0,
                    width: 1,
                    height: 1,
                };
                frame = patch(pixel, compressed(vec![self.clear]), Some(self.clear))?;
            }
        }
        Ok(())
    }
}

/// A frame of compressed pixels, including `clear` ones, on top of the previous one.
fn patch(area: Area, bytes: Vec<u8>, clear: Option<u8>) -> io::Result<gif::Frame<'static>> {
    let number = |n: usize| u16::try_from(n).map_err(io::Error::other);
    Ok(gif::Frame {
        left: number(area.x)?,
        top: number(area.y)?,
        width: number(area.width)?,
        height: number(area.height)?,
        buffer: bytes.into(),
        transparent: clear,
        dispose: gif::DisposalMethod::Keep,
        ..gif::Frame::default()
    })
}

fn to_io(error: gif::EncodingError) -> io::Error {
    match error {
        gif::EncodingError::Io(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::geometry::Size;
    use crate::draw::paint::raster::Pixels;
    use crate::draw::scene::Scene;
    use crate::draw::style::Color;

    const SIZE: (u16, u16) = (40, 30);

    /// The packet of a frame with these palette indices.
    fn packed(
        palette: &Palette,
        before: &[u8],
        indices: &[u8],
        (width, height): (u16, u16),
        pack: Pack,
    ) -> Packet {
        let pixels = Pixels {
            width: width.into(),
            height: height.into(),
            rgba: Vec::new(),
        };
        let scene = Scene {
            size: Size::new(width.into(), height.into()),
            width_mm: None,
            background: Color::NONE,
            title: String::new(),
            groups: Vec::new(),
        };
        pack(&DrawnFrame {
            scene: &scene,
            pixels: &pixels,
            palette,
            indices,
            before,
        })
        .unwrap()
    }

    fn colours() -> Palette {
        Palette::new(vec![[255; 3], [200, 30, 30], [10, 20, 120]])
    }

    /// A white frame with one dot of colour 1 at `x`.
    fn dot(x: usize) -> Vec<u8> {
        let mut frame = vec![0; usize::from(SIZE.0) * usize::from(SIZE.1)];
        frame[x] = 1;
        frame
    }

    /// These frames as a decoder reads them: delays in hundredths and the colour of each pixel.
    fn played(frames: &[(Vec<u8>, u32)]) -> Vec<(u16, Vec<u8>)> {
        let palette = colours();
        let mut animation = Animation::new(Vec::new(), (40, 30), &palette).unwrap();
        let mut before: &[u8] = &[];
        for (frame, ms) in frames {
            let packet = packed(&palette, before, frame, SIZE, pack);
            animation.add(packet, *ms).unwrap();
            before = frame;
        }
        let bytes = animation.finish().unwrap();
        let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..]).unwrap();
        let mut canvas = vec![9; frames[0].0.len()];
        let mut shown = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            for (i, pixel) in frame.buffer.iter().enumerate() {
                let (x, y) = (i % usize::from(frame.width), i / usize::from(frame.width));
                let place = (y + usize::from(frame.top)) * usize::from(SIZE.0);
                if frame.transparent != Some(*pixel) {
                    canvas[place + x + usize::from(frame.left)] = *pixel;
                }
            }
            shown.push((frame.delay, canvas.clone()));
        }
        assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
        shown
    }

    #[test]
    fn frames_round_trip() {
        let frames = [(dot(3), 500), (dot(700), 500), (dot(3), 1000)];
        let expected = frames
            .clone()
            .map(|(f, ms)| (u16::try_from(ms / 10).unwrap(), f));
        assert_eq!(played(&frames), expected);
    }

    #[test]
    fn an_unchanged_frame_prolongs_the_previous_one() {
        let shown = played(&[(dot(3), 500), (dot(3), 500), (dot(4), 250)]);
        assert_eq!(shown, [(100, dot(3)), (25, dot(4))]);
    }

    #[test]
    fn delays_are_within_the_limits_of_browsers_and_gif() {
        let shown = played(&[(dot(3), 1), (dot(4), 700_000)]);
        let delays: Vec<u16> = shown.iter().map(|s| s.0).collect();
        assert_eq!(delays, [2, 65_535, 4465]);
        assert_eq!(shown[2].1, dot(4));
    }

    #[test]
    fn rounding_errors_do_not_add_up() {
        let frames: Vec<_> = (0..300).map(|i| (dot(i), 33)).collect();
        let total: u32 = played(&frames).iter().map(|f| u32::from(f.0)).sum();
        assert_eq!(total, 990);
    }
}
