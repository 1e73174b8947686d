//! Other renderers: worker processes that speak the protocol of `docs/renderer-protocol.md`.
//!
//! A [`Pool`] holds several workers of one renderer and renders [`Job`]s on them. Whatever a worker does (dies, hangs,
//! prints garbage, leaks, renders black), the pool ends it, starts another, repeats the picture once and then reports it
//! as failed; no other picture is lost by it, and no process is left behind.

mod error;
mod hello;
mod pool;
mod process;
mod scene;
mod worker;

pub use error::{Cause, Failure, RendererError};
pub use hello::{Capabilities, Check, Determinism, Hello, Lambert, Light, Mirror, PROTOCOL, Threads};
pub use pool::{Job, Pool, PoolOptions, Stop, Usage};
pub use process::Launch;
pub use worker::Picture;
