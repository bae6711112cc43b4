//! The Saltykov estimate as the program GrainSizeTools computes it, for comparison.
//!
//! The histogram has bins closed below. From the largest class down, the profiles of spheres of the class's middle size
//! are subtracted from the smaller classes, scaled by the probability of the largest class at its upper edge. Negative
//! classes are set to zero and the sum is normalised to 1.

/// Fractions of `bins` equal classes up to `largest`.
pub fn saltykov(profiles: &[f64], largest: f64, bins: usize) -> Vec<f64> {
    let width = largest / bins as f64;
    let mut shares = vec![0.0; bins];
    for size in profiles {
        shares[((size / width) as usize).min(bins - 1)] += 1.0;
    }
    let chance = |diameter: f64, from: f64, to: f64| {
        let half = |d: f64| (diameter * diameter - d * d).max(0.0).sqrt();
        (half(from) - half(to)) / diameter
    };
    let edge = |k: usize| k as f64 * width;
    for class in (1..bins).rev() {
        if shares[class] <= 0.0 {
            continue;
        }
        let own = chance(edge(class + 1), edge(class), edge(class + 1));
        for smaller in (0..class).rev() {
            shares[smaller] -=
                chance(edge(class) + 0.5 * width, edge(smaller), edge(smaller + 1)) * shares[class] / own;
        }
    }
    let whole: f64 = shares.iter().map(|share| share.max(0.0)).sum();
    shares.iter().map(|share| share.max(0.0) / whole).collect()
}
