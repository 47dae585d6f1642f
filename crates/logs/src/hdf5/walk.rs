//! Groups and datasets of an HDF5 file or of a MAT-file of level 7.3.

use super::links::{Member, members};
use super::matlab::{Class, class, is_sparse};
use super::variable::{Limits, Variable, text, variable};
use hdf5_reader::error::Error as Damage;
use hdf5_reader::group::Group;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::object_header::ObjectHeader;
use hdf5_reader::reference::read_object_references;
use hdf5_reader::{Dataset, Hdf5File};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::collections::{HashMap, HashSet};
use std::fmt::Display;

/// Largest depth of nested groups.
pub(super) const DEPTH_MAX: usize = 32;
/// Largest number of groups and datasets.
pub(super) const OBJECTS_MAX: usize = 50_000;
/// Length of the longest path of a dataset \[bytes\].
const PATH_MAX: usize = 1024;
/// Group of the targets of references in a MAT-file.
const TARGETS: &str = "#refs#";

/// Numeric datasets and notes on the others.
#[derive(Default)]
pub(super) struct Contents {
    pub variables: Vec<Variable>,
    /// Notes on what was not read.
    pub ignored: Vec<String>,
    /// True if the file has objects of MATLAB.
    pub objects: bool,
}

/// Reads the structure of a file; `matlab` is true for a MAT-file.
///
/// # Errors
/// Returns a `Data` error if the file has no readable root group or too many objects.
pub(super) fn contents(file: &Hdf5File, matlab: bool, limits: Limits) -> Result<Contents> {
    let root = file.root_group().map_err(damaged)?;
    let all = members(file, root.address()).map_err(damaged)?;
    let (contents, visited) = (Contents::default(), HashSet::from([root.address()]));
    let mut walk = Walk { file, matlab, limits, contents, visited, targets: None };
    walk.members(&root, all, "", 0)?;
    Ok(walk.contents)
}

/// Returns the error for a damaged file.
pub(super) fn damaged(error: impl Display) -> Error {
    Error::data(format!("the file is damaged: {error}"), "Copy the file again, or save it again.")
}

/// Returns the note on an object that the decoder does not read.
fn unreadable(error: &Damage) -> String {
    match error {
        Damage::Context { source, .. } => unreadable(source),
        Damage::UnsupportedLayoutClass(3) => "a virtual dataset".to_owned(),
        Damage::UnsupportedDatatypeClass(11) => "complex numbers".to_owned(),
        error => format!("not readable: {error}"),
    }
}

/// A member of a group by its name and the position of its header.
type Place<'a> = (&'a str, u64);

struct Walk<'a> {
    file: &'a Hdf5File,
    matlab: bool,
    limits: Limits,
    contents: Contents,
    /// Positions of the headers of visited groups and datasets.
    visited: HashSet<u64>,
    targets: Option<Targets>,
}

/// Targets of the references of a MAT-file.
struct Targets {
    group: Option<Group>,
    /// Names by the positions of their headers.
    names: HashMap<u64, String>,
}

impl Targets {
    fn new(file: &Hdf5File) -> Self {
        let root = file.root_group();
        let group = root.and_then(|root| root.group(TARGETS)).ok();
        let members = group.as_ref().and_then(|group| members(file, group.address()).ok()).unwrap_or_default();
        let names = members.into_iter().filter_map(|target| Some((target.address?, target.name))).collect();
        Self { group, names }
    }
}

