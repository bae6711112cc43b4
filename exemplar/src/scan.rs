//! Orders in which the voxels of a box are visited.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::numbers::number;

/// An order of voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scan {
    /// x fastest, then y, then z.
    Lexicographic,
    /// A random order.
    Random,
    /// Z-curve: bits of z, y, x interleaved.
    Morton,
    /// Hilbert's curve generalised to any box, the default: nearly every step goes to a neighbour.
    #[default]
    Hilbert,
}

impl Scan {
    /// All voxels of a box of `size` (nz, ny, nx), each once, as (z ny + y) nx + x.
    ///
    /// Hilbert's curve steps to one of the 6 neighbours if all sides are even; with odd sides some steps are diagonal
    /// or skip one or two voxels. The box must have fewer than 2^31 voxels.
    ///
    /// # References
    ///
    /// urs-2012, section 2.4; the curve for any box: Červený's generalised curve (gilbert).
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_exemplar::Scan;
    ///
    /// assert_eq!(Scan::Morton.order([2, 2, 4], 0)[..6], [0, 1, 4, 5, 8, 9]);
    /// let path = Scan::Hilbert.order([1, 4, 4], 0);
    /// assert!(path.windows(2).all(|step| matches!(step[0].abs_diff(step[1]), 1 | 4)));
    /// ```
    #[must_use]
    pub fn order(self, size: [usize; 3], seed: u64) -> Vec<u32> {
        let n = size.iter().product::<usize>();
        match self {
            Self::Lexicographic => (0..number(n)).collect(),
            Self::Random => {
                let mut order: Vec<u32> = (0..number(n)).collect();
                order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                order
            }
            Self::Morton => morton(size),
            Self::Hilbert => hilbert(size),
        }
    }
}

fn morton([nz, ny, nx]: [usize; 3]) -> Vec<u32> {
    let mut order = Vec::with_capacity(nz * ny * nx);
    let side = nz.max(ny).max(nx).next_power_of_two();
    let mut open = vec![([0, 0, 0], side)];
    // Octants come from the stack in the order of their numbers; those wholly outside are skipped.
    while let Some(([z, y, x], side)) = open.pop() {
        if z >= nz || y >= ny || x >= nx {
            continue;
        }
        if side == 1 {
            order.push(number((z * ny + y) * nx + x));
            continue;
        }
        let half = side / 2;
        for octant in (0..8).rev() {
            let part = |bit: usize| (octant >> bit & 1) * half;
            open.push(([z + part(2), y + part(1), x + part(0)], half));
        }
    }
    order
}

type Step = [i64; 3];

fn hilbert([nz, ny, nx]: [usize; 3]) -> Vec<u32> {
    let along = |axis: usize, n: usize| {
        let mut step = [0; 3];
        step[axis] = n as i64;
        step
    };
    let (x, y, z) = (along(2, nx), along(1, ny), along(0, nz));
    let mut path = Vec::with_capacity(nz * ny * nx);
    #[allow(clippy::cast_possible_truncation, reason = "places of the box are not negative")]
    let mut visit = |[z, y, x]: Step| path.push(number((z as usize * ny + y as usize) * nx + x as usize));
    if nx >= ny && nx >= nz {
        curve([0; 3], x, y, z, &mut visit);
    } else if ny >= nx && ny >= nz {
        curve([0; 3], y, x, z, &mut visit);
    } else {
        curve([0; 3], z, x, y, &mut visit);
    }
    path
}

