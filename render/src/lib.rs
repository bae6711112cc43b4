//! Pictures of blocks and meshes whose colour is a function of the point.
