//! Materials on their way to pictures: what does not depend on scene or light, worked out once for all.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use lookmatch_materials::{BlackBody, Bsdf, Material};
use rayon::prelude::*;

use crate::bounce::BounceLobe;
use crate::lobe_table::LobeTable;

/// Some materials, ready for any prepared scene.
pub struct Lobes {
    pub(crate) bsdfs: Vec<Box<dyn Bsdf>>,
    /// For each of them, what it has beside its Lambert term, in the basis of the rings; `None` where that is nothing.
    pub(crate) expanded: Vec<Option<Arc<Expanded>>>,
}

/// A lobe in the basis of the rings.
pub(crate) struct Expanded {
    pub(crate) table: LobeTable,
    pub(crate) bounce: BounceLobe,
}

impl Expanded {
    /// `None` where a BSDF has no more than its Lambert term.
    fn new(bsdf: &dyn Bsdf) -> Option<Arc<Self>> {
        bsdf.sampling()?;
        let table = LobeTable::new(bsdf);
        Some(Arc::new(Self { bounce: BounceLobe::new(&table), table }))
    }
}

impl Lobes {
    /// Expands lobes, on all cores.
    pub fn new(bsdfs: Vec<Box<dyn Bsdf>>) -> Self {
        Self { expanded: bsdfs.par_iter().map(|bsdf| Expanded::new(&**bsdf)).collect(), bsdfs }
    }
}

/// What tells one diffuse reflection from another: a hash of all that its pictures depend on.
pub type DiffuseKey = [u8; 32];

/// Some materials, each beside its own diffuse reflection, to be told apart in pictures: specular is what is left of a
/// picture without the diffuse one (Guarnera *et al.* 2018, 3.1).
pub struct SplitLobes {
    pub(crate) whole: Lobes,
    /// Diffuse reflections whose pictures differ from each other.
    pub(crate) diffuse: Lobes,
    /// For each material, the place of its own in `diffuse`.
    place_of: Vec<usize>,
    /// For each material, true where its diffuse reflection is no more than the Lambert term that the material has too: the
    /// term is then left out of the picture instead of being subtracted from it.
    pub(crate) is_plain: Vec<bool>,
    /// What tells the members of `diffuse` from all others.
    keys: Vec<DiffuseKey>,
}

impl SplitLobes {
    /// Expands materials and their diffuse reflections, on all cores.
    pub fn new(materials: &[Material]) -> Self {
        let whole = Lobes::new(materials.iter().map(Material::bsdf).collect());
        let body = |k: usize| {
            let (bsdf, expanded) = body(&materials[k], whole.expanded[k].as_ref());
            let key = diffuse_key(&*bsdf, expanded.as_deref(), &materials[k]);
            (bsdf, expanded, key)
        };
        let bodies: Vec<_> = (0..materials.len()).into_par_iter().map(body).collect();
        let plain = |k: usize| {
            let (bsdf, expanded, _) = &bodies[k];
            expanded.is_none() && bsdf.diffuse() == whole.bsdfs[k].diffuse()
        };
        let is_plain = (0..materials.len()).map(plain).collect();
        let (firsts, place_of) = kinds(bodies.iter().map(|(_, _, key)| *key));
        let mut diffuse = Lobes { bsdfs: Vec::new(), expanded: Vec::new() };
        let mut keys = Vec::new();
        for (k, (bsdf, expanded, key)) in bodies.into_iter().enumerate() {
            if firsts[place_of[k]] == k {
                diffuse.bsdfs.push(bsdf);
                diffuse.expanded.push(expanded);
                keys.push(key);
            }
        }
        Self { whole, diffuse, place_of, is_plain, keys }
    }

    /// What tells the diffuse reflection of a material from others.
    pub fn diffuse_key(&self, material: usize) -> DiffuseKey {
        self.keys[self.diffuse_place(material)]
    }

    /// The place of a material's diffuse reflection among those that differ from each other.
    pub fn diffuse_place(&self, material: usize) -> usize {
        self.place_of[material]
    }
}

/// The diffuse reflection of a material whose own expansion is known.
fn body(material: &Material, whole: Option<&Arc<Expanded>>) -> (Box<dyn Bsdf>, Option<Arc<Expanded>>) {
    let bsdf = material.diffuse_bsdf();
    let Some(BlackBody { coloured, black, share }) = material.black_body() else {
        let expanded = Expanded::new(&*bsdf);
        return (bsdf, expanded);
    };
    // What is linear need not be evaluated again.
    let coloured = if coloured == *material { whole.cloned() } else { Expanded::new(&*coloured.bsdf()) };
    let expanded = match (coloured, Expanded::new(&*black.bsdf())) {
        (coloured, None) if share == 1.0 => coloured,
        (None, _) => None,
        (Some(coloured), black) => {
            let table = coloured.table.less(black.as_ref().map(|black| &black.table), share as f32);
            Some(Arc::new(Expanded { bounce: BounceLobe::new(&table), table }))
        }
    };
    (bsdf, expanded)
}

/// The place of the first of each kind of things that are told apart by keys, and for each thing the place of its kind.
fn kinds<K: Eq + Hash>(keys: impl Iterator<Item = K>) -> (Vec<usize>, Vec<usize>) {
    let (mut places, mut firsts) = (HashMap::new(), Vec::new());
    let kind = |(k, key)| {
        *places.entry(key).or_insert_with(|| {
            firsts.push(k);
            firsts.len() - 1
        })
    };
    let kind_of = keys.enumerate().map(kind).collect();
    (firsts, kind_of)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_the_same_is_kept_once() {
        let texts = [
            "ggx:diffuse=0.3,roughness=0.1",
            "oren-nayar",
            "ggx:diffuse=0.3,roughness=0.4",
            "ward:diffuse=0.3,roughness=0.4",
            "ggx:diffuse=0.5,roughness=0.4",
        ];
        let materials = texts.map(|text| Material::parse(text).unwrap());
        let lobes = SplitLobes::new(&materials);
        assert_eq!(lobes.place_of, [0, 1, 0, 0, 2]);
        assert_eq!(lobes.is_plain, [true, false, true, true, true]);
        assert_eq!((lobes.diffuse.bsdfs.len(), lobes.keys.len()), (3, 3));
        let [whole, diffuse] =
            [&lobes.whole, &lobes.diffuse].map(|lobes| lobes.expanded[1].as_ref().unwrap());
        assert!(Arc::ptr_eq(whole, diffuse), "a rough diffuse material is its own diffuse reflection");
        // Neither the company nor the order of materials matters.
        let alone = SplitLobes::new(&materials[3..4]);
        assert_eq!(alone.diffuse_key(0), lobes.diffuse_key(0));
        assert_ne!(lobes.diffuse_key(4), lobes.diffuse_key(0));
    }
}
