//! Which way things face: the turned environment, mirrored instances, tangent space, sets of texture coordinates, and
//! the two sides of a surface.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use mica_render::scene::{
    AlphaMode, Encoding, EquirectMap, Glint, Light, Material, Mesh, Scene, Texture, TextureRef, Wrap,
};
use mica_render::{Environment, OcclusionBackend, Renderer};
use mica_tests::shapes::{BEFORE_SPHERE, Eye, OVER_PLANE, conductor, plane, sphere};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [96, 54];
/// The mirror image of [`OVER_PLANE`]: it sees nothing but the lower side.
const UNDER_PLANE: Eye = Eye { eye: DVec3::new(0.0, -2.0, 3.0), ..OVER_PLANE };

/// A dim sky with one bright patch, above the horizon and in no direction of symmetry.
fn patch(width: u32) -> EquirectMap {
    let height = width / 2;
    let center = EquirectMap::direction_from_uv([0.32, 0.38]);
    let texels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row))).map(|(column, row)| {
        let uv = [(f64::from(column) + 0.5) / f64::from(width), (f64::from(row) + 0.5) / f64::from(height)];
        let bright = (8.0 * (EquirectMap::direction_from_uv(uv).dot(center) - 1.0)).exp() as f32;
        [0.1 + bright, 0.1 + 0.5 * bright, 0.15]
    });
    EquirectMap { width, height, texels: texels.collect() }
}

/// The map with its texels moved to the left by so many columns, around the horizon.
fn moved_left(map: &EquirectMap, columns: u32) -> EquirectMap {
    let mut moved = map.clone();
    moved.texels.chunks_exact_mut(map.width as usize).for_each(|row| row.rotate_left(columns as usize));
    moved
}

/// Turned counter-clockwise seen from above, what lies ahead (-Z, the middle of the map) comes to lie on the left (-X,
/// its left quarter). Catches the wrong sign, sine for cosine, and a method or a background that is not turned.
///
/// The columns are multiples of what the tables are made of, so that both pictures come from the same numbers; of the
/// smooth lobe they do not, as the directions drawn for its table do not turn with the normal.
#[test]
fn a_turned_environment_is_a_map_with_its_columns_moved() {
    let mut gpu = Gpu::new();
    for (method, width, columns, tolerance) in [("smooth", 64, 16, 0.01), ("wang2020", 60, 11, 1e-3)] {
        let map = patch(width);
        let mut shown = |map: &EquirectMap, rotation_radians: f64| {
            let glint = Glint { count: 1e12, alpha: 0.3, gamma_deg: 4.0, color: Some([1.0; 3]), ..Glint::default() };
            let environment = Environment { map: map.clone(), rotation_radians };
            let scene = sphere(Material { metallic: 0.0, ..conductor(method, glint) }, 64);
            let mut renderer =
                Renderer::new(scene, &[], Some(&environment), OcclusionBackend::None).expect("the scene is sound");
            if method == "wang2020" {
                for (key, value) in [("samples", "16"), ("depth", "2")] {
                    renderer.set(None, key, value).expect("a setting");
                }
            }
            gpu.precompute(&mut renderer);
            gpu.render(&mut renderer, &BEFORE_SPHERE.view(SIZE)).picture
        };
        let angle = std::f64::consts::TAU * f64::from(columns) / f64::from(width);
        let moved = shown(&moved_left(&map, columns), 0.0);
        let [turned, against] = [angle, -angle].map(|angle| shown(&map, angle));
        let apart = moved.apart(&turned, tolerance).len();
        println!("{method}: {apart} pixels apart, {} the wrong way", moved.apart(&against, tolerance).len());
        assert_eq!(apart, 0, "{method}");
        let hits = moved.hits();
        for (what, hit) in [("sphere", true), ("sky", false)] {
            let wrong = moved.apart(&against, 0.05).into_iter().filter(|pixel| hits[*pixel] == hit).count();
            let all = hits.iter().filter(|other| **other == hit).count();
            assert!(wrong * 10 > all, "{method}: the other way must show on the {what}: {wrong} of {all} pixels");
        }
    }
}

/// A square texture, from what each place in it holds.
fn texture(encoding: Encoding, side: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let pixels = (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y));
    Texture {
        name: "test".to_owned(),
        width: side,
        height: side,
        pixels: pixels.collect(),
        encoding,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
    }
}

fn texture_of_set(uv_set: u32) -> TextureRef {
    TextureRef { texture: 0, uv_set, transform: TextureRef::IDENTITY }
}

