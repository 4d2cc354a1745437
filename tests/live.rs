//! Tests of live systems: scripted local servers for the ROS 1 master API and Foxglove's protocol.

use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Follows a system until it has been silent for two seconds.
fn follow(folder: &Path, more: &[&str]) -> Output {
    follow_for("2s", folder, more)
}

fn follow_for(idle: &str, folder: &Path, more: &[&str]) -> Output {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.current_dir(folder).arg("follow").args(more);
    run.args(["--idle", idle, "-o", "f.json"]).output().unwrap()
}

/// The final output: names of nodes, and the ends of edges, of all windows.
fn graph(folder: &Path) -> (BTreeSet<String>, BTreeSet<String>) {
    let text = std::fs::read_to_string(folder.join("f.json")).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let text = |value: &Value, key: &str| value[key].as_str().unwrap().to_owned();
    let (mut nodes, mut edges) = (BTreeSet::new(), BTreeSet::new());
    for window in json["windows"].as_array().unwrap() {
        let list = |key: &str| window[key].as_array().unwrap().iter();
        nodes.extend(list("nodes").map(|node| text(node, "name")));
        for (key, arrow) in [("publishes", "→"), ("subscribes", "←")] {
            let edge = |e: &Value| format!("{} {arrow} {}", text(e, "node"), text(e, "topic"));
            edges.extend(list(key).map(edge));
        }
    }
    (nodes, edges)
}

/// An array of XML-RPC.
fn array(of: &[String]) -> String {
    format!("<value><array><data>{}</data></array></value>", of.concat())
}

fn string(text: &str) -> String {
    format!("<value><string>{text}</string></value>")
}

/// An entry of the master's state: a topic, or a service, with one node.
fn entry(name: &str, node: &str) -> String {
    array(&[string(name), array(&[string(node)])])
}

/// Answers like `rosmaster`: these publish, and `/listener` subscribes to `/chat`.
fn answer(stream: &mut TcpStream, publishers: &[String]) {
    let mut asked = [0; 4096];
    let mut got = 0;
    while !String::from_utf8_lossy(&asked[..got]).contains("</methodCall>") {
        got += stream.read(&mut asked[got..]).unwrap();
    }
    let asked = String::from_utf8_lossy(&asked[..got]).into_owned();
    let what = if asked.contains("getSystemState") {
        let subscribers = array(&[entry("/chat", "/listener")]);
        let services = array(&[entry("/listener/get_loggers", "/listener")]);
        array(&[array(publishers), subscribers, services])
    } else {
        assert!(asked.contains("getTopicTypes"), "{asked}");
        array(&[array(&[string("/chat"), string("std_msgs/String")])])
    };
    let all = array(&["<value><int>1</int></value>".to_owned(), string("ok"), what]);
    let body = format!(
        "<?xml version='1.0'?>\n<methodResponse>\n<params>\n<param>\n{all}\n</param>\n</params>\n</methodResponse>"
    );
    let length = body.len();
    write!(
        stream,
        "HTTP/1.0 200 OK\r\nContent-length: {length}\r\n\r\n{body}"
    )
    .unwrap();
}

#[test]
fn a_ros_1_master_is_watched() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("ros1://{}", listener.local_addr().unwrap());
    spawn(move || {
        let begun = Instant::now();
        for stream in listener.incoming() {
            let passed = begun.elapsed();
            if passed > Duration::from_secs(5) {
                break;
            }
            let talker = (passed < Duration::from_millis(2500)).then(|| entry("/chat", "/talker"));
            answer(&mut stream.unwrap(), talker.as_slice());
        }
    });
    let folder = TempDir::new().unwrap();
    let done = follow(folder.path(), &[&address]);
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(said.contains("no connection to ros1://127.0.0.1"), "{said}");
    let printed = String::from_utf8_lossy(&done.stdout);
    assert!(printed.contains("/talker stopped"), "{printed}");
    assert!(!printed.contains("nothing was recorded"), "{printed}");
    let (nodes, edges) = graph(folder.path());
    assert!(nodes.iter().eq(["/listener", "/talker"]), "{nodes:?}");
    assert!(edges.contains("/talker → /chat"), "{edges:?}");
    assert!(edges.contains("/listener ← /chat"), "{edges:?}");
}

#[test]
fn a_crowd_that_starts_at_once_is_not_listed_whole() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("ros1://{}", listener.local_addr().unwrap());
    spawn(move || {
        let named = |at| entry(&format!("/topic{at}"), &format!("/node{at}"));
        let all: Vec<_> = (0..1100).map(named).collect();
        // Two calls each second: empty at first, since what is there from the start did not start.
        for (round, stream) in listener.incoming().enumerate().take(14) {
            answer(&mut stream.unwrap(), if round < 6 { &[] } else { &all });
        }
    });
    let folder = TempDir::new().unwrap();
    let done = follow_for("2500ms", folder.path(), &[&address]);
    let [printed, said] = [done.stdout, done.stderr].map(|text| String::from_utf8(text).unwrap());
    // A slow machine needs several updates, each with at most a thousand lines.
    let cut = said.matches("more events").count();
    assert!(cut > 0, "{said}");
    assert!(printed.lines().count() <= 1000 * (cut + 1), "{printed}");
    assert!(graph(folder.path()).0.len() > 1100, "all are written");
}

