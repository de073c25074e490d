//! H08. A cone against a node of the angular hierarchy.
//!
//! `jakob` needs no roots but those of a leaf's share, which are in f64; its nodes are tested by chords.

use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError};
use glam::DVec3;
use mica_gpu::Timing;
use mica_graph::{Extent, Graph};
use mica_shaders::node_sides;
use mica_shaders::types::NodeQuestion;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

const OUTSIDE: u32 = 0;
const INSIDE: u32 = 2;

/// What is so of a node.
struct Node {
    /// Some flakes of it are lit.
    any_lit: bool,
    /// Some are not.
    any_dark: bool,
    /// All normals in the cone about it are dark, or all are lit, with room to spare.
    plain: bool,
    /// The lit normals lie wholly inside it.
    around_query: bool,
}

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(8);
    let count = laboratory.inputs(20_000, 2_000_000);
    let questions: Vec<NodeQuestion> = (0..count).map(|_| question(&mut random)).collect();
    let nodes: Vec<Node> = questions.par_iter().map(truth).collect();
    let sides = sides(laboratory, &questions)?;
    let share = |of: &dyn Fn(&Node) -> bool, wrong: &dyn Fn(&Node, u32) -> bool, form: usize| {
        let asked: Vec<_> = nodes.iter().zip(&sides).filter(|(node, _)| of(node)).collect();
        let wrong = asked.iter().filter(|(node, sides)| wrong(node, sides[form])).count();
        (asked.len() as u64, wrong as f64 / asked.len() as f64)
    };
    let check = |what: &str, error_of: &str, of: &dyn Fn(&Node) -> bool, wrong: &dyn Fn(&Node, u32) -> bool| {
        let [(inputs, naive), (_, stable)] = [share(of, wrong, 0), share(of, wrong, 1)];
        Check {
            what: what.to_owned(),
            error_of: error_of.to_owned(),
            inputs,
            naive: Form::new("roots of the conic on the edges", naive),
            stable: Form::new("chord of the mirrored axis against sines of gamma/2 +- b", stable),
            tolerance: 0.0,
        }
    };
    let misjudged = |node: &Node, side: u32| match side {
        OUTSIDE => node.any_lit,
        INSIDE => node.any_dark,
        _ => node.plain,
    };
    Ok(vec![
        check(
            "nodes of .01 to 89 degrees, cones of .01 to 30",
            "share misjudged, or left open where the cone about the node tells",
            &|_| true,
            &misjudged,
        ),
        check(
            "nodes around all that is lit",
            "share misjudged, or left open where the cone about the node tells",
            &|node| node.around_query,
            &misjudged,
        ),
    ])
}

/// A spherical triangle, and a cone about its size away from where its axis mirrors the light.
fn question(random: &mut Random) -> NodeQuestion {
    let axis = random.direction_about(DVec3::Z, 1.4);
    // From the finest nodes to those of the first level.
    let wide = random.between(0.0, 1.0) < 0.25;
    let radius = if wide { random.between(60.0, 89.0) } else { random.log_between(0.01, 60.0) }.to_radians();
    let gamma = random.log_between(0.01, 30.0).to_radians();
    let first = random.between(0.0, TAU);
    let corners = [0.0, 1.0, 2.0].map(|third| {
        let turn = first + TAU / 3.0 * (third + random.between(-0.3, 0.3));
        rounded(turned(axis, radius * random.between(0.5, 1.0), turn), 0.0)
    });
    let axis = rounded(axis, 0.0);
    // As the table of `jakob` has it: padded by what rounding moves normals by.
    let chord_radius = corners.iter().fold(0.0_f64, |most, v| most.max(unit(*v).distance(unit(axis)))) + 1e-6;
    let i = random.direction_about(unit(axis), 2.5);
    let mirrored = 2.0 * i.dot(unit(axis)) * unit(axis) - i;
    let away = random.between(0.0, 1.5) * (gamma + 2.0 * radius);
    let o = turned(mirrored, away.min(PI), random.between(0.0, TAU));
    let three = |v: [f32; 4]| [v[0], v[1], v[2]];
    NodeQuestion {
        v0: three(corners[0]),
        v1: three(corners[1]),
        v2: three(corners[2]),
        axis: three(axis),
        chord_radius: chord_radius as f32,
        sin_half: (0.5 * gamma).sin() as f32,
        cos_half: (0.5 * gamma).cos() as f32,
        cos_gamma: gamma.cos() as f32,
        i: rounded(i, 0.0),
        o: rounded(o, 0.0),
    }
}

