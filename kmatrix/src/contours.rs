//! The contours of a section while it moves: which triangle belongs to which, what area each encloses, which are holes of which.

use crate::depth_measure::{DepthMeasure, Quadratic};
use crate::sweep::View;

const NONE: u32 = u32::MAX;

/// Contours by number; a number is given to a new contour when an old one ends.
#[derive(Default)]
pub(crate) struct Contours {
    contours: Vec<Contour>,
    /// Contours that exist, in no order.
    present: Vec<u32>,
    vacant: Vec<u32>,
    /// The contour of each triangle the section cuts.
    of_triangle: Vec<u32>,
    /// Contours began, ended, split or merged since holes were last looked for.
    changed: bool,
}

#[derive(Clone, Copy)]
struct Contour {
    area: Quadratic,
    /// A triangle on it.
    triangle: u32,
    /// Its outer contour, if it is a hole.
    hole_of: Option<u32>,
    is_known: bool,
    is_hole: bool,
}

impl Contours {
    pub(crate) fn restart(&mut self, triangles: usize) {
        self.contours.clear();
        self.present.clear();
        self.vacant.clear();
        self.of_triangle.clear();
        self.of_triangle.resize(triangles, NONE);
        self.changed = false;
    }

    /// The contour of a triangle that the section cuts.
    pub(crate) fn of(&self, triangle: Option<u32>) -> u32 {
        triangle.map_or(NONE, |triangle| self.of_triangle[triangle as usize])
    }

    pub(crate) fn is_assigned(&self, triangle: u32) -> bool {
        self.of_triangle[triangle as usize] != NONE
    }

    pub(crate) fn assign(&mut self, triangle: u32, contour: u32) {
        self.of_triangle[triangle as usize] = contour;
        self.contours[contour as usize].triangle = triangle;
    }

    pub(crate) fn release(&mut self, triangle: u32) {
        self.of_triangle[triangle as usize] = NONE;
    }

    pub(crate) fn area(&self, contour: u32) -> Quadratic {
        self.contours[contour as usize].area
    }

    pub(crate) fn set_area(&mut self, contour: u32, area: Quadratic) {
        self.contours[contour as usize].area = area;
    }

    pub(crate) fn begin(&mut self) -> u32 {
        self.changed = true;
        let new = Contour {
            area: Quadratic::default(),
            triangle: NONE,
            hole_of: None,
            is_known: false,
            is_hole: false,
        };
        let number = match self.vacant.pop() {
            Some(number) => {
                self.contours[number as usize] = new;
                number
            }
            None => {
                self.contours.push(new);
                u32::try_from(self.contours.len() - 1).expect("fewer contours than triangles, whose indices are u32")
            }
        };
        self.present.push(number);
        number
    }

    /// Ends a contour, if it has not ended yet.
    pub(crate) fn end(&mut self, contour: u32) {
        if let Some(place) = self.present.iter().position(|&number| number == contour) {
            self.present.swap_remove(place);
            self.vacant.push(contour);
            self.changed = true;
        }
    }

    /// Adds the profiles between two heights to the measure.
    pub(crate) fn measure(&mut self, view: &View<'_>, low: f64, high: f64, measure: &mut DepthMeasure) {
        if self.changed {
            self.find_holes(view, 0.5 * (low + high));
            self.changed = false;
        }
        for &number in &self.present {
            let contour = &self.contours[number as usize];
            if contour.is_hole {
                measure.moments.holes += high - low;
                continue;
            }
            let mut area = contour.area.coefficients();
            for &other in &self.present {
                if self.contours[other as usize].hole_of == Some(number) {
                    let hole = self.contours[other as usize].area.coefficients();
                    area = [0, 1, 2].map(|k| area[k] + hole[k]);
                }
            }
            measure.add_profile(area, low, high);
        }
    }

    /// Tells holes (walked with the solid to the left, they have negative area) and gives each to the smallest outer contour around it.
    fn find_holes(&mut self, view: &View<'_>, height: f64) {
        for &number in &self.present {
            let contour = &mut self.contours[number as usize];
            if !contour.is_known {
                contour.is_hole = signed_area(&view.polygon(contour.triangle, height)) < 0.0;
                contour.is_known = true;
            }
        }
        if !self
            .present
            .iter()
            .any(|&number| self.contours[number as usize].is_hole)
        {
            return;
        }
        let outlines: Vec<(u32, Vec<[f64; 2]>, f64)> = self
            .present
            .iter()
            .filter(|&&number| !self.contours[number as usize].is_hole)
            .map(|&number| {
                let outline = view.polygon(self.contours[number as usize].triangle, height);
                let area = signed_area(&outline);
                (number, outline, area)
            })
            .collect();
        for &number in &self.present {
            if !self.contours[number as usize].is_hole {
                continue;
            }
            let outline = view.polygon(self.contours[number as usize].triangle, height);
            let area = -signed_area(&outline);
            self.contours[number as usize].hole_of = outlines
                .iter()
                .filter(|(_, outer, outer_area)| {
                    *outer_area > area && outline.iter().any(|point| is_inside(outer, point))
                })
                .min_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)))
                .map(|&(outer, _, _)| outer);
        }
    }
}

fn signed_area(polygon: &[[f64; 2]]) -> f64 {
    let Some(&[x, y]) = polygon.first() else { return 0.0 };
    let fans = polygon
        .windows(2)
        .map(|pair| (pair[0][0] - x) * (pair[1][1] - y) - (pair[0][1] - y) * (pair[1][0] - x));
    0.5 * fans.sum::<f64>()
}

/// Whether a ray from the point crosses the polygon an odd number of times.
fn is_inside(polygon: &[[f64; 2]], &[x, y]: &[f64; 2]) -> bool {
    let mut inside = false;
    for (k, &[ax, ay]) in polygon.iter().enumerate() {
        let [bx, by] = polygon[(k + 1) % polygon.len()];
        if (ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax) {
            inside = !inside;
        }
    }
    inside
}
