//! The gallery of reliefs.

use askama::Template;
use serde::Serialize;

/// Random reliefs on one mesh: a page that shows the images `pictures/NAME.png` beside it and refers to
/// `designs/NAME.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Gallery<R> {
    /// File name of the mesh.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Seed of the random choices.
    pub seed: u64,
    /// The command that generated the gallery.
    pub command: String,
    /// Ranges from which parameters were drawn: an object with `units`, `lengths`, `scales` (pairs of numbers) and
    /// `contact`.
    pub ranges: R,
    /// The reliefs.
    pub candidates: Vec<Candidate>,
}

/// One relief.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// Its number, with leading zeros.
    pub name: String,
    /// Half the longest side of the mesh's bounding box, in units of the distribution.
    pub units: f64,
    /// Fraction of the positive region.
    pub positive_share: f64,
    /// Mean distance to the interface, in units of the distribution.
    pub mean_distance: f64,
    /// Displacement of the negative region.
    pub negative: Displacement,
    /// Displacement of the positive region.
    pub positive: Displacement,
    /// Root mean square displacement, in halves of the longest side of the bounding box.
    pub roughness: f64,
    /// Wasserstein-1 distance of the labels from the distribution, in bins.
    pub emd_labels: f64,
    /// The same for distances measured on the mesh; `None` if there is only one region.
    pub emd_measured: Option<f64>,
    /// Fraction of the labels in another bin than requested.
    pub misplaced: f64,
    /// The contact distribution.
    pub histogram: Histogram,
}

/// How a region is displaced.
#[derive(Clone, Debug, Serialize)]
pub struct Displacement {
    /// `in`, `out` or `none`.
    pub direction: &'static str,
    /// Scale of the displacement.
    pub scale: f64,
    /// Function of the distance: `x`, `sqrt` or a table.
    pub profile: String,
}

/// Fractions of points by distance to the interface.
#[derive(Clone, Debug, Serialize)]
pub struct Histogram {
    /// In the negative region, from the interface outwards.
    pub negative: Vec<f64>,
    /// In the positive region, from the interface outwards.
    pub positive: Vec<f64>,
}

#[derive(Template)]
#[template(path = "gallery.html")]
struct GalleryPage<'a, R: Serialize> {
    gallery: &'a Gallery<R>,
}

impl<R: Serialize> Gallery<R> {
    /// The gallery as HTML.
    ///
    /// # Errors
    ///
    /// [`askama::Error`] if `ranges` cannot be serialised.
    pub fn page(&self) -> Result<String, askama::Error> {
        GalleryPage { gallery: self }.render()
    }
}

#[cfg(test)]
mod tests {
    use super::Gallery;

    #[test]
    fn data_cannot_end_the_script() {
        let gallery = Gallery {
            mesh: "</script><b><!--<script>.obj".to_owned(),
            triangles: 2,
            seed: 0,
            command: String::new(),
            ranges: [1.0, 2.0],
            candidates: Vec::new(),
        };
        let page = gallery.page().unwrap();
        assert_eq!(page.matches("</script>").count(), 1);
        assert!(page.contains("\\u003c/script") && !page.contains("<!--"));
    }
}
