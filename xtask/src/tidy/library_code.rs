//! What library code does not do: print, look at the clock, or let the order of hashes or threads into a result.

use std::collections::BTreeSet;
use std::path::Path;

use super::finding::Finding;

/// Checks one source file of a library.
pub fn library_code(path: &Path, text: &str) -> Vec<Finding> {
    let place = path.display().to_string();
    let code = code_of(text);
    let mut findings = Vec::new();
    for (number, line) in &code {
        for (wrong, why) in NOT_IN_LIBRARIES {
            if has_word(line, wrong) {
                findings.push(Finding::error(format!("{place}:{number}"), format!("`{wrong}`: {why}")));
            }
        }
    }
    findings.extend(hash_order(&place, &code));
    findings.extend(unordered_sums(&place, &code));
    findings
}

/// What libraries do not do.
const NOT_IN_LIBRARIES: [(&str, &str); 15] = [
    ("println!", "libraries print nothing"),
    ("print!", "libraries print nothing"),
    ("eprintln!", "libraries print nothing"),
    ("eprint!", "libraries print nothing"),
    ("dbg!", "libraries print nothing"),
    ("Instant", "libraries do not look at the clock"),
    ("SystemTime", "libraries do not look at the clock"),
    ("thread_rng", "libraries take seeds"),
    ("OsRng", "libraries take seeds"),
    ("SysRng", "libraries take seeds"),
    ("from_os_rng", "libraries take seeds"),
    ("RandomState", "libraries take seeds"),
    ("StdRng", "its stream may change with a version: take ChaCha8Rng"),
    ("SmallRng", "its stream differs between machines: take ChaCha8Rng"),
    ("std::env", "results depend on arguments only"),
];

/// Lines of code with their numbers: without comments, and without the test module at the end.
pub fn code_of(text: &str) -> Vec<(usize, String)> {
    let mut code = Vec::new();
    let mut lines = text.lines().enumerate().peekable();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line == "#[cfg(test)]"
            && lines
                .peek()
                .is_some_and(|(_, next)| next.trim().starts_with("mod ") && next.trim().ends_with('{'))
        {
            break;
        }
        if !line.starts_with("//") {
            code.push((index + 1, line.split(" // ").next().unwrap_or_default().to_owned()));
        }
    }
    code
}

/// Does `word` stand in the line, not as a part of a longer one, nor in a string?
pub fn has_word(line: &str, word: &str) -> bool {
    let of_a_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + word.len()..].chars().next();
        let in_string = line[..at].matches('"').count() % 2 == 1;
        !in_string && !before.is_some_and(of_a_name) && (word.ends_with('!') || !after.is_some_and(of_a_name))
    })
}

/// Loops over a hash map or set, whose order differs from run to run.
fn hash_order(place: &str, code: &[(usize, String)]) -> Vec<Finding> {
    let mut names = BTreeSet::new();
    for (_, line) in code {
        for hash in ["HashMap", "HashSet"] {
            if let Some(at) = line.find(hash) {
                let before = line[..at]
                    .trim_end_matches(|letter: char| !letter.is_whitespace())
                    .trim_end();
                let before = before.trim_end_matches(['=', ':', '&', ' ']).trim_end_matches(" mut");
                let name: String = before
                    .chars()
                    .rev()
                    .take_while(|letter| letter.is_alphanumeric() || *letter == '_')
                    .collect();
                let name: String = name.chars().rev().collect();
                if !name.is_empty() && !["use", "let", "mut", "pub", "fn", "type"].contains(&name.as_str()) {
                    names.insert(name);
                }
            }
        }
    }
    let mut findings = Vec::new();
    for (number, line) in code {
        for name in &names {
            let walks = [
                "iter()",
                "iter_mut()",
                "keys()",
                "values()",
                "values_mut()",
                "into_iter()",
                "drain(",
            ]
            .iter()
            .any(|walk| line.contains(&format!("{name}.{walk}")));
            let loops = [format!(" in {name} {{"), format!(" in &{name} {{")]
                .iter()
                .any(|end| line.contains(end.as_str()));
            if walks || loops {
                findings.push(Finding::error(
                    format!("{place}:{number}"),
                    format!("`{name}` is walked in the order of its hashes"),
                ));
            }
        }
    }
    findings
}

