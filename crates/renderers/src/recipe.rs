//! What a worker's file says about its installation: the comment block of PEP 723 that `pip` and `uv` know.
//!
//! ```text
//! # /// script
//! # requires-python = ">=3.9"
//! # dependencies = ["numpy==1.26.4"]
//! # [tool.lookmatch]
//! # title = "My renderer"
//! # licence = "MIT"
//! # about = "One sentence"
//! # debian = ["libgl1"]
//! # pip-options = ["--no-deps"]
//! # ///
//! ```
//!
//! In a JavaScript file the comments begin with `//`, and `requires-node` stands in place of `requires-python`.

use std::fmt;

use serde::Deserialize;

/// How a renderer is installed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Recipe {
    /// Which versions of Python will do, for a worker in Python.
    pub requires_python: Option<Versions>,
    /// Which versions of Node.js will do, for a worker in JavaScript.
    pub requires_node: Option<Versions>,
    /// Packages with their versions, as `pip` or `npm` take them.
    #[serde(default)]
    pub dependencies: Vec<String>,
    tool: Tool,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
struct Tool {
    lookmatch: Details,
}

/// What the block says for lookmatch alone.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Details {
    /// The renderer's name for lists.
    pub title: String,
    /// The renderer's licence, an SPDX expression.
    pub licence: String,
    /// What it is, in a sentence.
    pub about: String,
    /// Packages of the system, by the names that Debian gives them.
    #[serde(default)]
    pub debian: Vec<String>,
    /// Further options for `pip install`.
    #[serde(default)]
    pub pip_options: Vec<String>,
}

impl Recipe {
    /// Reads the block of a worker's file; the error says what is wrong with it.
    pub fn read(text: &str) -> Result<Self, String> {
        let recipe: Self =
            toml::from_str(&block(text)?).map_err(|error| error.to_string().trim_end().to_owned())?;
        if recipe.requires_python.is_some() == recipe.requires_node.is_some() {
            return Err("expected either requires-python or requires-node".into());
        }
        Ok(recipe)
    }

    /// What the block says for lookmatch alone.
    pub fn details(&self) -> &Details {
        &self.tool.lookmatch
    }
}

/// The text between `/// script` and `///`, without the comment signs.
fn block(text: &str) -> Result<String, String> {
    let mut lines = text.lines();
    let sign =
        lines.find_map(|line| line.strip_suffix(" /// script")).filter(|sign| ["#", "//"].contains(sign));
    let sign = sign.ok_or("expected a comment '# /// script' (or '// /// script')")?;
    let mut block = String::new();
    for line in lines {
        let content = line.strip_prefix(sign).ok_or("expected comments up to '///'")?;
        if content == " ///" {
            return Ok(block);
        }
        block.push_str(content.strip_prefix(' ').unwrap_or(content));
        block.push('\n');
    }
    Err("expected '///' at the end of the block".into())
}

/// A set of versions, in the notation of Python's packages: `>=3.9,<3.13`, `==3.11.*`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Versions {
    text: String,
    clauses: Vec<Clause>,
}

#[derive(Clone, Debug, PartialEq)]
struct Clause {
    operator: &'static str,
    version: Vec<u32>,
    /// Whether only the numbers that are given count, as in `3.11.*`.
    is_prefix: bool,
}

/// Longer ones first, so that none is taken for the beginning of another.
const OPERATORS: [&str; 7] = [">=", "<=", "==", "!=", "~=", ">", "<"];

impl TryFrom<String> for Versions {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let clauses = text.split(',').map(|clause| Clause::read(clause.trim()));
        let clauses = clauses.collect::<Option<_>>();
        let clauses =
            clauses.ok_or_else(|| format!("versions are '{text}'; expected such as '>=3.9,<3.13'"))?;
        Ok(Self { text, clauses })
    }
}

impl fmt::Display for Versions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Versions {
    /// True where a version such as `3.11.7` is among them.
    pub fn contain(&self, version: &str) -> bool {
        numbers(version).is_some_and(|version| self.clauses.iter().all(|clause| clause.contains(&version)))
    }
}

