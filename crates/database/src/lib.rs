//! The render database: every picture that another renderer ever rendered is found again, by any later run or process.
//!
//! A [`KeptPool`] stands before the workers of a renderer: it asks a [`Database`] first, renders what is missing, and keeps each
//! picture as it comes. Pictures are found by their content: the key is a hash of all that their pixels depend on
//! ([`Description`]). See `docs/render-database.md`.

mod database;
mod description;
mod entry;
mod error;
mod kept_pool;
mod renewal;
mod upkeep;

pub use database::{Database, Warn};
pub use description::{Description, SceneIdentity, worker_identity};
pub use error::DatabaseError;
pub use kept_pool::{KeptPool, Shown};
pub use upkeep::{Collected, Contents, Group, Verified};
