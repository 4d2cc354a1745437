//! All time thresholds for detecting lifetimes, silences, rates and hand-overs, each with its reason.
//!
//! Times are in nanoseconds. Only thresholds that decide whether something happened belong here, not drawing sizes or
//! window lengths.

use super::time::SECOND;

// ---- A rhythm, and its end.

/// The fewest messages that establish a rhythm: with fewer, one late message is half of the evidence.
pub(crate) const FEWEST: u64 = 5;
/// The fewest messages for a mean rate: a count has a random error of its square root, a sixth for 40.
pub(crate) const FEWEST_OF_MEAN: u64 = 40;
/// The number of usual intervals of silence that break a rhythm; one or two messages are lost now and then.
pub(crate) const BREAK: i64 = 5;
/// The shortest silence that breaks a rhythm: at its start and end a recorder writes topics up to a second apart.
pub(crate) const BREAK_NS: i64 = 2 * SECOND;
/// The silence that breaks a rhythm with pauses, as a multiple of the longest of them.
pub(crate) const UNUSUAL: i64 = 3;
/// The most pauses of a regular sender: one that pauses more often, and for more than a fifth of the time, sends only
/// when needed.
pub(crate) const OFTEN: usize = 4;
/// The length of a silence as a multiple of the second longest pause that the same sender made before.
pub(crate) const LONGER: i64 = 2;
/// The most pauses of a recording, a silence among them, that are at least half as long: of more, the first is as usual as the last.
pub(crate) const ALIKE: usize = 3;
/// The number of intervals before a silence that show the usual one: enough to include a pause, few enough to
/// exclude an earlier rate.
pub(crate) const RECENT: usize = 20;

/// The number of messages without a gap, and the time that they take, which show a rhythm even if they are not even: a
/// person who presses keys pauses earlier.
pub(crate) const STEADY: u64 = 50;
pub(crate) const STEADY_NS: i64 = 10 * SECOND;
/// The silence before the end of the recording that shows the end of a node with a single stream: a shorter one may be
/// a late message.
pub(crate) const GONE_NS: i64 = 5 * SECOND;

/// The silence of a sender with this usual interval that is long: it ends the rhythm.
pub(crate) fn broken_after(usual: i64) -> i64 {
    usual.saturating_mul(BREAK).max(BREAK_NS)
}

// ---- The clock of the recorder.

/// The longest time by which a message is recorded out of order; 374 of 1,586 public bags have such messages,
/// milliseconds late.
pub(crate) const OUT_OF_ORDER_NS: i64 = SECOND;
/// The percentage of connections that publish again whose time goes back when a clock is set back. If a script wrote
/// one topic after the other, or by header stamps, few do.
pub(crate) const RUN_SHARE: u64 = 80;
/// The fewest messages after the step back: fewer are records out of order.
pub(crate) const RUN_FEWEST: u64 = 10;

/// The percentage of active senders that fall silent together when recording pauses, and the fewest of them: fewer may
/// have a common cause on the robot.
pub(crate) const PAUSE_SHARE: u64 = 80;
pub(crate) const PAUSE_FEWEST: u64 = 3;
/// The most messages of a recording during a pause of it, and as a share of those that were due: true pauses have 0 to
/// 5 at their edges. With more, others were recorded while these senders were silent.
pub(crate) const PAUSE_MOST: f64 = 5.0;
pub(crate) const PAUSE_MOST_SHARE: f64 = 0.01;

/// The part of a recording over which the speed of a simulation is measured, since clocks tick once a second or more often;
/// and the shortest time for which a speed lasts: with less, each hesitation of a simulator would be one.
pub(crate) const SPEED_NS: i64 = 2 * SECOND;
pub(crate) const SPEED_HOLDS_NS: i64 = 10 * SECOND;
/// The percentage of the topics with a steady rate that change it by one factor at once if the clock that is not recorded does;
/// and the fewest such topics, and named nodes that send them: a camera with its drivers has as many topics, in one or two nodes.
pub(crate) const SPEED_SHARE: usize = 80;
pub(crate) const SPEED_FEWEST: (usize, usize) = (5, 3);

// ---- Starts and restarts.

/// The number of the first log record of a process. It shows a start, unless the node is known to have been there before, since it may
/// be silent for minutes; if another one follows it, that is of another process.
pub(crate) const FIRST_RECORD: u32 = 1;
/// The largest number in the header of the first message that a recorder gets of a publisher that has just begun: it
/// connects within a second, and misses a few.
pub(crate) const BEGUN_AGAIN: u32 = 5;
/// The least number before a fall to at most [`BEGUN_AGAIN`] that needs no gap: messages of one publisher arrive at most a few places
/// out of order.
pub(crate) const BEGUN_LONG: u32 = 20;

