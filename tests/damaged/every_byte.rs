//! Tests with bags of a few kilobytes in which every bit is flipped and which are cut at every byte: reading terminates,
//! invents nothing, and reports every lost message.

use std::fs;
use std::ops::Range;

use bagreel::bag::{OpenOptions, Want};
use bagreel::internals::base::notice::NoticeKind;

use super::{placed, read_bytes};
use crate::support::rosbag1::Pack;
use crate::support::tiny::{self, MESSAGES};
use crate::support::{read, read_as, rosbag1};

/// The padding after the head of a ROS 1 bag.
pub(super) const PADDING: Range<usize> = 100..4100;

/// The positions of meaningful bytes in a bag.
fn bytes_of(name: &str, bytes: &[u8]) -> impl Iterator<Item = usize> {
    let is_bag = !name.contains("mcap");
    (0..bytes.len()).filter(move |at| !(is_bag && PADDING.contains(at)))
}

/// Reads the bag with each of these bits of every byte flipped.
fn flip(name: &str, bytes: &[u8], bits: impl Fn(usize) -> Range<usize>) {
    change(name, bytes, |bytes, at| {
        let flipped = bits(at).map(|bit| {
            let mut bytes = bytes.to_vec();
            bytes[at] ^= 1 << bit;
            bytes
        });
        flipped.collect()
    });
}

/// Reads the bag with each of these changes at every byte: never more messages than before, and fewer only with a notice.
fn change(name: &str, bytes: &[u8], changes: impl Fn(&[u8], usize) -> Vec<Vec<u8>>) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    let mut faults = Vec::new();
    for at in bytes_of(name, bytes) {
        for (nth, bytes) in changes(bytes, at).into_iter().enumerate() {
            fs::write(&path, &bytes).unwrap();
            let Ok((report, kept)) = read(&path, Want::Payload) else {
                // The head of a database and its list of tables have no second copy.
                assert!(name == "rows.db3", "{name}: change {nth} of byte {at}");
                continue;
            };
            let found = kept.stamps.len();
            // Private records are not damage, but reported too.
            let is_said =
                !report.complete || kept.notices.iter().any(|n| n.kind == NoticeKind::Note);
            if found != MESSAGES && !is_said {
                let notices = kept.notices;
                faults.push(format!(
                    "change {nth} of byte {at}: {found} and no word, {notices:?}"
                ));
            }
        }
    }
    assert!(
        faults.is_empty(),
        "{name}: {}\n{}",
        faults.len(),
        faults.join("\n")
    );
}

#[test]
fn a_flipped_bit_in_any_byte_loses_no_message_silently() {
    for (name, bytes) in tiny::bags() {
        flip(name, &bytes, |at| at % 8..at % 8 + 1);
    }
}

#[test]
fn zeros_from_any_byte_on_lose_no_message_silently() {
    for (name, bytes) in tiny::bags() {
        change(name, &bytes, |bytes, at| {
            let mut bytes = bytes.to_vec();
            let end = bytes.len().min(at + [8, 64, 512][at % 3]);
            bytes[at..end].fill(0);
            vec![bytes]
        });
    }
}

#[test]
#[ignore = "minutes; by hand after changes to a reader"]
fn no_flipped_bit_loses_a_message_silently() {
    for (name, bytes) in tiny::bags() {
        flip(name, &bytes, |_| 0..8);
    }
}

#[test]
fn a_bag_cut_at_any_byte_has_the_messages_before_it() {
    for (name, bytes) in tiny::bags() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        let whole = read_bytes(name, &bytes).1.payloads();
        assert_eq!(whole.len(), MESSAGES, "{name}");
        let is_paged = name == "rows.db3";
        let mut before = 0;
        for end in bytes_of(name, &bytes).skip(1) {
            fs::write(&path, &bytes[..end]).unwrap();
            let Ok((report, kept)) = read(&path, Want::Payload) else {
                // The tables of a database may be listed behind their rows.
                let is_early = end < 16 && before == 0;
                assert!(is_early || is_paged, "{name}: cut at {end}");
                continue;
            };
            let kept = kept.payloads();
            assert!(
                kept.len() >= before || is_paged,
                "{name}: cut at {end}: {} after {before}",
                kept.len()
            );
            assert!(
                kept.iter().all(|m| whole.contains(m)),
                "{name}: cut at {end}"
            );
            let is_said = !report.complete || name.starts_with("front") && name.contains(".bag");
            assert!(kept.len() == MESSAGES || is_said, "{name}: cut at {end}");
            before = kept.len();
        }
    }
}

