//! `steps.json`: digests of the inputs of the steps of a synthesis, and what their other files do not hold.
//!
//! A step is offered to another run only while its file is as it was written.

use crate::files::packing::PackingFile;
use crate::files::{FileError, json, residual};
use crate::pipeline::{Digest, FineDetails, Finished, FinishedPacking, FinishedTexture, Inputs, Synthesis};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;
use stereology_metrics::Finding;
use stereology_pyramid::TextureReport;

const SCHEMA: &str = "stereology.steps/1";

#[derive(Serialize, Deserialize)]
struct StepsFile {
    schema: String,
    pack: PackStep,
    texture: TextureStep,
}

#[derive(Serialize, Deserialize)]
struct PackStep {
    inputs: String,
    /// Digest of packing.json.
    file: String,
    iterations: usize,
}

#[derive(Serialize, Deserialize)]
struct TextureStep {
    inputs: String,
    /// Digest of texture.npy.
    file: String,
    /// Edge of a voxel.
    voxel: f64,
    binder: Option<Report>,
    particles: Option<Report>,
    /// Codes and messages.
    findings: Vec<(String, String)>,
}

#[derive(Serialize, Deserialize)]
struct Report {
    levels: usize,
    band_errors: Vec<f64>,
    slice_errors: Vec<f64>,
    final_error: f64,
}

impl Report {
    fn of(report: &TextureReport) -> Self {
        Self {
            levels: report.levels,
            band_errors: report.band_errors.clone(),
            slice_errors: report.slice_errors.clone(),
            final_error: report.final_error,
        }
    }

    fn report(self) -> TextureReport {
        TextureReport::recorded(self.levels, self.band_errors, self.slice_errors, self.final_error)
    }
}

/// Writes `steps.json` beside the finished `packing.json` and `texture.npy`.
///
/// # Errors
///
/// [`FileError`] if one of these cannot be read, or the file cannot be written.
pub fn write(folder: impl AsRef<Path>, synthesis: &Synthesis) -> Result<(), FileError> {
    let folder = folder.as_ref();
    let details = &synthesis.details;
    let findings = details
        .findings
        .iter()
        .map(|of| (of.code.to_owned(), of.message.clone()));
    let file = StepsFile {
        schema: SCHEMA.to_owned(),
        pack: PackStep {
            inputs: synthesis.packing_inputs.to_string(),
            file: digest_of(&folder.join("packing.json"))?,
            iterations: synthesis.packing.iterations(),
        },
        texture: TextureStep {
            inputs: synthesis.texture_inputs.to_string(),
            file: digest_of(&folder.join("texture.npy"))?,
            voxel: details.residual.voxel,
            binder: details.binder.as_ref().map(Report::of),
            particles: details.particles.as_ref().map(Report::of),
            findings: findings.collect(),
        },
    };
    json::write(&folder.join("steps.json"), &file)
}

/// Reads the finished steps of a folder; those whose file was changed or removed are left out.
///
/// # Errors
///
/// [`FileError`]: no `steps.json`, or one of another kind or version.
pub fn read(folder: impl AsRef<Path>) -> Result<Finished, FileError> {
    let folder = folder.as_ref();
    let path = folder.join("steps.json");
    let file: StepsFile = json::read(&path)?;
    if file.schema != SCHEMA {
        return Err(FileError::Schema {
            path,
            found: file.schema,
            expected: SCHEMA,
        });
    }
    let unchanged = |name: &str, digest: &str| digest_of(&folder.join(name)).is_ok_and(|found| found == digest);
    let packing = || {
        let packing = PackingFile::read(folder.join("packing.json")).ok()?;
        Some(FinishedPacking {
            inputs: Digest::from_digits(&file.pack.inputs),
            particles: packing.unpack().ok()?.0,
            iterations: file.pack.iterations,
        })
    };
    let packing = unchanged("packing.json", &file.pack.file).then(packing).flatten();
    let texture = if unchanged("texture.npy", &file.texture.file) {
        texture(folder, file.texture)
    } else {
        None
    };
    Ok(Finished { packing, texture })
}

fn texture(folder: &Path, step: TextureStep) -> Option<FinishedTexture> {
    let findings = step
        .findings
        .into_iter()
        .map(|(code, message)| Some(Finding::new(known(&code)?, message)));
    Some(FinishedTexture {
        inputs: Digest::from_digits(&step.inputs),
        details: FineDetails {
            residual: residual::read(&folder.join("texture.npy"), step.voxel).ok()?,
            binder: step.binder.map(Report::report),
            particles: step.particles.map(Report::report),
            findings: findings.collect::<Option<_>>()?,
        },
    })
}

/// The codes of a residual volume; a step with others is computed again.
fn known(code: &str) -> Option<&'static str> {
    ["levels-reduced", "few-samples", "constant-exemplar", "no-texture"]
        .into_iter()
        .find(|known| *known == code)
}

fn digest_of(path: &Path) -> Result<String, FileError> {
    let bytes = fs::read(path).map_err(|source| FileError::io(path, source))?;
    Ok(Inputs::of("file").bytes(&bytes).digest().to_string())
}
