//! Columns of Parquet files: their names, types and levels.

use super::footer::{Meaning, Node};
use motorfit_core::text::excerpt;

/// Largest depth of nested groups; levels have at most this value.
const DEPTH_MAX: u8 = 32;

/// Type of the stored values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Physical {
    /// Booleans.
    Bool,
    /// Whole numbers of 32 bits.
    Int32,
    /// Whole numbers of 64 bits.
    Int64,
    /// Days and nanoseconds of a day, of 96 bits.
    Int96,
    /// Real numbers of 32 bits.
    Float,
    /// Real numbers of 64 bits.
    Double,
    /// Big-endian whole numbers of a fixed number of bytes, at most 16.
    Fixed(usize),
}

/// A column of numbers. The numbers of a list are the elements of one column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leaf {
    /// Index among all columns of the file.
    pub(crate) column: usize,
    /// Name up to the index of an element.
    pub(crate) before: String,
    /// Name behind the index of an element.
    pub(crate) after: String,
    /// Type of the stored values.
    pub(crate) physical: Physical,
    /// Meaning of the values.
    pub(crate) meaning: Meaning,
    /// Definition level of a value that is present.
    pub(crate) present: u8,
    /// Definition level of an element of a list that exists; 0 outside of lists.
    pub(crate) exists: u8,
    /// Number of elements of each row of a list.
    pub(crate) length: Option<usize>,
}

impl Leaf {
    /// Returns the name of a column without lists, or of an element of a list.
    pub(crate) fn name(&self, element: usize) -> String {
        match self.length {
            Some(_) => format!("{}[{element}]{}", self.before, self.after),
            None => format!("{}{}", self.before, self.after),
        }
    }

    /// Returns true if the column has lists.
    pub(crate) fn is_list(&self) -> bool {
        self.exists > 0
    }
}

/// Columns of a schema: those of numbers, and the names of all others with the reasons.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    /// Columns of numbers.
    pub(crate) leaves: Vec<Leaf>,
    /// Names of the columns left out, with the reasons.
    pub(crate) others: Vec<String>,
    /// Number of all columns.
    pub(crate) count: usize,
}

/// Place of a node within the schema.
#[derive(Debug, Clone, Default)]
struct Place {
    before: String,
    after: String,
    /// Definition level of a value that is present.
    present: u8,
    /// Definition level of an element of the list.
    exists: u8,
    lists: u8,
    is_map: bool,
    depth: u8,
    /// Name that is left out: that of the group or the element within a list.
    unnamed: bool,
    /// True if the parent is annotated as a list.
    in_list: bool,
}

impl Columns {
    /// Returns the columns of a schema; `None` if its tree is damaged or too deep.
    pub(crate) fn of(nodes: &[Node]) -> Option<Self> {
        let (root, mut rest) = nodes.split_first()?;
        let mut columns = Self::default();
        for _ in 0..root.children {
            rest = columns.add(rest, &Place::default())?;
        }
        rest.is_empty().then_some(columns)
    }

    /// Adds the columns of the first node and of those below it. Returns the nodes that follow.
    fn add<'a>(&mut self, nodes: &'a [Node], parent: &Place) -> Option<&'a [Node]> {
        let (node, mut rest) = nodes.split_first()?;
        let mut place = parent.within(node)?;
        if node.children == 0 {
            self.leaf(node, place);
            return Some(rest);
        }
        place.in_list = node.meaning == Meaning::List;
        place.is_map |= node.meaning == Meaning::Map;
        // The group that repeats holds either the element or, as a structure itself, the fields of the element.
        let holds_element = node.repetition == 2
            && parent.in_list
            && node.children == 1
            && node.name != "array"
            && !node.name.ends_with("_tuple");
        place.unnamed = holds_element;
        for _ in 0..node.children {
            rest = self.add(rest, &place)?;
        }
        Some(rest)
    }

    fn leaf(&mut self, node: &Node, place: Place) {
        let column = self.count;
        self.count += 1;
        match of_numbers(node, &place) {
            Ok(physical) => self.leaves.push(Leaf {
                column,
                before: place.before,
                after: place.after,
                physical,
                meaning: node.meaning,
                present: place.present,
                exists: place.exists,
                length: None,
            }),
            Err(reason) => {
                let name = excerpt(&format!("{}{}", place.before, place.after));
                self.others.push(format!("{name}: {reason}"));
            }
        }
    }
}

impl Place {
    /// Returns the place of a child.
    fn within(&self, node: &Node) -> Option<Self> {
        let mut place = Self { in_list: false, unnamed: false, depth: self.depth + 1, ..self.clone() };
        if place.depth > DEPTH_MAX {
            return None;
        }
        let repeats = node.repetition == 2;
        if !(self.unnamed || repeats && self.in_list) {
            let name = if place.lists > 0 { &mut place.after } else { &mut place.before };
            if !name.is_empty() || self.lists > 0 {
                name.push('/');
            }
            name.push_str(&node.name);
        }
        place.present += u8::from(node.repetition != 0);
        if repeats {
            place.lists += 1;
            place.exists = place.present;
        }
        Some(place)
    }
}

