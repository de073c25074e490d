//! Answers of both bodies against each other and against f64.
//!
//! An answer is right if f32 could have given it: it names a triangle that the ray may meet there, and none that the ray
//! surely meets is nearer. Two right answers that differ are a tie, since the ray grazes an edge or two surfaces lie at
//! the same distance within the bound of [`crate::truth`]. Every other difference is somebody's fault.

use crate::bodies::Said;
use crate::rays::is_aimed;
use crate::truth::{Crossing, World};
use mica_render::OcclusionBackend;
use mica_shaders::types::Ray;
use rayon::prelude::*;

/// Faults that are kept to be shown.
const SHOWN: usize = 3;

/// Rays that a thread takes at once.
const BATCH: usize = 4096;

/// What came of the rays of a scene.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    pub rays: usize,
    /// Rays that the first body lets hit something.
    pub hits: usize,
    /// Rays aimed at corners, edges or along the axes to which the bodies give different answers, and both are right.
    pub aimed_ties: usize,
    /// Such rays that were aimed at nothing of the kind.
    pub ties: usize,
    /// Those of all these that hit for one and miss for the other.
    pub flags: usize,
    /// Rays of which every triangle was tested in f64.
    pub tested: usize,
    /// How far a distance or a place of a hit that is sure was off at most, over what rounding may move it by.
    pub worst: f64,
    /// Wrong answers of each body.
    pub wrong: Vec<usize>,
    /// The first of them.
    pub shown: Vec<String>,
}

impl Tally {
    fn and(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.hits += other.hits;
        self.aimed_ties += other.aimed_ties;
        self.ties += other.ties;
        self.flags += other.flags;
        self.tested += other.tested;
        self.worst = self.worst.max(other.worst);
        self.wrong.resize(self.wrong.len().max(other.wrong.len()), 0);
        self.wrong.iter_mut().zip(&other.wrong).for_each(|(sum, wrong)| *sum += wrong);
        self.shown.extend(other.shown);
        self.shown.truncate(SHOWN);
        self
    }

    fn blame(&mut self, body: usize, ray: &Ray, what: String) {
        self.wrong[body] += 1;
        if self.shown.len() < SHOWN {
            self.shown.push(format!("body {body}: {what}; {ray:?}"));
        }
    }

    /// What [`Tally::line`] has below each other.
    pub const HEAD: &str = "scene                       rays    hits  in f64   worst   aimed    ties   flags  wrong";

    /// A line of a table.
    pub fn line(&self, name: &str) -> String {
        let Self { rays, hits, aimed_ties, ties, flags, tested, worst, wrong, .. } = self;
        format!(
            "{name:24} {rays:>7} {hits:>7} {tested:>7} {worst:>7.3} {aimed_ties:>7} {ties:>7} {flags:>7}  {wrong:?}"
        )
    }

    /// Fails unless all answers are right.
    pub fn expect_right(&self, name: &str) {
        assert!(
            self.wrong.iter().all(|&wrong| wrong == 0),
            "{name}: {:?} wrong answers\n{}",
            self.wrong,
            self.shown.join("\n")
        );
    }
}

/// What one body says of all rays.
pub type Answers = (OcclusionBackend, Vec<Said>);

/// Compares what each body says of each ray. Where they differ but in the name of what they meet, and of every `every`th
/// ray, all triangles are tested.
pub fn compare(world: &World, rays: &[Ray], said: &[Answers], every: usize) -> Tally {
    assert!(said.iter().all(|(_, said)| said.len() == rays.len()), "an answer for each ray");
    let batch = |(batch, some): (usize, &[Ray])| {
        let mut tally = Tally { rays: some.len(), wrong: vec![0; said.len()], ..Tally::default() };
        for (k, ray) in some.iter().enumerate() {
            let index = batch * BATCH + k;
            let of_ray: Vec<_> = said.iter().map(|(of, said)| (*of, &said[index])).collect();
            judge(world, ray, is_aimed(index), &of_ray, index.is_multiple_of(every), &mut tally);
        }
        tally
    };
    rays.par_chunks(BATCH).enumerate().map(batch).reduce(Tally::default, Tally::and)
}

