//! All sections perpendicular to one direction: a sweep over the sorted vertices of a closed mesh.
//!
//! Between two of its vertices the area of a contour is a quadratic function of the height. Near a vertex the section
//! changes by a polygon whose diameter is proportional to the distance from the vertex, so area and slope are
//! continuous there and only the curvature jumps, by a sum over the triangles around the vertex. A contour is therefore
//! represented by three numbers, which are updated at each of its vertices. Contours are traversed again only where
//! they split or merge.

use crate::contour_area::ContourArea;
use crate::contours::Contours;
use crate::depth_measure::DepthMeasure;
use crate::plane::{HIGHEST, LOWEST, MIDDLE, Surface, View};
use nalgebra::Vector3;
use stereology_shape::SectionAreas;

/// Largest relative difference between the integral of the areas and the volume. A sweep with a larger one met an edge
/// that is almost perpendicular to the direction; it is repeated in a slightly different direction.
const MOST_DEFECT: f64 = 1e-7;
/// Change of the direction, and number of attempts.
const ASIDE: f64 = 1e-8;
const ATTEMPTS: i32 = 4;

/// The sweep of a surface; reusable for several directions.
pub(crate) struct Sweep<'a> {
    view: View<'a>,
    totals: SectionAreas,
    contours: Contours,
}

impl<'a> Sweep<'a> {
    pub(crate) fn new(surface: &'a Surface<'a>) -> Self {
        Self {
            view: View::new(surface),
            totals: surface.totals.clone(),
            contours: Contours::default(),
        }
    }

    /// Adds all sections across `direction` (a unit vector) to `measure`, in units of the surface's reach.
    pub(crate) fn run(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) {
        let mut direction = *direction;
        for attempt in 0..=ATTEMPTS {
            measure.begin();
            let defect = if self.view.surface.convex {
                self.sweep_convex(&direction, measure)
            } else {
                self.sweep_contours(&direction, measure)
            };
            // Rounding alone makes the volume of very thin bodies inaccurate: their sections are used as they are.
            if defect <= MOST_DEFECT || (attempt == ATTEMPTS && defect.is_finite()) {
                break;
            }
            measure.undo();
            let aside = Vector3::new(0.36, -0.48, 0.8) * (ASIDE * 10.0_f64.powi(attempt));
            direction = (direction + aside).normalize();
        }
    }

    fn sweep_convex(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) -> f64 {
        self.totals
            .sweep(direction, |low, high, area| measure.add_section(area, high - low))
    }

    fn sweep_contours(&mut self, direction: &Vector3<f64>, measure: &mut DepthMeasure) -> f64 {
        let before = measure.moments.area;
        self.view.place(direction);
        let mut contours = std::mem::take(&mut self.contours);
        contours.restart(self.view.surface.triangles.len());
        let mut total = ContourArea::default();
        let mut below = f64::INFINITY;
        for i in 0..self.view.knots.order.len() {
            let vertex = self.view.knots.order[i];
            let height = self.view.knots.heights[vertex as usize];
            if height > below {
                measure.add_total([total.area, total.slope, total.curvature], height - below);
                total.advance(height - below);
                if contours.have_changed() {
                    contours.find_holes(&self.view.plane_below(vertex), below, 0.5 * (below + height));
                }
            }
            below = height;
            total.curvature += self.view.knots.jumps[vertex as usize];
            self.pass(vertex, &mut contours, measure);
        }
        self.contours = contours;
        ((measure.moments.area - before) / self.view.surface.volume - 1.0).abs()
    }

    /// Moves the section from just below a vertex to just above it.
    fn pass(&mut self, vertex: u32, contours: &mut Contours, measure: &mut DepthMeasure) {
        let surface = self.view.surface;
        let fan = surface.around(vertex);
        let (height, jump) = (
            self.view.knots.heights[vertex as usize],
            self.view.knots.jumps[vertex as usize],
        );
        let mut counts = [0_u32; 4];
        let mut cut = None;
        for &corner in fan {
            let role = self.view.role(corner);
            counts[role as usize] += 1;
            if role != LOWEST {
                cut = Some(corner / 4);
            }
        }
        // The number of triangles whose middle vertex this is: 0 at an extremum, 2 at a regular vertex, more at a
        // saddle.
        let simple = !surface.pinched[vertex as usize];
        match (counts[MIDDLE as usize], cut) {
            (2, Some(cut)) if simple => {
                let contour = contours.of(cut);
                contours.bend(contour, height, jump, measure);
                // Triangles whose middle vertex this is are included: a contour keeps a triangle that is still cut.
                for &corner in fan {
                    if self.view.role(corner) != HIGHEST {
                        contours.assign(corner / 4, contour);
                    }
                }
            }
            (0, None) if simple => {
                contours.settle(height, measure);
                let state = ContourArea {
                    curvature: jump,
                    ..ContourArea::default()
                };
                let contour = contours.begin(height, state);
                for &corner in fan {
                    contours.assign(corner / 4, contour);
                }
            }
            (0, Some(cut)) if simple && counts[LOWEST as usize] == 0 => {
                contours.settle(height, measure);
                contours.end(contours.of(cut));
            }
            _ => {
                contours.settle(height, measure);
                self.retrace(vertex, contours);
            }
        }
    }

    /// Contours split or merge: those through the vertex end, and the contours above it are traversed to begin new
    /// ones.
    fn retrace(&mut self, vertex: u32, contours: &mut Contours) {
        let fan = self.view.surface.around(vertex);
        for &corner in fan {
            if self.view.role(corner) != LOWEST {
                contours.end(contours.of(corner / 4));
            }
            contours.release(corner / 4);
        }
        let height = self.view.knots.heights[vertex as usize];
        let plane = self.view.plane_below(vertex + 1).at(height);
        for &corner in fan {
            let start = corner / 4;
            if self.view.role(corner) == HIGHEST || contours.is_assigned(start) {
                continue;
            }
            let contour = contours.begin(height, ContourArea::default());
            let mut state = ContourArea::default();
            let mut triangle = start;
            loop {
                contours.assign(triangle, contour);
                plane.add_fan(triangle, &mut state);
                triangle = plane.next(triangle).0;
                if triangle == start {
                    break;
                }
            }
            contours.set_state(contour, state);
        }
    }
}
