//! Operations on pixel and voxel grids that several crates need: distance transform, Otsu threshold, connected
//! components, Gaussian filter, colour spaces.
//!
//! Every function takes plain values (`ndarray` views, slices, `[f32; 3]` colours) and cannot fail. Images have axes
//! (y, x), volumes (z, y, x). The tests compare each function with a closed form or with a brute-force search.
//!
//! # Examples
//!
//! The particles of a grey image: a threshold, the connected components above it, and the depth of the deepest pixel of
//! each.
//!
//! ```
//! use ndarray::Array2;
//! use stereology_imaging::{connected_components, distance_transform, otsu};
//!
//! let image = Array2::from_shape_fn((9, 20), |(y, x)| if (2..7).contains(&y) && x % 10 > 4 { 200_u8 } else { 40 });
//! let mut counts = [0_u64; 256];
//! image.iter().for_each(|&level| counts[usize::from(level)] += 1);
//! let threshold = otsu(&counts).expect("two grey levels");
//! let mask = image.mapv(|level| f64::from(level) > threshold);
//!
//! let (components, count) = connected_components(mask.view(), |m| m);
//! let mut depths = vec![0.0_f32; count as usize + 1];
//! for (&component, &d) in components.iter().zip(&distance_transform(mask.view())) {
//!     depths[component as usize] = depths[component as usize].max(d);
//! }
//! // The second particle reaches the edge of the image, which does not count as outside.
//! assert_eq!(depths, [0.0, 3.0, 3.0]);
//! ```
//!
//! Colours: encoded values to linear light and to CIE L\*a\*b\*.
//!
//! ```
//! use stereology_imaging::{lab, linear};
//!
//! assert!((linear(0.5) - 0.214).abs() < 1e-3);
//! assert!((lab([1.0, 1.0, 1.0])[0] - 100.0).abs() < 0.01);
//! ```

mod area_average;
mod components;
mod disjoint_sets;
mod distance_transform;
mod gaussian;
mod gaussian_dilation;
mod lab;
mod otsu;
mod point_spread;
mod srgb;

pub use area_average::area_average_rgb;
pub use components::{Connectivity, connected_components, label_components, label_components_3d};
pub use disjoint_sets::DisjointSets;
pub use distance_transform::{distance_to_other_region, distance_transform, squared_distance_transform};
pub use gaussian::{gaussian_filter, gaussian_filter_rgb};
pub use gaussian_dilation::gaussian_dilation;
pub use lab::{lab, lab_image};
pub use otsu::otsu;
pub use point_spread::point_spread;
pub use srgb::{encoded, encoded_byte, linear};
