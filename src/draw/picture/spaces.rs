//! The frames of namespaces: their titles, the robots that they represent, and the time of their first content.

use super::replicas;
use crate::draw::text::Fonts;
use crate::view::View;

/// A namespace with a box around its members.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Space {
    /// Its full name.
    pub(crate) name: String,
    /// Its title: the part inside the namespace around it.
    pub(crate) title: String,
    /// The indices of the equal namespaces drawn as this one; empty for a single one.
    pub(crate) replicas: Vec<String>,
    /// Their number over time, if it changes: fractions of the time from 0 to 1, each with the share of them
    /// that exists from then on.
    pub(crate) course: Vec<(f64, f64)>,
}

/// The titles of the namespaces: the part of their names inside the namespace around them.
pub(crate) fn spaces(view: &View, fonts: &Fonts) -> Vec<Space> {
    let title = |at: usize| {
        let name = &*view.namespaces[at].name;
        let around = view.namespaces[at]
            .parent
            .and_then(|p| view.namespaces.get(p));
        around.map_or(name, |p| name.strip_prefix(&*p.name).unwrap_or(name))
    };
    let mut fleets = 0..;
    (0..view.namespaces.len())
        .map(|at| Space {
            course: Some(at)
                .filter(|&at| !view.namespaces[at].replicas.is_empty())
                .and_then(|_| fleets.next())
                .map_or_else(Vec::new, |nth| replicas::shares(view, nth)),
            name: view.namespaces[at].name.to_string(),
            title: match view.namespaces[at].replicas.len() {
                0 => fonts.shown(title(at)).into_owned(),
                n => format!("{} × {n}", fonts.shown(title(at))),
            },
            replicas: view.namespaces[at]
                .replicas
                .iter()
                .map(ToString::to_string)
                .collect(),
        })
        .collect()
}

/// The first window in which each namespace has content.
pub(crate) fn first_seen(view: &View) -> Vec<usize> {
    let mut first = vec![usize::MAX; view.namespaces.len()];
    for (item, looks) in view.items_shown.with_ids() {
        let seen = looks.runs().find(|(_, shown)| shown.is_some());
        let seen = seen.map_or(usize::MAX, |(window, _)| window as usize);
        for at in view.around(item) {
            first[at] = first[at].min(seen);
        }
    }
    first
}
