//! Designs: all parameters of a microgeometry in one file.

use serde::{Deserialize, Serialize};

use crate::contact::ContactDistribution;
use crate::displacement::{Direction, Offset, Profile};
use crate::error::MicrogeometryError;
use crate::reconstruction::Method;

/// A microgeometry that can be applied to any mesh: `design.json`.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The distribution to rebuild.
    pub contact: ContactDistribution,
    /// Half the mesh's longest box side, in distribution units (u; "scale units" of table 1).
    pub units: f64,
    /// Method of labelling.
    pub method: Method,
    /// Displacement of the negative region.
    pub negative: Offset,
    /// Displacement of the positive region.
    pub positive: Offset,
    /// Seed of the reconstruction.
    pub seed: u64,
    /// Longest edge of the mesh it was designed on, in halves of the longest box side, if it was refined.
    pub edge_length: Option<f64>,
    /// Axis and stretch of an anisotropic metric.
    pub stretch: Option<([f64; 3], f64)>,
}

#[derive(Serialize, Deserialize)]
struct Written {
    schema: String,
    units: f64,
    #[serde(default = "tight")]
    method: String,
    #[serde(default)]
    seed: u64,
    negative: WrittenOffset,
    positive: WrittenOffset,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    edge_length: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stretch: Option<WrittenStretch>,
    contact: WrittenContact,
}

#[derive(Serialize, Deserialize)]
struct WrittenOffset {
    direction: String,
    scale: f64,
    profile: String,
}

#[derive(Serialize, Deserialize)]
struct WrittenStretch {
    axis: [f64; 3],
    factor: f64,
}

#[derive(Serialize, Deserialize)]
struct WrittenContact {
    bin_width: f64,
    negative: Vec<f64>,
    positive: Vec<f64>,
}

fn tight() -> String {
    "tight".to_owned()
}

const SCHEMA: &str = "stereology.design/1";

impl Design {
    /// A design with the default method, seed 0 and no refinement of the mesh.
    #[must_use]
    pub fn new(contact: ContactDistribution, units: f64, negative: Offset, positive: Offset) -> Self {
        Self {
            contact,
            units,
            method: Method::Tight,
            negative,
            positive,
            seed: 0,
            edge_length: None,
            stretch: None,
        }
    }

    /// The file's text.
    ///
    /// ```
    /// use stereology_microgeometry::{ContactDistribution, Design, Offset};
    /// let contact = ContactDistribution::new(1.0, vec![1.0], vec![1.0, 2.0])?;
    /// let design = Design::new(contact, 40.0, Offset::still(), "out,0.03,sqrt".parse()?);
    /// assert_eq!(Design::from_json(&design.to_json())?, design);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    #[must_use]
    #[allow(
        clippy::missing_panics_doc,
        reason = "a structure of numbers and strings can always be written"
    )]
    pub fn to_json(&self) -> String {
        let offset = |of: &Offset| WrittenOffset {
            direction: of.direction.name().to_owned(),
            scale: of.scale,
            profile: of.profile.to_string(),
        };
        let written = Written {
            schema: SCHEMA.to_owned(),
            units: self.units,
            method: self.method.name().to_owned(),
            seed: self.seed,
            negative: offset(&self.negative),
            positive: offset(&self.positive),
            edge_length: self.edge_length,
            stretch: self.stretch.map(|(axis, factor)| WrittenStretch { axis, factor }),
            contact: WrittenContact {
                bin_width: self.contact.bin_width(),
                negative: self.contact.negative().to_vec(),
                positive: self.contact.positive().to_vec(),
            },
        };
        serde_json::to_string_pretty(&written).expect("numbers and strings can be written") + "\n"
    }

    /// From a file's text.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError`] that names what is missing or out of range.
    pub fn from_json(text: &str) -> Result<Self, MicrogeometryError> {
        let written: Written =
            serde_json::from_str(text).map_err(|error| MicrogeometryError::File(format!("not a design ({error})")))?;
        let offset = |of: &WrittenOffset| -> Result<Offset, MicrogeometryError> {
            let direction: Direction = of.direction.parse()?;
            let profile: Profile = of.profile.parse()?;
            if !(of.scale.is_finite() && of.scale >= 0.0) {
                return Err(MicrogeometryError::Parameter(format!(
                    "the scale of an offset must be zero or above, not {}",
                    of.scale
                )));
            }
            Ok(Offset {
                direction,
                scale: of.scale,
                profile,
            })
        };
        let WrittenContact {
            bin_width,
            negative,
            positive,
        } = written.contact;
        if !(written.units.is_finite() && written.units > 0.0) {
            return Err(MicrogeometryError::Parameter(format!(
                "scale units are a positive finite number, not {}",
                written.units
            )));
        }
        Ok(Self {
            contact: ContactDistribution::new(bin_width, negative, positive)?,
            units: written.units,
            method: written.method.parse()?,
            negative: offset(&written.negative)?,
            positive: offset(&written.positive)?,
            seed: written.seed,
            edge_length: written.edge_length,
            stretch: written.stretch.map(|stretch| (stretch.axis, stretch.factor)),
        })
    }
}

/// A row of table 1 of the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Preset {
    /// Name: the figure and the model.
    pub name: &'static str,
    /// Scale units.
    pub units: f64,
    /// Negative region.
    pub negative: Offset,
    /// Positive region.
    pub positive: Offset,
}

/// Table 1 of the paper: the parameters of its figures. Scale units and k are the paper's; the columns of directions
/// and functions have lost their dashes in the available text of the paper, so which regions are not displaced is an
/// interpretation.
///
/// ```
/// let coral = stereology_microgeometry::presets().into_iter().find(|preset| preset.name == "fig8-coral").unwrap();
/// assert_eq!((coral.units, coral.positive.scale), (57.27, 0.034));
/// ```
#[must_use]
pub fn presets() -> Vec<Preset> {
    use Direction::{In, Out, Still};
    use Profile::{Linear, Root};
    let row = |name, units, [negative, positive]: [(Direction, f64, Profile); 2]| {
        let offset = |(direction, scale, profile)| Offset {
            direction,
            scale,
            profile,
        };
        Preset {
            name,
            units,
            negative: offset(negative),
            positive: offset(positive),
        }
    };
    vec![
        row("fig1-arrow", 63.27, [(In, 0.02876, Root), (Out, 0.03489, Root)]),
        row("fig1-disk", 64.69, [(In, 0.01092, Root), (Still, 0.05097, Linear)]),
        row("fig1-candy", 38.93, [(Still, 0.0186, Linear), (In, 0.0397, Linear)]),
        row("fig1-head", 27.78, [(In, 0.02033, Root), (Out, 0.01647, Root)]),
        row("fig1-world", 36.65, [(In, 0.05472, Root), (Out, 0.02389, Root)]),
        row("fig6", 79.82, [(Still, 0.04906, Linear), (Out, 0.03232, Root)]),
        row("fig8-candy", 71.48, [(In, 0.02111, Linear), (Out, 0.02856, Root)]),
        row("fig8-coral", 57.27, [(Still, 0.03061, Linear), (Out, 0.034, Linear)]),
        row("fig8-head", 81.97, [(Still, 0.01083, Linear), (Out, 0.01319, Linear)]),
        row("fig10", 40.0, [(In, 0.05, Linear), (Still, 0.03, Linear)]),
    ]
}
