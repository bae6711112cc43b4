//! The contours of a moving section: the triangles of each contour, the area it encloses, and the contour that each
//! hole belongs to.

use crate::contour_area::ContourArea;
use crate::depth_measure::DepthMeasure;
use crate::plane::Plane;

const NONE: u32 = u32::MAX;

/// Contours by number. The number of a contour that ended is used again for a new one.
#[derive(Default)]
pub(crate) struct Contours {
    contours: Vec<Contour>,
    /// Contours that exist, in any order.
    present: Vec<u32>,
    vacant: Vec<u32>,
    /// The contour of each triangle the section cuts.
    of_triangle: Vec<u32>,
    /// Whether contours began or ended since holes were last assigned.
    changed: bool,
    holes: u32,
    /// The height up to which all profiles were measured at once.
    settled: f64,
}

#[derive(Clone, Copy)]
struct Contour {
    /// Area relative to `since`, the height up to which its profile has been measured.
    state: ContourArea,
    since: f64,
    /// A triangle of the contour.
    triangle: u32,
    kind: Kind,
    exists: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Unknown,
    Outer,
    /// The outer contour around it.
    Hole(u32),
}

impl Contours {
    pub(crate) fn restart(&mut self, triangles: usize) {
        self.contours.clear();
        self.present.clear();
        self.vacant.clear();
        self.of_triangle.clear();
        self.of_triangle.resize(triangles, NONE);
        self.changed = false;
        self.holes = 0;
        self.settled = f64::NEG_INFINITY;
    }

    pub(crate) fn have_changed(&self) -> bool {
        self.changed
    }

