//! The command `evaluate --slice`: a map of the cost over two parameters, as CSV and as a heat map.

use super::args::EvaluateArgs;
use super::model::inputs::ModelInputs;
use super::prelude::*;
use motorfit::criterion::Criterion;
use motorfit::motor::Parameter;
use motorfit::report::{Map, heat_map};
use motorfit::study::{CostMap, MapParameter, cost_map, model_cost_map};

/// Default number of points per axis.
const SIDE: usize = 101;

pub(super) fn run(args: &EvaluateArgs, slice: &str, style: &Style) -> Result<Outcome> {
    if let Some(path) = &args.model.model {
        let ModelInputs { model, spec, recordings, threads, .. } = ModelInputs::new(args, path)?;
        let (names, side) = (names(slice)?, side(args)?);
        let map = with_threads(threads, || model_cost_map((&model, &recordings), &spec, names, side))?;
        return shown(args, &map, &spec.criterion, style);
    }
    let spec = inputs::spec(&args.problem, &args.device, style)?;
    let [first, second] = names(slice)?;
    let parameters: [Parameter; 2] = [first.parse()?, second.parse()?];
    let side = side(args)?;
    let records = inputs::records(&args.recordings.records, &args.recordings.reading.0.and(&args.problem.0))?;
    let map = with_threads(spec.threads, || cost_map(&records, &spec, parameters, side))?;
    shown(args, &map, &spec.criterion, style)
}

/// Returns the names of the two parameters of a slice.
fn names(slice: &str) -> Result<[&str; 2]> {
    let names: Vec<&str> = slice.split(',').map(str::trim).collect();
    names[..].try_into().map_err(|_| {
        let message = format!("--slice: \"{}\" is not two parameters", excerpt(slice));
        Error::usage(message, "Write --slice R,L.")
    })
}

/// Returns the number of points per axis.
fn side(args: &EvaluateArgs) -> Result<usize> {
    let Some(sample) = args.sample.as_deref() else { return Ok(SIDE) };
    sample.strip_prefix("grid:").and_then(|number| number.parse().ok()).ok_or_else(|| {
        let message = format!("--slice takes --sample grid:N, not \"{}\"", excerpt(sample));
        Error::usage(message, "Leave --sample out, or give the number of points per axis as grid:N.")
    })
}

/// Writes a map as CSV, or as a heat map.
fn shown(args: &EvaluateArgs, map: &CostMap, criterion: &Criterion, style: &Style) -> Result<Outcome> {
    style.warnings(&map.warnings);
    if let Some(path) = &args.svg {
        out::write_file(path, &svg(map, criterion))?;
        if !stdio::is_stdio(path) {
            style.note(&format!("wrote {}", path.display()));
            show(&summary(map, criterion))?;
        }
    } else {
        data(&csv(map))?;
    }
    Ok(Outcome::Done)
}

/// Returns the optimum and the extent of a map that is drawn to a file.
fn summary(map: &CostMap, criterion: &Criterion) -> String {
    let costs = || map.costs.iter().flatten().copied().filter(|cost| cost.is_finite());
    let lowest = significant(costs().fold(f64::INFINITY, f64::min), 4);
    let points = format!("{} × {}", map.costs.first().map_or(0, Vec::len), map.costs.len());
    let mut text =
        format!("{} (scale {}), {points} points, lowest {lowest}\n", criterion.norm.name(), criterion.scale.name());
    for n in [0, 1] {
        let [low, high] = map.ranges[n].map(|value| significant(value, 4));
        let of = &map.parameters[n];
        let optimum = significant(map.optimum[n], 6);
        let _ = writeln!(text, "  {:<3} {optimum} {}, drawn from {low} to {high}", of.symbol, of.unit);
    }
    text
}

fn csv(map: &CostMap) -> String {
    let mut text = format!("{},{},cost\n", map.parameters[0].symbol, map.parameters[1].symbol);
    for (row, costs) in map.costs.iter().enumerate() {
        for (column, cost) in costs.iter().enumerate() {
            let [x, y, cost] = [map.value(0, column), map.value(1, row), *cost].map(Shortest);
            let _ = writeln!(text, "{x},{y},{cost}");
        }
    }
    text
}

fn svg(map: &CostMap, criterion: &Criterion) -> String {
    let label = |p: &MapParameter| format!("{}, {} [{}]", p.symbol, p.name, p.unit.replace('*', " "));
    let [x, y] = map.parameters.each_ref().map(label);
    let (criterion, scale) = (criterion.norm.name(), criterion.scale.name());
    let [at_x, at_y] = [0, 1].map(|n| format!("{} = {}", map.parameters[n].symbol, significant(map.optimum[n], 5)));
    heat_map(&Map {
        title: &format!("log10 of {criterion} ({scale}) around {at_x}, {at_y}; ellipse: 95 %"),
        labels: [&x, &y],
        ranges: map.ranges,
        values: map.costs.iter().map(|row| row.iter().map(|c| c.clamp(1e-300, 1e30).log10()).collect()).collect(),
        mark: map.optimum,
        curve: map.ellipse.clone(),
    })
    .file("", false)
}