impl Clause {
    fn read(text: &str) -> Option<Self> {
        let operator = OPERATORS.into_iter().find(|operator| text.starts_with(operator))?;
        let version = text[operator.len()..].trim();
        let (version, is_prefix) =
            version.strip_suffix(".*").map_or((version, false), |version| (version, true));
        Some(Self { operator, version: numbers(version)?, is_prefix })
    }

    fn contains(&self, version: &[u32]) -> bool {
        let number = |version: &[u32], k: usize| version.get(k).copied().unwrap_or(0);
        let count = if self.is_prefix { self.version.len() } else { self.version.len().max(version.len()) };
        let order = (0..count).map(|k| number(version, k)).cmp((0..count).map(|k| number(&self.version, k)));
        match self.operator {
            ">=" => order.is_ge(),
            "<=" => order.is_le(),
            ">" => order.is_gt(),
            "<" => order.is_lt(),
            "!=" => order.is_ne(),
            // At least this one, and the same but for the last number.
            "~=" => {
                let same = self.version.len().saturating_sub(1);
                order.is_ge() && (0..same).all(|k| number(version, k) == self.version[k])
            }
            _ => order.is_eq(),
        }
    }
}

/// The numbers of `3.11.7`; what follows the first other character does not count (`3.14.0rc1`).
fn numbers(version: &str) -> Option<Vec<u32>> {
    let end = version.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(version.len());
    version[..end].split('.').map(|number| number.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PYTHON: &str = "# SPDX-License-Identifier: MIT\n# /// script\n# requires-python = \">=3.10\"\n#\n\
        # dependencies = [\"a==1\", \"b>=1,<3\"]\n# [tool.lookmatch]\n# title = \"A\"\n# licence = \"MIT\"\n\
        # # why\n# about = \"x\"\n# debian = [\"libgl1\"]\n# pip-options = [\"--no-deps\"]\n# ///\nimport a\n";

    #[test]
    fn blocks_are_read() {
        let recipe = Recipe::read(PYTHON).unwrap();
        assert_eq!(recipe.dependencies, ["a==1", "b>=1,<3"]);
        assert_eq!(recipe.details().debian, ["libgl1"]);
        assert_eq!(recipe.details().pip_options, ["--no-deps"]);
        assert!(recipe.requires_python.unwrap().contain("3.12.1"));
        let node = PYTHON.replace("\n# ", "\n// ").replace("\n#\n", "\n//\n");
        let node = node.replace("requires-python", "requires-node");
        assert!(Recipe::read(&node).unwrap().requires_node.is_some());
    }

    #[test]
    fn faults_are_named() {
        let message = |text: &str| Recipe::read(text).unwrap_err();
        assert!(message("import a\n").contains("expected a comment '# /// script'"));
        assert!(message("# /// script\nimport a\n").contains("expected comments up to"));
        assert!(message("# /// script\n").contains("at the end of the block"));
        assert!(message(&PYTHON.replace(">=3.10", "new")).contains("versions are 'new'; expected such as"));
        assert!(message(&PYTHON.replace("title", "titel")).contains("titel"));
        assert!(message(&PYTHON.replace("requires-python", "requires-pyhton")).contains("pyhton"));
        assert!(
            message(&PYTHON.replace("# requires-python = \">=3.10\"\n", ""))
                .contains("either requires-python")
        );
    }

    #[test]
    fn versions_follow_the_rules_of_python_packages() {
        let contain =
            |versions: &str, version: &str| Versions::try_from(versions.to_owned()).unwrap().contain(version);
        for (versions, inside, outside) in [
            (">=3.9", "3.10.2", "3.8.18"),
            ("==3.11.*", "3.11.7", "3.12.0"),
            (">=3.9, <3.13", "3.12.9", "3.13.0"),
            ("!=3.9.*", "3.10.0", "3.9.1"),
            ("~=3.10", "3.12", "4.0"),
            ("~=3.10.2", "3.10.5", "3.11.0"),
            ("<=3.11", "3.11.0", "3.11.1"),
            (">20", "20.1", "20.0.0"),
            (">=3.14", "3.14.0rc1", "nothing"),
        ] {
            assert!(contain(versions, inside), "{versions}: {inside}");
            assert!(!contain(versions, outside), "{versions}: {outside}");
        }
    }
}
