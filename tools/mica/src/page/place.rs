//! A place of a study: its charts, what is known of each point, and the table of all.

use super::album::Album;
use super::figures::{FIGURES, further, scaled, tab, with_interval};
use super::html::Html;
use super::read::{Study, is_same_device};
use super::{Plot, unused};
use crate::charts::{Labelled, Mark, Scatter, Series, Use, escaped, look_of, svg, swatch, three_digits};
use crate::table::bytes;
use mica_accuracy::{BandErrors, Metric, Place, Point, ReferenceLine};
use mica_render::METHODS;
use serde_json::{Value as Json, json};

/// Points that can be compared with each other: of one place, measured on one device with one effort.
pub struct Section<'a> {
    /// Its name in links.
    pub slug: String,
    /// The newest of its points, which says where and how all were measured.
    pub newest: &'a Point,
    pub points: Vec<Entry<'a>>,
    pub reference: Option<&'a ReferenceLine>,
    /// What each metric shows.
    scatters: Vec<(Metric, Scatter)>,
}

/// A point with its name in links.
pub struct Entry<'a> {
    pub slug: String,
    pub point: &'a Point,
    /// By which metrics it is on the front.
    pub fronts: Vec<Metric>,
}

impl<'a> Section<'a> {
    /// The places of a study, in the order in which they were begun.
    pub fn of(study: &'a Study) -> Vec<Self> {
        let mut groups: Vec<Vec<&Point>> = Vec::new();
        for point in &study.points {
            let is_here = |group: &&mut Vec<&Point>| {
                group.first().is_some_and(|first| {
                    first.place == point.place
                        && is_same_device(&first.machine, &point.machine)
                        && first.effort == point.effort
                })
            };
            match groups.iter_mut().find(is_here) {
                Some(group) => group.push(point),
                None => groups.push(vec![point]),
            }
        }
        let mut used = Vec::new();
        groups.into_iter().filter_map(|group| Self::of_points(group, study, &mut used)).collect()
    }

    fn of_points(mut points: Vec<&'a Point>, study: &'a Study, used: &mut Vec<String>) -> Option<Self> {
        let newest = *points.last()?;
        // Methods in the order of the program; rungs in the order in which they were measured, which is that of ladders.
        points.sort_by_key(|point| METHODS.iter().position(|info| info.name == point.method).unwrap_or(METHODS.len()));
        let slug = unused(&format!("{} {} {}", newest.place.scene, newest.place.lighting, size(&newest.place)), used);
        let mut names = Vec::new();
        let mut points: Vec<Entry<'_>> = points
            .into_iter()
            .map(|point| Entry { slug: unused(&point.name(), &mut names), point, fronts: Vec::new() })
            .collect();
        let mut reference = None;
        for line in study.references.iter().filter(|line| line.place == newest.place) {
            let is_its_own = is_same_device(&line.machine, &newest.machine) && line.effort == newest.effort;
            if reference.is_none() || is_its_own {
                reference = Some(line);
            }
        }
        let mut scatters = Vec::new();
        for metric in Metric::ALL {
            let scatter = scatter(&newest.place, metric, &points, reference);
            if scatter.series.is_empty() {
                continue;
            }
            for key in scatter.front() {
                if let Some(entry) = points.iter_mut().find(|entry| entry.slug == key) {
                    entry.fronts.push(metric);
                }
            }
            scatters.push((metric, scatter));
        }
        Some(Self { slug, newest, points, reference, scatters })
    }

    /// Words for the place.
    pub fn title(&self) -> String {
        place_title(&self.newest.place)
    }

