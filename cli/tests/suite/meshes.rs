//! Surfaces and outlines as inputs.

use std::path::Path;
use std::process::Output;

use levelset::{ContourDistance, Moments};
use shapespace_input::lattice::Lattice;
use shapespace_input::place::physical_frames;
use shapespace_input::{
    AnyImage, Image, InputError, Numbers, ReadOptions, Sources, boundary, decode_image,
};
use test_support::cuboid;

use crate::common::ball::Mesh;
use crate::common::solid::{SOLID, lattice, mapped, nifti_of};
use crate::common::{Place, Results, succeeded};

/// The report of a run that is refused.
fn refused(run: &Output) -> String {
    assert_eq!(run.status.code(), Some(2));
    // Reports are wrapped to the width of the terminal.
    let report = String::from_utf8_lossy(&run.stderr);
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn ball() -> Mesh {
    Mesh::ball([20.0, -35.0, 41.0], 9.0, 24)
}

fn read(bytes: &[u8], name: &str) -> Result<AnyImage, InputError> {
    decode_image(bytes, name.as_ref(), &ReadOptions::default())
}

fn read_numbers(path: &Path) -> Result<Numbers, InputError> {
    Sources::files().read_numbers(path)
}

/// The mask of a surface, in the world.
pub fn solid(bytes: &[u8], name: &str) -> Image<3> {
    match read(bytes, name) {
        Ok(AnyImage::D3(image)) => image.in_world().unwrap(),
        other => panic!("{name}: {other:?}"),
    }
}

/// The volume of the boundary of an image, and the distances of points to it, positive inside.
pub fn measured(image: &Image<3>, points: &[[f64; 3]]) -> (f64, Vec<f64>) {
    let frame = physical_frames(std::slice::from_ref(image))[0];
    let drawn = boundary(image, &frame).unwrap();
    assert!(drawn.is_closed());
    let volume = Moments::of_contour(&drawn).unwrap().volume / frame.scale().powi(3);
    let distance = ContourDistance::new(&drawn).unwrap();
    let world = |p: [f64; 3]| {
        let origin = frame.to_physical([0.0; 3]);
        std::array::from_fn(|k| (p[k] - origin[k]) * frame.scale())
    };
    let to = |&point: &[f64; 3]| distance.signed_distance(world(point)) / frame.scale();
    (volume, points.iter().map(to).collect())
}

/// The same for one point.
fn measured_at(image: &Image<3>, point: [f64; 3]) -> (f64, f64) {
    let (volume, distances) = measured(image, &[point]);
    (volume, distances[0])
}

/// Files of every kind, with the statement that coordinates are LPS or without.
fn files(mesh: &Mesh, left: bool) -> Vec<(&'static str, Vec<u8>)> {
    let (space, field) = if left {
        let letters = "<FieldData><DataArray type=\"String\" Name=\"SPACE\" format=\"ascii\">76 80 83 \
                       0</DataArray></FieldData>";
        ("SPACE=LPS", letters)
    } else {
        ("", "")
    };
    let remark = format!("comment made {space}\n");
    let mut files = vec![
        ("a.stl", mesh.stl(&format!("solid by hand {space}"))),
        ("b.ply", mesh.ply("ascii", &remark)),
        ("c.ply", mesh.ply("binary_little_endian", &remark)),
        ("d.ply", mesh.ply("binary_big_endian", &remark)),
        ("e.obj", mesh.obj(space)),
        ("n.vtp", mesh.vtp("ascii", false, field)),
        ("o.vtp", mesh.vtp("binary", false, field)),
        ("p.vtp", mesh.vtp("appended", false, field)),
        ("q.vtp", mesh.vtp("appended", true, field)),
    ];
    for (binary, new) in [(false, false), (false, true), (true, false), (true, true)] {
        files.push(("f.vtk", mesh.vtk(binary, new, &format!("ball {space}"))));
    }
    if !left {
        files.push(("m.stl", mesh.stl_text()));
    }
    files
}

#[test]
fn every_format_gives_the_same_surface() {
    let ball = ball();
    let files_here = files(&ball, false);
    assert_eq!(files_here.len(), 14);
    let point = [23.0, -33.5, 40.0];
    let mut first = None;
    for (name, bytes) in files_here {
        let image = solid(&bytes, name);
        assert_eq!(image.remark, None, "{name}");
        let (volume, distance) = measured_at(&image, point);
        // Coordinates are those of single precision; the rest is rounding in the unit box.
        assert!(
            (volume / ball.volume() - 1.0).abs() < 1e-9,
            "{name}: {volume}"
        );
        let expected = *first.get_or_insert(distance);
        assert!((distance - expected).abs() < 1e-9, "{name}: {distance}");
        // Inside the facets of a ball of radius 9, at a depth of about 9 - |p - c|.
        let depth = 9.0 - (9.0f64 + 2.25 + 1.0).sqrt();
        assert!(
            (depth - 0.2..depth).contains(&distance),
            "{name}: {distance}"
        );
    }
    let mut mirrored = ball.clone();
    for p in &mut mirrored.points {
        *p = [-p[0], -p[1], p[2]];
    }
    for (name, bytes) in files(&mirrored, true) {
        let (volume, distance) = measured_at(&solid(&bytes, name), point);
        assert!(
            (volume / ball.volume() - 1.0).abs() < 1e-9,
            "{name}: {volume}"
        );
        assert!(
            (distance - first.unwrap()).abs() < 1e-9,
            "{name}: {distance}"
        );
    }
}

#[test]
fn orientations_are_mended() {
    let ball = ball();
    let mut inverted = ball.clone();
    for t in &mut inverted.triangles {
        t.swap(0, 1);
    }
    let mut mixed = ball.clone();
    for t in mixed.triangles.iter_mut().step_by(3) {
        t.swap(0, 1);
    }
    let mut doubled = ball.clone();
    doubled.triangles.extend(ball.triangles[10..20].iter());
    for (mesh, words) in [
        (inverted, Some("normals turned outwards")),
        (mixed, Some("turned as their neighbours are")),
        (doubled, None),
    ] {
        let image = solid(&mesh.ply("ascii", ""), "a.ply");
        let remark = image.remark.clone().unwrap_or_default();
        assert!(remark.contains(words.unwrap_or_default()), "{remark}");
        assert_eq!(remark.is_empty(), words.is_none());
        let (volume, distance) = measured_at(&image, [20.0, -35.0, 41.0]);
        assert!((volume / ball.volume() - 1.0).abs() < 1e-9, "{volume}");
        assert!((8.8..9.0).contains(&distance), "{distance}");
    }
}

#[test]
fn a_cavity_stays_one() {
    let ball = ball();
    let mut cavity = Mesh::ball([21.0, -35.0, 41.0], 4.0, 16);
    for t in &mut cavity.triangles {
        t.swap(0, 1);
    }
    let both = ball.clone().joined(&cavity);
    let image = solid(&both.stl(""), "a.stl");
    let (volume, distance) = measured_at(&image, [21.0, -35.0, 41.0]);
    assert!((volume / (ball.volume() + cavity.volume()) - 1.0).abs() < 1e-9);
    // Outside, in the middle of the cavity.
    assert!((-4.0..-3.8).contains(&distance), "{distance}");
}

#[test]
fn small_holes_are_closed_and_large_ones_counted() {
    let mut mesh = ball();
    // The triangles around a pole: a hole of 24 edges, 9 sin(15°) in radius.
    let whole = mesh.clone();
    mesh.triangles.retain(|t| !t.contains(&0));
    let error = read(&mesh.stl(""), "bowl.stl").unwrap_err().to_string();
    let words = "'bowl.stl' is not closed: 1 holes with 24 open edges, the widest 6.588 across, where \
                 holes up to 3.100 are closed; 0 edges have more than two triangles";
    assert_eq!(error, words);
    let fine = Mesh::ball([20.0, -35.0, 41.0], 9.0, 64);
    let mut small = fine.clone();
    small.triangles.retain(|t| !t.contains(&700));
    let image = solid(&small.stl(""), "a.stl");
    let remark = image.remark.clone().unwrap();
    assert!(
        remark.starts_with("1 hole of 6 open edges closed"),
        "{remark}"
    );
    let (volume, _) = measured_at(&image, [20.0, -35.0, 41.0]);
    let share = volume / fine.volume();
    assert!((0.9995..0.99999).contains(&share), "{share}");
    // Corners that differ by rounding do not open a surface.
    let mut loose = whole.stl("");
    for (k, byte) in loose[84..].iter_mut().enumerate() {
        // The lowest byte of the x coordinate of the first corner of each triangle.
        if k % 50 == 12 {
            *byte ^= 1;
        }
    }
    assert_eq!(solid(&loose, "a.stl").remark, None);
    let mut flat = whole;
    flat.triangles.truncate(1);
    let back = flat.triangles[0];
    flat.triangles.push([back[1], back[0], back[2]]);
    let error = read(&flat.stl(""), "flat.stl").unwrap_err();
    assert!(matches!(error, InputError::FlatSurface { .. }), "{error}");
}

/// Two balls of radius 9 whose middles are 9 apart have a lens of volume `5/12 pi r^3` in common.
#[test]
fn surfaces_that_cross_enclose_their_union() {
    let centre = |x: f64| Mesh::ball([x, -35.0, 41.0], 9.0, 64);
    let both = centre(20.0).joined(&centre(29.0));
    let image = solid(&both.stl(""), "a.stl");
    assert_eq!(image.outline, None);
    let r3 = 9.0f64.powi(3) * std::f64::consts::PI;
    let expected = (8.0 / 3.0 - 5.0 / 12.0) * r3;
    let (volume, distance) = measured_at(&image, [24.5, -35.0, 41.0]);
    // The facets take 4e-3 away; the samples are 27 / 128 apart.
    let share = volume / expected;
    assert!((0.994..0.999).contains(&share), "{share}");
    // In the middle of the lens the waist is 7.79 away, the surfaces inside half as far.
    assert!((7.6..7.9).contains(&distance), "{distance}");
}

/// The boundary does not depend on samples: a surface has one distance at any grid, and lies where a
/// volume of the same object does.
#[test]
fn surfaces_and_volumes_of_one_object_overlay() {
    let place = Place::new();
    let axes = [[0.8, 0.0, 0.0], [0.0, 0.8, 0.0], [0.0, 0.0, 0.8]];
    let size = [40, 40, 36];
    SOLID.write(&place, "a.nii", size, &lattice(axes, size));
    let common = ["--grid", "17", "--max-iterations", "2"];
    let first = ["average", "a.nii", "a.nii", "--align", "none", "-o", "one"];
    succeeded(&place.compute(&[&first[..], &common[..]].concat()));
    for extension in ["stl", "ply", "vtp"] {
        let name = format!("b.{extension}");
        std::fs::copy(
            place.path(&format!("one/average.{extension}")),
            place.path(&name),
        )
        .unwrap();
    }
    let inputs = ["average", "b.stl", "b.ply", "b.vtp", "a.nii"];
    let options = ["--align", "none", "--like", "a.nii", "-o", "two"];
    let output = place.compute(&[&inputs[..], &options[..], &common[..]].concat());
    succeeded(&output);
    let results = Results::read(&place.path("two"));
    assert_eq!(results.json["parameters"]["frame"], "physical");
    // The phase field of 17 nodes rounds the volume off; surfaces of it are alike.
    let volume = |i: usize| results.number(&format!("/input/{i}/volume_input_units"));
    assert!((volume(0) / volume(1) - 1.0).abs() < 1e-5);
    assert!((volume(1) / volume(2) - 1.0).abs() < 1e-12);
    assert!((volume(0) / volume(3) - 1.0).abs() < 0.1);
    assert!(results.number("/mean_dice") > 0.93);
    // Surfaces are no images, and have no labels.
    let report = refused(&place.run(&["segment", "b.ply", "-o", "x"]));
    assert!(
        report.contains("'b.ply' is a surface or an outline, not an image"),
        "{report}"
    );
    let labels = ["average", "b.ply", "b.stl", "--label", "1", "-o", "x"];
    let report = refused(&place.run(&labels));
    assert!(report.contains("has no labels"), "{report}");
    let mixed = ["average", "b.ply", "square.csv", "-o", "x"];
    place.write("square.csv", b"0,0\n1,0\n1,1\n0,1\n");
    let report = refused(&place.run(&mixed));
    assert!(report.contains("is a picture, but"), "{report}");
}

/// The distance of an average is right at all samples, also where the lattice of the input that leads
/// is turned against the grid and its corners lie outside.
#[test]
fn distances_on_turned_lattices_are_exact_outside_of_the_grid() {
    let place = Place::new();
    let (centre, radius) = ([20.0, -35.0, 41.0], 9.0);
    place.write("ball.ply", &Mesh::ball(centre, radius, 64).ply("ascii", ""));
    let (c, s) = (2.0 * 0.6, 2.0 * 0.8);
    let axes = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 2.0]];
    let size = [14; 3];
    let mut affine = lattice(axes, size);
    for (row, shift) in affine.iter_mut().zip([6.0, -5.0, -3.0]) {
        row[3] += shift;
    }
    let depth = |p: [f64; 3]| {
        let square: f64 = (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum();
        radius - square.sqrt()
    };
    let values: Vec<f32> = (0..size.iter().product::<usize>())
        .map(|i| {
            let sample = [i % 14, i / 14 % 14, i / 196].map(|n| n as f64);
            (0.5 + 0.25 * depth(mapped(&affine, sample))).clamp(0.0, 1.0) as f32
        })
        .collect();
    place.write("turned.nii", &nifti_of(size, &affine, &values));
    let inputs = ["average", "ball.ply", "turned.nii", "--like", "turned.nii"];
    let options = [
        "--align",
        "none",
        "--grid",
        "33",
        "--max-iterations",
        "1",
        "-o",
        "out",
    ];
    succeeded(&place.compute(&[&inputs[..], &options].concat()));
    let found = read_numbers(&place.path("out/average_distance.nii.gz")).unwrap();
    let lattice = Lattice {
        size: found.size.as_slice().try_into().unwrap(),
        affine: found.affine.unwrap(),
    };
    let mut furthest = 0.0f64;
    for (i, value) in found.values.iter().enumerate() {
        let expected = depth(lattice.position(i));
        // Grid spacing .8 mm: the average is not rounder than that, nor its middle sharper.
        assert!((value - expected).abs() < 0.8, "{value} {expected}");
        furthest = furthest.min(expected);
    }
    // The half diagonal of the part of the box is 20 mm, that of the lattice around it more.
    assert!(furthest < -12.0, "{furthest}");
}

