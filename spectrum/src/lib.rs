//! Real Fourier transforms of 2D and 3D fields of any size, the periodic component, radial spectra, autocorrelation.
