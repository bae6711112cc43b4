//! Steerable pyramid, histogram matching, and Heeger-Bergen texture synthesis in 2D and 3D.
