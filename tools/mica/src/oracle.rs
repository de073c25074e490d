//! `mica oracle`: the glint model in f64, flake by flake, beside what it must be on average.

mod npy;
mod queries;

use crate::args::{Angles, OracleArgs, Parallelogram};
use crate::error::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Column, table};
use mica_oracle::DVec3;
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::discrete::{Answer, DiscreteMicrofacets, Flakes, Query, answer_all, moments};
use mica_oracle::flake_list::FlakeList;
use mica_oracle::flake_set::{Footprint, leaf_level};
use serde_json::{Value as Json, json};
use std::path::Path;

/// What the numbers mean, for the end of the help.
pub const DEFINITIONS: &str = "\
Directions are about the normal +Z; texture repeats in every square of texture space; a footprint is the parallelogram
corner + a side + b side with 0 <= a, b < 1, and counts a flake in every repetition that it holds. A flake of normal m is lit
when i.m > 0 and its reflection of i lies within gamma of o. With N flakes in a square, a the footprint's area, F = 1, h the
half vector, sigma = 4 pi sin^2(gamma/2) and each flake's weight w = 1/(m.n), m brought to length 1,

    f = (i.h) G(i,o) / (a sigma (i.n)(o.n)) * (1/N) * sum of w over the lit flakes in the footprint.

G is Smith's of Beckmann, G1(i) G1(o), exact (with erf; the rational fit in use elsewhere is up to 0.31 % off).

`centre` is this f, and so is the f of --queries. `mean`, `variance` and `ratio` are of f with (i.m) G(i,r) / (r.n) of each
flake's own reflection r inside the sum, in place of those at the cone's centre: the spatial and directional average that
discrete flakes stand for, without approximation. Its mean is the smooth BRDF averaged over the cone; that of f at the centre
is not for wide cones at grazing angles (6 % off for alpha .1, gamma 6, both at 80 degrees), but what is printed as `expected`.

--queries: directions are brought to length 1; where one is zero or below the horizon, f is 0 and flakes are counted all the
same. A parallelogram without area holds nothing. Normals of --flakes may have any length, and must have mz > 0.";

/// Most flakes to be visited in one run: minutes.
const MOST_WORK: f64 = 1e10;

/// Answers for flakes from a file, or for sets of flakes that are drawn.
pub fn oracle(args: &OracleArgs) -> Result<(), Failure> {
    match (&args.flakes, &args.queries) {
        (Some(flakes), Some(queries)) => of_file(flakes, queries),
        _ => of_seeds(args),
    }
}

/// Prints the answers to queries about the flakes of a file.
fn of_file(flakes: &Path, queries: &Path) -> Result<(), Failure> {
    let rows = npy::read_rows(flakes)?;
    let list = FlakeList::new(&rows).map_err(|error| Failure::bad_input(format!("{}: {error}", flakes.display())))?;
    drop(rows);
    let asked = queries::read_queries(queries)?;
    let work: f64 = asked.iter().map(|query| work_in_list(&query.footprint, list.count() as f64)).sum();
    if work > MOST_WORK {
        return Err(too_much(work, "ask less of smaller footprints"));
    }
    let answers = Progress::new(false).during("answering queries", || answer_all(&list, &asked));
    let entry = |answer: &Answer| {
        let Answer { in_footprint, lit, brdf, .. } = answer;
        json!({ "in_area": in_footprint, "count": lit, "f": brdf })
    };
    output::print_json(&answers.iter().map(entry).collect::<Vec<Json>>())
}

/// Prints moments over seeds, and what they must be.
fn of_seeds(args: &OracleArgs) -> Result<(), Failure> {
    let Parallelogram(numbers) = args.footprint;
    let footprint = queries::footprint(numbers);
    if footprint.area() == 0.0 {
        return Err(Failure::bad_input("--footprint has no area; expected two sides that are not parallel"));
    }
    let count = args.count.round() as u64;
    let work = f64::from(args.seeds) * work_in_set(&footprint, count);
    if work > MOST_WORK {
        return Err(too_much(work, "use fewer --seeds, a smaller --footprint or a smaller --count"));
    }
    let bad = |error: mica_oracle::OracleError| Failure::bad_input(error.to_string());
    let (i, o) = (direction(args.light), direction(args.view));
    let microfacets = DiscreteMicrofacets::new(args.alpha, args.gamma_deg.to_radians()).map_err(bad)?;
    let query = Query { microfacets, footprint, i, o };
    let means = ConeMeans::new(microfacets.facets(), i, o, microfacets.gamma_radians());
    let answers =
        Progress::new(false).during("drawing flakes", || query.answers_by_seed(count, args.seeds)).map_err(bad)?;
    let report = report(args, &query, count, &means, &answers);
    if args.json { output::print_json(&report) } else { output::print(&text(&report)) }
}

/// Towards the light or the viewer.
fn direction(Angles(degrees): Angles) -> DVec3 {
    let [(sin, cos), (sin_phi, cos_phi)] = degrees.map(|degrees| degrees.to_radians().sin_cos());
    DVec3::new(sin * cos_phi, sin * sin_phi, cos)
}

/// About how many flakes and nodes of the tree one set of flakes is visited for.
fn work_in_set(footprint: &Footprint, count: u64) -> f64 {
    let leaves_a_side = f64::from(1 << leaf_level(count));
    squares(footprint) + count as f64 * partial(footprint) + 16.0 * leaves_a_side * perimeter(footprint)
}

