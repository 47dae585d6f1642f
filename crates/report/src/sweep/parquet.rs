//! Merged results as Parquet, one row per run with flat columns, in row groups that bound the memory.

use motorfit_core::file::{replace, unwritable};
use motorfit_core::{Error, Result};
use motorfit_study::sweep::{Line, OutputFits, RunEstimate, RunEstimates, SweepParameter, SweepSummary};
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Write};
use std::path::Path;
use std::sync::Arc;

/// Rows of a row group.
const GROUP: usize = 1 << 16;

/// Function that reads a column from a line.
enum Column {
    Whole(fn(&Line) -> u64),
    Text(fn(&Line) -> String),
    Reason(fn(&Line) -> Option<String>),
    Real(Real),
}

/// Function that reads a number that may be missing.
type Real = Box<dyn Fn(&Line) -> Option<f64>>;

/// Returns the names and functions of the columns; those of parameters depend on the results, some others on the study.
fn columns(sweep: &SweepSummary) -> Vec<(String, Column)> {
    let text = |name: &str, of| (name.to_owned(), Column::Text(of));
    let whole = |name: &str, of| (name.to_owned(), Column::Whole(of));
    let reason = |name: &str, of| (name.to_owned(), Column::Reason(of));
    let each = |prefix: &str, of: fn(&RunEstimate) -> Option<f64>| {
        let one = |parameter: &SweepParameter| {
            let name = parameter.name.clone();
            let read = move |row: &Line| of(row.outcome.estimates.as_ref()?.all().find(|e| e.name == name)?);
            (format!("{prefix}{}", parameter.name), Column::Real(Box::new(read)))
        };
        sweep.parameters.iter().map(one).collect::<Vec<_>>()
    };
    let fits = |prefix: &str, of: fn(&Line) -> Option<&OutputFits>| {
        let one = |output: &String| {
            let name = output.clone();
            (format!("{prefix}{output}"), Column::Real(Box::new(move |row: &Line| of(row)?.of(&name))))
        };
        sweep.outputs.iter().map(one).collect::<Vec<_>>()
    };
    let real = |name: &str, of: fn(&Line) -> Option<f64>| (name.to_owned(), Column::Real(Box::new(of)));
    let mut columns = vec![
        whole("id", |row| row.id),
        text("motor", |row| row.motor.clone()),
        text("method", |row| row.method.clone()),
        text("polish", |row| row.polish.clone()),
        whole("population", |row| row.population),
        whole("generations", |row| row.generations),
        text("criterion", |row| row.criterion.clone()),
        text("scale", |row| row.scale.clone()),
        text("noise", |row| row.noise.clone()),
        whole("seed", |row| row.seed),
    ];
    if sweep.names_with {
        columns.insert(4, text("with", |row| row.with.clone().unwrap_or_default()));
    }
    if sweep.names_models {
        columns.insert(4, text("model", |row| row.model.clone().unwrap_or_default()));
    }
    columns.extend(each("", |e| e.value));
    columns.extend(each("std_error_", |e| e.std_error));
    columns.extend(each("ci95_low_", |e| Some(e.ci95?[0])));
    columns.extend(each("ci95_high_", |e| Some(e.ci95?[1])));
    columns.extend([text("at_bound", at_bound), real("cost", |row| row.outcome.cost)]);
    columns.extend(fits("fit_", |row| row.outcome.fit_percent.as_ref()));
    if sweep.holds_out {
        columns.extend(fits("validation_fit_", |row| Some(&row.outcome.validation.as_ref()?.fit_percent)));
    }
    columns.extend([
        whole("evaluations", |row| row.outcome.evaluations),
        text("stop", |row| row.outcome.stop_name().to_owned()),
        text("device", |row| row.outcome.device.to_owned()),
        text("precision", |row| row.outcome.precision.to_owned()),
        text("warnings", |row| row.outcome.warnings.join(",")),
    ]);
    if sweep.trust.levels.is_known() {
        columns.push(reason("trust", |row| Some(row.outcome.trust.as_ref()?.level.name().to_owned())));
        columns.push(reason("trust_reasons", |row| Some(row.outcome.trust.as_ref()?.reasons.join(","))));
    }
    columns.push(reason("error", |row| Some(row.outcome.error.as_ref()?.message.clone())));
    columns
}

/// Lists the parameters at a bound, as in `R:max,J:min`.
fn at_bound(row: &Line) -> String {
    let name = |e: &RunEstimate| Some(format!("{}:{}", e.name, e.at_bound?));
    let all = row.outcome.estimates.iter().flat_map(RunEstimates::all);
    all.filter_map(name).collect::<Vec<_>>().join(",")
}

