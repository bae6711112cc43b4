//! The area that one contour of a section encloses, while the section moves.

/// Signed area of a contour as a function of the distance t from some height: area + slope t + curvature t².
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ContourArea {
    pub(crate) area: f64,
    pub(crate) slope: f64,
    pub(crate) curvature: f64,
}

impl ContourArea {
    pub(crate) fn at(&self, t: f64) -> f64 {
        self.area + t * (self.slope + t * self.curvature)
    }

    pub(crate) fn advance(&mut self, t: f64) {
        self.area = self.at(t);
        self.slope += 2.0 * t * self.curvature;
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.slope += other.slope;
        self.curvature += other.curvature;
    }
}
