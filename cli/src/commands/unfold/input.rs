//! INPUT of `unfold`: a table of profiles, or a folder of `segment`; its head, and options that contradict it.

use std::path::{Path, PathBuf};

use stereology::files::profiles::{self, ProfileReading, ProfileRow};
use stereology::files::table_head::{TableHead, TableUnit};
use stereology::grid::LengthUnit;
use stereology::pipeline::Finding;
use stereology_report::significant;

use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};

/// Profiles, and what is known of their section, in the unit of the table.
pub struct Input {
    /// The table.
    pub path: PathBuf,
    /// Its rows.
    pub rows: Vec<ProfileRow>,
    /// What the head of the table states.
    pub head: TableHead,
    /// What was found about its layout.
    pub findings: Vec<Finding>,
}

/// Options that repeat or replace values of the head, in the unit of the table.
#[derive(Clone, Copy, Debug)]
pub struct Given {
    /// --area.
    pub area: Option<f64>,
    /// --min-size.
    pub min_size: Option<f64>,
    /// --edge-rule.
    pub edge_rule: Option<&'static str>,
    /// --window.
    pub window: Option<[f64; 2]>,
}

/// Values that differ by less are the same, in other digits.
const SAME: f64 = 1e-6;

fn differ(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() > SAME
}

/// Whether an option repeats a value of the head.
pub fn repeats(given: Option<f64>, stated: Option<f64>) -> bool {
    matches!((given, stated), (Some(given), Some(stated)) if !differ(given, stated))
}

impl Input {
    /// Reads a table, or `profiles.csv` of a folder.
    pub fn read(path: &Path, reading: &ProfileReading) -> Result<Self, Failure> {
        let path = if path.is_dir() {
            let table = path.join("profiles.csv");
            if !table.is_file() {
                return Err(Failure::run(format!(
                    "{} contains no profiles.csv; give a table of profiles, or a folder written by `stereology segment` or `synthesize`",
                    path.display()
                )));
            }
            table
        } else {
            path.to_owned()
        };
        let table = profiles::read(&path, reading).at(&path)?;
        Ok(Self {
            path,
            rows: table.rows,
            head: table.head,
            findings: table.findings,
        })
    }

    /// Refuses options that contradict the head of the table, and a head that contradicts itself.
    pub fn check(&self, given: &Given) -> Result<(), Failure> {
        let head = &self.head;
        let has_slices = self.rows.iter().any(|row| row.slice.is_some());
        if let (Some(area), Some([width, height]), false) = (head.area, head.window, has_slices)
            && area > width * height * (1.0 + SAME)
        {
            return Err(Failure::run(format!(
                "area={} in the head of {} is larger than width x height = {}; correct the table (area is in the squared unit of the sizes)",
                significant(area),
                self.path.display(),
                significant(width * height)
            )));
        }
        if let (Some(stated), Some(area)) = (head.area, given.area)
            && differ(stated, area)
        {
            return Err(self.contradiction("--area", &significant(area), "area", &significant(stated)));
        }
        // A larger threshold ignores profiles that were measured, which is no contradiction.
        if let (Some(stated), Some(min_size)) = (head.min_size, given.min_size)
            && min_size < stated * (1.0 - SAME)
        {
            return Err(self.contradiction("--min-size", &significant(min_size), "min_size", &significant(stated)));
        }
        if let (Some(stated), Some(rule)) = (&head.edge_rule, given.edge_rule)
            && stated != rule
        {
            return Err(self.contradiction("--edge-rule", rule, "edge_rule", stated));
        }
        if let (Some(stated), Some(window)) = (head.window, given.window)
            && (differ(stated[0], window[0]) || differ(stated[1], window[1]))
        {
            let shown = |sides: [f64; 2]| sides.map(significant).join(",");
            return Err(self.contradiction("--window", &shown(window), "width,height", &shown(stated)));
        }
        Ok(())
    }

    fn contradiction(&self, option: &str, given: &str, key: &str, stated: &str) -> Failure {
        Failure::run(format!(
            "{option} {given} contradicts {key}={stated} in the head of {}; leave the option out, or correct the table",
            self.path.display()
        ))
    }

    /// Area examined, in the squared unit of the table.
    pub fn area(&self, given: Option<f64>) -> Result<f64, Failure> {
        given.or(self.head.area).ok_or_else(|| {
            Failure::usage(format!(
                "{} does not state the area examined; give --area, or begin the table with the line `# area=...`",
                self.path.display()
            ))
        })
    }

    /// The unit of the results; refuses a unit or a scale that contradicts that of the table.
    pub fn unit(&self, everywhere: &Everywhere) -> Result<Option<LengthUnit>, Failure> {
        let refused = |option: String, why: &str| {
            Err(Failure::run(format!(
                "{option} contradicts {}: {why}",
                self.path.display()
            )))
        };
        match (self.head.unit, everywhere.scale_given, everywhere.unit) {
            (TableUnit::Unit(unit), Some(scale), _) => {
                let given = scale.unit.map_or("", LengthUnit::symbol);
                let option = format!("--scale {}{given}", scale.length);
                refused(option, &format!("its lengths are in {unit} already (unit={unit})"))
            }
            (TableUnit::Unit(unit), None, Some(given)) if unit != given => refused(
                format!("--unit {given}"),
                &format!("its lengths are in {unit} (unit={unit})"),
            ),
            (TableUnit::Unit(unit), None, _) => Ok(Some(unit)),
            (TableUnit::Pixels, None, Some(given)) => refused(
                format!("--unit {given}"),
                &format!(
                    "its lengths are in pixels (unit=px); give the length of a pixel with --scale, such as 0.05{given}"
                ),
            ),
            (TableUnit::Pixels | TableUnit::Unknown, _, given) => Ok(given),
        }
    }
}