/// A hit that f32 could have given.
struct Hit {
    /// Or the first that is the same.
    triangle: u32,
    crossing: Crossing,
}

fn judge(world: &World, ray: &Ray, aimed: bool, said: &[(OcclusionBackend, &Said)], test_all: bool, tally: &mut Tally) {
    let hits: Vec<Option<Hit>> =
        said.iter().enumerate().map(|(body, (of, said))| hit(world, ray, body, *of, said, tally)).collect();
    tally.hits += usize::from(said[0].1.closest.blocked != 0);
    tally.tested += usize::from(test_all);
    let name = |hit: &Option<Hit>| hit.as_ref().map(|hit| hit.triangle);
    let differ = hits.iter().any(|hit| name(hit) != name(&hits[0]));
    // Two triangles at one distance are a tie whatever lies before them, as one triangle is no tie.
    let at_one_distance = hits.iter().all(|hit| match (hit, &hits[0]) {
        (Some(hit), Some(first)) => {
            (hit.crossing.t - first.crossing.t).abs() <= hit.crossing.t_error + first.crossing.t_error
        }
        (hit, first) => hit.is_none() && first.is_none(),
    });
    let mut right = true;
    if !at_one_distance || test_all {
        for (body, (of, said)) in said.iter().enumerate() {
            let latest = world.first_certain(ray, *of);
            let at = if said.closest.blocked == 0 { f64::INFINITY } else { f64::from(said.closest.t) };
            if at > latest {
                right = false;
                tally.blame(body, ray, format!("{:?}, though something is at {latest:e} at the latest", said.closest));
            }
        }
    }
    if differ && right {
        *(if aimed { &mut tally.aimed_ties } else { &mut tally.ties }) += 1;
        tally.flags += usize::from(hits.iter().any(Option::is_none));
    }
}

/// What a body says it hits, if that could be; blames it if not.
fn hit(world: &World, ray: &Ray, body: usize, of: OcclusionBackend, said: &Said, tally: &mut Tally) -> Option<Hit> {
    let Said { closest, any } = said;
    if let Some(any) = any.filter(|any| any.blocked != closest.blocked) {
        tally.blame(body, ray, format!("any hit says {} and closest hit {}", any.blocked, closest.blocked));
    }
    if closest.blocked == 0 {
        return None;
    }
    let Some(triangle) = world.named(closest) else {
        tally.blame(body, ray, format!("no such triangle: {closest:?}"));
        return None;
    };
    let crossing = world.crossing(triangle, ray, of);
    let apart = [0, 1].map(|k| (f64::from(closest.barycentrics[k]) - crossing.barycentrics[k]).abs());
    let t_off = (f64::from(closest.t) - crossing.t).abs() / crossing.t_error;
    let off = t_off.max(apart[0].max(apart[1]) / crossing.barycentrics_error).max(-crossing.margin);
    let between = ray.t_min < closest.t && closest.t < ray.t_max;
    if world.is_there(triangle, &crossing) == Some(false) {
        tally.blame(body, ray, format!("{closest:?} is in a hole at {crossing:?}"));
    } else if !(t_off <= 1.0 && off <= 1.0 && between) {
        // Written so that NaN is wrong.
        tally.blame(body, ray, format!("{closest:?} is {off:.2} bounds off {crossing:?}"));
    } else if crossing.margin > 1.0 {
        // Beside an edge, or seen edge-on, a triangle lets f32 answer anything within its bound.
        tally.worst = tally.worst.max(off);
    }
    Some(Hit { triangle, crossing })
}

