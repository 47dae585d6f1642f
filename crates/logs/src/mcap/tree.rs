//! Paths of the numbers in the messages of a topic, and the row of values of one message.
//!
//! The paths are nodes of a tree: members of structures, elements of arrays, and joints by name. The tree grows while the log
//! is scanned, because the lengths of arrays, the names of joints and the members of JSON objects are known only from messages.
//! Later, the numbers of selected leaves of each message are written to a row.

use super::limits::{ELEMENTS_MAX, NAME_MAX};
use std::collections::BTreeMap;

/// Node of a tree; `None` is a part of a message that is passed over.
pub(super) type At = Option<usize>;

/// Step from a node to one of its children.
enum Step {
    Root,
    Member(String),
    Element(usize),
    Joint(String),
}

struct Node {
    step: Step,
    /// Members or joints in the order in which they were found.
    members: Vec<usize>,
    /// Members or joints by their names, if they are looked up by name.
    names: BTreeMap<String, usize>,
    elements: Vec<usize>,
    /// Largest number of elements of an array that has too many; its elements have no nodes.
    overlong: Option<usize>,
    number: bool,
    /// Place in the row.
    slot: Option<usize>,
    /// True if the node or one below it has a place in the row.
    wanted: bool,
}

impl Node {
    fn new(step: Step) -> Self {
        let (members, names, elements) = (Vec::new(), BTreeMap::new(), Vec::new());
        Self { step, members, names, elements, overlong: None, number: false, slot: None, wanted: false }
    }
}

/// A numeric leaf of a tree.
pub(super) struct Leaf {
    /// Path such as `velocity[0]`.
    pub path: String,
    node: usize,
}

/// Paths of a topic and the current row.
pub(super) struct Tree {
    nodes: Vec<Node>,
    growing: bool,
    /// Number of nodes that may be added.
    spare: usize,
    /// True if a node could not be added.
    pub full: bool,
    /// Values of the selected leaves in the current message; NaN for those that it lacks.
    pub row: Vec<f64>,
}

impl Tree {
    /// Returns a tree of its root.
    pub fn new() -> Self {
        let nodes = vec![Node::new(Step::Root)];
        Self { nodes, growing: true, spare: 0, full: false, row: Vec::new() }
    }

    /// Allows the tree to grow by a number of nodes.
    pub fn allow(&mut self, nodes: usize) {
        self.spare = nodes;
    }

    /// Returns the number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Ends the growth.
    pub fn freeze(&mut self) {
        self.growing = false;
    }

    /// Adds a node and returns it; `None` if the tree does not grow.
    fn add(&mut self, step: Step) -> At {
        if !self.growing {
            return None;
        }
        let Some(spare) = self.spare.checked_sub(1) else {
            self.full = true;
            return None;
        };
        self.spare = spare;
        self.nodes.push(Node::new(step));
        Some(self.nodes.len() - 1)
    }

    /// Returns the node unless it is certain that nothing below it is selected.
    fn visible(&self, node: usize) -> At {
        (self.growing || self.nodes.get(node)?.wanted).then_some(node)
    }

    /// Returns member number `index` of a structure whose members are visited in order.
    pub fn member(&mut self, at: At, index: usize, name: &str) -> At {
        let at = at?;
        if let Some(&child) = self.nodes.get(at)?.members.get(index) {
            return self.visible(child);
        }
        let child = self.add(Step::Member(name.to_owned()))?;
        self.nodes.get_mut(at)?.members.push(child);
        Some(child)
    }

    /// Returns the member of a JSON object.
    pub fn named(&mut self, at: At, name: &str) -> At {
        self.by_name(at?, name, Step::Member)
    }

    /// Returns the element of an array that belongs to a joint.
    pub fn joint(&mut self, at: At, name: &str) -> At {
        self.by_name(at?, name, Step::Joint)
    }

    fn by_name(&mut self, at: usize, name: &str, step: fn(String) -> Step) -> At {
        if let Some(&child) = self.nodes.get(at)?.names.get(name) {
            return self.visible(child);
        }
        if name.len() > NAME_MAX {
            return None;
        }
        let child = self.add(step(name.to_owned()))?;
        let node = self.nodes.get_mut(at)?;
        node.members.push(child);
        node.names.insert(name.to_owned(), child);
        Some(child)
    }

    /// Returns the node of an array of `count` elements; `None` if it has too many in this or an earlier message.
    pub fn array(&mut self, at: At, count: usize) -> At {
        let node = self.nodes.get_mut(at?)?;
        if self.growing && (count > ELEMENTS_MAX || node.overlong.is_some()) {
            node.overlong = node.overlong.max(Some(count));
            node.elements.clear();
        }
        if node.overlong.is_some() { None } else { at }
    }

    /// Returns element number `index` of an array whose elements are visited in order.
    pub fn element(&mut self, at: At, index: usize) -> At {
        let at = at?;
        if let Some(&child) = self.nodes.get(at)?.elements.get(index) {
            return self.visible(child);
        }
        let child = self.add(Step::Element(index))?;
        self.nodes.get_mut(at)?.elements.push(child);
        Some(child)
    }

