//! The error of a view that shows nothing at all, with the name that may have been meant.

use std::collections::BTreeSet;

use super::ViewOptions;
use crate::base::error::Error;
use crate::base::name::namespace;
use crate::base::nearest::nearest;
use crate::base::words;
use crate::graph::Elements;

/// The error of a view in which nothing of these elements is left.
pub(crate) fn nothing(elements: &Elements, options: &ViewOptions) -> Error {
    let nodes: Vec<&str> = elements.nodes.iter().map(|n| n.name.as_str()).collect();
    let topics: Vec<&str> = elements.topics.iter().map(|t| t.name.as_str()).collect();
    let filters = [
        ("--ns-filter", &options.ns_filter, &nodes),
        ("--topic-filter", &options.topic_filter, &topics),
    ];
    for (flag, filter, names) in filters {
        let passes = |name: &&str| filter.passes(name);
        if !filter.passes_all() && !names.iter().any(passes) {
            return Error::usage(
                format!("`{flag}` lets none of {} through", among(names.len())),
                meant(&filter.wanted(), names),
            );
        }
    }
    let all = words::count(nodes.len() + topics.len(), "name");
    Error::usage(
        format!("nothing is left to draw of {all}"),
        "`--hide none` and `--show-recorder` show what is left out; wider filters show more",
    )
}

fn among(names: usize) -> String {
    match names {
        1 => "the only name".to_owned(),
        n => format!("{n} names"),
    }
}

/// The name or namespace nearest to one that was asked for, else some that there are.
fn meant(wanted: &[&str], names: &[&str]) -> String {
    let mut known: BTreeSet<&str> = names.iter().copied().collect();
    for name in names {
        let mut space = namespace(name);
        while space.len() > 1 {
            known.insert(space);
            space = namespace(space);
        }
    }
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '/');
    let near = wanted.iter().find_map(|wanted| {
        let end = wanted.find(|c| !plain(c)).unwrap_or(wanted.len());
        let name = wanted.get(..end)?.trim_end_matches('/');
        nearest(name, known.iter().copied())
    });
    match near {
        Some(name) if names.contains(&name) => format!("the nearest name is `{name}`"),
        Some(space) => format!("the nearest namespace is `{space}`: `{space}/.*` is all of it"),
        None => format!("there are {}", words::some_of(names, 3)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{NameFilter, outline};

    fn hint(filter: &str) -> String {
        let options = ViewOptions {
            ns_filter: NameFilter::parse(filter).unwrap(),
            ..ViewOptions::default()
        };
        let mission = mission(&["/robot1/nav/planner>/robot1/plan /robot1/amcl</robot1/plan"]);
        assert!(outline(&mission, &options).items.is_empty(), "{filter}");
        nothing(&mission.elements, &options).hint()
    }

    #[test]
    fn the_nearest_name_or_namespace_is_named() {
        assert_eq!(
            hint("/robt1/.*"),
            "the nearest namespace is `/robot1`: `/robot1/.*` is all of it"
        );
        assert_eq!(hint("/robot1/aml"), "the nearest name is `/robot1/amcl`");
        assert_eq!(
            hint("/somewhere/else"),
            "there are /robot1/amcl and /robot1/nav/planner"
        );
    }
}
