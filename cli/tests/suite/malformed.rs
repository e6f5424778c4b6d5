//! A table of malformed inputs, each with the report that it gets. All end with exit code 2.

use std::io::{Cursor, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use shapespace::error::{CliError, Exit};
use shapespace_input::{ReadOptions, decode_image};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::{ColorType, Gray8, Gray32Float, RGB8};

use crate::common::{nifti, npy_f64};
use crate::malformed_surfaces;

/// A name, the bytes of the file, and a part of the report.
pub type Row = (&'static str, Vec<u8>, &'static str);

/// A NumPy array of this version with any header.
fn npy(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    if version == 1 {
        bytes.extend((header.len() as u16).to_le_bytes());
    } else {
        bytes.extend((header.len() as u32).to_le_bytes());
    }
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn typed(code: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{code}', 'fortran_order': False, 'shape': {shape}, }}\n");
    npy(1, &header, data)
}

fn npy_headers() -> Vec<Row> {
    let other = "its header is not that of a plain array";
    let headers = [
        "",
        "{",
        "}",
        "{}",
        "[]",
        "{'descr': '<f8'}",
        "{'fortran_order': False, 'shape': (2, 2), }",
        "{'descr': '<f8', 'shape': (2, 2), }",
        "{'descr': '<f8', 'fortran_order': False, }",
        "{'descr': '<f8', 'fortran_order': 1, 'shape': (2, 2), }",
        "{'descr': '<f8', 'fortran_order': None, 'shape': (2, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': [2, 2], }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-2, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2.5, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1e9, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2, , 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), 'more': 1, }",
        "{'descr': '<f8' 'fortran_order': False, 'shape': (2, 2), }",
        "{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (2, 2), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2)",
    ];
    let codes = [
        "|O", "<f2", "<c8", "|S5", "<U3", "|V8", "<M8", "f8", "", "<", "<f16", "<i3",
    ];
    let headers = headers.map(|header| ("a.npy", npy(1, header, &[0; 64]), other));
    let codes = codes.map(|code| ("a.npy", typed(code, "(2, 2)", &[0; 64]), other));
    headers.into_iter().chain(codes).collect()
}

fn npy_contents() -> Vec<Row> {
    let f8 = |shape: &str, n: usize| typed("<f8", shape, &vec![0; 8 * n]);
    let whole = npy_f64(&[4, 4], &square(4));
    let with = |value: f64| {
        let mut values = square(4);
        values[6] = value;
        npy_f64(&[4, 4], &values)
    };
    let noise: Vec<u8> = (0..4096u32)
        .flat_map(|k| (k * k % 65521).to_le_bytes())
        .collect();
    vec![
        ("a.npy", Vec::new(), "it does not start as one"),
        ("a.npy", b"\x93NUMP".to_vec(), "it does not start as one"),
        (
            "a.npy",
            b"PK\x03\x04 an archive".to_vec(),
            "it does not start as one",
        ),
        ("a.npy", b"\x93NUMPY".to_vec(), "damaged or cut off"),
        ("a.npy", b"\x93NUMPY\x01\x00".to_vec(), "damaged or cut off"),
        ("a.npy", npy(0, "{}", &[]), "damaged or cut off"),
        ("a.npy", npy(4, "{}", &[]), "damaged or cut off"),
        ("a.npy", whole[..40].to_vec(), "damaged or cut off"),
        (
            "a.npy",
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff{".to_vec(),
            "damaged or cut off",
        ),
        (
            "a.npy",
            b"\x93NUMPY\x01\x00\x02\x00\xff\xfe".to_vec(),
            "damaged or cut off",
        ),
        ("a.npy", f8("()", 1), "0 axes"),
        ("a.npy", f8("(4,)", 4), "1 axes"),
        ("a.npy", f8("(2, 2, 2, 2)", 16), "4 axes"),
        ("a.npy", f8("(2, 2, 2, 2, 2)", 32), "5 axes"),
        ("a.npy", f8("(0, 4)", 0), "at least two"),
        ("a.npy", f8("(4, 1)", 4), "at least two"),
        ("a.npy", f8("(1, 4, 4)", 16), "at least two"),
        ("a.npy", f8("(65536, 65536)", 0), "more than the limit"),
        (
            "a.npy",
            f8("(4294967296, 4294967296)", 0),
            "more than the limit",
        ),
        ("a.npy", f8("(2, 134217729)", 0), "more than the limit"),
        (
            "a.npy",
            f8("(1000, 1000)", 8),
            "8000000 bytes of data, found 64",
        ),
        (
            "a.npy",
            whole[..whole.len() - 1].to_vec(),
            "128 bytes of data, found 127",
        ),
        ("a.npy", with(f64::NAN), "holds NaN at index [1, 2]"),
        ("a.npy", with(f64::INFINITY), "holds inf at index [1, 2]"),
        ("a.npy", with(f64::NEG_INFINITY), "holds -inf"),
        ("a.npy", with(1.5), "the value 1.5 at index [1, 2]"),
        ("a.npy", with(-0.5), "the value -0.5"),
        ("a.npy", with(1e300), "outside [0, 1]"),
        ("a.npy", npy_f64(&[4, 4], &[0.0; 16]), "an empty shape"),
        ("a.npy", npy_f64(&[4, 4], &[1.0; 16]), "a full shape"),
        (
            "a.npy",
            npy_f64(&[4, 4], &[0.25; 16]),
            "all values are 0.25",
        ),
        (
            "a.npy",
            npy_f64(&[2, 2], &[0.0, 0.1, 0.2, 0.5]),
            "an empty shape",
        ),
        (
            "a.npy",
            typed("<u4", "(64, 64)", &noise),
            "neighbours mostly differ",
        ),
        ("a.npy", typed("|u1", "(4, 4)", &[0; 16]), "an empty shape"),
        ("a.npy", typed("|b1", "(4, 4)", &[1; 16]), "a full shape"),
        (
            "a.npy",
            typed("<f4", "(2, 2)", &f32::NAN.to_le_bytes().repeat(4)),
            "holds NaN",
        ),
    ]
}

fn square(n: usize) -> Vec<f64> {
    let inside = |i: usize| (n / 4..3 * n / 4).contains(&i);
    (0..n * n)
        .map(|k| f64::from(u8::from(inside(k % n) && inside(k / n))))
        .collect()
}

fn chunk(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = flate2::Crc::new();
    crc.update(&kind);
    crc.update(data);
    let length = (data.len() as u32).to_be_bytes();
    [&length[..], &kind, data, &crc.sum().to_be_bytes()].concat()
}

/// A picture of bytes per row with any header: width, height, depth, colour type and the three
/// methods.
fn png(size: [u32; 2], header: [u8; 5], rows: &[u8]) -> Vec<u8> {
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::default());
    zlib.write_all(rows).unwrap();
    let ihdr = [&size.map(u32::to_be_bytes).concat()[..], &header].concat();
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(*b"IHDR", &ihdr),
        chunk(*b"IDAT", &zlib.finish().unwrap()),
        chunk(*b"IEND", &[]),
    ]
    .concat()
}

const GREY: [u8; 5] = [8, 0, 0, 0, 0];

fn png_rows() -> Vec<Row> {
    let rows = [0, 0, 255, 0, 255, 0];
    let whole = png([2, 2], GREY, &rows);
    let flipped = |at: usize| {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x40;
        bytes
    };
    let header = |header| png([2, 2], header, &rows);
    let colours = [0, 1, 2, 3, 40, 50, 60, 0, 7, 80, 90, 200, 100, 5];
    let n = whole.len();
    vec![
        ("a.png", Vec::new(), "cut off after 0 bytes"),
        ("a.png", whole[..8].to_vec(), "cut off after 8 bytes"),
        ("a.png", whole[..20].to_vec(), "cut off"),
        ("a.png", whole[..40].to_vec(), "cut off"),
        ("a.png", b"\xff\xd8\xff\xe0 a photograph".to_vec(), "PNG"),
        ("a.png", flipped(0), "signature"),
        ("a.png", flipped(18), "CRC"),
        ("a.png", flipped(n - 22), "PNG"),
        (
            "a.png",
            [&whole[..33], &chunk(*b"IEND", &[])].concat(),
            "IDAT",
        ),
        ("a.png", [&whole[..8], &whole[33..]].concat(), "IHDR"),
        ("a.png", png([0, 2], GREY, &rows), "PNG"),
        ("a.png", png([2, 0], GREY, &rows), "PNG"),
        ("a.png", png([1, 2], GREY, &rows), "at least two"),
        ("a.png", png([u32::MAX, 2], GREY, &rows), "PNG"),
        (
            "a.png",
            png([1 << 20, 1 << 20], GREY, &rows),
            "more than the limit",
        ),
        ("a.png", png([10_000, 10_000], GREY, &rows), "cut off"),
        ("a.png", png([2, 3], GREY, &rows), "PNG"),
        ("a.png", header([3, 0, 0, 0, 0]), "PNG"),
        ("a.png", header([8, 1, 0, 0, 0]), "PNG"),
        ("a.png", header([16, 3, 0, 0, 0]), "PNG"),
        ("a.png", header([8, 3, 0, 0, 0]), "PNG"),
        ("a.png", header([8, 0, 1, 0, 0]), "PNG"),
        ("a.png", header([8, 0, 0, 1, 0]), "PNG"),
        ("a.png", header([8, 0, 0, 0, 2]), "PNG"),
        ("a.png", png([2, 2], GREY, &[9, 0, 255, 9, 255, 0]), "PNG"),
        ("a.png", png([2, 2], GREY, &[0; 6]), "an empty shape"),
        (
            "a.png",
            png([2, 2], GREY, &[0, 255, 255, 0, 255, 255]),
            "a full shape",
        ),
        (
            "a.png",
            png([2, 2], GREY, &[0, 99, 99, 0, 99, 99]),
            "all values are",
        ),
        (
            "a.png",
            png([2, 2], [8, 2, 0, 0, 0], &colours),
            "a colour picture",
        ),
    ]
}

fn pnm_rows() -> Vec<Row> {
    let file = |text: &str| text.as_bytes().to_vec();
    let damaged = "its header is damaged or cut off";
    let mut rows: Vec<Row> = [
        "",
        "P",
        "P7\n2 2\n255\n",
        "P0 2 2",
        "P5",
        "P5 2",
        "P5 2 2",
        "P5 -2 2 255\n",
        "P5 x 2 255\n",
        "P5 2 2 0\n",
        "P5 2 2 65536\n",
        "P5 99999999999 2 255\n",
        "P5 # 2 2 255",
        "P2 2 2 255",
    ]
    .map(|text| ("a.pgm", file(text), damaged))
    .into();
    rows.extend([
        ("a.pgm", file("P5 1 2 255\nab"), "at least two"),
        ("a.pgm", file("P5 0 0 255\n"), "at least two"),
        ("a.pgm", file("P5 65536 65536 255\n"), "more than the limit"),
        ("a.pgm", file("P5 2 2 255\nabc"), "4 bytes of data, found 3"),
        (
            "a.pgm",
            file("P5 2 2 256\nabcdefg"),
            "8 bytes of data, found 7",
        ),
        (
            "a.ppm",
            file("P6 2 2 255\nabc"),
            "12 bytes of data, found 3",
        ),
        ("a.pbm", file("P4 9 2\nabc"), "4 bytes of data, found 3"),
        ("a.pgm", file("P2 2 2 9\n1 2 3 x"), "too few samples"),
        ("a.pgm", file("P2 2 2 9\n1 2 -3 4"), "too few samples"),
        ("a.pbm", file("P1 2 2\n0 1 2 0"), "too few samples"),
        ("a.pbm", file("P1 2 2\n1111"), "an empty shape"),
        ("a.pgm", file("P5 2 2 255\n\0\0\0\0"), "an empty shape"),
    ]);
    rows
}

/// A BMP file of a header of 40 bytes: width, height, bits, storage and colours.
fn bmp(size: [i32; 2], bits: u16, storage: u32, colours: u32, rest: &[u8]) -> Vec<u8> {
    let mut bytes = b"BM".to_vec();
    for number in [54 + rest.len() as u32, 0, 54 + 4 * colours.min(256), 40] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(size.map(i32::to_le_bytes).as_flattened());
    bytes.extend([1, bits].map(u16::to_le_bytes).as_flattened());
    bytes.extend(
        [storage, 0, 0, 0, colours, 0]
            .map(u32::to_le_bytes)
            .as_flattened(),
    );
    bytes.extend(rest);
    bytes
}

fn bmp_rows() -> Vec<Row> {
    let whole = bmp([2, 2], 24, 0, 0, &[0; 16]);
    let damaged = "its header is damaged or cut off";
    let mut short = whole.clone();
    short[14] = 13;
    let mut far = whole.clone();
    far[10] = 200;
    vec![
        ("a.bmp", Vec::new(), damaged),
        ("a.bmp", b"BM".to_vec(), damaged),
        ("a.bmp", whole[..40].to_vec(), damaged),
        ("a.bmp", b"MZ a program".to_vec(), damaged),
        ("a.bmp", short, damaged),
        ("a.bmp", far, damaged),
        ("a.bmp", bmp([-2, 2], 24, 0, 0, &[0; 16]), damaged),
        ("a.bmp", bmp([2, 2], 8, 0, 99, &[0; 16]), damaged),
        ("a.bmp", bmp([0, 2], 24, 0, 0, &[0; 16]), "at least two"),
        ("a.bmp", bmp([2, 0], 24, 0, 0, &[0; 16]), "at least two"),
        (
            "a.bmp",
            bmp([i32::MAX, i32::MAX], 24, 0, 0, &[0; 16]),
            "more than the limit",
        ),
        (
            "a.bmp",
            bmp([2, i32::MIN], 24, 0, 0, &[0; 16]),
            "more than the limit",
        ),
        ("a.bmp", bmp([9000, 9000], 24, 0, 0, &[0; 16]), "cut off"),
        (
            "a.bmp",
            bmp([2, 2], 24, 0, 0, &[0; 15]),
            "16 bytes of data, found 15",
        ),
        ("a.bmp", bmp([2, 2], 7, 0, 0, &[0; 999]), "7 bits a pixel"),
        ("a.bmp", bmp([2, 2], 48, 0, 0, &[0; 99]), "48 bits a pixel"),
        ("a.bmp", bmp([2, 2], 24, 4, 0, &[0; 99]), "stored in way 4"),
        ("a.bmp", bmp([2, 2], 24, 1, 0, &[0; 99]), "stored in way 1"),
        (
            "a.bmp",
            bmp([2, 2], 8, 1, 1, &[0, 0, 0, 0, 5]),
            "its pixels are damaged",
        ),
        ("a.bmp", whole, "an empty shape"),
        ("a.bmp", bmp([2, 2], 24, 0, 0, &[255; 16]), "a full shape"),
    ]
}

fn tiff<C: ColorType>(pages: &[([u32; 2], &[C::Inner])]) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    for ([width, height], page) in pages {
        encoder.write_image::<C>(*width, *height, page).unwrap();
    }
    bytes.into_inner()
}

