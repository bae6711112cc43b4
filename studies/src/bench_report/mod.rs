//! `cargo xtask bench-report`: our tasks beside the programs in use for them today, timed in one run on one machine.
//!
//! A section is a file in this folder: a function that times some tasks, ours and those of the reference program, and a
//! line in [`SECTIONS`]. The reference program is run by a Python script in the same folder, with the interpreter that
//! `--python` names. If the reference program is not installed, the section states that and has only our times.

mod bench;
mod packing;
mod section_law;
mod solids;
mod textures;

use std::path::Path;

use anyhow::{Context, Result, ensure};

use bench::{Bench, Section};

/// Measures the tasks of a section.
type Measure = fn(&Bench) -> Result<Section>;

/// The sections in the order of the report.
const SECTIONS: [(&str, Measure); 4] = [
    ("Section law", section_law::measure),
    ("Packing", packing::measure),
    ("Textures", textures::measure),
    ("Solids", solids::measure),
];

/// Measures all sections and writes the report; with `only`, measures the section of that title and keeps the text of
/// the others.
pub fn run(document: &Path, python: Option<&Path>, only: Option<&str>) -> Result<()> {
    let titles = SECTIONS.map(|(title, _)| title);
    ensure!(
        only.is_none_or(|only| titles.iter().any(|title| title.eq_ignore_ascii_case(only))),
        "no section has this title; the sections are {}",
        titles.join(", ")
    );
    let bench = Bench::new(python)?;
    let old = match only {
        Some(_) => std::fs::read_to_string(document).with_context(|| document.display().to_string())?,
        None => String::new(),
    };
    let mut text = format!(
        "# Times beside other programs\n\nWritten by `cargo xtask bench-report --python PYTHON`. CPU seconds on one core, the \
         least of several runs, each section in one run on {}; ratios are more portable to other machines than seconds.\n",
        processor()
    );
    for (title, section) in SECTIONS {
        if only.is_none_or(|only| only.eq_ignore_ascii_case(title)) {
            let section = section(&bench)?;
            println!("{title}: {} tasks", section.rows.len());
            text += &markdown(title, &section);
        } else if let Some(kept) = section_of(&old, title) {
            text += kept;
        }
    }
    std::fs::write(document, text).with_context(|| format!("{} cannot be written", document.display()))
}

/// A section of a report, including the empty line before it.
fn section_of<'a>(report: &'a str, title: &str) -> Option<&'a str> {
    let start = report.find(&format!("\n## {title}\n"))?;
    let rest = &report[start..];
    let end = rest[1..].find("\n## ").map_or(rest.len(), |at| at + 1);
    Some(&rest[..end])
}

/// The name of the processor, if the system reports it.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("model name"));
    line.map_or("an unnamed processor", |name| name.trim_start_matches([' ', '\t', ':']))
        .to_owned()
}

fn markdown(title: &str, section: &Section) -> String {
    let (peer, who) = match &section.peer {
        Ok(version) => (version.as_str(), "reference"),
        Err(missing) => (missing.as_str(), "reference"),
    };
    let mut text = format!(
        "\n## {}\n\n{}\n\nReference: {peer}.\n\n| task | ours, s | {who}, s | ratio | |\n|---|---|---|---|---|\n",
        title, section.words
    );
    for row in &section.rows {
        let (seconds, ratio) = match row.peer {
            Some(peer) => (significant(peer), format!("{}×", significant(peer / row.ours))),
            None => ("–".to_owned(), "–".to_owned()),
        };
        text += &format!(
            "| {} | {} | {seconds} | {ratio} | {} |\n",
            row.task,
            significant(row.ours),
            row.remark
        );
    }
    text
}

/// Two significant digits.
fn significant(x: f64) -> String {
    if x <= 0.0 || !x.is_finite() {
        return "0".to_owned();
    }
    let digits = (1.0 - x.log10().floor()).max(0.0);
    let unit = 10.0_f64.powf(1.0 - x.log10().floor());
    format!("{:.*}", digits as usize, (x * unit).round() / unit)
}

#[cfg(test)]
mod tests {
    use super::bench::{Row, Section};
    use super::{markdown, section_of, significant};

    #[test]
    fn numbers_have_two_digits() {
        assert_eq!(
            [0.000_613, 0.0367, 1.24, 12.5, 1234.0].map(significant),
            ["0.00061", "0.037", "1.2", "13", "1200"]
        );
    }

    /// A section kept from an old report is complete and contains nothing else.
    #[test]
    fn sections_are_found() {
        let report = "# T\n\nwords\n\n## A\n\na\n\n## B\n\nb\n";
        assert_eq!(section_of(report, "A"), Some("\n## A\n\na\n"));
        assert_eq!(section_of(report, "B"), Some("\n## B\n\nb\n"));
        assert_eq!(section_of(report, "C"), None);
    }

    /// Without the reference program only our times are reported, with the reason.
    #[test]
    fn a_missing_reference_program_is_reported() {
        let section = |peer, seconds| Section {
            words: "w".to_owned(),
            peer,
            rows: vec![Row {
                task: "cube".to_owned(),
                ours: 0.5,
                peer: seconds,
                remark: String::new(),
            }],
        };
        let alone = markdown(
            "T",
            &section(Err("not measured: no --python was given".to_owned()), None),
        );
        assert!(
            alone.contains("Reference: not measured") && alone.contains("| cube | 0.50 | – | – |"),
            "{alone}"
        );
        let both = markdown("T", &section(Ok("trimesh 4".to_owned()), Some(5.0)));
        assert!(both.contains("| cube | 0.50 | 5.0 | 10× |"), "{both}");
    }
}
