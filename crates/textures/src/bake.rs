//! A probe as tables: what `apply` says of every texel, asked once for each point of a grid.
//!
//! Parameters that were searched are linear between the probe's own levels, so their table has these levels and is exact. What is
//! carried over from the source (the colour of a body, say) may bend between them: its tables are refined where it does
//! ([`CarriedTable`]).

use std::sync::atomic::AtomicBool;

use itertools::Itertools;
use lookmatch_materials::{Kind, Material, Value};
use lookmatch_remap::{Axis, Probe, RemapError, apply};
use rayon::prelude::*;

use crate::TextureError;
use crate::carried::{CarriedTable, Factor, Known, Proportion};
use crate::convert::{Progress, is_stopped};
use crate::lut::{Between, Lut, MAX_INPUTS};

/// A source parameter that comes from a texture.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub(crate) name: String,
    /// Three channels.
    pub(crate) is_colour: bool,
    /// What the probe accepts.
    pub(crate) range: [f64; 2],
    pub(crate) levels: Vec<f64>,
    /// False for what is carried over.
    is_axis: bool,
}

/// A target parameter that differs from texel to texel.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    pub(crate) name: String,
    /// The parameters that it sets: several behind an alias.
    pub(crate) parameters: Vec<&'static str>,
    /// 1 or 3.
    pub(crate) channels: usize,
    /// Smallest and largest value.
    pub(crate) range: [f64; 2],
    /// For values that are carried over: their tables.
    carried: Option<Carried>,
}

#[derive(Clone, Debug)]
struct Carried {
    /// All that it depends on.
    inputs: Vec<usize>,
    /// The inputs of its tables.
    places: Vec<usize>,
    /// One for all channels, or one for each.
    tables: Vec<CarriedTable>,
}

/// A probe for some textures.
#[derive(Clone, Debug)]
pub(crate) struct Baked {
    pub(crate) inputs: Vec<Input>,
    /// Those of the table first.
    pub(crate) maps: Vec<Map>,
    /// The target's other parameters.
    pub(crate) constants: Vec<(&'static str, Value)>,
    table: Option<Lut>,
}

/// What is asked: the probe with the parameters that textures leave alone.
pub(crate) struct Question<'a> {
    probe: &'a Probe,
    pub(crate) base: &'a Material,
    pub(crate) inputs: Vec<Input>,
    progress: &'a (dyn Fn(Progress) + Sync),
    stop: &'a AtomicBool,
}