/// About how many flakes of a list are tested for one footprint.
fn work_in_list(footprint: &Footprint, count: f64) -> f64 {
    squares(footprint) + count * partial(footprint) + 4.0 * count.sqrt() * perimeter(footprint)
}

/// Squares of texture that the footprint's bounds touch.
fn squares(footprint: &Footprint) -> f64 {
    let [low, high] = footprint.bounds();
    (high.x - low.x + 3.0) * (high.y - low.y + 3.0)
}

/// Area of the footprint that is not whole squares of texture, and one such square.
fn partial(footprint: &Footprint) -> f64 {
    footprint.area().min(1.0 + 2.0 * perimeter(footprint))
}

fn perimeter(footprint: &Footprint) -> f64 {
    footprint.sides.iter().map(|side| 2.0 * side.length()).sum()
}

fn too_much(work: f64, advice: &str) -> Failure {
    Failure::bad_input(format!("about {work:.0e} flakes would be visited, and {MOST_WORK:.0e} is the most; {advice}"))
}

/// Everything that is known, as JSON.
fn report(args: &OracleArgs, query: &Query, count: u64, means: &ConeMeans, answers: &[Answer]) -> Json {
    let Query { microfacets, footprint, i, o } = query;
    let area = footprint.area();
    let of = |value: &dyn Fn(&Answer) -> f64| {
        let moments = moments(answers, value).ok();
        let mean = answers.iter().map(value).sum::<f64>() / answers.len() as f64;
        (mean, moments.map(|moments| moments.variance), moments.map(|moments| moments.standard_error()))
    };
    let (mean, variance, error) = of(&|answer| answer.brdf_averaged_over_cone);
    let (centre_mean, centre_variance, centre_error) = of(&|answer| answer.brdf);
    let (count_mean, count_variance, count_error) = of(&|answer| answer.lit as f64);
    let (in_area_mean, in_area_variance, _) = of(&|answer| answer.in_footprint as f64);
    let ratio = |value: Option<f64>, to: f64| value.filter(|_| to > 0.0).map(|value| value / to);
    json!({
        "schema": "mica-oracle-1",
        "settings": {
            "alpha": args.alpha,
            "gamma_deg": args.gamma_deg,
            "count": count,
            "footprint": args.footprint.0,
            "light": args.light.0,
            "view": args.view.0,
            "seeds": args.seeds,
        },
        "area": area,
        "mean": mean,
        "variance": variance,
        "standard_error": error,
        "ratio": ratio(Some(mean), means.smooth),
        "ratio_standard_error": ratio(error, means.smooth),
        "smooth_centre": microfacets.facets().brdf(*i, *o),
        "smooth_cone": means.smooth,
        "centre": {
            "mean": centre_mean,
            "variance": centre_variance,
            "standard_error": centre_error,
            "expected": means.discrete,
            "ratio": ratio(Some(centre_mean), means.smooth),
        },
        "P": means.lit_probability,
        "count": {
            "mean": count_mean,
            "variance": count_variance,
            "standard_error": count_error,
            "expected": count as f64 * area * means.lit_probability,
        },
        "in_area": {
            "mean": in_area_mean,
            "variance": in_area_variance,
            "expected": count as f64 * area,
        },
    })
}

/// The same for people.
fn text(report: &Json) -> String {
    let shown = |value: &Json| value.as_f64().map_or_else(|| "-".to_owned(), six_digits);
    let row = |name: &str, of: &Json, expected: &Json, ratio: &Json| {
        let ratio = ratio.as_f64().map_or_else(String::new, |ratio| format!("{ratio:.5}"));
        let [mean, variance, error] = ["mean", "variance", "standard_error"].map(|key| shown(&of[key]));
        vec![name.to_owned(), mean, variance, error, shown(expected), ratio]
    };
    let columns =
        [Column::Left("over seeds"), Column::Right("mean"), Column::Right("variance"), Column::Right("standard error")];
    let columns = [&columns[..], &[Column::Right("expected"), Column::Right("mean / smooth over cone")]].concat();
    let rows = [
        row("f (1/sr)", report, &report["smooth_cone"], &report["ratio"]),
        row(
            "f, factors at the cone's centre",
            &report["centre"],
            &report["centre"]["expected"],
            &report["centre"]["ratio"],
        ),
        row("lit flakes", &report["count"], &report["count"]["expected"], &Json::Null),
        row("flakes in the footprint", &report["in_area"], &report["in_area"]["expected"], &Json::Null),
    ];
    let averages = [
        vec!["P, that a flake is lit".to_owned(), shown(&report["P"])],
        vec!["smooth BRDF at the cone's centre (1/sr)".to_owned(), shown(&report["smooth_centre"])],
        vec!["smooth BRDF averaged over the cone (1/sr)".to_owned(), shown(&report["smooth_cone"])],
    ];
    table(&columns, &rows) + "\n" + &table(&[Column::Left("by quadrature"), Column::Right("value")], &averages)
}

/// Six significant digits.
fn six_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size @ 1e-4..1e7 => format!("{value:.*}", (5 - size.log10().floor() as i32).max(0) as usize),
        _ => format!("{value:.5e}"),
    }
}