    /// The section of the page, and its plots.
    pub fn html(&self, plots: &mut Vec<Plot>) -> String {
        let mut html = Html::new();
        html.tags(format_args!("<section class=\"place\" id=\"{0}\" data-place=\"{0}\">", self.slug));
        html.tag("<h2>").words(&self.newest.place.scene).tag(" <small>");
        html.words(&format!("{} · {}", lighting(&self.newest.place), size(&self.newest.place))).tag("</small></h2>");
        html.tag("<p class=\"measured\">").words(&self.measured()).tag("</p>");
        html.tag("<div class=\"columns\"><div class=\"charts\">");
        if self.scatters.len() > 1 {
            html.tag("<div class=\"tabs\" role=\"tablist\" aria-label=\"Measure of error\">");
            for (k, (metric, _)) in self.scatters.iter().enumerate() {
                let (slug, name, is_first) = (&self.slug, metric.name(), k == 0);
                html.tags(format_args!(
                    "<button type=\"button\" role=\"tab\" id=\"tab-{slug}-{name}\" aria-controls=\"chart-{slug}-{name}\" \
                     aria-selected=\"{is_first}\" tabindex=\"{}\">",
                    if is_first { 0 } else { -1 }
                ));
                html.words(tab(*metric)).tag("</button>");
            }
            html.tag("</div>");
        }
        for (k, (metric, scatter)) in self.scatters.iter().enumerate() {
            let (slug, name) = (&self.slug, metric.name());
            let drawing = scatter.draw();
            html.tags(format_args!(
                "<figure role=\"tabpanel\" id=\"chart-{slug}-{name}\" aria-labelledby=\"tab-{slug}-{name}\"{}>",
                if k == 0 { "" } else { " hidden" }
            ));
            html.tag(&svg(&drawing, Use::Page)).tag("</figure>");
            plots.push(Plot { file: format!("{slug}-{name}"), drawing });
        }
        if self.scatters.is_empty() {
            html.tag("<p>Only times were measured here.</p>");
        }
        html.tag(
            "</div><div class=\"panel\" aria-live=\"polite\"></div><div class=\"compare\"></div></div><details \
             class=\"all\"><summary>All points</summary><div class=\"scroll\">",
        );
        html.tag(&self.table()).tag("</div></details></section>");
        html.done()
    }

    /// By whom and how, and against what.
    fn measured(&self) -> String {
        let machine = &self.newest.machine;
        let mut builds: Vec<&str> = Vec::new();
        for entry in &self.points {
            if !builds.contains(&entry.point.machine.build.as_str()) {
                builds.push(&entry.point.machine.build);
            }
        }
        let mut text = format!(
            "{}, {}, occlusion {}; mica {}; effort {}.",
            machine.device,
            machine.driver,
            machine.occlusion,
            builds.join(" and "),
            self.newest.effort
        );
        if let Some(reference) = self.reference {
            text += &format!(
                " Reference: {} samples a pixel, noise {} of the mean; floor: W1 {}.",
                reference.samples,
                three_digits(reference.noise),
                three_digits(reference.floor.w1.value)
            );
        }
        text
    }

    /// All points as a table that can be sorted.
    fn table(&self) -> String {
        let mut html = Html::new();
        html.tag("<table class=\"points\"><thead><tr>");
        let names = FIGURES.iter().map(|figure| figure.name).chain(["memory of glints"]);
        for (k, name) in ["method", "setting", "claim"].into_iter().chain(names).enumerate() {
            let class = if k < 3 { "" } else { " class=\"number\"" };
            html.tags(format_args!("<th scope=\"col\"{class}><button type=\"button\">"))
                .words(name)
                .tag("</button></th>");
        }
        html.tag("</tr></thead><tbody>");
        for Entry { slug, point, fronts } in &self.points {
            let class = if fronts.contains(&Metric::W1) { " class=\"front\"" } else { "" };
            let look = look_of(&point.method);
            html.tags(format_args!("<tr data-row=\"{slug}\"{class}><th scope=\"row\">"));
            html.tag(&svg(&swatch(look, 14.0), Use::Page)).words(&point.method).tag("</th><td>");
            html.tags(format_args!("<a href=\"#{}/{slug}\">", self.slug)).words(&point.rung).tag("</a></td><td>");
            html.words(&point.claim).tag("</td>");
            for figure in &FIGURES {
                match figure.of(point).filter(|shown| shown.number().is_finite()) {
                    Some(shown) => html.tags(format_args!(
                        "<td data-value=\"{}\" title=\"{}\">{}</td>",
                        shown.number(),
                        escaped(&shown.with_interval()),
                        shown.words()
                    )),
                    None => html.tag("<td>–</td>"),
                };
            }
            let glint_bytes = point.cost.glint_bytes;
            html.tags(format_args!("<td data-value=\"{glint_bytes}\">{}</td></tr>", bytes(glint_bytes)));
        }
        html.tag("</tbody></table>");
        html.done()
    }

    /// What the page's script needs to know.
    pub fn as_json(&self, album: &mut Album) -> Json {
        let points: Vec<Json> = self.points.iter().map(|entry| entry.as_json(album)).collect();
        // What is looked at first: the most accurate of the front.
        let first = self.scatters.first().and_then(|(_, scatter)| scatter.front().last().map(|key| (*key).to_owned()));
        json!({
            "slug": self.slug,
            "title": self.title(),
            "size": self.newest.place.size,
            "reference": self.reference.and_then(|reference| album.add(&reference.pictures[0])),
            "first": first.or_else(|| self.points.first().map(|entry| entry.slug.clone())),
            "points": points,
        })
    }
}

