//! Values of options: positive numbers, lists, colours, shapes with their fractions. The message for an invalid
//! value states what is allowed.

use std::str::FromStr;

use stereology::grid::LengthUnit;

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("a finite number above zero is needed".to_owned()),
    }
}

/// Bytes of a number of GiB.
pub fn bytes(gib: f64) -> u64 {
    (gib * f64::from(1 << 30)) as u64
}

/// The length of a pixel, with its unit if it is given: `0.05` or `0.05mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelLength {
    /// Length.
    pub length: f64,
    /// Its unit.
    pub unit: Option<LengthUnit>,
}

impl FromStr for PixelLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if let Ok(length) = positive(text) {
            return Ok(Self { length, unit: None });
        }
        // The number ends before the letters of the unit; `e` may belong to either.
        let end = text
            .rfind(|letter: char| letter.is_ascii_digit() || letter == '.')
            .map_or(0, |last| last + 1);
        let (number, unit) = text.split_at(end);
        let length = positive(number)
            .map_err(|error| format!("{error}, with a unit of length or without, such as 0.05mm or 0.05"))?;
        let unit = unit.parse::<LengthUnit>().map_err(|error| error.to_string())?;
        Ok(Self {
            length,
            unit: Some(unit),
        })
    }
}

/// A finite number, zero or above.
pub fn not_negative(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number >= 0.0 => Ok(number),
        _ => Err("a finite number, zero or above, is needed".to_owned()),
    }
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("a finite number is needed".to_owned()),
    }
}

/// A number strictly between 0 and 1.
pub fn share(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number > 0.0 && number < 1.0 => Ok(number),
        _ => Err("a number between 0 and 1 is needed".to_owned()),
    }
}

/// A relative error above 0, at most one half.
pub fn size_error(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 0.5 => Ok(number),
        _ => Err("a relative error above 0 and at most 0.5 is needed, such as 0.1".to_owned()),
    }
}

/// A count from 1 to a million.
pub fn count(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(number @ 1..=1_000_000) => Ok(number),
        _ => Err("a whole number from 1 to 1000000 is needed".to_owned()),
    }
}

/// A number of bins, from 1 to 1000, or `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinCount {
    /// This many.
    Number(usize),
    /// As many as the number of profiles allows.
    Auto,
}

impl FromStr for BinCount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim() == "auto" {
            return Ok(Self::Auto);
        }
        bins(text).map(Self::Number)
    }
}

/// The largest size of a particle: a length, or how it is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaxSize {
    /// A known length.
    Length(f64),
    /// The size of the largest profile.
    Profile,
    /// The size of the largest profile, corrected for its bias.
    Corrected,
    /// The maximum-likelihood size.
    Likelihood,
}

impl FromStr for MaxSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "profile" => Ok(Self::Profile),
            "corrected" => Ok(Self::Corrected),
            "likelihood" => Ok(Self::Likelihood),
            length => positive(length)
                .map(Self::Length)
                .map_err(|error| format!("{error}, or profile, corrected, likelihood")),
        }
    }
}

/// A capping angle in degrees, or `fit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CappingAngle {
    /// A known angle.
    Degrees(f64),
    /// The maximum-likelihood angle.
    Fit,
}

impl FromStr for CappingAngle {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().parse::<f64>() {
            Ok(angle) if (0.0..90.0).contains(&angle) => Ok(Self::Degrees(angle)),
            _ if text.trim() == "fit" => Ok(Self::Fit),
            _ => Err("an angle from 0 to below 90 degrees is needed, or fit".to_owned()),
        }
    }
}

/// Width and height of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window(pub [f64; 2]);

impl FromStr for Window {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides: Vec<f64> = text.split(',').map(positive).collect::<Result<_, _>>()?;
        match sides[..] {
            [width, height] => Ok(Self([width, height])),
            _ => Err("two lengths are needed, width and height, such as 640,480".to_owned()),
        }
    }
}