impl Walk<'_> {
    fn skip(&mut self, path: &str, what: impl Display) {
        self.contents.ignored.push(format!("{}: {what}", excerpt(path)));
    }

    /// Visits the members of a group at `path`, which is inside `depth` groups.
    fn members(&mut self, group: &Group, members: Vec<Member>, path: &str, depth: usize) -> Result<()> {
        for Member { name, address } in members {
            // MATLAB keeps targets of references and contents of objects apart; PyTables its indices.
            if self.matlab && path.is_empty() && name.starts_with('#') || name.starts_with("_i_") {
                continue;
            }
            let separator = if self.matlab { "." } else { "/" };
            let path = if path.is_empty() { name.clone() } else { format!("{path}{separator}{name}") };
            match address {
                Some(address) => self.object(group, (&name, address), path, depth)?,
                None => self.skip(&path, "in another file"),
            }
        }
        Ok(())
    }

    /// Visits a member of a group. `path` is its name in the table.
    fn object(&mut self, group: &Group, place: Place<'_>, path: String, depth: usize) -> Result<()> {
        if !self.visited.insert(place.1) {
            return Ok(());
        }
        if self.visited.len() > OBJECTS_MAX {
            let message = format!("more than {OBJECTS_MAX} groups and datasets");
            return Err(Error::data(message, "Save the vectors of the recording alone."));
        }
        if path.len() > PATH_MAX {
            self.skip(&path, format!("a name of {} bytes, expected at most {PATH_MAX}", path.len()));
            return Ok(());
        }
        let visited = self.file.get_or_parse_header(place.1).and_then(|header| {
            let has = |kind: fn(&HdfMessage) -> bool| header.messages.iter().any(kind);
            if has(|message| matches!(message, HdfMessage::DataLayout(_))) {
                let dataset = group.dataset(place.0)?;
                Ok(self.dataset((group, dataset), &header, path.clone(), depth))
            } else if has(|message| {
                matches!(message, HdfMessage::SymbolTable(_) | HdfMessage::LinkInfo(_) | HdfMessage::Link(_))
            }) {
                self.group((group, place), &path, depth + 1)
            } else {
                // A type that datasets share.
                Ok(Ok(()))
            }
        });
        visited.unwrap_or_else(|error| {
            self.skip(&path, unreadable(&error));
            Ok(())
        })
    }

    /// Visits a group; the outer error is that of a damaged one.
    fn group(
        &mut self,
        (parent, (name, address)): (&Group, Place<'_>),
        path: &str,
        depth: usize,
    ) -> hdf5_reader::error::Result<Result<()>> {
        if depth > DEPTH_MAX {
            self.skip(path, format!("inside more than {DEPTH_MAX} groups"));
            return Ok(Ok(()));
        }
        let (group, members) = (parent.group(name)?, members(self.file, address)?);
        if self.matlab && group.attributes().is_ok_and(|attributes| is_sparse(&attributes)) {
            self.skip(path, "a sparse matrix");
            return Ok(Ok(()));
        }
        Ok(self.members(&group, members, path, depth))
    }

    /// Visits a dataset of a group.
    fn dataset(
        &mut self,
        (group, dataset): (&Group, Dataset),
        header: &ObjectHeader,
        path: String,
        depth: usize,
    ) -> Result<()> {
        let attributes = dataset.attributes();
        if self.matlab {
            match class(&attributes, dataset.dtype()) {
                Class::Numeric => {}
                Class::Elements => return self.elements(group.address(), &dataset, &path, depth),
                Class::Other(what) => {
                    self.skip(&path, what);
                    return Ok(());
                }
                Class::Object(name) => {
                    self.contents.objects = true;
                    self.skip(&path, name);
                    return Ok(());
                }
            }
        }
        // NetCDF writes a dataset without values for a dimension without values.
        if text(&attributes, "NAME").is_some_and(|name| name.starts_with("This is a netCDF dimension but not")) {
            return Ok(());
        }
        match variable(dataset, header, &path, &attributes, (self.matlab, self.limits)) {
            Ok((variable, others)) => {
                for (path, what) in others {
                    self.skip(&path, what);
                }
                self.contents.variables.extend(variable);
            }
            Err(what) => self.skip(&path, what),
        }
        Ok(())
    }

    /// Visits the values of a field of an array of structures, each of which has a reference in a dataset. `path` is that of
    /// the field.
    fn elements(&mut self, group: u64, dataset: &Dataset, path: &str, depth: usize) -> Result<()> {
        let (structure, field) = path.rsplit_once('.').unwrap_or((path, ""));
        let root = self.file.superblock().root_object_header_address().map_err(damaged)?;
        if group == root || depth >= DEPTH_MAX {
            self.skip(path, "references");
            return Ok(());
        }
        let width = self.file.superblock().offset_size;
        let fits = dataset.raw_byte_len().is_ok_and(|count| count as u64 <= self.limits.bytes_max);
        let bytes = if fits { dataset.read_raw_bytes() } else { Ok(Vec::new()) };
        let Ok(addresses) = bytes.and_then(|bytes| read_object_references(&bytes, width)) else {
            self.skip(path, "damaged references");
            return Ok(());
        };
        let file = self.file;
        for (address, index) in addresses.into_iter().zip(1_u64..) {
            let Targets { group, names } = self.targets.get_or_insert_with(|| Targets::new(file));
            let Some((group, name)) = group.clone().zip(names.get(&address).cloned()) else {
                self.skip(path, "references without targets");
                break;
            };
            self.object(&group, (&name, address), format!("{structure}({index}).{field}"), depth + 1)?;
        }
        Ok(())
    }
}
