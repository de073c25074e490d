//! What each flake of `flakes` mirrors of an environment: the f64 mean of the map's texels over its cone, whether the sun is in
//! it, outside, or cut by its edge.

use crate::flakes::{SIZE, footprints, local, renderer, shown};
use glam::{DQuat, DVec2, DVec3};
use mica_oracle::flake_set::{FlakeSet, Footprint};
use mica_oracle::statistics::Moments;
use mica_render::Environment;
use mica_render::scene::{EquirectMap, Glint, procedural};
use mica_tests::Gpu;
use mica_tests::shapes::OVER_PLANE;
use mica_tests::values::facets;
use std::f64::consts::PI;

const ROTATION: f64 = 0.4;

/// The mean of green over the cone about a direction of the map, by its definition: whole texels, and points of those that the edge
/// cuts, counted.
fn mean_over_cone(map: &EquirectMap, centres: &[DVec3], axis: DVec3, gamma: f64) -> f64 {
    const POINTS: u32 = 20;
    let texel_size = PI / f64::from(map.height);
    let place =
        |at: u32, sub: u32, size: u32| (f64::from(at) + (f64::from(sub) + 0.5) / f64::from(POINTS)) / f64::from(size);
    let towards = |column, row, [x, y]: [u32; 2]| {
        EquirectMap::direction_from_uv([place(column, x, map.width), place(row, y, map.height)])
    };
    let inside = |direction: DVec3| direction.dot(axis) >= gamma.cos();
    let (mut sum, mut total) = (0.0, 0.0);
    for row in 0..map.height {
        let polar = (f64::from(row) + 0.5) * texel_size;
        if (polar - axis.y.acos()).abs() > gamma + texel_size {
            continue;
        }
        for column in 0..map.width {
            let to_edge = (centres[(row * map.width + column) as usize] - axis).length() - 2.0 * (0.5 * gamma).sin();
            let points = if to_edge.abs() > texel_size { 1 } else { POINTS * POINTS };
            let within = match points {
                1 => u32::from(to_edge < 0.0),
                _ => (0..points).map(|at| u32::from(inside(towards(column, row, [at % POINTS, at / POINTS])))).sum(),
            };
            let part = f64::from(within) / f64::from(points) * polar.sin();
            sum += part * f64::from(map.texels[(row * map.width + column) as usize][1]);
            total += part;
        }
    }
    sum / total
}

/// A flake in a pixel: from where it mirrors, in the map's frame, and what it shows of radiance 1 from there.
struct Mirror {
    towards: DVec3,
    share: f64,
}

/// The flakes of each pixel that can mirror anything.
fn mirrors(glint: &Glint) -> Vec<Vec<Mirror>> {
    let set = FlakeSet::new(glint.count as u64, glint.alpha, glint.seed).expect("a set");
    let facets = facets(glint.alpha);
    let of_pixel = |(point, sides): (DVec3, [DVec2; 2])| {
        let o = local((OVER_PLANE.eye - point).normalize());
        let footprint = Footprint { corner: DVec2::new(point.x, point.z) - 0.5 * (sides[0] + sides[1]), sides };
        let mut mirrors = Vec::new();
        set.for_each_in(&footprint, |flake| {
            let m = flake.normal.normalize();
            let r = 2.0 * o.dot(m) * m - o;
            if o.dot(m) > 0.0 && r.z > 0.0 {
                let shadowing = facets.g1_over_cos(r) * r.z * facets.g1_over_cos(o);
                let share = flake.weight() * o.dot(m) * shadowing / (glint.count * footprint.area());
                let towards = DQuat::from_rotation_y(-ROTATION) * DVec3::new(r.x, r.z, -r.y);
                mirrors.push(Mirror { towards, share });
            }
        });
        mirrors
    };
    footprints().into_iter().map(of_pixel).collect()
}

