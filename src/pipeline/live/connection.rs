//! A connection to a server, which ends in time: however slowly the server responds, and when the recording ends.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::spawn;
use std::time::{Duration, Instant};

/// The time for connecting, for a whole answer, and for each write.
pub(super) const WAIT: Duration = Duration::from_secs(5);
/// The longest time for which the end of the recording goes unnoticed.
const SLICE: Duration = Duration::from_millis(100);

/// A connection whose reads end at a certain time.
pub(super) struct Patient {
    stream: TcpStream,
    until: Instant,
    is_over: Arc<AtomicBool>,
}

impl Patient {
    /// Sets the time for all reads from now on.
    #[cfg(feature = "live")]
    pub(super) fn wait(&mut self, most: Duration) {
        self.until = Instant::now() + most;
    }
}

impl Read for Patient {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            check(&self.is_over)?;
            let left = self.until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let late = "it did not respond in time";
                return Err(io::Error::new(ErrorKind::TimedOut, late));
            }
            self.stream.set_read_timeout(Some(left.min(SLICE)))?;
            let read = self.stream.read(into);
            if !is_blocked(&read) {
                return read;
            }
        }
    }
}

impl Write for Patient {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        let until = Instant::now() + WAIT;
        loop {
            let written = self.stream.write(from);
            if !is_blocked(&written) {
                return written;
            }
            check(&self.is_over)?;
            if Instant::now() >= until {
                return Err(io::Error::other("it did not receive in time"));
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Whether there was nothing to read, or no room to write; the kind depends on the system.
fn is_blocked(done: &io::Result<usize>) -> bool {
    let kind = done.as_ref().err().map(io::Error::kind);
    matches!(kind, Some(ErrorKind::WouldBlock | ErrorKind::TimedOut))
}

/// # Errors
/// If the recording has ended.
fn check(is_over: &AtomicBool) -> io::Result<()> {
    if is_over.load(Ordering::Relaxed) {
        return Err(ErrorKind::ConnectionAborted.into());
    }
    Ok(())
}

/// Connects to a server, which then has [`WAIT`] for its first answer.
pub(super) fn connect(place: &str, is_over: &Arc<AtomicBool>) -> io::Result<Patient> {
    // On its own thread, because resolving a name cannot be interrupted.
    let (sent, opened) = channel();
    let place = place.to_owned();
    spawn(move || sent.send(open(&place)));
    let stream = loop {
        match opened.recv_timeout(SLICE) {
            Ok(stream) => break stream?,
            Err(RecvTimeoutError::Timeout) => check(is_over)?,
            Err(error) => return Err(io::Error::other(error)),
        }
    };
    stream.set_write_timeout(Some(SLICE))?;
    Ok(Patient {
        stream,
        until: Instant::now() + WAIT,
        is_over: is_over.clone(),
    })
}

fn open(place: &str) -> io::Result<TcpStream> {
    let mut failed = io::Error::other("the host name cannot be resolved");
    for at in place.to_socket_addrs()? {
        match TcpStream::connect_timeout(&at, WAIT) {
            Ok(stream) => return Ok(stream),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_interrupts_reads_and_writes() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let place = listener.local_addr().unwrap().to_string();
        let is_over = Arc::default();
        let mut patient = connect(&place, &is_over).unwrap();
        patient.until = Instant::now() + WAIT * 1000;
        is_over.store(true, Ordering::Relaxed);
        let read = patient.read(&mut [0]).unwrap_err();
        assert_eq!(read.kind(), ErrorKind::ConnectionAborted);
        // The server reads nothing, so that its buffer fills up.
        let written = patient.write_all(&vec![0; 64 << 20]).unwrap_err();
        assert_eq!(written.kind(), ErrorKind::ConnectionAborted);
    }
}