/// The first line about the connection to an address.
fn complaint(address: &str) -> String {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.args(["follow", address]).stderr(Stdio::piped());
    let mut follower = run.spawn().unwrap();
    let mut line = String::new();
    let mut lines = BufReader::new(follower.stderr.take().unwrap());
    lines.read_line(&mut line).unwrap();
    follower.kill().unwrap();
    follower.wait().unwrap();
    line
}

/// Answers every call with the same bytes, one byte at a time if it `drips`.
fn answering(answer: String, drips: bool) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("ros1://{}", listener.local_addr().unwrap());
    spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let _ = stream.read(&mut [0; 4096]);
            let parts = answer
                .as_bytes()
                .chunks(if drips { 1 } else { answer.len() });
            for part in parts {
                if stream.write_all(part).is_err() {
                    break;
                }
                sleep(Duration::from_millis(20));
            }
        }
    });
    address
}

#[test]
fn a_server_that_is_not_a_master_is_reported() {
    let ok = "HTTP/1.0 200 OK\r\n\r\n";
    let attributes: Vec<String> = (0..200_000).map(|at| format!(" a{at}=''")).collect();
    let none = "is not that of a ROS master";
    let answers = [
        (format!("{ok}{}", "<value/>".repeat(4 << 20)), "too large"),
        (
            format!("{ok}<a>{}</a>", "<a/>".repeat(1 << 20)),
            "nodes limit",
        ),
        (format!("{ok}<a{}/>", attributes.concat()), none),
        (
            format!("{ok}<{}:a/>", "p".repeat(4_000_000)),
            "ppp…; trying",
        ),
        ("HTTP/1.1 404 Not Found\r\n\r\n".to_owned(), none),
    ];
    for (answer, why) in answers {
        let said = complaint(&answering(answer, false));
        assert!(said.contains("no connection to ros1://"), "{said}");
        assert!(said.contains(why) && said.len() < 500, "{said}");
    }
    let said = complaint(&answering(format!("{ok}{}", " ".repeat(10_000)), true));
    assert!(said.contains("it did not respond in time"), "{said}");
}

#[test]
fn rates_are_refused_without_messages() {
    let folder = TempDir::new().unwrap();
    let done = follow(folder.path(), &["ros1://localhost:1", "--rates", "/scan"]);
    assert_eq!(done.status.code(), Some(2));
}

#[test]
fn what_is_not_an_address_is_refused() {
    let folder = TempDir::new().unwrap();
    for address in [
        "ros1://",
        "ros1://robot",
        "ros1://:11311",
        "ros1://robot:99999",
        #[cfg(feature = "live")]
        "ws://robot",
        #[cfg(feature = "live")]
        "ws://[::1]",
    ] {
        let done = follow(folder.path(), &[address]);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{address}: {said}");
        assert!(said.contains("ros1://localhost:11311"), "{said}");
    }
}

#[cfg(feature = "live")]
mod bridge {
    use std::net::{TcpListener, TcpStream};
    use std::thread::{sleep, spawn};
    use std::time::Duration;

    use serde_json::{Value, json};
    use tempfile::TempDir;
    use tungstenite::handshake::server::{Request, Response};
    use tungstenite::{Message, WebSocket, accept_hdr};

    use super::{complaint, follow, follow_for, graph};

    /// Sends a message to the client.
    fn send(to: &mut WebSocket<TcpStream>, message: &Value) {
        to.send(Message::text(message.to_string())).unwrap();
    }

    /// Receives the client's next message.
    fn receive(from: &mut WebSocket<TcpStream>) -> Value {
        serde_json::from_str(from.read().unwrap().to_text().unwrap()).unwrap()
    }

    fn update(publisher: &[&str]) -> Value {
        json!({
            "op": "connectionGraphUpdate",
            "publishedTopics": [{"name": "/scan", "publisherIds": publisher}],
            "subscribedTopics": [{"name": "/scan", "subscriberIds": ["/slam"]}],
            "advertisedServices": [], "removedTopics": [], "removedServices": [],
        })
    }

    /// Opens the protocol with a client.
    fn open(stream: TcpStream) -> WebSocket<TcpStream> {
        #[expect(clippy::result_large_err, reason = "the type is the library's")]
        let protocol = |_: &Request, mut response: Response| {
            let own = "foxglove.websocket.v1".parse().unwrap();
            response.headers_mut().insert("Sec-WebSocket-Protocol", own);
            Ok(response)
        };
        let mut client = accept_hdr(stream, protocol).unwrap();
        send(
            &mut client,
            &json!({"op": "serverInfo", "name": "robot", "capabilities": ["connectionGraph"]}),
        );
        client
    }

