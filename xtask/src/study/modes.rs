//! Modes of variation: shapes with known modes, real shapes, and comparison with landmarks.

use std::path::{Path, PathBuf};
use std::process::Command;

use fe_grid::minimise::Silent;
use levelset::{BoxEdge, contour};
use nalgebra::DMatrix;
use serde_json::Value;
use shape_average::{AverageParams, average};
use shape_pca::{Average, Compound, Modes, Pca, PcaParams, Quality, Variation};
use shapespace::pca::Procrustes;

use super::Section;
use super::real::{build, files};
use super::shapes::aligned_files;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Options of every average here: a small length weight, and a tolerance that lets stresses
/// balance.
const AVERAGE: [&str; 4] = ["--length-weight", "1e-5", "--tolerance", "2e-4"];

/// Bends of the two arms of four crosses: two independent bends with squares in the ratio 1 to .39.
const BENDS: [&str; 4] = ["20,12.5", "20,-12.5", "-20,12.5", "-20,-12.5"];

/// Shapes, their options, and the requirements on the analysis.
struct Set {
    name: &'static str,
    files: Vec<PathBuf>,
    options: &'static [&'static str],
    /// Shapes of another class, and its name.
    others: (&'static str, Vec<PathBuf>),
    /// Bounds of the balance and of the largest residual.
    balance: f64,
    residual: f64,
}

/// The table of all sets.
pub fn section(data: Option<&Path>) -> Outcome<Section> {
    build()?;
    let place = std::env::temp_dir().join(format!("shapespace-modes-{}", std::process::id()));
    std::fs::create_dir_all(&place)?;
    let mut sets = Vec::new();
    let folder = place.join("bars");
    program(&["generate", "family", "bars", "-o", text(&folder)?])?;
    sets.push(Set {
        name: "bars",
        files: files(&folder, ".npy")?,
        options: &[],
        others: ("", Vec::new()),
        balance: 0.1,
        residual: 0.04,
    });
    let folder = place.join("crosses");
    std::fs::create_dir(&folder)?;
    for (k, bends) in BENDS.iter().enumerate() {
        let file = folder.join(format!("{k}.npy"));
        program(&["generate", "cross", "--angle", bends, "-o", text(&file)?])?;
    }
    sets.push(Set {
        name: "crosses",
        files: files(&folder, ".npy")?,
        options: &[],
        others: ("", Vec::new()),
        balance: 0.28,
        residual: 0.015,
    });
    if let Some(data) = data {
        // The first three of a class measure the distance of another class.
        let others = |name, folder: &str, ending| -> Outcome<(&str, Vec<PathBuf>)> {
            let mut found = files(&data.join(folder), ending)?;
            found.truncate(3);
            Ok((name, found))
        };
        let bones = || others("Bone", "mpeg7/Bone", ".png");
        let real = |name, folder: &str, ending, options, others| -> Outcome<Set> {
            Ok(Set {
                name,
                files: files(&data.join(folder), ending)?,
                options,
                others,
                balance: f64::INFINITY,
                residual: f64::INFINITY,
            })
        };
        let rigid = &["--align", "rigid"];
        let mut hands = real("hands", "hands/mask512", ".png", rigid, bones()?)?;
        hands.files.retain(|file| open(file));
        sets.push(hands);
        sets.push(real(
            "fish-roundfish",
            "fish-roundfish",
            ".png",
            rigid,
            bones()?,
        )?);
        sets.push(real("device7", "mpeg7/device7", ".png", rigid, bones()?)?);
        sets.push(real(
            "hippocampi",
            "hippocampus/labels",
            ".nii.gz",
            &["--grid", "65"],
            others("adrenal gland", "adrenal", ".nii.gz")?,
        )?);
    }
    let mut table = Table::new([
        "shapes",
        "ratios of the eigenvalues",
        "balance",
        "definite",
        "residual of (1 - u)(S), largest",
        "RMS of d_M / expected",
        "d_M left out, largest",
        "d_M of another class",
        "seconds: average, modes",
    ]);
    for (k, set) in sets.iter().enumerate() {
        measure(set, &place.join(k.to_string()), &mut table)?;
    }
    std::fs::remove_dir_all(&place)?;
    Ok(Section {
        title: "Modes of variation",
        text: "`shapespace average SHAPES --length-weight 1e-5 --tolerance 2e-4`, with `--align \
               rigid` for pictures and `--grid 65` for volumes, then `shapespace pca`. Bars have \
               one mode and balanced stresses, crosses two modes. Of the hands, three with closed \
               fingers are left out: the gaps are lost on the grid. The root mean square of the \
               Mahalanobis distances is `sqrt((n-1)/n)`. The Mahalanobis distances of three shapes \
               of another class, scored with `--size equal`, must be three times as large as that \
               of any shape in the modes of the others.",
        table,
        chart: None,
    })
}

