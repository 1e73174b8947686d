//! Materials on their way to pictures: what does not depend on scene or light, worked out once for all.

use std::collections::HashMap;

use lookmatch_materials::{Bsdf, Material};
use rayon::prelude::*;

use crate::bounce::BounceLobe;
use crate::lobe_table::LobeTable;

/// Some materials, ready for any prepared scene.
pub struct Lobes {
    pub(crate) bsdfs: Vec<Box<dyn Bsdf>>,
    /// For each of them, what it has beside its Lambert term, in the basis of the rings; `None` where that is nothing.
    pub(crate) expanded: Vec<Option<Expanded>>,
}

/// A lobe in the basis of the rings.
pub(crate) struct Expanded {
    pub(crate) table: LobeTable,
    pub(crate) bounce: BounceLobe,
}

impl Lobes {
    /// Expands lobes, on all cores.
    pub fn new(bsdfs: Vec<Box<dyn Bsdf>>) -> Self {
        let expanded = |bsdf: &Box<dyn Bsdf>| {
            bsdf.sampling()?;
            let table = LobeTable::new(&**bsdf);
            Some(Expanded { bounce: BounceLobe::new(&table), table })
        };
        Self { expanded: bsdfs.par_iter().map(expanded).collect(), bsdfs }
    }
}

/// What tells one diffuse reflection from another: a hash of all that its pictures depend on.
pub type DiffuseKey = [u8; 32];

/// Some materials, each beside its own diffuse reflection, to be told apart in pictures: specular is what is left of a
/// picture without the diffuse one (Guarnera *et al.* 2018, 3.1).
pub struct SplitLobes {
    pub(crate) whole: Lobes,
    /// Diffuse reflections that differ from each other.
    pub(crate) diffuse: Lobes,
    /// For each material, the place of its own in `diffuse`.
    pub(crate) diffuse_of: Vec<usize>,
    /// For each material, true where its diffuse reflection is no more than the Lambert term that the material has too.
    pub(crate) is_plain: Vec<bool>,
    /// What tells the members of `diffuse` from all others.
    keys: Vec<DiffuseKey>,
}

impl SplitLobes {
    /// Expands materials and their diffuse reflections, on all cores.
    pub fn new(materials: &[Material]) -> Self {
        let whole = Lobes::new(materials.iter().map(Material::bsdf).collect());
        let all = Lobes::new(materials.iter().map(Material::diffuse_bsdf).collect());
        let plain =
            |i: usize| all.expanded[i].is_none() && all.bsdfs[i].diffuse() == whole.bsdfs[i].diffuse();
        let is_plain = (0..materials.len()).map(plain).collect();
        let mut diffuse = Lobes { bsdfs: Vec::new(), expanded: Vec::new() };
        let mut places: HashMap<DiffuseKey, usize> = HashMap::new();
        let mut keys = Vec::new();
        let mut diffuse_of = Vec::with_capacity(materials.len());
        for ((bsdf, expanded), material) in all.bsdfs.into_iter().zip(all.expanded).zip(materials) {
            let key = diffuse_key(&*bsdf, expanded.as_ref(), material);
            let place = *places.entry(key).or_insert(keys.len());
            diffuse_of.push(place);
            if place == keys.len() {
                keys.push(key);
                diffuse.bsdfs.push(bsdf);
                diffuse.expanded.push(expanded);
            }
        }
        Self { whole, diffuse, diffuse_of, is_plain, keys }
    }

    /// What tells the diffuse reflection of a material from others.
    pub fn diffuse_key(&self, material: usize) -> DiffuseKey {
        self.keys[self.diffuse_of[material]]
    }

    /// The place of a material's diffuse reflection among those that differ from each other.
    pub fn diffuse_place(&self, material: usize) -> usize {
        self.diffuse_of[material]
    }
}

fn diffuse_key(bsdf: &dyn Bsdf, expanded: Option<&Expanded>, material: &Material) -> DiffuseKey {
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytemuck::bytes_of(&bsdf.diffuse()));
    if let Some(expanded) = expanded {
        hasher.update(expanded.table.bytes());
    }
    if !bsdf.is_isotropic() {
        // The table holds no more than its mean over all turns.
        hasher.update(material.to_string().as_bytes());
    }
    hasher.finalize().into()
}
