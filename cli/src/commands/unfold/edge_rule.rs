//! `--edge-rule`: weights of profiles at the edges of their slice.

use clap::ValueEnum;
use stereology::files::profiles::ProfileRow;
use stereology::unfold::{self, BoundingBox, SamplingWindow};

use crate::failure::Failure;

/// Rules for profiles at the edges of a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EdgeRule {
    /// Profiles entirely inside have the weight W H / ((W - w)(H - h)), where w and h are the sides of their bounding
    /// box (Miles-Lantuejoul)
    MilesLantuejoul,
    /// Counting frame: profiles that touch the left or the upper edge are excluded; sizes must be those of whole
    /// profiles
    Frame,
    /// Plus sampling: profiles with the centre of their bounding box inside count; profiles must be known beyond the
    /// edges
    Plus,
    /// All profiles count, truncated ones too: biased, for comparison
    All,
    /// Profiles that touch an edge are excluded: biased, for comparison
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

    /// Its name.
    pub fn name(self) -> &'static str {
        self.rule().name()
    }

    /// Replaces the weights of the table by those of the rule, for slices with this width and height.
    pub fn weigh(self, profiles: &mut [ProfileRow], window: Option<[f64; 2]>) -> Result<(), Failure> {
        let name = self.name();
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
                    "--edge-rule inside needs the column touches_edge (0 or 1), or the columns left, top, right, bottom (the bounding box of each profile) with --window",
                ));
            }
            (None, ..) => {
                return Err(Failure::run(format!(
                    "--edge-rule {name} needs the columns left, top, right, bottom: the bounding box of each profile, in a window that begins at 0,0. A table from \
                     `stereology segment` already has the weights of the rule given there"
                )));
            }
        };
        for (profile, weight) in profiles.iter_mut().zip(weights) {
            profile.weight = weight;
        }
        Ok(())
    }
}
