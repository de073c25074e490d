//! The flakes on the GPU are the oracle's, bit for bit: keys, words and normals, and how many of them a footprint holds
//! and a light lights.

use glam::{DVec2, DVec3};
use mica_graph::{Access, Buffer, Extent, Graph, Lifetime, Shader};
use mica_oracle::flake_set::{self, FlakeSet, Footprint, is_lit};
use mica_shaders::{constants as c, flake_counts};
use mica_tests::Gpu;
use mica_tests::shaders::{Change, filled, push_pass, test_shader};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

/// What `flake_words.comp` makes of four words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Made {
    key: [u32; 2],
    pair: [u32; 2],
    drawn: u32,
    half_low: [u32; 2],
    children: [u32; 8],
    place: [u32; 2],
    normal: [u32; 2],
}

impl Made {
    fn by_the_oracle([a, b, c, d]: [u32; 4]) -> Self {
        let halves = |number: u64| [number as u32, (number >> 32) as u32];
        let number = (u64::from(c) | u64::from(d & 0xff) << 32) >> ((d >> 8) % 40);
        let at = 6u32.wrapping_add(a.wrapping_mul(4));
        let word = |k: u32| flake_set::draw([b, c], at.wrapping_add(k));
        let children = flake_set::children_of(number, [a, b]).map(halves);
        Self {
            key: flake_set::node_key(a & 31, b, c, d),
            pair: flake_set::normal_pair(a, b).map(f32::to_bits),
            drawn: flake_set::draw([b, c], a),
            half_low: halves(flake_set::half_of(number, a, b)),
            children: bytemuck::cast(children),
            place: [word(0), word(1)],
            normal: flake_set::normal_pair(word(2), word(3)).map(|deviate| (0.3 * deviate).to_bits()),
        }
    }
}

