//! The loader and an instance of our own, with the validation layer where it is asked for.

use crate::error::{Call, Error};
use crate::features::{REQUIREMENTS, Version};
use crate::info::no_driver;
use crate::messages::{Messages, Validation};
use ash::{ext, vk};

const VALIDATION_LAYER: &std::ffi::CStr = c"VK_LAYER_KHRONOS_validation";

/// An instance, destroyed on drop.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    /// Whether `VK_EXT_debug_utils` is enabled.
    pub(crate) debug_utils: bool,
    messenger: Option<Messenger>,
    /// The loaded library; it must outlive every function taken from it.
    _entry: ash::Entry,
}

struct Messenger {
    functions: ext::debug_utils::Instance,
    raw: vk::DebugUtilsMessengerEXT,
    log: Messages,
}

impl Instance {
    /// Opens the loader and creates an instance.
    pub(crate) fn new(validation: Validation) -> Result<Self, Error> {
        let validates = validation != Validation::Off;
        // SAFETY: loading a library runs its initialisers; the Vulkan loader's are harmless.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| Error::NoLoader(error.to_string()))?;
        check_loader(&entry)?;
        // SAFETY: no layer name is passed.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .call("vkEnumerateInstanceExtensionProperties")
            .map_err(no_driver)?;
        let debug_utils = validates
            || extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        if validates {
            check_layer(&entry)?;
        }
        let mut layer_names = Vec::new();
        let mut extension_names = Vec::new();
        if debug_utils {
            extension_names.push(ext::debug_utils::NAME.as_ptr());
        }
        if validates {
            layer_names.push(VALIDATION_LAYER.as_ptr());
            extension_names.push(ext::validation_features::NAME.as_ptr());
        }
        let log = Messages::default();
        let application = vk::ApplicationInfo::default()
            .application_name(c"mica")
            .engine_name(c"mica")
            .api_version(REQUIREMENTS.api_version.packed());
        let mut messenger_info = log.messenger_info();
        let checks = validation.beside_core();
        let mut validation_features = vk::ValidationFeaturesEXT::default().enabled_validation_features(checks);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layer_names)
            .enabled_extension_names(&extension_names);
        if validates {
            info = info.push_next(&mut messenger_info).push_next(&mut validation_features);
        }
        // SAFETY: the chain and the names live until the call returns; `self` keeps the log in it until the instance is destroyed.
        let made = unsafe { entry.create_instance(&info, None) };
        let raw = made.making("vkCreateInstance", "the Vulkan instance", 0).map_err(|error| match error {
            Error::Vulkan {
                result: result @ (vk::Result::ERROR_LAYER_NOT_PRESENT | vk::Result::ERROR_EXTENSION_NOT_PRESENT),
                ..
            } if validates => Error::NoValidation(result.to_string()),
            other => no_driver(other),
        })?;
        let mut instance = Self { raw, debug_utils, messenger: None, _entry: entry };
        if validates {
            let functions = ext::debug_utils::Instance::new(&instance._entry, &instance.raw);
            // SAFETY: the instance has the extension; `self` keeps the log until the messenger is destroyed.
            let raw = unsafe { functions.create_debug_utils_messenger(&log.messenger_info(), None) }
                .call("vkCreateDebugUtilsMessengerEXT")?;
            instance.messenger = Some(Messenger { functions, raw, log });
        }
        Ok(instance)
    }

    /// Where the validation layer's messages go.
    pub(crate) fn messages(&self) -> Messages {
        self.messenger.as_ref().map(|messenger| messenger.log.clone()).unwrap_or_default()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: whoever made something from this instance destroyed it before giving the instance up; the log is
        // dropped after this, when nothing can call back any more.
        unsafe {
            if let Some(messenger) = &self.messenger {
                messenger.functions.destroy_debug_utils_messenger(messenger.raw, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn check_loader(entry: &ash::Entry) -> Result<(), Error> {
    // SAFETY: the entry is loaded.
    let packed = unsafe { entry.try_enumerate_instance_version() }.call("vkEnumerateInstanceVersion")?;
    let version = packed.map_or(Version { major: 1, minor: 0, patch: 0 }, Version::from_packed);
    if version < REQUIREMENTS.api_version {
        return Err(Error::NoLoader(format!(
            "the one found has Vulkan {version}, needed is {}",
            REQUIREMENTS.api_version
        )));
    }
    Ok(())
}

fn check_layer(entry: &ash::Entry) -> Result<(), Error> {
    // SAFETY: the entry is loaded.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.call("vkEnumerateInstanceLayerProperties")?;
    if layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        return Ok(());
    }
    Err(Error::NoValidation(format!("{} is not installed", VALIDATION_LAYER.to_string_lossy())))
}
