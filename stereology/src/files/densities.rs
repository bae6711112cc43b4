//! `densities.csv`: particles per unit volume by size bin. Columns
//! `lower_edge,upper_edge,number_density,lower,upper,type,category`; `type` and `category` are empty for sums over
//! them.

use crate::files::FileError;
use crate::files::delimited::{Opened, ReadTable, needed};
use crate::files::table_head::{TableHead, TableUnit};
use crate::pipeline::ParticleDensities;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;
use stereology_grid::{LengthUnit, write_atomically};
use stereology_metrics::Finding;
use stereology_shape::{Table, TableError, TableRow};
use stereology_unfold::Interval;

/// Writes densities: rows of all particles, then those of each type and of each category if there are several. The
/// rows of the categories sum to those of all particles.
///
/// # Errors
///
/// [`FileError`] if it cannot be written.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::files::densities;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, unfold_profiles};
///
/// let profiles = MeasuredProfiles { sizes: vec![3.0, 4.0, 5.0], weights: vec![1.0; 3], categories: vec![0; 3], area: 100.0, ..MeasuredProfiles::default() };
/// let options = DensityOptions { bins: 2, ..DensityOptions::default() };
/// let found = unfold_profiles(&profiles, &ParticleTypes::parse(&["sphere"])?, &options, &|_| ControlFlow::Continue(()))?;
/// let folder = tempfile::tempdir()?;
/// densities::write(folder.path().join("densities.csv"), &found, None)?;
/// let table = std::fs::read_to_string(folder.path().join("densities.csv"))?;
/// assert_eq!(table.lines().count(), 1 + 2);
/// assert!(table.lines().nth(2).is_some_and(|row| row.starts_with("2.5,5,")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: impl AsRef<Path>, densities: &ParticleDensities, unit: Option<LengthUnit>) -> Result<(), FileError> {
    let mut rows = DensityRows::new(unit);
    let all = &densities.all;
    rows.bins(&all.edges, &all.number_density, all.intervals.as_deref(), None, None);
    for (kind, part) in densities.by_type.iter().enumerate() {
        rows.bins(
            &part.edges,
            &part.number_density,
            part.intervals.as_deref(),
            Some(kind),
            None,
        );
    }
    let categories: BTreeSet<u8> = densities.by_category.iter().map(|part| part.category).collect();
    if categories.len() > 1 {
        for part in &densities.by_category {
            let of = &part.density;
            rows.bins(
                &all.edges,
                &of.number_density,
                of.intervals.as_deref(),
                part.kind,
                Some(part.category),
            );
        }
    }
    rows.write(path)
}

/// Rows of a density table, to be written together.
///
/// # Examples
///
/// ```
/// use stereology::files::densities::DensityRows;
///
/// let mut rows = DensityRows::new(None);
/// rows.bins(&[0.0, 1.0, 2.0], &[None, Some(0.25)], None, Some(0), None); // no density in the first bin
/// let folder = tempfile::tempdir()?;
/// rows.write(folder.path().join("densities.csv"))?;
/// assert!(std::fs::read_to_string(folder.path().join("densities.csv"))?.ends_with("0,1,,,,0,\n1,2,0.25,,,0,\n"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct DensityRows {
    lines: Vec<String>,
    unit: Option<LengthUnit>,
}

impl DensityRows {
    /// No rows; lengths are in `unit`.
    #[must_use]
    pub fn new(unit: Option<LengthUnit>) -> Self {
        Self {
            lines: Vec::new(),
            unit,
        }
    }

    /// Adds bins with their intervals, if there are any; `None` for a type or category means all together, an empty
    /// field.
    pub fn bins(
        &mut self,
        edges: &[f64],
        number_density: &[Option<f64>],
        intervals: Option<&[Option<Interval>]>,
        particle_type: Option<usize>,
        category: Option<u8>,
    ) {
        for (bin, (edges, density)) in edges.windows(2).zip(number_density).enumerate() {
            let interval = intervals.and_then(|of| of[bin]);
            let ends = interval.map(|interval| [interval.lower, interval.upper]);
            self.row(edges, *density, ends, particle_type, category);
        }
    }

