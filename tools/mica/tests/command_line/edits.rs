//! Sittings of edits: the report says which passes each made anew, and frames without an edit make nothing.

use super::*;

/// The edits of a sitting, and the passes that each makes anew, in order.
const SITTING: &[(&str, &[&str])] = &[
    ("count=2e5", &["quadtree"]),
    ("seed=9", &["quadtree"]),
    ("depth=4", &["quadtree"]),
    ("gamma_deg=3.5", PREFILTERED),
    ("flakes:alpha=0.31", PREFILTERED),
    ("samples=2", &["prefilter_probability", "prefilter"]),
    ("color=0.5,0.25,1", &[]),
    ("uv_scale=2", &[]),
    ("alpha=0.31", &[]),
    ("camera=0,0.1,0.5:0,0,0:40", &[]),
    ("exposure=1", &[]),
    ("size=20x10", &[]),
    ("light=dir:0,-1,-1,3,3,3", &["upload lights"]),
    ("light=point:0,3,3,5,5,5", &["upload lights"]),
    ("light=none", &["upload lights"]),
    ("light=none", &[]),
    ("env-rotate=30", &[]),
    ("env=constant:1,2,3", &["upload environment", "prefilter_probability", "prefilter"]),
    ("env=none", &[]),
    ("env=constant:1,2,3", &["upload environment", "prefilter_probability", "prefilter"]),
    ("move=0:0,0.25,0", &["upload instances", "upload bvh_instances"]),
    ("method=smooth", &["environment_specular", "specular_albedo"]),
    (
        "method=wang2020",
        &[
            "dpf",
            "build bvh",
            "upload bvh_nodes",
            "upload bvh_triangles",
            "upload bvh_instances",
            "dpf_accumulate",
            "prefilter_probability",
            "prefilter",
            "quadtree",
        ],
    ),
];

const PREFILTERED: &[&str] = &["dpf_accumulate", "prefilter_probability", "prefilter"];

#[test]
fn each_edit_makes_anew_what_it_touches() {
    let typed: Vec<&str> = SITTING.iter().flat_map(|(edit, _)| ["--edit", edit]).collect();
    let report = report(&[&QUICK, &["--env", "studio", "--occlusion", "bvh", "--samples", "2"], &typed]);
    let edits: Vec<&str> = SITTING.iter().map(|(edit, _)| *edit).collect();
    assert_eq!(report["edits"], serde_json::json!(edits));
    let updates = report["updates"].as_array().expect("a list");
    for (frame, (edit, expected)) in (1..).zip(SITTING) {
        let of_frame: Vec<&Json> = updates.iter().filter(|update| update["frame"] == frame).collect();
        assert!(of_frame.iter().all(|update| update["edit"] == *edit), "{edit}: {of_frame:?}");
        let passes: Vec<&str> = of_frame.iter().filter_map(|update| update["pass"].as_str()).collect();
        assert_eq!(passes, *expected, "{edit}");
    }
    // Samples, and the frames that are measured.
    let later: Vec<&Json> =
        updates.iter().filter(|update| update["frame"].as_u64() > Some(edits.len() as u64)).collect();
    assert!(later.is_empty(), "frames without an edit: {later:?}");
    assert!(report["frames"]["warmup"].as_u64() > Some(edits.len() as u64 + 1));

    // The report is of the last state.
    assert_eq!((&report["lights"], &report["size"]), (&Json::from(0), &serde_json::json!([20, 10])));
    assert_eq!(report["environment"], serde_json::json!({ "name": "constant:1,2,3", "rotation_deg": 30.0 }));
    assert_eq!(report["camera"]["eye"], serde_json::json!([0.0, 0.1, 0.5]));
}

/// What an edit leads to is what the options lead to.
#[test]
fn a_picture_after_edits_is_the_picture_with_those_options() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = |name: &str, words: &[&str]| {
        let path = in_folder(folder.path(), name);
        succeeded(run(&[
            &["render", "--method", "smooth", "--frames", "0", "--quiet", "-o", &path],
            &SMALL[..1],
            words,
        ]
        .concat()));
        std::fs::read(path).expect("a file")
    };
    let options = [
        ("--light", "light=dir:0,-1,-1,3,3,3"),
        ("--env", "env=dusk"),
        ("--env-rotate", "env-rotate=40"),
        ("--camera", "camera=0,0.1,0.5:0,0,0:40"),
        ("--size", "size=24x18"),
    ];
    let edits: Vec<&str> = options.iter().flat_map(|(_, edit)| ["--edit", edit]).collect();
    let value = |edit: &'static str| edit.split_once('=').map_or("", |(_, value)| value);
    let words: Vec<&str> = options.iter().flat_map(|(option, edit)| [*option, value(edit)]).collect();
    let lit = ["--light", "point:0,9,0,1,1,1", "--edit", "light=none"];
    let edited = picture("edited.exr", &[&["--env", "studio", "--size", "16x9"], &lit[..], &edits[..]].concat());
    assert!(edited == picture("options.exr", &words));
    assert!(edited != picture("moved.exr", &[&words[..], &["--edit", "move=0:0.05,0,0"]].concat()));
}
