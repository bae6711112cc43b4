//! Licence expressions of packages: SPDX, and the older `A/B` for `A OR B`.

/// Can the terms of `expression` be met with licences that are allowed alone?
///
/// `WITH` binds a licence to its exception, which is one entry of the list; `AND` binds tighter than `OR`.
pub fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    any(&mut rest, allowed) == Some(true) && rest.is_empty()
}

/// `A OR B OR ...`; `None` if the expression is malformed.
fn any(words: &mut &[&str], allowed: &[String]) -> Option<bool> {
    let mut met = all(words, allowed)?;
    while words.first() == Some(&"OR") {
        *words = &words[1..];
        met |= all(words, allowed)?;
    }
    Some(met)
}

/// `A AND B AND ...`.
fn all(words: &mut &[&str], allowed: &[String]) -> Option<bool> {
    let mut met = one(words, allowed)?;
    while words.first() == Some(&"AND") {
        *words = &words[1..];
        met &= one(words, allowed)?;
    }
    Some(met)
}

/// One licence, with its exception if it has one, or an expression in parentheses.
fn one(words: &mut &[&str], allowed: &[String]) -> Option<bool> {
    let (&first, rest) = words.split_first()?;
    *words = rest;
    if first == "(" {
        let met = any(words, allowed)?;
        let (&close, rest) = words.split_first()?;
        *words = rest;
        return (close == ")").then_some(met);
    }
    let name = match *words {
        ["WITH", exception, ..] => format!("{first} WITH {exception}"),
        _ => first.to_owned(),
    };
    if name.contains(" WITH ") {
        *words = &words[2..];
    }
    let is_name = ![")", "OR", "AND", "WITH"].contains(&first);
    is_name.then(|| allowed.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::is_allowed;

    fn allowed(expression: &str) -> bool {
        let list = ["MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "Unicode-3.0"];
        is_allowed(expression, &list.map(str::to_owned))
    }

    #[test]
    fn one_alternative_suffices_and_every_conjunct_is_needed() {
        for yes in [
            "MIT",
            "MIT OR GPL-3.0",
            "GPL-3.0/MIT",
            "(MIT OR GPL-3.0) AND Unicode-3.0",
            "GPL-3.0 AND MIT OR MIT",
        ] {
            assert!(allowed(yes), "{yes}");
        }
        for no in [
            "GPL-3.0",
            "MIT AND GPL-3.0",
            "(MIT OR GPL-3.0) AND Zlib",
            "MIT AND (GPL-3.0 OR Zlib)",
        ] {
            assert!(!allowed(no), "{no}");
        }
    }

    #[test]
    fn an_exception_belongs_to_its_licence() {
        assert!(allowed("Apache-2.0 WITH LLVM-exception"));
        assert!(!allowed("MIT WITH LLVM-exception"));
        assert!(!allowed("GPL-2.0 WITH Classpath-exception-2.0 AND MIT"));
    }

    #[test]
    fn a_malformed_expression_is_not_allowed() {
        for wrong in ["", "MIT OR", "(MIT", "MIT)", "MIT Apache-2.0", "AND MIT"] {
            assert!(!allowed(wrong), "{wrong:?}");
        }
    }
}
