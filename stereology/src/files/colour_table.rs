//! Colours of particles as a CSV table: columns `r,g,b` from 0 to 255, and optionally `category` and `size`. A
//! `profiles.csv` is such a table; so is a palette with one row per category.

use crate::files::FileError;
use crate::files::delimited::{Opened, ReadTable, needed};
use crate::files::labels;
use crate::pipeline::ColourSample;
use std::path::Path;
use stereology_shape::{Table, TableError};

/// Reads the table, for [`particle_colours`](crate::pipeline::particle_colours).
///
/// # Errors
///
/// [`FileError`] with the line: a missing column, a value that is not valid, several rows of a category without sizes.
///
/// # Examples
///
/// ```
/// use stereology::files::colour_table;
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("palette.csv");
/// std::fs::write(&file, "category,r,g,b\n0,255,0,0\n1,0,51,255\n")?;
/// let palette = colour_table::read(&file)?.rows;
/// assert_eq!((palette[1].category, palette[1].colour), (1, [0.0, 0.2, 1.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<ReadTable<ColourSample>, FileError> {
    let path = path.as_ref();
    Opened::read(path, &["r", "g", "b", "category"])?.into_rows(path, |table, _, _| samples(table))
}

fn samples(table: &Table) -> Result<Vec<ColourSample>, TableError> {
    let needed = |name: &str| needed(table, name, "a table of colours has r,g,b, and may have category,size");
    let channels = [needed("r")?, needed("g")?, needed("b")?];
    let (category, size) = (table.column(&["category"])?, table.column(&["size"])?);
    let mut samples: Vec<ColourSample> = Vec::new();
    let mut seen = [false; 256];
    for row in table.rows() {
        row.check_width()?;
        let number = |column: usize, most: f64| match row.number(column)? {
            value if (0.0..=most).contains(&value) => Ok(value),
            value => {
                let name = &table.columns()[column].name;
                Err(row.error(format!("`{value}` in column `{name}` is not valid")))
            }
        };
        let of: u8 = match category {
            None => 0,
            Some(column) => {
                let index = labels::indices(&[row.text(column)]).map(|indices| indices[0]);
                index.ok_or_else(|| row.error(format!("`{}` is not a category from 0 to 255", row.text(column))))?
            }
        };
        if size.is_none() && std::mem::replace(&mut seen[usize::from(of)], true) {
            return Err(row.error(format!(
                "category {of} has several colours, of which one is chosen by size, but there is no column `size`"
            )));
        }
        let [r, g, b] = channels.map(|channel| number(channel, 255.0));
        samples.push(ColourSample {
            size: size.map_or(Ok(1.0), |column| number(column, f64::MAX))?,
            category: of,
            colour: [r? / 255.0, g? / 255.0, b? / 255.0],
        });
    }
    if samples.is_empty() {
        return Err(table.error(None, "has a header but no colours"));
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    #[test]
    fn each_fault_is_named() {
        for (text, what) in [
            ("r,g\n1,2\n", "no column `b`"),
            ("r,g,b\n1,2,300\n", "line 2: `300` in column `b`"),
            ("r,g,b\n1,2,nan\n", "line 2: `nan`"),
            ("r,g,b\n", "no colours"),
            (
                "r,g,b,category\n1,2,3,0\n4,5,6,0\n",
                "line 3: category 0 has several colours",
            ),
            ("r,g,b,category\n1,2,3,x\n", "`x` is not a category"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("colours.csv");
            std::fs::write(&file, text).unwrap();
            let error = super::read(&file).unwrap_err().to_string();
            assert!(error.contains(what), "{text:?}: {error}");
        }
    }
}
