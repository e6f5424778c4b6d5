//! Surfaces of triangles as bytes of files.

use std::fmt::Write as _;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Triangles with common points.
#[derive(Clone, Default)]
pub struct Mesh {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A ball with its poles on the z axis. Coordinates are numbers of single precision.
    pub fn ball(centre: [f64; 3], radius: f64, around: usize) -> Self {
        let rows = around / 2;
        let place = |polar: f64, angle: f64| {
            let direction = [
                polar.sin() * angle.cos(),
                polar.sin() * angle.sin(),
                polar.cos(),
            ];
            let p: [f64; 3] = std::array::from_fn(|k| centre[k] + radius * direction[k]);
            p.map(|x| f64::from(x as f32))
        };
        let step = std::f64::consts::PI / rows as f64;
        let mut points = vec![place(0.0, 0.0)];
        for i in 1..rows {
            let at = |j: usize| place(i as f64 * step, j as f64 * step);
            points.extend((0..around).map(at));
        }
        points.push(place(std::f64::consts::PI, 0.0));
        let last = points.len() as u32 - 1;
        let at = |i: usize, j: usize| (1 + (i - 1) * around + j % around) as u32;
        let mut triangles = Vec::new();
        for j in 0..around {
            triangles.push([0, at(1, j), at(1, j + 1)]);
            for i in 1..rows - 1 {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
            triangles.push([at(rows - 1, j), last, at(rows - 1, j + 1)]);
        }
        Self { points, triangles }
    }

    pub fn joined(mut self, other: &Self) -> Self {
        let shift = self.points.len() as u32;
        self.points.extend(&other.points);
        let moved = other.triangles.iter().map(|t| t.map(|c| c + shift));
        self.triangles.extend(moved);
        self
    }

    pub fn volume(&self) -> f64 {
        let six: f64 = self
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| self.points[i as usize]);
                a[0] * (b[1] * c[2] - b[2] * c[1])
                    + a[1] * (b[2] * c[0] - b[0] * c[2])
                    + a[2] * (b[0] * c[1] - b[1] * c[0])
            })
            .sum();
        six / 6.0
    }

    pub fn stl(&self, header: &str) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..header.len()].copy_from_slice(header.as_bytes());
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for t in &self.triangles {
            bytes.extend([0; 12]);
            for p in t.map(|i| self.points[i as usize]) {
                bytes.extend(p.iter().flat_map(|x| (*x as f32).to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    pub fn stl_text(&self) -> Vec<u8> {
        let mut text = String::from("solid a ball\n");
        for t in &self.triangles {
            text += "facet normal 0 0 0\n outer loop\n";
            for [x, y, z] in t.map(|i| self.points[i as usize]) {
                writeln!(text, "  vertex {x:e} {y} {z}").unwrap();
            }
            text += " endloop\nendfacet\n";
        }
        (text + "endsolid a ball\n").into_bytes()
    }

    /// `kind` is the word of the header.
    pub fn ply(&self, kind: &str, remark: &str) -> Vec<u8> {
        let (n, m) = (self.points.len(), self.triangles.len());
        let mut bytes = format!(
            "ply\nformat {kind} 1.0\n{remark}element vertex {n}\nproperty uchar red\nproperty float \
             x\nproperty float y\nproperty double z\nelement face {m}\nproperty list uchar int \
             vertex_indices\nproperty list uchar float texture\nend_header\n"
        )
        .into_bytes();
        let little = kind == "binary_little_endian";
        let text = kind == "ascii";
        let order = |mut b: Vec<u8>| {
            if !little {
                b.reverse();
            }
            b
        };
        for [x, y, z] in &self.points {
            if text {
                bytes.extend(format!("7 {x} {y} {z}\n").bytes());
            } else {
                bytes.push(7);
                bytes.extend(order((*x as f32).to_le_bytes().to_vec()));
                bytes.extend(order((*y as f32).to_le_bytes().to_vec()));
                bytes.extend(order(z.to_le_bytes().to_vec()));
            }
        }
        for [a, b, c] in &self.triangles {
            if text {
                bytes.extend(format!("3 {a} {b} {c} 1 0.5\n").bytes());
            } else {
                bytes.push(3);
                for i in [a, b, c] {
                    bytes.extend(order((*i as i32).to_le_bytes().to_vec()));
                }
                bytes.push(1);
                bytes.extend(order(0.5f32.to_le_bytes().to_vec()));
            }
        }
        bytes
    }

    /// With every second triangle counted backwards from the last point.
    pub fn obj(&self, remark: &str) -> Vec<u8> {
        let mut text = format!("# {remark}\nmtllib none.mtl\no ball\n");
        for [x, y, z] in &self.points {
            write!(text, "v {x} {y} {z} 0.5 0.5 0.5\nvn 0 0 1\n").unwrap();
        }
        let n = self.points.len() as i64;
        for (k, t) in self.triangles.iter().enumerate() {
            let [a, b, c] = t.map(i64::from);
            let line = if k % 2 == 0 {
                format!("f {}//1 {}/2/1 \\\n {}\n", a + 1, b + 1, c + 1)
            } else {
                format!("f {} {} {}\n", a - n, b - n, c - n)
            };
            text.push_str(&line);
        }
        text.into_bytes()
    }

    /// Of version 4.2 or 5.1.
    pub fn vtk(&self, binary: bool, new: bool, title: &str) -> Vec<u8> {
        let (n, m) = (self.points.len(), self.triangles.len());
        let version = if new { "5.1" } else { "4.2" };
        let kind = if binary { "BINARY" } else { "ASCII" };
        let mut bytes = format!(
            "# vtk DataFile Version {version}\n{title}\n{kind}\nDATASET POLYDATA\nPOINTS {n} float\n"
        )
        .into_bytes();
        let put = |bytes: &mut Vec<u8>, numbers: &[f64], width: usize| {
            for &x in numbers {
                match (binary, width) {
                    (false, _) => bytes.extend(format!("{x} ").bytes()),
                    (true, 0) => bytes.extend((x as f32).to_be_bytes()),
                    (true, 4) => bytes.extend((x as i32).to_be_bytes()),
                    (true, _) => bytes.extend((x as i64).to_be_bytes()),
                }
            }
            bytes.push(b'\n');
        };
        put(&mut bytes, self.points.as_flattened(), 0);
        bytes.extend(b"METADATA\nINFORMATION 0\n\n");
        let corners: Vec<f64> = self
            .triangles
            .as_flattened()
            .iter()
            .map(|&c| f64::from(c))
            .collect();
        if new {
            bytes.extend(format!("POLYGONS {} {}\nOFFSETS vtktypeint64\n", m + 1, 3 * m).bytes());
            let ends: Vec<f64> = (0..=m).map(|i| 3.0 * i as f64).collect();
            put(&mut bytes, &ends, 8);
            bytes.extend(b"CONNECTIVITY vtktypeint64\n");
            put(&mut bytes, &corners, 8);
        } else {
            bytes.extend(format!("POLYGONS {m} {}\n", 4 * m).bytes());
            let lists: Vec<f64> = corners
                .chunks(3)
                .flat_map(|c| [3.0, c[0], c[1], c[2]])
                .collect();
            put(&mut bytes, &lists, 4);
        }
        bytes.extend(format!("POINT_DATA {n}\nSCALARS a float\n").bytes());
        bytes
    }

    /// `format` is that of the arrays; appended data are raw, and packed where told.
    pub fn vtp(&self, format: &str, packed: bool, field: &str) -> Vec<u8> {
        let (n, m) = (self.points.len(), self.triangles.len());
        let points: Vec<u8> = self
            .points
            .as_flattened()
            .iter()
            .flat_map(|x| (*x as f32).to_le_bytes())
            .collect();
        let corners: Vec<u8> = self
            .triangles
            .as_flattened()
            .iter()
            .flat_map(|&c| i64::from(c).to_le_bytes())
            .collect();
        let ends: Vec<u8> = (1..=m as i64).flat_map(|i| (3 * i).to_le_bytes()).collect();
        let arrays = [
            ("Points", "Float32", points),
            ("connectivity", "Int64", corners),
            ("offsets", "Int64", ends),
        ];
        let mut appended = Vec::new();
        let mut drawn = arrays.iter().map(|(name, kind, data)| {
            let content = match format {
                "ascii" => text_of(kind, data),
                "binary" => base64(&stored(data, false)),
                _ => String::new(),
            };
            let offset = appended.len();
            appended.extend(stored(data, packed));
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"3\" \
                 format=\"{format}\" offset=\"{offset}\">{content}</DataArray>"
            )
        });
        let [points, corners, ends] = std::array::from_fn(|_| drawn.next().unwrap());
        drop(drawn);
        let compressor = if packed {
            "compressor=\"vtkZLibDataCompressor\""
        } else {
            ""
        };
        let mut bytes = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" \
             byte_order=\"LittleEndian\" header_type=\"UInt32\" {compressor}><PolyData>{field}<Piece \
             NumberOfPoints=\"{n}\" NumberOfPolys=\"{m}\"><Points>{points}</Points>\
             <Polys>{corners}{ends}</Polys></Piece></PolyData>"
        )
        .into_bytes();
        if format == "appended" {
            bytes.extend(b"<AppendedData encoding=\"raw\">_");
            bytes.extend(appended);
            bytes.extend(b"</AppendedData>");
        }
        bytes.extend(b"</VTKFile>\n");
        bytes
    }
}

/// Data with what stands before them: their length, or their packed blocks.
fn stored(data: &[u8], packed: bool) -> Vec<u8> {
    const BLOCK: usize = 1000;
    if !packed {
        return [&(data.len() as u32).to_le_bytes(), data].concat();
    }
    let blocks: Vec<Vec<u8>> = data
        .chunks(BLOCK)
        .map(|block| {
            let mut packer = ZlibEncoder::new(Vec::new(), Compression::fast());
            packer.write_all(block).unwrap();
            packer.finish().unwrap()
        })
        .collect();
    let rest = data.len() % BLOCK;
    let sizes = blocks.iter().map(Vec::len);
    let header = [blocks.len(), BLOCK, rest].into_iter().chain(sizes);
    let mut bytes: Vec<u8> = header.flat_map(|n| (n as u32).to_le_bytes()).collect();
    bytes.extend(blocks.concat());
    bytes
}

fn text_of(kind: &str, data: &[u8]) -> String {
    let words: Vec<String> = if kind == "Float32" {
        let numbers = data.as_chunks::<4>().0.iter();
        numbers
            .map(|&b| f64::from(f32::from_le_bytes(b)).to_string())
            .collect()
    } else {
        let numbers = data.as_chunks::<8>().0.iter();
        numbers
            .map(|&b| i64::from_le_bytes(b).to_string())
            .collect()
    };
    words.join("\n")
}

pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |n: u32| DIGITS[(n & 63) as usize] as char;
    bytes
        .chunks(3)
        .flat_map(|c| {
            let at = |k: usize| u32::from(c.get(k).copied().unwrap_or(0));
            let n = at(0) << 16 | at(1) << 8 | at(2);
            let mut four = [digit(n >> 18), digit(n >> 12), digit(n >> 6), digit(n)];
            for place in four.iter_mut().skip(c.len() + 1) {
                *place = '=';
            }
            four
        })
        .collect()
}
