//! Messages as columns of a table: a column per field, with dots in the names of nested fields, and a list for each
//! array around a field.
//!
//! A payload is read by the definition in its bag, or by [`KnownTypes`] if there is none (<http://wiki.ros.org/msg>,
//! <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>). Arrays of bytes are bytes. A time is one
//! column; a duration is two, `sec` and `nanosec`, in ROS 1 as in ROS 2.

use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use crate::bag::{Connection, Encoding};
use crate::base::table::{Batch, ColumnKind, ColumnValues, TableColumn};
use crate::evidence::message::cursor::{Malformed, PayloadCursor, other_cdr};
use crate::evidence::message::definition::{
    Array, Field, Form, MessageFields, messages, without_comment,
};

/// The deepest nesting of messages; deeper ones are hostile: those in use nest eight deep.
const DEEPEST: usize = 16;
/// The most columns; more are hostile: messages in use have some hundred.
const MOST_COLUMNS: usize = 2000;

/// A step of decoding a payload.
#[derive(Clone, Debug, PartialEq)]
enum DecodeStep {
    /// A number, a Boolean or a text.
    One(usize, ColumnKind),
    /// A list of bytes is one value.
    Bytes(usize, Array),
    /// Seconds and nanoseconds since 1970.
    Time(usize),
    /// The list that ends on `level` of each of `columns`.
    List {
        count: Array,
        columns: Range<usize>,
        level: usize,
        /// The smallest number of bytes of an element.
        least: usize,
        element: Vec<Self>,
    },
    /// A message without fields, which CDR writes as one byte.
    Nothing,
}

/// A parsed definition, ready to decode messages.
#[derive(Debug, PartialEq)]
pub(crate) struct Decoder {
    encoding: Encoding,
    steps: Vec<DecodeStep>,
    columns: Vec<(String, ColumnKind, usize)>,
    /// Whether the message has no fields at all.
    is_empty: bool,
}

/// The ways to decode a connection's messages.
#[derive(Debug)]
pub(crate) struct Decoders {
    /// In the order to try them until one has decoded a message.
    pub(crate) all: Vec<Decoder>,
    /// The reason to state for messages that none decodes.
    pub(crate) why: String,
}

impl Decoders {
    /// By the definition in the bag; where that fails, by the known definition of the type, which may have changed over the
    /// years, and by the bag's with known types for all nested ones or for what it lacks.
    ///
    /// # Errors
    /// The reason why no message can be decoded.
    pub(crate) fn new(connection: &Connection, types: &KnownTypes) -> Result<Self, String> {
        let decoder = |definition: Result<_, _>| Decoder::of(connection, &definition?);
        let tried = definitions(connection, types)?.into_iter();
        let tried: Vec<_> = tried.map(decoder).collect();
        let failed = tried.iter().skip(1).find_map(|one| one.as_ref().err());
        let why = failed.filter(|_| tried[0].is_err()).cloned();
        let mut all = Vec::new();
        for decoder in tried.into_iter().flatten() {
            if !all.contains(&decoder) {
                all.push(decoder);
            }
        }
        match why {
            Some(why) if all.is_empty() => Err(why),
            why => Ok(Self {
                all,
                why: why.unwrap_or_else(|| "they do not match its definition".to_owned()),
            }),
        }
    }
}

/// The definitions to try, that of the bag first; an error for one that cannot be used.
///
/// # Errors
/// For an encoding that is not decoded.
fn definitions(
    connection: &Connection,
    types: &KnownTypes,
) -> Result<Vec<Result<Definition, String>>, String> {
    let versions: &[Carried] = match &connection.encoding {
        Encoding::Ros1 => &[Carried::Ros1],
        Encoding::Cdr => &[Carried::Ros2, Carried::OlderRos2],
        Encoding::Other(name) => return Err(format!("they are encoded as `{name}`")),
    };
    let known: Vec<_> = versions.iter().map(|one| types.all(*one)).collect();
    let of_type = known.iter();
    let of_type = of_type.filter_map(|all| Definition::known(all, &connection.type_name));
    let own = Definition::parse(connection);
    let corrected = own.clone().map(|own| own.corrected(&known[0]));
    let completed = own.clone().map(|own| own.completed(&known[0]));
    let mut all = vec![own];
    all.extend(of_type.map(Ok));
    all.extend([corrected, completed]);
    all.extend(Definition::empty(connection).map(Ok));
    Ok(all)
}

