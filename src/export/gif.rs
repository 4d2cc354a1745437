//! The animation as GIF: one palette for all frames, and only the pixels that change.

use std::io::{self, Write};

use super::{Encoder, Frame, Needs, Written};
use crate::base::error::{Error, Result};
use crate::export::palette::{self, Area, Palette};
use crate::export::sequence::Sequence;
use crate::export::sink::Sink;
use crate::export::target::Target;

/// The shortest time a frame is shown, in units of 10 ms as GIF counts: browsers slow down anything faster.
const SHORTEST: u64 = 2;
/// The longest time a frame is shown, in the same units.
const LONGEST: u64 = 65_535;

struct Gif {
    target: Target,
    /// The file until the first frame comes.
    sink: Option<Sink>,
    animation: Option<Animation<Sink>>,
}

/// Begins the animation.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    target.must_be_one("an animation holds all windows")?;
    Ok(Box::new(Gif {
        target: target.clone(),
        sink: Some(Sink::create(target, sequence.options.max_bytes)?),
        animation: None,
    }))
}

impl Gif {
    fn error(&self) -> impl FnOnce(io::Error) -> Error + use<> {
        Error::io("write", self.target.path())
    }

    fn begin(&mut self, frame: &Frame<'_>) -> Result<()> {
        let Some(sink) = self.sink.take() else {
            return Ok(());
        };
        let (width, height) = (frame.pixels.width, frame.pixels.height);
        let (Ok(w), Ok(h)) = (u16::try_from(width), u16::try_from(height)) else {
            return Err(Error::Output {
                path: self.target.path().to_owned(),
                reason: format!("{width} by {height} pixels are more than GIF can say"),
                hint: "give a `--size` below 65,536 pixels, or write `.apng`".to_owned(),
            });
        };
        let animation = Animation::new(sink, (w, h), frame.palette, frame.indices);
        self.animation = Some(animation.map_err(self.error())?);
        Ok(())
    }
}

impl Encoder for Gif {
    fn needs(&self) -> Needs {
        Needs::Indices
    }

