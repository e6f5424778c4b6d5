//! Malformed surfaces and outlines, each with a part of its report.

use crate::common::ball::Mesh;
use crate::malformed::Row;

pub fn rows() -> Vec<Row> {
    let ball = Mesh::ball([1.0, 2.0, 3.0], 5.0, 12);
    let stl = ball.stl("");
    let mut many = stl.clone();
    many[80..84].copy_from_slice(&[0xff; 4]);
    let mut nan = stl.clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    let text = ball.stl_text();
    let cut = |bytes: &[u8]| bytes[..bytes.len() - 40].to_vec();
    let ply = |kind: &str| ball.ply(kind, "");
    let replaced = |bytes: Vec<u8>, from: &str, to: &str| {
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
        let at = at.unwrap();
        [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
    };
    let count = ball.points.len();
    let huge = |bytes| replaced(bytes, &format!("vertex {count}"), "vertex 99999999999999");
    let vtk = |binary, new| ball.vtk(binary, new, "");
    let points = format!("POINTS {count}");
    let many_points = |binary| replaced(vtk(binary, true), &points, "POINTS 4000000000000000");
    let vtp = |format: &str, packed| ball.vtp(format, packed, "");
    let obj = |line: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{line}\n").into_bytes();
    vec![
        ("a.stl", Vec::new(), "shorter than a header"),
        ("a.stl", stl[..83].to_vec(), "shorter than a header"),
        ("a.stl", cut(&stl), "bytes of triangles, found"),
        ("a.stl", many, "bytes of triangles, found"),
        ("a.stl", nan, "a.stl"),
        ("a.stl", ball.stl("")[..84].to_vec(), "bytes of triangles"),
        ("a.stl", b"solid\nendsolid\n".to_vec(), "no triangles"),
        (
            "a.stl",
            Mesh::ball([0.0; 3], 1e-6, 12).stl(""),
            "lengths must lie between 1e-4 and 1e8",
        ),
        ("a.stl", cut(&text), "cut off"),
        (
            "a.stl",
            replaced(text.clone(), "vertex", "vertex x"),
            "'x' is not a number",
        ),
        (
            "a.stl",
            replaced(text, "vertex", "corner"),
            "a facet has 2 corners",
        ),
        ("a.ply", Vec::new(), "does not start as one"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\n".to_vec(),
            "header does not end",
        ),
        ("a.ply", b"ply\nend_header\n".to_vec(), "no known format"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nend_header\n".to_vec(),
            "no triangles",
        ),
        ("a.ply", cut(&ply("ascii")), "cut off"),
        ("a.ply", cut(&ply("binary_big_endian")), "cut off"),
        ("a.ply", huge(ply("ascii")), "a.ply"),
        ("a.ply", huge(ply("binary_little_endian")), "a.ply"),
        (
            "a.ply",
            replaced(ply("ascii"), "double z", "quad z"),
            "unknown type 'quad'",
        ),
        (
            "a.ply",
            replaced(ply("ascii"), "double z", "double w"),
            "no x, y and z",
        ),
        (
            "a.ply",
            replaced(ply("ascii"), "vertex_indices", "corners"),
            "no vertex_indices",
        ),
        (
            "a.ply",
            replaced(ply("ascii"), "\n3 0", "\n3 1.5"),
            "1.5 is not the number",
        ),
        (
            "a.ply",
            replaced(ply("ascii"), "\n3 0", "\n3 9999"),
            "names point 9999",
        ),
        (
            "a.ply",
            replaced(ply("ascii"), "\n3 0", "\n3 -1"),
            "-1 is not the number",
        ),
        ("a.obj", Vec::new(), "no triangles"),
        ("a.obj", obj("f 1 2"), "has 2 corners"),
        ("a.obj", obj("f 1 2 4"), "names point 3"),
        ("a.obj", obj("f 1 2 0"), "line 4"),
        ("a.obj", obj("f 1 2 -4"), "line 4"),
        ("a.obj", obj("v 1 2\nf 1 2 3"), "three coordinates"),
        ("a.obj", obj("v 1 2 1e400\nf 1 2 3"), "point 3 lies at"),
        (
            "a.obj",
            obj("f 1 2 3"),
            "not closed: 1 holes with 3 open edges",
        ),
        ("a.vtk", Vec::new(), "does not start as one"),
        ("a.vtk", cut(&vtk(false, false))[..600].to_vec(), "a.vtk"),
        ("a.vtk", vtk(true, false)[..600].to_vec(), "cut off"),
        ("a.vtk", many_points(false), "cut off"),
        ("a.vtk", many_points(true), "cut off"),
        (
            "a.vtk",
            replaced(vtk(true, true), "POLYDATA", "UNSTRUCTURED_GRID"),
            "not polygons",
        ),
        (
            "a.vtk",
            replaced(vtk(true, true), "BINARY", "SECRET"),
            "neither ASCII nor",
        ),
        (
            "a.vtk",
            replaced(vtk(true, true), "POLYGONS", "TETRAHEDRA"),
            "'TETRAHEDRA'",
        ),
        (
            "a.vtk",
            replaced(vtk(true, true), "CONNECTIVITY", "X"),
            "no CONNECTIVITY",
        ),
        (
            "a.vtk",
            replaced(vtk(false, false), "float", "bit"),
            "unknown type 'bit'",
        ),
        ("a.vtp", Vec::new(), "a.vtp"),
        ("a.vtp", b"<VTKFile type='ImageData'/>".to_vec(), "PolyData"),
        (
            "a.vtp",
            b"<VTKFile type='PolyData'/>".to_vec(),
            "no triangles",
        ),
        ("a.vtp", vtp("appended", false)[..3000].to_vec(), "cut off"),
        ("a.vtp", vtp("appended", true)[..1500].to_vec(), "cut off"),
        (
            "a.vtp",
            replaced(
                vtp("appended", false),
                "offset=\"0\"",
                "offset=\"99999999\"",
            ),
            "behind",
        ),
        (
            "a.vtp",
            replaced(vtp("appended", true), "ZLib", "LZ4"),
            "not by zlib",
        ),
        (
            "a.vtp",
            replaced(vtp("ascii", false), "Float32", "Float16"),
            "'Float16'",
        ),
        (
            "a.vtp",
            replaced(vtp("binary", false), "\"binary\"", "\"secret\""),
            "'secret'",
        ),
        ("a.csv", Vec::new(), "no closed curve"),
        ("a.csv", b"0,0\n1,0\n".to_vec(), "2 different points"),
        ("a.csv", b"0,0\n1,0\n1,nan\n".to_vec(), "a point of curve 0"),
        ("a.csv", b"a,b\n".to_vec(), "named x and y"),
        ("a.csv", b"x,y\n0,0\n1\n".to_vec(), "line 3"),
        ("a.csv", b"\xff\xfe".to_vec(), "UTF-8"),
        ("a.csv", b"0,0\n1,0\n2,0\n".to_vec(), "encloses no area"),
        ("a.svg", Vec::new(), "a.svg"),
        ("a.svg", b"<svg/>".to_vec(), "no path"),
        (
            "a.svg",
            b"<svg><path d='M0 0'/></svg>".to_vec(),
            "no closed curve",
        ),
        (
            "a.svg",
            b"<svg><path d='M0 0L1e300 1e300 3 4z'/></svg>".to_vec(),
            "a.svg",
        ),
    ]
}
