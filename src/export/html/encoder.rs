//! The mission as one page that plays it.

use crate::base::error::Result;
use crate::draw::picture::Union;
use crate::draw::style::{BUILTIN, Style};
use crate::export::html::HtmlPage;
use crate::export::sequence::Sequence;
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
    AtOnce::start(target, move || {
        let whole = sequence.picture.graph();
        let overview = sequence.picture.overview();
        let nothing = Union::default();
        // Whoever chose a style gets it always; the default one has a dark side.
        let chosen = whole.as_ref().map_or(&style, |w| w.style);
        let dark = Style::builtin("dark").ok().filter(|_| *chosen == style);
        let page = HtmlPage {
            mission: sequence.mission,
            view: sequence.view,
            union: whole.as_ref().map_or(&nothing, |w| &w.union),
            style: chosen,
            dark: dark.as_ref(),
            title: match (&whole, &overview) {
                (Some(whole), _) => whole.title,
                (None, overview) => overview.as_ref().map_or("", |o| &o.title),
            },
            overview: overview.as_ref(),
        };
        (page.write(), Vec::new())
    })
}
