//! Baking: the solid's colours on a mesh of few triangles as a texture atlas.

use crate::carve_error::{CarveError, MOST_PIXELS, check};
use crate::charts::{Chart, Layout, MARGIN, Rectangle, charts, least_side};
use crate::colour::{add, to_bytes};
use crate::solid::Solid;
use nalgebra::{Point2, Point3};
use rayon::prelude::*;
use stereology_metrics::Progress;
use stereology_shape::{Texture, TexturedMesh, TriangleMesh, corner_normals};

/// Baking options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeOptions {
    /// Side of the square texture in texels: 1 to 16384.
    pub pixels: u32,
    /// A texel is the mean of n × n points of the solid; values are limited to 1 to 16.
    pub samples: u32,
}

impl Default for BakeOptions {
    /// 2048 × 2048 texels, each the mean of 3 × 3 points.
    fn default() -> Self {
        Self {
            pixels: 2048,
            samples: 3,
        }
    }
}

/// A mesh with its atlas.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The mesh in its given coordinates, with its triangles unchanged.
    pub textured: TexturedMesh,
    /// Edge of a texel in the unit of the solid.
    pub texel: f64,
    /// Edge of a texel over that of the residual's voxels; above 1, detail of the photograph is lost. `None` without
    /// residual.
    pub coarseness: Option<f64>,
    /// Number of charts in the atlas, each of one or two triangles.
    pub charts: usize,
    /// Fraction of the texture covered by charts.
    pub used: f64,
}

/// Rows between two calls of `progress`.
const ROWS: u32 = 32;

impl Solid {
    /// Bakes the colours of the solid on the surface of `mesh` into one square texture, for meshes of few triangles;
    /// `place` maps points of the mesh to the solid.
    ///
    /// Triangles are laid flat without distortion; two that share an edge are laid together if that saves area
    /// (greedily, the largest saving first). Each chart gets its smallest bounding rectangle; rectangles are placed in
    /// rows by height at the largest common scale, so all texels have the same size. A texel is the mean of n × n
    /// points (box filter, encoded values); alpha is the fraction of them outside voids. Each rectangle has a margin of
    /// one texel, on the continued plane of its triangle, so bilinear filtering shows no seams. In coarser mip levels
    /// neighbouring charts mix; unused texels have the mean colour of the atlas. The bytes are the same at any number
    /// of threads.
    ///
    /// Cost: n² colours per texel; the memory of the texture.
    ///
    /// # Errors
    ///
    /// [`CarveError`]; [`CarveError::Crowded`] states how many texels are needed.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use std::ops::ControlFlow;
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// use stereology_shape::TriangleMesh;
    /// use stereology_volume::{BakeOptions, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// # let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[1.0, 0.0, 0.0]], [0.0; 3], None)?;
    /// // The six faces of a cube, each a third of the texture's side.
    /// let cube = TriangleMesh::cuboid([5.0, 5.0, 5.0]);
    /// let options = BakeOptions { pixels: 96, ..BakeOptions::default() };
    /// let baked = solid.bake(&cube, &|p| *p, &options, &|_| ControlFlow::Continue(()))?;
    /// assert_eq!((baked.charts, baked.textured.mesh.triangles.len()), (6, 12));
    /// assert!((baked.texel - 5.0 / 30.0).abs() < 1e-6); // 32 texels less the margin
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn bake(
        &self,
        mesh: &TriangleMesh,
        place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
        options: &BakeOptions,
        progress: Progress<'_>,
    ) -> Result<Baked, CarveError> {
        check(mesh)?;
        let BakeOptions { pixels, samples } = *options;
        if !(1..=MOST_PIXELS).contains(&pixels) {
            return Err(CarveError::Pixels { pixels });
        }
        let placed: Vec<Point3<f64>> = mesh.vertices.iter().map(place).collect();
        let charts = charts(mesh, &placed);
        if !sound(&charts) {
            return Err(CarveError::NoSize);
        }
        let Some(layout) = Layout::new(&charts, pixels) else {
            return Err(CarveError::Crowded {
                triangles: mesh.triangles.len(),
                pixels,
                enough: least_side(charts.len()),
            });
        };
        let oven = Oven {
            solid: self,
            place,
            charts: &charts,
            layout: &layout,
            samples: samples.clamp(1, 16),
        };
        let rgba = oven.texture(pixels, progress)?;
        let owned: f64 = layout
            .rectangles
            .iter()
            .map(|r| f64::from(r.width) * f64::from(r.height))
            .sum();
        Ok(Baked {
            textured: TexturedMesh {
                uvs: uvs(mesh.triangles.len(), &charts, &layout, pixels),
                normals: corner_normals(mesh),
                mesh: mesh.clone(),
                texture: Texture {
                    width: pixels,
                    height: pixels,
                    rgba,
                },
            },
            texel: 1.0 / layout.scale,
            coarseness: self.residual_voxel().map(|voxel| 1.0 / (layout.scale * voxel)),
            charts: charts.len(),
            used: owned / f64::from(pixels).powi(2),
        })
    }
}