/// The unit sphere, bumpy and grey, with a hole through which its inner side is in view.
fn open_sphere(double_sided: bool) -> Scene {
    let material = Material {
        base_color: [0.5, 0.5, 0.5, 1.0],
        metallic: 0.0,
        roughness: 0.5,
        normal_texture: Some(texture_of_set(0)),
        double_sided,
        ..Material::default()
    };
    let mut scene = sphere(material, 64);
    // The same bump everywhere: to the right and, less, upwards.
    scene.textures.push(texture(Encoding::Normal, 1, |_, _| [180, 150, 230, 255]));
    let mesh = &mut scene.meshes[0];
    let azimuths = mesh.uv[0].iter().map(|[u, _]| f64::from(*u) * std::f64::consts::TAU);
    // Towards +u; the other side of the frame points upwards, which is towards -v.
    mesh.tangents = azimuths.map(|azimuth| [azimuth.cos() as f32, 0.0, -azimuth.sin() as f32, 1.0]).collect();
    let uv = &mesh.uv[0];
    let kept = mesh.indices.chunks_exact(3).filter(|triangle| {
        let [u, v] = [0, 1].map(|axis| triangle.iter().map(|index| uv[*index as usize][axis]).sum::<f32>() / 3.0);
        !((0.05..0.3).contains(&u) && (0.2..0.7).contains(&v))
    });
    mesh.indices = kept.flatten().copied().collect();
    scene
}

/// The mesh that an instance with this transform has to place to look like `world` does as it is.
fn as_seen_from(world: &Mesh, world_from_local: DMat3) -> Mesh {
    let local_from_world = world_from_local.inverse();
    let moved = |by: DMat3, vector: [f32; 3]| by * Vec3::from(vector).as_dvec3();
    let mut mesh = world.clone();
    for position in &mut mesh.positions {
        *position = moved(local_from_world, *position).as_vec3().to_array();
    }
    for normal in &mut mesh.normals {
        *normal = moved(world_from_local.transpose(), *normal).normalize().as_vec3().to_array();
    }
    let mirrors = world_from_local.determinant() < 0.0;
    for tangent in &mut mesh.tangents {
        let [x, y, z, handedness] = *tangent;
        let [x, y, z] = moved(local_from_world, [x, y, z]).normalize().as_vec3().to_array();
        *tangent = [x, y, z, if mirrors { -handedness } else { handedness }];
    }
    if mirrors {
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
    mesh
}

/// Catches normals carried as if they were directions, normals and tangent frames that turn inside out in a mirror,
/// front and back taken for each other there, and rays that leave on the wrong side.
#[test]
fn a_placed_mesh_looks_like_the_mesh_it_stands_for() {
    let mut gpu = Gpu::new();
    let environment = Environment { map: patch(64), rotation_radians: 0.3 };
    let lamp = Light::Point { position: DVec3::new(2.0, 2.5, 1.5), radiant_intensity: [12.0, 8.0, 4.0], range: None };
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let through_the_origin = DMat3::from_diagonal(DVec3::NEG_ONE);
    let stretch = DMat3::from_diagonal(DVec3::new(2.0, 0.5, 1.25));
    let mut plain = Vec::new();
    for double_sided in [false, true] {
        let scene = open_sphere(double_sided);
        let mut shown = |scene: Scene| {
            let mut renderer =
                Renderer::new(scene, &[lamp], Some(&environment), OcclusionBackend::Bvh).expect("the scene is sound");
            gpu.render(&mut renderer, &BEFORE_SPHERE.view(SIZE)).picture
        };
        let expected = shown(scene.clone());
        for (name, world_from_local) in [
            ("mirrored", mirror),
            ("mirrored through a point", through_the_origin),
            ("turned and stretched", stretch * turn),
            ("turned, stretched and mirrored", stretch * turn * mirror),
        ] {
            let mut placed = scene.clone();
            placed.meshes[0] = as_seen_from(&scene.meshes[0], world_from_local);
            placed.instances[0].world_from_local = DAffine3::from_mat3(world_from_local);
            let apart = shown(placed).apart(&expected, 0.01).len();
            println!("{name}, double-sided {double_sided}: {apart} pixels apart");
            // Rounding moves the silhouette and the edge of the shadow by a pixel here and there.
            assert!(apart <= 8, "{name}, double-sided {double_sided}: {apart} pixels differ");
        }
        plain.push(expected);
    }
    let hits = plain[0].hits();
    let inside: Vec<usize> = (0..hits.len()).filter(|pixel| !hits[*pixel] && plain[1].hits()[*pixel]).collect();
    assert!(hits.iter().filter(|hit| **hit).count() > 500 && inside.len() > 50, "both sides are in view");
}

/// The plane whose texture coordinates are x and z times these signs, with the tangents that go with them.
fn plane_with_uv_signs(material: Material, signs: [f32; 2]) -> Scene {
    let mut scene = plane(material, 40.0);
    let mesh = &mut scene.meshes[0];
    mesh.uv[0].iter_mut().for_each(|[u, v]| (*u, *v) = (*u * signs[0], *v * signs[1]));
    // Along +u; handedness * cross(+Y, tangent) is along -v.
    mesh.tangents = vec![[signs[0], 0.0, 0.0, signs[0] * signs[1]]; 4];
    scene
}

/// Red leans towards +u and green towards -v (glTF: green up), whichever way the texture lies on the surface: the
/// picture is that of a plane with such normals at its vertices. Catches green taken downwards, a handedness that is
/// ignored or applied to the tangent, and a scale that is applied to z.
#[test]
fn mapped_normals_lean_along_the_texture() {
    let mut gpu = Gpu::new();
    let matte = Material { metallic: 0.0, base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() };
    let mut shown = |scene: Scene, from: DVec3| {
        let light = Light::Directional { direction: -from, irradiance: [3.0; 3] };
        let mut renderer = Renderer::new(scene, &[light], None, OcclusionBackend::None).expect("the scene is sound");
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    };
    let decoded = |byte: u8| f32::from(byte) / 255.0 * 2.0 - 1.0;
    for signs in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0f32]] {
        for (red, green, normal_scale) in [(191, 128, 1.0), (128, 191, 1.0), (160, 191, 0.5)] {
            let texel = [red, green, 238, 255];
            let mapped = Material { normal_texture: Some(texture_of_set(0)), normal_scale, ..matte.clone() };
            let mut mapped = plane_with_uv_signs(mapped, signs);
            mapped.textures.push(texture(Encoding::Normal, 1, |_, _| texel));
            let along_x = signs[0] * normal_scale * decoded(red);
            let along_z = -signs[1] * normal_scale * decoded(green);
            let normal = Vec3::new(along_x, decoded(238), along_z).normalize();
            let mut leaning = plane(matte.clone(), 40.0);
            leaning.meshes[0].normals = vec![normal.to_array(); 4];

            let case = format!("texture coordinates {signs:?}, texel {texel:?}");
            let lean = DVec3::new(f64::from(normal.x), 0.0, f64::from(normal.z)).normalize();
            let [towards, away] = [lean, -lean].map(|side| {
                let from = (side + DVec3::Y).normalize();
                let picture = shown(mapped.clone(), from);
                let apart = picture.apart(&shown(leaning.clone(), from), 1e-3).len();
                assert_eq!(apart, 0, "{case}, light from {from}");
                picture.mean()[1]
            });
            assert!(towards > 1.3 * away, "{case}: {towards} lit from where it leans, {away} from the other side");
        }
    }
}

