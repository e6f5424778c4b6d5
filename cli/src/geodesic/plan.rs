//! From the options to a checked plan.

use ::geodesic::GeodesicParams;
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::Serialize;

use super::args::{Form, GeodesicArgs, PathArgs};
use crate::error::CliError;
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::options::{Align, CommonArgs};
use crate::output::ResultDir;
use crate::shapes::Placed;

/// All parameters of a geodesic, with nothing left to choose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// Nodes a side.
    pub grid: usize,
    /// Steps of the path.
    pub steps: usize,
    /// The unknowns.
    pub form: Form,
    /// Tolerance of a level.
    pub tolerance: f64,
    /// Most iterations of a level.
    pub max_iterations: u32,
    /// The law.
    pub law: LawName,
    /// First Lame modulus.
    pub lambda: f64,
    /// Second Lame modulus.
    pub mu: f64,
    /// Weight of the match, as it is asked for.
    pub match_weight: f64,
    /// Weight of one match that this comes to for so many steps.
    pub match_weight_in_force: f64,
    /// Weight of the boundary area; level sets only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_weight: Option<f64>,
    /// Stiffness outside the objects.
    pub void_stiffness: f64,
    /// Viscosity outside the objects.
    pub void_viscosity: f64,
    /// Share of the match that is measured on the end domain.
    pub deformed_share: f64,
    /// Width of the match's step, in spacings of a level.
    pub match_cells: f64,
    /// Half-width of the elastic indicator, in spacings of a level.
    pub indicator_cells: f64,
    /// Nodes a side of the coarsest level.
    pub coarsest_nodes: usize,
    /// Nodes a side of the grid on which a path of level sets begins.
    pub flow_nodes: usize,
    /// Alignment.
    pub align: Align,
}

/// Inputs that are read, placed and checked, and what is to be done with them.
#[derive(Clone, Debug)]
pub struct GeodesicPlan<const D: usize> {
    /// The masks in the unit box: start and end.
    pub(crate) placed: Placed<D>,
    /// The parameters.
    pub parameters: Parameters,
}

/// A plan of either dimension.
#[derive(Clone, Debug)]
pub enum AnyPlan {
    /// In the plane.
    D2(GeodesicPlan<2>),
    /// In space.
    D3(GeodesicPlan<3>),
}

/// Reads, places and checks everything that a geodesic needs.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub fn plan_geodesic(args: &GeodesicArgs) -> Result<AnyPlan, CliError> {
    ResultDir::check(&args.common.output)?;
    args.path.check()?;
    let options = ReadOptions {
        label: args.common.label,
    };
    let inputs = [args.start.clone(), args.end.clone()];
    match read_images(&inputs, &options)? {
        AnyImages::D2(images) => plan_images(images, args).map(AnyPlan::D2),
        AnyImages::D3(images) => plan_images(images, args).map(AnyPlan::D3),
    }
}

fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    args: &GeodesicArgs,
) -> Result<GeodesicPlan<D>, CliError> {
    Ok(GeodesicPlan {
        placed: Placed::new(images, &args.common)?,
        parameters: Parameters::new::<D>(&args.common, &args.path)?,
    })
}

impl Parameters {
    /// The parameters that options come to.
    ///
    /// # Errors
    /// [`CliError`] for a grid or a law that does not exist.
    pub(crate) fn new<const D: usize>(
        common: &CommonArgs,
        path: &PathArgs,
    ) -> Result<Self, CliError> {
        let usual = GeodesicParams::default();
        let material = common.material::<D>()?;
        let area_weight = path.area_weight.unwrap_or(usual.area_weight);
        let mut parameters = Self {
            grid: common.nodes::<D>()?,
            steps: path.steps as usize,
            form: path.form,
            tolerance: path.tolerance,
            max_iterations: common.max_iterations,
            law: material.law,
            lambda: material.moduli.bulk_lambda,
            mu: material.moduli.shear_modulus,
            match_weight: path.match_weight,
            match_weight_in_force: 0.0,
            area_weight: (path.form == Form::LevelSets).then_some(area_weight),
            void_stiffness: common.void_stiffness,
            void_viscosity: usual.void_viscosity,
            deformed_share: usual.deformed_share,
            match_cells: usual.match_cells,
            indicator_cells: usual.indicator_cells,
            coarsest_nodes: usual.coarsest_nodes,
            flow_nodes: usual.flow_nodes,
            align: common.align,
        };
        let in_force = parameters.geodesic_params().resolved_match_weight();
        parameters.match_weight_in_force = in_force;
        Ok(parameters)
    }

    /// The law with its moduli.
    pub fn law_spec(&self) -> LawSpec {
        LawSpec {
            law: self.law,
            moduli: LameModuli {
                bulk_lambda: self.lambda,
                shear_modulus: self.mu,
            },
        }
    }

    /// Nodes a side of the first level.
    pub fn first_nodes(&self) -> usize {
        match self.form {
            Form::Lagrangian => self.coarsest_nodes,
            Form::LevelSets => self.flow_nodes,
        }
    }

    /// The same as the geodesic takes them.
    pub fn geodesic_params(&self) -> GeodesicParams {
        let usual = GeodesicParams::default();
        GeodesicParams {
            form: match self.form {
                Form::Lagrangian => ::geodesic::Form::Lagrangian,
                Form::LevelSets => ::geodesic::Form::LevelSets,
            },
            steps: self.steps,
            law: self.law_spec(),
            match_weight: self.match_weight,
            deformed_share: self.deformed_share,
            area_weight: self.area_weight.unwrap_or(usual.area_weight),
            void_stiffness: self.void_stiffness,
            void_viscosity: self.void_viscosity,
            match_cells: self.match_cells,
            indicator_cells: self.indicator_cells,
            coarsest_nodes: self.coarsest_nodes,
            flow_nodes: self.flow_nodes,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations as usize,
            ..usual
        }
    }
}
