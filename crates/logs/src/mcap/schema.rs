//! Message definitions of ROS 2 (`ros2msg`).
//!
//! A definition is the text of a `.msg` file, followed by those of all types that it uses, each after a line of `=` and a line
//! `MSG: package/Type`. A line declares a member (`float64[3] axis`) or a constant (`uint8 ON=1`).

use super::limits::{DEPTH_MAX, MEMBERS_MAX, NAME_MAX};
use motorfit_core::text::quoted;
use std::collections::BTreeMap;

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Bool,
            "int8" => Self::I8,
            "uint8" | "byte" | "char" => Self::U8,
            "int16" => Self::I16,
            "uint16" => Self::U16,
            "int32" => Self::I32,
            "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Returns the number of bytes.
    pub fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// Type of a member or of the elements of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Number),
    Text,
    /// Text whose representation depends on the implementation of ROS 2.
    WideText,
    /// Index of a structure.
    Structure(usize),
}

/// Number of values of a member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    One,
    Fixed(usize),
    Sequence,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Member {
    pub name: String,
    pub kind: Kind,
    pub shape: Shape,
}

/// Structures of a message; the first one is the message itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Schema {
    pub structures: Vec<Vec<Member>>,
    /// Index of the structure of a header.
    header: Option<usize>,
}

impl Schema {
    /// Returns the members of a structure.
    pub fn members(&self, structure: usize) -> &[Member] {
        self.structures.get(structure).map_or(&[], Vec::as_slice)
    }

    /// Returns true if a message starts with a header with a time.
    pub fn has_stamp(&self) -> bool {
        let first = self.members(0).first();
        first.is_some_and(|m| m.shape == Shape::One && self.header.is_some_and(|at| m.kind == Kind::Structure(at)))
    }

    /// Returns true if the members are those of `sensor_msgs/msg/JointState`.
    pub fn is_joint_state(&self) -> bool {
        let of = |m: &Member, name: &str, kind| m.name == name && m.kind == kind && m.shape == Shape::Sequence;
        let numbers = Kind::Number(Number::F64);
        matches!(self.members(0), [_, name, position, velocity, effort] if self.has_stamp()
            && of(name, "name", Kind::Text) && of(position, "position", numbers)
            && of(velocity, "velocity", numbers) && of(effort, "effort", numbers))
    }

    /// Returns true if a message has a wide string, after which its members cannot be found.
    pub fn has_wide_text(&self) -> bool {
        self.structures.iter().flatten().any(|member| member.kind == Kind::WideText)
    }

    /// Parses the definition of the message `name`; `left` is the number of members that the log may still declare.
    ///
    /// # Errors
    /// Returns what is not understood.
    pub fn ros2(name: &str, text: &str, left: &mut usize) -> Result<Self, String> {
        let texts = split(name, text);
        let mut parser = Parser { texts, known: BTreeMap::new(), structures: Vec::new(), left };
        parser.structure(&short(name), 0)?;
        let header = parser.known.get("std_msgs/Header").copied();
        // A header as used by ROS 2 starts with the time.
        let header = header.filter(|&at| {
            let stamp = parser.structures.get(at).and_then(|members| members.first());
            stamp.is_some_and(|stamp| match (stamp.kind, stamp.shape) {
                (Kind::Structure(time), Shape::One) => {
                    let parts = parser.structures.get(time).map_or(&[][..], Vec::as_slice);
                    let whole =
                        |m: &Member| m.shape == Shape::One && matches!(m.kind, Kind::Number(n) if n.size() == 4);
                    parts.len() == 2 && parts.iter().all(whole)
                }
                _ => false,
            })
        });
        Ok(Self { structures: parser.structures, header })
    }
}

/// Returns a name without the part `msg`: `package/Type`.
pub(super) fn short(name: &str) -> String {
    match (name.split('/').next(), name.rsplit('/').next()) {
        (Some(package), Some(kind)) if name.contains('/') => format!("{package}/{kind}"),
        _ => name.to_owned(),
    }
}

