//! Comments, documentation and messages: their width, the words they use, and what a library may not name in them.

use std::collections::BTreeSet;
use std::path::Path;
use std::str::FromStr;

use proc_macro2::{TokenStream, TokenTree};

use super::finding::Finding;
use super::tokens::without_tests;

/// Columns that a line with a comment may have.
const WIDEST_COMMENT: usize = 120;

/// Words that the project's English avoids, and what it says in their place.
const AVOIDED: [(&str, &str); 10] = [
    ("how like", "how similar"),
    ("tells", "reports, shows"),
    ("told", "reported, given"),
    ("hang together", "are connected; connected component"),
    ("reckoned", "computed, estimated"),
    ("whoever", "a plain subject"),
    ("windings", "tortuosity"),
    ("shore", "interface"),
    ("hills", "basins, peaks"),
    ("gone on with", "resumed"),
];

/// Comment lines that are too wide. Tables, fenced blocks and single words without a space cannot be broken and pass.
pub fn narrow_comments(path: &Path, text: &str) -> Vec<Finding> {
    let in_strings = lines_inside_strings(text);
    let mut fenced = false;
    let mut findings = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            fenced = false;
            continue;
        };
        let words = comment.trim_start_matches(['/', '!']).trim();
        if words.starts_with("```") {
            fenced = !fenced;
        }
        let width = line.chars().count();
        let is_breakable = !fenced && !words.starts_with('|') && words.contains(' ');
        if width > WIDEST_COMMENT && is_breakable && !in_strings.contains(&(index + 1)) {
            findings.push(Finding::error(
                format!("{}:{}", path.display(), index + 1),
                format!("a comment of {width} columns; break it at {WIDEST_COMMENT}"),
            ));
        }
    }
    findings
}

/// Lines that a string begun on an earlier line goes on in.
fn lines_inside_strings(text: &str) -> BTreeSet<usize> {
    fn walk(tokens: TokenStream, lines: &mut BTreeSet<usize>) {
        for token in tokens {
            match token {
                TokenTree::Group(group) => walk(group.stream(), lines),
                TokenTree::Literal(literal) => {
                    let span = literal.span();
                    lines.extend(span.start().line + 1..=span.end().line);
                }
                _ => {}
            }
        }
    }
    let mut lines = BTreeSet::new();
    if let Ok(tokens) = TokenStream::from_str(text) {
        walk(tokens, &mut lines);
    }
    lines
}

/// Command-line options and commands in a library's messages and documentation: a library knows no program that uses
/// it.
pub fn names_no_options(path: &Path, text: &str) -> Vec<Finding> {
    let Ok(tokens) = without_tests(text) else {
        return Vec::new();
    };
    strings(tokens)
        .into_iter()
        .filter_map(|(line, string)| {
            let named = option_in(&string).or_else(|| command_in(&string))?;
            Some(Finding::error(
                format!("{}:{line}", path.display()),
                format!("`{named}` is the program's; a library names no option and no command"),
            ))
        })
        .collect()
}

/// String literals with their lines; a doc comment is the string of a `doc` attribute.
fn strings(tokens: impl IntoIterator<Item = TokenTree>) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Group(group) => found.extend(strings(group.stream())),
            TokenTree::Literal(literal) => {
                let text = literal.to_string();
                if text.contains('"') {
                    found.push((literal.span().start().line, text));
                }
            }
            _ => {}
        }
    }
    found
}

/// The first `--option` of a text, but those of cargo.
fn option_in(text: &str) -> Option<String> {
    text.lines().filter(|line| !line.contains("cargo ")).find_map(|line| {
        line.match_indices("--").find_map(|(at, _)| {
            let stands_alone = !line[..at].ends_with(|before: char| before.is_alphanumeric() || "-!|".contains(before));
            let name: String = line[at + 2..]
                .chars()
                .take_while(|letter| letter.is_ascii_lowercase() || *letter == '-')
                .collect();
            let is_option = stands_alone && name.starts_with(|first: char| first != '-');
            is_option.then(|| format!("--{name}"))
        })
    })
}

/// A command of the program between backquotes.
fn command_in(text: &str) -> Option<String> {
    let (_, command) = text.split_once("`stereology ")?;
    let (command, _) = command.split_once('`')?;
    Some(format!("stereology {command}"))
}

/// Words of comments, documentation and messages that the project's English avoids.
pub fn plain_words(path: &Path, text: &str) -> Vec<Finding> {
    text.lines()
        .enumerate()
        .flat_map(|(index, line)| {
            let line = line.to_lowercase();
            AVOIDED
                .iter()
                .filter(|(avoided, _)| has_words(&line, avoided))
                .map(|(avoided, better)| {
                    Finding::error(
                        format!("{}:{}", path.display(), index + 1),
                        format!("`{avoided}` is not plain; write {better}"),
                    )
                })
                .collect::<Vec<_>>()
        })
        .collect()
}

fn has_words(line: &str, words: &str) -> bool {
    line.match_indices(words).any(|(at, _)| {
        let of_a_name = |letter: char| letter.is_alphanumeric() || letter == '_';
        !line[..at].ends_with(of_a_name) && !line[at + words.len()..].starts_with(of_a_name)
    })
}

#[cfg(test)]
mod tests {
    use super::{names_no_options, narrow_comments, plain_words};
    use std::path::Path;

    fn count(check: fn(&Path, &str) -> Vec<super::Finding>, text: &str) -> usize {
        check(Path::new("a/src/b.rs"), text).len()
    }

    #[test]
    fn wide_comments_are_found() {
        let wide = "long ".repeat(30);
        assert_eq!(
            count(narrow_comments, &format!("    /// {wide}\nfn f() {{}}\n// {wide}")),
            2
        );
        assert_eq!(
            count(narrow_comments, &format!("//! | {wide} |\n// {}", "x".repeat(130))),
            0
        );
        assert_eq!(
            count(narrow_comments, &format!("const A: &str = \"\n// {wide}\";\n")),
            0
        );
        assert_eq!(count(narrow_comments, &format!("// {}", "é ".repeat(58))), 0);
    }

    #[test]
    fn options_in_libraries_are_found() {
        for wrong in [
            "#[error(\"take a smaller --box\")]\nstruct S;",
            "/// The program's `--edge-rule`.\nstruct S;",
            "const A: &str = \"written by `stereology explore`\";",
        ] {
            assert_eq!(count(names_no_options, wrong), 1, "{wrong}");
        }
        for right in [
            "/// `cargo run --release` -- and a dash.\nfn f() {}",
            "// the program's --box\nfn f(mut i: i32) { i = 3 - --i; }",
            "#[cfg(test)]\nmod tests { const A: &str = \"--box\"; }",
            "/// a -- b, <!-- c -->, |---|--x\nfn f() {}",
        ] {
            assert_eq!(count(names_no_options, right), 0, "{right}");
        }
    }

    #[test]
    fn avoided_words_are_found_whole() {
        assert_eq!(count(plain_words, "// How like the two are, it tells\n"), 2);
        assert_eq!(count(plain_words, "fn told_apart() {} // foothills ashore\n"), 0);
    }
}
