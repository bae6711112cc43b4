//! Outputs are whole or absent, nothing of the user's is lost, and what is too large is refused before the work.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::{answer, path, stereology, write_discs};

/// A folder with a table of profiles, a photograph, a packing and its file in it.
fn place() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let sizes: Vec<String> = (0..80).map(|i| format!("{}\n", 0.2 + f64::from(i) / 100.0)).collect();
    fs::write(folder.path().join("t.csv"), format!("size\n{}", sizes.concat())).unwrap();
    write_discs(path(&folder, "photo.png"));
    folder
}

fn packing(folder: &TempDir) -> String {
    let file = path(folder, "p.json");
    answer(&["pack", "--constant", "--count", "20", "--fraction", "0.1", "-o", &file]);
    file
}

fn names(folder: &TempDir) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// The message of a command that must be refused with this code, without a change in the folder.
fn refused(folder: &TempDir, wanted: i32, arguments: &[&str]) -> String {
    let before = names(folder);
    let (code, out, error) = stereology(arguments);
    assert_eq!((code, out.as_str()), (wanted, ""), "{arguments:?}: {error}");
    assert!(!error.contains("panicked"), "{error}");
    assert_eq!(names(folder), before, "{arguments:?}");
    error
}

#[test]
fn names_that_look_temporary_are_left_alone() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    let kept = |name: &str| {
        fs::create_dir_all(Path::new(&at(name)).parent().unwrap()).unwrap();
        fs::write(at(name), "years of work").unwrap();
    };
    let others = [
        "out.partial/thesis",
        "out.partial-old/thesis",
        "v.zarr.partial/n",
        "v.zarr.old/n",
        "d.csv.partial",
    ];
    others.iter().for_each(|name| kept(name));
    let (photo, out, solid) = (at("photo.png"), at("out"), packing(&folder));
    for force in [&[][..], &["--force"]] {
        answer(&[&["segment", &photo, "-o", &out], force].concat());
        answer(&[&["export", &solid, "--voxels", "8", "-o", &at("v.zarr")], force].concat());
        answer(&[&["unfold", &at("t.csv"), "--area", "100", "-o", &at("d.csv")], force].concat());
    }
    for name in others {
        assert_eq!(fs::read_to_string(at(name)).unwrap(), "years of work", "{name}");
    }
    assert_eq!(names(&folder).len(), 11);
}

#[test]
fn an_output_is_never_an_input() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    let (photo, table, solid) = (at("photo.png"), at("t.csv"), packing(&folder));
    let bytes = fs::read(&photo).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("photo.png", at("link.png")).unwrap();
        fs::hard_link(&photo, at("twin.png")).unwrap();
    }
    fs::create_dir(at("deep")).unwrap();
    let around = at("deep/../photo.png");
    let volume = at("v.npy");
    answer(&["export", &solid, "--voxels", "8", "-o", &volume]);
    let mesh = at("ball.ply");
    answer(&["shape", "rock:1", "-o", &mesh]);
    let share = format!("{mesh}=1");
    let inside = at("made");
    answer(&["assemble", &solid, "-o", &inside]);
    let part = at("made/packing.json");
    let whole = folder.path().to_str().unwrap();
    let cases: Vec<Vec<&str>> = vec![
        vec!["segment", &photo, "--labels-out", &photo, "-o", &inside],
        vec!["segment", &photo, "--labels-out", &around, "-o", &inside],
        vec!["segment", &photo, "-o", whole],
        vec!["measure", &photo, &volume, "--report", &volume],
        vec!["unfold", &table, "--area", "9", "-o", &table],
        vec!["shape", &mesh, "-o", &mesh],
        vec!["pack", "--constant", "--shape", &share, "-o", &mesh],
        vec!["export", &inside, "--voxels", "8", "-o", &inside],
        vec!["contact", &inside, "-o", &part],
        vec!["texture", &photo, "--size", "8,8", "-o", &photo],
    ];
    for case in &cases {
        let error = refused(&folder, 2, &[&case[..], &["--force"]].concat());
        assert!(error.contains("input") || case[0] == "export", "{error}");
    }
    for link in ["link.png", "twin.png"] {
        if Path::new(&at(link)).exists() {
            refused(
                &folder,
                2,
                &["texture", &photo, "--size", "8,8", "-o", &at(link), "--force"],
            );
        }
    }
    assert_eq!(fs::read(&photo).unwrap(), bytes);
    // What users put into a folder of results is theirs to replace.
    for _ in 0..2 {
        answer(&["slice", &inside, "--size", "8", "-o", &at("made/slice.png"), "--force"]);
    }
    // A mesh that a packing names is an input too.
    let of_mesh = at("m.json");
    answer(&[
        "pack",
        "--constant",
        "--count",
        "5",
        "--fraction",
        "0.1",
        "--shape",
        &mesh,
        "-o",
        &of_mesh,
    ]);
    let (code, _, error) = stereology(&["carve", &of_mesh, &mesh, "-o", &mesh, "--force"]);
    assert_eq!(code, 2, "{error}");
    let other = at("other.obj");
    answer(&["shape", "rock:2", "-o", &other]);
    let error = refused(&folder, 2, &["carve", &of_mesh, &other, "-o", &mesh, "--force"]);
    assert!(error.contains("ball.ply"), "{error}");
}

