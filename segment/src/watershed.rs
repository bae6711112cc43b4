//! Touching particles apart: distance transform, h-maxima, watershed.

use std::{cmp::Reverse, collections::BinaryHeap};

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use crate::{
    lab::{gaussian, mirror},
    regions::{neighbours4, neighbours8},
};

/// Euclidean distance of every pixel of a mask to the nearest pixel outside it, 0 outside; the photo's edge is no outside. Infinite if the mask is everything.
///
/// # Complexity
///
/// Linear in pixels (Felzenszwalb & Huttenlocher 2012).
///
/// # Examples
///
/// ```
/// let mask = ndarray::Array2::from_shape_fn((1, 7), |(_, x)| x > 0);
/// assert_eq!(stereology_segment::distance_transform(&mask)[[0, 5]], 5.0);
/// ```
#[must_use]
pub fn distance_transform(mask: &Array2<bool>) -> Array2<f32> {
    let (height, width) = mask.dim();
    // Distance along the column, then the lower envelope of parabolas along the row.
    let mut column = Array2::from_elem((height, width), f32::INFINITY);
    for y in 0..height {
        for x in 0..width {
            column[[y, x]] = match (mask[[y, x]], y) {
                (false, _) => 0.0,
                (true, 0) => f32::INFINITY,
                (true, _) => column[[y - 1, x]] + 1.0,
            };
        }
    }
    for y in (0..height.saturating_sub(1)).rev() {
        for x in 0..width {
            let below = column[[y + 1, x]] + 1.0;
            if below < column[[y, x]] {
                column[[y, x]] = below;
            }
        }
    }
    let mut out = column.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let heights: Vec<f64> = column.row(y).iter().map(|d| f64::from(*d).powi(2)).collect();
            for (d, squared) in row.iter_mut().zip(lower_envelope(&heights)) {
                *d = squared.sqrt() as f32;
            }
        });
    out
}

/// min over q of (p − q)² + f(q), for every p.
fn lower_envelope(f: &[f64]) -> Vec<f64> {
    let mut vertices: Vec<(usize, f64)> = Vec::new(); // parabola and where it takes over
    for (q, &fq) in f.iter().enumerate() {
        if fq.is_infinite() {
            continue;
        }
        let mut from = f64::NEG_INFINITY;
        while let Some(&(v, start)) = vertices.last() {
            let (q2, v2) = ((q * q) as f64, (v * v) as f64);
            from = ((fq + q2) - (f[v] + v2)) / (2 * (q - v)) as f64;
            if from > start {
                break;
            }
            vertices.pop();
            from = f64::NEG_INFINITY;
        }
        vertices.push((q, from));
    }
    let mut k = 0;
    (0..f.len())
        .map(|p| {
            while vertices.get(k + 1).is_some_and(|next| next.1 < p as f64) {
                k += 1;
            }
            vertices
                .get(k)
                .map_or(f64::INFINITY, |&(v, _)| (p as f64 - v as f64).powi(2) + f[v])
        })
        .collect()
}

/// Gaussian smoothing of a field, mirrored at the edges. Zero sigma leaves it as it is.
///
/// # Examples
///
/// ```
/// let field = ndarray::Array2::from_elem((4, 5), 3.0_f32);
/// assert!((stereology_segment::smooth_field(&field, 1.5)[[0, 0]] - 3.0).abs() < 1e-5);
/// ```
#[must_use]
pub fn smooth_field(field: &Array2<f32>, sigma: f32) -> Array2<f32> {
    let Some(kernel) = gaussian(sigma) else {
        return field.clone();
    };
    let (height, width) = field.dim();
    let mut across = field.clone();
    across
        .axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            let source = field.row(y);
            for (x, out) in row.iter_mut().enumerate() {
                let sides = kernel.iter().enumerate().skip(1);
                let sum: f32 = sides
                    .map(|(i, w)| w * (source[mirror(x, -(i as isize), width)] + source[mirror(x, i as isize, width)]))
                    .sum();
                *out = kernel[0] * source[x] + sum;
            }
        });
    let mut out = field.clone();
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .enumerate()
        .for_each(|(y, mut row)| {
            row.assign(&across.row(y));
            row *= kernel[0];
            for (i, w) in kernel.iter().enumerate().skip(1) {
                row.scaled_add(*w, &across.row(mirror(y, -(i as isize), height)));
                row.scaled_add(*w, &across.row(mirror(y, i as isize, height)));
            }
        });
    out
}

