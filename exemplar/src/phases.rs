//! Assignment of phases with exact fractions.

use crate::field::Field;
use crate::numbers::{number, small};
use crate::stage::{Stage, Votes};

/// Phase of a voxel's channels: indicators, of which two phases share one.
pub(crate) fn phase_of(value: impl Fn(usize) -> f32, phases: usize) -> usize {
    if phases == 2 {
        return usize::from(value(0) >= 0.5);
    }
    (1..phases).fold(0, |best, phase| if value(phase) > value(best) { phase } else { best })
}

impl Stage<'_> {
    /// Phase of each voxel, with exactly the exemplars' fractions: if a phase has too many voxels, those with the
    /// largest margin of votes for a phase with too few are reassigned. Fixed voxels are not. `gaps` must contain
    /// weights.
    pub(crate) fn settle_phases(&self, field: &mut Field, phases: usize) -> Vec<u8> {
        let exemplars = self.level.places.len();
        let mut fractions = vec![0.0; phases];
        for places in &self.level.places {
            for &place in places {
                let phase = phase_of(|channel| self.level.value(channel, place), phases);
                fractions[phase] += 1.0 / (places.len() * exemplars) as f64;
            }
        }
        let mut labels: Vec<u8> = (0..field.sources.len())
            .map(|voxel| small(phase_of(|channel| field.values[channel][voxel], phases)))
            .collect();
        let held: Vec<u32> = (0..number(labels.len()))
            .filter(|&voxel| field.holds(voxel as usize))
            .collect();
        // Positive for phases with too many voxels.
        let mut surplus = rounded(&fractions, held.len())
            .map(|wanted| -wanted)
            .collect::<Vec<i64>>();
        for &voxel in &held {
            surplus[usize::from(labels[voxel as usize])] += 1;
        }
        let multipliers = vec![1.0; self.level.pixel.len()];
        let [_, ny, nx] = field.size;
        let mut votes = Votes::default();
        for wanted in 0..phases {
            if surplus[wanted] >= 0 {
                continue;
            }
            let mut claims: Vec<(f32, u32, u32)> = Vec::new();
            for &voxel in &held {
                let now = usize::from(labels[voxel as usize]);
                let given = !field.is_fixed.is_empty() && field.is_fixed[voxel as usize];
                if surplus[now] <= 0 || given {
                    continue;
                }
                let v = voxel as usize;
                self.gather(field, &multipliers, [v / (ny * nx), v / nx % ny, v % nx], 1, &mut votes);
                let (mut margin, mut all, mut best) = (0.0, 0.0, (f32::NEG_INFINITY, field.sources[v]));
                for (&place, &weight) in votes.places.iter().zip(&votes.weights) {
                    let phase = phase_of(|channel| self.level.value(channel, place), phases);
                    all += weight;
                    if phase == wanted {
                        margin += weight;
                        if weight > best.0 {
                            best = (weight, place);
                        }
                    } else if phase == now {
                        margin -= weight;
                    }
                }
                claims.push((margin / all, voxel, best.1));
            }
            claims.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, voxel, source) in claims {
                if surplus[wanted] >= 0 {
                    break;
                }
                let label = &mut labels[voxel as usize];
                if surplus[usize::from(*label)] > 0 {
                    surplus[usize::from(*label)] -= 1;
                    surplus[wanted] += 1;
                    *label = small(wanted);
                    field.sources[voxel as usize] = source;
                }
            }
        }
        labels
    }
}

/// Whole numbers with the sum `n` in these fractions, by largest remainders.
#[allow(clippy::cast_possible_truncation, reason = "numbers of voxels")]
fn rounded(fractions: &[f64], n: usize) -> impl Iterator<Item = i64> {
    let exact: Vec<f64> = fractions.iter().map(|fraction| fraction * n as f64).collect();
    let mut whole: Vec<i64> = exact.iter().map(|v| v.floor() as i64).collect();
    let mut order: Vec<usize> = (0..fractions.len()).collect();
    order.sort_by(|&a, &b| {
        (exact[b] - exact[b].floor())
            .total_cmp(&(exact[a] - exact[a].floor()))
            .then(a.cmp(&b))
    });
    let left = n as i64 - whole.iter().sum::<i64>();
    for &phase in order.iter().cycle().take(left.max(0) as usize) {
        whole[phase] += 1;
    }
    whole.into_iter()
}

#[cfg(test)]
mod tests {
    use super::{phase_of, rounded};

    #[test]
    fn phases_follow_from_indicators() {
        assert_eq!(phase_of(|_| 0.5, 2), 1);
        assert_eq!(phase_of(|channel| [0.2, 0.5, 0.3][channel], 3), 1);
    }

    #[test]
    fn fractions_become_whole_voxels() {
        assert_eq!(rounded(&[0.3, 0.3, 0.4], 4).collect::<Vec<_>>(), [1, 1, 2]);
        assert_eq!(rounded(&[0.5, 0.5], 27).sum::<i64>(), 27);
    }
}
