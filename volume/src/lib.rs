//! The solid texture: particles, colours and residual, asked at any point; slices, sections, voxels.
