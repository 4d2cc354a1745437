//! Drawings as SVG, PNG and WebP: one per window, or the strip.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::{DrawnFrame, Encoder, Needs, Pack, Packet, Written};
use crate::base::error::{Error, Result};
use crate::draw::paint::raster::Pixels;
use crate::draw::paint::svg;
use crate::draw::scene::Scene;
use crate::export::sequence::{FrameTime, Sequence, Shows};
use crate::export::sink::write_file;
use crate::export::target::Target;

/// The formats of still drawings.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum StillKind {
    Svg,
    Png,
    WebP,
}

struct Images<'a> {
    kind: StillKind,
    sequence: &'a Sequence<'a>,
    /// The one drawing to write, if it is not a sequence.
    strip: Option<&'a Scene>,
    target: Target,
    windows: usize,
    written: Written,
}

/// Begins the drawings: one of the whole, or one per window.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    kind: StillKind,
    shows: Shows<'a>,
) -> Box<dyn Encoder + 'a> {
    Box::new(Images {
        kind,
        sequence,
        strip: match shows {
            Shows::Whole(scene) => Some(scene),
            Shows::Film | Shows::Windows => None,
        },
        target: target.clone(),
        windows: sequence.view.frames.len(),
        written: Written::to(target),
    })
}

impl Images<'_> {
    /// The one drawing, encoded.
    fn alone(&self, scene: &Scene) -> Result<Vec<u8>> {
        if self.kind == StillKind::Svg {
            return Ok(svg::write(scene).into_bytes());
        }
        let scale = self.sequence.options.scale;
        encoded(self.kind, &self.sequence.painter.paint(scene, scale)?)
    }
}

impl Encoder for Images<'_> {
    fn needs(&self) -> Needs {
        match (self.strip, self.kind) {
            (Some(_), _) => Needs::Nothing,
            (None, StillKind::Svg) => Needs::Scene,
            (None, _) => Needs::Pixels,
        }
    }

    fn pack(&self) -> Pack {
        match self.kind {
            StillKind::Svg => |frame| Ok(Packet::Bytes(svg::write(frame.scene).into_bytes())),
            StillKind::Png => |frame| packed(StillKind::Png, frame),
            StillKind::WebP => |frame| packed(StillKind::WebP, frame),
        }
    }

    fn take(&mut self, index: usize, _: FrameTime, packet: Packet) -> Result<()> {
        let Packet::Bytes(bytes) = packet else {
            return Ok(());
        };
        let target = self.target.numbered(index, self.windows);
        self.written.add(write_file(&target, &bytes)?);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        if let Some(scene) = self.strip {
            let bytes = self.alone(scene)?;
            self.written.add(write_file(&self.target, &bytes)?);
        }
        Ok(self.written)
    }
}

fn packed(kind: StillKind, frame: &DrawnFrame<'_>) -> Result<Packet> {
    encoded(kind, frame.pixels).map(Packet::Bytes)
}

/// An image; without its transparency, as pictures have a background.
fn encoded(kind: StillKind, pixels: &Pixels) -> Result<Vec<u8>> {
    let mut rgb = Vec::with_capacity(pixels.rgba.len() / 4 * 3);
    for pixel in pixels.rgba.chunks_exact(4) {
        rgb.extend_from_slice(&pixel[..3]);
    }
    let (width, height, color) = (pixels.width, pixels.height, ExtendedColorType::Rgb8);
    let mut out = Vec::new();
    match kind {
        // Ten times as fast as the default, for a quarter more bytes. Pixels are never requested of an SVG.
        StillKind::Png | StillKind::Svg => {
            PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Adaptive)
                .write_image(&rgb, width, height, color)
        }
        StillKind::WebP => {
            WebPEncoder::new_lossless(&mut out).write_image(&rgb, width, height, color)
        }
    }
    .map_err(|error| {
        let what = format!("an image of {width} x {height} pixels cannot be written: {error}");
        Error::usage(what, "try a smaller `--size`")
    })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_formats_keep_every_pixel() {
        let rgba: Vec<u8> = (0..70 * 50_u32)
            .flat_map(|i| {
                let [_, a, b, c] = (i * 2311).to_be_bytes();
                [a, b, c, 255]
            })
            .collect();
        let pixels = Pixels {
            width: 70,
            height: 50,
            rgba,
        };
        for kind in [StillKind::Png, StillKind::WebP] {
            let bytes = encoded(kind, &pixels).unwrap();
            let read = image::load_from_memory(&bytes).unwrap().to_rgba8();
            assert_eq!(read.dimensions(), (70, 50));
            assert_eq!(read.into_raw(), pixels.rgba);
        }
    }
}
