//! `flakes` shows the very flakes: pixel by pixel what the oracle makes of them, under lights and under an environment.

use glam::{DVec2, DVec3};
use mica_accuracy::{Condition, Stage};
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::flake_set::{FlakeSet, Footprint, is_lit};
use mica_oracle::lit_probability::cone_solid_angle;
use mica_oracle::statistics::Moments;
use mica_render::scene::{EquirectMap, Glint, Light};
use mica_render::{Environment, OcclusionBackend, Renderer};
use mica_tests::shapes::{OVER_PLANE, conductor, plane, seen_plane};
use mica_tests::values::facets;
use mica_tests::{Gpu, Picture};

pub(crate) const SIZE: [u32; 2] = [160, 90];
/// Towards the sun.
const SUN: DVec3 = DVec3::new(0.2, 0.8, -0.6);

/// The plane of flakes that reflect everything, under the sun of irradiance 1, or under an environment, or both.
pub(crate) fn renderer(method: &str, glint: Glint, sun: bool, map: Option<&Environment>) -> Renderer {
    let material = conductor(method, Glint { color: Some([1.0; 3]), ..glint });
    let lights = [Light::Directional { direction: -SUN.normalize(), irradiance: [1.0; 3] }];
    let lights = if sun { &lights[..] } else { &[] };
    Renderer::new(plane(material, 40.0), lights, map, OcclusionBackend::None).expect("the scene is sound")
}

pub(crate) fn shown(gpu: &mut Gpu, renderer: &mut Renderer, settings: &[(&str, &str)]) -> Picture {
    for (key, value) in settings {
        renderer.set(None, key, value).expect("a setting");
    }
    let picture = gpu.render(renderer, &OVER_PLANE.view(SIZE)).picture;
    assert_eq!((picture.nonfinite(), picture.negative()), (0, 0));
    picture
}

/// The point of the plane that each pixel's centre sees, and its change from pixel to pixel along x and y.
pub(crate) fn footprints() -> Vec<(DVec3, [DVec2; 2])> {
    let points: Vec<DVec3> = seen_plane(SIZE).into_iter().map(|(point, _)| point).collect();
    // A ray's change is known from its neighbours', as points of a picture's rows and columns lie on straight lines.
    let backwards = (OVER_PLANE.eye - OVER_PLANE.target).normalize();
    let right = DVec3::Y.cross(backwards).normalize();
    let up = backwards.cross(right);
    let pixel = 2.0 * (0.5 * OVER_PLANE.vertical_fov_radians).tan() / f64::from(SIZE[1]);
    let sides = |point: DVec3| {
        let ray = point - OVER_PLANE.eye;
        let depth = -ray.dot(backwards);
        // d(eye + ray t) along the plane, for the ray through the next pixel.
        [right * pixel, -up * pixel].map(|change| {
            let moved = depth * (change - ray / ray.y * change.y);
            DVec2::new(moved.x, moved.z)
        })
    };
    points.into_iter().map(|point| (point, sides(point))).collect()
}

