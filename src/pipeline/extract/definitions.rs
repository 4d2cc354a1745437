//! Definitions of message types in folders of `.msg`, `.srv`, `.action` and `.idl` files.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::{budget, file};
use crate::evidence::message::fields::KnownTypes;

/// The most files and folders below a folder of definitions: ten times a whole installation of ROS.
const MOST_FILES: usize = 1 << 16;

/// The extensions of files with definitions, and the names of the folders with such files in a package.
const KINDS: [&str; 4] = ["msg", "srv", "action", "idl"];

/// The types of the files in folders. A file that cannot be used is an error of the topics that need it.
///
/// # Errors
/// If a folder cannot be read or contains no such file.
pub(super) fn read(folders: &[PathBuf]) -> Result<KnownTypes> {
    let mut types = KnownTypes::default();
    for folder in folders {
        let files = msg_files(folder)?;
        for (name, path) in &files {
            let text = file::read(path, budget::USER_TEXT);
            let text = text.map(|text| String::from_utf8_lossy(&text).into_owned());
            let text = text.map_err(|error| error.to_string());
            types.add(name, path, text);
        }
        if files.is_empty() {
            return Err(Error::usage(
                format!("`{}` contains no file of messages", folder.display()),
                "give the folder of one or more packages, which contain files such as `my_msgs/msg/Thing.msg`; \
                 `.srv`, `.action` and `.idl` files are read as well",
            ));
        }
    }
    Ok(types)
}

/// The files of definitions below a folder by the names of their types, sorted: `my_msgs/msg/Thing.msg` is
/// `my_msgs/Thing`.
fn msg_files(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
    let whole = folder.canonicalize().map_err(Error::io("read", folder))?;
    let typed = |path: PathBuf| match path.strip_prefix(&whole) {
        Ok(below) => folder.join(below),
        Err(_) => path,
    };
    let is_definition = |end: &OsStr| KINDS.iter().any(|kind| end == *kind);
    let (mut waiting, mut found) = (vec![whole.clone()], Vec::new());
    while let Some(folder) = waiting.pop() {
        let entries = fs::read_dir(&folder).map_err(Error::io("read", &folder))?;
        for entry in entries {
            let entry = entry.map_err(Error::io("read", &folder))?;
            let (path, kind) = (entry.path(), entry.file_type());
            if kind.is_ok_and(|kind| kind.is_dir()) {
                waiting.push(path);
            } else if path.is_file() && path.extension().is_some_and(is_definition) {
                let is_kind = KINDS.iter().any(|kind| folder.ends_with(kind));
                let outer = folder.parent().filter(|_| is_kind);
                let name = |path: Option<&OsStr>| path.map(|n| n.to_string_lossy().into_owned());
                let package = name(outer.unwrap_or(&folder).file_name()).unwrap_or_default();
                let own = name(path.file_stem()).unwrap_or_default();
                found.push((format!("{package}/{own}"), typed(path)));
            }
        }
        if waiting.len() + found.len() > MOST_FILES {
            let folder = folder.display();
            return Err(Error::usage(
                format!("`{folder}` contains more than {MOST_FILES} files"),
                "give the folder of your message packages",
            ));
        }
    }
    found.sort();
    Ok(found)
}
