//! The messages that make up a type, from its definition in the bag and from known types.

use std::sync::Arc;

use super::text::{self, Form, MessageFields};
use crate::bag::Connection;

/// The package of `Header`.
const HEADERS: &str = "std_msgs";

/// The messages of a type, the outermost first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Definition {
    pub(super) messages: Vec<Arc<MessageFields>>,
    /// The number of messages from the bag's text, which come first: in some old bags it names nested ones without their
    /// packages.
    loose: usize,
}

impl Definition {
    /// The definition in the bag.
    ///
    /// # Errors
    /// The reason why it cannot be used.
    pub(super) fn parse(connection: &Connection) -> Result<Self, String> {
        if is_blank(connection) {
            return Err(
                "the bag contains no definition of its type; `--msg-path` adds it".to_owned(),
            );
        }
        let text = connection.definition.as_deref().unwrap_or_default();
        let mut messages = text::messages(text, &connection.type_name, Form::of(connection))?;
        for reason in messages.iter_mut().filter_map(|one| one.wrong.as_mut()) {
            reason.push_str("; `--msg-path` replaces it");
        }
        Ok(Self {
            loose: messages.len(),
            messages: messages.into_iter().map(Arc::new).collect(),
        })
    }

    /// The definition of a message without fields, if that is what the bag may mean by an empty one.
    pub(super) fn empty(connection: &Connection) -> Option<Self> {
        let is_defined = connection.definition.is_some();
        (is_defined && is_blank(connection)).then(|| Self {
            messages: vec![Arc::new(MessageFields::new(&connection.type_name))],
            loose: 0,
        })
    }

    /// The definition of a type that is among `known` ones.
    pub(super) fn known(known: &[Arc<MessageFields>], type_name: &str) -> Option<Self> {
        let name = MessageFields::new(type_name);
        let own = known.iter().find(|m| m.is_called(&name))?;
        Some(Self {
            messages: std::iter::once(own).chain(known).cloned().collect(),
            loose: 0,
        })
    }

    /// This definition with `known` types for what it lacks.
    pub(super) fn completed(&self, known: &[Arc<MessageFields>]) -> Self {
        Self {
            messages: [&self.messages, known].concat(),
            loose: self.loose,
        }
    }

    /// This definition with `known` types in place of its nested ones.
    pub(super) fn corrected(&self, known: &[Arc<MessageFields>]) -> Self {
        let (own, nested) = self.messages.split_at(1);
        Self {
            messages: [own, known, nested].concat(),
            loose: 0,
        }
    }

    /// The index of the message that `kind` refers to in the message with index `from`: in the named package, in the
    /// same package, in any.
    ///
    /// # Errors
    /// If the definition does not contain it.
    pub(super) fn find(&self, from: usize, kind: &str, is_cdr: bool) -> Result<usize, String> {
        let mut wanted = MessageFields::new(kind);
        let is_header = kind == "Header";
        if wanted.package.is_empty() {
            // `Header` alone refers to that of `std_msgs`, in ROS 1 always.
            wanted.package = if is_header && !is_cdr {
                HEADERS.to_owned()
            } else {
                self.messages[from].package.clone()
            };
        }
        let found = self.first(|_, m| m.is_called(&wanted));
        let found = found.or_else(|| {
            let in_package = |m: &MessageFields| is_header && m.package == HEADERS;
            self.first(|at, m| m.name == wanted.name && (in_package(m) || at < self.loose))
        });
        found.ok_or_else(|| format!("its definition lacks the type `{kind}`; `--msg-path` adds it"))
    }

    /// The index of the first nested message that fits, if possible of one that can be used.
    fn first(&self, fits: impl Fn(usize, &MessageFields) -> bool) -> Option<usize> {
        let nested = || self.messages.iter().enumerate().skip(1);
        let mut fitting = nested().filter(|(at, m)| fits(*at, m));
        let usable = fitting.clone().find(|(_, m)| m.wrong.is_none());
        Some(usable.or_else(|| fitting.next())?.0)
    }
}

/// Whether a connection has no definition, or an empty one.
fn is_blank(connection: &Connection) -> bool {
    let text = connection.definition.as_deref().unwrap_or_default();
    let mut lines = text.lines().map(text::without_comment);
    lines.all(str::is_empty)
}