/// The plane with the coordinates of [`plane`] in one set; in the other, if it is not to stay empty, others.
fn plane_with_sets(material: Material, uv_set: u32, decoy: bool) -> Scene {
    let mut scene = plane(material, 40.0);
    let mesh = &mut scene.meshes[0];
    let real = std::mem::take(&mut mesh.uv[0]);
    if decoy {
        mesh.uv[1 - uv_set as usize] = real.iter().map(|[u, v]| [0.7 * v + 0.2, 1.3 * u]).collect();
    }
    mesh.uv[uv_set as usize] = real;
    scene
}

/// Textures, the holes that they cut and flakes lie in the set of texture coordinates that the material names. Catches
/// the first set used for all, and derivatives of one set with coordinates of the other.
#[test]
fn textures_and_flakes_lie_in_the_set_they_name() {
    let mut gpu = Gpu::new();
    let light = Light::Directional { direction: DVec3::new(0.0, -1.0, -1.0).normalize(), irradiance: [3.0; 3] };
    let textured = |uv_set: u32| Material {
        metallic: 0.0,
        base_color_texture: Some(texture_of_set(uv_set)),
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        ..Material::default()
    };
    let glinting = |uv_set: u32| {
        let glint = Glint { count: 3e3, alpha: 0.5, gamma_deg: 8.0, uv_set, ..Glint::default() };
        Material { base_color: [1.0; 4], ..conductor("wang2020", glint) }
    };
    let mut shown = |scene: Scene| {
        let glints = scene.materials[0].glint.is_some();
        let mut renderer = Renderer::new(scene, &[light], None, OcclusionBackend::None).expect("the scene is sound");
        if glints {
            for (key, value) in [("depth", "8"), ("blur", "off")] {
                renderer.set(None, key, value).expect("a setting");
            }
            gpu.precompute(&mut renderer);
        }
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    };
    let materials: [(&str, &dyn Fn(u32) -> Material); 2] = [("texture", &textured), ("flakes", &glinting)];
    for (what, material) in materials {
        let with_texture = |scene: Scene| Scene {
            textures: vec![texture(Encoding::Srgb, 64, |x, y| {
                [4 * x as u8, 4 * y as u8, 99, if x / 8 == y / 8 { 0 } else { 255 }]
            })],
            ..scene
        };
        let alone = shown(with_texture(plane_with_sets(material(0), 0, false)));
        let first = shown(with_texture(plane_with_sets(material(0), 0, true)));
        let second = shown(with_texture(plane_with_sets(material(1), 1, true)));
        // The sets are those of `second`, but the material names the other one.
        let other = shown(with_texture(plane_with_sets(material(0), 1, true)));
        assert_eq!(alone.differing(&first).len(), 0, "{what}: a second set changes nothing");
        assert_eq!(alone.differing(&second).len(), 0, "{what} in the second set");
        println!("{what}: {} pixels differ between the sets, mean {:?}", alone.differing(&other).len(), alone.mean());
        assert!(alone.differing(&other).len() * 4 > alone.pixels.len(), "{what}: the sets differ");
        assert!(alone.variance() > 0.0, "{what}");
    }
}