/// A number of bins, from 1 to 1000.
pub fn bins(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(number @ 1..=1000) => Ok(number),
        _ => Err("a whole number of bins from 1 to 1000 is needed".to_owned()),
    }
}

/// Edges of bins, `a,b,...`: at least two, from zero up, each above the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges(pub Vec<f64>);

impl FromStr for Edges {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let edges = text.split(',').map(not_negative).collect::<Result<Vec<_>, _>>()?;
        if edges.len() < 2 || edges.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err("at least two edges are needed, each above the one before, such as 0,2,4,8".to_owned());
        }
        Ok(Self(edges))
    }
}

/// The binder: its colour `R,G,B`, each 0 to 255, or the number of one of the photograph's main colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinderArgument {
    Colour([u8; 3]),
    MainColour(usize),
}

impl FromStr for BinderArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Result<Vec<u8>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        match parts.as_deref() {
            Ok(&[r, g, b]) => Ok(Self::Colour([r, g, b])),
            Ok(&[number @ 0..=7]) => Ok(Self::MainColour(usize::from(number))),
            _ => Err(
                "give a colour as three whole numbers from 0 to 255, such as 120,110,100, or a main colour of the photograph as one whole number from 0 to 7"
                    .to_owned(),
            ),
        }
    }
}

/// A number of categories, or how to choose it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CategoriesArgument {
    Count(usize),
    Separated,
    Silhouette,
    Gap,
}

impl FromStr for CategoriesArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "separated" => Ok(Self::Separated),
            "silhouette" => Ok(Self::Silhouette),
            "gap" => Ok(Self::Gap),
            number => count(number)
                .map(Self::Count)
                .map_err(|_| "a whole number from 1 to 255, `separated`, `silhouette` or `gap` is needed".to_owned()),
        }
    }
}

/// Two finite numbers `A,B`.
pub fn pair(text: &str) -> Result<[f32; 2], String> {
    let parts = text.split(',').map(finite).collect::<Result<Vec<_>, _>>()?;
    match *parts {
        [a, b] => Ok([a as f32, b as f32]),
        _ => Err("two numbers are needed, such as 5,9".to_owned()),
    }
}

/// Three finite numbers `X,Y,Z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triple(pub [f64; 3]);

impl FromStr for Triple {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split(',').map(finite).collect::<Result<Vec<_>, _>>()?;
        match *parts {
            [x, y, z] => Ok(Self([x, y, z])),
            _ => Err("three numbers are needed, such as 0,0,1".to_owned()),
        }
    }
}

/// The sides of a box: one length for all, or three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxSides(pub [f64; 3]);

impl FromStr for BoxSides {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match *text.split(',').map(positive).collect::<Result<Vec<_>, _>>()? {
            [side] => Ok(Self([side; 3])),
            [x, y, z] => Ok(Self([x, y, z])),
            _ => Err("one length or three are needed, such as 20 or 20,20,40".to_owned()),
        }
    }
}

/// One, two or three numbers of samples: `N`, `H,W` or `NZ,NY,NX`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Extent(pub Vec<usize>);

impl FromStr for Extent {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Result<Vec<usize>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        match parts {
            Ok(parts) if (1..=3).contains(&parts.len()) && parts.iter().all(|&n| n > 0) => Ok(Self(parts)),
            _ => Err("one, two or three whole numbers above zero are needed: N, H,W or NZ,NY,NX".to_owned()),
        }
    }
}

/// A particle shape and its fraction of the particles: `SHAPE` or `SHAPE=FRACTION`.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeShare {
    /// `sphere`, `box:A,B,C`, a mesh file, ...
    pub shape: String,
    /// Fraction by number of particles, if given.
    pub fraction: Option<f64>,
}

