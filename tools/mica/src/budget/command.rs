//! The command line that shows a view again, with the method and settings that were chosen for it.

use crate::args::{CameraChoice, DeviceArgs, SceneArgs};
use crate::study::shell_word;
use clap::ValueEnum;
use glam::DVec3;
use mica_accuracy::Point;
use mica_render::scene::Light;

/// The command that renders a point.
pub fn command(args: &SceneArgs, point: &Point) -> String {
    let scene = shell_word(&args.scene.display().to_string());
    let set: String = point.set.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
    format!("mica render {scene}{} --method {}{set}", options(args), point.method)
}

/// The options that decide what is seen, but for the method.
pub fn options(args: &SceneArgs) -> String {
    let SceneArgs {
        scene: _,
        size: [width, height],
        method: _,
        set,
        glint,
        env,
        env_rotate,
        light,
        no_lights,
        camera,
        exposure,
        occlusion,
        device: DeviceArgs { device, memory: _, validation: _, cache: _, no_cache: _ },
    } = args;
    let mut words = vec![format!("--size {width}x{height}")];
    words.extend(set.iter().map(|change| format!("--set {}", shell_word(&change.to_string()))));
    words.extend(glint.iter().map(|change| format!("--glint {}", shell_word(&change.to_string()))));
    words.extend(env.iter().map(|env| format!("--env {}", shell_word(&env.display().to_string()))));
    words.extend((*env_rotate != 0.0).then(|| format!("--env-rotate {env_rotate}")));
    words.extend(light.iter().filter_map(self::light).map(|light| format!("--light {light}")));
    words.extend(no_lights.then(|| "--no-lights".to_owned()));
    words.extend(camera.iter().map(|CameraChoice { eye, target, vertical_fov_deg }| {
        format!("--camera {}:{}:{vertical_fov_deg}", numbers(*eye), numbers(*target))
    }));
    words.extend((*exposure != 0.0).then(|| format!("--exposure {exposure}")));
    let backend = occlusion.to_possible_value().filter(|value| value.get_name() != "auto");
    words.extend(backend.map(|value| format!("--occlusion {}", value.get_name())));
    words.extend(device.iter().map(|device| format!("--device {}", shell_word(device))));
    words.into_iter().map(|word| format!(" {word}")).collect()
}

/// A light as it is typed; others than these cannot be.
fn light(light: &Light) -> Option<String> {
    let of = |kind: &str, place: DVec3, [r, g, b]: [f32; 3]| Some(format!("{kind}:{},{r},{g},{b}", numbers(place)));
    match *light {
        Light::Point { position, radiant_intensity, range: None } => of("point", position, radiant_intensity),
        Light::Directional { direction, irradiance } => of("dir", direction, irradiance),
        _ => None,
    }
}

fn numbers(DVec3 { x, y, z }: DVec3) -> String {
    format!("{x},{y},{z}")
}

#[cfg(test)]
mod tests {
    use super::options;
    use crate::args::{Cli, Command, SceneArgs};
    use clap::Parser;

    fn parsed(words: &[&str]) -> SceneArgs {
        let cli = Cli::try_parse_from([&["mica", "render"], words].concat()).expect("a command line");
        match cli.command {
            Command::Render(args) => args.scene,
            _ => panic!("another command"),
        }
    }

    #[test]
    fn options_say_what_was_typed() {
        let all = [
            "plane",
            "--size",
            "40x30",
            "--set",
            "count=1e5",
            "--glint",
            "my leather:alpha=0.3",
            "--env",
            "a b.exr",
            "--env-rotate",
            "-30",
            "--light",
            "point:1,2,3.5,4,5,6",
            "--light",
            "dir:0,-1,0,3,3,0.1",
            "--no-lights",
            "--camera",
            "-1,2,3:0,0.1,0:40",
            "--exposure",
            "-1.5",
            "--occlusion",
            "ray-query",
            "--device",
            "llvm",
        ];
        let text = options(&parsed(&all));
        assert_eq!(
            text,
            " --size 40x30 --set count=1e5 --glint 'my leather:alpha=0.3' --env 'a b.exr' --env-rotate -30 --light \
             point:1,2,3.5,4,5,6 --light dir:0,-1,0,3,3,0.1 --no-lights --camera -1,2,3:0,0.1,0:40 --exposure -1.5 \
             --occlusion ray-query --device llvm"
        );
        let plain = text.replace("'my leather:alpha=0.3'", "leather:alpha=0.3").replace("'a b.exr'", "a.exr");
        let again: Vec<&str> = ["plane"].into_iter().chain(plain.split_whitespace()).collect();
        assert_eq!(options(&parsed(&again)), plain, "what is printed can be typed");
        assert_eq!(options(&parsed(&["plane"])), " --size 1280x720");
    }
}