    /// Advertises a channel; returns the client's subscription to it.
    fn begin(client: &mut WebSocket<TcpStream>) -> u64 {
        assert_eq!(receive(client)["op"], "subscribeConnectionGraph");
        send(
            client,
            &json!({"op": "advertise", "channels": [{
                "id": 7, "topic": "/scan", "encoding": "cdr", "schemaName": "std_msgs/msg/Empty", "schema": "",
            }]}),
        );
        let asked = receive(client);
        assert_eq!(asked["subscriptions"][0]["channelId"], 7, "{asked}");
        asked["subscriptions"][0]["id"].as_u64().unwrap()
    }

    /// Sends messages for three seconds.
    fn scans(client: &mut WebSocket<TcpStream>, subscription: u64) {
        for time in 0..60_u64 {
            let mut message = vec![1];
            message.extend(&subscription.to_le_bytes()[..4]);
            message.extend((time * 50_000_000).to_le_bytes());
            message.extend([0, 1, 0, 0, 0]);
            client.send(Message::binary(message)).unwrap();
            sleep(Duration::from_millis(50));
        }
    }

    /// Like `foxglove_bridge`: sends the graph when a subscription follows the one to the graph.
    fn serve(stream: TcpStream) {
        let mut client = open(stream);
        let subscription = begin(&mut client);
        send(&mut client, &update(&["/lidar"]));
        scans(&mut client, subscription);
        send(&mut client, &update(&[]));
        sleep(Duration::from_millis(1500));
    }

    #[test]
    fn unreachable_elements_do_not_stop_and_unreported_stops_are_found() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}", listener.local_addr().unwrap());
        let server = spawn(move || {
            for is_last in [false, true] {
                let mut client = open(listener.accept().unwrap().0);
                let subscription = begin(&mut client);
                send(&mut client, &update(&["/lidar"]));
                scans(&mut client, subscription);
                if !is_last {
                    let _ = client.close(None);
                    sleep(Duration::from_millis(4500));
                    continue;
                }
                // The lidar left, which servers do not report, since its topic still has a subscriber.
                assert_eq!(receive(&mut client)["op"], "unsubscribeConnectionGraph");
                assert_eq!(receive(&mut client)["op"], "subscribeConnectionGraph");
                let mut whole = update(&[]);
                whole["publishedTopics"] = json!([]);
                send(&mut client, &whole);
                sleep(Duration::from_secs(3));
            }
        });
        let folder = TempDir::new().unwrap();
        let more = [&*address, "--rates", "/scan"];
        let done = follow_for("9s", folder.path(), &more);
        server.join().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{said}");
        let log = std::process::Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(folder.path())
            .args(["events", "f.json"])
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&log.stdout);
        assert!(log.contains("nothing was recorded for"), "{log}");
        assert!(!log.contains("silent for"), "{log}");
        assert_eq!(log.matches("/lidar stopped").count(), 1, "{log}");
    }

    #[test]
    fn hostile_bridges_are_disconnected() {
        let channel = |at| json!({"id": at, "topic": format!("/topic{at}"), "schemaName": "a/B"});
        let channels =
            json!({"op": "advertise", "channels": (0..400_000).map(channel).collect::<Vec<_>>()});
        let topic = |at| json!({"name": format!("/t{at}"), "publisherIds": ["/node"]});
        let many = json!({"op": "connectionGraphUpdate", "publishedTopics": (0..70_000).map(topic).collect::<Vec<_>>()});
        let texts = [
            (r#"{"op": "connectionGr"#.to_owned(), "EOF while parsing"),
            (
                channels.to_string(),
                "description of the graph is too large",
            ),
            (many.to_string(), "more than 65536 names"),
        ];
        for (text, why) in texts {
            let listener = TcpListener::bind("127.0.0.1:0").unwrap();
            let address = format!("ws://{}", listener.local_addr().unwrap());
            spawn(move || {
                for stream in listener.incoming() {
                    let mut client = open(stream.unwrap());
                    let _ = client.send(Message::text(&*text));
                    // The client ends the connection.
                    while client.read().is_ok() {}
                }
            });
            let said = complaint(&address);
            assert!(said.contains(why), "{said}");
        }
    }

    #[test]
    fn a_bridge_yields_its_graph_and_the_requested_rates() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}", listener.local_addr().unwrap());
        let server = spawn(move || serve(listener.accept().unwrap().0));
        let folder = TempDir::new().unwrap();
        let done = follow(folder.path(), &[&address, "--rates", "/scan"]);
        server.join().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{said}");
        let (nodes, edges) = graph(folder.path());
        assert!(nodes.iter().eq(["/lidar", "/slam"]), "{nodes:?}");
        assert!(edges.contains("/lidar → /scan"), "{edges:?}");
        let log = std::process::Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(folder.path())
            .args(["info", "f.json", "--format", "json"])
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&log.stdout);
        assert!(log.contains("\"received\": 60"), "{log}");
        let printed = String::from_utf8_lossy(&done.stdout);
        assert!(!printed.contains("nothing was recorded"), "{printed}");
    }
}
