//! Which points a study has: places, and methods with the rungs of their ladders, in an order that never changes.

use super::place::Lighting;
use mica_render::{EMBEDDED_SCENES, MethodInfo, Rung};
use std::path::PathBuf;

/// Scenes of a quick study: many flakes of little roughness and wide cones, and few of the opposite.
const QUICK_SCENES: [&str; 2] = ["shoe", "cloth"];

/// Rungs that a quick study goes without, as their frames or tables take seconds on a processor.
const SLOW: [(&str, &[&str]); 4] = [
    ("jakob", &["epsilon .5", "epsilon .02", "epsilon 0"]),
    ("atanasov", &["100 enumerated"]),
    ("wang2018", &["depth 8"]),
    ("wang2020", &["samples 1024"]),
];

/// A place to be opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// An embedded scene or a file.
    pub scene: PathBuf,
    /// Pixels along x and y.
    pub size: [u32; 2],
    /// Which of its lights shine.
    pub lighting: Lighting,
}

/// The scenes where none are named.
pub fn scenes(quick: bool) -> Vec<PathBuf> {
    if quick {
        return QUICK_SCENES.iter().map(PathBuf::from).collect();
    }
    EMBEDDED_SCENES.iter().filter(|scene| !scene.is_large()).map(|scene| PathBuf::from(scene.name)).collect()
}

/// All places, scene by scene.
pub fn stops(scenes: &[PathBuf], sizes: &[[u32; 2]], lightings: &[Lighting]) -> Vec<Stop> {
    let mut stops: Vec<Stop> = Vec::new();
    for scene in scenes {
        for size in sizes {
            for lighting in lightings {
                let stop = Stop { scene: scene.clone(), size: *size, lighting: *lighting };
                if !stops.contains(&stop) {
                    stops.push(stop);
                }
            }
        }
    }
    stops
}

/// All methods with their rungs, from cheap to dear.
pub fn rungs(methods: &[&'static MethodInfo], quick: bool) -> Vec<(&'static MethodInfo, &'static Rung)> {
    let is_slow = |method: &MethodInfo, rung: &Rung| {
        SLOW.iter().any(|(name, rungs)| *name == method.name && rungs.contains(&rung.name))
    };
    let mut all: Vec<(&'static MethodInfo, &'static Rung)> = Vec::new();
    for method in methods {
        for rung in method.ladder.iter().filter(|rung| !(quick && is_slow(method, rung))) {
            if !all.contains(&(*method, rung)) {
                all.push((*method, rung));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_render::METHODS;

    #[test]
    fn a_quick_study_has_every_method_and_leaves_out_what_it_names() {
        let methods: Vec<&MethodInfo> = METHODS.iter().collect();
        let (quick, full) = (rungs(&methods, true), rungs(&methods, false));
        assert!(METHODS.iter().all(|method| quick.iter().any(|(of, _)| of.name == method.name)));
        let left_out: usize = SLOW.iter().map(|(_, rungs)| rungs.len()).sum();
        assert_eq!(full.len() - quick.len(), left_out, "each rung that is left out exists");
        assert_eq!(full.len(), METHODS.iter().map(|method| method.ladder.len()).sum::<usize>());
    }

    #[test]
    fn what_is_named_twice_is_measured_once() {
        let scenes = ["shoe", "plane", "shoe"].map(PathBuf::from);
        let stops = stops(&scenes, &[[8, 8], [9, 9]], &[Lighting::Own, Lighting::Lights, Lighting::Own]);
        assert_eq!(stops.len(), 2 * 2 * 2);
        let smooth = &METHODS[0];
        assert_eq!(rungs(&[smooth, smooth], false).len(), smooth.ladder.len());
    }
}