impl Decoder {
    fn of(connection: &Connection, definition: &Definition) -> Result<Self, String> {
        let mut plan = DecodePlan {
            definition,
            is_cdr: connection.encoding == Encoding::Cdr,
            columns: Vec::new(),
            fields: 0,
        };
        let fields = &definition.messages[0].fields;
        let (steps, _) = plan.message(0, "", 0, 0)?;
        Ok(Self {
            encoding: connection.encoding.clone(),
            steps,
            is_empty: fields.is_empty(),
            columns: plan.columns,
        })
    }

    /// A column for each field, in the order of the definition, with names distinct from `taken`.
    pub(crate) fn columns(&self, taken: &[&str]) -> impl Iterator<Item = TableColumn> {
        let mut names: Vec<String> = Vec::new();
        self.columns.iter().map(move |(path, kind, levels)| {
            let mut name = path.clone();
            while taken.contains(&name.as_str()) || names.contains(&name) {
                name.push('_');
            }
            names.push(name.clone());
            TableColumn::full(name, *kind, *levels)
        })
    }

    /// Adds a payload's values to the columns from `first` on. On failure they are left incomplete.
    ///
    /// # Errors
    /// If the payload has another layout.
    pub(crate) fn decode(
        &self,
        data: &[u8],
        batch: &mut Batch,
        first: usize,
    ) -> Result<(), Malformed> {
        let mut payload = PayloadCursor::new(&self.encoding, data)?;
        if !self.is_empty {
            run(&self.steps, &mut payload, &mut batch.columns[first..])?;
        } else if payload.is_cdr() && payload.remaining() > 0 {
            payload.u8()?;
        }
        payload.finish()
    }

    /// The encoding of a payload that is not plain CDR, although its connection's is CDR.
    pub(crate) fn other_encoding(&self, data: &[u8]) -> Option<&'static str> {
        other_cdr(data).filter(|_| self.encoding == Encoding::Cdr)
    }
}

/// A decoding plan under construction.
struct DecodePlan<'a> {
    definition: &'a Definition,
    is_cdr: bool,
    columns: Vec<(String, ColumnKind, usize)>,
    /// The number of fields visited.
    fields: usize,
}

impl DecodePlan<'_> {
    /// The steps of a message inside `levels` lists, and the smallest number of its bytes.
    fn message(
        &mut self,
        message: usize,
        prefix: &str,
        levels: usize,
        depth: usize,
    ) -> Result<(Vec<DecodeStep>, usize), String> {
        let definition = self.definition;
        let fields = &definition.messages[message].fields;
        if let Some(reason) = &definition.messages[message].wrong {
            return Err(reason.clone());
        }
        if depth > DEEPEST {
            return Err("its definition contains itself".to_owned());
        }
        if fields.is_empty() && self.is_cdr {
            return Ok((vec![DecodeStep::Nothing], 1));
        }
        let (mut steps, mut least) = (Vec::new(), 0_usize);
        for field in fields {
            let name = format!("{prefix}{}", field.name);
            let (more, bytes) = self.field(message, field, &name, levels, depth)?;
            steps.extend(more);
            least = least.saturating_add(bytes);
        }
        Ok((steps, least))
    }

    fn field(
        &mut self,
        message: usize,
        field: &Field,
        name: &str,
        levels: usize,
        depth: usize,
    ) -> Result<(Vec<DecodeStep>, usize), String> {
        self.fields += 1;
        if self.fields > MOST_COLUMNS {
            return Err(format!(
                "its definition has more than {MOST_COLUMNS} fields"
            ));
        }
        let count = field.array;
        let bytes = |least: usize| match count {
            Array::Fixed(count) => least.saturating_mul(count),
            _ => 4,
        };
        if count == Array::No {
            return self.one(message, &field.kind, name, levels, depth);
        }
        if ["uint8", "byte", "char", "octet"].contains(&field.kind.as_str()) {
            let step = DecodeStep::Bytes(self.columns.len(), count);
            self.columns
                .push((name.to_owned(), ColumnKind::Bytes, levels));
            return Ok((vec![step], bytes(1)));
        }
        let start = self.columns.len();
        let (element, least) = self.one(message, &field.kind, name, levels + 1, depth)?;
        let list = DecodeStep::List {
            count,
            columns: start..self.columns.len(),
            level: levels,
            least,
            element,
        };
        Ok((vec![list], bytes(least)))
    }

    /// Adds the steps of a field, or of an element of its array.
    fn one(
        &mut self,
        message: usize,
        kind: &str,
        name: &str,
        levels: usize,
        depth: usize,
    ) -> Result<(Vec<DecodeStep>, usize), String> {
        let whole = ColumnKind::whole;
        let kind = match kind {
            "bool" => ColumnKind::FLAG,
            "int8" => whole(8, true),
            // In ROS 1 `byte` is signed by definition; in ROS 2, and in practice everywhere, it is unsigned.
            "uint8" | "char" | "byte" | "octet" => whole(8, false),
            "int16" => whole(16, true),
            "uint16" => whole(16, false),
            "int32" => whole(32, true),
            "uint32" => whole(32, false),
            "int64" => whole(64, true),
            "uint64" => whole(64, false),
            "float32" => ColumnKind::Float { bits: 32 },
            "float64" => ColumnKind::F64,
            "string" => ColumnKind::Text,
            "wstring" => return Err("wide strings are not decoded".to_owned()),
            "time" if !self.is_cdr => return Ok(self.time(name, levels)),
            "duration" if !self.is_cdr => {
                let mut part = |part| {
                    let name = format!("{name}.{part}");
                    self.one(message, "int32", &name, levels, depth)
                };
                let (sec, nanosec) = (part("sec")?, part("nanosec")?);
                return Ok(([sec.0, nanosec.0].concat(), 8));
            }
            _ => {
                let inner = self.definition.find(message, kind, self.is_cdr)?;
                if self.definition.messages[inner].is_time() {
                    return Ok(self.time(name, levels));
                }
                return self.message(inner, &format!("{name}."), levels, depth + 1);
            }
        };
        // A text begins with its length.
        let least = if kind == ColumnKind::Text {
            4
        } else {
            kind.size()
        };
        let step = DecodeStep::One(self.columns.len(), kind);
        self.columns.push((name.to_owned(), kind, levels));
        Ok((vec![step], least))
    }

    /// The step of a time.
    fn time(&mut self, name: &str, levels: usize) -> (Vec<DecodeStep>, usize) {
        let step = DecodeStep::Time(self.columns.len());
        self.columns
            .push((name.to_owned(), ColumnKind::Time, levels));
        (vec![step], 8)
    }
}

