//! File patterns: the paths that match, following symbolic links except in cycles.

use glob::Pattern;
use motorfit_core::file::unreadable;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf, is_separator};

/// Largest number of folders that a pattern visits; links can lead to a folder along more paths than can be listed.
pub(super) const FOLDERS_MAX: usize = 100_000;

/// Component of a pattern, between separators.
enum Part {
    /// Literal name.
    Name(PathBuf),
    /// Pattern of names with `*`, `?` or `[…]`.
    Names(Pattern),
    /// `**`, a folder and all folders below it.
    Below,
}

/// Returns the files that match a pattern relative to a folder, once for each path without cycles that leads to them.
///
/// # Errors
/// Returns a `Data` error if the pattern is invalid, a folder cannot be read, or more than [`FOLDERS_MAX`] folders
/// match.
pub(super) fn matched(pattern: &str, folder: &Path) -> Result<Vec<PathBuf>> {
    let wrong = |error: glob::PatternError| {
        let message = format!("recordings: \"{}\" is not a valid pattern: {}", excerpt(pattern), error.msg);
        Error::data(message, "Use * and ? as wildcards in names.")
    };
    Pattern::new(pattern).map_err(wrong)?;
    let (mut start, mut parts) = (folder.to_path_buf(), Vec::new());
    for component in Path::new(pattern).components() {
        let name = component.as_os_str().to_str().unwrap_or_default();
        match component {
            Component::Prefix(_) | Component::RootDir => start.push(component),
            _ if name == "**" => parts.push(Part::Below),
            _ if name.contains(['*', '?', '[']) => parts.push(Part::Names(Pattern::new(name).map_err(wrong)?)),
            _ => parts.push(Part::Name(PathBuf::from(name))),
        }
    }
    parts.dedup_by(|a, b| matches!((a, b), (Part::Below, Part::Below)));
    let mut walk = Walk { folders: 0, found: Vec::new() };
    // A pattern that ends with a separator matches folders only.
    if !pattern.ends_with(is_separator) {
        walk.follow(&start, &parts)?;
    }
    Ok(walk.found)
}

/// State of a search: the number of folders visited and the files found.
struct Walk {
    folders: usize,
    found: Vec<PathBuf>,
}

impl Walk {
    /// Matches the components of a pattern below a path.
    fn follow(&mut self, at: &Path, parts: &[Part]) -> Result<()> {
        match parts.split_first() {
            None if at.is_file() => self.found.push(at.to_path_buf()),
            None => {}
            Some((Part::Name(name), rest)) => self.follow(&at.join(name), rest)?,
            Some((Part::Names(names), rest)) => {
                for (path, is_folder) in self.entries(at)? {
                    let is_match = path.file_name().and_then(|name| name.to_str()).is_some_and(|n| names.matches(n));
                    if is_match && (rest.is_empty() || is_folder) {
                        self.follow(&path, rest)?;
                    }
                }
            }
            Some((Part::Below, rest)) => self.descend(at, rest, &mut Vec::new())?,
        }
        Ok(())
    }

    /// Matches the components below a folder and every folder below it, except folders that are their own ancestors
    /// (`above`).
    fn descend(&mut self, at: &Path, parts: &[Part], above: &mut Vec<PathBuf>) -> Result<()> {
        let Some(own) = existing(at, at.canonicalize())?.filter(|own| !above.contains(own)) else { return Ok(()) };
        self.follow(at, parts)?;
        above.push(own);
        for (path, _) in self.entries(at)?.into_iter().filter(|(_, is_folder)| *is_folder) {
            self.descend(&path, parts, above)?;
        }
        above.pop();
        Ok(())
    }

    /// Returns the paths in a folder, each with true if it is a folder itself; none if the folder does not exist.
    fn entries(&mut self, folder: &Path) -> Result<Vec<(PathBuf, bool)>> {
        if !existing(folder, std::fs::metadata(folder))?.is_some_and(|facts| facts.is_dir()) {
            return Ok(Vec::new());
        }
        self.folders += 1;
        if self.folders > FOLDERS_MAX {
            let message = format!("a pattern visits more than {FOLDERS_MAX} folders");
            return Err(
                Error::data(message, "Name the folders explicitly, or remove links between them.").in_file(folder)
            );
        }
        let failed = |error: std::io::Error| unreadable(folder, &error);
        let entry = |entry: std::io::Result<std::fs::DirEntry>| {
            let (entry, path) = entry.map(|entry| (entry.file_type(), entry.path())).map_err(failed)?;
            let is_folder = entry.is_ok_and(|kind| kind.is_dir() || (kind.is_symlink() && path.is_dir()));
            Ok((path, is_folder))
        };
        std::fs::read_dir(folder).map_err(failed)?.map(entry).collect()
    }
}

