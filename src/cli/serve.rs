//! A local HTTP server: serves one page, and an event whenever there is a newer one. It accepts requests for these two
//! only, and writes no files.

use std::io::{Read as _, Write as _};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::base::error::{Error, Result};

/// The longest request that is read, in bytes: browsers send less than a kilobyte.
const MOST_REQUEST: usize = 8 << 10;
/// The most connections at a time: a page keeps one open.
const MOST_OPEN: usize = 32;
/// The time for a request, and for writing a part of an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// The keep-alive interval of event streams, so that closed connections are detected.
const ALIVE: Duration = Duration::from_secs(15);

const WAITING: &str = "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"1\"><title>bagreel</title>\
    <p>Waiting for the first message.";

/// The newest page and its number.
type Newest = (Mutex<(u64, Arc<[u8]>)>, Condvar);

/// A server that runs until the process ends.
pub(super) struct Server {
    newest: Arc<Newest>,
    /// The address, with the chosen port if any port was allowed.
    pub(super) address: SocketAddr,
}

impl Server {
    /// Serves at an address.
    ///
    /// # Errors
    /// If the address cannot be used.
    pub(super) fn start(at: SocketAddr) -> Result<Self> {
        let failed = |source| Error::Io {
            path: PathBuf::from(at.to_string()),
            doing: "serve at",
            source,
        };
        let listener = TcpListener::bind(at).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let newest: Arc<Newest> =
            Arc::new((Mutex::new((0, WAITING.as_bytes().into())), Condvar::new()));
        let shared = Arc::clone(&newest);
        let open = Arc::new(AtomicUsize::new(0));
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                if open.fetch_add(1, Ordering::Relaxed) >= MOST_OPEN {
                    open.fetch_sub(1, Ordering::Relaxed);
                    continue;
                }
                let (newest, open) = (Arc::clone(&shared), Arc::clone(&open));
                thread::spawn(move || {
                    // Failed connections are ignored.
                    let _ = answer(stream, &newest);
                    open.fetch_sub(1, Ordering::Relaxed);
                });
            }
        });
        Ok(Self { newest, address })
    }

    /// Shows a newer page.
    pub(super) fn show(&self, page: Vec<u8>) {
        let mut newest = self.newest.0.lock().unwrap_or_else(PoisonError::into_inner);
        *newest = (newest.0 + 1, page.into());
        self.newest.1.notify_all();
    }
}

fn answer(mut stream: TcpStream, newest: &Newest) -> std::io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut request = Vec::new();
    let mut part = [0; 1024];
    let until = Instant::now() + PATIENCE;
    while !request.windows(4).any(|end| end == b"\r\n\r\n") {
        let got = stream.read(&mut part)?;
        request.extend_from_slice(&part[..got]);
        if got == 0 || request.len() > MOST_REQUEST || Instant::now() > until {
            return refuse(&mut stream, "431 Request Header Fields Too Large");
        }
    }
    let request = String::from_utf8_lossy(&request);
    let mut lines = request.split("\r\n");
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (method, path) = (words.next(), words.next().unwrap_or_default());
    let mut hosts = lines.filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.eq_ignore_ascii_case("host").then(|| value.trim())
    });
    if !hosts.next().is_some_and(is_own) || hosts.next().is_some() {
        return refuse(&mut stream, "403 Forbidden");
    }
    match (method, path) {
        (Some("GET"), "/") => {
            let page = newest
                .0
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .1
                .clone();
            head(&mut stream, "200 OK", "text/html; charset=utf-8")?;
            stream.write_all(&page)
        }
        (Some("GET"), "/events") => events(&mut stream, newest),
        (Some("GET"), _) => refuse(&mut stream, "404 Not Found"),
        _ => refuse(&mut stream, "405 Method Not Allowed"),
    }
}

/// Whether a request's host is an IP address or `localhost`: a foreign domain that resolves to this machine could read
/// the page (DNS rebinding).
fn is_own(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    };
    let plain = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost") || plain.parse::<IpAddr>().is_ok()
}

/// Sends the number of the newest page, and that of each newer one.
fn events(stream: &mut TcpStream, newest: &Newest) -> std::io::Result<()> {
    head(stream, "200 OK", "text/event-stream")?;
    let mut sent = None;
    loop {
        let page = newest.0.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = newest
            .1
            .wait_timeout_while(page, ALIVE, |page| sent == Some(page.0));
        let number = waited.unwrap_or_else(PoisonError::into_inner).0.0;
        if sent == Some(number) {
            stream.write_all(b":\n\n")?;
        } else {
            write!(stream, "data: {number}\n\n")?;
            sent = Some(number);
        }
        stream.flush()?;
    }
}

fn head(stream: &mut TcpStream, status: &str, kind: &str) -> std::io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n\r\n"
    )
}

fn refuse(stream: &mut TcpStream, status: &str) -> std::io::Result<()> {
    head(stream, status, "text/plain")?;
    writeln!(stream, "{status}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(server: &Server, request: &str) -> String {
        let mut stream = TcpStream::connect(server.address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        // A request that is refused before it was read completely ends in a reset.
        let _ = stream.read_to_string(&mut answer);
        answer
    }

    #[test]
    fn only_local_requests_for_two_paths_are_answered() {
        let server = Server::start("127.0.0.1:0".parse().unwrap()).unwrap();
        let get = |path: &str, host: &str| {
            ask(
                &server,
                &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"),
            )
        };
        assert!(get("/", "localhost:1").contains("Waiting"));
        server.show(b"<p>one".to_vec());
        for host in ["127.0.0.1:8723", "[::1]:8723", "LOCALHOST", "192.168.0.7"] {
            assert!(get("/", host).ends_with("<p>one"), "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:8723",
            "localhost.evil.example",
            "",
        ] {
            assert!(get("/", host).starts_with("HTTP/1.1 403"), "{host}");
        }
        assert!(ask(&server, "GET / HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 403"));
        assert!(get("/etc/passwd", "localhost").starts_with("HTTP/1.1 404"));
        let post = "POST / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        assert!(ask(&server, post).starts_with("HTTP/1.1 405"));
        let long = format!("GET /{} HTTP/1.1\r\n", "x".repeat(MOST_REQUEST));
        assert!(!ask(&server, &long).contains("200 OK"));
    }

    #[test]
    fn every_new_page_sends_an_event() {
        let server = Server::start("127.0.0.1:0".parse().unwrap()).unwrap();
        let mut stream = TcpStream::connect(server.address).unwrap();
        write!(stream, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        let mut seen = String::new();
        for number in 0..3 {
            let mut part = [0; 512];
            while !seen.contains(&format!("data: {number}\n\n")) {
                let got = stream.read(&mut part).unwrap();
                seen.push_str(&String::from_utf8_lossy(&part[..got]));
            }
            server.show(Vec::new());
        }
    }
}
