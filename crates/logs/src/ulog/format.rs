//! Formats of the messages of ULog files: names and types of their fields, nested and in arrays.

use super::number::Number;
use motorfit_core::text::quoted;
use std::collections::HashMap;

/// Largest number of fields of a file.
pub(super) const CHANNELS_MAX: usize = 10_000;
/// Largest number of formats.
const FORMATS_MAX: usize = 10_000;
/// Length of the text of all formats \[bytes\].
const TEXT_MAX: usize = 16 << 20;
/// Length of the longest name of a format or field \[bytes\].
pub(super) const NAME_MAX: usize = 256;
/// Largest number of elements of arrays and members in all layouts.
const STEPS_MAX: usize = 1_000_000;
/// Largest depth of formats within formats.
const DEPTH_MAX: usize = 32;
/// Length of the longest data of a message \[bytes\].
const DATA_MAX: usize = u16::MAX as usize - 2;

/// Type of a member of a format.
#[derive(Debug, Clone, PartialEq)]
enum Type {
    Number(Number),
    /// Characters, which are left out.
    Text,
    /// Another format.
    Nested(String),
}

/// Member of a format.
#[derive(Debug, Clone, PartialEq)]
struct Member {
    name: String,
    kind: Type,
    /// Number of elements; `None` if the member is not an array.
    elements: Option<u16>,
}

impl Member {
    /// Returns the member of a text such as `float[4] q`.
    fn of(text: &str) -> Option<Self> {
        let (kind, name) = text.split_once(' ')?;
        let (kind, elements) = match kind.split_once('[') {
            Some((kind, rest)) => (kind, Some(rest.strip_suffix(']')?.parse().ok()?)),
            None => (kind, None),
        };
        if name.is_empty() || kind.is_empty() || name.len() > NAME_MAX {
            return None;
        }
        let kind = match Number::of(kind) {
            Some(number) => Type::Number(number),
            None if kind == "char" => Type::Text,
            None => Type::Nested(kind.to_owned()),
        };
        Some(Self { name: name.to_owned(), kind, elements })
    }

    /// Returns true if the values only fill space.
    fn is_padding(&self) -> bool {
        self.name.starts_with("_padding")
    }
}

/// Field of a message.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leaf {
    /// Path, such as `esc[0].esc_rpm`.
    pub path: String,
    number: Number,
    /// Position in the data of the message \[bytes\].
    offset: usize,
}

impl Leaf {
    /// Returns the value in the data of a message.
    pub(super) fn value(&self, data: &[u8]) -> f64 {
        self.number.value(data.get(self.offset..).unwrap_or_default())
    }
}

/// Fields of a message at their positions.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Layout {
    pub leaves: Vec<Leaf>,
    /// Position of the timestamp \[bytes\].
    pub timestamp: Option<usize>,
    /// Length of the data \[bytes\].
    pub size: usize,
    /// Length of the data without the padding at its end, which a writer may omit \[bytes\].
    pub size_min: usize,
}

/// Formats by their names.
#[derive(Debug, Default)]
pub(super) struct Formats {
    all: HashMap<String, Vec<Member>>,
    /// Length of their texts \[bytes\].
    length: usize,
    /// Number of elements in all layouts.
    steps: usize,
}

impl Formats {
    /// Adds the format of a text such as `attitude:uint64_t timestamp;float[4] q;`. The first format of a name counts.
    ///
    /// # Errors
    /// Returns the reason if the text is not a format, or there are too many.
    pub(super) fn add(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.length = self.length.saturating_add(bytes.len());
        if self.length > TEXT_MAX || self.all.len() >= FORMATS_MAX {
            return Err(format!("more than {FORMATS_MAX} formats or {TEXT_MAX} bytes of them"));
        }
        let text = str::from_utf8(bytes).map_err(|_| "a format that is not text".to_owned())?;
        let invalid = || format!("the format {}", quoted(text));
        let (name, members) = text.split_once(':').ok_or_else(invalid)?;
        let members = members.split(';').filter(|member| !member.is_empty());
        let members: Option<Vec<Member>> = members.map(Member::of).collect();
        let members = members.filter(|members| !members.is_empty()).ok_or_else(invalid)?;
        if name.is_empty() || name.len() > NAME_MAX {
            return Err(invalid());
        }
        self.all.entry(name.to_owned()).or_insert(members);
        Ok(())
    }