fn text(path: &Path) -> Outcome<&str> {
    Ok(path.to_str().ok_or("a path that is no text")?)
}

fn program(arguments: &[&str]) -> Outcome<()> {
    // The program is in the folder of this one.
    let program = std::env::current_exe()?.with_file_name("shapespace");
    let output = Command::new(program).args(arguments).output()?;
    if output.status.success() {
        Ok(())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned().into())
    }
}

fn record(folder: &Path) -> Outcome<Value> {
    Ok(serde_json::from_str(&std::fs::read_to_string(
        folder.join("result.json"),
    )?)?)
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().cloned().unwrap_or_default();
    list.iter()
        .map(|x| x.as_f64().unwrap_or(f64::NAN))
        .collect()
}

fn measure(set: &Set, place: &Path, table: &mut Table) -> Outcome<()> {
    let (average, modes) = (
        place.with_extension("average"),
        place.with_extension("modes"),
    );
    let mut arguments = vec!["average"];
    for file in &set.files {
        arguments.push(text(file)?);
    }
    arguments.extend(AVERAGE);
    arguments.extend(set.options);
    arguments.extend(["--allow-doubtful", "-o", text(&average)?]);
    program(&arguments)?;
    let modes_of = ["pca", text(&average)?, "-o", text(&modes)?];
    program(&[&modes_of[..], &["--allow-doubtful"]].concat())?;
    let (made, record) = (record(&average)?, record(&modes)?);
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let ratios = numbers(&record["ratios"]);
    let shown: Vec<String> = ratios.iter().take(4).map(|r| format!("{r:.3}")).collect();
    let one = set.name != "bars" || ratios.get(1).is_some_and(|r| r.abs() < 1e-10);
    let two =
        set.name != "crosses" || ((0.36..0.43).contains(&ratios[1]) && ratios[2].abs() < 1e-3);
    let largest = |list: &Value| numbers(list).into_iter().fold(0.0, f64::max);
    let (balance, residual) = (number(&record["balance"]), largest(&record["procrustes"]));
    let n = set.files.len() as f64;
    let rms = number(&record["mahalanobis_over_n_rms"]) / ((n - 1.0) / n).sqrt();
    let definite = record["definite"] == true;
    let left_out = record["quality"]["left_out"]
        .as_array()
        .into_iter()
        .flatten();
    let left_out = left_out.map(|scores| number(&scores["mahalanobis"]));
    let left_out = left_out.fold(0.0, f64::max);
    table.row([
        format!("{} ({})", set.name, set.files.len()),
        checked(shown.join(" "), one && two),
        checked(format!("{:.1} %", 100.0 * balance), balance <= set.balance),
        if definite { "yes" } else { "no" }.to_owned(),
        checked(format!("{residual:.4}"), residual <= set.residual),
        checked(format!("{rms:.6}"), (rms - 1.0).abs() < 1e-6),
        format!("{left_out:.2}"),
        others(set, &modes, 3.0 * left_out)?,
        format!(
            "{:.0}, {:.0}",
            number(&made["seconds"]),
            number(&record["seconds"])
        ),
    ]);
    Ok(())
}

