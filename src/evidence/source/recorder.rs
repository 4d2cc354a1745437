//! The recorder subscribes everything recorded; views hide it unless asked.

use std::collections::BTreeSet;

use super::SourceContext;
use crate::base::name::is_recorder;
use crate::evidence::claim::{Claim, Degree, Name, SourceId};
use crate::evidence::message::cursor::{self, Cursor};
use crate::evidence::proof::{Findings, Key, Proof, Validity};

/// A recorder is known by the file its log records come from, whatever it is called.
pub(crate) fn read(heard: &mut SourceContext<'_>, payload: &mut Cursor<'_>) -> cursor::Result<()> {
    payload.header()?;
    payload.u8()?;
    let name = payload.string()?;
    let text = payload.string()?;
    if payload.string()?.ends_with("/src/recorder.cpp") {
        let node = heard.name(name);
        heard.claim(Claim::Node(node), Degree::Stated, || {
            format!("{name} records: {text}")
        });
    }
    Ok(())
}

/// With one recorder among the nodes it is the one that wrote the bag; several cannot be told apart.
pub(crate) fn conclude(source: SourceId, known: &mut Findings<'_>) {
    let nodes = known.nodes().iter().copied();
    let mut recorders: BTreeSet<Name> = nodes.filter(|n| is_recorder(&known.text(*n))).collect();
    let told = known.facts.list.iter().filter(|f| f.source == source);
    recorders.extend(told.filter_map(|fact| match fact.claim {
        Claim::Node(node) => Some(node),
        _ => None,
    }));
    for recorder in &recorders {
        known.prove(Proof {
            what: Key::Node(*recorder),
            source,
            degree: Degree::Stated,
            when: Validity::Unending,
        });
    }
    if let [recorder] = recorders.into_iter().collect::<Vec<_>>()[..] {
        let topics: BTreeSet<Name> = known.streams.iter().map(|s| s.topic).collect();
        for topic in topics {
            known.prove(Proof {
                what: Key::Subscribe(topic, recorder),
                source,
                degree: Degree::Stated,
                when: Validity::Like(Key::Topic(topic)),
            });
        }
    }
}
