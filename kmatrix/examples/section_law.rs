//! What do random sections of a body look like? `cargo run --release -p stereology-kmatrix --example section_law
//! [SHAPE] [TOLERANCE]`
//!
//! SHAPE is `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED` or a mesh file; a box of 1 by 2 by 3
//! if none is given.

#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;
use stereology_kmatrix::{SectionLaw, SectionOptions};
use stereology_shape::Body;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let shape = arguments.next().unwrap_or_else(|| "box:1,2,3".to_owned());
    let tolerance = arguments.next().map_or(Ok(3e-3), |word| word.parse())?;

    let body = Body::parse(&shape)?;
    let law = SectionLaw::of_body(&body, &SectionOptions::default().with_tolerance(tolerance))?;

    println!(
        "{shape}: volume {:.6}, surface {:.6}, size {:.6}",
        law.volume(),
        law.surface_area(),
        law.size()
    );
    println!(
        "mean caliper of the hull {:.6}, effective {:.6} ± {:.1e}: {:.4} profiles a hit",
        law.caliper_hull(),
        law.caliper_effective(),
        law.caliper_effective_standard_error(),
        law.profiles_per_hit()
    );
    println!(
        "K, 10 bins, standard error {:.1e} from {} directions:",
        law.standard_error(10),
        law.directions()
    );
    for row in law.k_matrix(10).row_iter() {
        println!("{}", row.iter().map(|entry| format!("{entry:8.5}")).collect::<String>());
    }
    Ok(())
}
