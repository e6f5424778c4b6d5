//! What a plot shows.

use shapespace_verify::plot::convergence;
use shapespace_verify::record::LineRecord;

#[test]
fn markers_and_names_are_there_and_nothing_makes_a_plot_too() {
    let errors = LineRecord {
        label: "Diss".into(),
        axis: "step".into(),
        order: 2.0,
        points: vec![(0.1, 1e-2), (0.05, 2.5e-3), (0.025, 6e-4)],
    };
    let text = convergence("balls", "step", &[&errors]).unwrap();
    // One of them stands in the legend.
    assert_eq!(text.matches("<circle").count(), 3 + 1);
    for word in ["balls", "step", "Diss", "dashed: 2)"] {
        assert!(text.contains(word), "{word}");
    }
    assert!(convergence("none", "step", &[]).is_ok());
}
