//! A frame simulates what its scene calls for, and nothing else: which nodes are declared, which tables are made, and what shaders
//! are specialised for. Nothing here touches a device.

mod scenes;
mod table;
mod turns;