/// Splits a definition into the texts of its types.
fn split<'a>(name: &str, text: &'a str) -> BTreeMap<String, Vec<&'a str>> {
    let mut texts = BTreeMap::new();
    let mut current = short(name);
    let mut lines = Vec::new();
    for line in text.lines() {
        let line = line.trim();
        if let Some(next) = line.strip_prefix("MSG:") {
            texts.entry(std::mem::replace(&mut current, short(next.trim()))).or_insert(std::mem::take(&mut lines));
        } else if !line.is_empty() && !line.starts_with('#') && line.bytes().any(|byte| byte != b'=') {
            lines.push(line);
        }
    }
    texts.entry(current).or_insert(lines);
    texts
}

struct Parser<'a> {
    /// Lines of each type.
    texts: BTreeMap<String, Vec<&'a str>>,
    /// Indices of the structures that are complete.
    known: BTreeMap<String, usize>,
    structures: Vec<Vec<Member>>,
    left: &'a mut usize,
}

impl Parser<'_> {
    /// Parses a type and those of its members, and returns its index.
    fn structure(&mut self, name: &str, depth: usize) -> Result<usize, String> {
        if let Some(&at) = self.known.get(name) {
            return Ok(at);
        }
        if depth == DEPTH_MAX {
            return Err(format!("{} is inside more than {DEPTH_MAX} types", quoted(name)));
        }
        // A type is removed while it is parsed: one that contains itself is not found.
        let lines = self.texts.remove(name).or_else(|| builtin(name));
        let lines = lines.ok_or_else(|| format!("type {} is not defined", quoted(name)))?;
        let at = self.structures.len();
        self.structures.push(Vec::new());
        let mut members = Vec::new();
        for line in lines {
            if let Some(member) = self.member(line, name, depth)? {
                *self.left = self.left.checked_sub(1).ok_or_else(|| format!("more than {MEMBERS_MAX} members"))?;
                members.push(member);
            }
        }
        if let Some(place) = self.structures.get_mut(at) {
            *place = members;
        }
        self.known.insert(name.to_owned(), at);
        Ok(at)
    }

    /// Parses a line; `None` if it declares a constant.
    fn member(&mut self, line: &str, inside: &str, depth: usize) -> Result<Option<Member>, String> {
        let not = || format!("line {} declares no member", quoted(line));
        let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(not)?;
        let rest = rest.trim_start();
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, rest) = rest.split_at_checked(end).ok_or_else(not)?;
        if rest.trim_start().starts_with('=') {
            return Ok(None);
        }
        if name.is_empty() || name.len() > NAME_MAX || !rest.starts_with([' ', '\t', '#']) && !rest.is_empty() {
            return Err(not());
        }
        let (base, shape) = shape(kind).ok_or_else(not)?;
        let kind = match base.split_once("<=").map_or(base, |(base, _)| base) {
            "string" => Kind::Text,
            "wstring" => Kind::WideText,
            plain => match Number::of(plain) {
                Some(number) => Kind::Number(number),
                None => Kind::Structure(self.structure(&full(plain, inside), depth + 1)?),
            },
        };
        Ok(Some(Member { name: name.to_owned(), kind, shape }))
    }
}

/// Returns the type of the elements and the shape of a type: `float64[<=3]`.
fn shape(kind: &str) -> Option<(&str, Shape)> {
    let Some((base, brackets)) = kind.split_once('[') else { return Some((kind, Shape::One)) };
    let count = brackets.strip_suffix(']')?;
    match count.strip_prefix("<=") {
        _ if count.is_empty() => Some((base, Shape::Sequence)),
        Some(bound) => bound.parse::<u64>().ok().map(|_| (base, Shape::Sequence)),
        None => count.parse::<u32>().ok().filter(|&n| n > 0).map(|count| (base, Shape::Fixed(count as usize))),
    }
}

/// Returns the full name of a type that is used inside the type `inside`.
fn full(name: &str, inside: &str) -> String {
    match name {
        "time" => "builtin_interfaces/Time".to_owned(),
        "duration" => "builtin_interfaces/Duration".to_owned(),
        "Header" => "std_msgs/Header".to_owned(),
        _ if name.contains('/') => short(name),
        _ => format!("{}/{name}", inside.split('/').next().unwrap_or_default()),
    }
}

/// Returns the definition of a type that a log may leave out.
fn builtin(name: &str) -> Option<Vec<&'static str>> {
    match name {
        "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Some(vec!["int32 sec", "uint32 nanosec"]),
        "std_msgs/Header" => Some(vec!["builtin_interfaces/Time stamp", "string frame_id"]),
        _ => None,
    }
}
