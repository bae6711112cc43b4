//! The figures of a comparison in JSON, and their verdict.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};
use stereology::metrics::{BlockTest, Comparison, Figure};
use stereology::pipeline::Level;

/// The measures by name, each as NAME, NAME_ideal, NAME_floor and NAME_level.
#[derive(Debug)]
pub struct Figures(pub [(&'static str, Figure); MEASURES.len()]);

/// Names and meanings of the measures, in the order of [`Comparison::figures`].
const MEASURES: [(&str, &str); 23] = [
    (
        "kl_grey",
        "Kullback-Leibler divergence of the histograms of grey levels, in nats",
    ),
    (
        "std_ratio",
        "Standard deviation of grey levels over that of the exemplar",
    ),
    ("skewness", "Skewness of grey levels"),
    (
        "kl_orientation",
        "Kullback-Leibler divergence of the histograms of directions, in nats",
    ),
    ("coherence", "Coherence of the structure tensor, 0 to 1"),
    (
        "fringe_length",
        "Mean length of the fringes that lie inside a window, in pixels",
    ),
    (
        "fringe_length_by_ends",
        "Twice the visible length of fringes over their visible ends, in pixels",
    ),
    (
        "tortuosity",
        "Mean length of a fringe over the distance between its ends",
    ),
    (
        "s2",
        "Root mean square difference of the two-point correlation of the bright phase",
    ),
    (
        "lineal_path",
        "Largest difference of the lineal-path function of the bright phase",
    ),
    (
        "chord_ratio",
        "Mean chord length of the bright phase over that of the exemplar",
    ),
    (
        "local_porosity",
        "Wasserstein-1 distance of the local fractions of the bright phase",
    ),
    ("swd7", "Sliced Wasserstein distance of patches of 7 x 7 pixels"),
    ("swd16", "Sliced Wasserstein distance of patches of 16 x 16 pixels"),
    ("gradient_ratio", "Mean gradient over that of the exemplar"),
    ("swd31", "Sliced Wasserstein distance of patches of 31 x 31 pixels"),
    (
        "scale_magnitudes",
        "Root mean square difference of the correlations of amplitudes at neighbouring scales",
    ),
    (
        "scale_phases",
        "Root mean square difference of the correlations of phases at neighbouring scales",
    ),
    (
        "boundary_ratio",
        "Length of the boundary between the phases over that of the exemplar",
    ),
    (
        "euler",
        "Euler number of the bright phase per 10,000 pixels: components minus holes, mean of both connectivities",
    ),
    (
        "dark_chord_ratio",
        "Mean chord length of the dark phase over that of the exemplar",
    ),
    (
        "chord_variation",
        "Standard deviation of the chords of the bright phase over their mean",
    ),
    (
        "dark_chord_variation",
        "Standard deviation of the chords of the dark phase over their mean",
    ),
];

/// A value of the object: a number or a level.
#[derive(Serialize)]
#[serde(untagged)]
enum Entry {
    Number(Option<f64>),
    Level(Option<Level>),
}

impl Serialize for Figures {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = self.0.iter().flat_map(|(name, figure)| {
            let Figure { value, ideal, floor } = figure;
            [
                ((*name).to_owned(), Entry::Number(*value)),
                (format!("{name}_ideal"), Entry::Number(*ideal)),
                (format!("{name}_floor"), Entry::Number(*floor)),
                (format!("{name}_level"), Entry::Level(figure.level())),
            ]
        });
        serializer.collect_map(rows)
    }
}

impl JsonSchema for Figures {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Figures".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let (mut properties, mut required) = (serde_json::Map::new(), Vec::new());
        for (name, meaning) in MEASURES {
            for (key, what) in [
                (name.to_owned(), format!("{meaning}; null if not measurable.")),
                (format!("{name}_ideal"), format!("Ideal value of `{name}`.")),
                (
                    format!("{name}_floor"),
                    format!("Distance of `{name}` from its ideal between two halves of the exemplar."),
                ),
            ] {
                properties.insert(
                    key.clone(),
                    serde_json::json!({ "description": what, "type": ["number", "null"] }),
                );
                required.push(key);
            }
            let key = format!("{name}_level");
            properties.insert(
                key.clone(),
                serde_json::json!({
                    "description": format!("Level of `{name}`: good up to 2 floors from its ideal, care up to 4, else bad; null without a floor."),
                    "type": ["string", "null"]
                }),
            );
            required.push(key);
        }
        json_schema!({ "type": "object", "properties": properties, "required": required })
    }
}

/// The verdict on a solid.
#[derive(Debug, Serialize, JsonSchema)]
pub struct VerdictFields {
    /// bad if the classifier or at least three figures are bad; care if the classifier needs care or two figures are
    /// bad; else good. Null if nothing has a level.
    #[schemars(with = "Option<String>")]
    level: Option<Level>,
    /// What decides: `classifier`, or the figure that is most floors from its ideal.
    worst: Option<&'static str>,
    /// Number of figures that are good.
    good: usize,
    /// Number of figures that need care.
    care: usize,
    /// Number of figures that are bad.
    bad: usize,
}

impl VerdictFields {
    /// The verdict of figures and block test.
    pub fn of(found: &Comparison, test: Option<&BlockTest>) -> Self {
        let count = |level: Level| {
            let is_level = |(_, figure): &&(&str, Figure)| figure.level() == Some(level);
            found.figures().iter().filter(is_level).count()
        };
        let of_test = test.map(|test| (test.level(), "classifier"));
        // The classifier decides among equals: its false-alarm rate is known.
        let worst = found
            .verdict()
            .into_iter()
            .chain(of_test)
            .max_by_key(|(level, _)| *level);
        Self {
            level: worst.map(|(level, _)| level),
            worst: worst.map(|(_, name)| name),
            good: count(Level::Good),
            care: count(Level::Care),
            bad: count(Level::Bad),
        }
    }

    /// The verdict in a line.
    pub fn line(&self) -> String {
        let level = self.level.map_or("unknown", word);
        let worst = self
            .worst
            .map_or_else(String::new, |worst| format!(" (worst: {worst})"));
        format!(
            "verdict: {level}{worst}; of the figures {} good, {} with care, {} bad",
            self.good, self.care, self.bad
        )
    }
}

/// A level in a word.
pub fn word(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Care => "care",
        Level::Bad => "bad",
    }
}
