//! Objects of TDMS files: the file, its groups and their channels, with properties and the layout of their raw data.

use super::kind::Kind;
use super::source::{Index, Source, Value};
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};
use std::collections::{BTreeMap, HashMap};

/// Largest number of objects of a file.
const OBJECTS_MAX: usize = 20_000;
/// Largest number of properties that are kept, in all objects.
const PROPERTIES_MAX: usize = 100_000;
/// Length of the longest path of an object \[bytes\].
const PATH_MAX: u32 = 4096;
/// Length of the longest name of a property that is kept \[bytes\].
const NAME_MAX: u32 = 1024;

/// Properties of an object that the reader uses.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Properties(BTreeMap<String, Value>);

impl Properties {
    /// Sets a property; a later value replaces an earlier one. Returns true if the property is new.
    pub(super) fn insert(&mut self, name: String, value: Value) -> bool {
        self.0.insert(name, value).is_none()
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        if let Some(Value::Number(number)) = self.0.get(name) { Some(*number) } else { None }
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        if let Some(Value::Text(text)) = self.0.get(name) { Some(text) } else { None }
    }

    pub(super) fn time(&self, name: &str) -> Option<i128> {
        if let Some(Value::Time(time)) = self.0.get(name) { Some(*time) } else { None }
    }

    /// Returns all numbers except those of scales and waveforms.
    pub(super) fn constants(&self) -> impl Iterator<Item = (&str, f64)> {
        let numbers = self.0.iter().filter(|(name, _)| !name.starts_with("NI_") && !name.starts_with("wf_"));
        numbers.filter_map(|(name, value)| if let Value::Number(n) = value { Some((name.as_str(), *n)) } else { None })
    }
}

/// Level of an object.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    File,
    Group(String),
    Channel { group: String, name: String },
}

impl Place {
    /// Returns the place of a path such as `/'group'/'channel'`; a quotation mark in a name is doubled.
    fn of(path: &str) -> Option<Self> {
        let mut names = Vec::new();
        let mut chars = path.chars().peekable();
        while let Some(separator) = chars.next() {
            match (separator, chars.next()) {
                ('/', None) if names.is_empty() => break,
                ('/', Some('\'')) => (),
                _ => return None,
            }
            let mut name = String::new();
            loop {
                match chars.next()? {
                    '\'' if chars.peek() == Some(&'\'') => name.extend(chars.next()),
                    '\'' => break,
                    c => name.push(c),
                }
            }
            names.push(name);
        }
        let mut names = names.into_iter();
        match (names.next(), names.next(), names.next()) {
            (None, ..) => Some(Self::File),
            (Some(group), None, _) => Some(Self::Group(group)),
            (Some(group), Some(name), None) => Some(Self::Channel { group, name }),
            _ => None,
        }
    }
}

/// File, group or channel.
#[derive(Debug)]
pub(super) struct Object {
    pub place: Place,
    pub properties: Properties,
    /// Type of the values, of the first segment with a type that decides about the use of the channel.
    pub kind: Option<Kind>,
    /// True if a segment has data of the object in the layout of an acquisition card.
    pub daqmx: bool,
    /// Number of values in all segments.
    pub count: u64,
    /// Layout in the last segment with data.
    index: Option<Index>,
    /// Position in the list of the segment.
    slot: Option<usize>,
}

/// Objects in the order of their first appearance, and the list of those in the present segment.
#[derive(Debug, Default)]
pub(super) struct Objects {
    pub all: Vec<Object>,
    paths: HashMap<String, usize>,
    /// Objects of the segment, and their layouts if they have data in it.
    list: Vec<(usize, Option<Index>)>,
    /// Length of a chunk \[bytes\].
    chunk: u128,
    /// Number of objects in the list with data in the layout of an acquisition card.
    daqmx: usize,
    /// Number of properties kept.
    kept: usize,
}

impl Objects {
    /// Empties the list of objects of the segment.
    pub(super) fn clear_list(&mut self) {
        for (object, _) in self.list.drain(..) {
            if let Some(object) = self.all.get_mut(object) {
                object.slot = None;
            }
        }
        self.chunk = 0;
        self.daqmx = 0;
    }

    /// Returns the number of objects in the list of the segment, with data or not.
    pub(super) fn list_len(&self) -> usize {
        self.list.len()
    }

    /// Returns the objects with data in the segment, and their layouts.
    pub(super) fn with_data(&self) -> impl Iterator<Item = (usize, Index)> {
        self.list.iter().filter_map(|(object, index)| Some((*object, (*index)?)))
    }

    /// Returns the length of a chunk of the segment \[bytes\].
    pub(super) fn chunk(&self) -> u128 {
        self.chunk
    }

    /// Returns true if the segment has data in the layout of an acquisition card.
    pub(super) fn is_daqmx(&self) -> bool {
        self.daqmx > 0
    }

    /// Reads the metadata of a segment; properties are only kept if `keep` is true.
    ///
    /// # Errors
    /// Returns a `Data` error if the metadata are damaged.
    pub(super) fn read(&mut self, source: &mut Source<'_>, keep: bool) -> Result<()> {
        for _ in 0..source.u32()? {
            let object = self.object(source)?;
            self.read_index(object, source)?;
            for _ in 0..source.u32()? {
                self.read_property(object, source, keep)?;
            }
        }
        Ok(())
    }