/// Returns the physical type of a column of numbers, or the reason why it is none.
fn of_numbers(node: &Node, place: &Place) -> Result<Physical, String> {
    if place.is_map {
        return Err("maps".to_owned());
    }
    if place.lists > 1 {
        return Err("lists of lists".to_owned());
    }
    if let Meaning::Other(name) = node.meaning {
        return Err(name.to_owned());
    }
    let length = usize::try_from(node.length).unwrap_or(0);
    let physical = match node.physical {
        Some(0) => Physical::Bool,
        Some(1) => Physical::Int32,
        Some(2) => Physical::Int64,
        Some(3) => Physical::Int96,
        Some(4) => Physical::Float,
        Some(5) => Physical::Double,
        Some(7) if length == 2 && node.meaning == Meaning::Half => Physical::Fixed(2),
        Some(7) if matches!(node.meaning, Meaning::Decimal(_)) => match length {
            1..=16 => Physical::Fixed(length),
            _ => return Err(format!("decimals of {length} bytes")),
        },
        Some(6) if matches!(node.meaning, Meaning::Decimal(_)) => return Err("decimals of varying length".to_owned()),
        Some(6 | 7) => return Err("bytes".to_owned()),
        _ => return Err("values of an unknown type".to_owned()),
    };
    let is_whole = matches!(physical, Physical::Int32 | Physical::Int64);
    match node.meaning {
        Meaning::Plain => Ok(physical),
        Meaning::Half if physical == Physical::Fixed(2) => Ok(physical),
        Meaning::Decimal(scale) if (0..=300).contains(&scale) => match physical {
            Physical::Fixed(_) => Ok(physical),
            _ if is_whole => Ok(physical),
            _ => Err("values of an unknown type".to_owned()),
        },
        Meaning::Unsigned | Meaning::Timestamp(_) | Meaning::Clock(_) if is_whole => Ok(physical),
        _ => Err("values of an unknown type".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(name: &str, repetition: i32, children: usize) -> Node {
        let physical = (children == 0).then_some(5);
        Node { name: name.to_owned(), physical, repetition, children, ..Node::default() }
    }

    fn list(name: &str) -> Node {
        Node { meaning: Meaning::List, ..node(name, 1, 1) }
    }

    fn names(nodes: Vec<Node>) -> Vec<(String, u8, u8)> {
        let columns = Columns::of(&nodes).unwrap();
        let all = columns.leaves.into_iter().map(|leaf| Leaf { length: leaf.is_list().then_some(1), ..leaf });
        all.map(|leaf| (leaf.name(0), leaf.present, leaf.exists)).collect()
    }

    #[test]
    fn names_follow_groups_and_lists_of_all_writers() {
        let nodes = vec![
            node("schema", 0, 8),
            node("t", 0, 0),
            node("state", 1, 1),
            node("velocity", 1, 0),
            list("three"),
            node("list", 2, 1),
            node("element", 1, 0),
            list("two"),
            node("item", 2, 0),
            list("points"),
            node("list", 2, 1),
            node("element", 0, 1),
            node("x", 1, 0),
            list("pair"),
            node("array", 2, 1),
            node("y", 0, 0),
            node("bare", 2, 0),
            node("group", 2, 1),
            node("z", 0, 0),
        ];
        let expected = [
            ("t", 0, 0),
            ("state/velocity", 2, 0),
            ("three[0]", 3, 2),
            ("two[0]", 2, 2),
            ("points[0]/x", 3, 2),
            ("pair[0]/y", 2, 2),
            ("bare[0]", 1, 1),
            ("group[0]/z", 1, 1),
        ];
        assert_eq!(names(nodes), expected.map(|(name, present, exists)| (name.to_owned(), present, exists)));
    }

    #[test]
    fn damaged_trees_are_refused() {
        assert!(Columns::of(&[]).is_none());
        assert!(Columns::of(&[node("schema", 0, 2), node("a", 0, 0)]).is_none());
        assert!(Columns::of(&[node("schema", 0, 1), node("a", 0, 0), node("b", 0, 0)]).is_none());
        let deep = |depth: usize| {
            let mut nodes: Vec<_> = (0..depth).map(|_| node("g", 1, 1)).collect();
            nodes.push(node("x", 1, 0));
            Columns::of(&nodes).is_none()
        };
        assert_eq!([deep(32), deep(33), deep(100_000)], [false, true, true]);
    }
}