/// Words of all sizes, the extremes among them in every place.
#[test]
fn flakes_are_made_alike_on_both_sides() {
    let mut gpu = Gpu::new();
    let mut random = Pcg64::seed_from_u64(3);
    let extremes = [0, 1, 2, 31, 32, 33, 63, 64, 65, 0x7fff_ffff, 0x8000_0000, u32::MAX - 1, u32::MAX];
    let words: Vec<[u32; 4]> = (0..400_000)
        .map(|index| {
            let mut words = [(); 4].map(|()| random.next_u32() >> (random.next_u32() % 32));
            for word in &mut words {
                if index % 2 == 0 && random.next_u32() % 2 == 0 {
                    *word = extremes[random.next_u32() as usize % extremes.len()];
                }
            }
            words
        })
        .collect();
    let access = [(30, Access::StorageRead), (31, Access::StorageWrite)];
    let shader = test_shader("flake_words.comp", None, &access, 0);
    let mut graph = Graph::new();
    let from = filled(&mut graph, "words", bytemuck::cast_slice(&words));
    let made = graph.buffer("made", (words.len() * size_of::<Made>()) as u64);
    push_pass(&mut graph, shader, &[], words.len(), &[(30, &from, access[0].1), (31, &made, access[1].1)]);
    let made: Vec<Made> = bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&made])[0]);
    for (words, made) in words.iter().zip(&made) {
        assert_eq!(*made, Made::by_the_oracle(*words), "{words:x?}");
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Query {
    uv: [f32; 2],
    side_x: [f32; 2],
    side_y: [f32; 2],
    i: [f32; 3],
    o: [f32; 3],
    sin2_half_gamma: [u32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Answer {
    inside: u32,
    lit: u32,
    steps: u32,
    allowed: f32,
    next: [i32; 2],
    over: u32,
    passes: u32,
}

/// A set of flakes, as the shader is told of it.
#[derive(Clone, Copy, Debug)]
struct Set {
    count: u64,
    alpha: f64,
    seed: u32,
}

impl Query {
    /// The numbers of flakes inside and of those lit.
    fn counted_by_the_oracle(&self, set: &FlakeSet) -> (u32, u32) {
        let wide = |pair: [f32; 2]| DVec2::from(pair.map(f64::from));
        let sides = [wide(self.side_x), wide(self.side_y)];
        let footprint = Footprint { corner: wide(self.uv) - 0.5 * (sides[0] + sides[1]), sides };
        let [i, o] = [self.i, self.o].map(|direction| DVec3::from(direction.map(f64::from)));
        let [low, high] = self.sin2_half_gamma.map(u64::from);
        let sin2_half_gamma = f64::from_bits(low | high << 32);
        let (mut inside, mut lit) = (0, 0);
        set.for_each_in(&footprint, |flake| {
            inside += 1;
            lit += u32::from(is_lit(flake.normal, i, o, sin2_half_gamma));
        });
        (inside, lit)
    }
}

/// Random queries of a set: 0 to 2,000 flakes are expected in each.
fn queries(set: Set, number: usize) -> Vec<Query> {
    let mut random = Pcg64::seed_from_u64(u64::from(set.seed) ^ set.count);
    let mut unit = || (f64::from(random.next_u32()) + 0.5) / 2.0_f64.powi(32);
    let leaves = 2.0_f64.powi(flake_set::leaf_level(set.count) as i32);
    (0..number)
        .map(|index| {
            let mut between = |least: f64, most: f64| least * (most / least).powf(unit());
            let flakes = between(0.003, if index % 4 == 0 { 2000.0 } else { 200.0 });
            let area = (flakes / set.count.max(1) as f64).min(400.0);
            // No longer than 60 squares or 1,500 leaves: the oracle looks at every square about it.
            let longest = 60.0_f64.min(1500.0 / leaves).max(area.sqrt());
            let stretch = between(1.0, if index % 16 == 0 { 1e12 } else { 30.0 });
            let stretch = stretch.min(longest * longest / area).max(1.0);
            let (long, reach) = ((area * stretch).sqrt(), between(1e-3, 1e6));
            let gamma = between(0.2, 30.0).to_radians();
            let turned = |angle: f64, length: f64| DVec2::new(angle.cos(), angle.sin()) * length;
            let angle = if index % 5 == 0 { 0.0 } else { std::f64::consts::TAU * unit() };
            let lean = if index % 7 == 0 { 0.0 } else { 2.8 * (unit() - 0.5) };
            let turn = if unit() < 0.5 { 1.0 } else { -1.0 };
            let mut side_x = turned(angle, long);
            let mut side_y = turned(angle + turn * std::f64::consts::FRAC_PI_2 + lean, area / long / lean.cos());
            if index % 50 == 0 {
                // Without area: one side is none, or both are one.
                side_y = if index % 100 == 0 { DVec2::ZERO } else { side_x };
            }
            if index % 3 == 0 {
                std::mem::swap(&mut side_x, &mut side_y);
            }
            let uv = turned(std::f64::consts::TAU * unit(), if index % 4 == 0 { unit() } else { reach });
            let mut direction = || {
                let (z, azimuth) = (1.0 - 0.95 * unit(), std::f64::consts::TAU * unit());
                turned(azimuth, (1.0 - z * z).sqrt()).extend(z)
            };
            let i = direction();
            // Half of the views look to where flakes mirror.
            let o = if index % 2 == 0 { direction() } else { DVec3::new(-i.x, -i.y, i.z) };
            let sin2 = (0.5 * gamma).sin().powi(2).to_bits();
            Query {
                uv: uv.as_vec2().to_array(),
                side_x: side_x.as_vec2().to_array(),
                side_y: side_y.as_vec2().to_array(),
                i: i.as_vec3().to_array(),
                o: o.as_vec3().to_array(),
                sin2_half_gamma: [sin2 as u32, (sin2 >> 32) as u32],
            }
        })
        .collect()
}

const PASSES: u32 = 4;

/// What the device says of each query, in several passes of so many steps.
fn answers(gpu: &mut Gpu, shader: &'static Shader, set: Set, queries: &[Query], steps: u32) -> Vec<Answer> {
    let mut graph = Graph::new();
    let leaf_level = flake_set::leaf_level(set.count);
    let table_level = leaf_level.min(c::FLAKE_TABLE_LEVEL);
    let mut counts = filled(&mut graph, "counts", &set.count.to_le_bytes());
    for level in 0..table_level {
        let mut children = Buffer::new("counts", 32 << (2 * level), Lifetime::Frame);
        let bind = flake_counts::Bind { parents: &counts, children: &mut children };
        graph.pass(bind, flake_counts::Params { level, seed: set.seed }, Extent::line(1 << (2 * level)));
        counts = children;
    }
    let asked = filled(&mut graph, "queries", bytemuck::cast_slice(queries));
    let mut answers = graph.buffer("answers", (queries.len() * size_of::<Answer>()) as u64);
    graph.fill(&mut answers, 0);
    let deviation = (set.alpha / 2.0_f64.sqrt()) as f32;
    let params = [set.seed, leaf_level, table_level, (set.count as f32).to_bits(), deviation.to_bits(), steps];
    for _ in 0..PASSES {
        let read = Access::StorageRead;
        let buffers = [(55, &counts, read), (30, &asked, read), (31, &answers, Access::StorageReadWrite)];
        push_pass(&mut graph, shader, &params, queries.len(), &buffers);
    }
    bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&answers])[0])
}

fn query_shader(change: Option<Change>) -> &'static Shader {
    let accesses = [(55, Access::StorageRead), (30, Access::StorageRead), (31, Access::StorageReadWrite)];
    test_shader("flake_queries.comp", change, &accesses, 24)
}

