//! scratch
#![allow(
    missing_docs,
    clippy::all,
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::pedantic
)]
use std::{ops::ControlFlow, time::Instant};
use stereology_segment::*;
fn ticks() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect();
    f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()
}
fn peak() -> String {
    let s = std::fs::read_to_string("/proc/self/status").unwrap();
    s.lines().find(|l| l.starts_with("VmHWM")).unwrap().to_string()
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    // time N photo... | labels OUT photo...
    let o = SegmentOptions::default().with_min_area(20);
    if a[1] == "time" {
        let n: usize = a[2].parse().unwrap();
        for f in &a[3..] {
            let photo = read_photo(f).unwrap();
            let mpx = f64::from(photo.width() * photo.height()) / 1e6;
            let mut best = f64::INFINITY;
            let mut w = 0.0;
            for _ in 0..n {
                let t = ticks();
                let i = Instant::now();
                let r = segment(&photo, &o, &|_| ControlFlow::Continue(()));
                drop(r);
                let c = (ticks() - t) / 100.0;
                if c < best {
                    best = c;
                    w = i.elapsed().as_secs_f64();
                }
            }
            println!(
                "{:<50} {mpx:.2} Mpx cpu {best:.2} s, per 2 Mpx {:.2} wall {w:.2} {}",
                f.rsplit('/').next().unwrap(),
                best / mpx * 2.0,
                peak()
            );
        }
    } else if a[1] == "steps" {
        for f in &a[2..] {
            println!("{f}");
            let photo = read_photo(f).unwrap();
            macro_rules! t {
                ($n:expr, $e:expr) => {{
                    let mut b = f64::INFINITY;
                    let mut r = None;
                    for _ in 0..3 {
                        let t = ticks();
                        r = Some($e);
                        b = b.min((ticks() - t) / 100.0);
                    }
                    println!("  {:<20} {b:.2}", $n);
                    r.unwrap()
                }};
            }
            let e = t!("encoded", encoded_image(&photo));
            let c = t!("smooth", smooth(&e, 1.0));
            let b = t!("fit", BinderModel::fit(&c, 0));
            let dev = t!("deviation", b.deviation(&c));
            let dist = t!("distance", b.distance(&c));
            let mask = t!("hysteresis", hysteresis(&dist, 5.0, 9.0));
            let _ = t!("distance_transform", distance_transform(&mask));
            let _ = t!("connected_pieces", connected_pieces(&mask, |m| m));
            let mut m2 = t!("fill_holes", {
                let mut m = mask.clone();
                fill_holes(&mut m, |a, b| a < b / 20);
                m
            });
            t!("open", open(&mut m2));
            let m3 = t!("half_contrast", half_contrast(&dev, &m2, 1.28));
            let _ = t!("faint", faint_regions(&c, &b, &m3, [3.5, 6.3]));
            let l = t!("lab", lab_image(&c));
            let parts = t!("split_by_colour", split_by_colour(&l, &m3, 0));
            let labels = t!("split_by_shape", split_by_shape(&parts, [0.7, 0.1]));
            let dt = distance_transform(&m3);
            let d = t!("smooth_field", smooth_field(&dt.mapv(|d| d.min(1e4)), 1.0));
            let mk = t!("h_maxima", h_maxima(&d, |_, r| (0.1 * r).max(0.7)));
            let _ = t!("watershed", watershed(&d, &mk, &m3));
            let mut s = t!(
                "from_labels",
                Segmentation::from_labels(&photo, labels.clone(), &o).unwrap()
            );
            println!("  profiles {}", s.profiles.len());
            let _ = t!("categorise", categorise(&mut s.profiles, CategoryCount::Silhouette, 0));
            let _ = t!("size_by_category", size_by_category(&s.profiles, 0));
            let _ = t!("means", s.means());
            let _ = t!("overlay", s.overlay());
            let _ = t!("residual", s.residual());
        }
    } else {
        for f in &a[3..] {
            let stem = f.rsplit('/').next().unwrap().split('.').next().unwrap();
            let photo = read_photo(f).unwrap();
            match segment(&photo, &o, &|_| ControlFlow::Continue(())) {
                Ok(s) => {
                    write_labels(format!("{}/{stem}.tif", a[2]), s.labels.view()).unwrap();
                    s.overlay().save(format!("{}/{stem}_overlay.png", a[2])).unwrap();
                    let c: Vec<_> = s.findings.iter().map(|f| f.code).collect();
                    println!(
                        "{stem} {} profiles {:.4} {}",
                        s.profiles.len(),
                        s.area_fraction,
                        c.join(",")
                    );
                    for f in &s.findings {
                        println!("      {}: {}", f.code, f.message);
                    }
                }
                Err(e) => {
                    let _ = std::fs::remove_file(format!("{}/{stem}.tif", a[2]));
                    println!("{stem} REFUSED {e}")
                }
            }
        }
    }
}