/// A segmented volume has its mask and its surface where the volume lies.
#[test]
fn segmented_objects_stay_in_the_world() {
    let place = Place::new();
    let axes = [[0.0, 1.2, 0.0], [-1.2, 0.0, 0.0], [0.0, 0.0, 1.2]];
    let size = [24, 28, 24];
    let affine = lattice(axes, size);
    SOLID.write(&place, "a.nii", size, &affine);
    succeeded(&place.compute(&["segment", "a.nii", "--grid", "17", "-o", "out"]));
    let mask = read_numbers(&place.path("out/mask_a.nii.gz")).unwrap();
    assert_eq!(mask.size, size);
    for (found, expected) in mask.affine.unwrap().iter().zip(affine) {
        for k in 0..4 {
            assert!((found[k] - expected[k]).abs() < 1e-4, "{found:?}");
        }
    }
    let image = solid(
        &std::fs::read(place.path("out/surface_a.stl")).unwrap(),
        "a.stl",
    );
    // Normals point outwards although the axes are exchanged.
    assert_eq!(image.remark, None);
    let (volume, _) = measured(&image, &[]);
    let of_mask = mask.values.iter().sum::<f64>() * 1.2f64.powi(3);
    assert!((volume / of_mask - 1.0).abs() < 0.05, "{volume} {of_mask}");
    // The middle of a ball of the solid, and a point outside.
    let (_, distances) = measured(&image, &[[10.0, -34.0, 40.0], [10.0, -22.0, 49.0]]);
    assert!(distances[0] > 2.0 && distances[1] < -2.0, "{distances:?}");
}