    fn row(
        &mut self,
        edges: &[f64],
        density: Option<f64>,
        ends: Option<[f64; 2]>,
        particle_type: Option<usize>,
        category: Option<u8>,
    ) {
        let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
        let index = |value: Option<usize>| value.map(|v| v.to_string()).unwrap_or_default();
        self.lines.push(format!(
            "{},{},{},{},{},{},{}",
            edges[0],
            edges[1],
            number(density),
            number(ends.map(|e| e[0])),
            number(ends.map(|e| e[1])),
            index(particle_type),
            index(category.map(usize::from))
        ));
    }

    /// Writes the table, completely or not at all.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        Ok(write_atomically(path, |out| {
            if let Some(unit) = self.unit {
                writeln!(out, "# unit={unit}")?;
            }
            writeln!(out, "lower_edge,upper_edge,number_density,lower,upper,type,category")?;
            self.lines.iter().try_for_each(|line| writeln!(out, "{line}"))
        })?)
    }
}

/// Number densities of one particle type and colour category in contiguous size bins.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityHistogram {
    /// Index of the shape; `None` if the table has no types.
    pub shape: Option<usize>,
    /// Colour category.
    pub category: u8,
    /// Edges of the size bins.
    pub edges: Vec<f64>,
    /// Particles per unit volume; bins without a density are empty.
    pub number_density: Vec<f64>,
}

type Key = (Option<usize>, Option<u8>);

/// Reads a table with the columns `lower_edge,upper_edge,number_density` and, optionally, `type` and `category`.
///
/// Rows without a category are sums over the categories and are left out if other rows have a category; likewise for
/// types.
///
/// # Errors
///
/// [`FileError`] with the line: a missing column, a value that is not a number, bins that do not follow each other, no
/// density above zero.
pub fn read(path: impl AsRef<Path>) -> Result<ReadTable<DensityHistogram>, FileError> {
    let path = path.as_ref();
    Opened::read(path, &["loweredge", "upperedge", "numberdensity"])?.into_rows(path, histograms)
}

fn histograms(
    table: &Table,
    head: &mut TableHead,
    findings: &mut Vec<Finding>,
) -> Result<Vec<DensityHistogram>, TableError> {
    let has = "a table of densities has the columns lower_edge,upper_edge,number_density,...";
    let needed = |name: &str| needed(table, name, has);
    let columns = [needed("lower_edge")?, needed("upper_edge")?, needed("number_density")?];
    let (shape, category) = (table.column(&["type"])?, table.column(&["category"])?);
    unit(table, [columns[0], columns[1]], head)?;
    let mut histograms: BTreeMap<Key, Vec<(usize, [f64; 3])>> = BTreeMap::new();
    for row in table.rows() {
        row.check_width()?;
        let index = |column: Option<usize>| match column.map_or("", |column| row.text(column)) {
            "" => Ok(None),
            text => text
                .parse::<u8>()
                .map(Some)
                .map_err(|_| row.error(format!("`{text}` is not an index from 0 to 255"))),
        };
        histograms
            .entry((index(shape)?.map(usize::from), index(category)?))
            .or_default()
            .push((row.line(), bin(&row, columns)?));
    }
    let mut sorted = false;
    for bins in histograms.values_mut() {
        // Tables of sieves go from coarse to fine.
        sorted |= !bins.is_sorted_by(|a, b| a.1[0] <= b.1[0]);
        bins.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        for pair in bins.windows(2) {
            let ([_, end, _], (line, [start, upper, _])) = (pair[0].1, pair[1]);
            if (end - start).abs() > 1e-9 * upper {
                return Err(table.error(
                    Some(line),
                    format!("the bin begins at {start}, where no other bin ends; bins must be contiguous"),
                ));
            }
        }
    }
    if sorted {
        findings.push(Finding::new("table-layout", "the bins were sorted by size"));
    }
    let with_category = histograms.keys().any(|key| key.1.is_some());
    let with_shape = histograms
        .keys()
        .any(|key| key.0.is_some() && key.1.is_some() == with_category);
    let found: Vec<DensityHistogram> = histograms
        .into_iter()
        .filter(|((shape, category), _)| category.is_some() == with_category && shape.is_some() == with_shape)
        .map(|((shape, category), bins)| DensityHistogram {
            shape,
            category: category.unwrap_or(0),
            edges: bins
                .iter()
                .take(1)
                .map(|(_, bin)| bin[0])
                .chain(bins.iter().map(|(_, bin)| bin[1]))
                .collect(),
            number_density: bins.iter().map(|(_, bin)| bin[2]).collect(),
        })
        .collect();
    if found
        .iter()
        .flat_map(|histogram| &histogram.number_density)
        .all(|&n| n <= 0.0)
    {
        return Err(table.error(None, "no number density is above zero; there is nothing to pack"));
    }
    Ok(found)
}

