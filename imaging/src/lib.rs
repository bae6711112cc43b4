//! Operations on pixel and voxel grids that several crates need: distance transform, thresholds, connected components, filters, colour spaces.