impl FromStr for ShapeShare {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("a shape is needed, such as sphere".to_owned());
        }
        match text.rsplit_once('=') {
            // A file name may contain `=`: only a number after it is a fraction.
            Some((shape, fraction)) if fraction.parse::<f64>().is_ok() => {
                let fraction = positive(fraction).map_err(|error| format!("the fraction after `=`: {error}"))?;
                Ok(Self {
                    shape: shape.to_owned(),
                    fraction: Some(fraction),
                })
            }
            _ => Ok(Self {
                shape: text.to_owned(),
                fraction: None,
            }),
        }
    }
}

/// Fractions that sum to one; shapes without a fraction share the remainder equally.
pub fn shares(shapes: &[ShapeShare]) -> Result<Vec<f64>, String> {
    let missing = shapes.iter().filter(|shape| shape.fraction.is_none()).count();
    let given: f64 = shapes.iter().filter_map(|shape| shape.fraction).sum();
    if missing == 0 {
        return Ok(shapes
            .iter()
            .filter_map(|shape| shape.fraction)
            .map(|fraction| fraction / given)
            .collect());
    }
    if given >= 1.0 {
        return Err("the given fractions sum to 1 or more and leave nothing for the shapes without one".to_owned());
    }
    let rest = (1.0 - given) / missing as f64;
    Ok(shapes.iter().map(|shape| shape.fraction.unwrap_or(rest)).collect())
}

#[cfg(test)]
mod tests {
    use super::{BinderArgument, Edges, Extent, PixelLength, ShapeShare, Triple, positive, shares};
    use stereology::grid::LengthUnit;

    #[test]
    fn numbers_are_finite_and_in_range() {
        for wrong in ["0", "-3", "nan", "inf", "1e400", "", "abc"] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
        assert_eq!(positive("1e3"), Ok(1000.0));
    }

    #[test]
    fn a_pixel_has_a_length_with_or_without_unit() {
        let parse = |text: &str| text.parse::<PixelLength>().map(|of| (of.length, of.unit));
        assert_eq!(parse("0.05"), Ok((0.05, None)));
        assert_eq!(parse("0.05mm"), Ok((0.05, Some(LengthUnit::Millimetre))));
        assert_eq!(parse("2e-3 µm"), Ok((0.002, Some(LengthUnit::Micrometre))));
        assert_eq!(parse("1in"), Ok((1.0, Some(LengthUnit::Inch))));
        for wrong in ["mm", "-1mm", "0mm", "1 furlong", "1e400m", ""] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn lists_are_checked() {
        assert_eq!("0,1,2.5".parse(), Ok(Edges(vec![0.0, 1.0, 2.5])));
        assert!("0,1,1".parse::<Edges>().is_err() && "1".parse::<Edges>().is_err());
        assert_eq!("1,2,255".parse(), Ok(BinderArgument::Colour([1, 2, 255])));
        assert!("1,2,256".parse::<BinderArgument>().is_err() && "1,2".parse::<BinderArgument>().is_err());
        assert_eq!("0,0,1".parse(), Ok(Triple([0.0, 0.0, 1.0])));
        assert_eq!("32,64".parse(), Ok(Extent(vec![32, 64])));
        assert!("0".parse::<Extent>().is_err() && "1,2,3,4".parse::<Extent>().is_err());
    }

    #[test]
    fn shapes_have_shares() {
        let parse = |text: &str| text.parse::<ShapeShare>().unwrap();
        assert_eq!(parse("box:1,2,3=0.25").fraction, Some(0.25));
        assert_eq!(parse("a=b.obj").shape, "a=b.obj");
        assert!("sphere=0".parse::<ShapeShare>().is_err());
        assert_eq!(shares(&[parse("sphere=3"), parse("rock:1=1")]).unwrap(), [0.75, 0.25]);
        assert_eq!(shares(&[parse("sphere"), parse("rock:1")]).unwrap(), [0.5, 0.5]);
        assert_eq!(shares(&[parse("sphere=0.2"), parse("rock:1")]).unwrap(), [0.2, 0.8]);
        assert!(shares(&[parse("sphere=1"), parse("rock:1")]).is_err());
    }
}
