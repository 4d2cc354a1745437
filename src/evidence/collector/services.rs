//! The services of a mission, as far as service introspection was recorded.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Recorded;
use crate::evidence::claim::{Claim, Name};

/// A service whose calls were recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// The name.
    pub name: Arc<str>,
    /// Requests: the larger number of those sent by clients and those received by servers.
    pub requests: u64,
    /// Replies: the larger number of those sent and those received.
    pub replies: u64,
    /// The number of clients that called it.
    pub clients: usize,
}

impl Recorded {
    /// Every service with recorded calls, sorted by name.
    pub fn services(&self) -> Vec<Service> {
        let mut calls: BTreeMap<Name, [u64; 4]> = BTreeMap::new();
        let mut clients: BTreeMap<Name, usize> = BTreeMap::new();
        for fact in &self.facts.list {
            match fact.claim {
                Claim::Client(topic, _) => *clients.entry(topic).or_default() += 1,
                Claim::Called(topic, event) => {
                    let event = self.facts.text(event);
                    let words = [
                        "request sent",
                        "request received",
                        "reply sent",
                        "reply received",
                    ];
                    if let Some(at) = words.iter().position(|word| **word == *event) {
                        calls.entry(topic).or_default()[at] += self.facts.times.count(fact.times);
                    }
                }
                _ => {}
            }
        }
        let service = |(topic, [asked, heard, answered, told]): (Name, [u64; 4])| {
            let topic_name = self.facts.text(topic);
            let name = topic_name
                .strip_suffix("/_service_event")
                .unwrap_or(&topic_name);
            Service {
                name: name.into(),
                requests: asked.max(heard),
                replies: answered.max(told),
                clients: clients.get(&topic).copied().unwrap_or(0),
            }
        };
        let mut all: Vec<_> = calls.into_iter().map(service).collect();
        all.sort_by(|a, b| a.name.cmp(&b.name));
        all
    }
}
