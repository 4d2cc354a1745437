//! The limits on work done for untrusted input, all in one place: every limit with its unit and its reason. Input past
//! a limit is counted, reported and left out; what was read before it is kept.

/// The most windows that are chosen where no period is given, whatever the span: each is a frame of a second, and ten
/// minutes is the longest useful video.
pub(crate) const CHOSEN_WINDOWS: i64 = 600;

/// The most windows that may be asked for: a bag of a day by the second. Each costs about a kilobyte per element.
pub(crate) const WINDOWS: i64 = 100_000;

/// The longest mission, in days: nobody records for a hundred years, and sums of three such lengths in nanoseconds
/// still fit a number.
pub(crate) const SPAN_DAYS: i64 = 36_525;

/// The longest style, topology or file of captions, in bytes: a hundred times the largest we know.
pub(crate) const USER_TEXT: u64 = 16 << 20;

/// The longest topology, in bytes: twenty times the largest graph known from `rqt_graph`. Parsing it needs eighty times
/// as much memory at worst.
pub(crate) const TOPOLOGY: u64 = 4 << 20;

/// The most nodes and edges that a table may name; no mission holds more.
pub(crate) const TOPOLOGY_ENTRIES: usize = 1 << 17;

/// The most work that is done for one launch file, counted in bytes of memory and of text gone through: two hundred
/// times the largest launch system seen (all of Autoware's), and a second or two of work.
pub(crate) const LAUNCH_WORK: usize = 64 << 20;

#[cfg(all(feature = "cli", feature = "parquet"))]
/// The longest list of bags, in bytes: a million of them.
pub(crate) const MANIFEST: u64 = 256 << 20;

#[cfg(feature = "cli")]
/// The longest font file, in bytes: collections of Chinese, Japanese and Korean have 20 MB.
pub(crate) const FONT: u64 = 64 << 20;

/// The longest mission in JSON, in bytes: one of 100,000 windows has 2 GB.
pub(crate) const MISSION_JSON: u64 = 4 << 30;

/// The longest job summary file, in bytes, to which a report is appended: GitHub takes 1 MiB.
pub(crate) const SUMMARY: u64 = 16 << 20;

/// The most names, types and states of a mission: five times the topics of the largest robot known. With all that is
/// kept about each, in the windows of `info` too, they take about 256 MB.
pub(crate) const NAMES: usize = 1 << 16;

/// The longest name, type or state of a mission, in bytes: ROS allows 255 for a name, and the quality of service of a
/// hundred publishers is text too.
pub(crate) const NAME: usize = 1 << 16;

/// The most bytes of all names, types and states of a mission together.
pub(crate) const NAMES_BYTES: usize = 32 << 20;

/// The most claims about those names, each by one source: eight for each name.
pub(crate) const CLAIMS: usize = 1 << 19;

/// The most lines of evidence that are listed for a question: more than anybody reads.
pub(crate) const EVIDENCE_LINES: usize = 1 << 16;
/// The most characters of a line of evidence, see [`EVIDENCE_LINES`].
pub(crate) const EVIDENCE_LINE: usize = 500;

#[cfg(feature = "video")]
/// The most bytes that are kept of a child process's error output: its last ones.
pub(crate) const MESSAGES_OF_A_CHILD: usize = 1 << 16;

/// The most bytes that may be unpacked of any bag: seconds of work.
pub(crate) const UNPACKED: u64 = 4 << 30;

/// The most unpacked bytes per byte of packed data that was read for them; real bags fold their data ten times.
pub(crate) const UNPACKED_FOLD: u64 = 1000;

/// The largest copy of a packed bag in the temporary folder, in bytes, where [`UNPACKED_FOLD`] allows less.
pub(crate) const UNPACKED_COPY: u64 = 1 << 30;

/// The most connections, or topics, that a bag may describe: real bags stay below 1,000.
pub(crate) const CONNECTIONS: usize = 100_000;

/// The most bytes of message definitions that are kept of a bag.
pub(crate) const DEFINITIONS: usize = 8 << 20;

/// The most files of one recording: one file a minute for a week.
pub(crate) const FILES: usize = 10_000;

/// The longest document in YAML that is parsed, in bytes: `metadata.yaml` of a thousand topics has 1 MB.
pub(crate) const YAML: usize = 8 << 20;

/// The most values of a YAML document, keys and mappings among them: 20,000 topics with all their fields. Each takes
/// about a hundred bytes while it is read.
pub(crate) const YAML_VALUES: usize = 250_000;

/// The most notices of different texts; any more only add to the count of a last one.
pub(crate) const NOTICES: usize = 200;

/// The work that is left for a launch file: files include each other, texts repeat each other, and neither may run
/// away.
#[derive(Debug)]
pub(crate) struct LaunchWork {
    left: usize,
    /// Whether something was refused.
    pub(crate) is_spent: bool,
}

impl LaunchWork {
    /// The whole allowance, for a file and what it includes.
    pub(crate) fn all() -> Self {
        Self {
            left: LAUNCH_WORK,
            is_spent: false,
        }
    }

    /// The work for one text of this many bytes by itself, without other files: loops over long lists need a tenth of
    /// it.
    pub(crate) fn of_text(bytes: usize) -> Self {
        Self {
            left: LAUNCH_WORK.min((1 << 20) + bytes.saturating_mul(500)),
            is_spent: false,
        }
    }

    /// Takes `work` from the allowance; `None` if not as much is left.
    pub(crate) fn spend(&mut self, work: usize) -> Option<()> {
        match self.left.checked_sub(work) {
            Some(left) if !self.is_spent => {
                self.left = left;
                Some(())
            }
            _ => {
                self.is_spent = true;
                None
            }
        }
    }
}

/// The most reports of statistics that are kept (30 MB): an hour of a hundred connections, each with one a second, of which
/// the rest is counted.
pub(crate) const MEASUREMENTS: usize = 360_000;