    /// The contour of a triangle that the section cuts.
    pub(crate) fn of(&self, triangle: u32) -> u32 {
        self.of_triangle[triangle as usize]
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

    pub(crate) fn set_state(&mut self, contour: u32, state: ContourArea) {
        self.contours[contour as usize].state = state;
    }

    pub(crate) fn begin(&mut self, since: f64, state: ContourArea) -> u32 {
        self.changed = true;
        let new = Contour {
            state,
            since,
            triangle: NONE,
            kind: Kind::Unknown,
            exists: true,
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

    /// Ends a contour, if it has not ended yet. Profiles must be settled up to its height.
    pub(crate) fn end(&mut self, contour: u32) {
        let Some(ended) = self.contours.get_mut(contour as usize).filter(|contour| contour.exists) else {
            return;
        };
        ended.exists = false;
        self.holes -= u32::from(matches!(ended.kind, Kind::Hole(_)));
        if let Some(place) = self.present.iter().position(|&number| number == contour) {
            self.present.swap_remove(place);
        }
        // Its number is not used again until its holes have been assigned to other contours.
        self.changed = true;
        if self.holes == 0 {
            self.vacant.push(contour);
        }
    }

    /// Passes a regular vertex of a contour: measures its profile up to there and changes its curvature.
    pub(crate) fn bend(&mut self, contour: u32, height: f64, jump: f64, measure: &mut DepthMeasure) {
        match self.contours[contour as usize].kind {
            Kind::Hole(NONE) => self.advance_alone(contour, height, measure),
            Kind::Hole(outer) => self.measure(outer, height, measure),
            _ => self.measure(contour, height, measure),
        }
        self.contours[contour as usize].state.curvature += jump;
    }

    /// Measures every profile up to a height at which contours begin or end.
    #[allow(clippy::float_cmp, reason = "the same height, not one near it")]
    pub(crate) fn settle(&mut self, height: f64, measure: &mut DepthMeasure) {
        if self.settled == height {
            return;
        }
        self.settled = height;
        for i in 0..self.present.len() {
            let number = self.present[i];
            match self.contours[number as usize].kind {
                Kind::Hole(NONE) => self.advance_alone(number, height, measure),
                Kind::Hole(_) => {}
                _ => self.measure(number, height, measure),
            }
        }
    }

    /// Advances a hole that rounding left without a contour around it.
    fn advance_alone(&mut self, hole: u32, height: f64, measure: &mut DepthMeasure) {
        let hole = &mut self.contours[hole as usize];
        let length = (height - hole.since).max(0.0);
        hole.state.advance(length);
        hole.since = height;
        measure.moments.holes += length;
    }

    /// Adds the profile within an outer contour, from the height where it was last measured up to `height`, and moves
    /// the contour and its holes there.
    fn measure(&mut self, outer: u32, height: f64, measure: &mut DepthMeasure) {
        let contour = &mut self.contours[outer as usize];
        let length = height - contour.since;
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let mut profile = contour.state;
        contour.state.advance(length);
        contour.since = height;
        if self.holes > 0 {
            for i in 0..self.present.len() {
                let hole = &mut self.contours[self.present[i] as usize];
                if hole.kind == Kind::Hole(outer) {
                    profile.add(&hole.state);
                    hole.state.advance(length);
                    hole.since = height;
                    measure.moments.holes += length;
                }
            }
        }
        measure.add_profile([profile.area, profile.slope, profile.curvature], length);
    }

    /// Finds holes (traversed with the solid to the left, their area is negative) and assigns each to the smallest
    /// outer contour around it.
    ///
    /// All profiles are measured up to `low`; `middle` is halfway to the next vertex; `plane` lies just below that
    /// vertex.
    pub(crate) fn find_holes(&mut self, plane: &Plane<'_>, low: f64, middle: f64) {
        self.changed = false;
        let mut outers = 0;
        for &number in &self.present {
            let contour = &mut self.contours[number as usize];
            if contour.kind == Kind::Unknown {
                let is_hole = contour.state.at(middle - low) < 0.0;
                contour.kind = if is_hole { Kind::Hole(NONE) } else { Kind::Outer };
                self.holes += u32::from(is_hole);
            }
            outers += u32::from(contour.kind == Kind::Outer);
        }
        if self.holes > 0 {
            let mut outlines = Vec::new();
            for i in 0..self.present.len() {
                let number = self.present[i];
                let orphan = match self.contours[number as usize].kind {
                    Kind::Hole(NONE) => true,
                    Kind::Hole(outer) => !self.contours[outer as usize].exists,
                    _ => false,
                };
                if orphan {
                    if outlines.is_empty() {
                        outlines = self.outlines(plane, middle, outers > 1);
                    }
                    let owner = self.owner(number, &outlines, plane, middle);
                    self.contours[number as usize].kind = Kind::Hole(owner);
                }
            }
        }
        // No hole refers to an ended contour now, so its number is free.
        self.vacant.clear();
        let numbers = 0..u32::try_from(self.contours.len()).unwrap_or(NONE);
        self.vacant
            .extend(numbers.filter(|&number| !self.contours[number as usize].exists));
    }

    /// Number and polygon of every outer contour. The polygons are left out if there is only one contour.
    fn outlines(&self, plane: &Plane<'_>, height: f64, several: bool) -> Vec<(u32, Vec<[f64; 2]>)> {
        let outers = self
            .present
            .iter()
            .filter(|&&number| self.contours[number as usize].kind == Kind::Outer);
        outers
            .map(|&number| {
                let triangle = self.contours[number as usize].triangle;
                let outline = if several {
                    plane.polygon(triangle, height)
                } else {
                    Vec::new()
                };
                (number, outline)
            })
            .collect()
    }

    /// The smallest outer contour around a hole.
    fn owner(&self, hole: u32, outlines: &[(u32, Vec<[f64; 2]>)], plane: &Plane<'_>, height: f64) -> u32 {
        if let [(only, _)] = outlines {
            return *only;
        }
        let outline = plane.polygon(self.contours[hole as usize].triangle, height);
        let area = |number: u32| {
            let contour = &self.contours[number as usize];
            contour.state.at(height - contour.since)
        };
        let around = outlines.iter().filter(|(number, outer)| {
            area(*number) > -area(hole) && outline.iter().any(|point| is_inside(outer, point))
        });
        around
            .min_by(|a, b| area(a.0).total_cmp(&area(b.0)).then(a.0.cmp(&b.0)))
            .map_or(NONE, |&(number, _)| number)
    }
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