/// Sums of floats over threads: the result would depend on the number of threads.
fn unordered_sums(place: &str, code: &[(usize, String)]) -> Vec<Finding> {
    const PARALLEL: [&str; 4] = ["par_iter()", "into_par_iter()", "par_chunks(", "par_bridge()"];
    const EXACT: [&str; 6] = ["u64", "usize", "u32", "i64", "u128", "bool"];
    let mut findings = Vec::new();
    for (index, (number, line)) in code.iter().enumerate() {
        let Some(start) = PARALLEL.iter().filter_map(|parallel| line.find(parallel)).min() else {
            continue;
        };
        // The rest of the chain, at the depth of the parallel call.
        let rest = line[start..]
            .chars()
            .chain(code[index + 1..].iter().flat_map(|(_, line)| line.chars()))
            .take(4000);
        let (mut depth, mut chain) = (0_i32, String::new());
        for letter in rest {
            match letter {
                '(' | '[' | '{' => depth += 1,
                ')' | ']' | '}' => depth -= 1,
                ';' if depth == 0 => break,
                _ if depth == 0 => chain.push(letter),
                _ => {}
            }
            if depth < 0 {
                break;
            }
        }
        let after = [".sum", ".product", ".reduce", ".fold"].iter().find_map(|step| {
            let (_, after) = chain.split_once(step)?;
            (!after.starts_with("_with") || *step == ".reduce").then_some(after)
        });
        if let Some(after) = after
            && !EXACT.iter().any(|exact| after.starts_with(&format!("::<{exact}>")))
            && !chain.contains(".collect")
        {
            findings.push(Finding::error(
                format!("{place}:{number}"),
                "threads add in any order: collect blocks, then add them in order (or say an integer type: `.sum::<u64>()`)",
            ));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::library_code;
    use std::path::Path;

    fn found(text: &str) -> usize {
        library_code(Path::new("grid/src/a.rs"), text).len()
    }

    #[test]
    fn libraries_are_quiet_and_seeded() {
        assert_eq!(found("/// println!(\"in a doc test\");\nfn f() {} // Instant\n"), 0);
        assert_eq!(found("#[error(\"Instant\")]\n"), 0);
        assert_eq!(found("println!(\"x\");\n"), 1);
        assert_eq!(found("let t = std::time::Instant::now();\n"), 1);
        assert_eq!(found("#[cfg(test)]\nmod tests {\nprintln!(\"x\");\n}\n"), 0);
    }

    #[test]
    fn hash_maps_are_looked_up_not_walked() {
        let code = |line: &str| format!("let mut seen: HashMap<u32, u32> = HashMap::new();\n{line}\n");
        assert_eq!(found(&code("seen.get(&3);")), 0);
        assert_eq!(found(&code("for (k, v) in &seen {")), 1);
        assert_eq!(found(&code("seen.values().sum()")), 1);
        assert_eq!(found("let set = HashSet::new();\nset.iter().max();\n"), 1);
    }

    #[test]
    fn threads_do_not_add_floats() {
        assert_eq!(found("let s: f64 = xs.par_iter().map(|x| x * 2.0).sum();\n"), 1);
        assert_eq!(
            found("let s = xs.par_iter()\n    .map(|x| { x.len() })\n    .sum::<f64>();\n"),
            1
        );
        assert_eq!(found("let n = xs.par_iter().map(|x| x.len()).sum::<usize>();\n"), 0);
        assert_eq!(
            found("let v: Vec<f64> = xs.par_iter().map(|x| x.iter().sum()).collect();\n"),
            0
        );
    }
}