fn sides(laboratory: &mut Laboratory, questions: &[NodeQuestion]) -> Result<Vec<[u32; 2]>, StabilityError> {
    let mut graph = Graph::new();
    let mut asked = graph.buffer("node questions", size_of_val(questions) as u64);
    graph.upload(&mut asked, bytemuck::cast_slice(questions));
    let mut sides = graph.buffer("node sides", (size_of::<[u32; 2]>() * questions.len()) as u64);
    let count = questions.len() as u32;
    let bind = node_sides::Bind { node_questions: &asked, node_sides: &mut sides };
    graph.pass(bind, node_sides::Params { count }, Extent::new(count, 1));
    let download = graph.download(&sides);
    let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// By normals all over the triangle, densest on its edges, and the half vector where it lies in the triangle: what is
/// lit is convex, so that it cannot meet a triangle and miss all of these but by a sliver.
fn truth(question: &NodeQuestion) -> Node {
    const ALONG_EDGE: u32 = 64;
    const ACROSS: u32 = 12;
    let four = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    let corners = [question.v0, question.v1, question.v2].map(|v| unit(four(v)));
    let (i, o, axis) = (unit(question.i), unit(question.o), unit(four(question.axis)));
    let gamma = 2.0 * f64::from(question.sin_half).asin();
    let lit = |m: DVec3| {
        let m = m.normalize();
        i.dot(m) > 0.0 && (2.0 * i.dot(m) * m - i).distance(o) <= 2.0 * f64::from(question.sin_half)
    };
    let mut on_edges = Vec::new();
    for edge in 0..3 {
        let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
        on_edges.extend((0..ALONG_EDGE).map(|step| lit(from.lerp(to, f64::from(step) / f64::from(ALONG_EDGE)))));
    }
    let mut inside = Vec::new();
    for (u, v) in (1..ACROSS).flat_map(|u| (1..ACROSS - u).map(move |v| (u, v))) {
        let (u, v) = (f64::from(u) / f64::from(ACROSS), f64::from(v) / f64::from(ACROSS));
        inside.push(lit(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])));
    }
    let h = (i + o).normalize();
    let turn = corners[0].cross(corners[1]).dot(corners[2]).signum();
    let holds_h = (0..3).all(|edge| turn * corners[edge].cross(corners[(edge + 1) % 3]).dot(h) > 1e-9);
    let any_on_edge = on_edges.contains(&true);

    // By the cone about the triangle: mirroring turns by twice what the normal turns by.
    const ROOM: f64 = 1e-4;
    let reach = 2.0 * (2.0 * (0.5 * f64::from(question.chord_radius)).asin());
    let mirrored = 2.0 * i.dot(axis) * axis - i;
    let away = 2.0 * (0.5 * mirrored.distance(o)).min(1.0).asin();
    let facing = (PI / 2.0 - i.dot(axis).acos()) > 0.5 * reach + ROOM;
    Node {
        any_lit: any_on_edge || inside.contains(&true) || holds_h && lit(h),
        any_dark: on_edges.contains(&false) || inside.contains(&false),
        plain: away > gamma + reach + ROOM && gamma + reach < 3.0 || away < gamma - reach - ROOM && facing,
        around_query: holds_h && lit(h) && !any_on_edge,
    }
}
