//! Which build of the program this is.

/// Version and commit; the commit is `unknown` where the program was not built in a checkout.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("MICA_COMMIT"), ")");
