//! Bodies of particles: closed triangle meshes, spheres, ellipsoids; their volume, surface, mean width, sections, support, distance; particles in a periodic box.
