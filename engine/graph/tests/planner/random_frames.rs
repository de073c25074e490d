//! Random frames: their plans keep every rule and compute what was declared.

use crate::contents::{Order, as_declared, as_planned};
use crate::frames::Frame;
use crate::rules::{faults, unchained};
use mica_graph::Plan;

/// What a set of frames contained, so that the tests notice when the frames become too tame to show anything.
#[derive(Debug, Default)]
struct Census {
    passes: usize,
    culled: usize,
    barriers: usize,
    aliased: usize,
    shared_bytes: u64,
    unshared_bytes: u64,
    live_bytes: u64,
}

impl Census {
    fn add(&mut self, plan: &Plan) {
        self.passes += plan.passes.len();
        self.culled += plan.culled.len();
        self.barriers += plan.steps.len() - plan.passes.len();
        self.aliased += usize::from(plan.shared_bytes < plan.unshared_bytes);
        self.shared_bytes += plan.shared_bytes;
        self.unshared_bytes += plan.unshared_bytes;
        self.live_bytes += (0..=plan.passes.len()).map(|pass| live_bytes(plan, pass)).max().unwrap_or(0);
    }
}

fn live_bytes(plan: &Plan, pass: usize) -> u64 {
    let live = plan.resources.iter().filter(|usage| {
        let exported = plan.exports.contains(&usage.resource.id);
        usage.passes.0 <= pass && (pass <= usage.passes.1 || exported)
    });
    live.filter_map(|usage| usage.placement).map(|place| place.bytes).sum()
}

#[test]
fn twenty_thousand_random_frames_compute_what_they_declare() {
    let mut census = Census::default();
    let frames = 20_000;
    for seed in 0..frames {
        let frame = Frame::random(seed);
        let plan = frame.plan();
        let faults = [faults(&frame, &plan), unchained(&plan)].concat();
        assert!(faults.is_empty(), "frame {seed}: {faults:#?}\n{plan}");
        let declared = as_declared(&frame);
        for order in [Order::Latest, Order::Any(seed)] {
            let planned = as_planned(&frame, &plan, order);
            assert!(planned.as_ref() == Ok(&declared), "frame {seed}: {planned:#?}, declared {declared:#?}\n{plan}");
        }
        census.add(&plan);
    }
    let frames = frames as usize;
    assert!(census.passes > 5 * frames && census.culled > frames, "{census:?}");
    assert!(census.barriers > 3 * frames && census.aliased > frames / 2, "{census:?}");
    // No layout is smaller than what one pass needs at once; 10 % above it were measured, most of it alignment.
    assert!(census.shared_bytes < census.live_bytes * 23 / 20, "{census:?}");
    assert!(census.shared_bytes < census.unshared_bytes * 4 / 5, "{census:?}");
}
