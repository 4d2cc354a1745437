//! One palette for a whole sequence: few enough colours for GIF, chosen so that frames look the same.

use std::collections::HashMap;
use std::sync::OnceLock;

/// A colour: red, green, blue.
pub(crate) type Rgb = [u8; 3];

/// The number of most frequent colours that are always included: more than a style has.
const THEME: usize = 40;
/// The number of further colours that are considered.
const CANDIDATES: usize = 6000;
/// Bits per channel of the cells in which nearest colours are looked up.
const BITS: u32 = 4;

/// A histogram of colours for a palette, independent of the order of frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Census(HashMap<Rgb, u64>);

impl Census {
    /// Counts the pixels of one frame as RGBA bytes; transparency is ignored.
    pub(crate) fn count(&mut self, rgba: &[u8]) {
        for (colour, length) in runs(rgba) {
            *self.0.entry(colour).or_default() += u64::from(length);
        }
    }

    /// The sum of both histograms.
    #[must_use]
    pub(crate) fn and(mut self, other: Self) -> Self {
        // Sums do not depend on the order of addition.
        #[expect(clippy::iter_over_hash_type, reason = "the order does not matter")]
        for (colour, count) in other.0 {
            *self.0.entry(colour).or_default() += count;
        }
        self
    }

    /// At most `most` (2..=256) colours: exactly those counted if they are so few, otherwise the most frequent ones
    /// and then, again and again, the frequent one that is farthest from all chosen.
    pub(crate) fn palette(self, most: usize) -> Palette {
        let mut counted: Vec<(Rgb, u64)> = self.0.into_iter().collect();
        counted.sort_unstable_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        let certain = if counted.len() <= most {
            counted.len()
        } else {
            THEME.min(most)
        };
        let mut colours: Vec<Rgb> = counted[..certain].iter().map(|c| c.0).collect();
        let candidates = &counted[certain..counted.len().min(certain + CANDIDATES)];
        fill(&mut colours, candidates, most);
        Palette::new(colours)
    }
}

/// Adds the farthest candidate, weighed by the root of its count, until there are `most` colours.
fn fill(colours: &mut Vec<Rgb>, candidates: &[(Rgb, u64)], most: usize) {
    let mut left: Vec<(Rgb, f64, u32)> = candidates
        .iter()
        .map(|&(colour, count)| {
            let near = colours.iter().map(|c| distance(*c, colour)).min();
            (colour, (count as f64).sqrt(), near.unwrap_or(u32::MAX))
        })
        .collect();
    while colours.len() < most {
        // Of equal ones the first is chosen, so that the result is deterministic.
        let mut best: Option<(f64, Rgb)> = None;
        for &(colour, weight, near) in &left {
            let score = f64::from(near) * weight;
            if near > 0 && best.is_none_or(|(most, _)| score > most) {
                best = Some((score, colour));
            }
        }
        let Some((_, chosen)) = best else { break };
        colours.push(chosen);
        for (colour, _, near) in &mut left {
            *near = (*near).min(distance(chosen, *colour));
        }
    }
}

/// The squared distance of two colours, 0..=195075.
fn distance(a: Rgb, b: Rgb) -> u32 {
    let square = |i: usize| u32::from(a[i].abs_diff(b[i])).pow(2);
    square(0) + square(1) + square(2)
}

/// Runs of equal pixels in RGBA bytes: colour and length.
fn runs(rgba: &[u8]) -> impl Iterator<Item = (Rgb, u32)> + '_ {
    let mut pixels = rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).peekable();
    std::iter::from_fn(move || {
        let colour = pixels.next()?;
        let mut length = 1;
        while pixels.next_if_eq(&colour).is_some() {
            length += 1;
        }
        Some((colour, length))
    })
}

/// A palette that finds the nearest of its colours quickly.
#[derive(Clone, Debug)]
pub struct Palette {
    colours: Vec<Rgb>,
    /// For every cell of the colour cube, computed on demand, the indices of all colours that can be nearest to a
    /// colour in it.
    cells: Vec<OnceLock<Vec<u8>>>,
}