/// Visits the box with edges `a`, `b`, `c` at `p`, from `p` to the far end of `a`.
fn curve(p: Step, a: Step, b: Step, c: Step, visit: &mut impl FnMut(Step)) {
    let length = |v: Step| v.iter().sum::<i64>().abs();
    let unit = |v: Step| v.map(i64::signum);
    let plus = |u: Step, v: Step| [u[0] + v[0], u[1] + v[1], u[2] + v[2]];
    let minus = |u: Step, v: Step| [u[0] - v[0], u[1] - v[1], u[2] - v[2]];
    let negative = |v: Step| v.map(|i| -i);
    let (w, h, d) = (length(a), length(b), length(c));
    for (edge, n, others) in [(a, w, h * d), (b, h, w * d), (c, d, w * h)] {
        if others == 1 {
            let mut at = p;
            for _ in 0..n {
                visit(at);
                at = plus(at, unit(edge));
            }
            return;
        }
    }
    // Halves, of even length if possible.
    let half = |v: Step| {
        let half = v.map(|i| i.div_euclid(2));
        if length(half) % 2 == 1 && length(v) > 2 {
            plus(half, unit(v))
        } else {
            half
        }
    };
    let (a2, b2, c2) = (half(a), half(b), half(c));
    let (da, db, dc) = (unit(a), unit(b), unit(c));
    if 2 * w > 3 * h && 2 * w > 3 * d {
        curve(p, a2, b, c, visit);
        curve(plus(p, a2), minus(a, a2), b, c, visit);
    } else if 3 * h > 4 * d {
        curve(p, b2, c, a2, visit);
        curve(plus(p, b2), a, minus(b, b2), c, visit);
        let at = plus(p, plus(minus(a, da), minus(b2, db)));
        curve(at, negative(b2), c, negative(minus(a, a2)), visit);
    } else if 3 * d > 4 * h {
        curve(p, c2, a2, b, visit);
        curve(plus(p, c2), a, b, minus(c, c2), visit);
        let at = plus(p, plus(minus(a, da), minus(c2, dc)));
        curve(at, negative(c2), negative(minus(a, a2)), b, visit);
    } else {
        curve(p, b2, c2, a2, visit);
        curve(plus(p, b2), c, a2, minus(b, b2), visit);
        let at = plus(p, plus(minus(b2, db), minus(c, dc)));
        curve(at, a, negative(b2), negative(minus(c, c2)), visit);
        let at = plus(p, plus(minus(a, da), plus(b2, minus(c, dc))));
        curve(at, negative(c), negative(minus(a, a2)), minus(b, b2), visit);
        let at = plus(p, plus(minus(a, da), minus(b2, db)));
        curve(at, negative(b2), c2, negative(minus(a, a2)), visit);
    }
}

#[cfg(test)]
mod tests {
    use super::Scan;
    use crate::numbers::number;
    use proptest::prelude::*;

    fn steps(size: [usize; 3]) -> Vec<[usize; 3]> {
        let [_, ny, nx] = size;
        let at = |i: u32| [i as usize / (ny * nx), i as usize / nx % ny, i as usize % nx];
        let path = Scan::Hilbert.order(size, 0);
        path.windows(2)
            .map(|pair| std::array::from_fn(|axis| at(pair[0])[axis].abs_diff(at(pair[1])[axis])))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Every voxel of any box is visited once.
        #[test]
        fn scans_are_bijections(nz in 1_usize..20, ny in 1_usize..20, nx in 1_usize..20, seed in 0_u64..9) {
            for scan in [Scan::Lexicographic, Scan::Random, Scan::Morton, Scan::Hilbert] {
                let mut order = scan.order([nz, ny, nx], seed);
                order.sort_unstable();
                prop_assert_eq!(order, (0..number(nz * ny * nx)).collect::<Vec<_>>());
            }
        }

        /// Hilbert's curve steps to a face neighbour where all sides are even.
        #[test]
        fn even_boxes_are_walked_without_a_jump(nz in 1_usize..12, ny in 1_usize..12, nx in 1_usize..12) {
            for step in steps([2 * nz, 2 * ny, 2 * nx]) {
                prop_assert_eq!(step.iter().sum::<usize>(), 1, "{:?}", step);
            }
        }
    }

    /// Where sides are odd a step may be diagonal or pass over two voxels, no more.
    #[test]
    fn odd_boxes_are_walked_with_small_steps() {
        for size in (0..12_usize.pow(3)).map(|i| [1 + i % 12, 1 + i / 12 % 12, 1 + i / 144]) {
            let longest = steps(size).into_iter().flatten().max().unwrap_or(0);
            assert!(longest <= 3, "{size:?} {longest}");
        }
    }

    #[test]
    fn morton_interleaves_bits() {
        let order = Scan::Morton.order([8, 8, 8], 0);
        for (code, &at) in order.iter().enumerate() {
            let spread = |i: u32| (0..3).map(|bit| (i >> bit & 1) << (3 * bit)).sum::<u32>();
            let (z, y, x) = (at / 64, at / 8 % 8, at % 8);
            assert_eq!(number(code), spread(z) << 2 | spread(y) << 1 | spread(x));
        }
    }
}