fn run(
    steps: &[DecodeStep],
    payload: &mut PayloadCursor<'_>,
    columns: &mut [TableColumn],
) -> Result<(), Malformed> {
    for step in steps {
        match step {
            DecodeStep::One(column, ColumnKind::Text) => {
                text(payload, &mut columns[*column].values)?;
            }
            DecodeStep::One(column, kind) => {
                numbers(payload, 1, *kind, &mut columns[*column].values)?;
            }
            DecodeStep::Bytes(column, count) => {
                let count = many(payload, *count, 1)?;
                let bytes = payload.bytes(count)?;
                if let ColumnValues::Texts(to) = &mut columns[*column].values {
                    to.push(bytes);
                }
            }
            DecodeStep::Time(column) => {
                // 32 bits, unsigned in ROS 1 and signed in ROS 2: the same until 2038.
                let sec = payload.u32()?;
                let sec = if payload.is_cdr() {
                    i64::from(sec.cast_signed())
                } else {
                    i64::from(sec)
                };
                let nanosec = i64::from(payload.u32()?);
                if let ColumnValues::Wholes(to) = &mut columns[*column].values {
                    to.push(sec * 1_000_000_000 + nanosec);
                }
            }
            DecodeStep::List {
                count,
                columns: own,
                level,
                least,
                element,
            } => {
                // Elements without columns and bytes need no work, however many a hostile payload states.
                let least = if own.is_empty() {
                    *least
                } else {
                    (*least).max(1)
                };
                let count = many(payload, *count, least)?;
                match &element[..] {
                    [DecodeStep::One(column, kind)] if *kind != ColumnKind::Text => {
                        numbers(payload, count, *kind, &mut columns[*column].values)?;
                    }
                    _ if least > 0 => {
                        (0..count).try_for_each(|_| run(element, payload, columns))?;
                    }
                    _ => {}
                }
                for column in &mut columns[own.clone()] {
                    column.end_list(*level, count);
                }
            }
            DecodeStep::Nothing => payload.u8().map(drop)?,
        }
    }
    Ok(())
}

/// The number of elements of an array; never more than fit in the payload, unless they have no bytes.
fn many(payload: &mut PayloadCursor<'_>, count: Array, least: usize) -> Result<usize, Malformed> {
    match count {
        Array::Dynamic => payload.length(least),
        Array::Fixed(count) if count.saturating_mul(least) > payload.remaining() => {
            Err(payload.wrong("a whole array"))
        }
        Array::Fixed(count) => Ok(count),
        Array::No => Ok(1),
    }
}

