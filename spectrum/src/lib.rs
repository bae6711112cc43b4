//! Real Fourier transforms of 2D and 3D fields of any size, the periodic component, radial spectra, autocorrelation.
//!
//! Conventions, once for the whole workspace:
//!
//! ```text
//! F(k) = Σ_x u(x) exp(−2πi Σ_a k_a x_a / n_a)        forward transform, not scaled
//! u(x) = (1/N) Σ_k F(k) exp(+2πi Σ_a k_a x_a / n_a)   inverse transform, N samples
//! P(k) = |F(k)|² / N                                  periodogram: its mean over all k is the mean square of u
//! C(d) = (1/N) Σ_x u(x) u(x + d)                      periodic autocovariance of u − mean = inverse transform of P
//! ```
//!
//! Fields are `ndarray` arrays in C order with axes (y, x) or (z, y, x). Frequencies are in cycles per sample, so the
//! Nyquist frequency is 1/2. The spectrum of a real field is stored as the half with non-negative frequency along the
//! last axis. Every lane is transformed by the same steps, so results do not depend on the number of threads. `rustfft`
//! chooses its kernels for the processor at run time: the last bits may differ between processor types.
//!
//! `rustfft` alone transforms lines, not fields. The `ndarray` transforms of other crates cost twice as much for real
//! fields, and the pyramid needs thousands of small transforms without allocation ([`RealFft::forward_into`]).
//!
//! # Examples
//!
//! A forward and an inverse transform, at an odd size:
//!
//! ```
//! use ndarray::Array2;
//! use stereology_spectrum::RealFft;
//!
//! let field = Array2::from_shape_fn((9, 15), |(y, x)| ((3 * y + x) % 7) as f64);
//! let fft = RealFft::new(&[9, 15])?;
//! let spectrum = fft.forward(field.view())?;
//! let back = fft.inverse(spectrum)?;
//! assert!(field.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
//! # Ok::<(), stereology_spectrum::SpectrumError>(())
//! ```
//!
//! At which frequency does a texture have the most power?
//!
//! ```
//! use ndarray::Array2;
//! use stereology_spectrum::radial_spectrum;
//!
//! let waves = Array2::from_shape_fn((64, 64), |(_, x)| (x as f64 * std::f64::consts::TAU / 8.0).cos());
//! let spectrum = radial_spectrum(waves.view(), 32)?;
//! let strongest = (0..32).max_by(|&a, &b| spectrum.power[a].total_cmp(&spectrum.power[b])).unwrap();
//! assert!((spectrum.frequency[strongest] - 1.0 / 8.0).abs() < 1.0 / 64.0);
//! # Ok::<(), stereology_spectrum::SpectrumError>(())
//! ```

mod band_pass;
mod covariance;
mod error;
mod periodic;
mod radial;
mod real;
mod transform;

pub use band_pass::BandPass;
pub use covariance::{autocorrelation, autocovariance, masked_autocovariance};
pub use error::SpectrumError;
pub use periodic::periodic_component;
pub use radial::{RadialSpectrum, radial_spectrum};
pub use real::Real;
pub use rustfft::num_complex::Complex;
pub use transform::{ComplexFft, RealFft, Work, frequency};
