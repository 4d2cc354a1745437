//! The limits on work done for untrusted input, all in one place: every limit with its unit and its reason. Input past
//! a limit is counted, reported and left out; what was read before it is kept.

/// The most windows if no period is given: each is a frame of a second, and ten minutes is the longest useful video.
pub(crate) const CHOSEN_WINDOWS: i64 = 600;

/// The most windows that can be requested: a day in windows of a second. Each costs about a kilobyte per element.
pub(crate) const WINDOWS: i64 = 100_000;

/// The longest mission, in days: a hundred years, so that sums of three such lengths in nanoseconds do not overflow.
pub(crate) const SPAN_DAYS: i64 = 36_525;

/// The longest style, topology or phases file, in bytes: a hundred times the largest known.
pub(crate) const USER_TEXT: u64 = 16 << 20;

/// The longest topology, in bytes: twenty times the largest graph known from `rqt_graph`. Parsing needs at most
/// eighty times as much memory.
pub(crate) const TOPOLOGY: u64 = 4 << 20;

/// The most nodes and edges in a table; no mission contains more.
pub(crate) const TOPOLOGY_ENTRIES: usize = 1 << 17;

/// The most work for one launch file, in bytes of memory and of text processed: two hundred
/// times the largest launch system seen (all of Autoware's), and a second or two of work.
pub(crate) const LAUNCH_WORK: usize = 64 << 20;

/// The longest font file, in bytes: CJK collections have 20 MB.
pub(crate) const FONT: u64 = 64 << 20;

/// The longest mission in JSON, in bytes: one of 100,000 windows has 2 GB.
pub(crate) const MISSION_JSON: u64 = 4 << 30;

/// The longest job summary file, in bytes, to which a report is appended: GitHub takes 1 MiB.
pub(crate) const SUMMARY: u64 = 16 << 20;

/// The most names, types and states of a mission: five times the topics of the largest robot known. With all their
/// data, including the windows of `info`, they take about 256 MB.
pub(crate) const NAMES: usize = 1 << 16;

/// The longest name, type or state of a mission, in bytes: ROS allows 255 for a name, and the quality of service of a
/// hundred publishers is text too.
pub(crate) const NAME: usize = 1 << 16;

/// The most bytes of all names, types and states of a mission together.
pub(crate) const NAMES_BYTES: usize = 32 << 20;

/// The most observations about those names, each by one source: eight for each name.
pub(crate) const OBSERVATIONS: usize = 1 << 19;

/// The most lines of evidence listed for a query: more than anyone reads.
pub(crate) const EVIDENCE_LINES: usize = 1 << 16;
/// The most characters of a line of evidence, see [`EVIDENCE_LINES`].
pub(crate) const EVIDENCE_LINE: usize = 500;

/// The most bytes that may be decompressed from any bag: seconds of work.
pub(crate) const UNPACKED: u64 = 4 << 30;

/// The highest compression ratio accepted; real bags compress ten to one.
pub(crate) const UNPACKED_FOLD: u64 = 1000;

/// The largest copy of a compressed bag in the temporary folder, in bytes, if [`UNPACKED_FOLD`] allows less.
pub(crate) const UNPACKED_COPY: u64 = 1 << 30;

/// The most connections, or topics, that a bag may describe: real bags stay below 1,000.
pub(crate) const CONNECTIONS: usize = 100_000;

/// The most bytes of message definitions kept per bag.
pub(crate) const DEFINITIONS: usize = 8 << 20;

/// The most files of one recording: one file a minute for a week.
pub(crate) const FILES: usize = 10_000;

/// The longest document in YAML that is parsed, in bytes: `metadata.yaml` of a thousand topics has 1 MB.
pub(crate) const YAML: usize = 8 << 20;

/// The most values of a YAML document, keys and mappings among them: 20,000 topics with all their fields. Each takes
/// about a hundred bytes while it is read.
pub(crate) const YAML_VALUES: usize = 250_000;

/// The most distinct notices; further ones only increase the count of a final one.
pub(crate) const NOTICES: usize = 200;

/// The remaining work for a launch file, which bounds recursive includes and texts that repeat each other.
#[derive(Debug)]
pub(crate) struct LaunchWork {
    left: usize,
    /// Whether the allowance was exceeded.
    pub(crate) is_spent: bool,
}

impl LaunchWork {
    /// The whole allowance, for a file and what it includes.
    pub(crate) fn all() -> Self {
        Self::of_text(LAUNCH_WORK)
    }

    /// The allowance for a single text of this many bytes: loops over long lists need a tenth of it.
    pub(crate) fn of_text(bytes: usize) -> Self {
        Self {
            left: LAUNCH_WORK.min((1 << 20) + bytes.saturating_mul(500)),
            is_spent: false,
        }
    }

    /// Takes `work` from the allowance; `None` if less is left.
    pub(crate) fn spend(&mut self, work: usize) -> Option<()> {
        let left = self.left.checked_sub(work);
        self.is_spent |= left.is_none();
        self.left = left.filter(|_| !self.is_spent)?;
        Some(())
    }
}

/// The most statistics messages kept (30 MB): an hour of a hundred connections with one a second each. The rest is only
/// counted.
pub(crate) const MEASUREMENTS: usize = 360_000;