impl Question<'_> {
    /// The source material for a value of each input; colours are grey.
    pub(crate) fn source(&self, values: &[f64]) -> Result<Material, TextureError> {
        let mut source = self.base.clone();
        for (input, value) in self.inputs.iter().zip(values) {
            source.set_number(&input.name, *value).map_err(RemapError::from)?;
        }
        Ok(source)
    }

    /// The target's values; none where the probe has no result.
    pub(crate) fn target(&self, source: &Material) -> Result<Option<Vec<Value>>, TextureError> {
        if is_stopped(self.stop) {
            return Err(TextureError::interrupted());
        }
        match apply(self.probe, source, false) {
            Ok(applied) => Ok(Some(applied.target.values().to_vec())),
            Err(RemapError::Option(_)) if self.probe.entries.iter().any(|e| e.failed.is_some()) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Tells how many points of the table of a target parameter are known.
    pub(crate) fn tell(&self, index: usize, points: usize) {
        (self.progress)(Progress::Table { parameter: self.probe.to.model().parameters[index].name, points });
    }

    /// What a target parameter may be.
    pub(crate) fn limits(&self, index: usize) -> [f64; 2] {
        let range = self.probe.to.model().parameters[index].range();
        range.map_or([f64::NEG_INFINITY, f64::INFINITY], |range| [range.valid.min, range.valid.max])
    }

    /// The target's values on a grid of some inputs, the others being as in `middle`.
    fn grid(
        &self,
        inputs: &[usize],
        levels: &[Vec<f64>],
        middle: &[f64],
    ) -> Result<Vec<Option<Vec<Value>>>, TextureError> {
        let at = |point: Vec<f64>| {
            let mut values = middle.to_vec();
            inputs.iter().zip(point).for_each(|(input, value)| values[*input] = value);
            values
        };
        points(levels).into_par_iter().map(|point| self.target(&self.source(&at(point))?)).collect()
    }
}

impl Baked {
    /// Makes the tables for textures of some parameters; `base` has the values of all others.
    ///
    /// # Errors
    /// A name that is no parameter, or not one that the probe can take from a texture; what `apply` refuses; a target whose
    /// channels depend on each other.
    pub(crate) fn new(
        probe: &Probe,
        base: &Material,
        names: &[String],
        progress: &(dyn Fn(Progress) + Sync),
        stop: &AtomicBool,
    ) -> Result<Self, TextureError> {
        let inputs = names.iter().map(|name| input(probe, base, name)).collect::<Result<Vec<_>, _>>()?;
        let question = Question { probe, base, inputs, progress, stop };
        let middle: Vec<f64> = question.inputs.iter().map(|i| i.levels[i.levels.len() / 2]).collect();
        let Some(values) = question.target(&question.source(&middle)?)? else {
            let reason = "the probe has no result in the middle of its range; remap again";
            return Err(TextureError::Request(reason.into()));
        };
        let mut baked = Self { inputs: Vec::new(), maps: Vec::new(), constants: Vec::new(), table: None };
        let searched = baked.searched(&question, &middle)?;
        let model = probe.to.model();
        for (index, parameter) in model.parameters.iter().enumerate() {
            let is_mapped = baked.maps.iter().any(|map| map.parameters.contains(&parameter.name));
            if is_mapped {
                continue;
            }
            match if searched.contains(&index) { None } else { carried(&question, index, &middle)? } {
                Some(map) => baked.maps.push(map),
                None => baked.constants.push((parameter.name, values[index].clone())),
            }
        }
        baked.inputs = question.inputs;
        Ok(baked)
    }

    /// Tabulates the searched parameters at the probe's levels. Returns the indices of all of them.
    fn searched(&mut self, question: &Question, middle: &[f64]) -> Result<Vec<usize>, TextureError> {
        let probe = question.probe;
        let model = probe.to.model();
        let mut searched = Vec::new();
        for axis in &probe.target_axes {
            searched.extend(model.resolve(&axis.name).map_err(RemapError::from)?);
        }
        let axes: Vec<usize> = (0..question.inputs.len()).filter(|i| question.inputs[*i].is_axis).collect();
        if axes.is_empty() {
            return Ok(searched);
        }
        let levels: Vec<Vec<f64>> = axes.iter().map(|i| question.inputs[*i].levels.clone()).collect();
        let targets = question.grid(&axes, &levels, middle)?;
        let mut outputs = Vec::new();
        for axis in &probe.target_axes {
            let parameters = model.resolve(&axis.name).map_err(RemapError::from)?;
            let points = |channel: usize| -> Vec<f64> {
                let value = |t: &Option<Vec<Value>>| {
                    t.as_ref().and_then(|t| t[parameters[0]].numbers().get(channel).copied())
                };
                targets.iter().map(|t| value(t).unwrap_or(f64::NAN)).collect()
            };
            let mut channels = vec![points(0)];
            if matches!(model.parameters[parameters[0]].kind, Kind::Colour { .. }) {
                let others = [points(1), points(2)];
                if others.iter().any(|c| differ(c, &channels[0])) {
                    channels.extend(others);
                }
            }
            let range = range(&channels.concat());
            if range[0] == range[1] && channels.len() == 1 {
                continue;
            }
            self.maps.push(Map {
                name: axis.name.clone(),
                parameters: parameters.iter().map(|p| model.parameters[*p].name).collect(),
                channels: channels.len(),
                range,
                carried: None,
            });
            // As `apply` has it: switches of two levels take the value of the nearest point.
            let between = if axis.len() > 2 { Between::Linear } else { Between::Nearest };
            outputs.extend(channels.into_iter().map(|c| (between, c)));
        }
        if !outputs.is_empty() {
            self.table = Some(Lut::new(&levels, &outputs).map_err(|e| TextureError::Request(e.to_string()))?);
        }
        Ok(searched)
    }

    /// Largest error of the tables of carried-over values, as a share of their ranges.
    pub(crate) fn error(&self) -> f64 {
        self.errors().map(|(_, error)| error).fold(0.0, f64::max)
    }

    /// Carried-over parameters, and the largest error of the table of each.
    pub(crate) fn errors(&self) -> impl Iterator<Item = (&str, f64)> {
        let worst = |c: &Carried| c.tables.iter().map(|table| table.error).fold(0.0, f64::max);
        self.maps.iter().filter_map(move |m| Some((m.name.as_str(), worst(m.carried.as_ref()?))))
    }

    /// Source parameters that a map depends on.
    pub(crate) fn inputs_of<'a>(&'a self, map: &'a Map) -> Vec<&'a Input> {
        match &map.carried {
            Some(carried) => carried.inputs.iter().map(|i| &self.inputs[*i]).collect(),
            None => self.inputs.iter().filter(|i| i.is_axis).collect(),
        }
    }

    /// Maps some texels: planes by input and channel to planes by map and channel.
    pub(crate) fn evaluate(&self, inputs: &[Vec<&[f32]>], outputs: &mut [Vec<&mut [f32]>]) {
        let tabulated = self.maps.iter().take_while(|map| map.carried.is_none()).count();
        let (table, carried) = outputs.split_at_mut(tabulated);
        if let Some(lut) = &self.table {
            let places = self.inputs.iter().zip(inputs).filter(|(i, _)| i.is_axis);
            let places: Vec<&[f32]> = places.map(|(_, planes)| planes[0]).collect();
            let mut planes: Vec<&mut [f32]> = table.iter_mut().flatten().map(|p| &mut **p).collect();
            lut.evaluate(&places, &mut planes);
        }
        for (map, planes) in self.maps[tabulated..].iter().zip(carried) {
            let Some(carried) = &map.carried else { continue };
            for (channel, plane) in planes.iter_mut().enumerate() {
                let of =
                    |i: &usize| if self.inputs[*i].is_colour { inputs[*i][channel] } else { inputs[*i][0] };
                let places: Vec<&[f32]> = carried.places.iter().map(of).collect();
                let table = &carried.tables[channel % carried.tables.len()];
                let factors = if let Factor::Input(i) = &table.factor { of(i) } else { &[] };
                table.evaluate(&places, factors, plane);
            }
        }
    }
}

fn differ(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-9)
}