/// The comparison itself is tested with answers that were tampered with: none goes through.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::ray;
    use crate::{meshes, scenes};
    use glam::DVec3;
    use mica_shaders::types::RayAnswer;

    /// One triangle before another one, the right answer of a ray onto both, and the ray.
    fn example() -> (World, Ray, Said) {
        let scene = scenes::alone("two", meshes::identical(1).and(meshes::identical(1).map(|point| point - DVec3::Z)));
        let world = World::new(&scene, DVec3::ZERO);
        let ray = ray(DVec3::new(0.05, -0.04, 2.0), DVec3::new(0.0, 0.0, -1.0));
        let found = world.crossing(0, &ray, OcclusionBackend::Bvh);
        assert!(found.margin > 1.0);
        let barycentrics = found.barycentrics.map(|weight| weight as f32);
        let closest = RayAnswer { t: found.t as f32, blocked: 1, instance: 0, triangle: 0, barycentrics };
        (world, ray, Said { closest, any: Some(RayAnswer { blocked: 1, ..RayAnswer::default() }) })
    }

    fn answers([first, second]: [Said; 2]) -> [Answers; 2] {
        [(OcclusionBackend::Bvh, vec![first]), (OcclusionBackend::RayQuery, vec![second])]
    }

    fn compared(world: &World, ray: Ray, said: [Said; 2]) -> Tally {
        compare(world, &[ray], &answers(said), usize::MAX)
    }

    #[test]
    fn the_comparison_finds_each_kind_of_wrong_answer() {
        let (world, ray, right) = example();
        compared(&world, ray, [right, right]).expect_right("the answer");
        let far = world.crossing(1, &ray, OcclusionBackend::Bvh);
        let behind = RayAnswer { t: far.t as f32, triangle: 1, ..right.closest };
        let tampered = [
            ("missed", Said { closest: RayAnswer::default(), any: Some(RayAnswer::default()) }),
            ("missed by any", Said { any: Some(RayAnswer::default()), ..right }),
            ("missed by closest", Said { closest: RayAnswer::default(), ..right }),
            ("the one behind", Said { closest: behind, ..right }),
            ("another triangle", Said { closest: RayAnswer { triangle: 1, ..right.closest }, ..right }),
            ("no triangle", Said { closest: RayAnswer { triangle: 2, ..right.closest }, ..right }),
            ("no instance", Said { closest: RayAnswer { instance: 1, ..right.closest }, ..right }),
            ("too near", Said { closest: RayAnswer { t: right.closest.t - 1e-5, ..right.closest }, ..right }),
            ("too far", Said { closest: RayAnswer { t: right.closest.t + 1e-5, ..right.closest }, ..right }),
            ("nowhere", Said { closest: RayAnswer { t: f32::NAN, ..right.closest }, ..right }),
            ("elsewhere", Said { closest: RayAnswer { barycentrics: [0.3, 0.4], ..right.closest }, ..right }),
        ];
        for (name, wrong) in tampered {
            let [first, second] = [[right, wrong], [wrong, right]].map(|said| compared(&world, ray, said).wrong);
            assert!(first[0] == 0 && first[1] > 0, "{name}: {first:?}");
            assert!(second[0] > 0 && second[1] == 0, "{name}: {second:?}");
        }
        let agreed = Said { closest: RayAnswer::default(), any: Some(RayAnswer::default()) };
        let both = compare(&world, &[ray], &answers([agreed; 2]), 1);
        assert_eq!(both.wrong, [1, 1], "both missed it, and the ray is in the sample");
    }

    #[test]
    fn a_hit_where_nothing_is_counts_as_wrong() {
        let (world, _, right) = example();
        let past = ray(DVec3::new(3.0, 0.0, 2.0), DVec3::new(0.0, 0.0, -1.0));
        assert_eq!(compared(&world, past, [right, right]).wrong, [1, 1]);
    }

    /// A ray through a corner may hit or miss; one through the middle of two copies may name either.
    #[test]
    fn what_f32_cannot_decide_is_a_tie() {
        let (world, _, right) = example();
        let [corner, ..] = meshes::identical(1).corners(0);
        let grazing = ray(corner + DVec3::Z, DVec3::new(0.0, 0.0, -1.0));
        let found = world.crossing(0, &grazing, OcclusionBackend::Bvh);
        let hit = RayAnswer { t: found.t as f32, barycentrics: [0.0; 2], ..right.closest };
        let miss = Said { closest: RayAnswer::default(), any: Some(RayAnswer::default()) };
        let tally = compared(&world, grazing, [Said { closest: hit, ..right }, miss]);
        tally.expect_right("a corner");
        assert_eq!((tally.ties, tally.flags), (1, 1));
    }
}