fn tiff_rows() -> Vec<Row> {
    let grey: [u8; 4] = [0, 255, 0, 255];
    let whole = tiff::<Gray8>(&[([2, 2], &grey)]);
    let size = |from: u32, to: u32| {
        // Entries of the directory hold the size as a number of 32 bits.
        let wide = tiff::<Gray8>(&[([from, 2], &vec![0; 2 * from as usize])]);
        let (old, new) = (from.to_le_bytes(), to.to_le_bytes());
        let at = wide.windows(4).rposition(|w| w == old).unwrap();
        [&wide[..at], &new, &wide[at + 4..]].concat()
    };
    let colours = [1, 2, 3, 40, 50, 60, 7, 80, 90, 200, 100, 5];
    vec![
        ("a.tif", Vec::new(), "TIFF"),
        ("a.tif", b"II".to_vec(), "TIFF"),
        ("a.tif", b"II*\0".to_vec(), "TIFF"),
        ("a.tif", b"II+\0\x08\0\0\0".to_vec(), "TIFF"),
        ("a.tif", b"XX*\0\x08\0\0\0".to_vec(), "TIFF"),
        ("a.tif", b"II*\0\xff\xff\xff\xff".to_vec(), "TIFF"),
        ("a.tif", b"II*\0\x08\0\0\0\xff\xff".to_vec(), "TIFF"),
        ("a.tif", whole[..whole.len() / 2].to_vec(), "TIFF"),
        ("a.tif", whole[..whole.len() - 30].to_vec(), "TIFF"),
        ("a.tiff", size(1234, 0), "'a.tiff'"),
        ("a.tif", size(1234, u32::MAX), "'a.tif'"),
        ("a.tif", size(1234, 100_000), "'a.tif'"),
        ("a.tif", tiff::<Gray8>(&[([1, 4], &grey)]), "at least two"),
        (
            "a.tif",
            tiff::<Gray8>(&[([2, 2], &grey), ([4, 1], &grey)]),
            "another size",
        ),
        (
            "a.tif",
            tiff::<Gray8>(&[([2, 2], &[0; 4])]),
            "an empty shape",
        ),
        (
            "a.tif",
            tiff::<Gray8>(&[([2, 2], &[255; 4])]),
            "a full shape",
        ),
        (
            "a.tif",
            tiff::<RGB8>(&[([2, 2], &colours)]),
            "a colour picture",
        ),
        (
            "a.tif",
            tiff::<Gray32Float>(&[([2, 2], &[f32::NAN; 4])]),
            "holds NaN",
        ),
        (
            "a.tif",
            tiff::<Gray32Float>(&[([2, 2], &[0.0, 7.0, 3.0, 1.0])]),
            "outside [0, 1]",
        ),
    ]
}

