//! A server of Foxglove's WebSocket protocol, such as `foxglove_bridge`: the graph as it reports it, and messages of
//! requested topics (<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>).

use std::collections::BTreeMap;
use std::io;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::client::{IntoClientRequest as _, client_with_config};
use tungstenite::http::HeaderValue;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

use super::{
    BEAT, LiveGraph, PUBLISHERS, Patient, SERVERS, SUBSCRIBERS, WAIT, Watched, connect, now,
};

/// The supported protocol versions.
const PROTOCOLS: HeaderValue = HeaderValue::from_static("foxglove.sdk.v1, foxglove.websocket.v1");
/// The longest message that is read, in bytes.
const MOST_MESSAGE: usize = 64 << 20;
/// The longest description of channels and of the graph, in bytes: ten times that of a thousand topics with their
/// definitions. Parsing needs at most twenty times as much memory.
const MOST_TEXT: usize = 16 << 20;
/// The interval at which the whole graph is requested: servers do not report that the last publisher of a topic left which
/// still has subscribers, and some report no changes to a second client.
const ANEW: Duration = Duration::from_secs(5);
/// The number of bytes before the payload of a message: an operation, a subscription and a time.
const HEAD: usize = 13;

/// The connection to a server.
struct Bridge<'a> {
    socket: WebSocket<Patient>,
    watched: &'a mut Watched,
    /// The channel in the file for each subscription; a subscription has the number of the server's channel.
    subscribed: BTreeMap<u64, usize>,
    /// The graph as described since it was last requested as a whole; `None` once it is in use.
    whole: Option<LiveGraph>,
    /// The time of that request; `None` before the first.
    requested: Option<Instant>,
    /// Whether a subscription was made, or made and ended, so that the server sends its first graph.
    has_asked: bool,
}

/// Connects to the server at `place` (`host:port`) and records what it sends.
pub(super) fn watch(place: &str, watched: &mut Watched) -> io::Result<()> {
    let stream = connect(place.split('/').next().unwrap_or_default())?;
    let request = format!("ws://{place}").into_client_request();
    let mut request = request.map_err(io::Error::other)?;
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", PROTOCOLS);
    let config = WebSocketConfig::default()
        .max_message_size(Some(MOST_MESSAGE))
        .max_frame_size(Some(MOST_MESSAGE));
    let opened = client_with_config(request, stream, Some(config));
    let (socket, _) = opened.map_err(|e| io::Error::other(e.to_string()))?;
    watched.graph = LiveGraph::default();
    let bridge = Bridge {
        socket,
        watched,
        subscribed: BTreeMap::new(),
        whole: None,
        requested: None,
        has_asked: false,
    };
    bridge.listen()
}

