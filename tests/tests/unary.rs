//! Functions of one number are as good as they say, on millions of their operands; on all of them by
//! `cargo run -p mica-stability --example unary -- full`.

use mica_stability::{Effort, Laboratory, unary};
use mica_tests::Gpu;

#[test]
fn helpers_of_one_number_keep_their_bounds() {
    let mut gpu = Gpu::new();
    let mut laboratory = Laboratory { executor: gpu.executor(), effort: Effort::Quick };
    let lines = unary(&mut laboratory, |_| ()).expect("they are tried");
    let names: std::collections::HashSet<&str> = lines.iter().map(|line| &*line.helper).collect();
    assert_eq!((lines.len(), names.len()), (9, 9));
    for line in &lines {
        println!("{} ({}): {:.2e} at {:e}, bound {:.1e}", line.helper, line.domain, line.worst, line.at, line.bound);
        assert!(line.holds() && line.inputs > 25_000_000, "{line:?}");
        // A bound far beyond what is found would let faults pass.
        assert!(line.worst > 0.1 * line.bound, "{line:?}");
    }
}
