//! Profiles of particles from a photograph of a section: binder, labels, colours, residual.
