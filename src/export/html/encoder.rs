//! The encoder of the page.

use crate::draw::picture::Union;
use crate::draw::style::{BUILTIN, Style};
use crate::export::html::{HtmlPage, PageGraph};
use crate::export::sequence::{Sequence, UnionDrawings};
use crate::export::target::Target;
use crate::export::{Started, one_text};
use crate::view::View;

/// Begins the page.
///
/// # Errors
/// As [`one_text`].
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let graphs = graphs(sequence);
    let style = Style::builtin(BUILTIN[0].0)?;
    one_text(target, move || page(sequence, graphs, &style))
}

/// A graph of the page: its view, and the drawing of that view.
type DrawnGraph<'a> = (&'a View, UnionDrawings<'a>);

/// The graph with all elements separately, and the picture's if it groups elements; none for a timeline of topics.
fn graphs<'a>(sequence: &'a Sequence<'a>) -> [Option<DrawnGraph<'a>>; 2] {
    let opened = sequence
        .unfolded
        .and_then(|opened| Some((opened.view, opened.picture?.graph()?)));
    let is_folded = opened.is_some() && sequence.view.is_folded();
    let picture = (is_folded || opened.is_none()).then(|| sequence.picture.graph());
    let picture = picture.flatten().map(|drawings| (sequence.view, drawings));
    match opened {
        Some(_) => [opened, picture],
        None => [picture, None],
    }
}

fn page(
    sequence: &Sequence<'_>,
    [whole, folded]: [Option<DrawnGraph<'_>>; 2],
    style: &Style,
) -> String {
    let overview = sequence.picture.overview();
    // A chosen style is always used; the default one has a dark variant.
    let chosen = whole.as_ref().map_or(style, |(_, drawn)| drawn.style);
    let dark = Style::builtin("dark").ok().filter(|_| chosen == style);
    let timeline = overview.as_ref().map_or("", |o| &o.title);
    let title = sequence.picture.title().unwrap_or(timeline);
    let graph = |(view, drawn): (_, UnionDrawings<'_>)| PageGraph::new(view, drawn.union);
    // The timeline of topics has a row for each, even if a graph would group them.
    let each = sequence.unfolded.map_or(sequence.view, |u| u.view);
    let page = HtmlPage {
        sequence,
        whole: whole.map_or_else(|| PageGraph::new(each, Union::default()), graph),
        folded: folded.map(graph),
        style: chosen,
        dark: dark.as_ref(),
        title,
        overview: overview.as_ref(),
    };
    page.write()
}