/// A volume with some bytes of its header replaced.
fn changed(at: usize, bytes: &[u8]) -> Vec<u8> {
    let labels: Vec<u8> = (0..27).map(|k| u8::from(k == 13)).collect();
    let mut volume = nifti([3, 3, 3], [1.0; 3], &labels);
    volume[at..at + bytes.len()].copy_from_slice(bytes);
    volume
}

fn nifti_rows() -> Vec<Row> {
    let whole = changed(0, &[]);
    let short = |at: usize, number: i16| changed(at, &number.to_le_bytes());
    let float = |at: usize, number: f32| changed(at, &number.to_le_bytes());
    let mut rows: Vec<Row> = vec![
        ("a.nii", Vec::new(), "348 bytes of data, found 0"),
        (
            "a.nii",
            whole[..347].to_vec(),
            "348 bytes of data, found 347",
        ),
        ("a.nii", whole[..352].to_vec(), "27 bytes of data, found 0"),
        ("a.nii", whole[..378].to_vec(), "27 bytes of data, found 26"),
        ("a.nii", changed(0, &[0; 4]), "NIfTI"),
        ("a.nii", changed(344, b"n+2\0"), "NIfTI"),
        ("a.nii", changed(344, b"XXXX"), "NIfTI"),
        ("a.nii", short(40, 0), "NIfTI"),
        ("a.nii", short(40, 8), "NIfTI"),
        ("a.nii", short(40, -1), "NIfTI"),
        ("a.nii", short(40, 1), "1 axes"),
        ("a.nii", short(42, 0), "'a.nii'"),
        ("a.nii", short(42, -3), "'a.nii'"),
        ("a.nii", short(42, 1), "at least two"),
        ("a.nii", short(42, 32767), "bytes of data"),
        (
            "a.nii",
            changed(42, &[0xff, 0x7f].repeat(3)),
            "more than the limit",
        ),
        (
            "a.nii",
            changed(40, &[4, 0, 3, 0, 3, 0, 3, 0, 2, 0]),
            "4 axes",
        ),
    ];
    for kind in [0, 1, 32, 128, 1536, 1792, 2048, 2304, 9999, -4] {
        rows.push(("a.nii", short(70, kind), "NIfTI"));
    }
    for offset in [
        -1.0,
        1.0,
        347.0,
        1e9,
        f32::NAN,
        f32::INFINITY,
        -f32::INFINITY,
    ] {
        rows.push(("a.nii", float(108, offset), "its data start at byte"));
    }
    for spacing in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e30, 1e-30] {
        rows.push(("a.nii", float(80, spacing), "voxel size"));
    }
    // The sform: its code, and rows from byte 280.
    let sform = |entries: [f32; 12]| {
        let mut bytes = changed(254, &1i16.to_le_bytes());
        bytes[280..328].copy_from_slice(entries.map(f32::to_le_bytes).as_flattened());
        bytes
    };
    let diagonal = |x: f32, y: f32, z: f32, xy: f32| {
        sform([x, xy, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, z, 0.0])
    };
    rows.extend([
        ("a.nii", sform([0.0; 12]), "no length"),
        ("a.nii", sform([f32::NAN; 12]), "finite"),
        ("a.nii", diagonal(1.0, 1.0, 0.0, 0.0), "no length"),
        ("a.nii", diagonal(1.0, 1.0, 3e38, 0.0), "more than 1e9 mm"),
        ("a.nii", diagonal(1.0, 1.0, 1.0, 50.0), "singular"),
        ("a.nii", sform([1.0; 12]), "singular"),
    ]);
    let mut turned = changed(252, &1i16.to_le_bytes());
    turned[256..268].copy_from_slice([9f32; 3].map(f32::to_le_bytes).as_flattened());
    rows.push(("a.nii", turned, "quaternion"));
    rows
}