/// The oracle's local frame of the plane: normal +Z, x as in the world.
pub(crate) fn local(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

/// Radiance of every pixel under the sun, flake by flake in f64.
fn expected(count: u64, alpha: f64, gamma: f64, seed: u32) -> Vec<f64> {
    let set = FlakeSet::new(count, alpha, seed).expect("a set");
    let facets = facets(alpha);
    let i = local(SUN.normalize());
    let sin2 = (0.5 * gamma).sin().powi(2);
    let radiance = |(point, sides): (DVec3, [DVec2; 2])| {
        let o = local((OVER_PLANE.eye - point).normalize());
        let footprint = Footprint { corner: DVec2::new(point.x, point.z) - 0.5 * (sides[0] + sides[1]), sides };
        let mut lit = 0.0;
        set.for_each_in(&footprint, |flake| lit += if is_lit(flake.normal, i, o, sin2) { flake.weight() } else { 0.0 });
        let i_h = 0.5 * (i + o).length();
        let shadowing = facets.g1_over_cos(i) * facets.g1_over_cos(o);
        lit / (count as f64 * footprint.area() * cone_solid_angle(gamma)) * i_h * shadowing * i.z
    };
    footprints().into_iter().map(radiance).collect()
}

/// The share of pixels whose radiance is the expected within .2 %.
fn agreeing(picture: &Picture, expected: &[f64]) -> f64 {
    let close = |(pixel, expected): (&[f32; 4], &f64)| (f64::from(pixel[1]) - expected).abs() <= 2e-3 * expected;
    let agreeing = picture.pixels.iter().zip(expected).filter(|pair| close(*pair)).count();
    agreeing as f64 / expected.len() as f64
}

/// Footprints hold 7 to 140 flakes. Where pixels differ, a flake lies within an f32's rounding of an edge or of the
/// cone. Other flakes, and a footprint or a cone larger by 1 %, do not agree.
#[test]
fn each_pixel_shows_the_oracle_s_flakes() {
    let mut gpu = Gpu::new();
    for (alpha, gamma_deg) in [(0.1, 6.0), (0.5, 4.0)] {
        let gamma = f64::to_radians(gamma_deg);
        let glint = Glint { count: 20_000.0, alpha, gamma_deg, seed: 3, ..Glint::default() };
        let picture = shown(&mut gpu, &mut renderer("flakes", glint, true, None), &[]);
        let lit = picture.pixels.iter().filter(|pixel| pixel[1] > 0.0).count();
        let share = agreeing(&picture, &expected(20_000, alpha, gamma, 3));
        let others = agreeing(&picture, &expected(20_000, alpha, gamma, 4));
        let wider = agreeing(&picture, &expected(20_000, alpha, 1.01 * gamma, 3));
        println!(
            "alpha {alpha}: {share:.4} agree, {others:.3} with other flakes, {wider:.3} in wider cones; {lit} lit"
        );
        assert!(lit > 1000, "{lit}");
        assert!(share > 0.995, "{share}");
        assert!(wider < 1.0 - 0.9 * lit as f64 / picture.pixels.len() as f64, "{wider}");
        assert!(others < 0.995, "{others}");
    }
}

/// A million squares from the origin a float tells eight places along a side of a square apart.
#[test]
fn any_number_of_squares_from_the_origin_the_flakes_are_the_same() {
    let mut gpu = Gpu::new();
    for method in ["flakes", "atanasov"] {
        let pictures = [0.0, 1.0, 1_048_576.0].map(|squares: f32| {
            let glint = Glint { count: 20_000.0, alpha: 0.3, gamma_deg: 4.0, ..Glint::default() };
            let mut scene = plane(conductor(method, glint), 40.0);
            for [u, v] in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.uv[0]) {
                (*u, *v) = (*u + squares, *v - squares);
            }
            let sun = [Light::Directional { direction: -SUN.normalize(), irradiance: [1.0; 3] }];
            let mut renderer = Renderer::new(scene, &sun, None, OcclusionBackend::None).expect("the scene is sound");
            shown(&mut gpu, &mut renderer, &[])
        });
        let lit = pictures[0].pixels.iter().filter(|pixel| pixel[1] > 0.0).count();
        assert!(lit > 1000, "{method}: {lit}");
        let [here, beside, far] = &pictures;
        assert_eq!(here.pixels, beside.pixels, "{method}, one square on");
        assert_eq!(here.pixels, far.pixels, "{method}, a million squares on");
    }
}

/// The same flakes one after the other, however many of them a pass takes; and no walk is cut off, as that would show
/// what is expected instead.
#[test]
fn the_picture_does_not_depend_on_how_it_is_split_into_passes() {
    let mut gpu = Gpu::new();
    let map = Environment { map: EquirectMap::constant([0.3, 0.5, 0.7]), rotation_radians: 0.0 };
    for count in [2e4, 2e5] {
        let glint = Glint { count, alpha: 0.3, gamma_deg: 4.0, ..Glint::default() };
        let mut renderer = renderer("flakes", glint, true, Some(&map));
        let most = ("most", "500");
        let whole = shown(&mut gpu, &mut renderer, &[most]);
        let in_parts = shown(&mut gpu, &mut renderer, &[most, ("steps", "1000")]);
        assert!(whole.differing(&in_parts).is_empty(), "{count}");
        let smooth = shown(&mut gpu, &mut renderer, &[("most", "0")]);
        let same = whole.pixels.len() - whole.differing(&smooth).len();
        println!("{count}: {same} of {} pixels show what is expected of them", whole.pixels.len());
        assert!(if count > 1e5 { same > 1000 && same < 13_000 } else { same == 0 }, "{same}");
    }
}

