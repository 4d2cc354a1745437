//! The animation as video: frames are piped into `ffmpeg`, if it is in `PATH`.

use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdin, Command, Stdio};
use std::thread::{self, JoinHandle};

use super::{Encoder, Needs, Pack, Packet, Started, Written};
use crate::base::budget;
use crate::base::error::{Error, Result};
use crate::export::palette::Palette;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::sink::OutputSink;
use crate::export::target::Target;

/// The finest time step in milliseconds; frames are repeated to fill their duration.
const FINEST_MS: u32 = 20;
/// The lowest frame rate in frames per second; players have trouble with less.
const FEWEST_PER_SECOND: f64 = 10.0;

/// A kind of video: the container and the arguments of ffmpeg for it.
pub(crate) struct VideoKind {
    arguments: &'static str,
    /// Arguments of the container for a pipe, in which ffmpeg cannot seek.
    piped: &'static str,
}

pub(crate) const MP4: VideoKind = VideoKind {
    arguments: "-c:v libx264 -crf 18 -pix_fmt yuv420p -f mp4",
    piped: "-movflags frag_keyframe+empty_moov",
};
pub(crate) const WEBM: VideoKind = VideoKind {
    arguments: "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1 -pix_fmt yuv420p -f webm",
    piped: "",
};

/// Whether ffmpeg can be run.
///
/// # Errors
/// [`Error::Output`] if it cannot, for the output at `target`.
pub(crate) fn check(target: &Target) -> Result<()> {
    let mut command = Command::new("ffmpeg");
    let command = command.arg("-version").stdin(Stdio::null());
    let run = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.map(drop).map_err(|e| missing(target.path(), &e))
}

fn missing(path: &Path, error: &io::Error) -> Error {
    let reason = format!("video needs `ffmpeg`, which cannot be run: {error}");
    let hint = "install ffmpeg, or write `.gif` or `.apng`, which need no other program";
    Error::output(path, reason, hint)
}

struct Video<'a> {
    sequence: &'a Sequence<'a>,
    kind: &'static VideoKind,
    target: Target,
    size: (u32, u32),
    work: Option<FfmpegJob>,
}

/// A process that is killed on drop.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running ffmpeg.
struct FfmpegJob {
    child: Process,
    /// The pipe for frames.
    pipe: Option<ChildStdin>,
    /// The thread that reads its messages, as a full pipe would block it.
    messages: Option<JoinHandle<Vec<u8>>>,
    sink: OutputSink,
    /// The length of one repetition in milliseconds.
    step: u32,
    /// Milliseconds requested and repetitions written so far.
    time: (u64, u64),
}

/// Begins the video.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    kind: &'static VideoKind,
) -> Started<'a> {
    target.must_be_one("an animation contains all windows")?;
    Ok(Box::new(Video {
        sequence,
        kind,
        target: target.clone(),
        size: (0, 0),
        work: None,
    }))
}

impl Video<'_> {
    fn failed(&self, reason: String) -> Error {
        let hint = "try `ffmpeg -version`; `.gif` and `.apng` need no ffmpeg";
        Error::output(self.target.path(), reason, hint)
    }

    fn start(&self, first: &[u8]) -> Result<FfmpegJob> {
        let mut sink = OutputSink::create(&self.target, None)?;
        let step = step(&self.sequence.frame_times());
        let rate = 1000.0 / f64::from(step);
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error", "-y"]);
        command.args(["-f", "rawvideo", "-pix_fmt", "rgba"]);
        command.args(["-s", &format!("{}x{}", self.size.0, self.size.1)]);
        command.args(["-framerate", &rate.to_string(), "-i", "pipe:0", "-an"]);
        // Most players require even sides: the picture is padded with the colour of its corner.
        let [r, g, b] = first.first_chunk().copied().unwrap_or([255; 3]);
        let pad = format!("pad=ceil(iw/2)*2:ceil(ih/2)*2:color=0x{r:02x}{g:02x}{b:02x}");
        // The filter, unlike `-r`, shows the last frame as long as the others.
        let fps = rate.max(FEWEST_PER_SECOND);
        command.args(["-vf", &format!("fps={fps},{pad}")]);
        // No version and no time in the file, so output is deterministic.
        command.args("-fflags +bitexact -flags:v +bitexact -map_metadata -1".split(' '));
        command.args(self.kind.arguments.split(' '));
        if let Some(file) = sink.handle()? {
            command.arg("/dev/stdout").stdout(file);
        } else {
            let piped = self.kind.piped.split_whitespace();
            command.args(piped).arg("pipe:1");
        }
        // We handle interrupts on the terminal: ffmpeg ends with its pipe.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.map_err(|e| missing(self.target.path(), &e))?;
        Ok(FfmpegJob {
            pipe: child.stdin.take(),
            messages: child
                .stderr
                .take()
                .map(|pipe| thread::spawn(|| last_messages(pipe))),
            child: Process(child),
            sink,
            step,
            time: (0, 0),
        })
    }

    /// The error with ffmpeg's message.
    fn complaint(&self, work: &mut FfmpegJob) -> Error {
        drop(work.pipe.take());
        let _ = work.child.0.wait();
        let messages = work.messages.take().and_then(|all| all.join().ok());
        let messages = String::from_utf8_lossy(&messages.unwrap_or_default()).into_owned();
        let last = messages.lines().rev().find(|l| !l.trim().is_empty());
        self.failed(format!(
            "ffmpeg failed: {}",
            last.unwrap_or("it printed no reason")
        ))
    }
}

