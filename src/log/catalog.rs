//! The messages that the simulator writes, as the firmware defines them.