/// The mean over flakes, and what is shown where there are too many, against the oracle's mean over all sets of flakes
/// (the smooth BRDF over the cone with the masking of its centre). Measured on lavapipe: within two standard errors of
/// .1 to 2 %; what is shown for many flakes is .08 % off at most. Smallest bias caught: 1.5 % of the mean, 1 % of what
/// is shown for many flakes, and 40 % of the variance.
#[test]
fn the_mean_is_that_over_the_cone() {
    let mut gpu = Gpu::new();
    let (mut means_off, mut many_off, mut variances) = (Vec::new(), Vec::new(), Vec::new());
    for (alpha, gamma_deg, theta_i_deg, theta_o_deg) in
        [(0.1, 6.0, 30.0, 36.0), (0.3, 2.0, 10.0, 50.0), (0.5, 6.0, 40.0, 30.0), (0.5, 1.0, 0.0, 70.0)]
    {
        let flakes = if gamma_deg < 3.0 { 3000.0 } else { 300.0 };
        let condition = Condition { alpha, gamma_deg, flakes, theta_i_deg, theta_o_deg, phi_deg: 0.0 };
        let means = ConeMeans::new(&facets(alpha), condition.i(), condition.o(), gamma_deg.to_radians());
        let mut stage = Stage::new("flakes", &condition).expect("a stage");
        let samples = stage.samples(gpu.executor(), &condition, 96, 1).expect("samples");
        let moments = Moments::of(&samples).expect("moments");
        let error = (moments.variance / samples.len() as f64).sqrt() / means.discrete;
        let off = moments.mean / means.discrete - 1.0;
        stage.set("most", "0").expect("a number");
        let many = stage.samples(gpu.executor(), &condition, 8, 1).expect("samples");
        let many = Moments::of(&many).expect("moments").mean / means.discrete;
        println!("{condition:?}: mean off by {off:.4} +- {error:.4}, expectation by {:.4}", many - 1.0);
        means_off.push((1.0 + off, error));
        many_off.push(many);
        // Of n P flakes: the variance of their number, but for the spread of their weights.
        let lit = condition.flakes * means.lit_probability;
        let relative = moments.variance / (moments.mean * moments.mean) * lit;
        variances.push((relative, 0.1 + 5.0 * (2.0 / samples.len() as f64).sqrt()));
    }
    let means = |bias: f64| means_off.iter().all(|(ratio, error)| (bias * ratio - 1.0).abs() < 3.5 * error + 2e-3);
    assert!(means(1.0), "{means_off:?}");
    assert!(!means(1.015) && !means(0.985), "a bias of 1.5 % must show");
    let expectations = |bias: f64| many_off.iter().all(|ratio| (bias * ratio - 1.0).abs() < 0.004);
    assert!(expectations(1.0), "{many_off:?}");
    assert!(!expectations(1.01) && !expectations(0.99), "a bias of 1 % must show");
    let spreads = |bias: f64| variances.iter().all(|(ratio, allowed)| (bias * ratio - 1.0).abs() < *allowed);
    assert!(spreads(1.0), "{variances:?}");
    assert!(!spreads(1.4) && !spreads(0.6), "a variance off by 40 % must show");
}

/// Under a constant environment a flake shows the same wherever it points: what is left is the fluctuation of the count,
/// variance over squared mean 1/n for n flakes, and a seventh more at alpha .3, where masking and weights differ between
/// flakes. `wang2020` lights some of the flakes and none of the others: as printed its furnace sparkles, where it tests each
/// flake, with 24 times that variance at alpha .1 and gamma 6 degrees, and 260 times at alpha .3 and gamma 2 degrees.
#[test]
fn a_furnace_shows_no_sparkle_but_the_count_s() {
    let mut gpu = Gpu::new();
    let map = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.4 };
    let areas: Vec<f64> = seen_plane(SIZE).into_iter().map(|(_, area)| area).collect();
    for (alpha, gamma_deg, as_printed) in [(0.1, 6.0, 20.0..29.0), (0.3, 2.0, 220.0..310.0)] {
        let count = 2000.0;
        let glint = Glint { count, alpha, gamma_deg, ..Glint::default() };
        let mut excess = |method: &str, settings: &[(&str, &str)]| {
            let mut renderer = renderer(method, glint.clone(), false, Some(&map));
            gpu.precompute(&mut renderer);
            let picture = shown(&mut gpu, &mut renderer, settings);
            let many = match method {
                "flakes" => shown(&mut gpu, &mut renderer, &[("most", "0")]),
                _ => shown(&mut gpu, &mut renderer, &[("macro", "0"), ("micro", "0")]),
            };
            // Where a footprint holds few flakes: wang2020 tests each of them there.
            let few = areas.iter().zip(picture.pixels.iter().zip(&many.pixels));
            let (mut sum, mut ratio, mut pixels) = (0.0, 0.0, 0.0);
            for (area, (pixel, many)) in few.filter(|(area, _)| **area * count < 4.0) {
                let relative = f64::from(pixel[1]) / f64::from(many[1]);
                sum += (relative - 1.0).powi(2) * area * count;
                ratio += relative;
                pixels += 1.0;
            }
            assert!(pixels > 3000.0, "{pixels}");
            (sum / pixels, ratio / pixels, many)
        };
        let (flakes, mean, many) = excess("flakes", &[]);
        let (printed, _, _) = excess("wang2020", &[("blur", "off"), ("samples", "16"), ("depth", "8")]);
        println!(
            "alpha {alpha} gamma {gamma_deg}: n variance / mean^2 {flakes:.3}, mean {mean:.4}; wang2020 {printed:.1}"
        );
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        assert!((0.9..1.2).contains(&flakes), "{flakes}");
        assert!(as_printed.contains(&printed), "{printed}");
        assert!(many.pixels.iter().all(|pixel| pixel[1] <= 1.001), "no energy is made");
    }
}

