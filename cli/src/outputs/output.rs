//! The name of an output on the command line.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::builder::TypedValueParser;

/// The name of an output on the command line.
///
/// It is no path to write to: [`Outputs`](super::Outputs) gives that.
#[derive(Clone, Debug)]
pub struct Output(PathBuf);

impl Output {
    /// The name as it was given.
    pub fn name(&self) -> &Path {
        &self.0
    }

    /// The name as text.
    pub fn display(&self) -> std::path::Display<'_> {
        self.0.display()
    }

    /// Extension of the name.
    pub fn extension(&self) -> Option<&OsStr> {
        self.0.extension()
    }
}

impl clap::builder::ValueParserFactory for Output {
    type Parser = clap::builder::MapValueParser<clap::builder::PathBufValueParser, fn(PathBuf) -> Self>;

    fn value_parser() -> Self::Parser {
        clap::builder::PathBufValueParser::new().map(Self)
    }
}