fn text(payload: &mut PayloadCursor<'_>, to: &mut ColumnValues) -> Result<(), Malformed> {
    let text = payload.text()?;
    if let ColumnValues::Texts(to) = to {
        match std::str::from_utf8(text) {
            Ok(_) => to.push(text),
            Err(_) => to.push(String::from_utf8_lossy(text).as_bytes()),
        }
    }
    Ok(())
}

/// Adds `count` numbers of a kind.
fn numbers(
    payload: &mut PayloadCursor<'_>,
    count: usize,
    kind: ColumnKind,
    to: &mut ColumnValues,
) -> Result<(), Malformed> {
    let is_big = payload.is_big_endian();
    let size = kind.size();
    let data = payload.numbers(count, size)?;
    let each = data.chunks_exact(size.max(1)).map(|bytes| {
        let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        if is_big {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        }
    });
    match (to, kind) {
        (ColumnValues::Wholes(to), ColumnKind::FLAG) => to.extend(each.map(|n| i64::from(n != 0))),
        (ColumnValues::Wholes(to), ColumnKind::Whole { bits, is_signed }) => {
            // The sign is that of the highest bit of the number.
            let unused = if is_signed { 64 - bits } else { 0 };
            to.extend(each.map(|n| (n << unused).cast_signed() >> unused));
        }
        (ColumnValues::Floats(to), ColumnKind::F64) => to.extend(each.map(f64::from_bits)),
        (ColumnValues::Floats(to), _) => {
            let single = |n: u64| u32::try_from(n).map_or(f32::NAN, f32::from_bits);
            to.extend(each.map(|n| f64::from(single(n))));
        }
        _ => {}
    }
    Ok(())
}

// The messages that make up a type, from its definition in the bag and from known types.

/// The package of `Header`.
const HEADERS: &str = "std_msgs";

/// The messages of a type, the outermost first.
#[derive(Clone)]
struct Definition {
    messages: Vec<Arc<MessageFields>>,
    /// The number of messages from the bag's text, which come first: in some old bags it names nested ones without their
    /// packages.
    loose: usize,
}

impl Definition {
    /// The definition in the bag.
    ///
    /// # Errors
    /// The reason why it cannot be used.
    fn parse(connection: &Connection) -> Result<Self, String> {
        if is_blank(connection) {
            return Err(
                "the bag contains no definition of its type; `--msg-path` adds it".to_owned(),
            );
        }
        let text = connection.definition.as_deref().unwrap_or_default();
        let mut messages = messages(text, &connection.type_name, Form::of(connection))?;
        for reason in messages.iter_mut().filter_map(|one| one.wrong.as_mut()) {
            reason.push_str("; `--msg-path` replaces it");
        }
        Ok(Self {
            loose: messages.len(),
            messages: messages.into_iter().map(Arc::new).collect(),
        })
    }

    /// The definition of a message without fields, if that is what the bag may mean by an empty one.
    fn empty(connection: &Connection) -> Option<Self> {
        let is_defined = connection.definition.is_some();
        (is_defined && is_blank(connection)).then(|| Self {
            messages: vec![Arc::new(MessageFields::new(&connection.type_name))],
            loose: 0,
        })
    }

    /// The definition of a type that is among `known` ones.
    fn known(known: &[Arc<MessageFields>], type_name: &str) -> Option<Self> {
        let name = MessageFields::new(type_name);
        let own = known.iter().find(|m| m.is_called(&name))?;
        Some(Self {
            messages: std::iter::once(own).chain(known).cloned().collect(),
            loose: 0,
        })
    }

    /// This definition with `known` types for what it lacks.
    fn completed(&self, known: &[Arc<MessageFields>]) -> Self {
        Self {
            messages: [&self.messages, known].concat(),
            loose: self.loose,
        }
    }

    /// This definition with `known` types in place of its nested ones.
    fn corrected(&self, known: &[Arc<MessageFields>]) -> Self {
        let (own, nested) = self.messages.split_at(1);
        Self {
            messages: [own, known, nested].concat(),
            loose: 0,
        }
    }

