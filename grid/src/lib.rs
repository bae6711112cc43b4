//! Arrays in files: NumPy, NRRD, VTK image data, TIFF stacks; written slab by slab and renamed when whole.