#[test]
fn force_replaces_only_what_this_program_wrote() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    let (photo, out, volume, solid) = (at("photo.png"), at("out"), at("v.zarr"), packing(&folder));
    let segment = ["segment", &photo, "-o", &out, "--force"];
    let export = ["export", &solid, "--voxels", "8", "-o", &volume, "--force"];
    fs::create_dir(&out).unwrap(); // empty: free to use
    for command in [&segment[..], &export[..]] {
        answer(command);
        answer(command);
    }
    for (command, mine) in [(&segment[..], "out/notes.txt"), (&export[..], "v.zarr/0/notes.txt")] {
        fs::write(at(mine), "years of work").unwrap();
        let error = refused(&folder, 1, command);
        assert!(error.contains("notes.txt"), "{error}");
        assert_eq!(fs::read_to_string(at(mine)).unwrap(), "years of work");
        fs::remove_file(at(mine)).unwrap();
        answer(command);
    }
}

#[test]
fn two_options_do_not_name_one_output() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    let (photo, mesh) = (at("photo.png"), at("ball.ply"));
    answer(&["shape", "rock:1", "-o", &mesh]);
    let contact = at("c.json");
    answer(&["contact", &photo, "-o", &contact]);
    let (npy, npz, csv, again) = (at("s.npy"), at("s.zarr"), at("e.csv"), at("./e.csv"));
    let inside = at("out/l.tif");
    let cases: Vec<Vec<&str>> = vec![
        vec!["exemplar", &photo, "--size", "8", "-o", &npy, "--sources", &npy],
        vec![
            "grow",
            &mesh,
            &photo,
            "--resolution",
            "8",
            "--seeds",
            "1",
            "-o",
            &npz,
            "--cells",
            &npz,
        ],
        vec![
            "displace",
            &mesh,
            "--contact",
            &contact,
            "--units",
            "9",
            "--labels-out",
            &csv,
            "--design-out",
            &again,
            "-o",
            "x.obj",
        ],
        vec!["pack", "--constant", "--also", &csv, "--trace", &again, "-o", "p.json"],
        vec!["pack", "--constant", "--also", &csv, "--also", &csv, "-o", "p.json"],
        vec!["segment", &photo, "-o", &inside, "--labels-out", &inside],
        vec![
            "segment",
            &photo,
            "-o",
            &csv,
            "--labels-out",
            &inside,
            "--labels-out",
            &inside,
        ],
    ];
    for case in cases {
        let error = refused(&folder, 2, &case);
        assert!(
            error.contains("one output") || error.contains("inside"),
            "{case:?}: {error}"
        );
    }
}

/// The last of several outputs cannot be written: none appears, and what was there stays.
#[test]
fn a_set_of_outputs_appears_together_or_not_at_all() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    fs::write(at("b.csv"), "old").unwrap();
    let arguments = ["pack", "--constant", "--count", "20", "--fraction", "0.1", "--force"];
    let (csv, trace, json) = (at("b.csv"), at("trace.csv"), at("p.json"));
    let outputs = ["--also", &csv, "--trace", &trace, "-o", &json];
    // A folder that is in the way.
    fs::create_dir(&json).unwrap();
    refused(&folder, 1, &[&arguments[..], &outputs].concat());
    assert_eq!(fs::read_to_string(&csv).unwrap(), "old");
    fs::remove_dir(&json).unwrap();
    answer(&[&arguments[..], &outputs].concat());
    assert!(fs::read_to_string(&csv).unwrap() != "old" && Path::new(&trace).exists() && Path::new(&json).exists());
    assert_eq!(names(&folder), ["b.csv", "p.json", "photo.png", "t.csv", "trace.csv"]);
}