/// Returns the schema in the message format of Parquet. Seeds are unsigned, since they use all 64 bits.
fn schema(columns: &[(String, Column)]) -> String {
    let one = |(name, column): &(String, Column)| match column {
        Column::Whole(_) if name == "seed" => format!("REQUIRED INT64 {name} (INTEGER(64,false));"),
        Column::Whole(_) => format!("REQUIRED INT64 {name};"),
        Column::Text(_) => format!("REQUIRED BINARY {name} (UTF8);"),
        Column::Reason(_) => format!("OPTIONAL BINARY {name} (UTF8);"),
        Column::Real(_) => format!("OPTIONAL DOUBLE {name};"),
    };
    format!("message sweep {{ {} }}", columns.iter().map(one).collect::<String>())
}

/// Writes the merged results of a sweep as Parquet; the file is replaced atomically. `sweep` is the summary of the same
/// merge.
///
/// # Errors
/// Returns a `Data` error if the results cannot be read or the file cannot be written.
pub fn write_parquet(results: &Path, sweep: &SweepSummary, out: &Path) -> Result<()> {
    let remedy = "Merge the sweep again.";
    let unread = |error| Error::data(format!("cannot be read: {error}"), remedy).in_file(results);
    let unwritten = |error: ParquetError| match error {
        ParquetError::External(error) => error.downcast().map_or_else(std::io::Error::other, |error| *error),
        error => std::io::Error::other(error),
    };
    let failed = |error| unwritable(out, &unwritten(error));
    let columns = columns(sweep);
    replace(out, |file| {
        let schema = Arc::new(parse_message_type(&schema(&columns)).map_err(failed)?);
        let properties = WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default()));
        let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties.build())).map_err(failed)?;
        let mut lines = BufReader::with_capacity(1 << 18, File::open(results).map_err(unread)?).lines();
        let (mut rows, mut number) = (Vec::with_capacity(GROUP), 0);
        loop {
            for line in lines.by_ref().take(GROUP) {
                number += 1;
                let damaged = |_| Error::data("is not a line of results", remedy).in_file(results).at_line(number);
                rows.push(serde_json::from_str::<Line>(&line.map_err(unread)?).map_err(damaged)?);
            }
            if rows.is_empty() {
                return writer.close().map(drop).map_err(failed);
            }
            group(&mut writer, &columns, &rows).map_err(failed)?;
            rows.clear();
        }
    })
}

