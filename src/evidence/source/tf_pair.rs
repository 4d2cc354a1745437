//! A subscriber of `/tf` also subscribes to `/tf_static`, and vice versa: tf2 always subscribes to both.

use crate::evidence::inference::{Conclusions, ElementKey};
use crate::evidence::observation::{Name, SourceId};

const PAIR: [&str; 2] = ["tf", "tf_static"];

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let listened: Vec<(Name, Name)> = known.subscriptions().collect();
    for (topic, node) in listened {
        let text = known.text(topic);
        let Some((space, last)) = text.rsplit_once('/') else {
            continue;
        };
        let Some(at) = PAIR.iter().position(|name| *name == last) else {
            continue;
        };
        let twin = known.facts.known(&format!("{space}/{}", PAIR[1 - at]));
        if let Some(twin) = twin.filter(|t| known.kind(*t) == "tf2_msgs/TFMessage") {
            let basis = ElementKey::Subscribe(topic, node);
            known.infer(source, ElementKey::Subscribe(twin, node), basis, |known| {
                format!(
                    "{} subscribes to {text}, and tf2 always subscribes to both",
                    known.text(node)
                )
            });
        }
    }
}