/// The mean radiance under a map of one bright texel is that of a sun that sends as much: within 3 % over all pixels,
/// as the texel is 5.6 degrees wide. Turning the map is turning the texel.
#[test]
fn flakes_mirror_the_environment_where_it_is() {
    let mut gpu = Gpu::new();
    let (width, height) = (64u32, 32u32);
    let bright = |column: u32| {
        let mut texels = vec![[0.0; 3]; (width * height) as usize];
        texels[(9 * width + column) as usize] = [1.0; 3];
        EquirectMap { width, height, texels }
    };
    let glint = Glint { count: 1e5, alpha: 0.5, gamma_deg: 4.0, ..Glint::default() };
    let mut under = |map: EquirectMap, rotation_radians: f64| {
        let map = Environment { map, rotation_radians };
        shown(&mut gpu, &mut renderer("flakes", glint.clone(), false, Some(&map)), &[])
    };
    let here = under(bright(35), 0.0);
    // A quarter turn counter-clockwise is a quarter of the columns to the left.
    let turned = under(bright(51), std::f64::consts::FRAC_PI_2);
    // The cones' directions are not turned with the map: averages over an edge of the texel differ a little.
    let apart = |other: &Picture| -> f64 {
        let pairs = here.pixels.iter().zip(&other.pixels);
        pairs.map(|(a, b)| f64::from((a[1] - b[1]).abs())).sum::<f64>() / here.pixels.len() as f64 / here.mean()[1]
    };
    let when_turned = apart(&turned);
    assert!(when_turned < 0.02, "{when_turned}");
    assert!(apart(&under(bright(51), 0.0)) > 0.2, "another place must show");

    // The texel's centre and solid angle.
    let (polar, azimuth) = (9.5 / 32.0 * std::f64::consts::PI, (35.5 / 64.0 - 0.5) * std::f64::consts::TAU);
    let sun = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
    let side = std::f64::consts::PI / 32.0;
    let solid_angle = side * side * polar.sin();
    let light = Light::Directional { direction: -sun, irradiance: [solid_angle as f32; 3] };
    let material = conductor("flakes", Glint { color: Some([1.0; 3]), ..glint.clone() });
    let mut lit = Renderer::new(plane(material, 40.0), &[light], None, OcclusionBackend::None).expect("a scene");
    let ratio = here.mean()[1] / shown(&mut gpu, &mut lit, &[]).mean()[1];
    println!("{ratio:.4} of a sun's; {when_turned:.4} differs when turned");
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn no_flakes_show_nothing() {
    let mut gpu = Gpu::new();
    for (count, some) in [(0.0, false), (0.4, false), (0.6, true)] {
        let mut renderer = renderer("flakes", Glint { count, ..Glint::default() }, true, None);
        assert_eq!(gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).declares("glints"), some, "{count}");
    }
}

/// Each table is made anew when something that it depends on changes, and only then.
#[test]
fn tables_follow_the_settings_they_are_made_from() {
    let mut gpu = Gpu::new();
    let map = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let mut renderer = renderer("flakes", Glint { count: 100.0, ..Glint::default() }, true, Some(&map));
    let mut updates = |key: &str, value: &str| -> Vec<String> {
        renderer.set(None, key, value).expect("a setting");
        let shot = gpu.render(&mut renderer, &OVER_PLANE.view([16, 9]));
        let tables = ["flake_counts", "upload environment_cone"];
        tables.into_iter().filter(|name| shot.declares(name)).map(str::to_owned).collect()
    };
    assert_eq!(updates("seed", "0"), ["flake_counts", "upload environment_cone"]);
    assert!(updates("alpha", "0.3").is_empty() && updates("most", "10").is_empty());
    assert_eq!(updates("seed", "1"), ["flake_counts"]);
    assert_eq!(updates("count", "300"), ["flake_counts"]);
    assert_eq!(updates("gamma_deg", "3"), ["upload environment_cone"]);
}