pub(crate) fn range(values: &[f64]) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]
}

/// The input that a texture's name stands for.
fn input(probe: &Probe, base: &Material, name: &str) -> Result<Input, TextureError> {
    let model = base.model();
    let indices = model.resolve(name).map_err(RemapError::from)?;
    let resolved = |axis: &Axis| model.resolve(&axis.name).unwrap_or_default();
    if let Some(axis) = probe.source_axes.iter().find(|axis| resolved(axis) == indices) {
        return Ok(Input {
            name: axis.name.clone(),
            is_colour: false,
            range: [axis.value(0), axis.value(axis.len() - 1)],
            levels: axis.levels.clone(),
            is_axis: true,
        });
    }
    if let Some(axis) =
        probe.source_axes.iter().find(|axis| resolved(axis).iter().any(|i| indices.contains(i)))
    {
        let advice = format!("give the texture to '{}'", axis.name);
        let what = format!("the probe tabulates '{}' as one number, of which '{name}' is a part", axis.name);
        return Err(TextureError::Request(format!("{what}; {advice}")));
    }
    let parameter = &model.parameters[indices[0]];
    let (is_colour, valid) = match (&parameter.kind, indices.len()) {
        (Kind::Colour { range, .. }, 1) => (true, range.valid),
        (Kind::Number { range, .. }, 1) => (false, range.valid),
        _ => {
            let reason = "a texture stands for one number or one colour";
            return Err(TextureError::Request(format!("'{name}' of {} cannot be one: {reason}", model.name)));
        }
    };
    let ends = [valid.nearest(valid.min), valid.nearest(valid.max)];
    // What is carried over is nearly proportional to them. The first step is short: it must not end beyond a limit.
    let levels = [0.0, 0.25, 1.0].map(|share| ends[0] + (ends[1] - ends[0]) * share).to_vec();
    Ok(Input { name: parameter.name.into(), is_colour, range: ends, levels, is_axis: false })
}

/// The map of a parameter that is carried over; none where it is the same for all texels.
fn carried(question: &Question, index: usize, middle: &[f64]) -> Result<Option<Map>, TextureError> {
    let parameter = &question.probe.to.model().parameters[index];
    let inputs: Vec<usize> = (0..question.inputs.len())
        .map(|input| Ok(depends(question, index, input, middle)?.then_some(input)))
        .collect::<Result<Vec<_>, TextureError>>()?
        .into_iter()
        .flatten()
        .collect();
    if inputs.is_empty() {
        return Ok(None);
    }
    let channels = match parameter.kind {
        Kind::Colour { .. } => 3,
        Kind::Number { .. } => 1,
        _ => 0,
    };
    let by_colour = inputs.iter().any(|i| question.inputs[*i].is_colour);
    if channels == 0 || inputs.len() > MAX_INPUTS || (by_colour && !keeps_channels(question, index, middle)?)
    {
        let names: Vec<&str> = inputs.iter().map(|i| question.inputs[*i].name.as_str()).collect();
        let names = names.join(" and ");
        return Err(TextureError::Request(format!(
            "'{}' of the target depends on {names} in a way that no texture can have",
            parameter.name
        )));
    }
    if channels == 3
        && let Some(proportion) = Proportion::of(question, index, &inputs, middle)?
    {
        return proportional(question, index, inputs, middle, proportion).map(Some);
    }
    let mut known = Known::new(question, index, &inputs, middle);
    let mut tables = vec![CarriedTable::new(&mut known, 0, Factor::One)?];
    // Textures of numbers may change each channel in its own way.
    if !by_colour && channels == 3 && known.has_hues() {
        for channel in [1, 2] {
            tables.push(CarriedTable::new(&mut known, channel, Factor::One)?);
        }
    }
    let channels = if by_colour { channels } else { tables.len() };
    Ok(Some(carried_map(
        question,
        index,
        channels,
        Carried { inputs: inputs.clone(), places: inputs, tables },
    )))
}

