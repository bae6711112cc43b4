//! Rust source as tokens, without what is compiled for tests only.

use std::str::FromStr;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Tokens of a file. Test items (`#[cfg(test)]`, `#[test]`) are left out, also inside inline modules.
///
/// # Errors
///
/// If the text is not Rust.
pub fn without_tests(text: &str) -> Result<Vec<TokenTree>, String> {
    let tokens = TokenStream::from_str(text).map_err(|error| error.to_string())?;
    let mut kept = Vec::new();
    for (attributes, item) in items(&tokens.into_iter().collect::<Vec<_>>()) {
        if !attributes.iter().any(is_for_tests) {
            kept.extend(attributes);
            kept.extend(item);
        }
    }
    Ok(kept)
}

/// The items of a module: outer attributes, and the tokens from the visibility to the final `;` or the body in braces.
pub fn items(tokens: &[TokenTree]) -> Vec<(Vec<TokenTree>, Vec<TokenTree>)> {
    let mut found = Vec::new();
    let mut rest = tokens;
    while !rest.is_empty() {
        let (attributes, after) = attributes(rest);
        let (item, after) = item(after);
        found.push((attributes.to_vec(), item.to_vec()));
        rest = after;
    }
    found
}

/// Splits attributes, inner ones too, off the front.
fn attributes(tokens: &[TokenTree]) -> (&[TokenTree], &[TokenTree]) {
    let mut end = 0;
    loop {
        end += match &tokens[end..] {
            [hash, TokenTree::Group(body), ..] if is_punct(hash, '#') && body.delimiter() == Delimiter::Bracket => 2,
            [hash, bang, TokenTree::Group(body), ..]
                if is_punct(hash, '#') && is_punct(bang, '!') && body.delimiter() == Delimiter::Bracket =>
            {
                3
            }
            _ => return tokens.split_at(end),
        };
    }
}

/// Splits one item off the front.
fn item(tokens: &[TokenTree]) -> (&[TokenTree], &[TokenTree]) {
    let declared = visibility(tokens);
    // Braces inside `use a::{b, c};` and `const A: B = B { c: 1 };` do not end the item.
    let ends_with_semicolon = match word(declared, 0).as_deref() {
        Some("use" | "static" | "type") => true,
        Some("const") => !matches!(word(declared, 1).as_deref(), Some("fn" | "async" | "unsafe" | "extern")),
        _ => false,
    };
    let end = tokens
        .iter()
        .position(|token| match token {
            TokenTree::Group(body) => body.delimiter() == Delimiter::Brace && !ends_with_semicolon,
            token => is_punct(token, ';'),
        })
        .map_or(tokens.len(), |at| at + 1);
    tokens.split_at(end)
}

/// Is the attribute `#[test]`, `#[cfg(test)]` or a longer condition that holds in tests only?
pub fn is_for_tests(attribute: &TokenTree) -> bool {
    let TokenTree::Group(attribute) = attribute else {
        return false;
    };
    let text: String = attribute.stream().to_string().split_whitespace().collect();
    text == "test" || text == "cfg(test)" || text.starts_with("cfg(all(test,")
}

/// What follows `pub` or `pub(...)`.
pub fn visibility(tokens: &[TokenTree]) -> &[TokenTree] {
    match tokens {
        [TokenTree::Ident(word), TokenTree::Group(scope), ..]
            if *word == "pub" && scope.delimiter() == Delimiter::Parenthesis =>
        {
            &tokens[2..]
        }
        [TokenTree::Ident(word), ..] if *word == "pub" => &tokens[1..],
        _ => tokens,
    }
}

/// Is the token this character of punctuation?
pub fn is_punct(token: &TokenTree, character: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == character)
}

/// The identifier or keyword at `index`.
pub fn word(tokens: &[TokenTree], index: usize) -> Option<String> {
    match tokens.get(index) {
        Some(TokenTree::Ident(word)) => Some(word.to_string()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::without_tests;

    /// What is left of a file, without white space.
    fn kept(text: &str) -> String {
        let tokens = without_tests(text).unwrap().into_iter().map(|token| token.to_string());
        tokens.collect::<String>().split_whitespace().collect()
    }

    #[test]
    fn items_for_tests_are_left_out() {
        assert_eq!(kept("#[cfg(test)]\nmod tests { use a::b; }\nfn f() {}"), "fnf(){}");
        assert_eq!(
            kept("#[cfg(all(test, feature = \"io\"))]\nuse a::{b, c};\nstruct S;"),
            "structS;"
        );
        assert_eq!(kept("#[cfg(not(test))]\nstruct S;"), "#[cfg(not(test))]structS;");
    }

    #[test]
    fn items_end_where_rust_ends_them() {
        assert_eq!(
            kept("#[cfg(test)]\nconst A: B = B { c: 1 };\nstatic D: u8 = 1;"),
            "staticD:u8=1;"
        );
        assert_eq!(kept("#[cfg(test)]\nconst fn f() -> u8 { 1 }\nstruct S;"), "structS;");
    }

    #[test]
    fn comments_and_strings_hold_no_code() {
        assert_eq!(
            kept("// use crate::a;\n/* use crate::b; */\nconst A: &str = \"use crate::c;\";"),
            "constA:&str=\"usecrate::c;\";"
        );
    }
}
