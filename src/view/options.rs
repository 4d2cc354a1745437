//! The options of a view, in `rqt_graph`'s words, and its filters of names with exactly its rules.

use std::sync::Arc;

use regex::Regex;

use crate::base::error::{Error, Result};
use crate::base::time::Span;
use crate::base::words::worded;

worded! {
    /// The kinds of boxes and arrows in the picture, as in the first box of `rqt_graph`'s window.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Mode {
        /// Nodes only: in pictures one line between two of them with the topics in both directions, in pages and graph
        /// files an arrow from publisher to subscriber for every topic.
        Nodes = "nodes",
        /// Nodes and topics.
        #[default]
        All = "all",
    }
}

impl Mode {
    /// Whether arrows run from node to node, over topics that are not drawn.
    pub(crate) fn is_direct(self) -> bool {
        self == Self::Nodes
    }
}

/// The elements to leave out. The default is `quiet` alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "one check box each, as in rqt_graph's window"
)]
pub struct Hide {
    /// Housekeeping topics, the recorder and the player: our default.
    pub quiet: bool,
    /// The nodes and topics that `rqt_graph` calls debug: viewers, monitors, `/rosout`, `/clock`, `/statistics`, names
    /// that begin with `_`.
    pub debug: bool,
    /// Topics without a subscriber.
    pub dead: bool,
    /// Topics with fewer than two connections.
    pub leaf: bool,
    /// `/tf` and `/tf_static`.
    pub tf: bool,
    /// Topics that carry parameters.
    pub params: bool,
    /// Services.
    pub services: bool,
    /// Nodes without any sign of activity in the window.
    pub unreachable: bool,
}

impl Hide {
    /// The choice that omits nothing.
    pub const NONE: Self = Self {
        quiet: false,
        debug: false,
        dead: false,
        leaf: false,
        tf: false,
        params: false,
        services: false,
        unreachable: false,
    };

    /// The elements to leave out by a list such as `debug,dead`, which replaces the default; `none` and the
    /// empty list hide nothing.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown word.
    pub fn parse(list: &str) -> Result<Self> {
        let mut hide = Self::NONE;
        for word in words(list) {
            match word {
                "none" => hide = Self::NONE,
                "quiet" => hide.quiet = true,
                "debug" => hide.debug = true,
                "dead" => hide.dead = true,
                "leaf" => hide.leaf = true,
                "tf" => hide.tf = true,
                "params" => hide.params = true,
                "services" => hide.services = true,
                "unreachable" => hide.unreachable = true,
                _ => {
                    let all = "quiet, debug, dead, leaf, tf, params, services, unreachable, none";
                    return Err(unknown("thing to hide", word, all));
                }
            }
        }
        Ok(hide)
    }
}

impl Default for Hide {
    fn default() -> Self {
        Self {
            quiet: true,
            ..Self::NONE
        }
    }
}

/// The elements to draw as one box. The default is all groups, with a box around every namespace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grouping {
    /// The topics of an action, and the event topics of services, as one box each.
    pub actions: bool,
    /// `/tf` and `/tf_static` as one box.
    pub tf: bool,
    /// An image with its compressed transports as one box.
    pub images: bool,
    /// The number of levels of namespaces that get a box around their members; `None` for all of them, 0 for none.
    pub namespaces: Option<usize>,
}

impl Grouping {
    /// The choice that draws every node and topic separately.
    pub const NONE: Self = Self {
        actions: false,
        tf: false,
        images: false,
        namespaces: Some(0),
    };

    /// The elements to draw as one box by a list such as `actions,tf,namespaces=2`, which replaces the
    /// default. A list without `namespaces` leaves them boxed on all levels, unless it is `none`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown word or a depth that is not a number.
    pub fn parse(list: &str) -> Result<Self> {
        let mut group = Self {
            namespaces: None,
            ..Self::NONE
        };
        for word in words(list) {
            match word.split_once('=').unwrap_or((word, "")) {
                ("none", "") => group = Self::NONE,
                ("actions", "") => group.actions = true,
                ("tf", "") => group.tf = true,
                ("images", "") => group.images = true,
                ("namespaces", "") => group.namespaces = None,
                ("namespaces", depth) => {
                    let what = format!("`{depth}` is not a number of namespace levels");
                    let bad = |_| Error::usage(what, "write a whole number: `namespaces=2`");
                    group.namespaces = Some(depth.parse().map_err(bad)?);
                }
                _ => {
                    let all = "actions, tf, images, namespaces, namespaces=N, none";
                    return Err(unknown("thing to group", word, all));
                }
            }
        }
        Ok(group)
    }
}

impl Default for Grouping {
    fn default() -> Self {
        Self {
            actions: true,
            tf: true,
            images: true,
            namespaces: None,
        }
    }
}

