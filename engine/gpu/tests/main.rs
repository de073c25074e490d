//! Frames on a real device, under validation and synchronisation validation: any message fails the test that caused it.

mod common;

mod canaries;
mod compute;
mod devices;
mod faults;
mod guest;
mod memory;
mod pipelines;
mod random;
mod raster;
mod structures;
mod timing;
mod transfers;
