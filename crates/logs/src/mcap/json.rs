//! Messages in JSON.

use super::cdr::Fault;
use super::limits::{DEPTH_MAX, ELEMENTS_MAX};
use super::tree::{At, Tree};
use motorfit_core::numeric::{count_u64, real};
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Reads the numbers of a message into the row of a tree; truth values are 0 and 1.
///
/// # Errors
/// Returns a fault if the message is not a JSON value; the numbers before the fault are in the row.
pub(super) fn read(message: &[u8], tree: &mut Tree) -> Result<(), Fault> {
    let mut deserializer = serde_json::Deserializer::from_slice(message);
    let value = Value { tree, at: Some(0), depth: 0 };
    value.deserialize(&mut deserializer).and_then(|()| deserializer.end()).map_err(|_| Fault::Json)
}

/// A value of a message at a node of the tree.
struct Value<'a> {
    tree: &'a mut Tree,
    at: At,
    depth: usize,
}

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        match self.at {
            Some(_) if self.depth < DEPTH_MAX => deserializer.deserialize_any(self),
            _ => deserializer.deserialize_ignored_any(IgnoredAny).map(|_| ()),
        }
    }
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        self.tree.number(self.at, value);
        Ok(())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.visit_f64(count_u64(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        self.visit_f64(real(value))
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<(), E> {
        self.visit_f64(f64::from(u8::from(value)))
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(at) = map.next_key_seed(Key { tree: &mut *self.tree, at: self.at })? {
            map.next_value_seed(Value { tree: &mut *self.tree, at, depth: self.depth + 1 })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<(), A::Error> {
        let array = self.tree.array(self.at, 0);
        let mut count = 0;
        loop {
            let at = if count < ELEMENTS_MAX { self.tree.element(array, count) } else { None };
            if elements.next_element_seed(Value { tree: &mut *self.tree, at, depth: self.depth + 1 })?.is_none() {
                break;
            }
            count += 1;
        }
        self.tree.array(self.at, count);
        Ok(())
    }
}

/// A name of a member of the object at a node; its value is the node of the member.
struct Key<'a> {
    tree: &'a mut Tree,
    at: At,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = At;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<At, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl Visitor<'_> for Key<'_> {
    type Value = At;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a name")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<At, E> {
        Ok(self.tree.named(self.at, name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(messages: &[&str]) -> (Vec<String>, Vec<Result<(), Fault>>) {
        let mut tree = Tree::new();
        tree.allow(1000);
        let read = messages.iter().map(|message| read(message.as_bytes(), &mut tree)).collect();
        (tree.leaves().0.into_iter().map(|leaf| leaf.path).collect(), read)
    }

    #[test]
    fn numbers_by_path() {
        let message = r#"{"a": {"b": [1, -2.5, "x"], "on": true}, "t": "1", "none": null, "é\n": 3}"#;
        let (found, read) = paths(&[message, r#"{"a": {"b": [1, 2, 3, {"c": 1}], "d": 1}}"#]);
        assert_eq!(found, ["a.b[0]", "a.b[1]", "a.b[2]", "a.b[3].c", "a.on", "a.d", "é\n"]);
        assert_eq!(read, [Ok(()), Ok(())]);
        assert_eq!(paths(&["3.5"]).0, [""]);
        assert_eq!(paths(&["[[1], [2, 3]]"]).0, ["[0][0]", "[1][0]", "[1][1]"]);
    }

    #[test]
    fn depth_and_length_are_limited() {
        let nested = |depth: usize| format!("{}1{}", r#"{"a":"#.repeat(depth), "}".repeat(depth));
        assert_eq!(paths(&[&nested(DEPTH_MAX - 1)]).0.len(), 1);
        assert_eq!(paths(&[&nested(DEPTH_MAX)]), (vec![], vec![Ok(())]));
        assert_eq!(paths(&[&format!("{}{}", "[".repeat(100_000), "]".repeat(100_000))]).1, [Ok(())]);
        assert_eq!(paths(&[&format!("[{}0]", "0,".repeat(ELEMENTS_MAX - 1))]).0.len(), ELEMENTS_MAX);
        assert_eq!(paths(&[&format!("[{}0]", "0,".repeat(ELEMENTS_MAX))]).0.len(), 0);
    }

    #[test]
    fn what_is_not_json_is_a_fault() {
        for text in ["", "{", "{\"a\": NaN}", "1 2", "{\"a\": 1,}"] {
            assert_eq!(paths(&[text]).1, [Err(Fault::Json)], "{text}");
        }
    }
}
