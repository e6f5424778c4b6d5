//! The headings under which the help lists the options of configurations: the same option has the same one in
//! every command.

/// The options under each heading, by their names.
const HEADINGS: [(&str, &[&str]); 5] = [
    (
        "Input",
        &[
            "label",
            "labels",
            "invert",
            "joint",
            "valid",
            "valid_start",
            "valid_end",
            "occluded",
            "truth",
            "against",
            "classes",
            "groups",
            "column",
            "covariates",
            "pca",
            "average",
        ],
    ),
    (
        "Frame and grid",
        &["grid", "spacing", "box", "frame", "align", "size", "like"],
    ),
    (
        "Computation",
        &[
            "sweep",
            "error_bars",
            "starts",
            "start",
            "no_geodesic",
            "steps",
            "form",
            "domain",
            "dilation",
            "mode",
            "translation",
            "neighbours",
            "skip_far",
            "landmarks",
            "one_way",
            "richardson",
            "reached",
            "retry",
            "refine",
            "detours",
            "linkage",
            "clusters",
            "object",
            "threshold",
            "largest",
            "modes",
            "amplitude",
            "keep_average",
            "metric",
            "variation",
            "at_rest",
            "void_at_rest",
            "scores",
            "nonlinear",
            "permutations",
            "seed",
            "discovery_rate",
            "weights",
            "mean",
            "median_reference",
        ],
    ),
    (
        "Model",
        &[
            "law",
            "lambda",
            "mu",
            "exponents",
            "norm_share",
            "coefficients",
            "mismatch_weight",
            "length_weight",
            "edge_weight",
            "edges",
            "smooth",
            "contrast",
            "deformed_share",
            "area_weight",
            "area_regularisation",
            "void_stiffness",
            "void_viscosity",
            "interface_cells",
            "mismatch_cells",
            "indicator_cells",
            "boundary",
            "edge_conductance",
        ],
    ),
    (
        "Solver",
        &[
            "solver",
            "coarsest_nodes",
            "flow_nodes",
            "tolerance",
            "max_iterations",
            "min_determinant",
            "filter_width",
            "descent_steps",
            "precision",
            "penalty",
            "load_steps",
            "zero_eigenvalue",
        ],
    ),
];

/// The heading of options that do not influence the results.
pub(crate) const RUN: &str = "Output and run";

/// The heading of an option.
pub(super) fn heading(option: &str) -> Option<&'static str> {
    let own = HEADINGS
        .iter()
        .find(|(_, options)| options.contains(&option));
    own.map(|(heading, _)| *heading)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::CommandFactory;

    /// So many options are read at a glance.
    const FEW: usize = 8;

    #[test]
    fn the_options_of_commands_with_many_are_grouped() {
        let program = Cli::command();
        let mut known: Vec<&str> = HEADINGS
            .iter()
            .flat_map(|(_, all)| all.iter().copied())
            .collect();
        for command in program.get_subcommands() {
            let options = command
                .get_arguments()
                .filter(|option| !option.is_positional());
            let options: Vec<_> = options.collect();
            for option in &options {
                known.retain(|name| option.get_id() != name);
                let is_general = ["config", "help"]
                    .iter()
                    .any(|name| option.get_id() == name);
                let is_grouped = option.get_help_heading().is_some();
                assert!(
                    options.len() <= FEW || is_general || is_grouped,
                    "{}: {}",
                    command.get_name(),
                    option.get_id()
                );
            }
        }
        assert_eq!(known, [""; 0], "no command has these");
    }
}