fn flat(text: &str, name: &str) -> (Image<2>, f64) {
    let image = match read(text.as_bytes(), name) {
        Ok(AnyImage::D2(image)) => image,
        other => panic!("{name}: {other:?}"),
    };
    let frame = shapespace_input::place::fit_frames(std::slice::from_ref(&image), None)[0];
    let drawn = boundary(&image, &frame).unwrap();
    assert!(drawn.is_closed());
    let area = Moments::of_contour(&drawn).unwrap().volume / frame.scale().powi(2);
    (image, area)
}

#[test]
fn outlines_have_their_areas() {
    let outer = "0,0\n0,9\n9,9\n9,0\n0,0\n";
    let inner = ["\n3,3\n6,3\n6,6\n3,6\n", "\n3,3\n3,6\n6,6\n6,3\n"];
    for inner in inner {
        let (image, area) = flat(&format!("{outer}{inner}"), "a.csv");
        // Exact, in either sense of both curves.
        assert!((area - 72.0).abs() < 1e-9, "{area}");
        assert!(image.outline.is_some());
        let middle = image.values.get(image.index([256, 256]));
        assert_eq!(middle, 0.0);
    }
    // Squares that cross are cut where they do; what both enclose is no part of the object.
    let (_, area) = flat("0,0\n9,0\n9,9\n0,9\n\n5,5\n14,5\n14,14\n5,14\n", "a.csv");
    assert!((area - 130.0).abs() < 1e-9, "{area}");
    let svg = |rule: &str| {
        let star = "M0 -10L5.878 8.09L-9.511 -3.09L9.511 -3.09L-5.878 8.09Z";
        format!("<svg><path fill-rule='{rule}' d='{star}'/></svg>")
    };
    // A pentagram whose corners lie on a circle of radius 10, with and without its pentagon.
    let (_, whole) = flat(&svg("nonzero"), "a.svg");
    let (_, points) = flat(&svg("evenodd"), "a.svg");
    assert!((whole - 112.257).abs() < 1e-2, "{whole}");
    assert!((whole - points - 34.69).abs() < 1e-2, "{points}");
    // Shapes are painted over each other, each by its own rule: a ring, a square beside it that is drawn the
    // other way round, and one over a part of the ring and of its hole.
    let ring = "<path fill-rule='evenodd' d='M0 0h9v9h-9zM3 3h3v3h-3z'/>";
    let beside = "<path d='M20 0v4h4v-4z'/>";
    let over = "<g fill-rule='nonzero'><path d='M2 4v1h2v-1z'/></g>";
    let (image, area) = flat(&format!("<svg>{ring}{beside}</svg>"), "a.svg");
    assert!(image.outline.is_some());
    assert!((area - 88.0).abs() < 1e-9, "{area}");
    let (_, area) = flat(&format!("<svg>{over}{ring}{beside}</svg>"), "a.svg");
    assert!((area - 89.0).abs() < 1e-9, "{area}");
}

