//! The modules of a crate as its source files declare them: their items, their imports and the paths they mention.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::TokenTree;

use super::tokens::{is_for_tests, is_punct, items, visibility, without_tests, word};

/// A path such as `crate::certificate::certify`, segment by segment.
pub type Names = Vec<String>;

/// One name that a `use` declaration brings into a module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Import {
    /// Path as written.
    pub path: Names,
    /// Name under which it is known here; `None` for a glob import.
    pub name: Option<String>,
}

/// One module: a file, or an inline `mod name { ... }`.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// File that holds the module, relative to the crate.
    pub file: PathBuf,
    /// Names of functions, types, traits, constants and macros defined here.
    pub items: BTreeSet<String>,
    /// `use` declarations.
    pub imports: Vec<Import>,
    /// Paths of two or more segments outside `use` declarations.
    pub paths: BTreeSet<Names>,
    /// Every identifier outside `use` declarations.
    pub identifiers: BTreeSet<String>,
}

/// All modules of a crate by their path from the crate's root; the root's own path is empty. Test modules are left out.
pub type ModuleTree = BTreeMap<Names, Module>;

/// Reads the modules that `root` (`src/lib.rs` or `src/main.rs`) declares. `read` returns the text of a file, if it
/// exists.
///
/// # Errors
///
/// A message that names the file, if it cannot be split into tokens or a declared module has no file.
pub fn module_tree(root: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Result<ModuleTree, String> {
    let mut tree = ModuleTree::new();
    let folder = root.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut files = vec![(Names::new(), root.to_path_buf(), folder)];
    while let Some((module, file, folder)) = files.pop() {
        let text = read(&file).ok_or_else(|| format!("{}: no such file", file.display()))?;
        let tokens = without_tests(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        let mut declared = Vec::new();
        scan_module(&tokens, &module, &file, &mut tree, &mut declared);
        for child in declared {
            // Inline modules stand between this file's module and the declared one.
            let inside: PathBuf = child[module.len()..].iter().collect();
            let flat = folder.join(&inside).with_extension("rs");
            let nested = folder.join(&inside).join("mod.rs");
            let path = if read(&flat).is_some() { flat } else { nested };
            let folder = folder.join(inside);
            files.push((child, path, folder));
        }
    }
    Ok(tree)
}

/// Scans the items of one module; modules that have a file of their own are added to `declared`.
fn scan_module(tokens: &[TokenTree], module: &Names, file: &Path, tree: &mut ModuleTree, declared: &mut Vec<Names>) {
    let mut found = Module {
        file: file.to_path_buf(),
        ..Module::default()
    };
    for (attributes, item) in items(tokens) {
        if attributes.iter().any(is_for_tests) {
            continue;
        }
        scan_code(&attributes, &mut found);
        let declaration = visibility(&item);
        match (word(declaration, 0).as_deref(), word(declaration, 1)) {
            (Some("use"), _) => imports(&declaration[1..], &Names::new(), &mut found.imports),
            (Some("mod"), Some(name)) => {
                let mut child = module.clone();
                child.push(name);
                match declaration.get(2) {
                    Some(TokenTree::Group(body)) => {
                        let inside: Vec<TokenTree> = body.stream().into_iter().collect();
                        scan_module(&inside, &child, file, tree, declared);
                    }
                    _ => declared.push(child),
                }
            }
            _ => {
                found.items.extend(defined_name(declaration));
                scan_code(&item, &mut found);
            }
        }
    }
    tree.insert(module.clone(), found);
}

/// Name of the function, type, trait, constant or macro that an item defines.
fn defined_name(item: &[TokenTree]) -> Option<String> {
    const KINDS: [&str; 8] = ["fn", "struct", "enum", "union", "trait", "type", "const", "static"];
    for (index, token) in item.iter().enumerate() {
        let TokenTree::Ident(token) = token else { return None };
        let kind = token.to_string();
        let next = word(item, index + 1);
        match kind.as_str() {
            "macro_rules" => return word(item, index + 2),
            "impl" => return None,
            "const" if matches!(next.as_deref(), Some("fn" | "async" | "unsafe" | "extern")) => {}
            "static" if next.as_deref() == Some("mut") => return word(item, index + 2),
            kind if KINDS.contains(&kind) => return next,
            _ => {}
        }
    }
    None
}

/// Adds the names of one `use` declaration; `prefix` is what stands before a group in braces.
fn imports(tokens: &[TokenTree], prefix: &Names, found: &mut Vec<Import>) {
    for one in tokens.split(|token| is_punct(token, ',') || is_punct(token, ';')) {
        let mut path = prefix.clone();
        let mut name = None;
        let mut rest = one.iter();
        let mut group = false;
        while let Some(token) = rest.next() {
            match token {
                TokenTree::Ident(word) if *word == "as" => name = rest.next().map(ToString::to_string),
                TokenTree::Ident(word) => path.push(word.to_string()),
                TokenTree::Group(inside) => {
                    let inside: Vec<TokenTree> = inside.stream().into_iter().collect();
                    imports(&inside, &path, found);
                    group = true;
                }
                TokenTree::Punct(star) if star.as_char() == '*' => {
                    found.push(Import {
                        path: path.clone(),
                        name: None,
                    });
                    group = true;
                }
                _ => {}
            }
        }
        if group || path.len() == prefix.len() {
            continue;
        }
        if path.last().is_some_and(|last| last == "self") && path.len() > 1 {
            path.pop();
        }
        let name = name.or_else(|| path.last().cloned());
        found.push(Import { path, name });
    }
}

/// Collects identifiers and paths, also inside bodies and macros. `use` declarations inside functions count as imports.
fn scan_code(tokens: &[TokenTree], found: &mut Module) {
    let mut index = 0;
    while index < tokens.len() {
        match &tokens[index] {
            TokenTree::Group(body) => {
                let inside: Vec<TokenTree> = body.stream().into_iter().collect();
                scan_code(&inside, found);
                index += 1;
            }
            TokenTree::Ident(first) if *first == "use" => {
                let end = (index..tokens.len())
                    .find(|&at| is_punct(&tokens[at], ';'))
                    .unwrap_or(tokens.len());
                imports(&tokens[index + 1..end], &Names::new(), &mut found.imports);
                index = end;
            }
            TokenTree::Ident(first) => {
                let mut path = vec![first.to_string()];
                index += 1;
                while let [a, b, TokenTree::Ident(next), ..] = &tokens[index..] {
                    if !is_punct(a, ':') || !is_punct(b, ':') {
                        break;
                    }
                    path.push(next.to_string());
                    index += 3;
                }
                found.identifiers.insert(path[0].clone());
                if path.len() > 1 {
                    found.paths.insert(path);
                }
            }
            _ => index += 1,
        }
    }
}
