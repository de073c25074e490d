//! `--occlusion`: who answers whether something lies between two points, on the device that there is.

use crate::args::OcclusionChoice;
use crate::error::{Failure, NO_DEVICE};
use mica_gpu::DeviceInfo;
use mica_render::OcclusionBackend;

/// Who answers, and why.
pub struct ChosenOcclusion {
    /// Who.
    pub backend: OcclusionBackend,
    /// Why.
    pub why: String,
}

/// Takes what was asked for, or what suits the device and a scene of so many triangles.
pub fn choose(choice: OcclusionChoice, device: &DeviceInfo, triangles: u64) -> Result<ChosenOcclusion, Failure> {
    let backend = match choice {
        OcclusionChoice::Auto => {
            let (backend, why) = OcclusionBackend::auto(device, triangles);
            return Ok(ChosenOcclusion { backend, why });
        }
        OcclusionChoice::RayQuery if !device.offers_ray_query() => {
            return Err(Failure::with_code(
                NO_DEVICE,
                format!(
                    "--occlusion ray-query: {} (driver {} {}) lacks {}; use bvh, which runs on every device, or name another \
                     device of `mica doctor` with --device",
                    device.name,
                    device.driver,
                    device.driver_version,
                    device.ray_query_lacks.join(", ")
                ),
            ));
        }
        OcclusionChoice::RayQuery => OcclusionBackend::RayQuery,
        OcclusionChoice::Bvh => OcclusionBackend::Bvh,
        OcclusionChoice::None => OcclusionBackend::None,
    };
    Ok(ChosenOcclusion { backend, why: format!("--occlusion {} asks for it", backend.name()) })
}