/// What lies inside of an object is not its boundary: the distance in the middle is that to the rim.
#[test]
fn outlines_with_a_common_edge_have_no_slit() {
    let rectangles = "0,0\n40,0\n40,30\n0,30\n\n40,0\n60,0\n60,30\n40,30\n";
    let first = "<rect x='20' y='20' width='40' height='30'/>";
    let second = "<rect x='60' y='20' width='20' height='30'/>";
    let drawing = format!("<svg>{first}{second}</svg>");
    for (text, name) in [(rectangles, "a.csv"), (&drawing, "a.svg")] {
        let (image, area) = flat(text, name);
        assert!((area - 1800.0).abs() < 1e-9, "{area}");
        let outline = image.outline.unwrap();
        let length = image.spacing[0] * outline.perimeter();
        assert!((length - 180.0).abs() < 1e-9, "{length}");
    }
    // A ring of two circles of arcs whose ends differ by rounding.
    let circle = |r: u32| format!("M-{r} 0A{r} {r} 0 1 0 {r} 0A{r} {r} 0 1 0-{r} 0Z");
    for turn in 0..90 {
        let place = format!("translate(50 50) rotate({turn}) scale(2 1)");
        let path = format!(
            "<path fill-rule='evenodd' d='{}{}'/>",
            circle(15),
            circle(5)
        );
        let ring = format!("<svg><g transform='{place}'>{path}</g></svg>");
        let (_, area) = flat(&ring, "ring.svg");
        let share = area / (400.0 * std::f64::consts::PI);
        assert!((0.999..1.0001).contains(&share), "{turn}: {share}");
    }
}

