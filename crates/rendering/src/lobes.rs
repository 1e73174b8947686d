//! Lobes on their way to pictures: what does not depend on scene or light, worked out once for all.

use lookmatch_materials::Bsdf;
use rayon::prelude::*;

use crate::bounce::BounceLobe;
use crate::lobe_table::LobeTable;

/// The specular lobes of some materials, ready for any prepared scene.
pub struct Lobes<'a> {
    pub(crate) bsdfs: Vec<&'a dyn Bsdf>,
    /// For each of the materials, its lobe in the basis of the rings; `None` where it has none.
    pub(crate) expanded: Vec<Option<Expanded>>,
}

/// A lobe in the basis of the rings.
pub(crate) struct Expanded {
    pub(crate) table: LobeTable,
    pub(crate) bounce: BounceLobe,
}

impl<'a> Lobes<'a> {
    /// Expands lobes, on all cores.
    pub fn new(bsdfs: &[&'a dyn Bsdf]) -> Self {
        let expanded = |bsdf: &&dyn Bsdf| {
            bsdf.sampling()?;
            let table = LobeTable::new(*bsdf);
            Some(Expanded { bounce: BounceLobe::new(&table), table })
        };
        Self { expanded: bsdfs.par_iter().map(expanded).collect(), bsdfs: bsdfs.to_vec() }
    }

    /// The same materials as if none had a lobe.
    pub(crate) fn without_lobes(bsdfs: &[&'a dyn Bsdf]) -> Self {
        Self { expanded: bsdfs.iter().map(|_| None).collect(), bsdfs: bsdfs.to_vec() }
    }
}
