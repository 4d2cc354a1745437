//! Log records of ROS 2: a node is alive. Dots stand for slashes; the loggers of a node's parts are folded into it.

use super::layout::{Layout, TIME2};
use super::Heard;
use crate::bag::Encoding;
use crate::facts::{Claim, Degree};
use crate::wire::{self, Cursor};

/// `rcl_interfaces/msg/Log`.
pub(super) const LAYOUT: Layout = Layout {
    type_name: "rcl_interfaces/Log",
    md5: "",
    encoding: Encoding::Cdr,
    fields: &[
        (
            "",
            "Time stamp;byte level;string name;string msg;string file;string function;uint32 line",
        ),
        TIME2,
    ],
    read,
};

fn read(heard: &mut Heard<'_>, payload: &mut Cursor<'_>) -> wire::Result<()> {
    payload.time()?;
    payload.u8()?;
    let name = payload.string()?;
    let message = payload.string()?;
    payload.skip_string()?;
    payload.skip_string()?;
    payload.u32()?;
    payload.finish()?;
    if name.is_empty() {
        return Ok(());
    }
    let text = format!("/{}", name.trim_start_matches('/').replace('.', "/"));
    let node = heard.name(&text);
    heard.claim(Claim::Logger(node), Degree::Stated, || format!("logger {name}: {message}"));
    Ok(())
}