/// Edges and number density of a bin; an empty field is a density of zero.
fn bin(row: &TableRow<'_>, [lower, upper, density]: [usize; 3]) -> Result<[f64; 3], TableError> {
    let number = |column: usize| match row.number(column)? {
        value if value >= 0.0 => Ok(value),
        value => Err(row.error(format!("{value} is not a finite number, zero or above"))),
    };
    let (a, b) = (number(lower)?, number(upper)?);
    if a >= b {
        return Err(row.error(format!("the bin from {a} to {b} is empty")));
    }
    let n = if row.text(density).is_empty() {
        0.0
    } else {
        number(density)?
    };
    Ok([a, b, n])
}

/// The unit of the edges in the header becomes that of the head.
fn unit(table: &Table, edges: [usize; 2], head: &mut TableHead) -> Result<(), TableError> {
    let [lower, upper] = edges.map(|column| table.columns()[column].unit.as_ref());
    let Some(unit) = lower.or(upper) else { return Ok(()) };
    let unit = unit.length.parse().map_or(TableUnit::Pixels, TableUnit::Unit);
    if (upper.is_some() && lower.is_some() && lower != upper) || (head.unit != TableUnit::Unknown && head.unit != unit)
    {
        return Err(table.error(None, "the edges of the bins have two units"));
    }
    head.unit = unit;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::read;

    fn table(text: &str) -> Result<Vec<super::DensityHistogram>, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("densities.csv");
        std::fs::write(&file, text).unwrap();
        read(&file).map(|table| table.rows).map_err(|error| error.to_string())
    }

    #[test]
    fn sums_are_left_out_where_parts_are_given() {
        let found = table(
            "lower_edge,upper_edge,number_density,lower,upper,type,category\n0,1,,,,,\n1,2,3,,,,\n0,1,,,,,0\n1,2,1,,,,0\n0,1,,,,,1\n1,2,2,,,,1\n",
        )
        .unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(
            (
                found[1].category,
                found[1].edges.as_slice(),
                found[1].number_density.as_slice()
            ),
            (1, &[0.0, 1.0, 2.0][..], &[0.0, 2.0][..])
        );
        let ascending = table("lower_edge,upper_edge,number_density\n0,1,5\n1,2,7\n");
        assert_eq!(
            table("Lower edge;Upper edge;Number density\n1,0;2;7\n0;1;5\n"),
            ascending
        );
        assert_eq!(
            table("lower_edge,upper_edge,number_density\n0,1,5\n").unwrap()[0].shape,
            None
        );
    }

    #[test]
    fn a_wrong_table_says_where() {
        for (text, what) in [
            ("", "lower_edge"),
            ("lower_edge,upper_edge\n0,1\n", "number_density"),
            ("lower_edge,upper_edge,number_density\n0,1,x\n", "line 2: `x`"),
            ("lower_edge,upper_edge,number_density\n0,1,-2\n", "zero or above"),
            ("lower_edge,upper_edge,number_density\n1,1,2\n", "is empty"),
            (
                "lower_edge,upper_edge,number_density\n0,1,2\n3,4,2\n",
                "must be contiguous",
            ),
            ("lower_edge,upper_edge,number_density\n0,1,\n", "nothing to pack"),
        ] {
            let error = table(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
    }
}
