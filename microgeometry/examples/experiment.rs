use stereology_microgeometry::*;
fn cpu()->f64{let s=std::fs::read_to_string("/proc/self/stat").unwrap();let f:Vec<&str>=s.rsplit(')').next().unwrap().split_whitespace().collect();(f[11].parse::<f64>().unwrap()+f[12].parse::<f64>().unwrap())/100.0}
fn main(){
    let a:Vec<String>=std::env::args().collect();
    let text=std::fs::read_to_string(&a[1]).unwrap();
    let of=ContactDistribution::from_json(&text).unwrap();
    let units:f64=a[3].parse().unwrap();
    let mut mesh= if let Ok(n)=a[2].parse::<u32>(){ stereology_shape::TriangleMesh::icosphere(1.0,n)} else {stereology_shape::read_mesh(&a[2]).unwrap()};
    mesh.weld();
    let mesh=to_distribution_units(&mesh,units).unwrap();
    for m in [Method::Tight,Method::Paper]{ for seed in 0..2{
    let t=cpu(); let r=reconstruct(&mesh,&of,&ReconstructOptions::default().with_method(m).with_seed(seed),&|_|std::ops::ControlFlow::Continue(())).unwrap();
    println!("{m:?} n {} {:.2}s left {:.4} misplaced {:.4} viol {} emd {:.4} measured {:?} shortfalls {}",r.labels.len(),cpu()-t,r.left_over,r.misplaced,r.violations,r.emd_labels,r.emd_measured,r.shortfalls.len());
    }}
}
