//! Help, exit codes, and what is not built yet.

use crate::stereology;

#[test]
fn help_teaches() {
    for command in [
        "synthesize",
        "segment",
        "kmatrix",
        "unfold",
        "pack",
        "texture",
        "pyramid",
        "slice",
        "render",
        "export",
        "carve",
        "shape",
        "measure",
        "grow",
        "exemplar",
        "contact",
        "displace",
        "explore",
        "schema",
    ] {
        let (code, out, _) = stereology(&[command, "--help"]);
        assert_eq!(code, 0);
        assert!(
            out.contains("Example") && out.contains(&format!("stereology {command} ")) && out.contains("--seed"),
            "{command}:\n{out}"
        );
    }
}

#[test]
fn wrong_usage_exits_2() {
    for wrong in [
        &["nonsense"] as &[_],
        &[],
        &["kmatrix"],
        &["kmatrix", "sphere", "--bins", "0"],
        &["unfold", "a.csv", "--area=nan"],
    ] {
        let (code, out, error) = stereology(wrong);
        assert_eq!((code, out.as_str()), (2, ""), "{wrong:?}");
        assert!(error.len() > 10);
    }
}

#[test]
fn the_manual_is_the_help() {
    let (_, manual, _) = stereology(&["manual"]);
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/cli.md")).unwrap();
    assert!(
        manual == page,
        "docs/cli.md is not what the help says: `cargo run -- manual > docs/cli.md`"
    );
}
