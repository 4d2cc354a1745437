//! The number of headlines of each kind in a window.

use super::{Counts, Headline};
use crate::graph::Element;
use crate::mission::event_log::Kind;

impl Counts {
    /// The number of headlines of each kind.
    pub(crate) fn of<'a>(headlines: impl IntoIterator<Item = &'a Headline>) -> Self {
        let mut counts = Self::default();
        for headline in headlines {
            *counts.slot(headline.kind, headline.what) += 1;
        }
        counts
    }

    fn slot(&mut self, kind: Kind, what: Element) -> &mut usize {
        let is_topic = what.is_topic();
        match kind {
            Kind::Started => &mut self.nodes_added,
            Kind::Stopped => &mut self.nodes_removed,
            Kind::Restarted => &mut self.restarted,
            Kind::Silent => &mut self.silent,
            Kind::Appeared if is_topic => &mut self.topics_added,
            Kind::Appeared => &mut self.edges_added,
            Kind::Vanished if is_topic => &mut self.topics_removed,
            Kind::Vanished => &mut self.edges_removed,
            Kind::HandedOver => &mut self.handed_over,
            Kind::Rate => &mut self.rates,
            Kind::Lifecycle
            | Kind::Type
            | Kind::Qos
            | Kind::Starved
            | Kind::Duplicate
            | Kind::Lost => &mut self.values,
        }
    }

    /// The number of all headlines.
    pub fn total(&self) -> usize {
        self.came() + self.went() + self.changed()
    }

    /// The number of beginnings.
    pub fn came(&self) -> usize {
        self.nodes_added + self.topics_added + self.edges_added
    }

    /// The number of ends.
    pub fn went(&self) -> usize {
        self.nodes_removed + self.topics_removed + self.edges_removed
    }

    /// The number of changes other than beginnings and ends.
    pub fn changed(&self) -> usize {
        self.restarted + self.silent + self.handed_over + self.rates + self.values
    }
}

impl std::ops::Add for Counts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            nodes_added: self.nodes_added + other.nodes_added,
            nodes_removed: self.nodes_removed + other.nodes_removed,
            topics_added: self.topics_added + other.topics_added,
            topics_removed: self.topics_removed + other.topics_removed,
            edges_added: self.edges_added + other.edges_added,
            edges_removed: self.edges_removed + other.edges_removed,
            restarted: self.restarted + other.restarted,
            silent: self.silent + other.silent,
            handed_over: self.handed_over + other.handed_over,
            rates: self.rates + other.rates,
            values: self.values + other.values,
        }
    }
}