fn packed(bytes: &[u8], level: u32) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::new(level));
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

fn gzip_rows() -> Vec<Row> {
    let whole = packed(&changed(0, &[]), 6);
    let stored = packed(&changed(0, &[]), 0);
    let n = whole.len();
    let mut flipped = stored.clone();
    flipped[stored.len() - 12] ^= 1;
    let mut length = whole.clone();
    length[n - 1] ^= 1;
    let mut second = whole.clone();
    second.extend(&whole[..9]);
    let bomb = packed(&[&changed(0, &[])[..], &vec![0; (1 << 26) + 1]].concat(), 1);
    let mut wide = changed(42, &[0xff, 0x01].repeat(3));
    wide.truncate(352);
    vec![
        ("a.nii.gz", Vec::new(), "'a.nii.gz'"),
        ("a.nii.gz", changed(0, &[]), "NIfTI"),
        ("a.nii.gz", whole[..5].to_vec(), "cut off"),
        ("a.nii.gz", whole[..n / 2].to_vec(), "cut off"),
        ("a.nii.gz", whole[..n - 1].to_vec(), "cut off"),
        ("a.nii.gz", whole[..n - 8].to_vec(), "cut off"),
        ("a.nii.gz", flipped, "checksum"),
        ("a.nii.gz", length, "checksum"),
        ("a.nii.gz", second, "cut off"),
        (
            "a.nii.gz",
            packed(b"short", 6),
            "348 bytes of data, found 5",
        ),
        ("a.nii.gz", packed(&changed(0, &[])[..370], 6), "cut off"),
        ("a.nii.gz", packed(&wide, 6), "cut off"),
        ("a.nii.gz", bomb, "more than the"),
        ("a.gz", whole.clone(), "no known image format"),
        ("a.nii.bz2", whole.clone(), "no known image format"),
        ("a", whole.clone(), "no known image format"),
        (".png", whole.clone(), "'.png'"),
        ("a.webp", whole.clone(), "no known image format"),
        ("a.dcm", whole, "no known image format"),
    ]
}

#[test]
fn every_malformed_input_gets_its_report() {
    let tables = [
        npy_headers(),
        npy_contents(),
        png_rows(),
        pnm_rows(),
        bmp_rows(),
        tiff_rows(),
        nifti_rows(),
        gzip_rows(),
        malformed_surfaces::rows(),
    ];
    let rows = tables.concat();
    assert!(rows.len() >= 150, "{} rows", rows.len());
    let mut wrong = Vec::new();
    for (k, (name, bytes, words)) in rows.iter().enumerate() {
        match decode_image(bytes, Path::new(name), &ReadOptions::default()) {
            Ok(_) => wrong.push(format!("{k} {name}: accepted, not '{words}'")),
            Err(error) => {
                let report = error.to_string();
                let error = CliError::from(error);
                assert_eq!(error.exit(), Exit::BadInput, "{report}");
                assert!(!error.help().is_empty());
                if !report.contains(words) || !report.contains(name) || report.len() > 400 {
                    wrong.push(format!("{k} {name}: no '{words}' in '{report}'"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "of {}:\n{}", rows.len(), wrong.join("\n"));
}