/// Converts the result of a query about a path, `None` if nothing exists there. A path that cannot be read must not be
/// skipped silently.
fn existing<T>(path: &Path, result: std::io::Result<T>) -> Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
        Err(error) => Err(unreadable(path, &error)),
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir_all, write};
    use std::os::unix::fs::symlink;

    fn names(pattern: &str, folder: &Path) -> Vec<String> {
        let found = matched(pattern, folder).unwrap();
        let mut names: Vec<String> =
            found.iter().map(|path| path.strip_prefix(folder).unwrap().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn tree() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        create_dir_all(root.join("line/one/deep")).unwrap();
        create_dir_all(root.join("line/[two]")).unwrap();
        for file in ["a.csv", "line/b.csv", "line/one/c.csv", "line/one/deep/d.csv", "line/[two]/e.csv", "line/.f.csv"]
        {
            write(root.join(file), "").unwrap();
        }
        folder
    }

    #[test]
    fn patterns_match_those_of_the_glob_library() {
        let folder = tree();
        let root = folder.path();
        symlink(root.join("line/one"), root.join("linked")).unwrap();
        symlink(root.join("nowhere"), root.join("broken.csv")).unwrap();
        for pattern in [
            "*.csv",
            "*",
            "line/*.csv",
            "line/*/*.csv",
            "**/*.csv",
            "line/**/d.csv",
            "**/deep/*",
            "**",
            "linked/*.csv",
            "l*/**/*.csv",
            "./line/./*.csv",
            "line/../*.csv",
            "line/[[]two]/?.csv",
            "*/",
            "no/*.csv",
            "**/**/d.csv",
            "line/one/c.csv",
            "line/o?e/[a-c].csv",
            "linked/**/*.csv",
        ] {
            let expected = glob::glob(&format!("{}/{pattern}", root.display())).unwrap().map(|path| path.unwrap());
            let expected = expected.filter(|path| path.is_file());
            let shown = |path: PathBuf| path.components().collect::<PathBuf>().strip_prefix(root).unwrap().to_owned();
            let mut expected: Vec<String> = expected.map(|path| shown(path).to_string_lossy().into_owned()).collect();
            expected.sort();
            assert_eq!(names(pattern, root), expected, "{pattern}");
        }
        let absolute = format!("{}/line/*.csv", root.display());
        assert_eq!(names(&absolute, root), ["line/.f.csv", "line/b.csv"]);
        for wrong in ["***", "a**/b", "[a"] {
            assert!(matched(wrong, root).unwrap_err().to_string().contains("is not a valid pattern"), "{wrong}");
        }
    }

    #[test]
    fn links_in_circles_end() {
        let folder = tree();
        let root = folder.path();
        let all = names("**/*.csv", root);
        assert_eq!(all.len(), 6);
        // With two links and the 40 that a system follows there are 2^40 paths.
        symlink(root, root.join("line/one/around")).unwrap();
        symlink(root.join("line"), root.join("line/one/deep/again")).unwrap();
        assert_eq!(names("**/*.csv", root), all);
        assert_eq!(names("line/**/*.csv", root).len(), all.len());
        // Literal names still follow links.
        assert_eq!(names("line/one/around/*.csv", root), ["line/one/around/a.csv"]);
        // These links lead to one folder along many paths without a cycle.
        for n in 0..30 {
            create_dir_all(root.join(format!("many/{n}"))).unwrap();
        }
        for (n, name) in (0..29).flat_map(|n| [(n, "x"), (n, "y")]) {
            symlink(root.join(format!("many/{}", n + 1)), root.join(format!("many/{n}/{name}"))).unwrap();
        }
        let error = matched("many/0/**/*.csv", root).unwrap_err();
        assert!(error.to_string().contains("more than 100000 folders"), "{error}");
    }
}
