//! A folder of its own for each test, and small files of every format, byte by byte.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub mod ball;
pub mod document;
pub mod solid;

/// A temporary folder in which the program runs.
pub struct Place(tempfile::TempDir);

impl Place {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// Names in the folder, hidden ones too.
    pub fn listing(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.0.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Runs a command whose result may be doubtful: shapes on grids that are too coarse for them,
    /// or few iterations.
    pub fn compute(&self, arguments: &[&str]) -> Output {
        self.run(&[arguments, &["--allow-doubtful"]].concat())
    }

    pub fn run(&self, arguments: &[&str]) -> Output {
        self.run_with(arguments, &[])
    }

    /// Runs the program with environment variables.
    pub fn run_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_shapespace"))
            .args(arguments)
            .envs(variables.iter().copied())
            .current_dir(self.0.path())
            .output()
            .unwrap()
    }
}

pub fn npy_f64(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let sides: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let sides = sides.join(", ");
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({sides}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// Shape and values of an array of doubles.
pub fn array(path: &Path) -> (Vec<u64>, Vec<f64>) {
    read_npy(path, "<f8", f64::from_le_bytes)
}

/// The same of single precision.
pub fn array_of_singles(path: &Path) -> (Vec<u64>, Vec<f32>) {
    read_npy(path, "<f4", f32::from_le_bytes)
}

/// Shape and values of an array as the program writes it, of the type with this code.
fn read_npy<const W: usize, T>(
    path: &Path,
    code: &str,
    number: fn([u8; W]) -> T,
) -> (Vec<u64>, Vec<T>) {
    let bytes = std::fs::read(path).unwrap();
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let (header, data) = bytes[10..].split_at(length);
    let header = std::str::from_utf8(header).unwrap();
    let start = format!("{{'descr': '{code}', 'fortran_order': False, 'shape': (");
    let (shape, _) = header
        .strip_prefix(&start)
        .unwrap()
        .split_once(')')
        .unwrap();
    let sides = shape.split(',').filter(|n| !n.trim().is_empty());
    let shape: Vec<u64> = sides.map(|n| n.trim().parse().unwrap()).collect();
    let (data, rest) = data.as_chunks();
    assert!(rest.is_empty() && data.len() as u64 == shape.iter().product::<u64>());
    (shape, data.iter().map(|&b| number(b)).collect())
}

pub fn grey_png(width: u32, height: u32, grey: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(grey).unwrap();
    writer.finish().unwrap();
    bytes
}

/// Pixels along `x` and `y` of a PNG file, all of which is read.
pub fn picture_size(path: &Path) -> [u32; 2] {
    let file = BufReader::new(File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    [frame.width, frame.height]
}

/// A little-endian NIfTI-1 file of `u8` labels.
pub fn nifti(size: [u16; 3], pixdim: [f32; 3], labels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0u8; 352];
    bytes[..4].copy_from_slice(&348i32.to_le_bytes());
    for (k, n) in [3, size[0], size[1], size[2], 1, 1, 1, 1]
        .iter()
        .enumerate()
    {
        bytes[40 + 2 * k..42 + 2 * k].copy_from_slice(&n.to_le_bytes());
    }
    bytes[70..72].copy_from_slice(&2i16.to_le_bytes());
    bytes[72..74].copy_from_slice(&8i16.to_le_bytes());
    for (k, h) in [1.0, pixdim[0], pixdim[1], pixdim[2]].iter().enumerate() {
        bytes[76 + 4 * k..80 + 4 * k].copy_from_slice(&f32::to_le_bytes(*h));
    }
    bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
    bytes[344..348].copy_from_slice(b"n+1\0");
    bytes.extend(labels);
    bytes
}

/// The standard output of a run that must succeed.
pub fn succeeded(run: &Output) -> String {
    let report = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{report}");
    String::from_utf8(run.stdout.clone()).unwrap()
}

/// A result directory.
pub struct Results {
    folder: PathBuf,
    pub json: serde_json::Value,
}

impl Results {
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read(folder.join("result.json")).unwrap();
        Self {
            folder: folder.into(),
            json: serde_json::from_slice(&text).unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The number at a place such as `/energy/total`.
    pub fn number(&self, place: &str) -> f64 {
        let value = self.json.pointer(place).and_then(serde_json::Value::as_f64);
        value.unwrap_or_else(|| panic!("no number at {place}"))
    }

    /// The numbers of a list.
    pub fn numbers(&self, place: &str) -> Vec<f64> {
        let list = self.json.pointer(place).and_then(|v| v.as_array()).unwrap();
        list.iter().map(|v| v.as_f64().unwrap()).collect()
    }

    /// Energies on all levels, with or without gradient.
    pub fn evaluations(&self) -> u64 {
        let of = |level: &serde_json::Value, key| level["evaluations"][key].as_u64().unwrap();
        let levels = self.json["levels"].as_array().unwrap().iter();
        levels.map(|l| of(l, "values") + of(l, "gradients")).sum()
    }

    /// Shape and values of an array of doubles.
    pub fn array(&self, name: &str) -> (Vec<u64>, Vec<f64>) {
        array(&self.path(name))
    }

    /// Shape and values of an array of bytes.
    pub fn mask(&self, name: &str) -> (Vec<u64>, Vec<u8>) {
        read_npy(&self.path(name), "|u1", u8::from_le_bytes)
    }
}

/// Draws a family at so many nodes and returns its files.
pub fn drawn(place: &Place, family: &str, dimension: &str, grid: &str) -> Vec<String> {
    let mut arguments = vec!["generate", "family", family, "--dimension", dimension];
    arguments.extend(["--grid", grid, "-o", family]);
    succeeded(&place.run(&arguments));
    let mut files: Vec<String> = std::fs::read_dir(place.path(family))
        .unwrap()
        .map(|entry| entry.unwrap().path().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    files
}

/// Draws one shape into a file.
pub fn draw(place: &Place, name: &str, arguments: &[&str]) {
    let mut all = vec!["generate"];
    all.extend(arguments);
    all.extend(["-o", name]);
    succeeded(&place.run(&all));
}

/// Every array of a run, by name.
pub fn arrays(results: &Results) -> Vec<(String, Vec<u8>)> {
    let mut arrays: Vec<_> = std::fs::read_dir(results.path("."))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "npy"))
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read(path).unwrap())
        })
        .collect();
    arrays.sort();
    arrays
}

