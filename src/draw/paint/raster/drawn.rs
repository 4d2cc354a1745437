//! A group as it is composited onto pages: small ones as cached pixels, large ones as a tree to draw each
//! time.

use resvg::usvg::Tree;
use tiny_skia::{Pixmap, PixmapMut, Transform};

use super::Pixels;
use crate::base::cast;

/// The largest number of pixels of a group that is cached as pixels: a box with its words has about ten
/// thousand.
const MOST_PIXELS: f64 = 65_536.0;
/// Pixels around a group's box, for soft edges.
const MARGIN: f64 = 2.0;

/// A group in pixels of the page.
pub(super) enum Drawn {
    Pixels(GroupPixels),
    Tree(Box<Tree>),
}

/// The pixels of a group that are not transparent: most of the area around lines is.
pub(super) struct GroupPixels {
    runs: Vec<Run>,
    /// Premultiplied red, green, blue and alpha, run by run.
    rgba: Vec<u8>,
}

/// Pixels side by side.
struct Run {
    /// The number of pixels of the page before it.
    at: usize,
    length: usize,
}

impl Drawn {
    /// The group of `tree` on a page of `page` pixels, `scale` times as large as its own size.
    pub(super) fn new(tree: Tree, scale: f64, page: (u32, u32)) -> Self {
        match GroupPixels::of(&tree, scale, page) {
            Some(pixels) => Self::Pixels(pixels),
            None => Self::Tree(Box::new(tree)),
        }
    }

    /// The number of cached bytes of its pixels.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Pixels(pixels) => pixels.rgba.len() + size_of_val(&*pixels.runs),
            Self::Tree(_) => 0,
        }
    }

    /// Composites the group onto a page of opaque pixels.
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
    /// The pixels of the group; `None` if there are too many.
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
        let [left, top, width, height] = [left, top, width, height].map(cast::to_u32);
        let mut map = Pixmap::new(width, height)?;
        #[expect(clippy::cast_precision_loss, reason = "at most 65,535")]
        let moved = scaled(scale).post_translate(-(left as f32), -(top as f32));
        resvg::render(tree, moved, &mut map.as_mut());
        Some(Self::inked(
            &map,
            (left as usize, top as usize),
            page.0 as usize,
        ))
    }

    /// The pixels of `map` that are not transparent; its corner is at this column and row of a page `across`
    /// pixels wide.
    fn inked(map: &Pixmap, (left, top): (usize, usize), across: usize) -> Self {
        let (mut runs, mut rgba) = (Vec::new(), Vec::new());
        let rows = map.data().chunks_exact(map.width() as usize * 4);
        for (row, y) in rows.zip(top..) {
            let mut x = left + y * across;
            for run in row
                .as_chunks::<4>()
                .0
                .chunk_by(|a, b| (a[3] == 0) == (b[3] == 0))
            {
                if run[0][3] != 0 {
                    runs.push(Run {
                        at: x,
                        length: run.len(),
                    });
                    rgba.extend_from_slice(run.as_flattened());
                }
                x += run.len();
            }
        }
        Self { runs, rgba }
    }

    fn lay(&self, page: &mut Pixels) {
        let mut from = &self.rgba[..];
        for run in &self.runs {
            let (now, later) = from.split_at(run.length * 4);
            let to = &mut page.rgba[run.at * 4..(run.at + run.length) * 4];
            for (to, from) in to.chunks_exact_mut(4).zip(now.chunks_exact(4)) {
                match from[3] {
                    255 => to.copy_from_slice(from),
                    alpha => over(to, from, 255 - alpha),
                }
            }
            from = later;
        }
    }
}

/// Composites a premultiplied pixel over an opaque one.
fn over(to: &mut [u8], from: &[u8], rest: u8) {
    for (to, from) in to.iter_mut().zip(&from[..3]) {
        let under = u32::from(*to) * u32::from(rest) + 128;
        // Division by 255, rounded.
        let under = (under + (under >> 8)) >> 8;
        *to = from.saturating_add(u8::try_from(under).unwrap_or(u8::MAX));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a scale near 1")]
fn scaled(scale: f64) -> Transform {
    Transform::from_scale(scale as f32, scale as f32)
}
