//! Labels of rows: slices, categories and types that a table names by words or by numbers with gaps.

use std::cmp::Ordering;
use std::collections::BTreeMap;

/// A label, in the order of numbers or, if any label is a word, of the alphabet.
#[derive(Clone, Debug)]
struct Label<'a> {
    number: Option<f64>,
    text: &'a str,
}

impl Ord for Label<'_> {
    fn cmp(&self, other: &Self) -> Ordering {
        match (self.number, other.number) {
            (Some(a), Some(b)) => a.total_cmp(&b),
            _ => self.text.cmp(other.text),
        }
    }
}

impl PartialOrd for Label<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Label<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Label<'_> {}

/// The number of each label among the different ones, from 0 without gaps, and the labels in this order.
pub(super) fn numbered(labels: &[&str]) -> (Vec<usize>, Vec<String>) {
    let numbers: Option<Vec<f64>> = labels.iter().map(|text| text.parse().ok()).collect();
    let labels: Vec<Label<'_>> = labels
        .iter()
        .enumerate()
        .map(|(at, text)| Label {
            number: numbers.as_ref().map(|numbers| numbers[at]),
            text,
        })
        .collect();
    let mut places: BTreeMap<Label<'_>, usize> = labels.iter().map(|label| (label.clone(), 0)).collect();
    places.values_mut().enumerate().for_each(|(at, place)| *place = at);
    let names = places.keys().map(|label| label.text.to_owned()).collect();
    (labels.iter().map(|label| places[label]).collect(), names)
}

/// Indices from 0 to 255, if all labels are such numbers.
pub(super) fn indices(labels: &[&str]) -> Option<Vec<u8>> {
    let index = |label: &&str| {
        let whole = label.strip_suffix(".0").unwrap_or(label);
        whole.parse().ok()
    };
    labels.iter().map(index).collect()
}

#[cfg(test)]
mod tests {
    use super::{indices, numbered};

    #[test]
    fn gaps_and_words_make_no_difference() {
        let expected = vec![2, 0, 1, 0];
        for labels in [
            ["2", "0", "1", "0"],
            ["30", "10", "20", "10.0"],
            ["c", "a", "b", "a"],
            ["x", "1", "2", "1"],
        ] {
            assert_eq!(numbered(&labels).0, expected, "{labels:?}");
        }
        assert_eq!(numbered(&["b", "a"]).1, ["a", "b"]);
        assert_eq!(indices(&["0", "255", "3.0"]), Some(vec![0, 255, 3]));
        assert!(indices(&["256"]).is_none() && indices(&["-1"]).is_none() && indices(&["a"]).is_none());
    }
}