/// Whether lengths are finite, and not all zero.
fn sound(charts: &[Chart]) -> bool {
    let finite = |p: &Point2<f64>| p.iter().all(|x| x.is_finite());
    let corners = || {
        charts
            .iter()
            .flat_map(|chart| &chart.pieces)
            .flat_map(|piece| &piece.corners)
    };
    corners().all(finite) && corners().any(|p| p.x > 0.0 && (1.0 / p.x).is_finite())
}

fn uvs(triangles: usize, charts: &[Chart], layout: &Layout, pixels: u32) -> Vec<[[f64; 2]; 3]> {
    let mut uvs = vec![[[0.0; 2]; 3]; triangles];
    for rectangle in &layout.rectangles {
        for piece in &charts[rectangle.chart].pieces {
            let share = |x: f64, from: u32| (x * layout.scale + f64::from(from + MARGIN)) / f64::from(pixels);
            uvs[piece.triangle] = piece
                .corners
                .map(|p| [share(p.x, rectangle.left), share(p.y, rectangle.top)]);
        }
    }
    uvs
}

/// The input of a texture.
struct Oven<'a> {
    solid: &'a Solid,
    place: &'a (dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
    charts: &'a [Chart],
    layout: &'a Layout,
    samples: u32,
}

impl Oven<'_> {
    fn texture(&self, pixels: u32, progress: Progress<'_>) -> Result<Vec<u8>, CarveError> {
        let row_bytes = 4 * pixels as usize;
        let mut rgba = vec![0; row_bytes * pixels as usize];
        let mut sum = [0_u64; 4];
        for (block, bytes) in (0_u32..).zip(rgba.chunks_mut(row_bytes * ROWS as usize)) {
            let first = block * ROWS;
            if progress(f64::from(first) / f64::from(pixels)).is_break() {
                return Err(CarveError::Cancelled);
            }
            let rows = bytes.par_chunks_mut(row_bytes).zip(first..first + ROWS);
            let sums: Vec<[u64; 4]> = rows.map(|(bytes, row)| self.row(bytes, row)).collect();
            sums.iter().for_each(|row| (0..4).for_each(|c| sum[c] += row[c]));
        }
        // Rounded mean of the visible texels.
        let count = sum[3].max(1);
        let [r, g, b] = [0, 1, 2].map(|c| u8::try_from((sum[c] + count / 2) / count).unwrap_or(u8::MAX));
        rgba.par_chunks_mut(row_bytes).zip(0..pixels).for_each(|(bytes, row)| {
            let owned = self.layout.in_row(row).map(|r| [r.left, r.left + r.width]);
            let mut from = 0;
            for [left, right] in owned.chain([[pixels, pixels]]) {
                let free = &mut bytes[4 * from as usize..4 * left as usize];
                for texel in free.chunks_exact_mut(4) {
                    texel.copy_from_slice(&[r, g, b, u8::MAX]);
                }
                from = right;
            }
        });
        Ok(rgba)
    }

    /// Bakes a row; returns the sums of red, green and blue of the visible texels, and their number.
    fn row(&self, bytes: &mut [u8], row: u32) -> [u64; 4] {
        let mut sum = [0; 4];
        for rectangle in self.layout.in_row(row) {
            let texels = bytes[4 * rectangle.left as usize..].chunks_exact_mut(4);
            for (column, texel) in (0..rectangle.width).zip(texels) {
                let [r, g, b, a] = self.texel(rectangle, column, row - rectangle.top);
                texel.copy_from_slice(&[r, g, b, a]);
                if a == u8::MAX {
                    for (sum, c) in sum.iter_mut().zip([r, g, b, 1]) {
                        *sum += u64::from(c);
                    }
                }
            }
        }
        sum
    }

    fn texel(&self, rectangle: &Rectangle, column: u32, row: u32) -> [u8; 4] {
        let n = self.samples;
        let place = |texel: u32, i: u32| {
            (f64::from(texel) - f64::from(MARGIN) + (f64::from(i) + 0.5) / f64::from(n)) / self.layout.scale
        };
        // Sum and number of the points outside and inside voids.
        let mut sums = [([0.0_f32; 3], 0_u16); 2];
        for i in 0..n * n {
            let on_mesh = self.charts[rectangle.chart].point(Point2::new(place(column, i % n), place(row, i / n)));
            let p = (self.place)(&on_mesh);
            let (sum, count) = &mut sums[usize::from(self.solid.is_void_at(&p))];
            *sum = add(*sum, self.solid.colour_at(&p));
            *count += 1;
        }
        let [(seen, count), (hollow, holes)] = sums;
        let (sum, of) = if count > 0 { (seen, count) } else { (hollow, holes) };
        let [r, g, b] = to_bytes(sum.map(|c| c / f32::from(of)));
        #[allow(clippy::cast_possible_truncation, reason = "a fraction of 255")]
        let alpha = (f32::from(count) / f32::from(count + holes) * 255.0).round() as u8;
        [r, g, b, alpha]
    }
}
