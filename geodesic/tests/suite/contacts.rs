//! Where paths merge and split parts, and what arrives.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{Change, Domain, DomainChoice, Geodesic, GeodesicParams, Shape, geodesic_between};
use levelset::{Cause, signed_distance};

fn shape(u: impl Fn(f64, f64) -> f64 + Sync) -> Shape<2> {
    let implicit = ScalarField::<f64, 2>::from_fn(Grid::dyadic(6), |[x, y]| [u(x - 0.5, y - 0.5)]);
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn ring(x: f64, y: f64) -> f64 {
    0.09 - (x.hypot(y) - 0.3).abs()
}

/// A ring that is open on its right.
fn open_ring(x: f64, y: f64) -> f64 {
    let gap = y.abs() - 0.04;
    ring(x, y).min(if x > 0.0 { gap } else { f64::INFINITY })
}

fn path(start: &Shape<2>, end: &Shape<2>, domain: DomainChoice) -> Geodesic<2> {
    let params = GeodesicParams {
        steps: 2,
        domain,
        ..GeodesicParams::default()
    };
    geodesic_between(start, end, &params, &mut Silent).unwrap()
}

#[test]
fn a_ring_that_closes_merges_its_ends_and_one_that_opens_splits() {
    let (open, closed) = (shape(open_ring), shape(ring));
    let closes = path(&open, &closed, DomainChoice::Start);
    let opens = path(&closed, &open, DomainChoice::End);
    for (found, change, step) in [(&closes, Change::Merge, 2), (&opens, Change::Split, 0)] {
        assert!(
            found.end_reached(),
            "{:?} {}",
            found.arrival,
            found.dice_end
        );
        let [contact] = &found.contacts[..] else {
            panic!("{:?}", found.contacts);
        };
        assert_eq!((contact.change, contact.step), (change, step));
        // In the middle of the right side, over most of the width of the ring, .18 or 11.5 spacings, on both sides of
        // the slit, which need not be straight.
        assert!((contact.centre[0] - 0.8).abs() < 0.03, "{contact:?}");
        assert!((contact.centre[1] - 0.5).abs() < 0.01, "{contact:?}");
        assert!(contact.size > 16.0 && contact.size < 25.0, "{contact:?}");
    }
    assert_eq!(opens.domain, Some(Domain::End));
    // The figures that do not know of the slit: the hole of the open ring is none.
    let arrival = closes.arrival.unwrap();
    assert!(arrival.slits > 16.0 && arrival.films == 0.0, "{arrival:?}");
}

/// Deformations of a disk have no hole.
#[test]
fn a_path_that_misses_a_hole_does_not_arrive() {
    let (disk, ring) = (shape(|x, y| 0.3 - x.hypot(y)), shape(ring));
    let found = path(&disk, &ring, DomainChoice::Start);
    assert!(!found.end_reached());
    let doubts = found.doubts(&GeodesicParams::default());
    for cause in [Cause::PathBoundary, Cause::PathParts] {
        assert!(
            doubts.iter().any(|doubt| doubt.cause == cause),
            "{doubts:?}"
        );
    }
}

#[test]
fn shapes_of_one_topology_have_no_contacts() {
    let (disk, ellipse) = (
        shape(|x, y| 0.25 - x.hypot(y)),
        shape(|x, y| 0.2 * (1.0 - (x / 0.35).hypot(y / 0.2))),
    );
    let found = path(&disk, &ellipse, DomainChoice::Better);
    assert!(found.end_reached() && found.contacts.is_empty());
    let arrival = found.arrival.unwrap();
    assert!(
        arrival.percentile_95 < 0.25 && arrival.missing < 0.5,
        "{arrival:?}"
    );
    assert_eq!((arrival.slits, arrival.films), (0.0, 0.0));
}
