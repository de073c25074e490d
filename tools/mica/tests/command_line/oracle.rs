//! `mica oracle`: its answers against a brute force of the test's own, and what it refuses.

use super::*;
use std::f64::consts::PI;
use std::fs;
use std::process::Command;

/// A NumPy file, version 1, of rows (u, v, mx, my, mz).
fn npy(rows: &[[f64; 5]]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 5), }}\n", rows.len());
    let numbers = rows.iter().flatten().flat_map(|number| number.to_le_bytes());
    let start = [&b"\x93NUMPY\x01\x00"[..], &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
    start.into_iter().chain(numbers).collect()
}

/// Numbers in [0, 1) without pattern.
fn uniforms() -> impl FnMut() -> f64 {
    let mut state = 0x1234_5678_9abc_def1_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    a.map(|x| x / dot(a, a).sqrt())
}

/// Smith's masking of Beckmann over the cosine (Walter et al. 2007, Eqs. 23 to 26), erf by its series.
fn masking_over_cosine(v: [f64; 3], alpha: f64) -> f64 {
    let a = v[2] / (alpha * v[0].hypot(v[1])).max(1e-9);
    // All terms are positive: no digits are lost.
    let (mut term, mut sum) = (a, a);
    for n in 1..200 {
        term *= 2.0 * a * a / f64::from(2 * n + 1);
        sum += term;
    }
    let erf = if a > 6.0 { 1.0 } else { 2.0 / PI.sqrt() * (-a * a).exp() * sum };
    2.0 / (1.0 + erf + (-a * a).exp() / (a * PI.sqrt())) / v[2]
}

/// One question, and the flakes that it finds one by one: in the footprint, lit, and their BRDF.
struct Question {
    alpha: f64,
    gamma_deg: f64,
    i: [f64; 3],
    o: [f64; 3],
    para: [f64; 6],
}

impl Question {
    fn json(&self) -> Json {
        let Self { alpha, gamma_deg, i, o, para } = self;
        serde_json::json!({ "alpha": alpha, "gamma_deg": gamma_deg, "i": i, "o": o, "para": para })
    }

    fn answer(&self, rows: &[[f64; 5]]) -> (u64, u64, f64) {
        let (i, o) = (unit(self.i), unit(self.o));
        let [pu, pv, e1u, e1v, e2u, e2v] = self.para;
        let determinant = e1u * e2v - e1v * e2u;
        let gamma = self.gamma_deg.to_radians();
        let (mut in_area, mut count, mut weights) = (0, 0, 0.0);
        for (shift_u, shift_v) in (-9..=9).flat_map(|u| (-9..=9).map(move |v| (f64::from(u), f64::from(v)))) {
            for &[u, v, mx, my, mz] in rows {
                let (x, y) = (u + shift_u - pu, v + shift_v - pv);
                let (a, b) = ((x * e2v - y * e2u) / determinant, (e1u * y - e1v * x) / determinant);
                if (0.0..1.0).contains(&a) && (0.0..1.0).contains(&b) {
                    let m = unit([mx, my, mz]);
                    let lit = dot(i, m) > 0.0 && 2.0 * dot(i, m) * dot(o, m) - dot(i, o) >= gamma.cos();
                    in_area += 1;
                    count += u64::from(lit);
                    weights += if lit { 1.0 / m[2] } else { 0.0 };
                }
            }
        }
        let h = unit([i[0] + o[0], i[1] + o[1], i[2] + o[2]]);
        let solid_angle = 4.0 * PI * (gamma / 2.0).sin().powi(2);
        let factors = dot(i, h) * masking_over_cosine(i, self.alpha) * masking_over_cosine(o, self.alpha);
        (in_area, count, factors * weights / (rows.len() as f64 * determinant.abs() * solid_angle))
    }
}

/// Asks the program about these flakes.
fn ask(rows: &[[f64; 5]], questions: &Json) -> Vec<Json> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (flakes, queries) = (in_folder(folder.path(), "f.npy"), in_folder(folder.path(), "q.json"));
    fs::write(&flakes, npy(rows)).expect("a file");
    fs::write(&queries, questions.to_string()).expect("a file");
    let answers = json(&succeeded(run(&["oracle", "--flakes", &flakes, "--queries", &queries])));
    answers.as_array().expect("an array").clone()
}

