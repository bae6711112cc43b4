//! HTML pages and plots of results.
//!
//! - [`SynthesisReport`]: the page from which a reader decides whether to trust a solid.
//! - [`MeasureReport`]: the slices of a volume compared with an exemplar.
//! - [`Gallery`]: random reliefs on a mesh, to filter, sort and choose from.
//!
//! Every page is an askama template, so that text from outside is escaped. A page contains nothing that differs between
//! two runs with the same inputs and seed. The first two are single files without scripts and links: images and plots
//! are inside. The gallery refers to images beside it.
//!
//! The alternative to templates was to push strings: text and markup were then hard to tell apart, and one forgotten
//! call of the escaping function was enough for a file name to become markup.

mod checks;
mod data_url;
mod figures;
mod gallery;
mod measures;
mod number;
mod of_synthesis;
mod page;
mod plot;
mod size_plots;

pub use figures::{
    CategoryFigures, ComparisonFigures, PackingFigures, PhotoFigures, Remark, SectionFigures, SizeFigures,
    SynthesisReport,
};
pub use gallery::{Candidate, Displacement, Gallery, Histogram};
pub use measures::{MeasureReport, PhaseRow};
pub use number::{counted, percent, significant};
pub use of_synthesis::{Invocation, SolidImages};
pub use page::synthesis_page;

#[cfg(test)]
mod tests;