impl Palette {
    /// A palette of these colours; one of black if there are none, the first 256 if there are more.
    pub fn new(mut colours: Vec<Rgb>) -> Self {
        colours.truncate(256);
        if colours.is_empty() {
            colours.push([0; 3]);
        }
        let cells = vec![OnceLock::new(); 1 << (3 * BITS)];
        Self { colours, cells }
    }

    /// The colours by index.
    pub fn colours(&self) -> &[Rgb] {
        &self.colours
    }

    /// The colours as bytes: red, green, blue of the first, and so on.
    pub fn bytes(&self) -> Vec<u8> {
        self.colours.concat()
    }

    fn nearest(&self, colour: Rgb) -> u8 {
        let [r, g, b] = colour.map(|c| usize::from(c >> (8 - BITS)));
        let cell = (r << (2 * BITS)) | (g << BITS) | b;
        let near = self.cells[cell].get_or_init(|| candidates(&self.colours, cell));
        let by_distance = |i: &&u8| distance(self.colours[usize::from(**i)], colour);
        near.iter().min_by_key(by_distance).copied().unwrap_or(0)
    }
}

/// The size of a [`Matcher`]'s cache: four times the colours of a frame.
const MET: u32 = 4096;

/// Finds the palette indices of colours, with a cache.
pub(crate) struct Matcher<'a> {
    palette: &'a Palette,
    met: Vec<Option<(Rgb, u8)>>,
}

impl<'a> Matcher<'a> {
    /// A matcher with an empty cache.
    pub(crate) fn new(palette: &'a Palette) -> Self {
        let met = vec![None; MET as usize];
        Self { palette, met }
    }

    /// Writes the index of the nearest colour of every pixel of RGBA bytes, the first of equals, into `places`.
    pub(crate) fn map(&mut self, rgba: &[u8], places: &mut [u8]) {
        let mut left = places;
        for (colour, length) in runs(rgba) {
            let (run, rest) = left.split_at_mut((length as usize).min(left.len()));
            run.fill(self.place(colour));
            left = rest;
        }
    }

    fn place(&mut self, colour: Rgb) -> u8 {
        let [r, g, b] = colour.map(u32::from);
        // Mixed with a large odd number, so that similar colours do not share a slot.
        let slot = ((r << 16 | g << 8 | b).wrapping_mul(0x9e37_79b1) >> 16) % MET;
        match self.met[slot as usize] {
            Some((met, place)) if met == colour => place,
            _ => {
                let place = self.palette.nearest(colour);
                self.met[slot as usize] = Some((colour, place));
                place
            }
        }
    }
}

/// The indices of the colours that can be nearest to a point of the cell: those whose nearest distance is below the
/// smallest farthest distance.
fn candidates(colours: &[Rgb], cell: usize) -> Vec<u8> {
    let side = 1_i32 << (8 - BITS);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "BITS bits of a cell number"
    )]
    let low = |channel: u32| (cell >> (BITS * (2 - channel))) as i32 % (1 << BITS) * side;
    let lows = [low(0), low(1), low(2)];
    // Squared distances from the colour to the cell's closest and farthest point.
    let reach = |colour: &Rgb| {
        let mut near_far = (0, 0);
        for (low, &value) in lows.iter().zip(colour) {
            let (below, above) = (low - i32::from(value), i32::from(value) - (low + side - 1));
            near_far.0 += below.max(above).max(0).pow(2);
            near_far.1 += below.abs().max(above.abs()).pow(2);
        }
        near_far
    };
    let farthest = colours.iter().map(|c| reach(c).1).min().unwrap_or(0);
    let near = (0_u8..=255).zip(colours);
    let near = near.filter(|(_, colour)| reach(colour).0 <= farthest);
    near.map(|(index, _)| index).collect()
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Columns from the left.
    pub x: usize,
    /// Rows from the top.
    pub y: usize,
    /// The number of columns, ≥ 1.
    pub width: usize,
    /// The number of rows, ≥ 1.
    pub height: usize,
}

