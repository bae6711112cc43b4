//! `stereology schema`: JSON Schemas of the answers.

use clap::Args;
use schemars::Schema;

use crate::answer::{Fields, print, schema_of};
use crate::commands::assemble::AssembleFields;
use crate::commands::carve::CarveFields;
use crate::commands::contact::ContactFields;
use crate::commands::displace::DisplaceFields;
use crate::commands::exemplar::ExemplarFields;
use crate::commands::explore::ExploreFields;
use crate::commands::export::ExportFields;
use crate::commands::grow::GrowFields;
use crate::commands::kmatrix::KmatrixFields;
use crate::commands::measure::MeasureFields;
use crate::commands::pack::PackFields;
use crate::commands::pyramid::PyramidFields;
use crate::commands::render::RenderFields;
use crate::commands::segment::SegmentFields;
use crate::commands::shape::ShapeFields;
use crate::commands::slice::SliceFields;
use crate::commands::synthesize::SynthesizeFields;
use crate::commands::texture::TextureFields;
use crate::commands::unfold::UnfoldFields;
use crate::everywhere::Everywhere;
use crate::failure::Failure;
use crate::outputs::{Output, write_text};

/// Prints the JSON Schema of a command's --json answer
///
/// The schema names every field of the JSON object with its type and meaning. A summary.json follows the same schema,
/// without `seconds`. Without COMMAND the schemas of all commands are written into the folder DIR, as COMMAND.json;
/// docs/schema holds them.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology schema unfold")]
pub struct SchemaOf {
    /// Command whose answer is described
    #[arg(
        value_name = "COMMAND",
        required_unless_present = "output",
        conflicts_with = "output"
    )]
    pub command: Option<String>,
    /// Write the schemas of all commands into this folder
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<Output>,
}

/// A command and the schema of its answer.
struct Entry {
    command: &'static str,
    schema: fn() -> Schema,
}

fn entry<T: Fields>() -> Entry {
    Entry {
        command: T::COMMAND,
        schema: schema_of::<T>,
    }
}

fn entries() -> [Entry; 19] {
    [
        entry::<SynthesizeFields>(),
        entry::<SegmentFields>(),
        entry::<KmatrixFields>(),
        entry::<UnfoldFields>(),
        entry::<PackFields>(),
        entry::<TextureFields>(),
        entry::<PyramidFields>(),
        entry::<ShapeFields>(),
        entry::<AssembleFields>(),
        entry::<SliceFields>(),
        entry::<RenderFields>(),
        entry::<ExportFields>(),
        entry::<CarveFields>(),
        entry::<MeasureFields>(),
        entry::<ExemplarFields>(),
        entry::<GrowFields>(),
        entry::<ContactFields>(),
        entry::<DisplaceFields>(),
        entry::<ExploreFields>(),
    ]
}

impl SchemaOf {
    pub fn run(&self, everywhere: &Everywhere) -> Result<(), Failure> {
        if let Some(folder) = &self.output {
            for Entry { command, schema } in entries() {
                let path = everywhere
                    .outputs
                    .file_called(&folder.name().join(format!("{command}.json")))?;
                write_text(&path, &text(&schema()))?;
            }
            return Ok(());
        }
        let name = self.command.as_deref().unwrap_or_default();
        let found = entries().into_iter().find(|entry| entry.command == name);
        let Some(Entry { schema, .. }) = found else {
            let names: Vec<_> = entries().iter().map(|entry| entry.command).collect();
            return Err(Failure::usage(format!(
                "`{name}` is not a command with a JSON answer; these are {}",
                names.join(", ")
            )));
        };
        print(&text(&schema()))
    }
}

fn text(schema: &Schema) -> String {
    format!("{:#}\n", schema.as_value())
}
