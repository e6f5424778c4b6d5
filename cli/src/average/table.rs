//! `subjects.csv`: a line for every input, for programs that read tables.

use shape_average::StrainRanges;
use shapespace_report::table::{Table, exact_or_empty};

use super::Outcome;
use crate::error::CliError;
use crate::output::{ResultDir, write_text};
use crate::shapes::{InputRecord, WorldFrame};

/// The name of the table.
const NAME: &str = "subjects.csv";

/// Writes `subjects.csv`. Lengths are in spacings of the grid, and in millimetres where the average lies in the world.
///
/// # Errors
/// [`CliError::Output`].
pub(super) fn write_subjects<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    inputs: &[InputRecord<D>],
    strains: &[Option<StrainRanges>],
) -> Result<(), CliError> {
    let result = &outcome.result;
    let size = if D == 2 { "area" } else { "volume" };
    let mut units = vec![("spacings", result.average.grid().spacing().recip())];
    units.extend(WorldFrame::of_inputs(inputs).map(|world| ("mm", world.length())));
    let mut head = vec![
        "shape".into(),
        "file".into(),
        size.into(),
        format!("{size}_input_units"),
        "elastic".into(),
        "mismatch".into(),
        "dice".into(),
    ];
    for (unit, _) in &units {
        let kinds = ["mean", "95", "max"];
        head.extend(kinds.map(|kind| format!("distance_{kind}_{unit}")));
    }
    head.push("least_determinant".into());
    let mut table = Table::new(head);
    for (i, input) in outcome.inputs.iter().enumerate() {
        let energy = &result.energy;
        let distance = result.hausdorff.get(i).copied().flatten();
        let mut numbers = vec![
            Some(input.volume),
            Some(input.volume / input.scale().powi(D as i32)),
            energy.elastic.get(i).copied(),
            energy.mismatch.get(i).copied(),
            result.dice.get(i).copied(),
        ];
        for (_, factor) in &units {
            let distances = distance.map(|d| [d.mean, d.percentile_95, d.maximum]);
            numbers.extend((0..3).map(|k| distances.map(|d| factor * d[k])));
        }
        let strain = strains.get(i).and_then(Option::as_ref);
        numbers.push(strain.map(|ranges| ranges.determinant.least));
        let names = [input.name.clone(), input.path.display().to_string()];
        table.texts(
            names
                .into_iter()
                .chain(numbers.into_iter().map(exact_or_empty)),
        );
    }
    Ok(directory.with_file(NAME, |path| write_text(path, &table.csv()))?)
}
