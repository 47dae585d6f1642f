//! Drawings of a page, scaled to its width.

use super::Figure;
use crate::text::{hexadecimal, printable};
use maud::html;
use sha2::{Digest as _, Sha256};

impl Figure {
    /// Returns the SVG scaled to the available width, up to its own, with its alternative text; `attributes` are added
    /// to the `svg` element.
    #[must_use]
    pub fn scaled(&self, attributes: &str) -> String {
        let Some((head, rest)) = self.svg.split_once('>') else { return String::new() };
        let size = |name: &str| {
            let (_, after) = head.split_once(&format!(" {name}=\""))?;
            after.split_once('"').map(|(value, _)| value.to_owned())
        };
        let (width, height) = (size("width").unwrap_or_default(), size("height").unwrap_or_default());
        let name = html! { title { (printable(&self.alternative)) } }.into_string();
        let head =
            head.replacen("<svg ", &format!("<svg {attributes} role=\"img\" viewBox=\"0 0 {width} {height}\" "), 1);
        named(&format!("{head}>{name}{rest}"))
    }
}

/// Prefix of kuva's identifiers of clip paths, which is followed by a number that increases from drawing to drawing.
const CLIP: &str = "kuva-clip-";

/// Replaces the identifiers in a drawing by ones that depend on its content. Equal drawings are then equal texts, and
/// identifiers of different drawings on one page do not collide.
fn named(svg: &str) -> String {
    let mut known = Vec::new();
    let mut parts = svg.split(CLIP);
    let mut counted = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (number, rest) = part.split_at(end);
        let at = known.iter().position(|one| *one == number).unwrap_or(known.len());
        if at == known.len() {
            known.push(number);
        }
        counted += &format!("{CLIP}{at}{rest}");
    }
    let digest = hexadecimal(&Sha256::digest(&counted));
    counted.replace(CLIP, &format!("clip-{}-", &digest[..12]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_have_names_of_their_own() {
        let drawn = |first: u32, width: u32| {
            let (a, b) = (first, first + 1);
            named(&format!(
                "<svg><g id=\"kuva-clip-{a}\"/><g id=\"kuva-clip-{b}\" width=\"{width}\"/><p clip-path=\"url(#kuva-clip-{a})\"/></svg>"
            ))
        };
        // Identifiers do not depend on the running number, even if one number is a prefix of another.
        assert_eq!(drawn(0, 5), drawn(9, 5));
        let (here, other) = (drawn(0, 5), drawn(0, 6));
        let name = |svg: &str| svg.split('"').nth(1).unwrap().to_owned();
        assert_ne!(name(&here), name(&other));
        assert!(here.contains(&format!("url(#{})", name(&here))) && !here.contains("kuva"), "{here}");
        assert_eq!(named("<svg/>"), "<svg/>");
    }
}
