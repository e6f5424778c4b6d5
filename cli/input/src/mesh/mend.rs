//! Closed surfaces from triangles as they stand in files.
//!
//! Equal corners become one; triangles that occur twice count once, and those that occur in both
//! orientations not at all; neighbours are given one orientation; small holes are closed. The result
//! has no boundary: every edge occurs equally often in both directions. Then the winding number of
//! every point is a whole number, whatever the triangles cross.

use std::collections::{BTreeMap, HashMap};

use levelset::bounds;

use super::Mesh;
use crate::merge::merged;

/// Holes up to this share of the surface's diagonal are closed.
const SMALL: f64 = 0.1;
/// Corners nearer to each other than this share of the largest length are one, where edges do not
/// meet: numbers of single precision have 6e-8.
pub(super) const SAME: f64 = 1e-6;
/// Least volume, as a share of the cube of the diagonal.
const LEAST_VOLUME: f64 = 1e-12;

/// A surface without a boundary, normals outwards.
pub(crate) struct Mended {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// What was changed, for the user.
    pub remark: Option<String>,
}

/// Why a surface has no inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    Open {
        open: usize,
        holes: usize,
        crowded: usize,
        widest: f64,
        limit: f64,
    },
    Flat,
}

/// The triangles of a file as a closed surface.
pub(crate) fn mended(mesh: Mesh) -> Result<Mended, Fault> {
    let Mesh {
        mut points,
        mut triangles,
    } = mesh;
    let diagonal = diagonal(triangles.iter().flatten().map(|&c| &points[c as usize]));
    merge(&mut points, &mut triangles, 0.0);
    if !missing(&edges(&triangles)).is_empty() {
        let largest = points
            .iter()
            .flatten()
            .fold(diagonal, |m, x| m.max(x.abs()));
        merge(&mut points, &mut triangles, SAME * largest);
    }
    cancel(&mut triangles);
    let mut remarks = Vec::new();
    let turned = orient(&points, &mut triangles);
    if turned > 0 {
        remarks.push(format!("{turned} triangles turned as their neighbours are"));
    }
    let holes = close(&mut points, &mut triangles, SMALL * diagonal)?;
    if let Some(closed) = holes {
        remarks.push(closed);
    }
    let volume = volume(&points, &triangles);
    if volume.abs() <= LEAST_VOLUME * diagonal.powi(3) {
        return Err(Fault::Flat);
    }
    if volume < 0.0 {
        for triangle in &mut triangles {
            triangle.swap(0, 1);
        }
        remarks.push("normals turned outwards".into());
    }
    Ok(Mended {
        points,
        triangles,
        remark: (!remarks.is_empty()).then(|| remarks.join(", ")),
    })
}