/// Blocks that touch in a part of a face, or overlap by less than a sample, are one object without a wall inside.
#[test]
fn surfaces_that_touch_in_a_part_of_a_face_have_no_wall() {
    let block = |low: [f64; 3], high: [f64; 3]| {
        let (points, triangles) = cuboid(low, high);
        Mesh { points, triangles }
    };
    let large = block([0.0; 3], [4.0, 3.0, 3.0]);
    for start in [4.0, 3.99] {
        let both = large
            .clone()
            .joined(&block([start, 0.5, 0.5], [6.0, 2.5, 2.5]));
        let image = solid(&both.stl(""), "a.stl");
        let remark = image.remark.clone().unwrap_or_default();
        assert!(remark.contains("unite the parts"), "{remark}");
        // The wall would be at no distance; the corner of the smaller block is 1 away.
        let (volume, distance) = measured_at(&image, [4.0, 1.5, 1.5]);
        assert!((volume / 44.0 - 1.0).abs() < 2e-3, "{volume}");
        assert!((distance - 1.0).abs() < 0.05, "{distance}");
    }
    let apart = large.joined(&block([4.2, 0.5, 0.5], [6.0, 2.5, 2.5]));
    let image = solid(&apart.stl(""), "a.stl");
    assert!(image.outline.is_some() && image.remark.is_none());
}

