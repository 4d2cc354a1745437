//! ROS 1 bags, version 2: by the index behind each chunk, else record by record.
//!
//! The format: <https://wiki.ros.org/Bags/Format/2.0>.

use super::{FormatRow, OpenOptions, Place, Reader};
use crate::error::{Error, Result};

/// ROS 1 bags.
pub(super) const FORMAT: FormatRow = FormatRow {
    name: "rosbag1",
    what: "ROS 1 bag",
    extensions: &["bag", "bag.active"],
    sniff: |_, head| head.starts_with(b"#ROSBAG V2.") || head.starts_with(b"#ROSRECORD V"),
    open,
};

fn open(place: Place, _options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let path = match &place {
        Place::File(source) => source.path().to_owned(),
        Place::Folder(path) => path.clone(),
        Place::Pipe(name, _) => name.into(),
    };
    Err(Error::Unsupported {
        path,
        what: "not yet".to_owned(),
        hint: String::new(),
    })
}