#[test]
fn answers_about_a_list_are_those_of_brute_force() {
    let mut uniform = uniforms();
    let mut between = |low: f64, high: f64| low + (high - low) * uniform();
    // Off any lattice, and on one whose flakes lie on the edges of footprints.
    let rows: Vec<[f64; 5]> = (0..600)
        .map(|k| {
            let length = between(0.1, 10.0);
            let normal = [between(-0.4, 0.4) * length, between(-0.4, 0.4) * length, length];
            let place = if k < 400 {
                [between(-1.0, 2.0), between(0.0, 1.0)]
            } else {
                [f64::from(k % 16) / 16.0, f64::from(k / 16 % 16) / 16.0]
            };
            [place[0], place[1], normal[0], normal[1], normal[2]]
        })
        .collect();
    let questions: Vec<Question> = (0..60)
        .map(|k| {
            let o = unit([between(-1.0, 1.0), between(-1.0, 1.0), between(0.2, 1.0)]);
            let m = unit([between(-0.3, 0.3), between(-0.3, 0.3), 1.0]);
            let length = between(0.5, 2.0);
            let o_m = dot(o, m);
            let mut i = [0, 1, 2].map(|axis| length * (2.0 * o_m * m[axis] - o[axis]));
            i[2] = i[2].max(0.05);
            let mut para = [0; 6].map(|_| between(-2.0, 2.0));
            if k % 2 == 0 {
                para = para.map(|number| (number * 8.0).round() / 8.0);
            }
            if k % 4 == 0 {
                (para[3], para[4]) = (0.0, 0.0);
            }
            Question { alpha: between(0.05, 1.0), gamma_deg: between(1.0, 25.0), i, o, para }
        })
        .filter(|question| question.para[2] * question.para[5] != question.para[3] * question.para[4])
        .collect();
    let answers = ask(&rows, &questions.iter().map(Question::json).collect::<Vec<Json>>().into());
    assert_eq!(answers.len(), questions.len());
    let mut lit = 0;
    for (answer, question) in answers.iter().zip(&questions) {
        let (in_area, count, f) = question.answer(&rows);
        assert_eq!((answer["in_area"].as_u64(), answer["count"].as_u64()), (Some(in_area), Some(count)), "{answer}");
        let given = answer["f"].as_f64().expect("a number");
        assert!((given - f).abs() <= 1e-9 * f, "{given} {f}");
        lit += count;
    }
    assert!(lit > 1000, "{lit}");
}

/// A footprint's corner belongs to it, and the next number above the flake's place is past it: queries are read to their
/// last bit.
#[test]
fn a_corner_on_a_flake_is_decided_by_the_last_bit() {
    let mut uniform = uniforms();
    let rows: Vec<[f64; 5]> = (0..200).map(|_| [uniform(), 0.5, 0.0, 0.0, 1.0]).collect();
    for row in &rows {
        let question = |corner: f64| Question {
            alpha: 0.3,
            gamma_deg: 6.0,
            i: [0.0, 0.0, 1.0],
            o: [0.0, 0.0, 1.0],
            para: [corner, 0.5, 1e-9, 0.0, 0.0, 1e-3],
        };
        let questions = vec![question(row[0]).json(), question(row[0].next_up()).json()];
        let counts: Vec<Option<u64>> =
            ask(&[*row], &questions.into()).iter().map(|answer| answer["in_area"].as_u64()).collect();
        assert_eq!(counts, [Some(1), Some(0)], "{row:?}");
    }
}

