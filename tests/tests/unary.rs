//! Functions of one number are as good as they say, on millions of their operands; on all of them by
//! `mica stability --full`.

use mica_stability::{Effort, Laboratory, Trial};
use mica_tests::Gpu;

#[test]
fn helpers_of_one_number_keep_their_bounds() {
    let mut gpu = Gpu::new();
    let mut laboratory = Laboratory { executor: gpu.executor(), effort: Effort::Quick };
    let tried = |mut trial: Trial| loop {
        if let Some(line) = trial.step(&mut laboratory).expect("it is tried") {
            assert_eq!(trial.progress(), [line.inputs; 2]);
            return line;
        }
    };
    let lines: Vec<_> = Trial::all(Effort::Quick).into_iter().map(tried).collect();
    let names: std::collections::HashSet<&str> = lines.iter().map(|line| &*line.helper).collect();
    assert_eq!((lines.len(), names.len()), (9, 9));
    for line in &lines {
        println!("{} ({}): {:.2e} at {:e}, bound {:.1e}", line.helper, line.domain, line.worst, line.at, line.bound);
        assert!(line.holds() && line.inputs > 50_000_000, "{line:?}");
        // A bound far beyond what is found would let faults pass.
        assert!(line.worst > 0.1 * line.bound, "{line:?}");
    }
}
