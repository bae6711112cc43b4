use ndarray::Array2;
use std::ops::ControlFlow;
use stereology_exemplar::*;
// raw files: "h w" + bytes
fn read(p: &str) -> Exemplar {
    let b = std::fs::read(p).unwrap();
    let h = u32::from_le_bytes(b[0..4].try_into().unwrap()) as usize;
    let w = u32::from_le_bytes(b[4..8].try_into().unwrap()) as usize;
    let a = Array2::from_shape_vec((h, w), b[8..].iter().map(|&v| v as f32 / 255.0).collect()).unwrap();
    if b[8..].iter().all(|v| *v==0 || *v==255) && std::env::var("GREY").is_err() { return Exemplar::phase_map(a.mapv(|v| (v*255.0) as u32).view()).unwrap(); }
    Exemplar::grey(a.view()).unwrap()
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[1].parse().unwrap();
    let views = if a[2] == "2" { Views::Two } else { Views::Three };
    let out = &a[3];
    let ex: Vec<Exemplar> = a[4..].iter().map(|p| read(p)).collect();
    let g = |k: &str, d: usize| std::env::var(k).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    let mut o = SolidOptions::default().with_views(views).with_iterations(g("IT", 10)).with_neighbourhood(g("NB", 7)).with_seed(g("SEED",0) as u64);
    if g("K",0)>0 {o=o.with_similar(g("K",3));}
    if g("LEV",0)>0 {o=o.with_levels(g("LEV",3));}
    if g("EXACT", 0) > 0 { o = o.with_search(Search::Exact); }
    o = match g("METH", 0) { 1 => o.with_method(Method::WeiLevoy), 2 => o.with_method(Method::Kopf), 3 => o.with_method(Method::ChenWang), _ => o };
    if g("BATCH",0)>0 { o = o.with_solver(Solver::Batch); }
    o = match g("SCAN",0) {1=>o.with_scan(Scan::Lexicographic),2=>o.with_scan(Scan::Random),3=>o.with_scan(Scan::Morton),_=>o};
    if g("TSVQ",0)>0 {o=o.with_search(Search::Tsvq);}
    let t = std::time::Instant::now();
    let s = synthesize_solid(&ex, &Domain::new([n; 3]).unwrap(), &o, &|_| ControlFlow::Continue(())).unwrap();
    let el = t.elapsed();
    for l in &s.levels { eprintln!("{:?} {:.3?}", l.size, l.energies); }
    eprintln!("time {:?} us/vi {:.3} coverage {:.3} perplexity {:.3}", el, el.as_secs_f64()*1e6/s.voxel_iterations as f64, s.coverage, s.perplexity);
    let bytes: Vec<u8> = s.values.iter().map(|v| if ex[0].phases().is_some() {*v as u8} else {(v * 255.0).round() as u8}).collect();
    std::fs::write(out, bytes).unwrap();
}