#[test]
fn what_shows_no_light_is_counted_all_the_same() {
    let rows = [[0.5, 0.5, 0.0, 0.0, 2.0], [0.0, 0.25, -0.1, 0.0, 1.0]];
    let ask_one = |i: [f64; 3], para: [f64; 6]| {
        let question = Question { alpha: 0.5, gamma_deg: 30.0, i, o: [0.9, 0.0, 0.1], para };
        let answer = ask(&rows, &vec![question.json()].into()).remove(0);
        (answer["in_area"].as_u64(), answer["count"].as_u64(), answer["f"].as_f64())
    };
    let square = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    assert!(ask_one([-0.9, 0.0, 0.1], square).2 > Some(0.0));
    assert_eq!(ask_one([-0.9, 0.0, -0.01], square), (Some(2), Some(1), Some(0.0)));
    assert_eq!(ask_one([0.0; 3], square), (Some(2), Some(0), Some(0.0)));
    assert_eq!(ask_one([-0.9, 0.0, 0.1], [0.0, 0.0, 1.0, 1.0, 2.0, 2.0]), (Some(0), Some(0), Some(0.0)));
    assert_eq!(ask(&[], &serde_json::json!([])), Vec::<Json>::new());
}

/// The mean over seeds is the smooth BRDF over the cone within 1.2 % and three standard errors, and flakes are as many and
/// lit as often as they must be. Measured: ratios .993 to .999, of standard errors .0006 to .008.
#[test]
fn the_mean_over_seeds_is_the_smooth_brdf_over_the_cone() {
    for (alpha, gamma_deg, light, view) in [
        ("0.1", "1", "0,0", "0,0"),
        ("0.1", "6", "80,180", "80,0"),
        ("0.3", "6", "60,90", "50,-60"),
        ("0.5", "6", "40,180", "20,0"),
        ("0.3", "2", "80,0", "70,170"),
    ] {
        let words = ["oracle", "--json", "--alpha", alpha, "--gamma-deg", gamma_deg, "--light", light, "--view", view];
        let amounts = ["--count", "1e5", "--seeds", "40", "--footprint", "-3.1,0.4,0.9,0.1,-0.2,0.8"];
        let report = json(&succeeded(run(&[&words[..], &amounts].concat())));
        let number = |path: &str| report.pointer(path).and_then(Json::as_f64).expect("a number");
        let (ratio, error) = (number("/ratio"), number("/ratio_standard_error"));
        assert!((ratio - 1.0).abs() < 3.0 * error && (ratio - 1.0).abs() < 0.012, "{report:#}");
        assert!((number("/mean") / number("/smooth_cone") - ratio).abs() < 1e-12);
        assert!((number("/centre/mean") - number("/centre/expected")).abs() < 3.0 * number("/centre/standard_error"));
        assert!((number("/count/mean") - number("/count/expected")).abs() < 3.0 * number("/count/standard_error"));
        assert!((number("/count/expected") - 1e5 * number("/area") * number("/P")).abs() < 1e-6);
        assert!((number("/variance") / 40.0).sqrt() - number("/standard_error") < 1e-9);
    }
    let text = succeeded(run(&["oracle", "--seeds", "20"]));
    for word in ["mean", "variance", "standard error", "lit flakes", "P, ", "averaged over the cone"] {
        assert!(text.contains(word), "{word} in {text}");
    }
}

#[test]
fn nothing_and_next_to_nothing_have_answers() {
    let report = json(&succeeded(run(&["oracle", "--json", "--count", "0", "--seeds", "3"])));
    assert_eq!((&report["mean"], &report["variance"], &report["ratio"]), (&0.0.into(), &0.0.into(), &0.0.into()));
    let report = json(&succeeded(run(&["oracle", "--json", "--seeds", "1"])));
    assert_eq!((&report["variance"], &report["standard_error"]), (&Json::Null, &Json::Null));
    let report = json(&succeeded(run(&["oracle", "--json", "--light", "100,0", "--seeds", "2"])));
    assert_eq!((&report["mean"], &report["ratio"]), (&0.0.into(), &Json::Null));
    let tiny = ["--count", "1e12", "--footprint", "1e6,-1e6,1e-6,0,0,1e-6"];
    let report = json(&succeeded(run(&[&["oracle", "--json", "--seeds", "400"], &tiny[..]].concat())));
    let expected = report["in_area"]["expected"].as_f64().expect("a number");
    assert!((expected - 1.0).abs() < 1e-6);
    assert!(report["in_area"]["mean"].as_f64().is_some_and(|mean| (mean - 1.0).abs() < 0.2), "{report:#}");
}

/// The oracle is wrong in one way; the error must mention each of the words.
#[track_caller]
fn wrong(arguments: &[&str], words: &[&str]) {
    let error = failed_in_one_line(&run(&[&["oracle"], arguments].concat()), 2);
    for word in words {
        assert!(error.contains(word), "{word} in {error}");
    }
}

