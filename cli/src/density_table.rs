//! The table of number densities that `stereology pack` reads: `densities.csv` of `stereology unfold`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::failure::{Explain, Failure};

/// Number densities of one particle type and colour category in contiguous size bins.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityHistogram {
    /// Index of the shape; `None` where the table does not tell, so that the shapes have shares of it.
    pub shape: Option<usize>,
    /// Colour category.
    pub category: u8,
    /// Edges of the size bins.
    pub edges: Vec<f64>,
    /// Particles per unit volume; bins of which nothing is known count as empty.
    pub number_density: Vec<f64>,
}

/// Reads `lower_edge,upper_edge,number_density[,lower,upper][,type][,category]`.
///
/// Rows without a category are the sum over categories, so they are left out where there are rows with one; and so for types.
pub fn read_densities(path: &Path) -> Result<Vec<DensityHistogram>, Failure> {
    read(path).at(path)
}

type Key = (Option<usize>, Option<u8>);

fn read(path: &Path) -> Result<Vec<DensityHistogram>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| format!("cannot be read ({error})"))?;
    let headers = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |name: &str| headers.iter().position(|header| header == name);
    let needed = |name: &str| {
        column(name).ok_or_else(|| {
            format!("line 1 has no column `{name}`; a table of densities is what `stereology unfold -o` writes, with lower_edge,upper_edge,number_density,...")
        })
    };
    let (lower, upper, density) = (needed("lower_edge")?, needed("upper_edge")?, needed("number_density")?);
    let (shape, category) = (column("type"), column("category"));
    let mut histograms: BTreeMap<Key, Vec<[f64; 3]>> = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: usize| match record.get(column).unwrap_or_default().parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
            _ => Err(format!(
                "line {line}: `{}` in column `{}` is not a finite number, zero or above",
                record.get(column).unwrap_or_default(),
                &headers[column]
            )),
        };
        let index = |column: Option<usize>| match column.and_then(|column| record.get(column)).unwrap_or_default() {
            "" => Ok(None),
            text => text
                .parse::<u8>()
                .map(Some)
                .map_err(|_| format!("line {line}: `{text}` is no index from 0 to 255")),
        };
        let (a, b) = (number(lower)?, number(upper)?);
        if a >= b {
            return Err(format!("line {line}: the bin from {a} to {b} is empty"));
        }
        let n = if record.get(density).unwrap_or_default().is_empty() {
            0.0
        } else {
            number(density)?
        };
        let bins = histograms
            .entry((index(shape)?.map(usize::from), index(category)?))
            .or_default();
        if bins.last().is_some_and(|last| (last[1] - a).abs() > 1e-9 * b) {
            return Err(format!(
                "line {line}: the bin begins at {a}, but the one before ends elsewhere; bins follow each other"
            ));
        }
        bins.push([a, b, n]);
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
                .map(|bin| bin[0])
                .chain(bins.iter().map(|bin| bin[1]))
                .collect(),
            number_density: bins.iter().map(|bin| bin[2]).collect(),
        })
        .collect();
    if found
        .iter()
        .flat_map(|histogram| &histogram.number_density)
        .all(|&n| n <= 0.0)
    {
        return Err("no number density is above zero; there is nothing to pack".to_owned());
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::read;

    fn table(text: &str) -> Result<Vec<super::DensityHistogram>, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("densities.csv");
        std::fs::write(&file, text).unwrap();
        read(&file)
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
                "follow each other",
            ),
            ("lower_edge,upper_edge,number_density\n0,1,\n", "nothing to pack"),
        ] {
            let error = table(text).unwrap_err();
            assert!(error.contains(what), "{text:?}: {error}");
        }
    }
}
