//! Surfaces of other programs are read as these wrote them, and ours are read by them. The tests print
//! a reason and pass where Python lacks a module.

use crate::common::ball::Mesh;
use crate::common::{Place, Results, succeeded};
use crate::formats::{python, run_script};
use crate::meshes::{measured, solid};

const WRITE: &str = include_str!("files/write_surfaces.py");
const READ: &str = include_str!("files/read_surfaces.py");
const MODULES: &str = "numpy, trimesh, vtk, meshio";

#[test]
fn surfaces_of_other_programs_have_their_distances() {
    let Some(program) = python(MODULES) else {
        return;
    };
    let place = Place::new();
    let written = run_script(&program, &place, WRITE, &[]);
    let numbers = |key: &str| -> Vec<f64> {
        let list = written[key].as_array().unwrap().iter();
        list.map(|x| x.as_f64().unwrap()).collect()
    };
    let expected = numbers("distances");
    let places: Vec<[f64; 3]> = serde_json::from_value(written["places"].clone()).unwrap();
    let mut count = 0;
    for name in place.listing() {
        let image = solid(&std::fs::read(place.path(&name)).unwrap(), &name);
        assert_eq!(image.remark, None, "{name}");
        assert!(image.outline.is_some(), "{name}");
        let (volume, found) = measured(&image, &places);
        // Text of VTK has six digits, of coordinates up to 60.
        let volume_stated = written["volume"].as_f64().unwrap();
        assert!(
            (volume / volume_stated - 1.0).abs() < 1e-5,
            "{name}: {volume}"
        );
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() < 2e-4,
                "{name}: {found} {expected}"
            );
        }
        count += 1;
    }
    // 5 of trimesh, 3 of meshio, 6 and 24 of VTK.
    assert_eq!(count, 38);
}

#[test]
fn averages_are_surfaces_elsewhere() {
    let Some(program) = python(MODULES) else {
        return;
    };
    let place = Place::new();
    for (name, x) in [("a.ply", 20.0), ("b.ply", 21.0)] {
        let ball = Mesh::ball([x, -35.0, 41.0], 9.0, 32);
        place.write(name, &ball.ply("ascii", ""));
    }
    let command = ["average", "a.ply", "b.ply", "--grid", "17", "-o", "out"];
    succeeded(&place.compute(&[&command[..], &["--align", "none"]].concat()));
    let volume = Results::read(&place.path("out")).number("/average/volume_input_units");
    let read = run_script(&program, &place, READ, &["out".into()]);
    assert_eq!(read["space"], "RAS");
    let found = read["found"].as_object().unwrap();
    assert_eq!(found.len(), 6);
    for (name, values) in found {
        // VTK's formula for volumes is another one, accurate to this for a coarse surface.
        let share = values[0].as_f64().unwrap() / volume;
        assert!((share - 1.0).abs() < 1e-3, "{name}: {share}");
        assert_eq!(values[1], true, "{name} is open");
        let low = values[2][0][0].as_f64().unwrap();
        assert!((11.0..13.0).contains(&low), "{name}: {low}");
    }
}
