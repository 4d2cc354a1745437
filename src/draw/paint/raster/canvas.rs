//! Frames one after another: only changed parts are redrawn, with the same pixels as a full redraw.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::tiles::{SIDE, Tiles};
use super::{Painter, PixelSheet, Pixels, RasterGroup, fill};
use crate::base::cast;
use crate::base::error::Result;
use crate::draw::scene::{Group, Scene};

/// The largest share of changed tiles; above it, everything is redrawn, since clipping then costs more than it saves.
const MOST_SHARE: f64 = 0.7;

/// A scene with its pixels.
pub struct DrawnScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its pixels; none if it was not drawn.
    pub pixels: &'a Pixels,
    sheet: Option<(&'a PixelSheet, Option<&'a Tiles>)>,
}

impl<'a> DrawnScene<'a> {
    /// A scene that was not drawn.
    pub fn without_pixels(scene: &'a Scene) -> Self {
        const NOTHING: &Pixels = &Pixels {
            width: 0,
            height: 0,
            rgba: Vec::new(),
        };
        Self {
            scene,
            pixels: NOTHING,
            sheet: None,
        }
    }

    /// The bytes of the pixels that may differ from those of the scene before, from top to bottom.
    pub fn changed(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let rows = self
            .sheet
            .and_then(|(sheet, dirty)| Some(sheet.rows(dirty?)));
        let all = rows.is_none().then_some(0..self.pixels.rgba.len());
        all.into_iter().chain(rows.into_iter().flatten())
    }
}

/// A page on which frames are drawn one after another; it stores the last one.
pub struct Canvas<'a> {
    painter: &'a Painter,
    scale: f64,
    last: Option<Last>,
}

struct Last {
    scene: Scene,
    drawn: Vec<Arc<RasterGroup>>,
    sheet: PixelSheet,
    scratch: PixelSheet,
    /// The tiles that differ from the previous scene; `None` for all of them.
    dirty: Option<Tiles>,
}

impl<'a> Canvas<'a> {
    /// An empty canvas; scenes on it are `scale` times as large.
    pub fn new(painter: &'a Painter, scale: f64) -> Self {
        Self {
            painter,
            scale,
            last: None,
        }
    }

    /// The scene in pixels, equal to [`Painter::paint`]; fast if little differs from the previous scene.
    ///
    /// # Errors
    /// As [`Painter::paint`].
    pub fn draw(&mut self, scene: Scene) -> Result<DrawnScene<'_>> {
        let last = match self.last.take() {
            Some(last) => last.followed_by(scene, self.painter)?,
            None => Last::first(scene, self.painter, self.scale)?,
        };
        let last = self.last.insert(last);
        Ok(DrawnScene {
            scene: &last.scene,
            pixels: &last.sheet.pixels,
            sheet: Some((&last.sheet, last.dirty.as_ref())),
        })
    }
}

impl Last {
    fn first(scene: Scene, painter: &Painter, scale: f64) -> Result<Self> {
        let mut drawn = Vec::with_capacity(scene.groups.len());
        Ok(Self {
            sheet: PixelSheet::covered(painter, &scene, scale, |group| drawn.push(group))?,
            scratch: PixelSheet::of(&scene, scale)?,
            scene,
            drawn,
            dirty: None,
        })
    }

    /// Redraws the parts that differ, or everything if there are too many.
    fn followed_by(mut self, scene: Scene, painter: &Painter) -> Result<Self> {
        if scene.size != self.scene.size || scene.background != self.scene.background {
            return Self::first(scene, painter, self.sheet.scale);
        }
        let stays = self.stays(&scene);
        let groups = scene.groups.iter().zip(&stays);
        let drawn = groups.map(|(group, stays)| match stays {
            Some(at) => Ok(Arc::clone(&self.drawn[*at])),
            None => painter.read(&scene, group, &self.sheet),
        });
        let drawn: Vec<_> = drawn.collect::<Result<_>>()?;
        let dirty = self.dirty(&scene, &drawn, &stays);
        match &dirty {
            Some(dirty) => self.mend(&scene, &drawn, dirty),
            None => self.sheet.cover(&scene, &drawn),
        }
        Ok(Self {
            scene,
            drawn,
            dirty,
            ..self
        })
    }

    /// Draws the groups that overlap these tiles, and copies only these tiles.
    fn mend(&mut self, scene: &Scene, drawn: &[Arc<RasterGroup>], dirty: &Tiles) {
        self.scratch.clear(dirty, scene);
        for group in drawn.iter().filter(|d| d.tiles.meets(dirty)) {
            self.scratch.draw(group);
        }
        self.sheet.copy(dirty, &self.scratch);
    }

    /// The index in the previous scene of each group that is equal there.
    fn stays(&self, scene: &Scene) -> Vec<Option<usize>> {
        let ids = self.scene.groups.iter().map(|group| group.id.as_str());
        let before: HashMap<&str, usize> = ids.zip(0..).collect();
        let same = |group: &Group| {
            let at = before.get(group.id.as_str()).copied();
            at.filter(|at| self.scene.groups[*at] == *group)
        };
        scene.groups.iter().map(same).collect()
    }

    /// The tiles under everything that differs; `None` if everything must be redrawn.
    fn dirty(
        &self,
        scene: &Scene,
        drawn: &[Arc<RasterGroup>],
        stays: &[Option<usize>],
    ) -> Option<Tiles> {
        // Unchanged groups must keep their order, or overlaps would differ.
        if !stays.iter().flatten().is_sorted() {
            return None;
        }
        let mut dirty = Tiles::none(scene.size);
        let new = drawn.iter().zip(stays).filter(|(_, stays)| stays.is_none());
        new.for_each(|(drawn, _)| dirty.extend(&drawn.tiles));
        let mut is_gone = vec![true; self.drawn.len()];
        stays.iter().flatten().for_each(|at| is_gone[*at] = false);
        let gone = self.drawn.iter().zip(&is_gone).filter(|(_, gone)| **gone);
        gone.for_each(|(drawn, _)| dirty.extend(&drawn.tiles));
        (dirty.share() <= MOST_SHARE).then_some(dirty)
    }
}

impl PixelSheet {
    /// The byte range of each row of pixels inside the tiles.
    fn rows(&self, tiles: &Tiles) -> impl Iterator<Item = Range<usize>> + use<> {
        let (width, height) = (self.pixels.width as usize, self.pixels.height as usize);
        let scale = self.scale;
        let edge = move |tile: usize, most: usize| {
            cast::to_usize(libm::floor(tile as f64 * SIDE * scale).min(most as f64))
        };
        tiles.spans().into_iter().flat_map(move |(columns, row)| {
            let (left, right) = (edge(columns.start, width), edge(columns.end, width));
            let lines = edge(row, height)..edge(row + 1, height);
            lines.map(move |y| (y * width + left) * 4..(y * width + right) * 4)
        })
    }

    fn clear(&mut self, tiles: &Tiles, scene: &Scene) {
        for row in self.rows(tiles) {
            fill(&mut self.pixels.rgba[row], scene.background);
        }
    }

    fn copy(&mut self, tiles: &Tiles, from: &Self) {
        for row in self.rows(tiles) {
            self.pixels.rgba[row.clone()].copy_from_slice(&from.pixels.rgba[row]);
        }
    }
}
