//! A server of Foxglove's WebSocket protocol, such as `foxglove_bridge`: the graph as it reports it, and messages of
//! requested topics (<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>).

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::{Value, json};
use tungstenite::client::{IntoClientRequest as _, client_with_config};
use tungstenite::http::HeaderValue;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

use super::connection::{Patient, WAIT, connect};
use super::graph::{LiveGraph, PUBLISHERS, SERVERS, SUBSCRIBERS};
use super::{BEAT, MOST_CHANNELS, Watched, now};

/// The supported protocol versions.
const PROTOCOLS: HeaderValue = HeaderValue::from_static("foxglove.sdk.v1, foxglove.websocket.v1");
/// The longest message of a requested topic that is read, in bytes.
const MOST_MESSAGE: usize = 64 << 20;
/// The longest description of channels and of the graph, in bytes: five times that of a thousand topics with their
/// definitions. Parsing needs at most twenty times as much memory.
const MOST_TEXT: usize = 8 << 20;
/// The bytes of descriptions after which the size of the graph is checked; it is checked with each heartbeat anyway.
const MOST_UNCHECKED: usize = 1 << 20;
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
    let host = place.split('/').next().unwrap_or_default();
    let stream = connect(host, &watched.is_over)?;
    let request = format!("ws://{place}").into_client_request();
    let mut request = request.map_err(io::Error::other)?;
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", PROTOCOLS);
    let most = if watched.topics.is_empty() {
        MOST_TEXT
    } else {
        MOST_MESSAGE
    };
    let config = WebSocketConfig::default()
        .max_message_size(Some(most))
        .max_frame_size(Some(most));
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
        let (mut is_new, mut unchecked) = (false, 0);
        while !self.watched.is_over() {
            // Heartbeats are written between two messages, and within one that is sent slowly.
            self.socket.get_mut().wait(BEAT / 10);
            match self.socket.read() {
                Ok(Message::Text(text)) if text.len() > MOST_TEXT => return Err(too_large()),
                Err(tungstenite::Error::Capacity(_)) => return Err(too_large()),
                Ok(Message::Text(text)) => {
                    self.take(&text)?;
                    is_new = true;
                    unchecked += text.len();
                    if unchecked > MOST_UNCHECKED {
                        self.watched.graph.check()?;
                        unchecked = 0;
                    }
                }
                Ok(Message::Binary(bytes)) => self.record(&bytes)?,
                Ok(Message::Close(_)) => return Err(io::ErrorKind::ConnectionReset.into()),
                Ok(_) => {}
                Err(tungstenite::Error::Io(e)) if e.kind() == io::ErrorKind::TimedOut => {}
                Err(_) if self.watched.is_over() => {}
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
    fn take(&mut self, message: &str) -> io::Result<()> {
        match &*parsed::<Operation<'_>>(message)?.op {
            "serverInfo" => {
                let info: ServerInfo = parsed(message)?;
                if !info.capabilities.iter().any(|c| c == "connectionGraph") {
                    return Err(io::Error::other("the server does not report its graph"));
                }
                self.request()?;
            }
            "advertise" => {
                for channel in parsed::<Advertise>(message)?.channels {
                    self.advertised(channel)?;
                }
            }
            "unadvertise" => {
                for id in parsed::<Unadvertise>(message)?.channel_ids {
                    self.subscribed.remove(&id);
                }
            }
            "connectionGraphUpdate" => {
                let update: Update = parsed(message)?;
                let graphs = self.whole.iter_mut().chain([&mut self.watched.graph]);
                graphs.for_each(|graph| update.apply(graph));
            }
            _ => {}
        }
        Ok(())
    }

    /// Records the type of a channel, and subscribes to it if requested.
    fn advertised(&mut self, channel: Channel) -> io::Result<()> {
        let (id, topic, kind) = (channel.id, channel.topic, channel.schema_name);
        let types = &mut self.watched.graph.types;
        types.insert(topic.clone(), kind.clone());
        let mut is_wanted =
            self.watched.topics.contains(&topic) && self.subscribed.len() < MOST_CHANNELS;
        if is_wanted {
            let own = channel.schema_encoding.filter(|own| !own.is_empty());
            let schema_encoding = own.unwrap_or_else(|| match &*channel.encoding {
                "cdr" => "ros2msg".to_owned(),
                _ => "ros1msg".to_owned(),
            });
            let schema = channel.schema.unwrap_or_default();
            let parts = [topic, channel.encoding, kind, schema_encoding, schema];
            let number = self.watched.channel(parts)?;
            is_wanted = number.is_some();
            self.subscribed.extend(number.map(|number| (id, number)));
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

/// An error about a message beyond [`MOST_TEXT`].
fn too_large() -> io::Error {
    io::Error::other("its description of the graph is too large")
}

/// The kind of a message from the server; those of other kinds are skipped.
#[derive(Deserialize)]
struct Operation<'a> {
    #[serde(borrow, default)]
    op: Cow<'a, str>,
}

#[derive(Deserialize)]
struct ServerInfo {
    capabilities: Vec<String>,
}

#[derive(Deserialize)]
struct Advertise {
    channels: Vec<Channel>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Channel {
    id: u64,
    topic: String,
    #[serde(default)]
    encoding: String,
    #[serde(default)]
    schema_name: String,
    schema: Option<String>,
    schema_encoding: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Unadvertise {
    channel_ids: Vec<u64>,
}

/// Changes of the graph.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Update {
    published_topics: Vec<Ends>,
    subscribed_topics: Vec<Ends>,
    advertised_services: Vec<Ends>,
    removed_topics: Vec<String>,
    removed_services: Vec<String>,
}

/// The nodes of a topic or service.
#[derive(Deserialize)]
struct Ends {
    name: String,
    #[serde(alias = "publisherIds", alias = "subscriberIds", alias = "providerIds")]
    nodes: BTreeSet<String>,
}

impl Update {
    fn apply(&self, graph: &mut LiveGraph) {
        for name in &self.removed_topics {
            graph.set(PUBLISHERS, name, [].into());
            graph.set(SUBSCRIBERS, name, [].into());
        }
        for name in &self.removed_services {
            graph.set(SERVERS, name, [].into());
        }
        for (side, all) in [
            (PUBLISHERS, &self.published_topics),
            (SUBSCRIBERS, &self.subscribed_topics),
            (SERVERS, &self.advertised_services),
        ] {
            for ends in all {
                graph.set(side, &ends.name, ends.nodes.clone());
            }
        }
    }
}

fn parsed<'a, T: Deserialize<'a>>(text: &'a str) -> io::Result<T> {
    serde_json::from_str(text).map_err(io::Error::other)
}