impl Encoder for Video<'_> {
    fn needs(&self) -> Needs {
        Needs::Pixels
    }

    fn plays(&self) -> bool {
        true
    }

    fn pack(&self) -> Pack {
        |frame| Ok(Packet::Bytes(frame.pixels.rgba.clone()))
    }

    fn packet_density(&self) -> f64 {
        4.0
    }

    fn begin(&mut self, size: (u32, u32), _: &Palette) -> Result<()> {
        self.size = size;
        Ok(())
    }

    fn take(&mut self, _: usize, frame_time: FrameTime, packet: Packet) -> Result<()> {
        let Packet::Bytes(rgba) = packet else {
            return Ok(());
        };
        let mut work = match self.work.take() {
            Some(work) => work,
            None => self.start(&rgba)?,
        };
        if work.show(&rgba, frame_time.ms).is_err() {
            return Err(self.complaint(&mut work));
        }
        self.work = Some(work);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        let mut written = Written::to(&self.target);
        let Some(mut work) = self.work.take() else {
            return Ok(written);
        };
        drop(work.pipe.take());
        let status = work.child.0.wait().map_err(work.sink.error())?;
        if !status.success() {
            return Err(self.complaint(&mut work));
        }
        if work.sink.is_empty_file().map_err(work.sink.error())? {
            return Err(self.failed("ffmpeg reported success but wrote nothing".to_owned()));
        }
        written.add(work.sink.commit()?);
        Ok(written)
    }
}

impl FfmpegJob {
    /// Shows a frame for `ms` milliseconds, rounded so that errors do not add up.
    fn show(&mut self, rgba: &[u8], ms: u32) -> io::Result<()> {
        let Some(pipe) = &mut self.pipe else {
            return Ok(());
        };
        self.time.0 += u64::from(ms);
        let step = u64::from(self.step);
        let until = ((self.time.0 + step / 2) / step).max(self.time.1 + 1);
        for _ in self.time.1..until {
            pipe.write_all(rgba)?;
        }
        self.time.1 = until;
        Ok(())
    }
}

/// The end of the messages of a child process, read until it closes the pipe.
fn last_messages(mut pipe: ChildStderr) -> Vec<u8> {
    let (mut messages, mut buffer) = (Vec::new(), [0; 4096]);
    // Read errors are ignored, as partial messages still help.
    while let Ok(count) = pipe.read(&mut buffer)
        && count > 0
    {
        messages.extend_from_slice(&buffer[..count]);
        let spare = messages.len().saturating_sub(budget::MESSAGES_OF_A_CHILD);
        messages.drain(..spare);
    }
    messages
}

/// The greatest common divisor of all times, but at least [`FINEST_MS`].
fn step(frame_times: &[FrameTime]) -> u32 {
    fn common(a: u32, b: u32) -> u32 {
        if b == 0 { a } else { common(b, a % b) }
    }
    let step = frame_times.iter().map(|s| s.ms).fold(0, common);
    step.max(FINEST_MS)
}