/// Maxima of a positive field that stand at least `h(place, height)`, place being (y, x), above the saddle to any higher one: a number from 1 for each at its peak pixel, in order of decreasing height, 0 elsewhere.
///
/// Pixels are taken from the highest down and joined; where two hills meet, the lower one ends if it stands out less than `h` of its height. Heights are compared in steps of 1/64.
///
/// # Complexity
///
/// Linear in pixels but for the inverse Ackermann function.
///
/// # Examples
///
/// ```
/// let field = ndarray::array![[1.0_f32, 3.0, 2.5, 2.8, 1.0, 5.0]];
/// let peaks = stereology_segment::h_maxima(&field, |_, _| 1.0);
/// assert_eq!(peaks, ndarray::array![[0, 2, 0, 0, 0, 1]]);
/// ```
#[must_use]
pub fn h_maxima(field: &Array2<f32>, h: impl Fn([usize; 2], f32) -> f32) -> Array2<u32> {
    const NONE: u32 = u32::MAX;
    let (_, width) = field.dim();
    let quantised = |v: f32| (v.clamp(0.0, 16_000.0) * 64.0) as usize;
    // Counting sort, highest first, ties in reading order.
    let top = field.iter().map(|v| quantised(*v)).max().unwrap_or(0);
    let mut starts = vec![0_usize; top + 2];
    field.iter().for_each(|v| starts[top - quantised(*v) + 1] += 1);
    (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
    let positive = starts[top]; // those of height 0 come last
    let mut order = vec![0_u32; field.len()];
    for (i, v) in field.iter().enumerate() {
        let slot = &mut starts[top - quantised(*v)];
        order[*slot] = i as u32; // pictures have fewer than 2³² pixels
        *slot += 1;
    }
    let height = |i: u32| field[[i as usize / width, i as usize % width]];
    let mut parent = vec![NONE; field.len()];
    let mut ended = vec![false; field.len()]; // per root: its hill was joined to a higher one it does not stand out from
    fn find(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            let up = parent[parent[i as usize] as usize];
            parent[i as usize] = up;
            i = up;
        }
        i
    }
    let mut peaks: Vec<u32> = Vec::new();
    for &i in &order[..positive] {
        parent[i as usize] = i;
        let mut hill = i;
        for q in neighbours8([i as usize / width, i as usize % width], field.dim()) {
            let q = (q[0] * width + q[1]) as u32;
            if parent[q as usize] == NONE {
                continue;
            }
            let other = find(&mut parent, q);
            let this = find(&mut parent, hill);
            if other == this {
                continue;
            }
            // The root of a hill is its peak; the higher peak goes on, the earlier in reading order of equals.
            let (high, low) = if (height(other), Reverse(other)) > (height(this), Reverse(this)) {
                (other, this)
            } else {
                (this, other)
            };
            if low != i && height(low) - height(i) >= h([low as usize / width, low as usize % width], height(low)) {
                peaks.push(low);
            }
            ended[low as usize] = true;
            parent[low as usize] = high;
            hill = high;
        }
    }
    peaks.extend(order[..positive].iter().copied().filter(|&i| !ended[i as usize]));
    peaks.sort_by(|&a, &b| height(b).total_cmp(&height(a)).then(a.cmp(&b)));
    let mut out = Array2::zeros(field.dim());
    for (number, i) in (1..).zip(peaks) {
        out[[i as usize / width, i as usize % width]] = number;
    }
    out
}

/// Watershed by priority flood: markers grow over the pixels of `mask` from the highest down, until they meet. Parts of the mask that no marker reaches stay 0.
///
/// # Complexity
///
/// n log n in the pixels of the mask.
///
/// # References
///
/// Meyer 1994; Barnes, Lehman & Mulla 2014.
///
/// # Examples
///
/// ```
/// use ndarray::{Array2, array};
/// let field = array![[3.0_f32, 2.0, 1.0, 2.0, 3.0, 0.0]];
/// let labels = stereology_segment::watershed(&field, &array![[1, 0, 0, 0, 2, 0]], &field.mapv(|v| v > 0.0));
/// assert_eq!(labels, array![[1, 1, 1, 2, 2, 0]]);
/// ```
#[must_use]
pub fn watershed(field: &Array2<f32>, markers: &Array2<u32>, mask: &Array2<bool>) -> Array2<u32> {
    let (_, width) = field.dim();
    let mut labels = markers.clone();
    let mut heap = BinaryHeap::new();
    let key = |v: f32| v.max(0.0).to_bits(); // bits of positive floats are in the order of the floats
    let mut turn = 0_u32;
    let mut push = |heap: &mut BinaryHeap<(u32, Reverse<u32>, u32)>, q: [usize; 2], below: u32| {
        heap.push((key(field[q]).min(below), Reverse(turn), (q[0] * width + q[1]) as u32));
        turn += 1;
    };
    for ((y, x), &m) in markers.indexed_iter() {
        if m != 0 {
            push(&mut heap, [y, x], u32::MAX);
        }
    }
    while let Some((level, _, i)) = heap.pop() {
        let p = [i as usize / width, i as usize % width];
        let label = labels[p];
        for q in neighbours4(p, field.dim()) {
            if mask[q] && labels[q] == 0 {
                labels[q] = label;
                push(&mut heap, q, level);
            }
        }
    }
    labels
}
