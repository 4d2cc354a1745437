//! Drawings as SVG, PNG and WebP: one per window, or the strip; and the whole sequence as one animated SVG.

use std::io::Write as _;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::sequence::{FrameTime, Sequence, Shows};
use super::sink::write_file;
use super::target::Target;
use super::{
    DrawnFrame, Encoder, Needs, OneDrawing, Pack, Packet, Started, Written, one_drawing, one_file,
};
use crate::base::error::{Error, Result};
use crate::draw::paint::animated::AnimatedScenes;
use crate::draw::paint::raster::Pixels;
use crate::draw::paint::svg;

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
    target: Target,
    written: Written,
}

/// Begins the drawings: one of the whole, one per window, or an animated SVG.
///
/// # Errors
/// As [`one_file`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    kind: StillKind,
) -> Started<'a> {
    let whole = match kind {
        StillKind::Svg => OneDrawing::Asked,
        StillKind::Png | StillKind::WebP => OneDrawing::Always,
    };
    match sequence.shows(target, whole) {
        Shows::Film if kind == StillKind::Svg => animation(sequence, target),
        Shows::Whole(scene) => Ok(one_drawing(target, move || {
            if kind == StillKind::Svg {
                return Ok(svg::write(scene).into_bytes());
            }
            let scale = sequence.options.scale;
            encoded(kind, &sequence.painter.paint(scene, scale)?)
        })),
        Shows::Film | Shows::Windows => Ok(Box::new(Images {
            kind,
            sequence,
            target: target.clone(),
            written: Written::to(target),
        })),
    }
}

impl Encoder for Images<'_> {
    fn needs(&self) -> Needs {
        match self.kind {
            StillKind::Svg => Needs::Scene,
            StillKind::Png | StillKind::WebP => Needs::Pixels,
        }
    }

    fn pack(&self) -> Pack {
        match self.kind {
            StillKind::Svg => |frame| Ok(Packet::Bytes(svg::write(frame.scene).into_bytes())),
            StillKind::Png => |frame| packed(StillKind::Png, frame),
            StillKind::WebP => |frame| packed(StillKind::WebP, frame),
        }
    }

    fn take(&mut self, frame_time: FrameTime, packet: Packet) -> Result<()> {
        if let Packet::Bytes(bytes) = packet {
            let frames = &self.sequence.view.frames;
            let index = frames[frame_time.window].index;
            let target = self.target.numbered(index, frames.len());
            self.written.add(write_file(&target, &bytes)?);
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Written> {
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

/// The number of elements above which browsers need a third of a core or more to show it, even with reduced motion.
const MANY: usize = 100;

/// Begins the animation.
fn animation<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    one_file(target, "all windows are in one file", move |sink| {
        let elements = sequence.view.items.len() + sequence.view.arrows.len();
        let remark =
            format!("an animated SVG of {elements} elements is slow in browsers; prefer a GIF");
        let remarks = (elements > MANY).then_some(remark).into_iter().collect();
        let times = sequence.frame_times(true);
        let busiest = sequence.view.busiest();
        let still = times.iter().rposition(|time| time.window <= busiest);
        let scene = |time: &FrameTime| (sequence.picture.scene(time.window), time.ms);
        let scenes = AnimatedScenes::new(times.iter().map(scene));
        let title = sequence.picture.title().unwrap_or_default();
        let text = scenes.write(title, still.unwrap_or(0));
        sink.write_all(text.as_bytes()).map(|()| remarks)
    })
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
