//! The section law of a mesh: ours is exact in depth; the reference is trimesh with random sections, the usual way
//! today.

use anyhow::{Context, Result};
use serde_json::Value;
use stereology::kmatrix::{SectionLaw, SectionOptions};
use stereology::shape::{Body, ClosedMesh, TriangleMesh, write_mesh};

use super::bench::{Bench, Row, Section};

const SCRIPT: &str = include_str!("section_law.py");
const BINS: usize = 10;
const TOLERANCE: f64 = 0.005;
/// Random planes cut to measure the time of one.
const PLANES: usize = 400;

pub fn measure(bench: &Bench) -> Result<Section> {
    let meshes = [
        ("cube", TriangleMesh::cuboid([1.0; 3]), 400),
        ("rock, convex", Body::rock(1).to_triangles(0), 200),
        (
            "round rock, convex",
            Body::ellipsoid([1.0, 0.8, 0.6])?.to_triangles(3),
            40,
        ),
        ("torus", TriangleMesh::torus(2.0, 0.5, 100, 50), 1),
        ("rough rock", Body::rough_rock(1, 0.05)?.to_triangles(0), 1),
    ];
    let folder = std::env::temp_dir().join(format!("stereology-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let mut arguments = vec![PLANES.to_string()];
    for (k, (_, mesh, _)) in meshes.iter().enumerate() {
        let path = folder.join(format!("{k}.ply"));
        write_mesh(&path, mesh)?;
        arguments.push(path.display().to_string());
    }
    let answer = bench.ask_peer("trimesh (with scipy, shapely, networkx)", SCRIPT, &arguments);
    let removed = std::fs::remove_dir_all(&folder);
    let answer = answer?;
    removed?;
    let mut rows = Vec::new();
    for (k, (name, mesh, runs)) in meshes.iter().enumerate() {
        let checks = u32::div_ceil(*runs, 10);
        let (checking, body) = bench.time(checks, || Ok(Body::from_mesh(ClosedMesh::try_from(mesh.clone())?)))?;
        let options = SectionOptions::default().with_bins(BINS).with_tolerance(TOLERANCE);
        let (ours, law) = bench.time(*runs, || Ok(SectionLaw::of_body(&body, &options)?))?;
        let peer = match &answer {
            Ok(answer) => Some(
                peer_of(&answer["rows"][k])
                    .with_context(|| format!("the result of the reference program for {name}"))?,
            ),
            Err(_) => None,
        };
        let task = |what: &str| format!("{name}, {} triangles: {what}", mesh.triangles.len());
        let sections = sections_needed(&law);
        let agreement = peer.as_ref().map_or_else(String::new, |peer| {
            format!(
                "profiles per intersecting plane {:.2} and {:.2}, mean section {:.3} and {:.3} (reference: {} planes)",
                law.profiles_per_hit(),
                peer.profiles_per_hit,
                law.mean_section_area(),
                peer.mean_section_area,
                peer.hits
            )
        });
        rows.push(Row {
            task: task("law"),
            ours,
            peer: peer.as_ref().map(|peer| peer.seconds_per_hit * sections),
            remark: format!("{sections:.0} sections; {agreement}"),
        });
        rows.push(Row {
            task: task("check and largest section, then law"),
            ours: checking + ours,
            peer: peer.as_ref().map(|peer| peer.seconds_per_hit * sections),
            remark: "the reference checks nothing and takes the largest section found".to_owned(),
        });
    }
    Ok(Section {
        words: format!(
            "K of {BINS} bins to a standard error of {TOLERANCE}. Ours: exact in depth, over directions until the error is reached. Reference: \
             `Trimesh.section` by isotropic uniform random planes, `to_2D`, `polygons_full`, areas. Its time is that of one intersecting section (the best \
             of three runs of {PLANES} planes) times the number of sections that reduces the largest standard error of a count p of n, √(p (1 − p) / n), \
             to the same value. So its times are extrapolated, not measured, and only the statistical error is counted."
        ),
        peer: answer
            .as_ref()
            .map(|answer| answer["version"].as_str().unwrap_or("trimesh").to_owned())
            .map_err(Clone::clone),
        rows,
    })
}

struct Peer {
    seconds_per_hit: f64,
    profiles_per_hit: f64,
    mean_section_area: f64,
    hits: u64,
}

fn peer_of(row: &Value) -> Result<Peer> {
    let number = |name: &str| row[name].as_f64().with_context(|| format!("{name} is not a number"));
    Ok(Peer {
        seconds_per_hit: number("seconds_per_hit")?,
        profiles_per_hit: number("profiles_per_hit")?,
        mean_section_area: number("mean_section_area")?,
        hits: row["hits"].as_u64().context("hits is not a count")?,
    })
}

/// Number of random sections that brings every `K[i][j] = (j / n) p` to the tolerance, where p is the fraction of
/// profiles and each section has m profiles.
fn sections_needed(law: &SectionLaw) -> f64 {
    let matrix = law.k_matrix(BINS);
    let mut needed = 0.0_f64;
    for j in 0..BINS {
        let size = (j + 1) as f64 / BINS as f64;
        for i in 0..=j {
            let share = matrix[(i, j)] / size;
            needed = needed.max(size * size * share * (1.0 - share) / (TOLERANCE * TOLERANCE));
        }
    }
    (needed / law.profiles_per_hit()).ceil()
}
