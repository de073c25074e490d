//! Questions about a list of flakes, as JSON.

use crate::args::{ALPHAS, GAMMAS_DEG, LARGEST_COORDINATE};
use crate::error::Failure;
use mica_oracle::discrete::{DiscreteMicrofacets, Query};
use mica_oracle::flake_set::Footprint;
use mica_oracle::{DVec2, DVec3};
use serde::Deserialize;
use serde_json::Value as Json;
use std::fs;
use std::path::Path;

/// Files beyond this are no list that a person or a script would ask.
const LARGEST_FILE: u64 = 1 << 30;

/// One question as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    alpha: f64,
    gamma_deg: f64,
    i: [f64; 3],
    o: [f64; 3],
    para: [f64; 6],
}

/// Reads the questions of a file.
pub fn read_queries(path: &Path) -> Result<Vec<Query>, Failure> {
    let wrong = |why: String| Failure::bad_input(format!("{}: {why}", path.display()));
    let found = fs::metadata(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    if !found.is_file() {
        return Err(wrong("is no file".to_owned()));
    }
    if found.len() > LARGEST_FILE {
        return Err(wrong(format!("is longer than {LARGEST_FILE} bytes; ask in several files")));
    }
    let text = fs::read(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    queries_of(&text).map_err(wrong)
}

fn queries_of(text: &[u8]) -> Result<Vec<Query>, String> {
    let json: Json = serde_json::from_slice(text).map_err(|error| format!("is no JSON: {error}"))?;
    let Json::Array(entries) = json else { return Err("holds no array of queries".to_owned()) };
    let query = |(index, entry)| query_of(entry).map_err(|why| format!("query {index}, counted from 0: {why}"));
    entries.into_iter().enumerate().map(query).collect()
}

fn query_of(entry: Json) -> Result<Query, String> {
    let Written { alpha, gamma_deg, i, o, para } = serde_json::from_value(entry).map_err(|error| error.to_string())?;
    for (what, value, range) in [("alpha", alpha, ALPHAS), ("gamma_deg", gamma_deg, GAMMAS_DEG)] {
        if !range.contains(&value) {
            return Err(format!("{what} is {value}; expected {} to {}", range.start(), range.end()));
        }
    }
    if let Some(far) = para.iter().find(|number| number.abs() > LARGEST_COORDINATE) {
        return Err(format!("para holds {far}; expected up to {LARGEST_COORDINATE:e}"));
    }
    Ok(Query {
        microfacets: DiscreteMicrofacets::new(alpha, gamma_deg.to_radians()).map_err(|error| error.to_string())?,
        footprint: footprint(para),
        i: unit(i),
        o: unit(o),
    })
}

/// A corner and two sides.
pub fn footprint([pu, pv, e1u, e1v, e2u, e2v]: [f64; 6]) -> Footprint {
    Footprint { corner: DVec2::new(pu, pv), sides: [DVec2::new(e1u, e1v), DVec2::new(e2u, e2v)] }
}

/// Of length 1, or 0 where there is no direction. Scaled first: squares could leave the range of an f64.
fn unit(direction: [f64; 3]) -> DVec3 {
    let direction = DVec3::from(direction);
    (direction / direction.abs().max_element()).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"alpha":0.2,"gamma_deg":3,"i":[0,0,2],"o":[0,3e200,4e200],"para":[0,0,1,0,0,1]}"#;

    #[test]
    fn directions_are_brought_to_length_one() {
        let queries = queries_of(format!("[{GOOD}]").as_bytes()).expect("a query");
        assert_eq!(queries[0].i, DVec3::Z);
        assert!((queries[0].o - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15);
        assert_eq!(unit([0.0; 3]), DVec3::ZERO);
        assert!(queries_of(b"[]").expect("no query").is_empty());
    }

    #[test]
    fn what_is_wrong_with_a_query_is_named_with_its_number() {
        for (from, to, words) in [
            ("alpha", "alhpa", "alhpa"),
            (r#""alpha":0.2,"#, "", "`alpha`"),
            ("0.2", "2", "0.001 to 1"),
            (r#""gamma_deg":3"#, r#""gamma_deg":0"#, "0.01 to 30"),
            ("[0,0,2]", "[0,0]", "3"),
            ("[0,0,2]", "[0,0,null]", "null"),
            ("[0,0,1,0,0,1]", "[0,0,1,0,0]", "6"),
            ("[0,0,1,0,0,1]", "[0,1e10,1,0,0,1]", "1e9"),
        ] {
            let text = format!("[{GOOD},{}]", GOOD.replacen(from, to, 1));
            let error = queries_of(text.as_bytes()).expect_err("must be refused");
            assert!(error.starts_with("query 1, counted from 0: ") && error.contains(words), "{from} {to}: {error}");
        }
        for text in ["", "{}", "[NaN]", "[1e999]", "nonsense", "[[]"] {
            assert!(queries_of(text.as_bytes()).is_err(), "{text}");
        }
    }
}
