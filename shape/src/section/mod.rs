//! Sections by planes: outlines, areas, the largest section.

pub(crate) mod largest_section;
pub(crate) mod section_areas;
pub(crate) mod slicer;
