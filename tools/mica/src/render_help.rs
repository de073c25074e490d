//! What `mica render --help` says after its options: what files hold, and what those that are read may hold.

use mica_render::scene::{EquirectMap, LoadLimits};

/// Of the files that are written.
pub const SAME_BYTES: &str = "Two runs of the same command give the same bytes in every .exr and .png, so these hold \
    no times: an .exr says scene, method, settings, camera, environment, lights, samples and device in its attributes; \
    times are in the table and in --json.";

/// The same, and the limits of files that are read.
pub fn at_length() -> String {
    let LoadLimits { file_bytes, data_uri_chars, image_side, image_bytes, total_bytes, instances, node_depth } =
        LoadLimits::default();
    let side = EquirectMap::LARGEST_SIDE;
    let lines = [
        SAME_BYTES.to_owned(),
        "\nLimits of files, held before anything is allocated:".to_owned(),
        format!("  scene      {} a file and {} a data URI;", size(file_bytes), size(data_uri_chars)),
        format!("             {} of buffers, vertices, indices and images together;", size(total_bytes)),
        format!("             {instances} placements of meshes; {node_depth} nodes above a node"),
        format!("  images     PNG or JPEG, {image_side} texels a side, {} decoded", size(image_bytes)),
        format!("  --env      OpenEXR or Radiance, {side} x {} texels, {} a file", side / 2, size(EquirectMap::LARGEST_FILE_BYTES)),
        "Regular files alone are read. A scene reaches files in its own folder and below, none through links that leave\n\
         it, and no network. A picture that declares more than its bytes can hold is refused."
            .to_owned(),
    ];
    lines.join("\n")
}

fn size(bytes: u64) -> String {
    match bytes {
        whole if whole.is_multiple_of(1 << 30) => format!("{} GiB", whole >> 30),
        other => format!("{} MiB", other >> 20),
    }
}
