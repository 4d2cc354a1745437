//! The budget for untrusted work, told once: every limit with its unit and its reason. What lies past one is counted,
//! said, and left out; what was read so far stays.

/// The most windows that are chosen for a user who asked for no period, whatever the span: each is a frame of a second,
/// and nobody watches longer than ten minutes.
pub(crate) const CHOSEN_WINDOWS: i64 = 600;

/// The most windows that may be asked for: a bag of a day by the second. Each costs about a kilobyte per element.
pub(crate) const WINDOWS: i64 = 100_000;

/// The longest mission, in days: nobody records for a hundred years, and sums of three such lengths in nanoseconds still
/// fit a number.
pub(crate) const SPAN_DAYS: i64 = 36_525;

/// The longest style, topology or file of captions, in bytes: a hundred times the largest we know.
pub(crate) const USER_TEXT: u64 = 16 << 20;

/// The longest topology, in bytes: twenty times the largest graph that anybody saved from `rqt_graph`. Taken apart it needs
/// eighty times as much memory at worst.
pub(crate) const TOPOLOGY: u64 = 4 << 20;

/// The most nodes and edges that a table may name: more than that are not told of a mission.
pub(crate) const TOPOLOGY_ENTRIES: usize = 1 << 17;

/// How much may be done for one launch file, in about as many bytes of memory and of text gone through: two hundred times
/// the largest launch system seen (all of Autoware's), and a second or two of work.
pub(crate) const LAUNCH_WORK: usize = 64 << 20;

#[cfg(all(feature = "cli", feature = "parquet"))]
/// The longest list of bags, in bytes: a million of them.
pub(crate) const MANIFEST: u64 = 256 << 20;

#[cfg(feature = "cli")]
/// The longest font file, in bytes: collections of Chinese, Japanese and Korean have 20 MB.
pub(crate) const FONT: u64 = 64 << 20;

/// The longest mission in JSON, in bytes: one of 100,000 windows has 2 GB.
pub(crate) const MISSION_JSON: u64 = 4 << 30;

/// The longest file of a job's summary that a report is written behind, in bytes: GitHub takes 1 MiB.
pub(crate) const SUMMARY: u64 = 16 << 20;

/// The most names, types and states of a mission: five times the topics of the largest robot known. With all that is kept
/// about each, in the windows of `info` too, they take about 256 MB.
pub(crate) const NAMES: usize = 1 << 16;

/// The longest of them, in bytes: ROS allows 255 for a name, and the quality of service of a hundred publishers is text
/// too.
pub(crate) const NAME: usize = 1 << 16;

/// Their bytes in all.
pub(crate) const NAMES_BYTES: usize = 32 << 20;

/// The most things claimed about them, each by one source: eight for each name.
pub(crate) const CLAIMS: usize = 1 << 19;

/// The most lines of evidence on what somebody asks about, and the most characters of each: more than anybody reads.
pub(crate) const EVIDENCE_LINES: usize = 1 << 16;
/// See [`EVIDENCE_LINES`].
pub(crate) const EVIDENCE_LINE: usize = 500;

#[cfg(feature = "video")]
/// How much of what a child process says is kept, in bytes: its last words.
pub(crate) const LAST_WORDS: usize = 1 << 16;

/// How much may be unpacked of any bag, in bytes: seconds of work.
pub(crate) const UNPACKED: u64 = 4 << 30;

/// How many bytes more for each byte of packed data that was read for it; real bags fold their data ten times.
pub(crate) const UNPACKED_FOLD: u64 = 1000;

/// The largest copy of a packed bag in the temporary folder, in bytes, where [`UNPACKED_FOLD`] allows less.
pub(crate) const UNPACKED_COPY: u64 = 1 << 30;

/// The most connections, or topics, that a bag may describe: real bags stay below 1,000.
pub(crate) const CONNECTIONS: usize = 100_000;

/// The most bytes of message definitions that are kept of a bag.
pub(crate) const DEFINITIONS: usize = 8 << 20;

/// The most files of one recording: a split a minute for a week.
pub(crate) const FILES: usize = 10_000;

/// The longest document in YAML that is understood, in bytes: `metadata.yaml` of a thousand topics has 1 MB.
pub(crate) const YAML: usize = 8 << 20;

/// The most values of such a document, keys and mappings among them: 20,000 topics with all that is said of them. Each
/// takes about a hundred bytes while it is read.
pub(crate) const YAML_VALUES: usize = 250_000;

/// The most notices of different texts; more of them only add to the count of a last one. Nobody reads more.
pub(crate) const NOTICES: usize = 200;

/// What is left of the work that a launch file may ask for: files include each other, texts repeat each other, and
/// neither may run away.
#[derive(Debug)]
pub(crate) struct LaunchWork {
    left: usize,
    /// Whether something was refused.
    pub(crate) is_spent: bool,
}

impl LaunchWork {
    /// All of it, for a file and what it includes.
    pub(crate) fn all() -> Self {
        Self {
            left: LAUNCH_WORK,
            is_spent: false,
        }
    }

    /// The work for what one text of this many bytes says by itself, without other files: loops over long lists need
    /// a tenth of it.
    pub(crate) fn of_text(bytes: usize) -> Self {
        Self {
            left: LAUNCH_WORK.min((1 << 20) + bytes.saturating_mul(500)),
            is_spent: false,
        }
    }

    /// Takes `work` from it; `None` if not as much is left.
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
