//! Files of a crate that import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::finding::Finding;
use super::module_tree::{Import, ModuleTree, Names, module_tree};

/// Which files each file imports, and the names by which it does.
type FileImports = BTreeMap<PathBuf, BTreeMap<PathBuf, BTreeSet<String>>>;

/// Re-exports of each other would be followed without end.
const LONGEST_CHAIN: usize = 16;

/// Where a path ends.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Target {
    /// A module itself.
    Module(Names),
    /// An item, by the file that defines it.
    Item(PathBuf, String),
}

/// Circles of imports in the crate in `folder`; `read` returns the text of a file of the crate, if it exists.
pub fn import_circles(folder: &str, read: &dyn Fn(&Path) -> Option<String>) -> Vec<Finding> {
    let root = ["src/lib.rs", "src/main.rs"]
        .into_iter()
        .find(|root| read(Path::new(root)).is_some());
    let Some(root) = root else {
        return Vec::new();
    };
    let imports = match file_imports(Path::new(root), read) {
        Ok(imports) => imports,
        Err(message) => return vec![Finding::error(folder, message)],
    };
    circles(&imports)
        .iter()
        .map(|group| Finding::error(folder, described(group, &imports)))
        .collect()
}

/// The files of a circle, and each import between them with the names it takes.
fn described(group: &BTreeSet<PathBuf>, imports: &FileImports) -> String {
    let mut message = "files import each other in a circle; move the shared items to the lower file:".to_owned();
    for file in group {
        for (other, names) in imports.get(file).into_iter().flatten() {
            if group.contains(other) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                message += &format!(
                    "\n             {} takes {} from {}",
                    file.display(),
                    names.join(", "),
                    other.display()
                );
            }
        }
    }
    message
}

