//! Alpha masks in the walk: what they cut out does not block, whatever is behind it does.

use crate::shapes;
use crate::trace::{Ray, Tracer, scene};
use crate::truth::crossing;
use glam::DVec3;

/// Whole triangles and parts of others are holes; the rule depends on all that the walk passes on.
const COVERED: &str = "
bool is_covered(uint instance, uint triangle, vec2 barycentrics) {
  return (instance + triangle) % 3u != 0u && barycentrics.x + 0.5 * barycentrics.y > 0.4;
}
";

/// The same on the host; `None` near the rim of a hole.
fn covered(instance: u32, triangle: u32, [second, third]: [f64; 2]) -> Option<bool> {
    let inside = second + 0.5 * third - 0.4;
    if (instance + triangle).is_multiple_of(3) { Some(false) } else { (inside.abs() > 1e-3).then_some(inside > 0.0) }
}

/// All but some of 5,000 rays are decided by the truth in f64.
#[test]
fn rays_pass_through_holes_and_meet_what_is_behind() {
    let mesh = shapes::random_triangles(300, 0.4, 31);
    let instances = shapes::twelve_places();
    let corners: Vec<_> = (0..12u32)
        .flat_map(|instance| (0..300u32).map(move |triangle| (instance, triangle)))
        .map(|(instance, triangle)| {
            let place = |corner| instances[instance as usize].1.transform_point3(corner);
            (instance, triangle, mesh.corners(triangle as usize).map(place))
        })
        .collect();
    let mut random = shapes::Random::new(32);
    let rays: Vec<Ray> = (0..5_000).map(|_| Ray::new(1.5 * random.point(), random.direction())).collect();
    let answers = Tracer::masked(COVERED).trace(&scene(&mesh, &instances), &rays);

    let (mut decided, mut through, mut hits) = (0, 0, 0);
    for (ray, answer) in rays.iter().zip(&answers) {
        assert_eq!(answer.any != 0, answer.hit(), "any and closest hit differ: {answer:?}");
        let mut met: Vec<_> = corners
            .iter()
            .filter_map(|&(instance, triangle, corners)| Some((instance, triangle, crossing(corners, ray)?)))
            .filter(|(_, _, crossing)| crossing.inside > -1e-4 && crossing.t > -1e-4)
            .collect();
        met.sort_by(|a, b| a.2.t.total_cmp(&b.2.t));
        let uncertain = met.iter().any(|(instance, triangle, crossing)| {
            crossing.inside < 1e-4
                || crossing.t < 1e-4
                || covered(*instance, *triangle, crossing.barycentrics).is_none()
        });
        if uncertain || met.windows(2).any(|pair| pair[1].2.t - pair[0].2.t < 1e-4) {
            continue;
        }
        decided += 1;
        let blocks = |&&(instance, triangle, ref crossing): &&(u32, u32, _)| {
            let crossing: &crate::truth::Crossing = crossing;
            covered(instance, triangle, crossing.barycentrics) == Some(true)
        };
        let first = met.iter().find(blocks);
        through += usize::from(met.first().is_some_and(|first| !blocks(&first)));
        hits += usize::from(first.is_some());
        let expected = first.map(|&(instance, triangle, _)| (instance, triangle));
        assert_eq!(answer.hit().then_some((answer.instance, answer.triangle)), expected, "{ray:?}: {answer:?}");
    }
    println!("{decided} of {} rays decided, {through} pass through a hole first, {hits} hit", rays.len());
    assert!(decided > 4_500 && through > 800 && hits > 1_000);
}

/// Ninety-nine panes that are holes, and a wall.
#[test]
fn a_ray_passes_through_any_number_of_holes() {
    let panes = shapes::Mesh::soup((0..100).map(|k| {
        let z = f64::from(-k);
        [DVec3::new(-1.0, -1.0, z), DVec3::new(3.0, -1.0, z), DVec3::new(-1.0, 3.0, z)]
    }));
    let only_last = "bool is_covered(uint instance, uint triangle, vec2 barycentrics) { return triangle == 99u; }\n";
    let here = [(0, glam::DAffine3::IDENTITY)];
    let ray = Ray::new(DVec3::new(0.1, 0.2, 5.0), -DVec3::Z);
    let before = Ray { t_max: 103.9, ..ray };
    let answers = Tracer::masked(only_last).trace(&scene(&panes, &here), &[ray, before]);
    assert_eq!((answers[0].hit(), answers[0].any, answers[0].triangle, answers[0].t), (true, 1, 99, 104.0));
    assert_eq!((answers[1].hit(), answers[1].any), (false, 0));
}
