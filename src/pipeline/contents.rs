//! A digest of the messages of a bag, by which copies and conversions of it are recognized.

use crate::bag::ConnectionId;
use crate::base::time::Stamp;

/// The number of messages, and a sum over their topics and times, in which their order does not matter. The same in
/// every version and on every machine, since tables contain it.
#[derive(Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Contents {
    messages: u64,
    sum: u64,
    /// A number for the topic of each connection.
    topics: Vec<u64>,
}

impl Contents {
    /// The next connection, with this topic.
    pub(super) fn connection(&mut self, topic: &str) {
        let add = |sum: u64, byte: u8| mixed(sum ^ u64::from(byte));
        self.topics.push(topic.bytes().fold(0, add));
    }

    /// Adds messages with these times.
    pub(super) fn add(&mut self, connection: ConnectionId, stamps: &[Stamp]) {
        for stamp in stamps {
            self.add_many(connection, *stamp, 1);
        }
    }

    /// Adds messages with the same time.
    pub(super) fn add_many(&mut self, connection: ConnectionId, at: Stamp, count: u64) {
        let topic = self.topics.get(connection.0 as usize);
        let one = mixed(topic.copied().unwrap_or_default() ^ at.0.cast_unsigned());
        self.sum = self.sum.wrapping_add(one.wrapping_mul(count));
        self.messages = self.messages.wrapping_add(count);
    }

    /// The digest; `None` without messages.
    pub(super) fn digest(&self) -> Option<String> {
        let digest = mixed(self.sum ^ mixed(self.messages));
        (self.messages > 0).then(|| format!("{digest:016x}"))
    }
}

/// A number of which each bit depends on every bit of `number` (`SplitMix64`).
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(messages: &[(u32, i64)]) -> Option<String> {
        let mut contents = Contents::default();
        contents.connection("/a");
        contents.connection("/b");
        for (connection, at) in messages {
            contents.add(ConnectionId(*connection), &[Stamp(*at)]);
        }
        contents.digest()
    }

    #[test]
    fn the_digest_depends_on_topics_and_times_alone() {
        let all = digest(&[(0, 1), (1, 2), (0, 3)]);
        assert_eq!(all.as_deref(), Some("bcc9e913ad19d226"));
        assert_eq!(digest(&[(0, 3), (0, 1), (1, 2)]), all);
        for other in [
            &[(0, 1), (1, 2)][..],
            &[(0, 1), (0, 2), (0, 3)],
            &[(0, 1), (1, 2), (0, 4)],
            &[(0, 1), (1, 2), (0, 3), (0, 3)],
        ] {
            assert_ne!(digest(other), all, "{other:?}");
        }
        assert_eq!(digest(&[]), None);
    }
}