/// Imports between the files of the crate whose root module is `root`.
///
/// A name counts as imported from the file that defines it, whichever re-exports it came through; a re-export that its
/// own file does not use is no import.
///
/// # Errors
///
/// As of [`module_tree`].
fn file_imports(root: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Result<FileImports, String> {
    let tree = module_tree(root, read)?;
    let mut found = FileImports::new();
    for (here, module) in &tree {
        let mut targets = Vec::new();
        for import in &module.imports {
            match &import.name {
                Some(name) if module.identifiers.contains(name) || name == "_" => {
                    targets.extend(resolve(&tree, here, &import.path, 0));
                }
                Some(_) => {}
                // A glob imports those names of the other module that occur here.
                None => {
                    if let Some(Target::Module(other)) = resolve(&tree, here, &import.path, 0) {
                        targets.extend(
                            module
                                .identifiers
                                .iter()
                                .filter_map(|name| look_up(&tree, &other, name, 0)),
                        );
                    }
                }
            }
        }
        targets.extend(module.paths.iter().filter_map(|path| resolve(&tree, here, path, 0)));
        let from = found.entry(module.file.clone()).or_default();
        for target in targets {
            if let Target::Item(file, name) = target
                && file != module.file
            {
                from.entry(file).or_default().insert(name);
            }
        }
    }
    Ok(found)
}

/// Follows a path from the module `here`; `None` if it leads out of the crate.
fn resolve(tree: &ModuleTree, here: &Names, path: &[String], depth: usize) -> Option<Target> {
    if depth > LONGEST_CHAIN {
        return None;
    }
    let mut at = Target::Module(here.clone());
    for (index, segment) in path.iter().enumerate() {
        let Target::Module(module) = &at else { break };
        at = match segment.as_str() {
            "crate" => Target::Module(Names::new()),
            "self" => Target::Module(module.clone()),
            "super" => Target::Module(module[..module.len().checked_sub(1)?].to_vec()),
            name => match look_up(tree, module, name, depth) {
                Some(target) => target,
                None if index == 0 => return None, // another crate, or a name of the language
                None => Target::Item(tree.get(module)?.file.clone(), name.to_owned()),
            },
        };
    }
    Some(at)
}

/// What `name` means inside `module`: a child module, an item or an import.
fn look_up(tree: &ModuleTree, module: &Names, name: &str, depth: usize) -> Option<Target> {
    let mut child = module.clone();
    child.push(name.to_owned());
    if tree.contains_key(&child) {
        return Some(Target::Module(child));
    }
    let found = tree.get(module)?;
    if found.items.contains(name) {
        return Some(Target::Item(found.file.clone(), name.to_owned()));
    }
    // `use rand::Rng` does not make `rand` a name of this module.
    let foreign = |import: &&Import| import.path.first().is_some_and(|first| first == name);
    let (named, globs): (Vec<_>, Vec<_>) = found.imports.iter().partition(|import| import.name.is_some());
    named
        .into_iter()
        .filter(|import| import.name.as_deref() == Some(name) && !foreign(import))
        .find_map(|import| resolve(tree, module, &import.path, depth + 1))
        .or_else(|| {
            // Only globs of our own modules that start at a keyword or a child module are followed.
            globs
                .into_iter()
                .filter(|import| is_local(tree, module, &import.path))
                .find_map(|import| match resolve(tree, module, &import.path, depth + 1)? {
                    Target::Module(other) if other != *module => look_up(tree, &other, name, depth + 1),
                    _ => None,
                })
        })
}

/// Does the path start at a keyword or a child module?
fn is_local(tree: &ModuleTree, module: &Names, path: &[String]) -> bool {
    path.first().is_some_and(|first| {
        let child = [module.as_slice(), std::slice::from_ref(first)].concat();
        ["crate", "self", "super"].contains(&first.as_str()) || tree.contains_key(&child)
    })
}

/// Groups of files each of which reaches every other of its group through imports.
fn circles(imports: &FileImports) -> Vec<BTreeSet<PathBuf>> {
    let reached: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = imports
        .keys()
        .map(|start| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(file) = open.pop() {
                for next in imports.get(file).into_iter().flat_map(BTreeMap::keys) {
                    if seen.insert(next) {
                        open.push(next);
                    }
                }
            }
            (start, seen)
        })
        .collect();
    let mut groups = BTreeSet::new();
    for (start, seen) in &reached {
        let group: BTreeSet<PathBuf> = seen
            .iter()
            .filter(|other| reached.get(**other).is_some_and(|back| back.contains(start)))
            .map(|file| (*file).clone())
            .collect();
        if !group.is_empty() {
            groups.insert(group);
        }
    }
    groups.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::{file_imports, import_circles};
    use std::path::Path;

    fn read<'a>(files: &'a [(&'a str, &'a str)]) -> impl Fn(&Path) -> Option<String> + 'a {
        |path| {
            files
                .iter()
                .find(|(name, _)| Path::new(name) == path)
                .map(|(_, text)| (*text).to_owned())
        }
    }

    fn circles(files: &[(&str, &str)]) -> usize {
        import_circles("a", &read(files)).len()
    }

    /// The crate's root only re-exports, so a name imported through it comes from its own file.
    #[test]
    fn names_come_from_the_file_that_defines_them() {
        let root = (
            "src/lib.rs",
            "mod low;\nmod high;\npub use low::Low;\npub use high::High;",
        );
        let high = ("src/high.rs", "use crate::Low;\npub struct High(Low);");
        assert_eq!(circles(&[root, high, ("src/low.rs", "pub struct Low;")]), 0);
        assert_eq!(
            circles(&[
                root,
                high,
                ("src/low.rs", "use crate::High;\npub struct Low(Box<High>);")
            ]),
            1
        );
        let imports = file_imports(
            Path::new("src/lib.rs"),
            &read(&[root, high, ("src/low.rs", "pub struct Low;")]),
        );
        let from_high = &imports.unwrap()[Path::new("src/high.rs")];
        assert_eq!(from_high.keys().collect::<Vec<_>>(), [Path::new("src/low.rs")]);
    }

    #[test]
    fn paths_in_code_and_in_macros_count() {
        let root = ("src/lib.rs", "mod a;\nmod b;");
        let b = ("src/b.rs", "pub fn g() -> u8 { crate::a::f() }");
        assert_eq!(circles(&[root, b, ("src/a.rs", "pub fn f() -> u8 { 1 }")]), 0);
        assert_eq!(
            circles(&[
                root,
                b,
                ("src/a.rs", "pub fn f() -> u8 { assert!(super::b::g() > 0); 1 }")
            ]),
            1
        );
        assert_eq!(
            circles(&[root, b, ("src/a.rs", "use crate::b;\npub fn f() -> u8 { b::g() }")]),
            1
        );
        assert_eq!(
            circles(&[root, b, ("src/a.rs", "use crate::b::*;\npub fn f() -> u8 { g() }")]),
            1
        );
    }

    #[test]
    fn tests_comments_and_strings_do_not_count() {
        let root = ("src/lib.rs", "mod a;\nmod b;");
        let b = ("src/b.rs", "pub fn g() -> u8 { crate::a::f() }");
        let harmless = [
            "/// As [`crate::b::g`].\npub fn f() -> u8 { 1 }",
            "pub fn f() -> u8 { 1 } // crate::b::g()",
            "pub fn f() -> usize { \"crate::b::g()\".len() }",
            "pub fn f() -> u8 { 1 }\n#[cfg(test)]\nmod tests { use crate::b::g; }",
        ];
        for a in harmless {
            assert_eq!(circles(&[root, b, ("src/a.rs", a)]), 0, "{a}");
        }
    }

    /// A parent that does work of its own and its child may not import each other; one that only re-exports may.
    #[test]
    fn parents_and_children_are_files_like_others() {
        let root = ("src/lib.rs", "mod a;");
        let child = ("src/a/b.rs", "use super::LIMIT;\npub fn g() -> u8 { LIMIT }");
        let works = "mod b;\nconst LIMIT: u8 = 1;\npub fn f() -> u8 { b::g() }";
        assert_eq!(circles(&[root, child, ("src/a/mod.rs", works)]), 1);
        assert_eq!(circles(&[root, child, ("src/a.rs", works)]), 1);
        let exports = "mod b;\nmod c;\npub use b::g;\npub use c::LIMIT;";
        let c = ("src/a/c.rs", "pub const LIMIT: u8 = 1;");
        assert_eq!(circles(&[root, child, c, ("src/a/mod.rs", exports)]), 0);
    }

    #[test]
    fn longer_circles_are_found_once() {
        let files = [
            ("src/lib.rs", "mod a;\nmod b;\nmod c;"),
            ("src/a.rs", "pub fn f() { crate::b::f() }"),
            ("src/b.rs", "pub fn f() { crate::c::f() }"),
            ("src/c.rs", "pub fn f() { crate::a::f() }"),
        ];
        let findings = import_circles("x", &read(&files));
        assert_eq!(findings.len(), 1);
        assert!(findings[0].fatal && findings[0].message.contains("src/c.rs takes f from src/a.rs"));
    }
}
