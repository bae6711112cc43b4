//! The paper's method to cut a mesh (section 3.2): the part of the surface beyond the plane is drawn, and pixels drawn
//! an odd number of times are inside.

use nalgebra::{Point3, UnitVector3, Vector3};

/// Draws sections of one mesh into reusable buffers, as a graphics card does with its stencil buffer.
pub(crate) struct StencilBuffer<'a> {
    vertices: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    centre: Point3<f64>,
    radius: f64,
    resolution: usize,
    /// (x, y, depth) of every vertex, x and y in pixels.
    placed: Vec<[f64; 3]>,
    odd: Vec<bool>,
    queue: Vec<usize>,
}

impl<'a> StencilBuffer<'a> {
    /// An image of `resolution` × `resolution` pixels that contains the ball of `radius` about `centre`.
    pub(crate) fn new(
        vertices: &'a [Point3<f64>],
        triangles: &'a [[u32; 3]],
        centre: Point3<f64>,
        radius: f64,
        resolution: usize,
    ) -> Self {
        Self {
            vertices,
            triangles,
            centre,
            radius,
            resolution,
            placed: Vec::with_capacity(vertices.len()),
            odd: vec![false; resolution * resolution],
            queue: Vec::new(),
        }
    }

    /// Areas of the 4-connected components of odd pixels of the section by n · x = `offset`.
    pub(crate) fn profile_areas(&mut self, normal: &UnitVector3<f64>, offset: f64) -> Vec<f64> {
        let mut axis = Vector3::zeros();
        axis[normal.iamin()] = 1.0;
        let u = axis.cross(normal).normalize();
        let v = normal.cross(&u);
        let pixels = 0.5 * self.resolution as f64 / self.radius;
        self.placed.clear();
        self.placed.extend(self.vertices.iter().map(|p| {
            let from_centre = p - self.centre;
            let place = |axis: &Vector3<f64>| (from_centre.dot(axis) + self.radius) * pixels;
            [place(&u), place(&v), p.coords.dot(normal) - offset]
        }));
        self.odd.fill(false);
        for corners in self.triangles {
            self.draw(corners);
        }
        let pixel = 1.0 / (pixels * pixels);
        self.regions().into_iter().map(|count| count as f64 * pixel).collect()
    }

    /// Toggles every pixel whose centre is covered by the part of the triangle beyond the plane.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the image"
    )]
    fn draw(&mut self, corners: &[u32; 3]) {
        let placed = corners.map(|v| self.placed[v as usize]);
        if placed.iter().all(|p| p[2] <= 0.0) {
            return;
        }
        let last = self.resolution as f64;
        let first = |x: f64| (x - 0.5).ceil().clamp(0.0, last) as usize;
        let low = placed.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let high = placed.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
        for row in first(low)..first(high) {
            let y = row as f64 + 0.5;
            // Ends of the row in the triangle: (x, depth). Both triangles of an edge use its ends in the same order, so
            // that no pixel on an edge is drawn twice or left out.
            let mut ends = [[0.0; 2]; 2];
            let mut found = 0;
            for k in 0..3 {
                let (a, b) = (
                    corners[k].min(corners[(k + 1) % 3]),
                    corners[k].max(corners[(k + 1) % 3]),
                );
                let (a, b) = (self.placed[a as usize], self.placed[b as usize]);
                if (a[1] <= y) != (b[1] <= y) && found < 2 {
                    let t = (y - a[1]) / (b[1] - a[1]);
                    ends[found] = [a[0] + t * (b[0] - a[0]), a[2] + t * (b[2] - a[2])];
                    found += 1;
                }
            }
            if found < 2 {
                continue;
            }
            if ends[0][0] > ends[1][0] {
                ends.swap(0, 1);
            }
            let [[from, start], [to, end]] = ends;
            let slope = if to > from { (end - start) / (to - from) } else { 0.0 };
            for column in first(from)..first(to) {
                if start + (column as f64 + 0.5 - from) * slope > 0.0 {
                    let at = row * self.resolution + column;
                    self.odd[at] = !self.odd[at];
                }
            }
        }
    }

    /// Number of pixels of every 4-connected component of odd pixels; clears the image.
    fn regions(&mut self) -> Vec<usize> {
        let n = self.resolution;
        let mut regions = Vec::new();
        for start in 0..self.odd.len() {
            if !std::mem::replace(&mut self.odd[start], false) {
                continue;
            }
            let mut count = 0;
            self.queue.push(start);
            while let Some(at) = self.queue.pop() {
                count += 1;
                let (row, column) = (at / n, at % n);
                let beside = [
                    (column > 0).then(|| at - 1),
                    (column + 1 < n).then(|| at + 1),
                    (row > 0).then(|| at - n),
                    (row + 1 < n).then(|| at + n),
                ];
                for next in beside.into_iter().flatten() {
                    if std::mem::replace(&mut self.odd[next], false) {
                        self.queue.push(next);
                    }
                }
            }
            regions.push(count);
        }
        regions
    }
}

#[cfg(test)]
mod tests {
    use super::StencilBuffer;
    use nalgebra::{Point3, UnitVector3, Vector3};
    use proptest::prelude::*;
    use stereology_shape::{Body, ClosedMesh, TriangleMesh};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// The pixel count agrees with the polygon area, up to the length of the outline in pixels.
        #[test]
        fn odd_pixels_are_the_section(x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, depth in -0.9..0.9_f64) {
            prop_assume!(Vector3::new(x, y, z).norm() > 0.1);
            let normal = UnitVector3::new_normalize(Vector3::new(x, y, z));
            let torus = Body::from_mesh(ClosedMesh::try_from(TriangleMesh::torus(1.4, 0.6, 40, 20)).unwrap());
            let mesh = torus.mesh().unwrap();
            let mut buffer = StencilBuffer::new(mesh.vertices(), mesh.triangles(), Point3::origin(), 1.0, 400);
            let drawn: f64 = buffer.profile_areas(&normal, depth).iter().sum();
            let cut: f64 = torus.profile_areas(&normal, depth).iter().sum();
            prop_assert!((drawn - cut).abs() < 0.02, "{drawn} {cut}");
        }
    }

    #[test]
    fn two_discs_are_two_regions() {
        let torus = ClosedMesh::try_from(TriangleMesh::torus(1.4, 0.6, 40, 20)).unwrap();
        let mut buffer = StencilBuffer::new(torus.vertices(), torus.triangles(), Point3::origin(), 1.0, 128);
        assert_eq!(buffer.profile_areas(&Vector3::x_axis(), 0.01).len(), 2);
        assert_eq!(buffer.profile_areas(&Vector3::z_axis(), 0.01).len(), 1);
        assert!(buffer.profile_areas(&Vector3::z_axis(), 0.99).is_empty());
    }
}
