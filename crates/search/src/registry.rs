//! The search methods by name. Adding one takes a file of its own and a line here.

use crate::{CmaEs, Exhaustive, Genetic, Search, SearchError, Survey, Synthesis};

/// One search method in the registry.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The name given to [`by_name`].
    pub name: &'static str,
    /// One sentence for a list of methods.
    pub about: &'static str,
    /// Makes the method with its default settings.
    pub make: fn() -> Box<dyn Search>,
}

#[rustfmt::skip] // one line per method
static REGISTRY: [Entry; 8] = [
    Entry { name: "genetic", about: "integer genetic algorithm with a final lattice descent (default)", make: || Box::new(Genetic::default()) },
    Entry { name: "genetic-guarnera2018", about: "the genetic algorithm as Guarnera et al. 2018 describe it", make: || Box::new(Genetic::guarnera2018()) },
    Entry { name: "genetic-deep2009", about: "MI-LXPM as Deep et al. 2009 describe it", make: || Box::new(Genetic::deep2009()) },
    Entry { name: "survey", about: "few evaluations: evenly spread points, then a compass search (default for models of other renderers)", make: || Box::new(Survey::default()) },
    Entry { name: "synthesis", about: "fewest renders: candidates come from synthesised pictures, and are verified by real ones", make: || Box::new(Synthesis::default()) },
    Entry { name: "synthesis-half-rate", about: "synthesis from every second level of each axis, as Guarnera et al. 2018 describe it", make: || Box::new(Synthesis::half_rate()) },
    Entry { name: "cma-es", about: "covariance matrix adaptation (Hansen 2016) with a final lattice descent", make: || Box::new(CmaEs::default()) },
    Entry { name: "exhaustive", about: "every point within bounds: the ground truth", make: || Box::new(Exhaustive::default()) },
];

/// All search methods, the default first.
pub fn registry() -> &'static [Entry] {
    &REGISTRY
}

/// The search method of this name with its default settings.
///
/// # Errors
/// [`SearchError::Unknown`], which names the most similar valid name.
pub fn by_name(name: &str) -> Result<Box<dyn Search>, SearchError> {
    if let Some(entry) = REGISTRY.iter().find(|entry| entry.name == name) {
        return Ok((entry.make)());
    }
    let likeness = |entry: &&Entry| strsim::jaro_winkler(entry.name, name);
    let nearest = REGISTRY.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    Err(SearchError::Unknown { name: name.to_owned(), nearest: nearest.map_or("", |entry| entry.name) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_their_methods() {
        for entry in registry() {
            let search = by_name(entry.name).expect("a registered name");
            assert_eq!(search.name(), entry.name);
        }
    }

    #[test]
    fn a_misspelt_name_gets_a_suggestion() {
        let error = by_name("exaustive").err().expect("an unknown name");
        assert!(error.to_string().contains("\"exhaustive\""), "{error}");
        assert!(by_name("").is_err());
    }
}