    /// Takes the number of a leaf.
    pub fn number(&mut self, at: At, value: f64) {
        let Some(node) = at.and_then(|at| self.nodes.get_mut(at)) else { return };
        if self.growing {
            node.number = true;
        } else if let Some(place) = node.slot.and_then(|slot| self.row.get_mut(slot)) {
            *place = value;
        }
    }

    /// Returns the numeric leaves in the order of the tree, and the paths of arrays with too many elements.
    pub fn leaves(&self) -> (Vec<Leaf>, Vec<(String, usize)>) {
        let (mut leaves, mut overlong) = (Vec::new(), Vec::new());
        // The depth of a tree is that of types and JSON values, which is limited.
        self.collect(0, String::new(), &mut leaves, &mut overlong);
        (leaves, overlong)
    }

    fn collect(&self, at: usize, path: String, leaves: &mut Vec<Leaf>, overlong: &mut Vec<(String, usize)>) {
        let Some(node) = self.nodes.get(at) else { return };
        if node.number {
            leaves.push(Leaf { path: path.clone(), node: at });
        }
        for &child in node.members.iter().chain(&node.elements) {
            let below = match self.nodes.get(child).map(|child| &child.step) {
                Some(Step::Member(name)) if path.is_empty() => name.clone(),
                Some(Step::Member(name)) => format!("{path}.{name}"),
                Some(Step::Joint(name)) => format!("{path}/{name}"),
                Some(Step::Element(index)) => format!("{path}[{index}]"),
                Some(Step::Root) | None => continue,
            };
            self.collect(child, below, leaves, overlong);
        }
        if let Some(count) = node.overlong {
            overlong.push((path, count));
        }
    }

    /// Selects the leaves of the row, and returns the place of each of them in it.
    pub fn select<'a>(&mut self, leaves: impl Iterator<Item = &'a Leaf>) -> Vec<usize> {
        self.freeze();
        for node in &mut self.nodes {
            (node.slot, node.wanted) = (None, false);
        }
        let mut width = 0;
        let mut places = Vec::new();
        for leaf in leaves {
            let Some(node) = self.nodes.get_mut(leaf.node) else { continue };
            let slot = *node.slot.get_or_insert(width);
            width = width.max(slot + 1);
            places.push(slot);
        }
        self.row = vec![f64::NAN; width];
        // Children have larger numbers than their parents.
        for at in (0..self.nodes.len()).rev() {
            let Some(node) = self.nodes.get(at) else { continue };
            let is = |&child: &usize| self.nodes.get(child).is_some_and(|child| child.wanted);
            let wanted = node.slot.is_some() || node.members.iter().chain(&node.elements).any(is);
            if let Some(node) = self.nodes.get_mut(at) {
                node.wanted = wanted;
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grown(nodes: usize) -> Tree {
        let mut tree = Tree::new();
        tree.allow(nodes);
        tree
    }

    fn paths(tree: &Tree) -> Vec<String> {
        tree.leaves().0.into_iter().map(|leaf| leaf.path).collect()
    }

    #[test]
    fn paths_and_rows_of_selected_leaves() {
        let mut tree = grown(100);
        let fill = |tree: &mut Tree, n: usize| {
            tree.row.fill(f64::NAN);
            let linear = tree.member(Some(0), 0, "linear");
            let x = tree.member(linear, 0, "x");
            tree.number(x, 1.0);
            let velocity = tree.member(Some(0), 1, "velocity");
            let velocity = tree.array(velocity, n);
            for index in 0..n {
                let element = tree.element(velocity, index);
                tree.number(element, 2.0 + index as f64);
            }
            let wheel = tree.joint(Some(0), "left");
            tree.number(wheel, 9.0);
        };
        fill(&mut tree, 1);
        fill(&mut tree, 2);
        assert_eq!(paths(&tree), ["linear.x", "velocity[0]", "velocity[1]", "/left"]);
        let (leaves, _) = tree.leaves();
        let places = tree.select([&leaves[2], &leaves[0], &leaves[2]].into_iter());
        assert_eq!(places, [0, 1, 0]);
        fill(&mut tree, 2);
        assert_eq!(tree.row, [3.0, 1.0]);
        fill(&mut tree, 1);
        assert!(tree.row[0].is_nan());
        assert_eq!(tree.row[1].to_bits(), 1_f64.to_bits());
        assert_eq!(tree.joint(Some(0), "left"), None);
    }

    #[test]
    fn arrays_with_too_many_elements_have_no_leaves() {
        let mut tree = grown(10_000);
        for count in [2, ELEMENTS_MAX + 1, 2] {
            let at = tree.named(Some(0), "ranges");
            let at = tree.array(at, count);
            for index in 0..count {
                let element = tree.element(at, index);
                tree.number(element, 0.0);
            }
        }
        let (leaves, overlong) = tree.leaves();
        assert!(leaves.is_empty());
        assert_eq!(overlong, [("ranges".to_owned(), ELEMENTS_MAX + 1)]);
    }

    #[test]
    fn a_tree_grows_up_to_its_largest_size() {
        let mut tree = grown(2);
        for name in ["a", "b", "c"] {
            let at = tree.named(Some(0), name);
            tree.number(at, 0.0);
        }
        assert!(tree.full && paths(&tree) == ["a", "b"]);
    }
}
