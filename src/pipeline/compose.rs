//! A mission as it is drawn: its view, the page and the positions of everything. Only this file calls `view` and,
//! but for DOT, `layout`.
//!
//! In come a mission and a [`Drawing`]; out comes a [`Composed`]. [`super::fit`] tries several until one is legible.

use std::collections::BTreeMap;

use super::Drawing;
use crate::base::geometry::{Rect, Size};
use crate::base::notice::Notices;
use crate::draw::picture::{Measured, PageOptions, Picture};
use crate::layout::{Layout, LayoutOptions, Plan, extend, lay_out};
use crate::mission::{Mission, Place, Places};
use crate::view::{Item, View, ViewOptions, outline, view};

/// A view with its page and its layout.
#[derive(Default)]
pub(super) struct Composed {
    /// The view; only its boxes and arrows if it is an [`Composed::outline`].
    pub(super) view: View,
    /// What of the mission it shows.
    pub(super) options: ViewOptions,
    pub(super) page: PageOptions,
    /// The positions; empty unless it is laid out.
    pub(super) layout: Layout,
    pub(super) notices: Notices,
}

impl Composed {
    /// The view of these options without positions, for a page.
    pub(super) fn new(mission: &Mission, options: ViewOptions, page: PageOptions) -> Self {
        let (view, notices) = view(mission, &options);
        Self {
            view,
            notices,
            options,
            page,
            layout: Layout::default(),
        }
    }

    /// Its boxes and arrows without windows, to try whether they fit on a page.
    pub(super) fn outline(mission: &Mission, options: ViewOptions, page: PageOptions) -> Self {
        Self {
            view: outline(mission, &options),
            options,
            page,
            ..Self::default()
        }
    }

    /// Labels and sizes on its page.
    pub(super) fn measured<'a>(&'a self, drawing: &'a Drawing) -> Measured<'a> {
        drawing.measured(&self.view, self.page.clone())
    }

    /// Its picture.
    pub(super) fn picture<'a>(&'a self, drawing: &'a Drawing) -> Picture<'a> {
        self.measured(drawing).with(self.layout.clone())
    }

    /// The positions, for the JSON.
    pub(super) fn places(&self) -> Places {
        let boxes = self.view.items.iter().zip(&self.layout.boxes);
        let boxes = boxes.map(|(item, rect)| Place {
            what: item.kind.word().to_owned(),
            name: item.name.to_string(),
            rect: *rect,
        });
        let mut boxes: Vec<Place> = boxes.collect();
        boxes.sort_by(|a, b| (&a.what, &a.name).cmp(&(&b.what, &b.name)));
        Places {
            width: self.layout.size.w,
            height: self.layout.size.h,
            orientation: self.layout.orientation.word().to_owned(),
            boxes,
        }
    }
}

impl Drawing {
    /// Labels and sizes of a view on a page.
    pub(super) fn measured<'a>(&'a self, view: &'a View, page: PageOptions) -> Measured<'a> {
        Measured::new(view, &self.style, &self.fonts, page)
    }

    /// The layout of a plan by this drawing's engine. The boxes of `view`, if it is given, keep the positions of an
    /// earlier drawing, if there is one.
    pub(super) fn laid_out(
        &self,
        plan: &Plan,
        page: &LayoutOptions,
        view: Option<&View>,
    ) -> Layout {
        match self.kept.as_ref().zip(view) {
            None => lay_out(plan, page, self.engine),
            Some((kept, view)) => extend(plan, page, self.engine, &known(view, kept)),
        }
    }

    /// The layouts of a plan on pages as wide as this one, of these shapes: height over width.
    pub(super) fn of_shapes(
        &self,
        plan: &Plan,
        page: &LayoutOptions,
        shapes: &[f64],
    ) -> Vec<Layout> {
        let wide = page.page.w;
        let of_shape = |shape: &f64| {
            let page = LayoutOptions {
                page: Size::new(wide, wide * shape),
                ..*page
            };
            self.laid_out(plan, &page, None)
        };
        shapes.iter().map(of_shape).collect()
    }
}

/// The position of each item in an earlier drawing; `None` for new ones.
fn known(view: &View, kept: &Places) -> Vec<Option<Rect>> {
    let boxes = kept.boxes.iter();
    let places = boxes.map(|b| ((b.what.as_str(), b.name.as_str()), b.rect));
    let places: BTreeMap<(&str, &str), Rect> = places.collect();
    let items = view.items.iter();
    let place = |item: &Item| places.get(&(item.kind.word(), &*item.name)).copied();
    items.map(place).collect()
}
