//! One frame after another: only what changed is drawn again, to the same pixels as all of it would be.

use std::collections::HashMap;
use std::sync::Arc;

use super::tiles::{SIDE, Tiles};
use super::{Drawn, Painter, Pixels, Sheet};
use crate::base::error::Result;
use crate::draw::scene::{Group, Scene};

/// Above this share of changed tiles, all is drawn anew.
const MOST_SHARE: f64 = 0.7;

/// A page that frames are drawn on in turn; it remembers the last one.
pub struct Canvas<'a> {
    painter: &'a Painter,
    scale: f64,
    last: Option<Last>,
}

struct Last {
    scene: Scene,
    drawn: Vec<Arc<Drawn>>,
    sheet: Sheet,
    scratch: Sheet,
}

impl<'a> Canvas<'a> {
    /// An empty canvas; what is drawn on it will be `scale` times as large.
    pub fn new(painter: &'a Painter, scale: f64) -> Self {
        Self {
            painter,
            scale,
            last: None,
        }
    }

    /// The scene in pixels, equal to [`Painter::paint`]; quick if little differs from the scene before.
    ///
    /// # Errors
    /// As [`Painter::paint`].
    pub fn draw(&mut self, scene: &Scene) -> Result<Pixels> {
        let read = |group| self.painter.read(scene, group);
        let drawn: Vec<_> = scene.groups.iter().map(read).collect::<Result<_>>()?;
        let kept = match self.last.take() {
            Some(mut last) => last
                .update(scene, &drawn)
                .then_some((last.sheet, last.scratch)),
            None => None,
        };
        let (sheet, scratch) = match kept {
            Some(sheets) => sheets,
            None => (
                Sheet::covered(scene, &drawn, self.scale)?,
                Sheet::of(scene, self.scale)?,
            ),
        };
        let pixels = sheet.pixels();
        self.last = Some(Last {
            scene: scene.clone(),
            drawn,
            sheet,
            scratch,
        });
        Ok(pixels)
    }
}

impl Last {
    /// Draws what differs between the scene before and `scene` again; false, and nothing done, where that is too much.
    fn update(&mut self, scene: &Scene, drawn: &[Arc<Drawn>]) -> bool {
        let same_page = scene.size == self.scene.size && scene.background == self.scene.background;
        let Some(dirty) = same_page.then(|| self.changed(scene, drawn)).flatten() else {
            return false;
        };
        self.scratch.clear(&dirty, scene);
        for group in drawn.iter().filter(|d| d.tiles.meets(&dirty)) {
            self.scratch.draw(group);
        }
        self.sheet.copy(&dirty, &self.scratch);
        true
    }

    /// The tiles under everything that differs; `None` where all has to be drawn anew.
    fn changed(&self, scene: &Scene, drawn: &[Arc<Drawn>]) -> Option<Tiles> {
        let id = |group: &'_ Group| group.id.clone();
        let before: HashMap<String, usize> = self.scene.groups.iter().map(id).zip(0..).collect();
        let mut stays = vec![false; self.drawn.len()];
        let mut dirty = Tiles::none(scene.size);
        let mut order = 0;
        for (group, drawn) in scene.groups.iter().zip(drawn) {
            match before.get(&group.id) {
                Some(&at) if self.scene.groups[at] == *group => {
                    // What stays must stay in order, or what lies above what would differ.
                    if at < order {
                        return None;
                    }
                    order = at;
                    stays[at] = true;
                }
                _ => dirty.extend(&drawn.tiles),
            }
        }
        let gone = self.drawn.iter().zip(&stays).filter(|(_, stays)| !**stays);
        gone.for_each(|(drawn, _)| dirty.extend(&drawn.tiles));
        (dirty.share() <= MOST_SHARE).then_some(dirty)
    }
}

impl Sheet {
    fn pixels(&self) -> Pixels {
        Pixels {
            width: self.map.width(),
            height: self.map.height(),
            rgba: self.map.data().to_vec(),
        }
    }

    /// The bytes of each row of pixels inside each tile, by their place.
    fn rows(&self, tiles: &Tiles) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (width, height) = (self.map.width() as usize, self.map.height() as usize);
        let edge = |tile: usize, most: usize, scale: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "held below the size of the picture"
            )]
            let pixel = libm::floor(tile as f64 * SIDE * scale).min(most as f64) as usize;
            pixel
        };
        let scale = self.scale;
        let tiles: Vec<_> = tiles.iter().collect();
        tiles.into_iter().flat_map(move |(column, row)| {
            let (left, right) = (edge(column, width, scale), edge(column + 1, width, scale));
            let lines = edge(row, height, scale)..edge(row + 1, height, scale);
            lines.map(move |y| (y * width + left) * 4..(y * width + right) * 4)
        })
    }

    fn clear(&mut self, tiles: &Tiles, scene: &Scene) {
        let [r, g, b] = scene.background.rgb().unwrap_or([255; 3]);
        for row in self.rows(tiles) {
            for pixel in self.map.data_mut()[row].chunks_exact_mut(4) {
                pixel.copy_from_slice(&[r, g, b, 255]);
            }
        }
    }

    fn copy(&mut self, tiles: &Tiles, from: &Self) {
        for row in self.rows(tiles) {
            self.map.data_mut()[row.clone()].copy_from_slice(&from.map.data()[row]);
        }
    }
}