    /// Returns true if a format is defined.
    pub(super) fn contains(&self, name: &str) -> bool {
        self.all.contains_key(name)
    }

    /// Returns the layout of a message, which may have a number of fields.
    ///
    /// # Errors
    /// Returns the reason if a format is missing or contains itself, or the message is too long.
    pub(super) fn layout(&mut self, name: &str, fields_max: usize) -> Result<Layout, String> {
        let mut flat = Flat { formats: &self.all, layout: Layout::default(), fields_max, steps: self.steps };
        let done = flat.append(name, Some(""), 0);
        let Flat { layout, steps, .. } = flat;
        self.steps = steps;
        done.map(|()| layout)
    }
}

/// Layout to which members of formats are appended.
struct Flat<'f> {
    formats: &'f HashMap<String, Vec<Member>>,
    layout: Layout,
    /// Largest number of fields.
    fields_max: usize,
    /// Number of elements so far, in all layouts of the file.
    steps: usize,
}

impl Flat<'_> {
    /// Appends the members of a format; those within padding have no prefix and give no fields.
    fn append(&mut self, name: &str, prefix: Option<&str>, depth: usize) -> Result<(), String> {
        if depth >= DEPTH_MAX {
            return Err(format!("has formats within formats of more than {DEPTH_MAX} levels"));
        }
        let members = self.formats.get(name).ok_or_else(|| format!("has no format {}", quoted(name)))?;
        for member in members {
            let path = prefix.filter(|_| !member.is_padding()).map(|prefix| format!("{prefix}{}", member.name));
            match (path, &member.kind, member.elements) {
                (Some(path), Type::Number(Number::U64), None) if path == "timestamp" => {
                    self.layout.timestamp = Some(self.layout.size);
                    self.skip(Number::U64.size())?;
                }
                (None, Type::Number(number), elements) => {
                    self.skip(number.size() * usize::from(elements.unwrap_or(1)))?;
                }
                (_, Type::Text, elements) => self.skip(usize::from(elements.unwrap_or(1)))?,
                (path, kind, None) => self.append_element(kind, path, depth)?,
                (path, kind, Some(elements)) => {
                    for element in 0..elements {
                        self.append_element(kind, path.as_ref().map(|path| format!("{path}[{element}]")), depth)?;
                    }
                }
            }
            if depth == 0 && !member.is_padding() {
                self.layout.size_min = self.layout.size;
            }
        }
        Ok(())
    }

    /// Appends a number or a nested format.
    fn append_element(&mut self, kind: &Type, path: Option<String>, depth: usize) -> Result<(), String> {
        match (kind, path) {
            (Type::Number(number), Some(path)) => {
                if self.layout.leaves.len() >= self.fields_max {
                    return Err(format!("exceeds {CHANNELS_MAX} fields of the file"));
                }
                let offset = self.layout.size;
                self.layout.leaves.push(Leaf { path, number: *number, offset });
                self.skip(number.size())
            }
            (Type::Nested(name), path) => {
                self.skip(0)?;
                let prefix = path.map(|path| format!("{path}."));
                self.append(name, prefix.as_deref(), depth + 1)
            }
            _ => Ok(()),
        }
    }

    /// Advances by a number of bytes.
    fn skip(&mut self, bytes: usize) -> Result<(), String> {
        self.layout.size += bytes;
        self.steps += 1;
        if self.steps > STEPS_MAX {
            return Err(format!("exceeds {STEPS_MAX} elements of the formats of the file"));
        }
        if self.layout.size > DATA_MAX {
            return Err(format!("has a format of more than {DATA_MAX} bytes"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formats(texts: &[&str]) -> Formats {
        let mut formats = Formats::default();
        texts.iter().for_each(|text| formats.add(text.as_bytes()).unwrap());
        formats
    }

    #[test]
    fn nested_formats_and_arrays() {
        // A format may be used before it is defined.
        let mut formats = formats(&[
            "status:uint64_t timestamp;esc[2] esc;char[3] name;float[2] q;uint8_t[3] _padding0;",
            "esc:int16_t rpm;uint8_t[2] _padding0;pair[1] more;",
            "pair:bool a;double b;",
        ]);
        let layout = formats.layout("status", 8).unwrap();
        let leaf = |path: &str, number, offset| Leaf { path: path.to_owned(), number, offset };
        let expected = [
            leaf("esc[0].rpm", Number::I16, 8),
            leaf("esc[0].more[0].a", Number::Bool, 12),
            leaf("esc[0].more[0].b", Number::F64, 13),
            leaf("esc[1].rpm", Number::I16, 21),
            leaf("esc[1].more[0].a", Number::Bool, 25),
            leaf("esc[1].more[0].b", Number::F64, 26),
            leaf("q[0]", Number::F32, 37),
            leaf("q[1]", Number::F32, 41),
        ];
        assert_eq!(layout.leaves, expected);
        assert_eq!((layout.timestamp, layout.size_min, layout.size), (Some(0), 45, 48));
    }

    #[test]
    fn padding_within_and_at_the_end() {
        let mut formats = formats(&["a:uint8_t x;b _padding0;uint8_t y;b[2] _padding1;b[0] none;", "b:uint32_t[2] z;"]);
        let layout = formats.layout("a", 2).unwrap();
        let paths: Vec<_> = layout.leaves.iter().map(|leaf| (leaf.path.as_str(), leaf.offset)).collect();
        assert_eq!(paths, [("x", 0), ("y", 9)]);
        // The empty array after the padding ends it.
        assert_eq!((layout.timestamp, layout.size_min, layout.size), (None, 26, 26));
        let layout = self::formats(&["a:uint8_t x;b _padding1;", "b:uint32_t[2] z;"]).layout("a", 2).unwrap();
        assert_eq!((layout.leaves.len(), layout.size_min, layout.size), (1, 1, 9));
    }

    #[test]
    fn impossible_formats() {
        let mut all = Formats::default();
        for text in
            ["", "a", ":float x;", "a:", "a:;", "a:float;", "a:float[x] y;", "a:float[1 y;", "a:float[65536] y;"]
        {
            assert!(all.add(text.as_bytes()).is_err(), "{text}");
        }
        assert!(all.add(&[0xff]).is_err());
        assert!(all.add(format!("{}:float x;", "a".repeat(257)).as_bytes()).is_err());
        assert!(all.add(format!("a:float {};", "x".repeat(257)).as_bytes()).is_err());
        let reason = |texts: &[&str], name: &str| formats(texts).layout(name, 10_000).unwrap_err();
        assert_eq!(reason(&["a:b x;"], "a"), "has no format \"b\"");
        assert_eq!(reason(&["a:b x;", "b:a y;"], "a"), "has formats within formats of more than 32 levels");
        assert_eq!(reason(&["a:double[8192] x;"], "a"), "has a format of more than 65533 bytes");
        assert_eq!(
            reason(&["a:b[65535] x;", "b:c[65535] x;", "c:char x;"], "a"),
            "has a format of more than 65533 bytes"
        );
        assert_eq!(reason(&["a:uint8_t[10001] x;"], "a"), "exceeds 10000 fields of the file");
        let deep: Vec<String> =
            (0..32).map(|n| format!("f{n}:f{} x;", n + 1)).chain(["f32:float x;".to_owned()]).collect();
        let mut deep = formats(&deep.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(deep.layout("f1", 1).unwrap().leaves.len(), 1);
        assert!(deep.layout("f0", 1).is_err());
        let mut many = formats(&["a:b[60000] x;", "b:char[1] x;"]);
        assert_eq!((0..100).filter(|_| many.layout("a", 0).is_ok()).count(), STEPS_MAX / 120_001);
        let text = format!("f:{}", "float x;".repeat(1000));
        let mut all = Formats::default();
        let added = (0..3000).take_while(|_| all.add(text.as_bytes()).is_ok()).count();
        assert_eq!(added, TEXT_MAX / text.len());
    }
}
