//! Runs the targets on files: `replay FILE...`

fn main() {
    for name in std::env::args().skip(1) {
        let bytes = std::fs::read(&name).expect("the file can be read");
        let start = std::time::Instant::now();
        stereology_fuzz::mesh_file(&bytes);
        stereology_fuzz::sweep(&bytes);
        stereology_fuzz::table(&bytes);
        stereology_fuzz::photo(&bytes);
        stereology_fuzz::labels(&bytes);
        println!("{name}: {:?}", start.elapsed());
    }
}