/// The plane turned over: what is seen from below of it is its front.
fn facing_down(mut scene: Scene) -> Scene {
    let mesh = &mut scene.meshes[0];
    mesh.normals = vec![[0.0, -1.0, 0.0]; 4];
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    scene
}

/// Catches a back that is shaded with the front's normal, and front and back taken for each other in a mirror.
#[test]
fn a_back_face_is_seen_if_double_sided_and_then_as_a_front() {
    let mut gpu = Gpu::new();
    let material = |double_sided: bool| {
        let glint = Glint { count: 1e6, alpha: 0.5, color: Some([0.9, 0.6, 0.3]), ..Glint::default() };
        Material { base_color: [0.5, 0.5, 0.5, 1.0], metallic: 0.0, double_sided, ..conductor("smooth", glint) }
    };
    let lamp_at =
        |y: f64| Light::Point { position: DVec3::new(0.4, y, -1.0), radiant_intensity: [5.0; 3], range: None };
    let mut shown = |scene: Scene, eye: Eye, lamp: Light| -> Picture {
        let mut renderer = Renderer::new(scene, &[lamp], None, OcclusionBackend::Bvh).expect("the scene is sound");
        gpu.render(&mut renderer, &eye.view(SIZE)).picture
    };
    let (above, below) = (lamp_at(1.2), lamp_at(-1.2));
    for mirrors in [false, true] {
        let placed = |double_sided: bool| {
            let mut scene = plane(material(double_sided), 40.0);
            if mirrors {
                // It looks the same.
                scene.instances[0].world_from_local = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
            }
            scene
        };
        let case = format!("mirrored {mirrors}");
        let hits = |picture: &Picture| picture.hits().into_iter().filter(|hit| *hit).count();
        let all = (SIZE[0] * SIZE[1]) as usize;
        assert_eq!(hits(&shown(placed(false), OVER_PLANE, above)), all, "{case}: the front is seen");
        assert_eq!(hits(&shown(placed(false), UNDER_PLANE, below)), 0, "{case}: the back is not");

        let back = shown(placed(true), UNDER_PLANE, below);
        let front = shown(facing_down(plane(material(false), 40.0)), UNDER_PLANE, below);
        assert!(front.mean()[1] > 0.05, "{case}: {:?}", front.mean());
        assert_eq!(back.apart(&front, 1e-4).len(), 0, "{case}: a back looks like a front");
        let dark = shown(placed(true), UNDER_PLANE, above);
        assert_eq!(hits(&dark), all, "{case}: a double-sided back is seen");
        assert_eq!(dark.mean(), [0.0; 3], "{case}: light from behind does not come through");
        let front = shown(placed(true), OVER_PLANE, above);
        let single = shown(placed(false), OVER_PLANE, above);
        assert_eq!(front.differing(&single).len(), 0, "{case}: the front of both kinds is the same");
    }
}
