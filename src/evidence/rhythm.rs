//! Whether something that is heard now and then has a rhythm, and whether that broke off.

use crate::base::time::Stamp;

/// What was heard so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rhythm {
    beat: Option<Stamp>,
    last: Option<Stamp>,
    beats: u32,
    longest: i64,
}

impl Rhythm {
    /// Fewer beats than this are no rhythm.
    const FEWEST: u32 = 5;
    /// What is heard sooner after a beat is the same beat; a burst at a start is no rhythm.
    const BEAT_NS: i64 = 1_000_000_000;
    /// Less silence than this is none: a recorder stops writing topics up to a second apart.
    const SILENCE_NS: i64 = 2_000_000_000;

    /// Hears something; times do not go back.
    pub(crate) fn hear(&mut self, time: Stamp) {
        self.longest = self
            .longest
            .max(self.last.map_or(0, |last| time.since(last)));
        self.last = Some(time);
        if self
            .beat
            .is_none_or(|beat| time.since(beat) >= Self::BEAT_NS)
        {
            self.beat = Some(time);
            self.beats += 1;
        }
    }

    /// Whether the silence before `end` is far longer than any before it.
    pub(crate) fn broke_off(&self, end: Stamp) -> bool {
        let silence = self.last.map_or(0, |last| end.since(last));
        let usual = self.longest.saturating_mul(3).max(Self::SILENCE_NS);
        self.beats >= Self::FEWEST && silence > usual
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn broke_off(times: &[i64], end: i64) -> bool {
        let mut rhythm = Rhythm::default();
        for time in times {
            rhythm.hear(Stamp(time * 100_000_000));
        }
        rhythm.broke_off(Stamp(end * 100_000_000))
    }

    #[test]
    fn a_rhythm_breaks_off_when_silence_is_longer_than_ever() {
        let steady = [0, 20, 40, 60, 80];
        assert!(broke_off(&steady, 150));
        assert!(!broke_off(&steady, 130));
    }

    #[test]
    fn a_burst_at_the_start_is_no_rhythm() {
        assert!(!broke_off(&[0, 1, 2, 3, 4, 5, 6], 900));
    }
}