#[test]
fn names_of_250_bytes_work() {
    let folder = place();
    let name = |length: usize, ending: &str| path(&folder, &format!("{}{ending}", "x".repeat(length - ending.len())));
    let solid = packing(&folder);
    answer(&[
        "unfold",
        &path(&folder, "t.csv"),
        "--area",
        "100",
        "-o",
        &name(250, ".csv"),
    ]);
    answer(&["export", &solid, "--voxels", "8", "-o", &name(250, ".zarr")]);
    answer(&["export", &solid, "--voxels", "8", "--resume", "-o", &name(250, ".npy")]);
    answer(&["segment", &path(&folder, "photo.png"), "-o", &name(250, "")]);
    answer(&["shape", "sphere", "-o", &name(255, ".obj")]);
    assert_eq!(names(&folder).len(), 8);
}

#[test]
fn limits_are_told_before_the_work() {
    let folder = place();
    let at = |name: &str| path(&folder, name);
    let (photo, out) = (at("photo.png"), at("o.npy"));
    fs::write(at("d.csv"), "lower_edge,upper_edge,number_density\n0,1,255\n").unwrap();
    let json = at("p.json");
    let cases: Vec<(i32, &str, Vec<&str>)> = vec![
        (
            2,
            "bytes of memory",
            vec!["exemplar", &photo, "--size", "1000", "-o", &out],
        ),
        (
            2,
            "bytes of memory",
            vec![
                "grow",
                "rock:1",
                &photo,
                "--resolution",
                "2000",
                "--seeds",
                "2",
                "-o",
                &out,
            ],
        ),
        (
            2,
            "replicates",
            vec!["unfold", &photo, "--area", "1", "--bootstrap", "1"],
        ),
    ];
    for (code, message, case) in cases {
        let error = refused(&folder, code, &case);
        assert!(error.contains(message), "{case:?}: {error}");
    }
    let error = refused(
        &folder,
        1,
        &["pack", "--densities", &at("d.csv"), "--box", "500", "-o", &json],
    );
    assert!(error.contains("particles are too many"), "{error}");
    // More memory can be allowed.
    answer(&[
        "exemplar",
        &photo,
        "--size",
        "8",
        "--memory",
        "0.1",
        "--iterations",
        "1",
        "-o",
        &out,
    ]);
}

#[cfg(unix)]
mod on_unix {
    use std::fs;
    use std::io::Read;
    use std::os::unix::fs::FileTypeExt;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    use super::{names, packing, path, place, refused};
    use crate::{answer, stereology};

    fn program(arguments: &[&str]) -> Command {
        let mut program = Command::new(assert_cmd::cargo::cargo_bin!("stereology"));
        program.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        program
    }

