//! Surfaces as binary PLY.

use std::io::{self, Write};

use super::{WORLD, corner};
use shapespace_picture::Surface;

/// Writes a surface; points in double precision.
pub(super) fn surface_to(
    writer: &mut impl Write,
    surface: Surface<'_>,
    in_world: bool,
) -> io::Result<()> {
    let remark = if in_world {
        format!("comment {WORLD}\n")
    } else {
        String::new()
    };
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\n{remark}element vertex {}\nproperty double x\n\
         property double y\nproperty double z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        surface.vertices.len(),
        surface.triangles.len()
    )?;
    for x in surface.vertices.as_flattened() {
        writer.write_all(&x.to_le_bytes())?;
    }
    for triangle in surface.triangles {
        writer.write_all(&[3])?;
        for &index in triangle {
            writer.write_all(&corner(&surface, index)?.to_le_bytes())?;
        }
    }
    Ok(())
}
