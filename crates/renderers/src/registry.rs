//! The renderers that come with lookmatch. Another one is a file in `workers/` and a line here.

use crate::InstallationError;

/// A renderer that comes with lookmatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bundled {
    /// What users call it.
    pub name: &'static str,
    /// Name of the worker's file.
    pub file: &'static str,
    /// Its content.
    pub text: &'static str,
}

macro_rules! bundled {
    ($($name:literal: $file:literal,)*) => {
        /// All of them.
        pub const BUNDLED: &[Bundled] =
            &[$(Bundled { name: $name, file: $file, text: include_str!(concat!("../workers/", $file)) }),*];
    };
}

bundled! {
    "mitsuba": "mitsuba.py",
    "cycles": "cycles.py",
    "luxcore": "luxcore.py",
    "radiance": "radiance.py",
    "povray": "povray.py",
    "threejs": "threejs.mjs",
}

/// What workers in Python share.
pub(crate) const SHARED: (&str, &str) =
    ("lookmatch_worker.py", include_str!("../workers/lookmatch_worker.py"));

impl Bundled {
    /// The renderer of a name.
    ///
    /// # Errors
    /// Where there is none; the message lists all.
    pub fn find(name: &str) -> Result<&'static Self, InstallationError> {
        BUNDLED.iter().find(|bundled| bundled.name == name).ok_or_else(|| InstallationError::Unknown {
            name: name.into(),
            known: BUNDLED.iter().map(|bundled| bundled.name).collect::<Vec<_>>().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recipe;

    #[test]
    fn all_recipes_are_read() {
        for bundled in BUNDLED {
            let recipe =
                Recipe::read(bundled.text).unwrap_or_else(|error| panic!("{}: {error}", bundled.file));
            assert!(
                !recipe.details().title.is_empty() && !recipe.details().licence.is_empty(),
                "{}",
                bundled.name
            );
            let is_node = bundled.file.ends_with(".mjs");
            assert_eq!(recipe.requires_node.is_some(), is_node, "{}", bundled.name);
        }
    }

    #[test]
    fn names_are_unique() {
        let names: std::collections::BTreeSet<_> = BUNDLED.iter().map(|bundled| bundled.name).collect();
        assert_eq!(names.len(), BUNDLED.len());
    }

    #[test]
    fn unknown_names_are_answered_with_the_known_ones() {
        assert_eq!(Bundled::find("cycles").unwrap().file, "cycles.py");
        let message = Bundled::find("blender").unwrap_err().to_string();
        assert!(message.contains("'blender'") && message.contains("mitsuba, cycles"), "{message}");
    }
}