impl Bridge<'_> {
    fn listen(mut self) -> io::Result<()> {
        let begun = Instant::now();
        let mut beat = begun;
        let mut is_new = false;
        while !self.watched.is_over() {
            // Heartbeats are written between two messages, and within one that is sent slowly.
            self.socket.get_mut().wait(BEAT / 10);
            match self.socket.read() {
                Ok(Message::Text(text)) if text.len() > MOST_TEXT => {
                    return Err(io::Error::other(
                        "its description of the graph is too large",
                    ));
                }
                Ok(Message::Text(text)) => {
                    let message = serde_json::from_str(&text).map_err(io::Error::other)?;
                    self.take(&message)?;
                    self.watched.graph.check()?;
                    is_new = true;
                }
                Ok(Message::Binary(bytes)) => self.record(&bytes)?,
                Ok(Message::Close(_)) => return Err(io::ErrorKind::ConnectionReset.into()),
                Ok(_) => {}
                Err(tungstenite::Error::Io(e)) if e.kind() == io::ErrorKind::TimedOut => {}
                Err(error) => return Err(io::Error::other(error)),
            }
            is_new |= self.renew()?;
            // Several messages describe one graph, which is written after all of them. A server that has just started
            // does not know any nodes for a while.
            let is_known = !self.watched.graph.is_empty() || begun.elapsed() >= WAIT;
            if is_known && beat.elapsed() >= if is_new { BEAT / 10 } else { BEAT } {
                self.watched.beat()?;
                (beat, is_new) = (Instant::now(), false);
            }
        }
        // The server need not answer.
        let _ = self.socket.close(None);
        Ok(())
    }

    /// Adopts the whole graph after a request, and requests it again; returns whether the graph may have
    /// changed.
    fn renew(&mut self) -> io::Result<bool> {
        let Some(requested) = self.requested else {
            return Ok(false);
        };
        if requested.elapsed() >= ANEW {
            self.send(&json!({"op": "unsubscribeConnectionGraph"}))?;
            self.request()?;
        }
        // Changes already in transit may arrive before the whole graph.
        let is_whole =
            requested.elapsed() >= BEAT && self.whole.as_ref().is_some_and(|g| !g.is_empty());
        if let Some(mut whole) = self.whole.take_if(|_| is_whole) {
            whole.types = std::mem::take(&mut self.watched.graph.types);
            self.watched.graph = whole;
        }
        Ok(is_whole)
    }

    /// Requests the whole graph, and each change from then on.
    fn request(&mut self) -> io::Result<()> {
        (self.whole, self.requested) = (Some(LiveGraph::default()), Some(Instant::now()));
        self.send(&json!({"op": "subscribeConnectionGraph"}))
    }

    /// Handles a message from the server.
    fn take(&mut self, message: &Value) -> io::Result<()> {
        match text(message, "op") {
            "serverInfo" => {
                if !list(message, "capabilities").any(|c| c == "connectionGraph") {
                    return Err(io::Error::other("the server does not report its graph"));
                }
                self.request()?;
            }
            "advertise" => {
                for channel in list(message, "channels") {
                    self.advertised(channel)?;
                }
            }
            "unadvertise" => {
                for id in list(message, "channelIds").filter_map(Value::as_u64) {
                    self.subscribed.remove(&id);
                }
            }
            "connectionGraphUpdate" => {
                let graphs = self.whole.iter_mut().chain([&mut self.watched.graph]);
                graphs.for_each(|graph| change(graph, message));
            }
            _ => {}
        }
        Ok(())
    }

    /// Records the type of a channel, and subscribes to it if requested.
    fn advertised(&mut self, channel: &Value) -> io::Result<()> {
        let Some(id) = channel["id"].as_u64() else {
            return Ok(());
        };
        let (topic, kind) = (text(channel, "topic"), text(channel, "schemaName"));
        let encoding = text(channel, "encoding");
        self.watched
            .graph
            .types
            .insert(topic.to_owned(), kind.to_owned());
        let is_wanted = self.watched.topics.contains(topic);
        if is_wanted {
            let schema_encoding = match (text(channel, "schemaEncoding"), encoding) {
                ("", "cdr") => "ros2msg",
                ("", _) => "ros1msg",
                (own, _) => own,
            };
            let schema = (kind, schema_encoding, text(channel, "schema").to_owned());
            let file = &mut self.watched.file;
            let number = file.channel(topic, encoding, schema, &BTreeMap::new())?;
            self.subscribed.insert(id, number);
        }
        if is_wanted || !self.has_asked {
            let subscription = json!([{"id": id, "channelId": id}]);
            self.send(&json!({"op": "subscribe", "subscriptions": subscription}))?;
        }
        if !is_wanted && !self.has_asked {
            self.send(&json!({"op": "unsubscribe", "subscriptionIds": [id]}))?;
        }
        self.has_asked = true;
        Ok(())
    }

    /// Writes a message of a subscription to the file.
    fn record(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (Some((1, rest)), Some(payload)) = (bytes.split_first(), bytes.get(HEAD..)) else {
            return Ok(());
        };
        let subscription = rest.first_chunk().map_or(0, |id| u32::from_le_bytes(*id));
        match self.subscribed.get(&u64::from(subscription)) {
            Some(channel) => self.watched.file.write(*channel, now(), payload),
            None => Ok(()),
        }
    }

    fn send(&mut self, message: &Value) -> io::Result<()> {
        let sent = self.socket.send(Message::text(message.to_string()));
        sent.map_err(io::Error::other)
    }
}

/// Applies changes of the graph.
fn change(graph: &mut LiveGraph, message: &Value) {
    for (sides, gone) in [
        (&[PUBLISHERS, SUBSCRIBERS][..], "removedTopics"),
        (&[SERVERS], "removedServices"),
    ] {
        for name in list(message, gone).filter_map(Value::as_str) {
            for side in sides {
                graph.set(*side, name, [].into());
            }
        }
    }
    for (side, topics, nodes) in [
        (PUBLISHERS, "publishedTopics", "publisherIds"),
        (SUBSCRIBERS, "subscribedTopics", "subscriberIds"),
        (SERVERS, "advertisedServices", "providerIds"),
    ] {
        for topic in list(message, topics) {
            let nodes = list(topic, nodes).filter_map(Value::as_str);
            graph.set(
                side,
                text(topic, "name"),
                nodes.map(str::to_owned).collect(),
            );
        }
    }
}

fn list<'a>(of: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> + use<'a> {
    of[key].as_array().into_iter().flatten()
}

fn text<'a>(of: &'a Value, key: &str) -> &'a str {
    of[key].as_str().unwrap_or_default()
}
