//! Laws of the transforms, judged by the sum that defines them.

mod laws;