fn diagonal<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> f64 {
    let [low, high] = bounds(points.copied());
    let squares = (0..3).map(|k| (high[k] - low[k]).max(0.0).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Makes one of corners that are equal, or nearer to each other than a distance, the first of them, and
/// leaves out triangles that have lost a corner.
fn merge(points: &mut Vec<[f64; 3]>, triangles: &mut Vec<[u32; 3]>, distance: f64) {
    let (kept, numbers) = merged(points, distance);
    *points = kept;
    for triangle in triangles.iter_mut() {
        *triangle = triangle.map(|c| numbers[c as usize]);
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
}

/// Leaves one of several equal triangles, and none of those that occur in both orientations.
fn cancel(triangles: &mut Vec<[u32; 3]>) {
    let key = |triangle: &[u32; 3]| {
        let mut sorted = *triangle;
        sorted.sort_unstable();
        let least = triangle.iter().position(|c| *c == sorted[0]).unwrap_or(0);
        let sign = if triangle[(least + 1) % 3] == sorted[1] {
            1
        } else {
            -1
        };
        (sorted, sign)
    };
    let mut count: HashMap<[u32; 3], i32> = HashMap::new();
    for triangle in triangles.iter() {
        let (sorted, sign) = key(triangle);
        *count.entry(sorted).or_default() += sign;
    }
    triangles.retain(|triangle| {
        let (sorted, sign) = key(triangle);
        let left = count.get_mut(&sorted);
        // The first of those that are left, once.
        left.is_some_and(|left| {
            let keep = *left * sign > 0;
            if keep {
                *left = 0;
            }
            keep
        })
    });
}

/// An edge of a triangle, from the corner with the smaller number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    triangle: u32,
    forwards: bool,
}

/// The edges of all triangles, equal ones one after the other.
fn edges(triangles: &[[u32; 3]]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = triangles
        .iter()
        .enumerate()
        .flat_map(|(number, triangle)| {
            (0..3).map(move |k| {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                Edge {
                    ends: [a.min(b), a.max(b)],
                    triangle: number as u32,
                    forwards: a < b,
                }
            })
        })
        .collect();
    edges.sort_unstable();
    edges
}

fn groups(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    edges.chunk_by(|a, b| a.ends == b.ends)
}

/// The directed edges that triangles lack to have no boundary.
fn missing(edges: &[Edge]) -> Vec<[u32; 2]> {
    let mut missing = Vec::new();
    for group in groups(edges) {
        let [low, high] = group[0].ends;
        let forwards = group.iter().filter(|edge| edge.forwards).count();
        let backwards = group.len() - forwards;
        let lacking = forwards.abs_diff(backwards);
        let edge = if forwards > backwards {
            [high, low]
        } else {
            [low, high]
        };
        missing.extend(std::iter::repeat_n(edge, lacking));
    }
    missing
}

/// Gives neighbours one orientation, and each part that has needed it a positive volume; returns the
/// number of triangles that are turned. Where all neighbours agree, parts keep theirs: one inside of
/// another may be a cavity.
fn orient(points: &[[f64; 3]], triangles: &mut [[u32; 3]]) -> usize {
    let edges = edges(triangles);
    let pairs: Vec<&[Edge]> = groups(&edges).filter(|group| group.len() == 2).collect();
    if pairs
        .iter()
        .all(|pair| pair[0].forwards != pair[1].forwards)
    {
        return 0;
    }
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); triangles.len()];
    for pair in pairs {
        let agree = pair[0].forwards != pair[1].forwards;
        for (one, other) in [(0, 1), (1, 0)] {
            neighbours[pair[one].triangle as usize].push((pair[other].triangle, agree));
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut total = 0;
    for seed in 0..triangles.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        let mut part = vec![seed];
        let mut next = 0;
        while next < part.len() {
            let here = part[next];
            let own = turned[here] == Some(true);
            for &(other, agree) in &neighbours[here] {
                let other = other as usize;
                if turned[other].is_none() {
                    turned[other] = Some(own == agree);
                    part.push(other);
                }
            }
            next += 1;
        }
        let flip = |triangles: &mut [[u32; 3]], which: &dyn Fn(usize) -> bool| {
            for &i in part.iter().filter(|&&i| which(i)) {
                triangles[i].swap(0, 1);
            }
        };
        let n_turned = part.iter().filter(|&&i| turned[i] == Some(true)).count();
        if n_turned == 0 {
            continue;
        }
        flip(triangles, &|i| turned[i] == Some(true));
        let own: Vec<[u32; 3]> = part.iter().map(|&i| triangles[i]).collect();
        if volume(points, &own) < 0.0 {
            flip(triangles, &|_| true);
            total += part.len() - n_turned;
        } else {
            total += n_turned;
        }
    }
    total
}

/// Six times the volume is the sum of determinants about the middle of the points.
fn volume(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corners = || triangles.iter().flatten().map(|&c| points[c as usize]);
    let n = (3 * triangles.len()).max(1) as f64;
    let middle: [f64; 3] = std::array::from_fn(|k| corners().map(|p| p[k]).sum::<f64>() / n);
    let sum: f64 = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|c| {
                let p = points[c as usize];
                std::array::from_fn(|k| p[k] - middle[k])
            });
            fe_grid::tensor::determinant(&[a, b, c])
        })
        .sum();
    sum / 6.0
}

/// Closes holes up to a width, with triangles to their middles, and returns what was closed.
fn close(
    points: &mut Vec<[f64; 3]>,
    triangles: &mut Vec<[u32; 3]>,
    limit: f64,
) -> Result<Option<String>, Fault> {
    let edges = edges(triangles);
    let open = missing(&edges);
    if open.is_empty() {
        return Ok(None);
    }
    let loops = loops(&open);
    let width = |hole: &Vec<u32>| diagonal(hole.iter().map(|&c| &points[c as usize]));
    let widest = loops.iter().map(width).fold(0.0, f64::max);
    if widest > limit {
        return Err(Fault::Open {
            open: open.len(),
            holes: loops.len(),
            crowded: groups(&edges).filter(|group| group.len() > 2).count(),
            widest,
            limit,
        });
    }
    for hole in &loops {
        if let [a, b, c] = hole[..] {
            triangles.push([a, b, c]);
            continue;
        }
        let corners = || hole.iter().map(|&c| points[c as usize]);
        let n = hole.len() as f64;
        let middle = std::array::from_fn(|k| corners().map(|p| p[k]).sum::<f64>() / n);
        let centre = points.len() as u32;
        for (i, &a) in hole.iter().enumerate() {
            triangles.push([a, hole[(i + 1) % hole.len()], centre]);
        }
        points.push(middle);
    }
    let count = loops.len();
    Ok(Some(format!(
        "{count} {} of {} open edges closed, the widest {widest:.3} across",
        if count == 1 { "hole" } else { "holes" },
        open.len()
    )))
}

/// Closed ways along directed edges; as many edges enter every point as leave it.
fn loops(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut onwards: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[from, to] in edges {
        onwards.entry(from).or_default().push(to);
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = onwards.first_key_value() {
        let mut way = vec![start];
        let mut place: HashMap<u32, usize> = HashMap::from([(start, 0)]);
        let mut here = start;
        while let Some(ends) = onwards.get_mut(&here) {
            let Some(next) = ends.pop() else { break };
            if ends.is_empty() {
                onwards.remove(&here);
            }
            if let Some(&first) = place.get(&next) {
                let hole = way.split_off(first);
                for point in &hole {
                    place.remove(point);
                }
                loops.push(hole);
            }
            place.insert(next, way.len());
            way.push(next);
            here = next;
        }
    }
    loops
}
