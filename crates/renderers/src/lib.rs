//! Other renderers: worker processes that speak the protocol of `docs/renderer-protocol.md`.
//!
//! A [`Pool`] holds several workers of one renderer and renders [`Job`]s on them. Whatever a worker does (dies, hangs,
//! prints garbage, leaks, renders black), the pool ends it, starts another, repeats the picture once and then reports it
//! as failed; no other picture is lost by it, and no process is left behind.
//!
//! [`check()`] says what a worker gets wrong.
//!
//! Those that come with lookmatch ([`BUNDLED`]) are installed by [`Installations`], each in an environment of its own, and
//! started from there.

mod check;
mod command;
mod debian;
mod error;
mod hello;
mod installation;
mod pool;
mod process;
mod recipe;
mod registry;
mod scene;
mod worker;

pub use check::{CHECK_NAMES, CheckOptions, CheckReport, Finding, Limit, Number, Outcome, Sheet, check};
pub use error::{Cause, Failure, RendererError};
pub use hello::{Capabilities, Check, Determinism, Hello, Lambert, Light, Mirror, PROTOCOL, Threads};
pub use installation::{InstallationError, Installations, State};
pub use pool::{Job, Pool, PoolOptions, Stop, Usage};
pub use process::Launch;
pub use recipe::{Details, Recipe, Versions};
pub use registry::{BUNDLED, Bundled};
pub use worker::Picture;