/// The map of a colour that is in proportion to one of the source's.
fn proportional(
    question: &Question,
    index: usize,
    inputs: Vec<usize>,
    middle: &[f64],
    Proportion { base, reference, mut factors }: Proportion,
) -> Result<Map, TextureError> {
    let mut middle = middle.to_vec();
    let is_input = |i: &usize| factors.contains(&Factor::Input(*i));
    inputs.iter().filter(|i| is_input(i)).for_each(|i| middle[*i] = reference);
    let places: Vec<usize> = inputs.iter().copied().filter(|i| !is_input(i)).collect();
    let is_textured = places.len() < inputs.len();
    if factors.iter().all(|factor| *factor == factors[0]) {
        factors.truncate(1);
    }
    let dark = Question { base: &base, inputs: question.inputs.clone(), ..*question };
    let mut known = Known::new(&dark, index, &places, &middle).over(reference);
    let tables = factors.iter().map(|factor| CarriedTable::new(&mut known, 0, *factor));
    let tables: Vec<CarriedTable> = tables.collect::<Result<_, _>>()?;
    let channels = if is_textured || tables.len() > 1 { 3 } else { 1 };
    Ok(carried_map(question, index, channels, Carried { inputs, places, tables }))
}

fn carried_map(question: &Question, index: usize, channels: usize, carried: Carried) -> Map {
    let name = question.probe.to.model().parameters[index].name;
    let ranges: Vec<f64> = carried.tables.iter().flat_map(|table| table.range).collect();
    Map { name: name.into(), parameters: vec![name], channels, range: range(&ranges), carried: Some(carried) }
}

/// Whether a target parameter changes with an input, wherever the others are.
fn depends(question: &Question, index: usize, input: usize, middle: &[f64]) -> Result<bool, TextureError> {
    for share in [0.5, 0.2, 0.8] {
        let at = |i: &Input| i.range[0] + share * (i.range[1] - i.range[0]);
        let base: Vec<f64> =
            if share == 0.5 { middle.to_vec() } else { question.inputs.iter().map(at).collect() };
        let levels = &question.inputs[input].levels;
        let ends = vec![levels[0], levels[levels.len() / 2], levels[levels.len() - 1]];
        let ends = if levels.len() < 3 { levels.clone() } else { ends };
        let found: Vec<_> = question.grid(&[input], &[ends], &base)?.into_iter().flatten().collect();
        if found.windows(2).any(|p| p[0][index] != p[1][index]) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Whether each channel of a target parameter depends on the same channel of coloured inputs alone.
fn keeps_channels(question: &Question, index: usize, middle: &[f64]) -> Result<bool, TextureError> {
    let shares = [0.2, 0.5, 0.7];
    let at = |share: f64| -> Vec<f64> {
        let inputs = question.inputs.iter().zip(middle);
        inputs
            .map(|(i, m)| if i.is_colour { i.range[0] + share * (i.range[1] - i.range[0]) } else { *m })
            .collect()
    };
    let mut source = question.source(middle)?;
    let model = source.model();
    for (i, input) in question.inputs.iter().enumerate().filter(|(_, input)| input.is_colour) {
        let place = model.resolve(&input.name).map_err(RemapError::from)?[0];
        let colour = Value::Colour(shares.map(|share| at(share)[i]));
        source.set_value(place, colour).map_err(RemapError::from)?;
    }
    let Some(mixed) = question.target(&source)? else { return Ok(false) };
    let mixed = mixed[index].numbers();
    for (channel, share) in shares.into_iter().enumerate() {
        let Some(grey) = question.target(&question.source(&at(share))?)? else { return Ok(false) };
        let (Some(mixed), Some(grey)) = (mixed.get(channel), grey[index].numbers().first().copied()) else {
            return Ok(false);
        };
        if (mixed - grey).abs() > crate::TOLERANCE * grey.abs().max(1e-2) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The points of a grid, the first axis slowest.
pub(crate) fn points(levels: &[Vec<f64>]) -> Vec<Vec<f64>> {
    levels.iter().map(|levels| levels.iter().copied()).multi_cartesian_product().collect()
}
