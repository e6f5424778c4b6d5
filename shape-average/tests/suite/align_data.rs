//! Alignment of real silhouettes: stars with ten nearly equal arms, bent, ragged and plain.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fe_grid::{Field, Grid};
use levelset::{BoxEdge, Contour, ContourDistance, Moments, contour, dice, largest_component};
use nalgebra::{Rotation2, Vector2};
use shape_average::align::{RigidMotion, align_group};

/// The folder of silhouettes: `shared/data` beside the project, or beside the folder named by
/// `SHAPESPACE_ORACLE`. Says why where there is none.
fn silhouettes() -> Option<PathBuf> {
    let named = std::env::var_os("SHAPESPACE_ORACLE").map(PathBuf::from);
    let beside_oracle = named.and_then(|d| Some(d.parent()?.join("data/mpeg7/device7")));
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let beside = here
        .ancestors()
        .map(|d| d.join("shared/data/mpeg7/device7"));
    let found = beside_oracle.into_iter().chain(beside).find(|d| d.is_dir());
    if found.is_none() {
        println!("skipped: no shared/data/mpeg7/device7 beside the project");
    }
    found
}

/// The outline of a silhouette, scaled to area 0.16 about the middle of the box.
fn outline(path: &Path) -> Contour<2> {
    let mut decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut picture = decoder.read_info().unwrap();
    let mut grey = vec![0; picture.output_buffer_size().unwrap()];
    let frame = picture.next_frame(&mut grey).unwrap();
    assert_eq!(frame.color_type, png::ColorType::Grayscale);
    let size = [frame.width as usize, frame.height as usize];
    let grid = Grid::with_nodes(size, 1.0).unwrap();
    let data = grey.into_iter().map(f64::from).collect();
    let mask = largest_component(&Field::from_vec(grid, data).unwrap(), 127.5).unwrap();
    let outline = contour(&mask, 0.5, BoxEdge::Closed).unwrap();
    let moments = Moments::of_contour(&outline).unwrap();
    let scale = (0.16 / moments.volume).sqrt();
    outline.map(|p| std::array::from_fn(|k| 0.5 + scale * (p[k] - moments.centroid[k])))
}

#[test]
fn turned_stars_of_one_class_meet() {
    let Some(folder) = silhouettes() else { return };
    let grid = Grid::<2>::dyadic(6);
    let mut shapes = Vec::new();
    for i in [1, 2, 5, 9, 13, 16, 19, 20] {
        let outline = outline(&folder.join(format!("device7-{i:02}.png")));
        let rotation = Rotation2::new(0.7 * f64::from(i - 1)).into_inner();
        let middle = Vector2::repeat(0.5);
        let motion = RigidMotion::new(rotation, middle - rotation * middle).unwrap();
        let turned = motion.apply_to_contour(&outline);
        shapes.push(ContourDistance::new(&turned).unwrap().sample(grid));
    }
    let list: Vec<_> = shapes.iter().collect();
    let start = Instant::now();
    let found = align_group(&list).unwrap();
    println!("aligned in {:.2} s", start.elapsed().as_secs_f64());
    let aligned: Vec<_> = found
        .iter()
        .zip(&shapes)
        .map(|(a, u)| a.motion.apply(u))
        .collect();
    let overlap = |set: &[Field<f64, 2, 1>]| {
        let pairs = (0..set.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let values: Vec<f64> = pairs
            .map(|(i, j)| dice(&set[i], 0.0, &set[j], 0.0).unwrap())
            .collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let (before, after) = (overlap(&shapes), overlap(&aligned));
    for a in &found {
        println!(
            "{:8.2} deg, mismatch {:.4}",
            a.motion.angle().to_degrees(),
            a.mismatch
        );
    }
    println!("mean Dice of pairs: {before:.4} turned, {after:.4} aligned");
    assert!(after > 0.85 && after > before + 0.04, "{before} {after}");
}