/// The Mahalanobis distances of shapes of another class, which must exceed a bound.
fn others(set: &Set, modes: &Path, bound: f64) -> Outcome<String> {
    let (name, files) = &set.others;
    if files.is_empty() {
        return Ok("-".to_owned());
    }
    let scored = modes.with_extension("scored");
    let mut arguments = vec!["score"];
    for file in files {
        arguments.push(text(file)?);
    }
    arguments.extend([
        "--pca",
        text(modes)?,
        "--size",
        "equal",
        "--allow-doubtful",
        "-o",
        text(&scored)?,
    ]);
    program(&arguments)?;
    let distances = numbers(&record(&scored)?["mahalanobis"]);
    let words: Vec<String> = distances.iter().map(|d| format!("{d:.1}")).collect();
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(checked(
        format!("{name}: {}", words.join(", ")),
        least >= bound,
    ))
}

/// Hands whose fingers are closed: the gaps between them are lost on the grid.
const CLOSED: [&str; 3] = ["hand-p1-06", "hand-p2-05", "hand-p2-06"];

/// Whether a file is that of a hand with open fingers.
fn open(file: &Path) -> bool {
    let name = file.file_stem().unwrap_or_default();
    CLOSED.iter().all(|closed| name != *closed)
}

/// Nodes along every axis for the hands.
const NODES: usize = 129;

/// Modes of hands compared with modes of their landmarks: reconstruction of shapes that are left
/// out.
pub fn landmarks(data: &Path) -> Outcome<Section> {
    let mut masks = files(&data.join("hands/mask512"), ".png")?;
    masks.retain(|file| open(file));
    let [stress, finite] = elastic_generalisation(&masks)?;
    let points = landmark_generalisation(&data.join("hands/contours"))?;
    let mut table = Table::new(["modes", "of stresses", "of displacements", "landmarks"]);
    let longest = stress.len().min(finite.len()).min(points.len());
    for m in (0..longest).step_by(2) {
        let better = finite[m] < points[m];
        table.row([
            m.to_string(),
            format!("{:.2} %", 100.0 * stress[m]),
            checked(format!("{:.2} %", 100.0 * finite[m]), better),
            format!("{:.2} %", 100.0 * points[m]),
        ]);
    }
    Ok(Section {
        title: "Hands: elastic modes and a point distribution model",
        text: "Each of 17 hands (three with closed fingers are left out: the gaps are lost on the \
               grid) is reconstructed from the modes of the others: root mean square distance of \
               the boundary after a rigid motion, relative to its distance from the centroid. The \
               landmarks are 56 points placed manually in every photograph, aligned by generalised \
               Procrustes analysis; the elastic modes use the masks only. Modes of displacements \
               (`pca --variation displacement`) must be better than landmarks.",
        table,
        chart: None,
    })
}

/// Root mean square of the reconstruction error over the hands, with `m = 0, 1, ...` modes of the
/// others: modes of stresses, and of displacements.
fn elastic_generalisation(files: &[PathBuf]) -> Outcome<[Vec<f64>; 2]> {
    let shapes = aligned_files(files, NODES)?;
    let params = AverageParams {
        length_weight: Some(1e-5),
        tolerance: 2e-4,
        ..AverageParams::default()
    };
    let result = average(&shapes, &params, &mut fe_grid::minimise::Silent)?;
    let average = Average::of_result(&result, &params)?;
    let of = |variation| reconstruction_errors(&average, variation);
    Ok([of(Variation::Stress)?, of(Variation::Displacement)?])
}

fn reconstruction_errors(average: &Average<2>, variation: Variation) -> Outcome<Vec<f64>> {
    let params = PcaParams {
        variation,
        ..PcaParams::default()
    };
    let compound = Compound::new(average, &params)?;
    let pca = Pca::new(average, &compound, usize::MAX, &mut Silent)?;
    let n = average.n_shapes();
    let mut squares = vec![0.0; n - 1];
    for i in 0..n {
        let own = contour(&average.indicators()[i], 0.5, BoxEdge::Closed)?;
        for (m, combination) in left_out(&pca.gram, i)?.into_iter().enumerate() {
            let mut made = fe_grid::VectorField::zeros(*average.grid());
            for (a, u) in combination.iter().zip(&pca.displacements) {
                fe_grid::vector::axpy(*a, u.as_slice(), made.as_mut_slice());
            }
            let made = pca.space.from_average(made);
            let back = own
                .displaced(&average.displacements()[i], 1.0)
                .displaced(&made, -1.0);
            squares[m] += Procrustes::new(back.points(), own.points())
                .residual
                .powi(2);
        }
    }
    Ok(squares.into_iter().map(|s| (s / n as f64).sqrt()).collect())
}