#[test]
fn a_flipped_bit_seen_only_by_the_data_checksum_is_reported() {
    let mut bags = tiny::bags().into_iter();
    let (name, bytes) = bags
        .find(|(name, _)| *name == "front_unchunked.mcap")
        .unwrap();
    // After the first eight bytes, and before the end of the data, the end of the file and the closing bytes.
    let (start, end) = (8, bytes.len() - 13 - 29 - 8);
    assert_eq!(bytes[end..end + 9], [15, 4, 0, 0, 0, 0, 0, 0, 0]);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    let is_complete = |bytes: &[u8], want| {
        fs::write(&path, bytes).unwrap();
        read(&path, want).unwrap().0.complete
    };
    assert!(is_complete(&bytes, Want::Stamps));
    for at in start..end {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        assert!(!is_complete(&damaged, Want::Stamps), "byte {at}");
    }
    // The last byte before the end belongs to a payload, where damage is only detected by a checksum.
    let mut unsummed = bytes.clone();
    unsummed[end - 1] ^= 1;
    unsummed[end + 9..end + 13].fill(0);
    assert!(is_complete(&unsummed, Want::Payload));
}

/// The positions of this field's values in a ROS 1 bag.
fn values(bytes: &[u8], field: &[u8]) -> Vec<usize> {
    let starts = bytes.windows(field.len()).enumerate();
    let starts = starts.filter(|(_, window)| *window == field);
    starts.map(|(at, _)| at + field.len()).collect()
}

#[test]
fn chunk_infos_with_too_few_connections_lose_no_message() {
    let bytes = rosbag1::write(&super::short(), Pack::None, 4000);
    let truth = super::short().messages.len();
    let infos = values(&bytes, b"op=\x06");
    assert!(infos.len() > 3, "{}", infos.len());
    for info in infos {
        let count = values(&bytes[info..], b"count=")[0] + info;
        let stated = bytes[count];
        for fewer in 0..stated {
            let mut lying = bytes.clone();
            lying[count] = fewer;
            let (_, kept) = read_bytes("x.bag", &lying);
            assert_eq!(kept.stamps.len(), truth, "{fewer} of {stated} at {info}");
            assert!(!kept.notices.is_empty());
            // The same wrong count, consistent with the record's length and content.
            let len = count + 4 + 4;
            let pairs = len + 8 * usize::from(fewer)..len + 8 * usize::from(stated);
            let later = values(&bytes, b"index_pos=")[0];
            assert!(later < info, "the head comes first");
            lying[count + 4] = 8 * fewer;
            lying.drain(pairs.start..pairs.end);
            let (report, kept) = read_bytes("x.bag", &lying);
            assert_eq!(kept.stamps.len(), truth, "{fewer} of {stated} at {info}");
            assert!(!report.complete, "{fewer} of {stated} at {info}");
        }
    }
}

#[test]
fn foreign_records_in_a_chunk_are_reported_by_both_readers() {
    let recording = super::short();
    let truth = recording.messages.len();
    let mut bytes = rosbag1::unindexed(&rosbag1::write(&recording, Pack::None, 4000));
    // The index of a chunk is trusted; here there is none.
    let mut lost = 0;
    for at in values(&bytes, b"op=\x02").into_iter().step_by(2) {
        bytes[at - 1] = 10;
        lost += 1;
    }
    for at in values(&bytes, b"op=\x04") {
        bytes[at - 1] = 10;
    }
    for verify in [false, true] {
        let options = OpenOptions { verify };
        let (_dir, path) = placed("x.bag", &bytes);
        let (report, kept) = read_as(&path, Want::Stamps, None, &options).unwrap();
        assert_eq!(kept.stamps.len(), truth - lost, "{:?}", kept.notices);
        assert!(!report.complete, "{:?}", kept.notices);
    }
}