    /// The index of the message that `kind` refers to in the message with index `from`: in the named package, in the
    /// same package, in any.
    ///
    /// # Errors
    /// If the definition does not contain it.
    fn find(&self, from: usize, kind: &str, is_cdr: bool) -> Result<usize, String> {
        let mut wanted = MessageFields::new(kind);
        let is_header = kind == "Header";
        if wanted.package.is_empty() {
            // `Header` alone refers to that of `std_msgs`, in ROS 1 always.
            wanted.package = if is_header && !is_cdr {
                HEADERS.to_owned()
            } else {
                self.messages[from].package.clone()
            };
        }
        let found = self.first(|_, m| m.is_called(&wanted));
        let found = found.or_else(|| {
            let in_package = |m: &MessageFields| is_header && m.package == HEADERS;
            self.first(|at, m| m.name == wanted.name && (in_package(m) || at < self.loose))
        });
        found.ok_or_else(|| format!("its definition lacks the type `{kind}`; `--msg-path` adds it"))
    }

    /// The index of the first nested message that fits, if possible of one that can be used.
    fn first(&self, fits: impl Fn(usize, &MessageFields) -> bool) -> Option<usize> {
        let nested = || self.messages.iter().enumerate().skip(1);
        let mut fitting = nested().filter(|(at, m)| fits(*at, m));
        let usable = fitting.clone().find(|(_, m)| m.wrong.is_none());
        Some(usable.or_else(|| fitting.next())?.0)
    }
}

/// Whether a connection has no definition, or an empty one.
fn is_blank(connection: &Connection) -> bool {
    let text = connection.definition.as_deref().unwrap_or_default();
    let mut lines = text.lines().map(without_comment);
    lines.all(str::is_empty)
}

// Types that bags may use without definition: those of common packages, and those in the user's files.
// rosbag2's sqlite3 recordings contain no definitions before ROS 2 Iron.

/// The suffix of a type's name for its fields before they changed.
const BEFORE: &str = " before";

/// The version of the built-in types.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Carried {
    Ros1,
    Ros2,
    /// ROS 2 before some of them changed.
    OlderRos2,
}

/// Types by package and name, the user's own first.
#[derive(Default)]
pub(crate) struct KnownTypes {
    own: Vec<Arc<MessageFields>>,
}

/// The fields of common packages' types, each with whether it is an earlier version. The texts are generated
/// by `carry.py` in the same folder; their headers list the sources.
static ROS1: LazyLock<CarriedTypes> = LazyLock::new(|| carried(include_str!("fields/ros1.msg")));
static ROS2: LazyLock<CarriedTypes> = LazyLock::new(|| carried(include_str!("fields/ros2.msg")));

type CarriedTypes = Vec<(Arc<MessageFields>, bool)>;

fn carried(text: &str) -> CarriedTypes {
    let all = messages(text, "", Form::Msg).unwrap_or_default();
    let named = all.into_iter().skip(1).map(|mut message| {
        let name = message.name.strip_suffix(BEFORE).map(str::to_owned);
        let is_older = name.is_some();
        message.name = name.unwrap_or(message.name);
        (Arc::new(message), is_older)
    });
    named.collect()
}

impl KnownTypes {
    /// Adds the types of the file of `name`, `my_msgs/Thing`, by its text, or the reason why there is none. One that cannot
    /// be used is an error of the messages that need it; `path` names it.
    pub(crate) fn add(&mut self, name: &str, path: &Path, text: Result<String, String>) {
        let end = path.extension().unwrap_or_default().to_string_lossy();
        let form = Form::named(&end.to_uppercase()).unwrap_or(Form::Msg);
        let all = text.and_then(|text| messages(&text, name, form));
        // The file of a service or an action defines no message of its own name.
        let own = usize::from(form.has_parts());
        let all = all.map(|all| all.into_iter().skip(own).collect());
        let mut all: Vec<_> =
            all.unwrap_or_else(|reason| vec![MessageFields::malformed(name, reason)]);
        for reason in all.iter_mut().filter_map(|message| message.wrong.as_mut()) {
            *reason = format!("`{}`: {reason}", path.display());
        }
        self.own.extend(all.into_iter().map(Arc::new));
    }

    /// All types. The first match is used.
    fn all(&self, carried: Carried) -> Vec<Arc<MessageFields>> {
        let built_in = match carried {
            Carried::Ros1 => &ROS1,
            Carried::Ros2 | Carried::OlderRos2 => &ROS2,
        };
        let of = |is_older: bool| built_in.iter().filter(move |t| t.1 == is_older);
        let older = of(true).filter(|_| carried == Carried::OlderRos2);
        let built_in = older.chain(of(false)).map(|(message, _)| message);
        self.own.iter().chain(built_in).cloned().collect()
    }
}

#[cfg(test)]
mod tests;
