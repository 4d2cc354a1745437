//! A group as it is laid on pages: small ones as pixels that were drawn once, large ones as a tree to draw each time.

use resvg::usvg::Tree;
use tiny_skia::{Pixmap, PixmapMut, Transform};

use super::Pixels;

/// The largest number of pixels that are kept of one group: a box with its words has about ten thousand. Of a long
/// line nearly all would be clear, and drawing it is as quick as laying them.
const MOST_PIXELS: f64 = 65_536.0;
/// Pixels around a group's box, for soft edges.
const MARGIN: f64 = 2.0;

/// A group in pixels of the page.
pub(super) enum Drawn {
    Pixels(GroupPixels),
    Tree(Box<Tree>),
}

/// The pixels of a group and their place on the page.
pub(super) struct GroupPixels {
    left: usize,
    top: usize,
    width: usize,
    /// Premultiplied red, green, blue and alpha, row by row.
    rgba: Vec<u8>,
}

impl Drawn {
    /// The group of `tree` on a page of `page` pixels, `scale` times as large as it says.
    pub(super) fn new(tree: Tree, scale: f64, page: (u32, u32)) -> Self {
        match GroupPixels::of(&tree, scale, page) {
            Some(pixels) => Self::Pixels(pixels),
            None => Self::Tree(Box::new(tree)),
        }
    }

    /// The bytes that are kept of its pixels.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Pixels(pixels) => pixels.rgba.len(),
            Self::Tree(_) => 0,
        }
    }

    /// Lays the group on a page of opaque pixels.
    pub(super) fn lay(&self, scale: f64, page: &mut Pixels) {
        match self {
            Self::Pixels(pixels) => pixels.lay(page),
            Self::Tree(tree) => {
                if let Some(mut map) =
                    PixmapMut::from_bytes(&mut page.rgba, page.width, page.height)
                {
                    resvg::render(tree, scaled(scale), &mut map);
                }
            }
        }
    }
}

impl GroupPixels {
    /// The pixels of the group; `None` where they are too many.
    fn of(tree: &Tree, scale: f64, page: (u32, u32)) -> Option<Self> {
        let area = tree.root().abs_layer_bounding_box();
        let low = |at: f32, most: u32| {
            libm::floor(f64::from(at) * scale - MARGIN).clamp(0.0, f64::from(most))
        };
        let high = |at: f32, most: u32| {
            libm::ceil(f64::from(at) * scale + MARGIN).clamp(0.0, f64::from(most))
        };
        let (left, right) = (low(area.left(), page.0), high(area.right(), page.0));
        let (top, bottom) = (low(area.top(), page.1), high(area.bottom(), page.1));
        let (width, height) = (right - left, bottom - top);
        if width * height > MOST_PIXELS {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers inside the page"
        )]
        let (left, top, width, height) = (left as u32, top as u32, width as u32, height as u32);
        let mut map = Pixmap::new(width, height)?;
        #[expect(clippy::cast_precision_loss, reason = "at most 65,535")]
        let moved = scaled(scale).post_translate(-(left as f32), -(top as f32));
        resvg::render(tree, moved, &mut map.as_mut());
        Some(Self {
            left: left as usize,
            top: top as usize,
            width: width as usize,
            rgba: map.take(),
        })
    }

    fn lay(&self, page: &mut Pixels) {
        let across = page.width as usize * 4;
        let rows = page.rgba.chunks_exact_mut(across).skip(self.top);
        for (row, from) in rows.zip(self.rgba.chunks_exact(self.width * 4)) {
            let to = &mut row[self.left * 4..(self.left + self.width) * 4];
            for (to, from) in to.chunks_exact_mut(4).zip(from.chunks_exact(4)) {
                match from[3] {
                    0 => {}
                    255 => to.copy_from_slice(from),
                    alpha => over(to, from, 255 - alpha),
                }
            }
        }
    }
}

/// Lays a premultiplied pixel over an opaque one.
fn over(to: &mut [u8], from: &[u8], rest: u8) {
    for (to, from) in to.iter_mut().zip(&from[..3]) {
        let under = u32::from(*to) * u32::from(rest) + 128;
        // A 255th, rounded.
        let under = (under + (under >> 8)) >> 8;
        *to = from.saturating_add(u8::try_from(under).unwrap_or(u8::MAX));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a scale near 1")]
fn scaled(scale: f64) -> Transform {
    Transform::from_scale(scale as f32, scale as f32)
}
