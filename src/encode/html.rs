//! The mission as one page that plays it.

use super::{AtOnce, Encoder};
use crate::error::Result;
use crate::film::Film;
use crate::output::Target;
use crate::page::Page;
use crate::picture::Union;
use crate::style::{BUILTIN, Style};

/// Begins the page.
///
/// # Errors
/// As [`AtOnce::start`].
pub(super) fn start<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    let style = Style::builtin(BUILTIN[0].0)?;
    AtOnce::start(target, move || {
        let whole = film.picture.graph();
        let nothing = Union::default();
        // Whoever chose a style gets it always; the default one has a dark side.
        let chosen = whole.as_ref().map_or(&style, |w| w.style);
        let dark = Style::builtin("dark").ok().filter(|_| *chosen == style);
        let page = Page {
            evolution: film.evolution,
            view: film.view,
            union: whole.as_ref().map_or(&nothing, |w| &w.union),
            style: chosen,
            dark: dark.as_ref(),
            title: whole.as_ref().map_or("", |w| w.title),
        };
        (page.write(), Vec::new())
    })
}
