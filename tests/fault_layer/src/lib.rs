//! A Vulkan layer that lets calls fail on demand and makes devices poorer than they are.
//!
//! The loader puts it above the driver, so that the program and the library are tested as they are, with no door of their
//! own for tests. [`environment`] is what a process is started with. What is to fail stands in `MICA_FAULTS`, with `;`
//! between items:
//!
//! - `vkAllocateMemory@2=-2`: the call number 2 of this function, counted from 0, returns `VkResult` -2.
//!   `@2+` lets every call from that one on fail.
//! - `maxStorageBufferRange=4096`: a limit of every device; also `timestampValidBits`.
//! - `without=VK_KHR_ray_query`: devices lack this extension or feature.
//! - `largestAllocation=4096`: an allocation of more bytes is out of memory.
//! - `hang=2`: the submission number 2 never begins, and no later one. Waits for it last as long as they may, and those that
//!   may last for ever do. With `hang=2/60` waits last a sixtieth.
//! - `clock=back`, `clock=jump`, `clock=wrap`: timestamps run backwards, jump by years after the first of a frame, or
//!   are those of a counter of 36 bits that wraps just then.
//!
//! A process can also ask for one fault after another: [`ARM`] and [`REPORT`] are functions of the library.

mod calls;
mod chain;
mod faults;
mod moods;
mod poorer;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

pub use faults::{Arm, Report, ReportOf};

/// The layer's name.
pub const LAYER: &str = "VK_LAYER_MICA_faults";

/// The symbol of an [`Arm`] in the library.
pub const ARM: &[u8] = b"mica_faults_arm\0";
/// The symbol of a [`ReportOf`] in the library.
pub const REPORT: &[u8] = b"mica_faults_report\0";

/// The layer's library, which Cargo puts beside the programs of tests.
pub fn library() -> PathBuf {
    let program = std::env::current_exe().expect("the test program has a path");
    let name = format!("{}mica_fault_layer{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    program.with_file_name(name)
}

/// The variables that put the layer, described in a file in `folder`, below the layers named and let `faults` happen.
///
/// # Panics
/// If the file cannot be written.
pub fn environment(folder: &Path, above: &[&str], faults: &str) -> Vec<(&'static str, OsString)> {
    let manifest = format!(
        r#"{{"file_format_version":"1.2.0","layer":{{"name":"{LAYER}","type":"GLOBAL","library_path":{:?},
            "api_version":"1.3.230","implementation_version":"1","description":"Faults on demand","functions":{{
            "vkGetInstanceProcAddr":"mica_faults_get_instance_proc_addr",
            "vkGetDeviceProcAddr":"mica_faults_get_device_proc_addr"}}}}}}"#,
        library()
    );
    std::fs::write(folder.join("mica_faults.json"), manifest).expect("a manifest");
    let layers = [above, &[LAYER]].concat().join(":");
    vec![
        ("VK_ADD_LAYER_PATH", folder.into()),
        ("VK_INSTANCE_LAYERS", layers.into()),
        ("MICA_FAULTS", faults.into()),
        // Mesa's own layer above this one does not survive calls that fail.
        ("NODEVICE_SELECT", "1".into()),
    ]
}