/// Flakes a square, from none to the most there can be, and about every change of how they are counted.
const COUNTS: [u64; 25] = [
    0,
    1,
    2,
    4,
    5,
    17,
    64,
    65,
    300,
    1_000,
    4_096,
    10_000,
    65_537,
    100_000,
    1_000_000,
    1 << 20,
    (1 << 20) + 1,
    10_000_000,
    300_000_000,
    (1 << 32) - 1,
    (1 << 32) + 1,
    20_000_000_000,
    300_000_000_000,
    999_999_999_999,
    1_000_000_000_000,
];

/// More than a million queries over flakes from none to 10^12 a square, UVs to 10^6 either way, footprints of 0 to
/// 2,000 flakes, round and up to 10^12 times as long as wide, turned either way, without area, larger than the square:
/// all counts are equal (46.6 million flakes inside, 2 million of them lit), no walk runs out of passes, and none takes
/// more steps than are allowed for.
#[test]
fn a_million_counts_equal_the_oracle_s() {
    let mut gpu = Gpu::new();
    let shader = query_shader(None);
    let (mut asked, mut found, mut lit, mut most, mut resumed) = (0usize, 0u64, 0u64, 0, 0usize);
    for (index, count) in COUNTS.into_iter().enumerate() {
        let set = Set { count, alpha: [0.05, 0.1, 0.3, 0.5, 1.0][index % 5], seed: 77 * index as u32 };
        let queries = queries(set, 40_500);
        let answers = answers(&mut gpu, shader, set, &queries, 7000);
        let flakes = FlakeSet::new(count, set.alpha, set.seed).expect("a set");
        let expected: Vec<(u32, u32)> = queries.par_iter().map(|query| query.counted_by_the_oracle(&flakes)).collect();
        for ((query, answer), expected) in queries.iter().zip(&answers).zip(&expected) {
            assert_eq!((answer.inside, answer.lit), *expected, "{set:?} {query:?} {answer:?}");
            assert_eq!(answer.over, 1, "cut off: {set:?} {query:?} {answer:?}");
            assert!(answer.steps as f32 <= answer.allowed, "{set:?} {query:?} {answer:?}");
            asked += 1;
            found += u64::from(answer.inside);
            lit += u64::from(answer.lit);
            most = most.max(answer.inside);
            resumed += usize::from(answer.steps > 7000);
        }
        println!("{count} a square: {found} found so far");
    }
    println!("{asked} queries: {found} flakes inside, {most} at most, {lit} lit; {resumed} walks took several passes");
    assert!(asked > 1_000_000 && found > 20_000_000 && lit > 200_000 && most > 1_900 && resumed > 10);
}

/// How a walk is cut into passes changes nothing, and the counts above would show positions rounded to f32, edges that
/// are open on the wrong side by 2^-30 of a leaf, and a cone wider by one part in a thousand.
#[test]
fn counts_depend_on_every_bit_and_on_nothing_else() {
    let mut gpu = Gpu::new();
    let set = Set { count: 1_000_000, alpha: 0.3, seed: 5 };
    let queries = queries(set, 20_000);
    let counts = |answers: &[Answer]| -> Vec<(u32, u32)> { answers.iter().map(|a| (a.inside, a.lit)).collect() };
    let exact = answers(&mut gpu, query_shader(None), set, &queries, 7000);
    let in_parts = answers(&mut gpu, query_shader(None), set, &queries, 4500);
    assert!(in_parts.iter().all(|answer| answer.over == 1));
    assert_eq!(counts(&exact), counts(&in_parts));
    let cut = |axis| format!("packDouble2x32(unpackDouble2x32(corner.{axis}) & uvec2(0xe0000000u, ~0u))");
    // The bits that a float lacks, by hand: Mesa 25 folds a conversion to float and back away.
    let as_float = format!("corner = dvec2({}, {}); dvec2 square = floor(corner);", cut('x'), cut('y'));
    const FOOTPRINT: &str = "shared/flakes_in_footprint.glsl";
    const LIT: &str = "shared/lit_flake.glsl";
    for (file, from, to) in [
        (FOOTPRINT, "dvec2 square = floor(corner);", as_float.as_str()),
        (FOOTPRINT, "low >= 0.0lf && high < 0.0lf", "low >= 1e-6lf * -high && high < 0.0lf"),
        (LIT, "<= 4.0lf * sin2_half_gamma", "<= 4.004lf * sin2_half_gamma"),
    ] {
        let wrong = answers(&mut gpu, query_shader(Some(Change { file, from, to })), set, &queries, 7000);
        let differing = counts(&exact).iter().zip(counts(&wrong)).filter(|(a, b)| **a != *b).count();
        println!("{from}: {differing} of {} counts differ", queries.len());
        assert!(differing > 0, "{from}");
    }
}
