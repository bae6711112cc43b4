//! Periodic packing: ours beside spheropack, which packs spheres only; then packings that no other program makes with a
//! certificate.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use stereology::anneal::{Grain, PackOptions, Packing, box_for_fraction, lognormal_sizes, mix, pack, populate};
use stereology::shape::{Arrangement, Body, ClosedMesh, TriangleMesh, UnitBody};

use super::bench::{Bench, Row, Section};

const SCRIPT: &str = include_str!("packing.py");
const SIGMA: f64 = 0.3;

pub fn measure(bench: &Bench) -> Result<Section> {
    let ball = UnitBody::new(&Body::sphere(1.0)?);
    let spheres = [
        (1000, 0.3),
        (1000, 0.5),
        (1000, 0.6),
        (1000, 0.64),
        (10_000, 0.3),
        (10_000, 0.6),
    ];
    let sizes = spheres
        .iter()
        .map(|&(count, _)| lognormal_sizes(count, SIGMA, 1))
        .collect::<Result<Vec<_>, _>>()?;
    // The reference program's time grows without bound near jamming, so it is measured up to a fraction of 0.6.
    let asked: Vec<usize> = (0..spheres.len()).filter(|&k| spheres[k].1 <= 0.6).collect();
    let path = std::env::temp_dir().join(format!("stereology-bench-sizes-{}.json", std::process::id()));
    let of_peer: Vec<&Vec<f64>> = asked.iter().map(|&k| &sizes[k]).collect();
    std::fs::write(&path, serde_json::to_vec(&of_peer)?)?;
    let mut arguments = vec![path.display().to_string()];
    arguments.extend(asked.iter().map(|&k| spheres[k].1.to_string()));
    let answer = bench.ask_peer("spheropack", SCRIPT, &arguments);
    let removed = std::fs::remove_file(&path);
    let answer = answer?;
    removed?;
    let mut rows = Vec::new();
    for (k, ((count, fraction), sizes)) in spheres.iter().zip(&sizes).enumerate() {
        let (ours, packing) = packed(bench, std::slice::from_ref(&ball), sizes, *fraction)?;
        let place = asked.iter().position(|&of| of == k);
        let (peer, theirs) = match (&answer, place) {
            (Ok(answer), Some(place)) => {
                let row = &answer["rows"][place];
                let number = |name: &str| {
                    row[name]
                        .as_f64()
                        .with_context(|| format!("{name} of the reference program is not a number"))
                };
                (Some(number("seconds")?), format!("{:.4}", number("fraction")?))
            }
            _ => (None, "not measured".to_owned()),
        };
        rows.push(Row {
            task: format!("{count} spheres at {fraction}"),
            ours,
            peer,
            remark: format!(
                "{} iterations; fraction {:.4}, reference {theirs}",
                packing.iterations(),
                packing.fraction()
            ),
        });
    }
    let ring = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.7, 32, 16))?;
    for (name, body, count, fraction) in [
        ("rocks of 20 vertices", Body::rock(24), 1000, 0.5),
        ("rocks of 20 vertices", Body::rock(24), 1000, 0.55),
        ("ellipsoids", Body::ellipsoid([1.0, 0.8, 0.6])?, 1000, 0.5),
        ("cubes", Body::cuboid([1.0; 3])?, 1000, 0.5),
        ("rings of 1024 faces", Body::from_mesh(ring), 300, 0.2),
    ] {
        let sizes = lognormal_sizes(count, SIGMA, 1)?;
        let (ours, packing) = packed(bench, &[UnitBody::new(&body)], &sizes, fraction)?;
        rows.push(Row {
            task: format!("{count} {name} at {fraction}"),
            ours,
            peer: None,
            remark: format!("{} iterations", packing.iterations()),
        });
    }
    Ok(Section {
        words: format!(
            "Sizes lognormal, σ {SIGMA}, equal for both programs; a periodic box; from random positions to no overlap, ours with its certificate. Reference: \
             event-driven growth (Lubachevsky & Stillinger), spheres only."
        ),
        peer: answer
            .as_ref()
            .map(|answer| answer["version"].as_str().unwrap_or("spheropack").to_owned())
            .map_err(Clone::clone),
        rows,
    })
}

/// CPU seconds of one packing, random placement included, and the packing.
fn packed(bench: &Bench, bodies: &[UnitBody], sizes: &[f64], fraction: f64) -> Result<(f64, Packing)> {
    let batch = if sizes.len() > 1000 { 1 } else { 5 };
    bench.time(batch, || {
        let grains: Vec<Grain> = mix(sizes, &[1.0], 1)?;
        let period = box_for_fraction(bodies, &grains, fraction)?;
        let start = populate(&grains, &period, 1);
        let options = PackOptions::default();
        Ok(pack(&Arrangement::new(bodies, start, period)?, &options, &|_| {
            ControlFlow::Continue(())
        })?)
    })
}