/// Writes a row group, column by column.
fn group<W: Write + Send>(
    writer: &mut SerializedFileWriter<W>,
    columns: &[(String, Column)],
    rows: &[Line],
) -> std::result::Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    let bytes = |text: String| ByteArray::from(text.into_bytes());
    for (_, column) in columns {
        let Some(mut place) = group.next_column()? else { break };
        match column {
            Column::Whole(of) => {
                let values: Vec<i64> = rows.iter().map(|row| of(row).cast_signed()).collect();
                place.typed::<Int64Type>().write_batch(&values, None, None)?;
            }
            Column::Text(of) => {
                let values: Vec<ByteArray> = rows.iter().map(|row| bytes(of(row))).collect();
                place.typed::<ByteArrayType>().write_batch(&values, None, None)?;
            }
            Column::Reason(of) => {
                let (values, levels) = present(rows, |row| of(row).map(bytes));
                place.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
            Column::Real(of) => {
                let (values, levels) = present(rows, of);
                place.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        place.close()?;
    }
    group.close()?;
    Ok(())
}

/// Returns the values present and the definition level of each row, 1 if it has a value.
fn present<T>(rows: &[Line], of: impl Fn(&Line) -> Option<T>) -> (Vec<T>, Vec<i16>) {
    let cells: Vec<Option<T>> = rows.iter().map(of).collect();
    let levels = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    (cells.into_iter().flatten().collect(), levels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorfit_motor::{Parameter, Scope};
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::Field;

    /// Returns a summary of results with an extension and a parameter of two recordings.
    fn summary() -> SweepSummary {
        let mut summary = super::super::sample::product(1);
        let own = |n| SweepParameter::of_motor(Parameter::Load, Scope::Recording(n));
        summary.parameters.extend([SweepParameter::of_motor(Parameter::Coulomb, Scope::Shared), own(0), own(1)]);
        (summary.names_with, summary.holds_out) = (true, true);
        summary.trust.levels.check = 1;
        summary
    }

    fn line(id: u64) -> String {
        let mut found = serde_json::json!({
            "id": id, "motor": format!("m\u{e4} \"{id}\""), "method": "gwo", "polish": "lm", "population": 100,
            "generations": 50, "criterion": "nrmse", "scale": "std", "noise": "none", "seed": u64::MAX - id,
            "parameters": {"R": 0.1 + 1e-9 * id as f64, "L": 0.2, "K": 0.3, "B": 0.4, "J": 1.0 / 3.0},
            "std_error": {"R": 0.01, "L": null, "K": 0.03, "B": 0.04, "J": 0.05},
            "ci95": {"R": [0.09, 0.11], "L": null, "K": [0.2, 0.4], "B": [0.3, 0.5], "J": [0.25, 0.5]},
            "at_bound": {"R": "max", "L": null, "K": null, "B": null, "J": "min"},
            "cost": 0.0256, "fit_percent": {"current": 98.5, "speed": null}, "evaluations": 5000,
            "stop": "budget_spent", "device": "cpu", "precision": "f64", "warnings": ["a", "b"], "error": null,
        });
        let failed = serde_json::json!({
            "id": id, "motor": "bad", "method": "sm", "polish": "none", "population": 1, "generations": 1,
            "criterion": "nrmse", "scale": "std", "noise": "none", "seed": 1, "parameters": null, "std_error": null,
            "ci95": null, "at_bound": null, "cost": null, "fit_percent": null, "evaluations": 0, "stop": "failed",
            "device": "cpu", "precision": "f64", "warnings": [],
            "error": {"kind": "data", "message": "no such file", "remedy": "…"},
        });
        if id % 2 == 1 {
            let more = [("Tc", 0.01, [0.0, 0.02]), ("TL[0]", -0.1, [-0.2, 0.0]), ("TL[1]", 0.1, [0.0, 0.2])];
            for (name, value, ends) in more {
                found["parameters"][name] = value.into();
                found["std_error"][name] = 0.05.into();
                found["ci95"][name] = ends.to_vec().into();
                found["at_bound"][name] = "min".into();
            }
            found["with"] = "coulomb,load".into();
            found["trust"] = serde_json::json!({"level": "check", "reasons": ["at_bound", "residuals"]});
            found["validation"] = serde_json::json!({"fit_percent": {"current": 90.5, "speed": null}});
        }
        if id % 7 == 3 { failed.to_string() } else { found.to_string() }
    }

    #[test]
    fn written_results_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let (results, out) = (folder.path().join("results.jsonl"), folder.path().join("results.parquet"));
        let rows = GROUP as u64 + 5;
        std::fs::write(&results, (0..rows).map(|id| line(id) + "\n").collect::<String>()).unwrap();
        write_parquet(&results, &summary(), &out).unwrap();
        let reader = SerializedFileReader::new(File::open(&out).unwrap()).unwrap();
        assert_eq!((reader.num_row_groups(), reader.metadata().file_metadata().num_rows()), (2, rows as i64));
        let columns = columns(&summary());
        for (id, read) in (0..rows).zip(reader.get_row_iter(None).unwrap()) {
            let row: Line = serde_json::from_str(&line(id)).unwrap();
            let (read, mut cells) = (read.unwrap(), 0);
            for ((name, field), (expected, column)) in read.get_column_iter().zip(&columns) {
                let text = |text: Option<String>| text.map_or(Field::Null, Field::Str);
                let cell = match column {
                    Column::Whole(of) if name == "seed" => Field::ULong(of(&row)),
                    Column::Whole(of) => Field::Long(of(&row).cast_signed()),
                    Column::Text(of) => text(Some(of(&row))),
                    Column::Reason(of) => text(of(&row)),
                    Column::Real(of) => of(&row).map_or(Field::Null, Field::Double),
                };
                assert_eq!((name, field), (expected, &cell), "run {id}");
                cells += 1;
            }
            assert_eq!(cells, 40 + 3 * 4 + 3 + 2);
        }
    }

    #[test]
    fn a_damaged_line_is_named_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let (results, out) = (folder.path().join("results.jsonl"), folder.path().join("results.parquet"));
        std::fs::write(&results, line(0) + "\n{\"id\":1}\n").unwrap();
        let error = write_parquet(&results, &summary(), &out).unwrap_err();
        assert_eq!(error.line(), Some(2), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        std::fs::write(&results, "").unwrap();
        write_parquet(&results, &summary(), &out).unwrap();
        assert!(write_parquet(&folder.path().join("none"), &summary(), &out).is_err() && out.exists());
    }
}