    fn plays(&self) -> bool {
        true
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<()> {
        self.begin(frame)?;
        let failed = self.error();
        match &mut self.animation {
            Some(animation) => animation.add(frame.indices, frame.time.ms).map_err(failed),
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

/// A GIF being written. A frame is held back until the next one differs, since only then its time is known.
struct Animation<W: Write> {
    encoder: gif::Encoder<W>,
    /// The place after the last colour: pixels that stay as they are.
    clear: u8,
    width: usize,
    before: Vec<u8>,
    waiting: gif::Frame<'static>,
    /// When the waiting frame began and when the next begins, in milliseconds.
    began: u64,
    now: u64,
}

impl<W: Write> Animation<W> {
    /// Begins an endless loop. `first` holds a palette place for each pixel; the palette has at most 255 colours.
    fn new(out: W, size: (u16, u16), palette: &Palette, first: &[u8]) -> io::Result<Self> {
        let mut colours = palette.bytes();
        let clear = u8::try_from(palette.colours().len()).map_err(io::Error::other)?;
        colours.extend([0; 3]);
        let mut encoder = gif::Encoder::new(out, size.0, size.1, &colours).map_err(to_io)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(to_io)?;
        let waiting = gif::Frame {
            width: size.0,
            height: size.1,
            buffer: first.to_vec().into(),
            dispose: gif::DisposalMethod::Keep,
            ..gif::Frame::default()
        };
        Ok(Self {
            encoder,
            clear,
            width: usize::from(size.0),
            before: first.to_vec(),
            waiting,
            began: 0,
            now: 0,
        })
    }

    /// Shows a frame for `ms` milliseconds; one that equals the frame before prolongs it.
    fn add(&mut self, indices: &[u8], ms: u32) -> io::Result<()> {
        if let Some(area) = palette::difference(&self.before, indices, self.width) {
            let pixels = palette::patch(&self.before, indices, self.width, area, self.clear);
            let next = patch(area, pixels, self.clear)?;
            self.write_waiting()?;
            self.waiting = next;
            self.before.copy_from_slice(indices);
        }
        self.now += u64::from(ms);
        Ok(())
    }

    /// Writes the waiting frame, as often as its time needs.
    fn write_waiting(&mut self) -> io::Result<()> {
        // Whole hundredths, rounded from the start, so that errors do not add up.
        let hundredths = |ms: u64| (ms + 5) / 10;
        let mut left = (hundredths(self.now) - hundredths(self.began)).max(SHORTEST);
        self.began = self.now;
        while left > 0 {
            let part = left.min(LONGEST);
            self.waiting.delay = u16::try_from(part).unwrap_or(u16::MAX);
            self.encoder.write_frame(&self.waiting).map_err(to_io)?;
            left -= part;
            if left > 0 {
                let pixel = Area {
                    x: 0,
                    y: 0,
                    width: 1,
                    height: 1,
                };
                self.waiting = patch(pixel, vec![self.clear], self.clear)?;
            }
        }
        Ok(())
    }

    /// Ends the file.
    fn finish(mut self) -> io::Result<W> {
        self.write_waiting()?;
        self.encoder.into_inner().map_err(to_io)
    }
}

/// A frame of some pixels, `clear` ones among them, on top of the one before.
fn patch(area: Area, pixels: Vec<u8>, clear: u8) -> io::Result<gif::Frame<'static>> {
    let number = |n: usize| u16::try_from(n).map_err(io::Error::other);
    Ok(gif::Frame {
        left: number(area.x)?,
        top: number(area.y)?,
        width: number(area.width)?,
        height: number(area.height)?,
        buffer: pixels.into(),
        transparent: Some(clear),
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

    const SIZE: (u16, u16) = (40, 30);

    fn colours() -> Palette {
        Palette::new(vec![[255; 3], [200, 30, 30], [10, 20, 120]])
    }

    /// A white frame with one dot of colour 1 at `x`.
    fn dot(x: usize) -> Vec<u8> {
        let mut frame = vec![0; usize::from(SIZE.0) * usize::from(SIZE.1)];
        frame[x] = 1;
        frame
    }

    /// What a decoder makes of these frames: delays in hundredths and the colour of each pixel.
    fn played(frames: &[(Vec<u8>, u32)]) -> Vec<(u16, Vec<u8>)> {
        let mut animation = Animation::new(Vec::new(), SIZE, &colours(), &frames[0].0).unwrap();
        for (frame, ms) in frames {
            animation.add(frame, *ms).unwrap();
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
    fn every_frame_comes_back_as_it_was() {
        let frames = [(dot(3), 500), (dot(700), 500), (dot(3), 1000)];
        let expected = frames
            .clone()
            .map(|(f, ms)| (u16::try_from(ms / 10).unwrap(), f));
        assert_eq!(played(&frames), expected);
    }

    #[test]
    fn an_unchanged_frame_prolongs_the_one_before() {
        let shown = played(&[(dot(3), 500), (dot(3), 500), (dot(4), 250)]);
        assert_eq!(shown, [(100, dot(3)), (25, dot(4))]);
    }

    #[test]
    fn no_frame_is_faster_than_browsers_show_and_none_is_lost_for_being_long() {
        let shown = played(&[(dot(3), 1), (dot(4), 700_000)]);
        let delays: Vec<u16> = shown.iter().map(|s| s.0).collect();
        assert_eq!(delays, [2, 65_535, 4465]);
        assert_eq!(shown[2].1, dot(4));
    }

    #[test]
    fn rounding_does_not_add_up() {
        let frames: Vec<_> = (0..300).map(|i| (dot(i), 33)).collect();
        let total: u32 = played(&frames).iter().map(|f| u32::from(f.0)).sum();
        assert_eq!(total, 990);
    }
}
