//! Log texts of roscpp about its connections: start and end of subscribers (DEBUG), clients with another
//! type, its own subscriptions; and the recorder's `Subscribing to`, which gives the time at which a topic
//! appeared.

use super::SourceContext;
use crate::evidence::message::log::LogRecord;
use crate::evidence::observation::Observation;

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let (name, text, file) = (record.name, record.text, record.file);
    if file.ends_with("recorder.cpp")
        && let Some(topic) = text.strip_prefix("Subscribing to ")
    {
        let topic = context.name(topic.trim());
        context.states(Observation::Appears(topic), || format!("{name}: {text}"));
    }
    let roscpp = file.rsplit('.').next() == Some("cpp");
    if let Some(link) = link(text).filter(|_| roscpp) {
        let node = context.name(link.node.unwrap_or(name));
        let topic = context.name(link.topic);
        let words = || format!("{name} logs: {text}");
        let observation = match link.how {
            How::Begins => Observation::Joins(node, topic),
            How::Lasts => Observation::Subscribe(node, topic),
            How::Refused => Observation::Refused(node, topic),
            How::Ends => {
                // It existed until now.
                context.states(Observation::Node(node), words);
                Observation::Unsubscribe(node, topic)
            }
        };
        context.states(observation, words);
    }
}

/// A subscription in a log text.
#[derive(Debug, PartialEq, Eq)]
struct LoggedSubscription<'a> {
    /// The subscriber; `None` for the logging node.
    node: Option<&'a str>,
    topic: &'a str,
    how: How,
}

/// The change of a subscription.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum How {
    Begins,
    Lasts,
    Refused,
    Ends,
}

/// The subscription in a log text of roscpp.
fn link(text: &str) -> Option<LoggedSubscription<'_>> {
    let between = |from: &str, to: &str| Some(text.split_once(from)?.1.split_once(to)?.0);
    let caller = || between("callerid=[", "]");
    let own = |topic| LoggedSubscription {
        node: None,
        topic,
        how: How::Lasts,
    };
    let clients = |node, topic, how| LoggedSubscription {
        node: Some(node),
        topic,
        how,
    };
    if text.starts_with("Connection: Creating TransportSubscriberLink for topic [") {
        let topic = between("for topic [", "]")?;
        return Some(clients(caller()?, topic, How::Begins));
    }
    if text.starts_with("Connection to subscriber [callerid=[") && text.contains("dropped") {
        let topic = between("to topic [", "]")?;
        return Some(clients(caller()?, topic, How::Ends));
    }
    if text.starts_with("Client [") && text.contains("to have datatype/md5sum") {
        let topic = between("] wants topic ", " to have datatype")?;
        return Some(clients(between("Client [", "]")?, topic, How::Refused));
    }
    if text.starts_with("Connection to publisher [") && text.contains("dropped") {
        return Some(own(between("to topic [", "]")?));
    }
    if text.starts_with("Retrying connection to [") {
        return Some(own(between("for topic [", "]")?));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subscriber_comes_and_goes() {
        let text = "Connection: Creating TransportSubscriberLink for topic [/scan] connected to \
                    [callerid=[/slam] address=[TCPROS connection on port 1 to [127.0.0.1:2 on socket 3]]]";
        let slam = |how| {
            Some(LoggedSubscription {
                node: Some("/slam"),
                topic: "/scan",
                how,
            })
        };
        assert_eq!(link(text), slam(How::Begins));
        let text =
            "Connection to subscriber [callerid=[/slam] address=[…]] to topic [/scan] dropped";
        assert_eq!(link(text), slam(How::Ends));
    }

    #[test]
    fn a_client_of_another_type_wants_to_subscribe() {
        let text = "Client [/bad] wants topic /scan to have datatype/md5sum [a/b], but our version has [c/d].";
        assert_eq!(
            link(text),
            Some(LoggedSubscription {
                node: Some("/bad"),
                topic: "/scan",
                how: How::Refused
            })
        );
    }

    #[test]
    fn a_lost_publisher_reveals_the_loggers_subscription() {
        let text = "Retrying connection to [127.0.0.1:4] for topic [/scan]";
        assert_eq!(
            link(text),
            Some(LoggedSubscription {
                node: None,
                topic: "/scan",
                how: How::Lasts
            })
        );
        assert_eq!(link("Retrying connection to [127.0.0.1:4]"), None);
        assert_eq!(link("hello"), None);
    }
}
