//! remap