/// Reconstructions of a displacement from the mean and the first `m = 0, 1, ...` modes of the
/// others, as combinations of their displacements.
fn left_out(gram: &DMatrix<f64>, i: usize) -> Outcome<Vec<Vec<f64>>> {
    let all = gram.nrows();
    let others: Vec<usize> = (0..all).filter(|&j| j != i).collect();
    let n = others.len() as f64;
    let mean = |a: usize| others.iter().map(|&j| gram[(a, j)]).sum::<f64>() / n;
    let means: Vec<f64> = (0..all).map(mean).collect();
    let square = others.iter().map(|&j| means[j]).sum::<f64>() / n;
    let centred = |a: usize, b: usize| gram[(a, b)] - means[a] - means[b] + square;
    let own = DMatrix::from_fn(others.len(), others.len(), |a, b| {
        centred(others[a], others[b])
    });
    let weights = vec![1.0 / n; others.len()];
    let modes = Modes::new(&own, &weights, 1e-10, usize::MAX)?;
    let mut combination = vec![0.0; all];
    for &j in &others {
        combination[j] = 1.0 / n;
    }
    let mut found = vec![combination.clone()];
    for mode in &modes.combinations {
        let terms = mode.iter().zip(&others);
        let product: f64 = terms.map(|(a, &j)| a * centred(i, j)).sum();
        let sum: f64 = mode.iter().sum();
        for (a, &j) in mode.iter().zip(&others) {
            combination[j] += product * (a - sum / n);
        }
        found.push(combination.clone());
    }
    Ok(found)
}

/// The same for landmarks, each hand scaled as its mask is: to one longest side.
fn landmark_generalisation(folder: &Path) -> Outcome<Vec<f64>> {
    let mut hands = Vec::new();
    for file in files(folder, ".csv")?.into_iter().filter(|file| open(file)) {
        let text = std::fs::read_to_string(file)?;
        let points: Option<Vec<[f64; 2]>> = text
            .lines()
            .skip(1)
            .map(|line| {
                let (x, y) = line.split_once(',')?;
                Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
            })
            .collect();
        hands.push(scaled(
            &points.ok_or("a contour that is no table of points")?,
        ));
    }
    let mut mean = hands[0].clone();
    for _ in 0..10 {
        for hand in &mut hands {
            let fit = Procrustes::new(hand, &mean);
            *hand = hand.iter().map(|p| fit.motion.map(*p)).collect();
        }
        mean = (0..mean.len())
            .map(|k| {
                [0, 1].map(|c| hands.iter().map(|h| h[k][c]).sum::<f64>() / hands.len() as f64)
            })
            .collect();
    }
    let n = hands.len();
    let count = mean.len() as f64;
    let gram = DMatrix::from_fn(n, n, |i, j| {
        let pairs = hands[i].iter().zip(&hands[j]);
        pairs.map(|(p, q)| p[0] * q[0] + p[1] * q[1]).sum::<f64>() / count
    });
    let spread = |hand: &Vec<[f64; 2]>| -> f64 {
        let c = [0, 1].map(|c| hand.iter().map(|p| p[c]).sum::<f64>() / count);
        let squares = hand
            .iter()
            .map(|p| (p[0] - c[0]).powi(2) + (p[1] - c[1]).powi(2));
        squares.sum::<f64>() / count
    };
    let size = (hands.iter().map(spread).sum::<f64>() / n as f64).sqrt();
    let quality = Quality::new(&gram, &vec![1.0 / n as f64; n], 1e-10, usize::MAX)?;
    Ok(quality.generalisation.iter().map(|e| e / size).collect())
}

/// Points whose longest side is one.
fn scaled(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let extent = |c: usize| {
        let values = || points.iter().map(|p| p[c]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let side = extent(0).max(extent(1));
    points.iter().map(|p| p.map(|x| x / side)).collect()
}
