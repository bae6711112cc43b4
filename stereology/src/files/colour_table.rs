//! Colours of particles as a CSV table: columns `r,g,b` from 0 to 255, and optionally `category` and `size`. A
//! `profiles.csv` is such a table; so is a palette with one row per category.

use crate::files::FileError;
use crate::pipeline::ColourSample;
use std::path::Path;

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
/// let palette = colour_table::read(&file)?;
/// assert_eq!((palette[1].category, palette[1].colour), (1, [0.0, 0.2, 1.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Vec<ColourSample>, FileError> {
    let path = path.as_ref();
    parse(path).map_err(|what| FileError::value(path, what))
}

fn parse(path: &Path) -> Result<Vec<ColourSample>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| format!("cannot be read ({error})"))?;
    let headers = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |name: &str| headers.iter().position(|header| header.eq_ignore_ascii_case(name));
    let needed = |name: &str| {
        column(name)
            .ok_or_else(|| format!("has no column `{name}`; a table of colours has r,g,b, and may have category,size"))
    };
    let channels = [needed("r")?, needed("g")?, needed("b")?];
    let (category, size) = (column("category"), column("size"));
    let mut samples: Vec<ColourSample> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |column: usize| record.get(column).unwrap_or_default();
        let number = |column: usize, most: f64| match field(column).parse::<f64>() {
            Ok(value) if (0.0..=most).contains(&value) => Ok(value),
            _ => Err(format!(
                "line {line}: `{}` in column `{}` is not valid",
                field(column),
                &headers[column]
            )),
        };
        let of: u8 = match category {
            None => 0,
            Some(column) => field(column)
                .parse()
                .map_err(|_| format!("line {line}: `{}` is not a category from 0 to 255", field(column)))?,
        };
        if size.is_none() && samples.iter().any(|sample| sample.category == of) {
            return Err(format!(
                "line {line}: category {of} has several colours, of which one is chosen by size, but there is no column `size`"
            ));
        }
        let [r, g, b] = channels.map(|channel| number(channel, 255.0));
        samples.push(ColourSample {
            size: size.map_or(Ok(1.0), |column| number(column, f64::MAX))?,
            category: of,
            colour: [r? / 255.0, g? / 255.0, b? / 255.0],
        });
    }
    if samples.is_empty() {
        return Err("has a header but no colours".to_owned());
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