/// Runs the program, whose output nobody sees.
#[cfg(target_os = "linux")]
pub fn spawn(place: &Place, arguments: &[&str]) -> std::process::Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shapespace"));
    command
        .args(arguments)
        .current_dir(place.path("."))
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null());
    command.spawn().unwrap()
}

/// Runs the program until something holds, and ends it at once.
#[cfg(target_os = "linux")]
pub fn killed(place: &Place, arguments: &[&str], reached: impl Fn() -> bool) {
    let mut child = spawn(place, arguments);
    while !reached() {
        assert_eq!(child.try_wait().unwrap(), None, "it has come to its end");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Runs the program until it listens to signals and has printed this on standard error, sends it a
/// signal, and returns the exit code.
#[cfg(target_os = "linux")]
pub fn signalled(place: &Place, arguments: &[&str], signal: &str, printed: &str) -> Option<i32> {
    use std::io::{BufRead, Read};
    let mut child = Command::new(env!("CARGO_BIN_EXE_shapespace"))
        .args(arguments)
        .current_dir(place.path("."))
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // Signal 15 is caught once its bit is set in the mask that the system shows.
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let mask = status
            .lines()
            .find_map(|l| l.strip_prefix("SigCgt:"))
            .unwrap();
        u64::from_str_radix(mask.trim(), 16).unwrap() >> 14 & 1 != 0
    };
    while !listens() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains(printed) {
        line.clear();
        let read = stderr.read_line(&mut line).unwrap();
        assert_ne!(read, 0, "it ended without printing '{printed}'");
    }
    let sent = Command::new("kill")
        .args([&format!("-{signal}"), &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
    let mut rest = Vec::new();
    stderr.read_to_end(&mut rest).unwrap();
    child.wait().unwrap().code()
}

/// Presses Ctrl-C when the program has printed this.
#[cfg(target_os = "linux")]
pub fn interrupted(place: &Place, arguments: &[&str], printed: &str) -> Option<i32> {
    signalled(place, arguments, "INT", printed)
}
