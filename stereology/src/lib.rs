//! From a photograph of a cut through a material to the solid it came from.