#[test]
fn outlines_are_written_and_read_back() {
    let place = Place::new();
    let ring = "<svg><path d='M0 0h40v30h-40zM10 10v10h10v-10z'/></svg>";
    place.write("a.svg", ring.as_bytes());
    place.write(
        "b.csv",
        b"x,y\n0,0\n40,0\n40,30\n0,30\n\n10,10\n20,10\n20,20\n10,20\n",
    );
    let options = ["--grid", "33", "--max-iterations", "2", "--align", "none"];
    let average = |inputs: [&str; 2], out: &str| {
        let command = [&["average"], &inputs[..], &options[..], &["-o", out]].concat();
        succeeded(&place.compute(&command));
        Results::read(&place.path(out))
    };
    let results = average(["a.svg", "b.csv"], "one");
    assert_eq!(results.json["outline"]["coordinates"], "input");
    // 1200 less the hole; an average on 33 nodes rounds corners off.
    let area = results.number("/average/area_input_units");
    assert!((area / 1100.0 - 1.0).abs() < 0.03, "{area}");
    let (_, of_table) = flat(
        &std::fs::read_to_string(results.path("average_outline.csv")).unwrap(),
        "average_outline.csv",
    );
    let (_, of_drawing) = flat(
        &std::fs::read_to_string(results.path("average_outline.svg")).unwrap(),
        "average_outline.svg",
    );
    assert!((of_table / area - 1.0).abs() < 1e-4, "{of_table} {area}");
    assert!(
        (of_drawing / area - 1.0).abs() < 1e-4,
        "{of_drawing} {area}"
    );
    let text = std::fs::read_to_string(results.path("average_outline.geojson")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rings = json["features"][0]["geometry"]["coordinates"].as_array();
    assert_eq!(rings.unwrap().len(), 2);
    assert_eq!(json["features"].as_array().unwrap().len(), 1);
}