    /// Waits for a child, at most 20 seconds.
    fn code(child: &mut Child) -> i32 {
        let since = Instant::now();
        while since.elapsed() < Duration::from_secs(20) {
            if let Some(status) = child.try_wait().unwrap() {
                return status.code().unwrap();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        panic!("the program did not end");
    }

    #[test]
    fn a_lost_answer_is_a_failure() {
        if !Path::new("/dev/full").exists() {
            return;
        }
        for arguments in [
            &["kmatrix", "sphere", "--json"][..],
            &["kmatrix", "sphere"],
            &["schema", "pack"],
            &["--help"],
        ] {
            let full = fs::File::options().write(true).open("/dev/full").unwrap();
            assert_eq!(
                program(arguments).stdout(full).status().unwrap().code(),
                Some(1),
                "{arguments:?}"
            );
        }
        // Nobody reads on: not a failure.
        let mut child = program(&["kmatrix", "sphere", "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        assert_eq!(code(&mut child), 0);
    }

    #[test]
    fn a_link_is_followed() {
        let folder = place();
        let at = |name: &str| path(&folder, name);
        fs::create_dir(at("deep")).unwrap();
        for name in ["d.csv", "v.zarr", "out"] {
            std::os::unix::fs::symlink(format!("deep/{name}"), at(name)).unwrap();
        }
        let solid = packing(&folder);
        for force in [&[][..], &["--force"]] {
            answer(&[&["unfold", &at("t.csv"), "--area", "100", "-o", &at("d.csv")], force].concat());
            answer(&[&["export", &solid, "--voxels", "8", "-o", &at("v.zarr")], force].concat());
            answer(&[&["segment", &at("photo.png"), "-o", &at("out")], force].concat());
        }
        for name in ["d.csv", "v.zarr", "out"] {
            assert!(fs::symlink_metadata(at(name)).unwrap().is_symlink());
            assert!(!fs::symlink_metadata(at(&format!("deep/{name}"))).unwrap().is_symlink());
        }
    }

    #[test]
    fn devices_and_pipes_are_written_to() {
        let folder = place();
        let at = |name: &str| path(&folder, name);
        answer(&["unfold", &at("t.csv"), "--area", "100", "-o", "/dev/null", "--force"]);
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        let pipe = at("pipe.csv");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = {
            let pipe = pipe.clone();
            std::thread::spawn(move || {
                let mut text = String::new();
                fs::File::open(pipe).unwrap().read_to_string(&mut text).unwrap();
                text
            })
        };
        answer(&["unfold", &at("t.csv"), "--area", "100", "-o", &pipe]);
        answer(&["unfold", &at("t.csv"), "--area", "100", "-o", &at("file.csv")]);
        assert_eq!(reader.join().unwrap(), fs::read_to_string(at("file.csv")).unwrap());
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        // A pipe that nobody reads can be left.
        let mut child = program(&["unfold", &at("t.csv"), "--area", "100", "-o", &pipe])
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(300));
        signal(&child, "TERM");
        assert_eq!(code(&mut child), 143);
    }

    fn signal(child: &Child, name: &str) {
        let sent = Command::new("kill")
            .args([format!("-{name}"), child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
    }

    #[test]
    fn signals_leave_nothing_behind() {
        let folder = place();
        let solid = packing(&folder);
        let before = names(&folder);
        for (name, wanted) in [("TERM", 143), ("HUP", 129), ("INT", 130)] {
            for output in ["k.npy", "k.zarr"] {
                let file = path(&folder, output);
                let mut child = program(&["export", &solid, "--voxels", "1200", "-o", &file])
                    .spawn()
                    .unwrap();
                while names(&folder) == before {
                    std::thread::sleep(Duration::from_millis(5));
                }
                let since = Instant::now();
                signal(&child, name);
                assert_eq!(code(&mut child), wanted);
                assert!(since.elapsed() < Duration::from_secs(2), "{:?}", since.elapsed());
                assert_eq!(names(&folder), before);
            }
        }
    }

    #[test]
    fn of_two_writers_one_wins() {
        let folder = place();
        let solid = packing(&folder);
        let before = names(&folder);
        for output in ["r.npy", "r.zarr", "r.tif"] {
            let file = path(&folder, output);
            let mut both = [40, 48].map(|voxels: i32| {
                let voxels = voxels.to_string();
                program(&["export", &solid, "--voxels", &voxels, "-o", &file])
                    .spawn()
                    .unwrap()
            });
            let mut codes = both.each_mut().map(code);
            codes.sort_unstable();
            assert_eq!(codes, [0, 1], "{output}");
            assert!(Path::new(&file).exists());
        }
        assert_eq!(names(&folder).len(), before.len() + 3);
    }

    #[test]
    fn a_resumed_export_has_one_process() {
        let folder = place();
        let solid = packing(&folder);
        let before = names(&folder);
        let file = path(&folder, "k.npy");
        let export = ["export", &solid, "--voxels", "1200", "--resume", "-o", &file];
        let mut child = program(&export).spawn().unwrap();
        while names(&folder) == before {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(50));
        let error = refused(&folder, 1, &export);
        assert!(error.contains("another process"), "{error}");
        signal(&child, "INT");
        assert_eq!(code(&mut child), 130);
        assert!(Path::new(&format!("{file}.partial")).exists());
    }

    #[test]
    fn too_many_threads_are_refused() {
        let mut child = program(&["kmatrix", "sphere"])
            .env("RAYON_NUM_THREADS", "100000")
            .spawn()
            .unwrap();
        assert_eq!(code(&mut child), 2);
        assert_eq!(stereology(&["kmatrix", "sphere", "--threads", "100000"]).0, 2);
    }

    #[test]
    fn names_need_not_be_utf8() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().join(OsStr::from_bytes(b"k\xf6rn.obj"));
        let run = |arguments: &[&OsStr]| {
            let mut program = program(&[]);
            program.args(arguments).status().unwrap().code()
        };
        let of = |word: &'static str| OsStr::new(word);
        assert_eq!(run(&[of("shape"), of("rock:1"), of("-o"), name.as_os_str()]), Some(0));
        let again = folder.path().join("again.ply");
        assert_eq!(
            run(&[of("shape"), name.as_os_str(), of("-o"), again.as_os_str()]),
            Some(0)
        );
        assert!(again.exists());
    }
}