/// The part of the graph that the picture shows.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "independent choices")]
#[non_exhaustive]
pub struct ViewOptions {
    /// The kinds of boxes and arrows.
    pub mode: Mode,
    /// The filter for nodes, by their full names.
    pub ns_filter: NameFilter,
    /// The filter for topics.
    pub topic_filter: NameFilter,
    /// The elements to leave out.
    pub hide: Hide,
    /// The elements to draw as one box.
    pub group: Grouping,
    /// Namespaces to draw as one box each: `/robot1/nav`.
    pub collapse: Vec<Arc<str>>,
    /// Namespaces to keep open, even inside a collapsed one.
    pub expand: Vec<Arc<str>>,
    /// Whether the output is only for viewing: topics with one known endpoint, and those that half the system
    /// is connected to, are rows in boxes, and topics without a known endpoint are listed as words.
    pub(crate) is_picture: bool,
    /// Whether one line between two nodes or collapsed namespaces stands for all topics in both directions, instead of an
    /// arrow for each; only with [`Mode::Nodes`].
    pub(crate) is_bundled: bool,
    /// Whether all windows are drawn as one, in which nothing changes; `None` for a mission with a single window.
    pub(crate) is_still: Option<bool>,
    /// The phases in which nodes of one namespace must be alike to share a box; none if each has its own.
    pub(crate) alike_in: Vec<Span>,
    /// Whether charts in Markdown have a box per topic however many lines they have.
    pub(crate) keeps_topics: bool,
    /// Whether bundles count the topics that a single node sends beside its name, unless there is an event about them.
    pub(crate) counts_rows: bool,
    /// Whether bundles list nodes without a line as words although they change or send, if their topics are counted.
    pub(crate) are_unlinked_in_words: bool,
    /// Whether bundles also list nodes that never change as words if they have a single line.
    pub(crate) are_leaves_in_words: bool,
    /// Whether anonymous nodes are drawn under their full names, with a box for each run.
    pub exact_names: bool,
}

impl ViewOptions {
    /// Whether they choose elements, rather than only how these are drawn.
    pub(crate) fn is_filter(&self) -> bool {
        let plain = Self::default();
        let is_named = !self.ns_filter.passes_all() || !self.topic_filter.passes_all();
        is_named || self.mode != plain.mode || self.hide != plain.hide
    }

    /// The settings of `rqt_graph`'s window when it opens. Its "Unreachable" is left out: a bag cannot add which node
    /// would not have answered.
    pub fn rqt_defaults() -> Self {
        Self {
            mode: Mode::Nodes,
            hide: Hide {
                debug: true,
                dead: true,
                leaf: true,
                params: true,
                ..Hide::NONE
            },
            group: Grouping {
                namespaces: Some(2),
                ..Grouping::default()
            },
            exact_names: true,
            ..Self::default()
        }
    }
}

fn words(list: &str) -> impl Iterator<Item = &str> {
    list.split(',')
        .map(str::trim)
        .filter(|word| !word.is_empty())
}

fn unknown(what: &str, word: &str, all: &str) -> Error {
    let what = format!("`{word}` is not a {what}");
    Error::usage(what, format!("one of: {all}"))
}

/// A list of names and patterns, some of them exclusions. The default accepts every name.
///
/// The rules are those of `matches_any` and `_split_filter_string` in `rqt_graph/dotcode.py`: tokens are split at
/// commas and stripped; one that begins with `-` excludes; a lone `/` or nothing includes everything. A token matches
/// a name that it equals, and, if it contains a character outside `[A-Za-z0-9_/]`, as a pattern at the name's beginning.
#[derive(Clone, Debug, Default)]
pub struct NameFilter {
    includes: Vec<FilterToken>,
    excludes: Vec<FilterToken>,
}

#[derive(Clone, Debug)]
struct FilterToken {
    text: String,
    pattern: Option<Regex>,
}

impl NameFilter {
    /// The filter of this text.
    ///
    /// # Errors
    /// [`Error::Usage`] for a pattern that is not a regular expression, or one that needs features that only Python has.
    pub fn parse(text: &str) -> Result<Self> {
        let tokens: Vec<&str> = text.split(',').map(str::trim).collect();
        let excludes = tokens.iter().filter_map(|t| t.strip_prefix('-'));
        let excludes = excludes.map(FilterToken::new).collect::<Result<_>>()?;
        let mut includes: Vec<&str> = tokens;
        includes.retain(|t| !t.starts_with('-'));
        if matches!(includes[..], ["/" | ""]) {
            includes.clear();
        }
        let includes = includes.into_iter().map(FilterToken::new);
        let includes = includes.collect::<Result<_>>()?;
        Ok(Self { includes, excludes })
    }

    /// Whether a name passes: an inclusion matches it, or none is given, and no exclusion matches it.
    pub fn passes(&self, name: &str) -> bool {
        let name = name.trim();
        let included = self.includes.is_empty() || self.includes.iter().any(|t| t.matches(name));
        included && !self.excludes.iter().any(|t| t.matches(name))
    }

    /// The inclusions as they were written: names and patterns.
    pub(crate) fn wanted(&self) -> Vec<&str> {
        self.includes.iter().map(|t| t.text.as_str()).collect()
    }

