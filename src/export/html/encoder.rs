//! The mission as one page that plays it.

use crate::base::error::Result;
use crate::draw::picture::Union;
use crate::draw::style::{BUILTIN, Style};
use crate::export::html::{HtmlPage, PageGraph};
use crate::export::sequence::{Sequence, UnionDrawings};
use crate::export::target::Target;
use crate::export::{AtOnce, Encoder};

/// Begins the page.
///
/// # Errors
/// As [`AtOnce::start`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    let style = Style::builtin(BUILTIN[0].0)?;
    AtOnce::start(target, move || (page(sequence, &style), Vec::new()))
}

/// The page of everything one by one, and of the picture where that folds something.
fn page(sequence: &Sequence<'_>, style: &Style) -> String {
    let picture = sequence.picture.graph();
    let overview = sequence.picture.overview();
    let opened = sequence.unfolded;
    let whole = opened.and_then(|o| o.picture?.graph());
    let is_folded = whole.is_some() && sequence.view.is_folded();
    let (view, whole) = match (opened, whole) {
        (Some(opened), Some(whole)) => (opened.view, Some(whole)),
        _ => (sequence.view, picture.clone()),
    };
    // Whoever chose a style gets it always; the default one has a dark side.
    let chosen = whole.as_ref().map_or(style, |w| w.style);
    let dark = Style::builtin("dark").ok().filter(|_| chosen == style);
    let union = |whole: Option<UnionDrawings<'_>>| whole.map_or_else(Union::default, |w| w.union);
    let title = match (&picture, &overview) {
        (Some(picture), _) => picture.title,
        (None, overview) => overview.as_ref().map_or("", |o| &o.title),
    };
    let page = HtmlPage {
        sequence,
        whole: PageGraph::new(view, union(whole.clone())),
        folded: is_folded.then(|| PageGraph::new(sequence.view, union(picture.clone()))),
        style: chosen,
        dark: dark.as_ref(),
        title,
        overview: overview.as_ref(),
    };
    page.write()
}
