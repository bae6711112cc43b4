//! `--edge-rule`: how much a profile counts at the edge of its slice, from what the table tells of it.

use clap::ValueEnum;
use stereology::files::profiles::ProfileRow;
use stereology::unfold::{self, BoundingBox, SamplingWindow};

use crate::failure::Failure;

/// Rules for profiles at the edges of a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EdgeRule {
    /// A profile wholly inside counts W H / ((W - w)(H - h)), w and h the sides of its box (Miles & Lantuejoul)
    MilesLantuejoul,
    /// What touches the left or upper edge does not count, all else does (counting frame); sizes must be of whole profiles
    Frame,
    /// What has the middle of its box inside counts; profiles must be known beyond the edges
    Plus,
    /// Everything counts, cut or not: wrong, for comparison
    All,
    /// What touches an edge does not count: wrong, for comparison
    Inside,
}

impl EdgeRule {
    fn rule(self) -> unfold::EdgeRule {
        match self {
            Self::MilesLantuejoul => unfold::EdgeRule::MilesLantuejoul,
            Self::Frame => unfold::EdgeRule::CountingFrame,
            Self::Plus => unfold::EdgeRule::PlusSampling,
            Self::All => unfold::EdgeRule::All,
            Self::Inside => unfold::EdgeRule::Inside,
        }
    }

    /// Weighs the profiles of slices of this size, width and height; the weights of the table are replaced.
    pub fn weigh(self, profiles: &mut [ProfileRow], window: Option<[f64; 2]>) -> Result<(), Failure> {
        let name = self.rule().name();
        let boxes: Option<Vec<BoundingBox>> = profiles.iter().map(|profile| profile.bounding_box).collect();
        let weights = match (boxes, window, self) {
            (Some(boxes), Some([width, height]), _) => {
                SamplingWindow::continuous(width, height)
                    .weigh(&boxes, self.rule())
                    .weights
            }
            (_, _, Self::All) => vec![1.0; profiles.len()],
            (_, _, Self::Inside) if profiles.iter().all(|profile| profile.touches_edge.is_some()) => profiles
                .iter()
                .map(|profile| f64::from(u8::from(profile.touches_edge == Some(false))))
                .collect(),
            (Some(_), None, _) => {
                return Err(Failure::usage(format!(
                    "--edge-rule {name} needs --window WIDTH,HEIGHT, the size of a slice"
                )));
            }
            (None, _, Self::Inside) => {
                return Err(Failure::run(
                    "--edge-rule inside needs the column touches_edge (0 or 1), or the columns left, top, right, bottom (the box around each profile) with --window",
                ));
            }
            (None, ..) => {
                return Err(Failure::run(format!(
                    "--edge-rule {name} needs the columns left, top, right, bottom: the box around each profile, in a window that begins at 0,0. A table of \
                     `stereology segment` has its weights by the rule given there"
                )));
            }
        };
        for (profile, weight) in profiles.iter_mut().zip(weights) {
            profile.weight = weight;
        }
        Ok(())
    }
}