/// Pixels of one to three flakes, so that no other hides what one shows; under `clear` also those where the sun is just inside, just
/// outside, or cut. To 1 %; where the sun is cut .5 % of it more, and where the edge of a soft box is, .1 % of it.
#[test]
fn each_flake_mirrors_the_mean_over_its_cone() {
    let mut gpu = Gpu::new();
    for (name, gamma_deg) in
        [("overcast", 6.0), ("dusk", 3.0), ("studio", 6.0), ("studio", 2.0), ("clear", 6.0), ("clear", 2.0)]
    {
        let map = procedural::environment(name).expect("listed");
        let gamma = f64::to_radians(gamma_deg);
        let glint = Glint { count: 2000.0, alpha: 0.5, gamma_deg, seed: 5, ..Glint::default() };
        let sky = Environment { map, rotation_radians: ROTATION };
        let picture = shown(&mut gpu, &mut renderer("flakes", glint.clone(), false, Some(&sky)), &[]);
        let whole_sun = procedural::SUN_IRRADIANCE.y / (4.0 * PI * (0.5 * gamma).sin().powi(2));
        // How far inside of the cones the sun's middle is.
        let depth = |mirror: &Mirror| gamma - mirror.towards.angle_between(procedural::SUN_DIRECTION);
        let [width, height] = [sky.map.width, sky.map.height];
        let centre = |index: u32| {
            let place = |at: u32, size: u32| (f64::from(at) + 0.5) / f64::from(size);
            EquirectMap::direction_from_uv([place(index % width, width), place(index / width, height)])
        };
        let centres: Vec<DVec3> = (0..width * height).map(centre).collect();
        let (_, rest) = sky.map.part_small_lights();
        let brightest = rest.texels.iter().map(|texel| f64::from(texel[1])).fold(0.0, f64::max);
        let (mut errors, mut off, mut touching, mut inside) = (Vec::new(), 0, 0, 0);
        let mut elsewhere = 0;
        for (pixel, mirrors) in picture.pixels.iter().zip(mirrors(&glint)) {
            let closest = mirrors.iter().map(depth).fold(-PI, f64::max);
            let sun = name == "clear" && closest > -0.01;
            elsewhere += usize::from(!sun);
            if !(1..=3).contains(&mirrors.len()) || !sun && elsewhere % 40 != 0 {
                continue;
            }
            let cut = mirrors.iter().any(|mirror| depth(mirror).abs() < 0.01);
            touching += usize::from(sun && cut);
            inside += usize::from(sun && !cut);
            let means = |mirror: &Mirror| mirror.share * mean_over_cone(&sky.map, &centres, mirror.towards, gamma);
            let expected: f64 = mirrors.iter().map(means).sum();
            // Where the first of a bright edge comes into a cone, the table's texels are straight and the mean is not.
            let edge = 1e-3 * brightest + if cut { 0.005 * whole_sun } else { 0.0 };
            let error = f64::from(pixel[1]) - expected;
            off += usize::from(error.abs() > 0.01 * expected + edge * mirrors.iter().map(|m| m.share).sum::<f64>());
            errors.push(if cut { 0.0 } else { error / expected });
        }
        let moments = Moments::of(&errors).expect("moments");
        println!(
            "{name}, {gamma_deg} degrees: {off} of {} pixels off, deviation {:.5}; the sun is in {inside}, cut in {touching}",
            errors.len(),
            moments.variance.sqrt()
        );
        assert!(errors.len() > 150, "{}", errors.len());
        // A flake may lie within rounding of a pixel's edge.
        assert!(off * 100 <= errors.len(), "{name}: {off}");
        assert!(name != "clear" || inside > 10 && touching > 20, "{inside} {touching}");
    }
}

/// What is shown for many flakes is the mean over flakes also where a few of them show the sun.
#[test]
fn many_flakes_show_the_sun_as_often_as_each_does() {
    let mut gpu = Gpu::new();
    let map = procedural::environment("clear").expect("listed");
    let sky = Environment { map, rotation_radians: ROTATION };
    for (alpha, gamma_deg) in [(0.5, 6.0), (0.2, 2.0)] {
        let glint = Glint { count: 2e5, alpha, gamma_deg, seed: 5, ..Glint::default() };
        let mut renderer = renderer("flakes", glint, false, Some(&sky));
        let each = shown(&mut gpu, &mut renderer, &[]);
        let many = shown(&mut gpu, &mut renderer, &[("most", "0")]);
        let ratio = many.mean()[1] / each.mean()[1];
        println!("alpha {alpha}, gamma {gamma_deg}: {ratio:.4}, over {} pixels", SIZE[0] * SIZE[1]);
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
}