    /// The inclusions and, with their `-`, the exclusions that match none of these names, as they were written.
    pub(crate) fn unused(&self, names: &[&str]) -> Vec<String> {
        let is_used = |token: &&FilterToken| names.iter().any(|name| token.matches(name.trim()));
        let includes = self.includes.iter().filter(|token| !is_used(token));
        let includes = includes.map(|token| token.text.clone());
        let excludes = self.excludes.iter().filter(|token| !is_used(token));
        includes
            .chain(excludes.map(|token| format!("-{}", token.text)))
            .collect()
    }

    /// Whether every name passes.
    pub fn passes_all(&self) -> bool {
        self.includes.is_empty() && self.excludes.is_empty()
    }
}

impl FilterToken {
    fn new(text: &str) -> Result<Self> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
        let is_pattern = text.is_empty() || !text.chars().all(plain);
        Ok(Self {
            text: text.to_owned(),
            pattern: is_pattern.then(|| anchored(text)).transpose()?,
        })
    }

    fn matches(&self, name: &str) -> bool {
        self.text == name || self.pattern.as_ref().is_some_and(|p| p.is_match(name))
    }
}

/// The pattern as in Python's `re.match`: anchored at the start of the text, free to end anywhere.
fn anchored(pattern: &str) -> Result<Regex> {
    // Compiled alone first, so that a stray `)` cannot close our group.
    let compiled = Regex::new(pattern).and_then(|_| Regex::new(&format!(r"\A(?:{pattern})")));
    compiled.map_err(|error| {
        let text = error.to_string();
        let reason = text.lines().last().unwrap_or_default();
        let reason = reason.trim().trim_start_matches("error: ");
        let what = format!("`{pattern}` is not a pattern for names: {reason}");
        let hint = "patterns are regular expressions: `/robot1/.*`, `-/rqt.*`";
        Error::usage(what, hint)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_replaces_the_default() {
        let hide = Hide::parse("dead, leaf").unwrap();
        assert!(hide.dead && hide.leaf && !hide.quiet && !hide.debug);
        assert_eq!(Hide::parse("none").unwrap(), Hide::NONE);
        let group = Grouping::parse("tf,namespaces=3").unwrap();
        assert_eq!((group.tf, group.actions), (true, false));
        assert_eq!(group.namespaces, Some(3));
        assert_eq!(Grouping::parse("tf").unwrap().namespaces, None);
        assert_eq!(Grouping::parse("none").unwrap(), Grouping::NONE);
    }

    #[test]
    fn unknown_words_are_reported() {
        for error in [
            Hide::parse("dead,dad").unwrap_err(),
            Grouping::parse("action").unwrap_err(),
            Grouping::parse("namespaces=two").unwrap_err(),
        ] {
            assert!(error.is_usage() && !error.hint().is_empty());
        }
    }

    /// The names that pass, as one text.
    fn passing(filter: &str, names: &[&str]) -> String {
        let filter = NameFilter::parse(filter).unwrap();
        let kept: Vec<&str> = names.iter().copied().filter(|n| filter.passes(n)).collect();
        kept.join(" ")
    }

    const NAMES: &[&str] = &["/tf", "/tf_static", "/rqt_gui", "/r1/tf"];

    #[test]
    fn plain_names_match_only_themselves() {
        assert_eq!(passing("/tf", NAMES), "/tf");
        assert_eq!(passing(" /tf , /r1/tf", NAMES), "/tf /r1/tf");
    }

    #[test]
    fn patterns_are_anchored_at_the_start_only() {
        assert_eq!(passing("/tf.*", NAMES), "/tf /tf_static");
        assert_eq!(passing("/t.", NAMES), "/tf /tf_static");
        assert_eq!(passing("tf.*", NAMES), "");
        assert_eq!(passing("/x|/r1", NAMES), "/r1/tf");
    }

    #[test]
    fn a_dash_excludes_and_alone_includes_the_rest() {
        assert_eq!(passing("-/rqt.*", NAMES), "/tf /tf_static /r1/tf");
        assert_eq!(passing("/.*,-/tf", NAMES), "/tf_static /rqt_gui /r1/tf");
        assert_eq!(passing("/,-/tf", NAMES), "/tf_static /rqt_gui /r1/tf");
    }

    #[test]
    fn an_empty_filter_or_a_lone_slash_matches_everything() {
        for all in ["", "/", "  "] {
            assert_eq!(passing(all, NAMES), NAMES.join(" "));
        }
        assert_eq!(passing("/,/tf", NAMES), "/tf");
        // An empty token is an empty pattern, which matches everything, as in Python.
        assert_eq!(passing("/tf,", NAMES), NAMES.join(" "));
        assert_eq!(passing("-", NAMES), "");
    }

    #[test]
    fn an_invalid_pattern_is_a_usage_error() {
        for bad in ["/a(", "-[", "a)(b", "(?=/tf)"] {
            assert!(NameFilter::parse(bad).unwrap_err().is_usage(), "{bad}");
        }
    }
}
