//! The warnings the program can give: fixed codes, what each means, and what to do about it.

use serde_json::{Value, json};
pub use stereology::metrics::Finding as Warning;

/// Every code, in alphabetical order: (code, what it means, what to do). `docs/cli.md` and the report show this table.
pub const CODES: &[(&str, &str, &str)] = &[
    (
        "alpha-over-white",
        "Some of the photograph is transparent; it was laid over white.",
        "Save the photograph without transparency if that is not meant.",
    ),
    (
        "area-fraction",
        "Less than 1 % or more than 70 % of the photograph are profiles.",
        "Look at overlay.png; give the binder's colour with --binder, or import a label map with --labels FILE.",
    ),
    (
        "box-rounded",
        "The box's side was rounded to a whole number of periods of the texture, so that the solid repeats.",
        "Nothing, unless you need exactly that side: then choose --box as a multiple of the texture's period.",
    ),
    (
        "clipped-labels",
        "The largest label is exactly 255 or 65,535: the label map was probably cut off when it was saved.",
        "Save the labels with more bits (u16 or u32) and import them again.",
    ),
    (
        "coarse-texture",
        "A carved mesh has fewer triangles, or an atlas fewer pixels, than the texture asks for: it looks blurred.",
        "More --triangles, a larger --atlas, or a larger --period so that the texture is coarser on the mesh.",
    ),
    (
        "constant-exemplar",
        "The picture whose texture was asked for has one colour where it counts: there is no texture.",
        "Nothing, if the material is that smooth; otherwise look at the picture.",
    ),
    (
        "crowded-edges",
        "Some edges of the mesh have more than two triangles. The reconstruction takes all of them as neighbours.",
        "Nothing, or mend the mesh if that is not what you meant.",
    ),
    (
        "edge-heavy",
        "Many profiles touch the edge of the photograph.",
        "Take a photograph of a larger area: it should be at least ten times as wide as the largest profile.",
    ),
    (
        "few-profiles",
        "There are few profiles: every figure that follows from them is uncertain.",
        "Use a photograph of a larger area, or fewer --bins.",
    ),
    (
        "few-profiles-in-bin",
        "Some size bins hold fewer than five profiles: their densities are uncertain.",
        "Use fewer --bins, or photographs of a larger area.",
    ),
    (
        "few-samples",
        "Too few pixels lie inside particles (or binder) to take the texture's coarse statistics from.",
        "Nothing for fine textures; otherwise a photograph of higher resolution, or fewer --levels.",
    ),
    (
        "fewer-bins",
        "More size bins were asked for than there are profiles: so many bins as profiles were used.",
        "Give fewer --bins, or --bins auto, or photographs of a larger area.",
    ),
    (
        "fines-left-out",
        "The smallest sizes were left out of the packing, to keep the number of particles feasible.",
        "Give a smaller --box, or raise --min-size if they are not needed.",
    ),
    (
        "first-page",
        "The label TIFF has several pages; the first one was taken.",
        "Save the page that belongs to the photograph alone.",
    ),
    (
        "fraction-mismatch",
        "The particles' volume fraction by unfolding and the photograph's area fraction differ by more than 10 %, though on average they must agree.",
        "The shape is probably wrong (try another --shape), or many profiles were missed or merged (look at overlay.png).",
    ),
    (
        "largest-uncorrected",
        "The largest profiles are all of one size, so the largest particle size could not be extrapolated; the size of the largest profile was used.",
        "Give --max-size as a length, or leave it out.",
    ),
    (
        "levels-reduced",
        "The pyramid has fewer levels than asked for: the picture or the result is too small.",
        "Use a larger picture, or fewer --levels.",
    ),
    (
        "lost-labels",
        "Some outlines of the label file hold no pixel of their own (points, lines, slivers, or covered by others).",
        "Nothing, or correct them in the tool they come from.",
    ),
    (
        "measured-as-voxels",
        "Measurements lie outside the mesh, but are whole numbers that fit as numbers of voxels: they were taken as that.",
        "Say --measured-in voxels or --measured-in mesh.",
    ),
    (
        "measured-moved",
        "Measurements just outside the mesh were moved to the nearest voxel inside.",
        "Nothing for measurements on the surface; otherwise correct their places.",
    ),
    (
        "mesh-repaired",
        "The mesh was not quite a closed surface and was repaired.",
        "Look at `repairs`; mend the mesh if that is not what you meant.",
    ),
    (
        "near-minimum",
        "Many profiles are hardly larger than the smallest that is counted: smaller ones are probably missed.",
        "Use a photograph of higher resolution; the sizes below the threshold are not reported.",
    ),
    (
        "negative-bins",
        "Some unfolded number densities came out negative and were set to zero.",
        "Use as many --bins as the message names, a threshold (--min-size), or --method auto.",
    ),
    (
        "no-binder",
        "No single colour surrounds the particles: what is particle and what is binder is a guess.",
        "Give the binder's colour with --binder R,G,B, or import a label map with --labels FILE.",
    ),
    (
        "no-fringes",
        "No fringe lies wholly inside a slice or the exemplar: lengths and windings could not be measured.",
        "Nothing for textures without fringes; otherwise larger slices, or --period if the fringes are finer.",
    ),
    (
        "no-texture",
        "Too few pixels lie inside the particles (or the binder) to learn their texture: they were left plain.",
        "Use a photograph of higher resolution.",
    ),
    (
        "not-converged",
        "The estimate was still changing when the iteration limit was reached.",
        "Use fewer --bins, or --method nnls for comparison.",
    ),
    (
        "oscillating-bins",
        "Densities of neighbouring bins swing up and down: the counts cannot carry so many bins.",
        "Use as many --bins as the message names, --method auto, or photographs of a larger area.",
    ),
    (
        "overlapping-labels",
        "Outlines of the label file overlap; pixels in several went to the smallest.",
        "Correct the outlines in the tool they come from if that is not meant.",
    ),
    (
        "paper-normalisation",
        "The paper's normalisation counts one profile a hit, but planes through this body show more.",
        "Leave --paper out for densities; use it to compare with the paper's figures.",
    ),
    (
        "range-guessed",
        "The samples of a volume do not say which value is white; a range was taken from the data.",
        "Give --range LOW,HIGH (or --exemplar-range) if black and white are other values.",
    ),
    (
        "seeds-added",
        "Parts of the mesh hang together with no seed by voxels; each was given one.",
        "Nothing, or a higher --resolution, at which thin parts hang together.",
    ),
    (
        "self-intersection",
        "The mesh seems to cut through itself: sections show another number of profiles than its surface says.",
        "Mend the mesh (a boolean union in a mesh editor).",
    ),
    (
        "sharp-relief",
        "The displaced mesh cuts through itself.",
        "Smaller k, or a profile that rises less (sqrt), or a finer mesh (--edge-length).",
    ),
    (
        "slices-left-out",
        "The volume has more slices than are measured: they were taken at even distances.",
        "Nothing, or a larger --at-most.",
    ),
    (
        "small-labels",
        "Labels smaller than the smallest area that counts were left out.",
        "Lower --min-area to keep them.",
    ),
    (
        "split-label",
        "A label of the imported map is in several pieces; it was kept as one profile.",
        "Give each profile a label of its own if they are different particles.",
    ),
    (
        "threshold-moved",
        "The smallest size lies inside a profile bin, all of which was left out.",
        "Nothing, or choose --edges with an edge at --min-size.",
    ),
    (
        "unrealisable-distribution",
        "The mesh cannot hold the contact distribution: some distances found no place and moved towards the interface.",
        "More --units (the structure gets finer), or a distribution without the longest distances (contact --edit).",
    ),
    (
        "unstable-count",
        "The number of profiles changes much when the thresholds move a little.",
        "Look at overlay.png; import a label map with --labels FILE if the particles are not outlined well.",
    ),
    (
        "vague-binder",
        "The binder's colours go over into those of particles: outlines are approximate, and particles of the binder's own colours are missed.",
        "Look at overlay.png; give the binder's colour with --binder, or correct the labels by hand (--labels-out, --labels).",
    ),
];

/// What to do about a warning.
pub fn advice(warning: &Warning) -> Option<&'static str> {
    CODES
        .iter()
        .find(|(code, ..)| *code == warning.code)
        .map(|&(_, _, advice)| advice)
}

/// `{"code", "message"}`.
pub fn to_json(warning: &Warning) -> Value {
    json!({ "code": warning.code, "message": warning.message })
}

#[cfg(test)]
mod tests {
    use super::CODES;

    #[test]
    fn codes_are_sorted_and_unique() {
        assert!(CODES.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