#[test]
fn numbers_out_of_range_are_told_with_the_range() {
    for alpha in ["0", "2", "NaN", "-1", "x"] {
        wrong(&["--alpha", alpha], &["--alpha", "0.001 to 1"]);
    }
    wrong(&["--gamma-deg", "90"], &["--gamma-deg", "0.01 to 30"]);
    wrong(&["--count", "1e13"], &["--count", "0 to 1e12"]);
    wrong(&["--footprint", "0,0,1,0,0"], &["--footprint", "six numbers"]);
    wrong(&["--footprint", "0,0,1,0,2,0"], &["--footprint", "no area"]);
    wrong(&["--footprint", "0,0,1e10,0,0,1"], &["--footprint", "1e9"]);
    wrong(&["--light", "30"], &["--light", "THETA,PHI"]);
    wrong(&["--view", "300,0"], &["--view", "-180 to 180"]);
    wrong(&["--seeds", "0"], &["--seeds"]);
    wrong(&["--count", "1e12", "--footprint", "0,0,1,0,0,1"], &["flakes would be visited", "--footprint"]);
    wrong(&["--footprint", "0,0,1e6,0,0,1e6", "--count", "5"], &["would be visited"]);
}

#[test]
fn lists_and_queries_that_cannot_be_read_are_told_by_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = in_folder(folder.path(), name);
        fs::write(&path, bytes).expect("a file");
        path
    };
    let good = npy(&[[0.5, 0.5, 0.0, 0.0, 1.0]]);
    let flakes = write("good.npy", &good);
    let query = r#"{"alpha":0.3,"gamma_deg":3,"i":[0,0,1],"o":[0,0,1],"para":[0,0,1,0,0,1]}"#;
    let queries = write("good.json", format!("[{query}]").as_bytes());
    let both = |flakes: &str, queries: &str, words: &[&str]| {
        wrong(&["--flakes", flakes, "--queries", queries], words);
    };
    wrong(&["--flakes", &flakes], &["--queries"]);
    wrong(&["--queries", &queries], &["--flakes"]);
    wrong(&["--flakes", &flakes, "--queries", &queries, "--alpha", "0.3"], &["--alpha"]);
    both("missing.npy", &queries, &["missing.npy"]);
    both(folder.path().to_str().expect("a plain name"), &queries, &["is no file"]);
    // Nobody writes into these.
    let pipe = in_folder(folder.path(), "pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()));
    both(&pipe, &queries, &["pipe", "is no file"]);
    both(&flakes, &pipe, &["pipe", "is no file"]);
    both(&write("text.npy", b"u,v,mx,my,mz"), &queries, &["text.npy", "no NumPy"]);
    both(&write("cut.npy", &good[..good.len() - 1]), &queries, &["cut.npy", "too short"]);
    both(&write("nan.npy", &npy(&[[0.5, f64::NAN, 0.0, 0.0, 1.0]])), &queries, &["nan.npy", "flake 0", "finite"]);
    both(&write("down.npy", &npy(&[[0.5, 0.5, 0.0, 0.0, -1.0]])), &queries, &["flake 0", "mz > 0"]);
    let single = String::from_utf8_lossy(&good[10..]).replace("<f8", "<f4");
    both(&write("single.npy", &[&good[..10], single.as_bytes()].concat()), &queries, &["single.npy", "'<f4'"]);
    both(&flakes, "missing.json", &["missing.json"]);
    for (text, words) in [
        ("{}", "array"),
        ("[{]", "line 1"),
        (&format!("[{query},{}]", query.replace("alpha", "alhpa")) as &str, "query 1"),
        (&format!("[{}]", query.replace("0.3", "7")), "0.001 to 1"),
        (&format!("[{}]", query.replace(r#","o":[0,0,1]"#, "")), "`o`"),
        (&format!("[{}]", query.replace("1]}", "1e9]}").replace("[0,0,1,0,", "[0,0,1e9,0,")), "would be visited"),
    ] {
        both(&flakes, &write("bad.json", text.as_bytes()), &[words]);
    }
}
