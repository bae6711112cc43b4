//! Stereological kernels: how often a random section shows a particle of each size as a profile of each size.
