//! Random changes of small files of meshes, tables, pictures and label maps, and of raw meshes, for seconds:
//! `mutate [SECONDS] [SEED] [TARGET]`. A case that fails is written to `mutate-failure.bin`, and its target is printed.

use std::panic::catch_unwind;
use std::path::Path;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_shape::{ControlSphere, TriangleMesh, write_mesh};

fn main() {
    let mut words = std::env::args().skip(1);
    let seconds: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(60);
    let seed: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(0);
    let only = words.next();
    let mut seeds = corpus();
    for target in ["photo", "labels"] {
        seeds.extend(files(target).into_iter().map(|bytes| (target, bytes)));
    }
    seeds.retain(|(target, _)| only.as_ref().is_none_or(|only| only == target));
    let start = Instant::now();
    let (mut cases, mut slowest) = (0_u64, Duration::ZERO);
    while start.elapsed() < Duration::from_secs(seconds) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(cases);
        let from = &seeds[rng.random_range(0..seeds.len())];
        let bytes = mutated(&from.1, &mut rng);
        let begin = Instant::now();
        let target = from.0;
        let outcome = catch_unwind(|| match target {
            "mesh_file" => stereology_fuzz::mesh_file(&bytes),
            "table" => stereology_fuzz::table(&bytes),
            "photo" => stereology_fuzz::photo(&bytes),
            "labels" => stereology_fuzz::labels(&bytes),
            _ => stereology_fuzz::sweep(&bytes),
        });
        slowest = slowest.max(begin.elapsed());
        if outcome.is_err() || begin.elapsed() > Duration::from_secs(20) {
            std::fs::write("mutate-failure.bin", &bytes).expect("the case can be kept");
            println!(
                "case {cases} of seed {seed} ({target}) failed or took {:?}",
                begin.elapsed()
            );
            std::process::exit(1);
        }
        cases += 1;
    }
    println!("{cases} cases in {seconds} s without a panic; the slowest took {slowest:?}");
}

/// Small tables in several dialects.
const TABLES: [&[u8]; 5] = [
    b" ,Label,Area,Mean\n1,\"a, b\",403.727,1\n2,\"c \"\"d\"\"\",482.6,2\n,,,\nMean,x,1,2\nSD,x,1,2\n",
    b"sep=;\r\nid;Area [\xb5m\xb2];y\r\n1;1.403,727;5,5\r\n2;12,5;NaN\r\n",
    b"2\nFeature_ID,area\n1,22.67\n2,24.79\nFeature_ID,Neighbours\n1,2\n",
    b"\"area\" \"y\"\n\"1\" 403.7 2\n\"2\" 1e5 -3\n",
    b"# area=3\nLabel\tarea\tx\n#\t[um^2]\t[-]\na\t1\t2\nb\t-3\t1e400\n",
];

/// The files of a target's corpus.
fn files(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("the corpus")
        .map(|entry| entry.expect("a file").path())
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| std::fs::read(path).expect("the file can be read"))
        .collect()
}

/// Small meshes in every format, and tables.
fn corpus() -> Vec<(&'static str, Vec<u8>)> {
    let folder = std::env::temp_dir().join(format!("stereology-mutate-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the corpus");
    let meshes = [
        TriangleMesh::cuboid([1.0, 2.0, 3.0]),
        TriangleMesh::torus(2.0, 0.8, 6, 4),
        TriangleMesh::icosphere(1.0, 1),
        TriangleMesh::cuboid([1.0; 3]).with(&TriangleMesh::cuboid([0.5; 3])),
    ];
    let mut corpus = Vec::new();
    for mesh in &meshes {
        for name in ["m.obj", "m.stl", "m.ply"] {
            write_mesh(folder.join(name), mesh).expect("the corpus can be written");
            corpus.push(("mesh_file", std::fs::read(folder.join(name)).expect("and read")));
        }
        corpus.push(("mesh_file", text_stl(mesh)));
        corpus.push(("mesh_file", text_ply(mesh)));
        for kind in [0_u8, 5] {
            corpus.push(("sweep", raw(mesh, kind)));
        }
    }
    corpus.extend(TABLES.map(|table| ("table", table.to_vec())));
    corpus.push(("mesh_file", ControlSphere::sphere(1.0).to_json().into_bytes()));
    let _ = std::fs::remove_dir_all(&folder);
    corpus
}

fn text_stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = String::from("solid m\n");
    for t in &mesh.triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for &v in t {
            let p = mesh.vertices[v as usize];
            text += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid m\n").into_bytes()
}

fn text_ply(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    for p in &mesh.vertices {
        text += &format!("{} {} {}\n", p.x, p.y, p.z);
    }
    for t in &mesh.triangles {
        text += &format!("3 {} {} {}\n", t[0], t[1], t[2]);
    }
    text.into_bytes()
}

/// The bytes that the target `sweep` interprets as this mesh.
fn raw(mesh: &TriangleMesh, kind: u8) -> Vec<u8> {
    let mut bytes = vec![u8::try_from(mesh.vertices.len()).unwrap_or(255), kind];
    for p in &mesh.vertices {
        for x in p.iter() {
            if kind % 4 == 0 {
                bytes.extend(x.to_le_bytes());
            } else {
                bytes.push((x * 2.0 + 3.0) as u8);
            }
        }
    }
    bytes.extend(mesh.triangles.iter().flatten().map(|&v| v as u8));
    bytes
}

/// Makes a few changes: bytes and numbers replaced, parts duplicated, removed or swapped, the end truncated.
fn mutated(from: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    const WORDS: [&[u8]; 14] = [
        b"nan",
        b"inf",
        b"-1",
        b"0",
        b"1e308",
        b"1e-308",
        b"4294967295",
        b"99999999999999999999",
        b"f 1 2 3 4 5 6",
        b"\\\n",
        b"//",
        b"\xff\xff\xff\xff",
        b"\0\0\0\0",
        b"end_header\n",
    ];
    let mut bytes = from.to_vec();
    for _ in 0..rng.random_range(1..6) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.random_range(0..bytes.len());
        let to = (at + rng.random_range(0..40)).min(bytes.len());
        match rng.random_range(0..8) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..to)),
            4 => {
                let piece = bytes[at..to].to_vec();
                let place = rng.random_range(0..=bytes.len());
                bytes.splice(place..place, piece);
            }
            5 => {
                let word = WORDS[rng.random_range(0..WORDS.len())];
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            6 => {
                let other = rng.random_range(0..bytes.len());
                bytes.swap(at, other);
            }
            _ => bytes[at] = b'0' + rng.random_range(0..10_u8),
        }
    }
    bytes
}
