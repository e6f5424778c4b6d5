//! From the options to a checked plan.

use std::path::PathBuf;

use ::geodesic::GeodesicParams;
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::Serialize;

use super::args::{Form, GeodesicArgs, Occluded, PathArgs};
use crate::error::CliError;
use crate::input::{AnyImages, Image, ReadOptions, read_images, read_label_images};
use crate::options::{Align, CommonArgs};
use crate::output::ResultDir;
use crate::shapes::{Components, Placed, SeenMask};

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
    /// The labels of the components, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<Vec<i64>>,
    /// Which shape may be hidden in part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occluded: Option<Occluded>,
    /// The mask of what was seen of the start shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub valid_start: Option<PathBuf>,
    /// The mask of what was seen of the end shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub valid_end: Option<PathBuf>,
}

/// Inputs that are read, placed and checked, and what is to be done with them.
#[derive(Clone, Debug)]
pub struct GeodesicPlan<const D: usize> {
    /// The masks in the unit box: start and end.
    pub(crate) placed: Placed<D>,
    /// Their components, where there are several.
    pub(crate) parts: Option<Components<D>>,
    /// What was seen of start and end, where masks tell.
    pub(crate) views: [Option<SeenMask<D>>; 2],
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
    let inputs = vec![args.start.clone(), args.end.clone()];
    let images = if args.labels {
        read_label_images(&inputs)?
    } else {
        read_images(&inputs, &options)?
    };
    let views = [&args.valid_start, &args.valid_end].map(|path| {
        path.as_ref()
            .map(|path| read_images(std::slice::from_ref(path), &ReadOptions::default()))
            .transpose()
    });
    let [first, second] = views;
    let views = [first?, second?];
    match images {
        AnyImages::D2(images) => {
            let views = views.map(|view| match view {
                Some(AnyImages::D2(mut images)) => Ok(images.pop()),
                None => Ok(None),
                Some(AnyImages::D3(images)) => Err(other_dimension(&images)),
            });
            let [first, second] = views;
            plan_images(images, [first?, second?], args).map(AnyPlan::D2)
        }
        AnyImages::D3(images) => {
            let views = views.map(|view| match view {
                Some(AnyImages::D3(mut images)) => Ok(images.pop()),
                None => Ok(None),
                Some(AnyImages::D2(images)) => Err(other_dimension(&images)),
            });
            let [first, second] = views;
            plan_images(images, [first?, second?], args).map(AnyPlan::D3)
        }
    }
}

/// What was seen of a picture is a picture, of a volume a volume.
fn other_dimension<const D: usize>(images: &[Image<D>]) -> CliError {
    CliError::Option {
        option: "--valid-start or --valid-end",
        value: images
            .first()
            .map(|image| image.path.display().to_string())
            .unwrap_or_default(),
        remedy: "give a mask with as many axes and values as the shape's own image".into(),
    }
}

fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    views: [Option<Image<D>>; 2],
    args: &GeodesicArgs,
) -> Result<GeodesicPlan<D>, CliError> {
    let (images, parts) = if args.labels {
        let (images, parts) = Components::split(&images)?;
        (images, Some(parts))
    } else {
        (images, None)
    };
    let mut parameters = Parameters::new::<D>(&args.common, &args.path)?;
    parameters.occluded = args.occluded;
    parameters.valid_start.clone_from(&args.valid_start);
    parameters.valid_end.clone_from(&args.valid_end);
    parameters.labels = parts.as_ref().map(|parts| parts.labels.clone());
    let [start, end] = views;
    let seen = |image: Option<Image<D>>, option| image.map(|image| SeenMask { image, option });
    Ok(GeodesicPlan {
        placed: Placed::new(images, &args.common)?,
        parts,
        views: [seen(start, "--valid-start"), seen(end, "--valid-end")],
        parameters,
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
            lambda: material.moduli.lambda,
            mu: material.moduli.mu,
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
            labels: None,
            occluded: None,
            valid_start: None,
            valid_end: None,
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
                lambda: self.lambda,
                mu: self.mu,
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
