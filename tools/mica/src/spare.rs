//! A second device in the place of one that was lost: what caused the loss is often over with it.

use crate::error::Failure;

/// The one device more that a command may make.
#[derive(Debug, Default)]
pub struct Spare {
    used: bool,
}

impl Spare {
    /// Whether to do what failed once more, on a new device: if a device was lost, and none before it. Says so.
    pub fn serves(&mut self, failure: &Failure) -> bool {
        let serves = failure.device_lost && !self.used;
        if serves {
            self.used = true;
            log::warn!("{failure}; what was under way is done once more, on a new device");
        }
        serves
    }
}

#[cfg(test)]
mod tests {
    use super::Spare;
    use crate::error::Failure;

    #[test]
    fn f25_one_lost_device_is_replaced_and_nothing_else_is_tried_again() {
        let lost = Failure::from(mica_gpu::Error::DeviceLost { pass: None });
        let hung = Failure::from(mica_gpu::Error::Timeout { seconds: 1.0, pass: None });
        let mut spare = Spare::default();
        assert!(!spare.serves(&hung) && !spare.serves(&Failure::bad_input("no")));
        assert!(spare.serves(&lost));
        assert!(!spare.serves(&lost));
    }
}