    /// Reads a path and returns the number of its object.
    fn object(&mut self, source: &mut Source<'_>) -> Result<usize> {
        let length = source.u32()?;
        if length > PATH_MAX {
            return Err(source.damaged(&format!("holds a path of {length} bytes, expected at most {PATH_MAX}")));
        }
        let path = String::from_utf8_lossy(source.bytes(length)?);
        if let Some(object) = self.paths.get(path.as_ref()) {
            return Ok(*object);
        }
        let path = path.into_owned();
        let place = Place::of(&path);
        let place = place.ok_or_else(|| source.damaged(&format!("names an object {}", quoted(&path))))?;
        if self.all.len() >= OBJECTS_MAX {
            return Err(Error::data(
                format!("holds more than {OBJECTS_MAX} groups and channels"),
                "Save the channels of one recording alone.",
            ));
        }
        let properties = Properties::default();
        self.all.push(Object { place, properties, kind: None, daqmx: false, count: 0, index: None, slot: None });
        self.paths.insert(path, self.all.len() - 1);
        Ok(self.all.len() - 1)
    }

    /// Reads the layout of the raw data of an object and enters it into the list.
    fn read_index(&mut self, at: usize, source: &mut Source<'_>) -> Result<()> {
        let header = source.u32()?;
        let Some(object) = self.all.get_mut(at) else { return Ok(()) };
        let index = match header {
            u32::MAX => None,
            0 => match object.index {
                Some(index) => Some(index),
                None => return Err(source.damaged("refers to an earlier layout of an object that has none")),
            },
            0x1269 | 0x126a | 0x1369 => {
                object.daqmx = true;
                Some(source.daqmx_index(header)?)
            }
            _ => Some(source.index()?),
        };
        if let Some(index) = index {
            object.index = Some(index);
            let class = |kind: Kind| (kind.left_out(), kind == Kind::Time);
            match object.kind {
                _ if matches!(index.kind, Kind::Void | Kind::Daqmx) => (),
                None => object.kind = Some(index.kind),
                Some(kind) if class(kind) == class(index.kind) => (),
                Some(kind) => {
                    let what = format!("changes the type of a channel from {kind:?} to {:?}", index.kind);
                    return Err(source.damaged(&what));
                }
            }
        }
        let is_daqmx = |index: &Option<Index>| index.is_some_and(|index| index.kind == Kind::Daqmx);
        let bytes = |index: &Option<Index>| index.map_or(0, |index| u128::from(index.bytes));
        match object.slot.and_then(|slot| self.list.get_mut(slot)) {
            Some((_, old)) => {
                self.chunk = self.chunk.saturating_sub(bytes(old)).saturating_add(bytes(&index));
                self.daqmx = self.daqmx.saturating_sub(usize::from(is_daqmx(old))) + usize::from(is_daqmx(&index));
                *old = index;
            }
            None => {
                object.slot = Some(self.list.len());
                self.list.push((at, index));
                self.chunk = self.chunk.saturating_add(bytes(&index));
                self.daqmx += usize::from(is_daqmx(&index));
            }
        }
        Ok(())
    }

    /// Reads a property and keeps it if the reader uses it.
    fn read_property(&mut self, at: usize, source: &mut Source<'_>, keep: bool) -> Result<()> {
        let length = source.u32()?;
        let keep = keep && length <= NAME_MAX;
        let name = if keep {
            String::from_utf8_lossy(source.bytes(length)?).into_owned()
        } else {
            source.skip(u64::from(length))?;
            String::new()
        };
        let code = source.u32()?;
        let Some(kind) = Kind::of(code) else {
            let what = format!("holds a property {} of the unknown type {code:#x}", quoted(&name));
            return Err(source.damaged(&what));
        };
        let value = source.value(kind)?;
        let Some(object) = self.all.get_mut(at) else { return Ok(()) };
        let used = match (&object.place, &value) {
            _ if name.starts_with("NI_Scal") || name == "NI_Number_Of_Scales" => true,
            (Place::Channel { .. }, _) => name.starts_with("wf_") || name == "unit_string",
            (_, value) => matches!(value, Some(Value::Number(_))),
        };
        if let Some(value) = value.filter(|_| keep && used) {
            self.kept += usize::from(object.properties.insert(name, value));
            if self.kept > PROPERTIES_MAX {
                return Err(source.damaged(&format!("exceeds {PROPERTIES_MAX} properties of the file")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_paths() {
        let channel = |group: &str, name: &str| Some(Place::Channel { group: group.to_owned(), name: name.to_owned() });
        assert_eq!(Place::of("/"), Some(Place::File));
        assert_eq!(Place::of("/'a/b'"), Some(Place::Group("a/b".to_owned())));
        assert_eq!(Place::of("/'a'/'b c'"), channel("a", "b c"));
        assert_eq!(Place::of("/'Dr. T''s'/'''x'''"), channel("Dr. T's", "'x'"));
        assert_eq!(Place::of("/''/''"), channel("", ""));
        for path in ["a", "/a", "/'a", "/'a''", "/'a'b", "/'a'/", "/'a'/'b'/'c'", "//"] {
            assert_eq!(Place::of(path), None, "{path}");
        }
    }
}
