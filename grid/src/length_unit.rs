//! Units of length, and their names in the formats that store one.

use std::fmt::{self, Display};
use std::str::FromStr;

/// A unit of length.
///
/// # Examples
///
/// ```
/// use stereology_grid::LengthUnit;
///
/// let unit: LengthUnit = "µm".parse()?;
/// assert_eq!((unit.symbol(), unit.in_metres()), ("um", 1e-6));
/// assert!("furlong".parse::<LengthUnit>().is_err());
/// # Ok::<(), stereology_grid::LengthUnitError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LengthUnit {
    /// 10⁻⁹ m.
    Nanometre,
    /// 10⁻⁶ m.
    Micrometre,
    /// 10⁻³ m.
    Millimetre,
    /// 10⁻² m.
    Centimetre,
    /// Metre.
    Metre,
    /// 0.0254 m.
    Inch,
}

/// A name that is no known unit of length.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not a known unit of length: nm, um (µm), mm, cm, m or in")]
#[non_exhaustive]
pub struct LengthUnitError {
    /// The name.
    pub name: String,
}

impl LengthUnit {
    /// All units.
    pub const ALL: [Self; 6] = [
        Self::Nanometre,
        Self::Micrometre,
        Self::Millimetre,
        Self::Centimetre,
        Self::Metre,
        Self::Inch,
    ];

    /// The symbol in ASCII, as files store it; [`FromStr`] reads it.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Nanometre => "nm",
            Self::Micrometre => "um",
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
        }
    }

    /// The symbol for readers: µm in place of um.
    #[must_use]
    pub fn printed(self) -> &'static str {
        match self {
            Self::Micrometre => "µm",
            other => other.symbol(),
        }
    }

    /// Its length in metres.
    #[must_use]
    pub fn in_metres(self) -> f64 {
        match self {
            Self::Nanometre => 1e-9,
            Self::Micrometre => 1e-6,
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Metre => 1.0,
            Self::Inch => 0.0254,
        }
    }

    /// Its name in OME-Zarr, from UDUNITS-2.
    pub(crate) fn udunits(self) -> &'static str {
        match self {
            Self::Nanometre => "nanometer",
            Self::Micrometre => "micrometer",
            Self::Millimetre => "millimeter",
            Self::Centimetre => "centimeter",
            Self::Metre => "meter",
            Self::Inch => "inch",
        }
    }
}

impl Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

impl FromStr for LengthUnit {
    type Err = LengthUnitError;

    fn from_str(name: &str) -> Result<Self, LengthUnitError> {
        match name.trim() {
            // The micro sign and the Greek letter.
            "\u{b5}m" | "\u{3bc}m" => Ok(Self::Micrometre),
            name => Self::ALL
                .into_iter()
                .find(|unit| unit.symbol() == name)
                .ok_or_else(|| LengthUnitError { name: name.to_owned() }),
        }
    }
}
