//! Columns of a table of profiles that contradict each other: sizes, areas and bounding boxes, and rows that are
//! repeated.

use crate::files::profiles::ProfileRow;
use std::collections::HashSet;
use std::f64::consts::PI;
use stereology_metrics::Finding;

/// Sizes and areas agree if their areas differ by less than this: rounding.
const SAME: f64 = 0.02;
/// Quartiles of the ratio differ by less than this if it is a factor, the same for all profiles.
const CONSTANT: f64 = 0.05;
/// Median fractions of the box that a profile fills: a disc fills π / 4, a square on its corner 1 / 2.
const FILLED: (f64, f64) = (0.25, 1.02);

/// Findings on rows of a table: `area-and-size-disagree`, `duplicate-rows`.
///
/// - The columns `area` and `size` disagree if the median of `area` / (π/4 `size`²) differs from 1 by more than 2 %.
/// - `size` and the bounding boxes disagree if the circles of the sizes fill less than a quarter of their boxes, or
///   more than all of them, in the median.
/// - Rows are repeated if two have the same slice, position and size.
///
/// ```
/// use stereology::files::{profiles, size_columns};
///
/// let table = std::env::temp_dir().join(format!("radii-{}.csv", std::process::id()));
/// std::fs::write(&table, "size,area\n1,3.1416\n2,12.566\n3,28.274\n")?;
/// let found = size_columns::findings(&profiles::read(&table, &profiles::ProfileReading::default())?.rows);
/// assert!(found[0].code == "area-and-size-disagree" && found[0].message.contains("radii"));
/// # std::fs::remove_file(table)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn findings(rows: &[ProfileRow]) -> Vec<Finding> {
    [against_areas(rows), against_boxes(rows), repeated(rows)]
        .into_iter()
        .flatten()
        .collect()
}

fn circle(size: f64) -> f64 {
    0.25 * PI * size * size
}

/// Quartiles; `None` of nothing.
fn quartiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some([1, 2, 3].map(|quarter| values[last * quarter / 4]))
}

fn disagree(message: String) -> Option<Finding> {
    Some(Finding::new("area-and-size-disagree", message))
}

fn against_areas(rows: &[ProfileRow]) -> Option<Finding> {
    let both: Vec<(f64, f64)> = rows.iter().filter_map(|row| Some((row.size, row.area?))).collect();
    let [low, ratio, high] = quartiles(both.iter().map(|(size, area)| area / circle(*size)).collect())?;
    if (ratio - 1.0).abs() <= SAME {
        return None;
    }
    let is = |factor: f64| (ratio / factor - 1.0).abs() < 0.5 * CONSTANT;
    let repeats = quartiles(both.iter().map(|(size, area)| area / size).collect())?;
    let cause = if repeats.iter().all(|of| (of - 1.0).abs() <= SAME) {
        "the sizes are areas".to_owned()
    } else if high - low > CONSTANT * ratio {
        "the sizes are probably other diameters than those of circles of equal area, such as Feret diameters".to_owned()
    } else if is(4.0) {
        "the sizes are radii".to_owned()
    } else {
        format!(
            "their units probably differ by a factor of {:.4} in length",
            ratio.sqrt()
        )
    };
    disagree(format!(
        "the areas are {ratio:.4} times those of circles with these sizes (median): {cause}. The sizes were used; leave out the column that is wrong"
    ))
}

fn against_boxes(rows: &[ProfileRow]) -> Option<Finding> {
    let filled = |row: &ProfileRow| {
        let of = row.bounding_box?;
        Some(circle(row.size) / ((of.right - of.left) * (of.bottom - of.top)))
    };
    let [_, filled, _] = quartiles(rows.iter().filter_map(filled).collect())?;
    if (FILLED.0..=FILLED.1).contains(&filled) {
        return None;
    }
    disagree(format!(
        "circles with these sizes fill {filled:.4} times the areas of the bounding boxes (median), where a disc fills 0.79: the sizes are not diameters of circles of \
         equal area, or boxes have another unit. Sizes and boxes were used as they are"
    ))
}

fn repeated(rows: &[ProfileRow]) -> Option<Finding> {
    let mut seen = HashSet::new();
    let key = |row: &ProfileRow| {
        let [x, y] = row.position?;
        Some((row.slice, [x, y, row.size].map(f64::to_bits)))
    };
    let repeated = rows.iter().filter_map(key).filter(|key| !seen.insert(*key)).count();
    (repeated > 0).then(|| {
        Finding::new(
            "duplicate-rows",
            format!(
                "{repeated} rows have the position and the size of an earlier row: remove them, or they count twice"
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::findings;
    use crate::files::profiles::{ProfileReading, read};

    fn messages(text: &str) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("profiles.csv");
        std::fs::write(&file, text).unwrap();
        let found = findings(&read(&file, &ProfileReading::default()).unwrap().rows);
        found.iter().map(|of| format!("{}: {}", of.code, of.message)).collect()
    }

    /// A table of discs with diameters 1 to 8, whose columns are altered.
    fn table(head: &str, row: impl Fn(f64, f64) -> String) -> String {
        let rows = (1..=8).map(|d| row(f64::from(d), std::f64::consts::FRAC_PI_4 * f64::from(d * d)) + "\n");
        format!("{head}\n{}", rows.collect::<String>())
    }

    #[test]
    fn agreeing_columns_raise_nothing() {
        assert!(messages(&table("size,area", |d, a| format!("{d},{a:.1}"))).is_empty());
        assert!(messages(&table("size,left,top,right,bottom", |d, _| format!("{d},0,0,{d},{d}"))).is_empty());
        assert!(messages(&table("size", |d, _| format!("{d}"))).is_empty());
    }

    #[test]
    fn contradictions_are_found_with_their_cause() {
        for (text, cause) in [
            (table("size,area", |d, a| format!("{},{a}", 0.5 * d)), "radii"),
            (table("size,area", |_, a| format!("{a},{a}")), "the sizes are areas"),
            (table("size,area", |d, a| format!("{d},{}", 1e6 * a)), "factor of 1000"),
            (
                table("size,area", |d, a| format!("{},{a}", d * (1.1 + 0.05 * d))),
                "Feret",
            ),
            (
                table("size,left,top,right,bottom", |d, _| format!("{},0,0,{d},{d}", 0.5 * d)),
                "0.1963",
            ),
            (
                table("size,left,top,right,bottom", |d, _| format!("{},0,0,{d},{d}", 2.0 * d)),
                "3.1416",
            ),
        ] {
            let found = messages(&text);
            assert!(found.len() == 1 && found[0].contains(cause), "{text}: {found:?}");
        }
    }

    #[test]
    fn repeated_rows_are_counted() {
        let found = messages("x,y,size\n1,1,2\n5,5,2\n1,1,2\n");
        assert!(
            found.len() == 1 && found[0].starts_with("duplicate-rows: 1 rows"),
            "{found:?}"
        );
        assert!(messages("x,y,size,slice\n1,1,2,0\n1,1,2,1\n").is_empty());
    }
}