/// The bounding box of the differences between two frames of `width` columns; `None` if they are equal.
pub(crate) fn difference(before: &[u8], after: &[u8], width: usize) -> Option<Area> {
    let rows = || before.chunks_exact(width).zip(after.chunks_exact(width));
    let top = rows().position(|(a, b)| a != b)?;
    let bottom = rows().rposition(|(a, b)| a != b)?;
    let (mut left, mut right) = (width, 0);
    // Whole rows are compared at once: most are equal.
    let differing = rows().take(bottom + 1).skip(top).filter(|(a, b)| a != b);
    for (a, b) in differing {
        let mut differs = a.iter().zip(b).map(|(a, b)| a != b);
        let first = differs.clone().position(|d| d);
        left = first.map_or(left, |at| left.min(at));
        right = differs.rposition(|d| d).map_or(right, |at| right.max(at));
    }
    Some(Area {
        x: left,
        y: top,
        width: right + 1 - left,
        height: bottom + 1 - top,
    })
}

/// The pixels of `area` in `after`, with `clear` where they equal `before`.
pub(crate) fn patch(before: &[u8], after: &[u8], width: usize, area: Area, clear: u8) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(area.width * area.height);
    for row in area.y..area.y + area.height {
        let from = row * width + area.x;
        let (a, b) = (&before[from..][..area.width], &after[from..][..area.width]);
        let pairs = a.iter().zip(b);
        pixels.extend(pairs.map(|(a, b)| if a == b { clear } else { *b }));
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of RGBA bytes from colours.
    fn frame(colours: impl IntoIterator<Item = Rgb>) -> Vec<u8> {
        let pixel = |[r, g, b]: Rgb| [r, g, b, 255];
        colours.into_iter().flat_map(pixel).collect()
    }

    /// A frame of many colours: a smooth ramp through the cube.
    fn ramp() -> Vec<u8> {
        frame((0..20_000_u32).map(|i| {
            let [_, a, b, c] = (i * 838).to_be_bytes();
            [a, b, c]
        }))
    }

    fn palette_of(rgba: &[u8], most: usize) -> Palette {
        let mut census = Census::default();
        census.count(rgba);
        census.palette(most)
    }

    fn mapped(palette: &Palette, rgba: &[u8]) -> Vec<u8> {
        let mut places = vec![0; rgba.len() / 4];
        Matcher::new(palette).map(rgba, &mut places);
        places
    }

    #[test]
    fn few_colours_are_kept_exactly() {
        let rgba = frame([[1, 2, 3], [1, 2, 3], [200, 0, 9]]);
        let palette = palette_of(&rgba, 255);
        assert_eq!(palette.colours(), [[1, 2, 3], [200, 0, 9]]);
        assert_eq!(mapped(&palette, &rgba), [0, 0, 1]);
    }

    #[test]
    fn the_nearest_colour_equals_that_of_a_full_search() {
        let rgba = ramp();
        let palette = palette_of(&rgba, 255);
        assert_eq!(palette.colours().len(), 255);
        for (pixel, index) in rgba.chunks_exact(4).zip(mapped(&palette, &rgba)) {
            let colour = [pixel[0], pixel[1], pixel[2]];
            let all = palette.colours().iter().map(|c| distance(*c, colour));
            let found = distance(palette.colours()[usize::from(index)], colour);
            assert_eq!(Some(found), all.min());
        }
    }

    #[test]
    fn the_order_of_frames_does_not_matter() {
        let (a, b) = (ramp(), frame([[9, 9, 9]; 300]));
        let counted = |frame: &[u8]| {
            let mut census = Census::default();
            census.count(frame);
            census
        };
        let both = |a, b| counted(a).and(counted(b)).palette(255).bytes();
        assert_eq!(both(&a, &b), both(&b, &a));
    }

    #[test]
    fn the_difference_area_is_minimal() {
        let before = vec![0; 12];
        let mut after = before.clone();
        assert_eq!(difference(&before, &after, 4), None);
        (after[5], after[10]) = (7, 8);
        let area = difference(&before, &after, 4).unwrap();
        let expected = Area {
            x: 1,
            y: 1,
            width: 2,
            height: 2,
        };
        assert_eq!(area, expected);
        assert_eq!(patch(&before, &after, 4, area, 255), [7, 255, 255, 8]);
    }
}