impl Entry<'_> {
    fn as_json(&self, album: &mut Album) -> Json {
        let point = self.point;
        let mut figures: Vec<[String; 3]> = FIGURES
            .iter()
            .filter_map(|figure| {
                Some([figure.name.to_owned(), figure.of(point)?.with_interval(), figure.meaning.to_owned()])
            })
            .collect();
        let meanings = super::figures::FURTHER.map(|(_, meaning)| meaning);
        for ((name, words), meaning) in further(point).into_iter().zip(meanings) {
            figures.push([name.to_owned(), words, meaning.to_owned()]);
        }
        let bands: Vec<[String; 5]> = point.errors.iter().flat_map(|errors| &errors.bands).map(band_words).collect();
        let passes: Vec<[String; 2]> =
            point.cost.passes.iter().map(|(name, ns)| [name.clone(), with_interval(scaled(*ns, 1e-6))]).collect();
        let memory: Vec<[String; 3]> =
            point.cost.memory.iter().map(|one| [one.name.clone(), bytes(one.bytes), one.lifetime.clone()]).collect();
        let picture = |k: usize| point.pictures.as_ref().and_then(|paths| paths.get(k));
        json!({
            "slug": self.slug,
            "name": point.name(),
            "method": point.method,
            "rung": point.rung,
            "claim": point.claim,
            "set": point.set,
            "fronts": self.fronts.iter().map(|metric| tab(*metric)).collect::<Vec<_>>(),
            "figures": figures,
            "bands": bands,
            "passes": passes,
            "memory": memory,
            "command": point.command,
            "build": point.machine.build,
            "picture": picture(0).and_then(|path| album.add(path)),
            "difference": picture(1).and_then(|path| album.add(path)),
        })
    }
}

fn band_words(band: &BandErrors) -> [String; 5] {
    let (from, to) = band.flakes;
    let flakes = match to {
        Some(to) => format!("{} to {}", three_digits(from), three_digits(to)),
        None => format!("{} and more", three_digits(from)),
    };
    [
        flakes,
        band.pixels.to_string(),
        with_interval(band.mean_ratio),
        with_interval(band.variance_ratio),
        with_interval(band.w1),
    ]
}

/// The chart of a metric; without series where nothing was measured.
fn scatter(place: &Place, metric: Metric, points: &[Entry<'_>], reference: Option<&ReferenceLine>) -> Scatter {
    let mut series: Vec<Series> = Vec::new();
    for Entry { slug, point, .. } in points {
        let error = point.errors.as_ref().and_then(|errors| metric.of(errors)).filter(|error| error.value.is_finite());
        let Some(error) = error else { continue };
        let time = scaled(point.cost.glints, 1e-6);
        let mark = Mark { key: slug.clone(), name: point.name(), what: String::new(), time, error };
        match series.iter_mut().find(|one| one.name == point.method) {
            Some(one) => one.marks.push(mark),
            None => {
                series.push(Series { name: point.method.clone(), look: look_of(&point.method), marks: vec![mark] });
            }
        }
    }
    // The floor of |ratio - 1| is chance alone: the reference's own ratio is 1.
    let has_floor = matches!(metric, Metric::W1 | Metric::RelMse | Metric::Flip | Metric::HdrFlip);
    let floor = reference.filter(|_| has_floor).and_then(|line| metric.of(&line.floor)).map(|floor| floor.value);
    Scatter {
        title: place_title(place),
        time: "glint time, ms".to_owned(),
        error: metric.label().to_owned(),
        floor: floor.filter(|floor| floor.is_finite() && *floor > 0.0),
        series,
        labelled: Labelled::Front,
    }
}

fn place_title(place: &Place) -> String {
    format!("{}, {}, {}", place.scene, lighting(place), size(place))
}

/// Which lights shine, in words.
pub fn lighting(place: &Place) -> String {
    match place.lighting.as_str() {
        "own" => "its own light".to_owned(),
        "lights" => "lights alone".to_owned(),
        "environment" => "environment alone".to_owned(),
        other => other.to_owned(),
    }
}

/// Pixels along x and y, in words.
pub fn size(place: &Place) -> String {
    let [width, height] = place.size;
    format!("{width}×{height}")
}
