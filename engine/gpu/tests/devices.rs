//! Finding a device, and what is said where there is none.

use crate::common::Checked;
use mica_gpu::{Device, DeviceKind, DeviceOptions, Error, Validation, devices};
use std::process::Command;

#[test]
fn the_device_used_is_one_of_those_listed() {
    let checked = Checked::new();
    let device = checked.device();
    let listed = devices().expect("there is a driver");
    assert!(listed.contains(device.info()), "{listed:?}");
    let info = device.info();
    assert!(!info.driver.is_empty() && !info.driver_version.is_empty() && info.unusable.is_none());
    assert!(info.limits.max_storage_buffer_range_bytes >= 1 << 27 && info.limits.max_push_constants_bytes >= 128);
}

#[test]
fn f44_a_device_is_selected_by_index_or_by_part_of_its_name() {
    let listed = devices().expect("there is a driver");
    let usable = listed.iter().find(|info| info.unusable.is_none()).expect("one is usable");
    let select =
        |select: &str| Device::new(&DeviceOptions { select: Some(select.to_owned()), ..DeviceOptions::default() });
    for name in [usable.index.to_string(), usable.name.clone(), usable.name[..4].to_uppercase()] {
        assert_eq!(select(&name).expect("it is found").info(), usable);
    }
    // Digits within a name or a version are neither an index nor a word, and nothing is no part of anything.
    for number in ["99", ""] {
        let error = select(number).expect_err("there is none");
        assert!(matches!(error, Error::NoSuchDevice { .. }), "{number}: {error}");
    }
    let error = select("no such device").expect_err("there is none");
    assert!(matches!(error, Error::NoSuchDevice { .. }) && error.exit_code() == 3);
    let text = error.to_string();
    assert!(text.contains("no such device") && text.contains(&usable.name), "{text}");
}

#[test]
fn kinds_of_devices_are_ordered_best_first() {
    assert!(DeviceKind::Discrete < DeviceKind::Integrated && DeviceKind::Integrated < DeviceKind::Cpu);
}

/// Run as a child with an environment of its own: prints the error of a new device.
#[test]
#[ignore = "is run in a child process by the tests below"]
fn print_the_error_of_a_new_device() {
    let asked = std::env::var_os("TEST_VALIDATION").is_some();
    let validation = if asked { Validation::Core } else { Validation::Off };
    let error = Device::new(&DeviceOptions { validation, ..DeviceOptions::default() }).expect_err("none can be had");
    println!("exit code {}: {error}", error.exit_code());
}

fn error_with(environment: &[(&str, &std::ffi::OsStr)]) -> String {
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "--ignored", "--nocapture", "devices::print_the_error_of_a_new_device"])
        .envs(environment.iter().copied())
        .output()
        .expect("the child runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    said.lines().find(|line| line.contains("exit code")).expect("the error is one line").to_owned()
}

#[test]
fn f19_without_a_loader_the_package_to_install_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("libvulkan.so.1"), b"not a library").expect("a file");
    let said = error_with(&[("LD_LIBRARY_PATH", folder.path().as_os_str())]);
    assert!(said.contains("exit code 3: no Vulkan loader") && said.contains("install libvulkan1"), "{said}");
}

#[test]
fn f20_without_a_driver_the_package_to_install_is_named() {
    let nowhere = std::ffi::OsStr::new("/nonexistent");
    let said = error_with(&[("VK_DRIVER_FILES", nowhere), ("VK_ICD_FILENAMES", nowhere)]);
    assert!(said.contains("exit code 3: no Vulkan driver") && said.contains("mesa-vulkan-drivers"), "{said}");
}

#[test]
fn f45_without_the_validation_layer_a_device_with_validation_is_refused() {
    let said = error_with(&[
        ("VK_LAYER_PATH", std::ffi::OsStr::new("/nonexistent")),
        ("TEST_VALIDATION", std::ffi::OsStr::new("1")),
    ]);
    assert!(said.contains("exit code 3") && said.contains("install vulkan-validationlayers"), "{said}");
}
