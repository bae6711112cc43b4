//! Warnings of the program: fixed codes, meanings and advice.

use schemars::JsonSchema;
use serde::Serialize;
pub use stereology::metrics::Finding as Warning;

/// All codes in alphabetical order: (code, meaning, what to do). `docs/cli.md` and the report show this table.
pub const CODES: &[(&str, &str, &str)] = &[
    (
        "alpha-over-white",
        "Parts of the photograph are transparent; they were composited over white.",
        "Save the photograph without transparency if this is not intended.",
    ),
    (
        "area-and-size-disagree",
        "The sizes of the profiles contradict their areas or bounding boxes: other units, radii, Feret diameters, or areas in the column of sizes.",
        "Correct the table: `size` is the diameter of the circle with the profile's area, in the unit of all other lengths.",
    ),
    (
        "area-fraction",
        "Profiles cover less than 1 % or more than 70 % of the photograph.",
        "Look at overlay.png; give the colour of the binder with --binder, or import a label map with --labels FILE.",
    ),
    (
        "beyond-heeger-bergen",
        "The image has structures (edges, chips, layers, two phases) that the synthesis of sub-bands does not reproduce: slices of the result are distinguishable from it.",
        "Use `stereology exemplar`, which copies pixels; for layers or fibres, --mode oriented with one image per axis.",
    ),
    (
        "binder-colour",
        "The palette of a label PNG has black at another place than 0; black was taken as the binder.",
        "Nothing; otherwise save the labels as a grey PNG or TIFF, 0 for the binder.",
    ),
    (
        "binder-numbers",
        "Pixels of the label map are -1 or not numbers, or it has the background 1 of OpenCV's watershed; they were taken as the binder.",
        "Nothing; otherwise save the labels with 0 for the binder.",
    ),
    (
        "box-rounded",
        "The box's side was rounded to a whole number of periods of the texture, so that the solid repeats.",
        "Nothing, unless you need exactly that side; then give --box as a multiple of the texture's period.",
    ),
    (
        "clipped-labels",
        "The largest label is exactly 255 or 65,535: the label map was probably clipped when it was saved.",
        "Save the labels with more bits (u16 or u32) and import them again.",
    ),
    (
        "clipped-outlines",
        "Outlines of the label file extend beyond the photograph; they were clipped at its edges.",
        "Check that the outlines belong to this photograph and that it was not cropped.",
    ),
    (
        "clustered",
        "The profiles are clustered: their number varies more than that of independent profiles.",
        "Nothing: the intervals contain it, unless --resample counts was given; several photographs of other places make them narrower.",
    ),
    (
        "coarse-texture",
        "A carved mesh has fewer triangles, or an atlas fewer pixels, than the texture requires: it looks blurred.",
        "Give more --triangles, a larger --atlas, or a larger --period, which makes the texture coarser on the mesh.",
    ),
    (
        "colour-labels",
        "The label map is an image in colours: each colour was taken as a profile, black, the transparent, or the colour at the edges as the binder.",
        "Nothing if each profile has a colour of its own; otherwise export numbers.",
    ),
    (
        "colour-profile",
        "The image has an ICC profile other than sRGB: its colours were converted to sRGB, or could not be.",
        "Nothing if they were converted; otherwise save the image in sRGB.",
    ),
    (
        "constant-exemplar",
        "The example image has a single colour in the relevant region, so it has no texture.",
        "Nothing, if the material is smooth; otherwise check the image.",
    ),
    (
        "crowded-edges",
        "Some edges of the mesh have more than two triangles. The reconstruction treats all of them as neighbours.",
        "Nothing, or repair the mesh if this is not intended.",
    ),
    (
        "duplicate-rows",
        "Many sizes of profiles occur more than once, more often than their resolution explains: rows of the table were probably repeated.",
        "Remove the repeated rows: they make intervals too narrow and densities too large.",
    ),
    (
        "edge-heavy",
        "Many profiles touch the edge of the photograph.",
        "Take a photograph of a larger area: it should be at least ten times as wide as the largest profile.",
    ),
    (
        "exif-orientation",
        "The photograph or the label map notes an orientation, and it cannot be seen whether the labels belong to the upright photograph or to the pixels as stored.",
        "Look at overlay.png; give --exif apply or --exif ignore.",
    ),
    (
        "few-profiles",
        "There are few profiles: all results that depend on them are uncertain.",
        "Use a photograph of a larger area, or fewer --bins.",
    ),
    (
        "few-profiles-in-bin",
        "Some size bins contain fewer than five profiles: their densities are uncertain.",
        "Use fewer --bins, or photographs of a larger area.",
    ),
    (
        "few-samples",
        "Too few pixels lie inside particles (or binder) to measure the coarse statistics of the texture.",
        "Nothing for fine textures; otherwise a photograph of higher resolution, or fewer --levels.",
    ),
    (
        "fewer-bins",
        "More size bins were requested than there are profiles: as many bins as profiles were used.",
        "Give fewer --bins, or --bins auto, or photographs of a larger area.",
    ),
    (
        "fines-left-out",
        "The smallest sizes were left out of the packing to limit the number of particles.",
        "Give a smaller --box, or raise --min-size if they are not needed.",
    ),
    (
        "first-page",
        "The TIFF is a stack of images; the first one was taken.",
        "Save only the page that belongs to the photograph.",
    ),
    (
        "fraction-mismatch",
        "The unfolded volume fraction and the area fraction of the photograph differ by more than 10 %, although their expectations are equal.",
        "The shape is probably wrong (try another --shape), or many profiles were missed or merged (look at overlay.png).",
    ),
    (
        "halo",
        "Regions along particles, with colours between theirs and that of the binder, were left out: blur or compression.",
        "Look at overlay.png; use a photograph that is sharper or compressed less if they are particles.",
    ),
    (
        "holes-filled",
        "Holes in labels of an imported label map were filled.",
        "Give --holes keep if they are binder.",
    ),
    (
        "impossible-area",
        "The profiles cover more than the examined area, beyond the error of counting, or one profile is larger than it.",
        "Check --area and its unit, and whether the sizes are diameters or areas.",
    ),
    (
        "invalid-rows",
        "Rows of a table with invalid values were left out, as requested.",
        "Look at the first of them: missing values of a few particles bias the sizes if they are not missing at random.",
    ),
    (
        "labels-turned",
        "The labels belong to the photograph's pixels as stored; they were turned with the photograph.",
        "Nothing; --exif ignore leaves both as stored.",
    ),
    (
        "largest-uncorrected",
        "The largest profiles all have the same size, so the largest particle size could not be extrapolated; the size of the largest profile was used.",
        "Give --max-size as a length, or omit it.",
    ),
    (
        "levels-reduced",
        "The pyramid has fewer levels than requested: the image or the result is too small.",
        "Use a larger image, or fewer --levels.",
    ),
    (
        "lost-labels",
        "Some outlines of the label file contain no pixel of their own (points, lines, slivers, or covered by others).",
        "Nothing, or correct them in the tool that made them.",
    ),
    (
        "main-page",
        "The TIFF has thumbnails or levels of a pyramid; the largest page, or that of the photograph's size, was read.",
        "Nothing, or save only the page that is meant.",
    ),
    (
        "mask-split",
        "The label map has a single value besides 0, a mask: each connected component was taken as a profile.",
        "Export a label image if particles touch: they are one profile now.",
    ),
    (
        "measured-as-voxels",
        "Measurements lie outside the mesh, but are valid voxel indices: they were taken as voxel indices.",
        "Give --measured-in voxels or --measured-in mesh.",
    ),
    (
        "measured-moved",
        "Measurements just outside the mesh were moved to the nearest voxel inside.",
        "Nothing for measurements on the surface; otherwise correct their positions.",
    ),
    (
        "merged-category",
        "No profile of a colour category is above the detection limit: its particles are counted in the nearest category.",
        "Nothing, or give fewer --categories.",
    ),
    (
        "mesh-repaired",
        "The mesh was not quite a closed surface and was repaired.",
        "Read `repairs`; repair the mesh yourself if they are not intended.",
    ),
    (
        "missing-fines",
        "There are no profiles below the smallest one, where sections of the larger particles alone would show some: small profiles were not detected.",
        "Give the smallest size that is detected reliably with --min-size.",
    ),
    (
        "near-minimum",
        "Many profiles are close to the smallest size that is counted: smaller ones are probably missed.",
        "Use a photograph of higher resolution; sizes below the detection limit are not reported.",
    ),
    (
        "negative-bins",
        "Some unfolded number densities were negative and were set to zero.",
        "Use the number of --bins that the message names, a detection limit (--min-size), or --method auto.",
    ),
    (
        "no-binder",
        "No single colour surrounds the particles, so the separation of particles and binder is a guess.",
        "Give the colour of the binder with --binder R,G,B, or import a label map with --labels FILE.",
    ),
    (
        "no-fringes",
        "No fringe lies entirely inside a slice or the exemplar: lengths and tortuosities could not be measured.",
        "Nothing for textures without fringes; otherwise larger slices, or --period if the fringes are finer.",
    ),
    (
        "no-texture",
        "Too few pixels lie inside the particles (or the binder) to measure their texture: they have a uniform colour.",
        "Use a photograph of higher resolution.",
    ),
    (
        "not-converged",
        "The estimate was still changing when the iteration limit was reached.",
        "Use fewer --bins, or --method nnls for comparison.",
    ),
    (
        "oscillating-bins",
        "Densities of neighbouring bins oscillate: there are too few profiles for that many bins.",
        "Use the number of --bins that the message names, --method auto, or photographs of a larger area.",
    ),
    (
        "other-slices",
        "The regions of an ImageJ archive belong to several slices; those of the first one were taken.",
        "Save only the regions that belong to the photograph.",
    ),
    (
        "outlier",
        "The largest profile is far larger than the next ones.",
        "Check whether it is a profile of a particle; if not, remove it.",
    ),
    (
        "overlapping-labels",
        "Outlines of the label file overlap; pixels in several outlines were assigned to the smallest.",
        "Correct the outlines in the tool that made them if this is not intended.",
    ),
    (
        "paper-normalisation",
        "The paper's normalisation assumes one profile per intersecting plane, but this body shows more.",
        "Omit --paper for densities; use it only for comparison with the paper.",
    ),
    (
        "poor-fit",
        "No size distribution of particles of this shape explains the profiles.",
        "Try another --shape; check the edge rule, the detection limit (--min-size) and the segmentation.",
    ),
    (
        "range-guessed",
        "The samples of a volume do not define which value is white; the range was taken from the data.",
        "Give --range LOW,HIGH (or --exemplar-range) if black and white have other values.",
    ),
    (
        "rounded-sizes",
        "The sizes of the profiles are rounded to coarse steps, or all equal.",
        "Use sizes that are not rounded.",
    ),
    (
        "seeds-added",
        "Some connected components of the voxels had no seed; each got one.",
        "Nothing, or give a higher --resolution, at which thin parts are connected.",
    ),
    (
        "self-intersection",
        "The mesh probably intersects itself: the number of profiles on sections disagrees with the curvature of its surface.",
        "Repair the mesh (a boolean union in a mesh editor).",
    ),
    (
        "sharp-relief",
        "The displaced mesh intersects itself.",
        "Use a smaller scale k, the function sqrt, or a finer mesh (--edge-length).",
    ),
    (
        "slices-left-out",
        "The volume has more slices than were measured; evenly spaced slices were taken.",
        "Nothing, or give a larger --at-most.",
    ),
    (
        "small-labels",
        "Labels smaller than the minimum area were left out.",
        "Lower --min-area to keep them.",
    ),
    (
        "split-label",
        "A label of the imported map has several connected components; it was kept as one profile.",
        "Give each component its own label if they are different particles.",
    ),
    (
        "table-format",
        "A table is not plain (comma-separated UTF-8 with decimal points): the message states encoding, separator and decimal mark that were found.",
        "Check them. If the decimal mark is undecided, write the numbers without marks between thousands, or with another number of decimals.",
    ),
    (
        "table-layout",
        "Something in the layout of a table was interpreted: a column by another name, lines above the header, a header in a comment, rows of statistics, names of rows, a missing header, the order of bins.",
        "Check the message; a plain table with the columns `size` or `area` raises no warning.",
    ),
    (
        "table-unit",
        "The header of a table states the unit of a column, in which lengths are, or from which they were converted to --unit.",
        "Check that --area and other lengths are in the unit of the message.",
    ),
    (
        "threshold-moved",
        "The detection limit lies inside a profile bin; the whole bin was left out.",
        "Nothing, or give --edges with an edge at --min-size.",
    ),
    (
        "unrealisable-distribution",
        "The mesh cannot have this contact distribution: some labels found no place and moved towards the interface.",
        "Give more --units (a finer structure), or a distribution without the longest distances (contact --edit).",
    ),
    (
        "unstable-count",
        "The number of profiles changes strongly with small changes of the thresholds.",
        "Look at overlay.png; import a label map with --labels FILE if the particles are not outlined well.",
    ),
    (
        "unused-option",
        "An option has no effect beside the others.",
        "Leave it out, or give the option that the message names.",
    ),
    (
        "vague-binder",
        "Binder and particle colours overlap: outlines are approximate, and particles with colours of the binder are missed.",
        "Look at overlay.png; give the colour of the binder with --binder, or correct the labels by hand (--labels-out, --labels).",
    ),
    (
        "words-as-numbers",
        "Categories or types of a table are words or numbers with gaps, and were numbered; or its types are kinds of selections (ImageJ) and were ignored.",
        "Check the numbers in the message: types are the indices of --shape in the order of the command line.",
    ),
];

/// What to do about a warning with this code.
pub fn advice(code: &str) -> Option<&'static str> {
    CODES.iter().find(|(of, ..)| *of == code).map(|&(_, _, advice)| advice)
}

/// A warning in JSON.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Record {
    /// Fixed code.
    pub code: String,
    /// What was found.
    pub message: String,
}

impl From<&Warning> for Record {
    fn from(warning: &Warning) -> Self {
        Self {
            code: warning.code.to_owned(),
            message: warning.message.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::CODES;

    #[test]
    fn codes_are_sorted_and_unique() {
        assert!(CODES.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