/// The time after its first sign within which a node of ROS 2 declares its parameters; a declaration later than that is another
/// start. Of the public recordings, 73 contain parameter events, and none a node that declares them again.
pub(crate) const DECLARED_NS: i64 = 2 * SECOND;

// ---- The recorder.

/// The time in which a recorder has found the topics that exist when it starts; their messages come a period later at
/// the latest. It looks once a second, and connects within another.
pub(crate) const FOUND_NS: i64 = 2 * SECOND;
/// The longest time from a node's start to the first of its messages in the bag: a recorder looks for new
/// topics once a second, and a node takes as long to start. Measured on real missions: 0.8 to 1.3 s, at most
/// 2.4 s.
pub(crate) const DISCOVERY_NS: i64 = 2 * SECOND + SECOND / 2;
/// The time after its first sign in which a node has registered its topics.
pub(crate) const REGISTRATION_NS: i64 = SECOND;
/// The longest time from a node's start to its first message on a topic that counts as advertised at the start.
pub(crate) const ADVERTISED_NS: i64 = 5 * SECOND;
/// The longest time for which a node may still send after a shutdown request.
pub(crate) const SHUTDOWN_NS: i64 = SECOND / 2;
/// The last part of a mission, in which elements end because the robot is shut down node by node.
pub(crate) const CLOSING_NS: i64 = 5 * SECOND;

// ---- Gaps, and steps of a rate.

/// The fewest intervals that show a rate.
pub(crate) const FEWEST_INTERVALS: usize = 5;
/// The length of a gap as a multiple of the usual interval on both of its sides; one or two lost messages are not a
/// gap.
pub(crate) const GAP: i64 = 5;
/// The shortest gap: shorter pauses are scheduling jitter.
pub(crate) const GAP_NS: i64 = SECOND;
/// The ratio of medians below which rates are equal: the least useful value of `--rate-change`.
pub(crate) const SAME_RATE: f64 = 1.1;
/// The largest ratio of the quartiles of even intervals.
pub(crate) const EVEN: f64 = 1.8;
/// The largest ratio of the quartiles of sums of two even intervals, which scatter less by the square root of two.
pub(crate) const EVEN_OF_TWO: f64 = 1.5;
/// The longest tick of a coarse clock: simulators publish theirs ten times a second or more often.
pub(crate) const TICK_NS: i64 = SECOND / 10;
/// The fewest messages at a rate for it to be an event: five intervals.
pub(crate) const FEWEST_OF_RATE: u64 = 6;
/// The shortest duration of a rate that is an event.
pub(crate) const RATE_HOLDS_NS: i64 = 3 * SECOND;
/// The ratio of a steady rate to that of the stray messages before it from which on these are about none.
pub(crate) const ABOUT_NONE: f64 = 10.0;
/// The longest pause of a sender while it changes its rate.
pub(crate) const RATE_PAUSE_NS: i64 = 5 * SECOND;

// ---- Hand-overs.

/// The fewest messages of a sender that can take over a topic.
pub(crate) const FEWEST_OF_SENDER: u64 = 3;
/// The longest time for which a new sender begins before the old one stops.
pub(crate) const OVERLAP_NS: i64 = 5 * SECOND;
/// The longest time by which it begins after that; unlimited if the old one never sends again.
pub(crate) const TAKEN_NS: i64 = 60 * SECOND;
/// The shortest time before the old one returns.
pub(crate) const BACK_NS: i64 = 5 * SECOND;
/// The shortest duration of a larger share of a topic's messages.
pub(crate) const SHARE_HOLDS_NS: i64 = 5 * SECOND;

// ---- Related events.

/// The longest time between the start or end of a node and that of an edge, or the silence of a topic, that it causes.
pub(crate) const TOGETHER_NS: i64 = 5 * SECOND;
/// The longest time between headlines of one reconfiguration: a launch file starts its nodes one after the other, each
/// within this time.
pub(crate) const CLOSE_NS: i64 = 2 * SECOND;
/// The longest time between events that are one: connections that a node makes together, silences that begin together, a
/// silence that begins before its input's by the clock of the recorder.
pub(crate) const CROWD_NS: i64 = SECOND;
/// The fewest repeated appearances of an element that are combined into one event.
pub(crate) const FLAPS: usize = 3;
/// The largest ratio of two steps of rates with one cause.
pub(crate) const SAME_STEP: f64 = 1.2;
/// The time within which nodes that stop and nodes that start are a switch to another mode.
pub(crate) const SWITCH_NS: i64 = 4 * SECOND;
/// The fewest nodes that stop, and that start, in such a switch, and the fewest of both together.
pub(crate) const SWITCH: (usize, usize) = (2, 5);
