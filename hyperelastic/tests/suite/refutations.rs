//! What fails, and must be seen to fail: the faults that the model's corrections answer.

use crate::common::{Matrix, diagonal, minus_identity, moduli, norm, plane_rotation};
use fe_grid::tensor;
use hyperelastic::{
    LinearElasticity, PolyconvexForm, Power, PowerCoefficients, PowerExponents, SeedLiteral,
    SeedParameters, StoredEnergy,
};

fn seed<const D: usize>(half_exponent: u32) -> SeedLiteral<D> {
    SeedLiteral::new(SeedParameters {
        norm: 1.0,
        cofactor: 0.0,
        volume: 1.0,
        half_norm_exponent: half_exponent,
        half_cofactor_exponent: 1,
        expansion: 2.0,
        compression: 2.0,
    })
    .unwrap()
}

/// `p = 2`: the stress at the identity is `2 a1 1`, and in 2D the energy there is `-a1`.
#[test]
fn the_printed_density_is_not_stress_free() {
    let (value, stress) = seed::<3>(1).gradient(&tensor::zero::<f64, 3>());
    assert_eq!(value, 0.0);
    assert!((norm(&stress) - 2.0 * 3f64.sqrt()).abs() < 1e-14);
    let (value, stress) = seed::<2>(1).gradient(&tensor::zero::<f64, 2>());
    assert_eq!(value, -1.0);
    assert!((norm(&stress) - 2.0 * 2f64.sqrt()).abs() < 1e-14);
    assert!(!seed::<3>(1).hypotheses().stress_free);
    // Compressing lowers the energy below that of the identity.
    let squeezed = diagonal::<3>(&[-0.01; 3]);
    assert!(seed::<3>(1).value(&squeezed) < 0.0);
}

/// `p = 4` in 3D: shear costs nothing to second order.
#[test]
fn the_printed_density_has_no_shear_stiffness() {
    let mut shear = tensor::zero::<f64, 3>();
    shear[0][1] = 1.0;
    shear[1][0] = 1.0;
    let action = seed::<3>(2).hessian_action(&tensor::zero(), &shear);
    assert_eq!(norm(&action), 0.0);
    assert_eq!(seed::<3>(2).moduli().mu, 0.0);
    // Where a law with stiffness has 2 mu |e|^2.
    let stiff = crate::common::logdet::<3>().hessian_action(&tensor::zero(), &shear);
    assert!((tensor::contract(&stiff, &shear) - 4.0).abs() < 1e-14);
}

/// Linear elasticity charges a rotation with `(cos t - 1)^2 (2 lambda + 2 mu)`: the strain is
/// `(cos t - 1) 1` in the plane of the rotation, in 2D as in 3D.
#[test]
fn linear_elasticity_is_not_frame_indifferent() {
    fn check<const D: usize>(i: usize, k: usize) {
        let law = LinearElasticity::<D>::new(moduli(1.3, 0.8)).unwrap();
        for angle in [0.01, 0.4, 1.0, 2.5] {
            let h = minus_identity(&plane_rotation::<D>(i, k, angle));
            // In 2D this is (cos t - 1)^2 (lambda d^2 / 2 + mu d).
            let expected = (angle.cos() - 1.0).powi(2) * (2.0 * 1.3 + 2.0 * 0.8);
            let found = law.value(&h);
            // cos t - 1 loses digits for the small angle.
            assert!((found - expected).abs() < 1e-11 * expected, "{angle}");
            // A frame-indifferent law has nothing to charge.
            assert!(crate::common::logdet::<D>().value(&h).abs() < 1e-14);
        }
        assert!(!law.hypotheses().frame_indifferent);
    }
    check::<2>(0, 1);
    check::<3>(0, 1);
    check::<3>(1, 2);
    check::<3>(0, 2);
}

/// Linear elasticity lets a deformation fold at finite cost.
#[test]
fn linear_elasticity_has_no_barrier() {
    let folded: Matrix<2> = [[-2.0, 0.0], [0.0, 0.0]];
    let law = LinearElasticity::<2>::new(moduli(1.0, 1.0)).unwrap();
    assert_eq!(law.value(&folded), 6.0);
    assert!(!law.hypotheses().barrier);
}

/// A two-term power law below its bound is stress free, but not polyconvex and not bounded below.
#[test]
fn a_negative_beta_is_not_polyconvex() {
    let coefficients = PowerCoefficients {
        norm: 1.0,
        cofactor: 0.0,
        compression: 0.5,
    };
    let exponents = PowerExponents {
        norm: 2.0,
        cofactor: 2.0,
        expansion: 3.0,
        compression: 2.0,
    };
    let law = Power::<3>::from_coefficients(coefficients, exponents).unwrap();
    assert!(law.expansion_coefficient() < 0.0);
    let hypotheses = law.hypotheses();
    assert!(hypotheses.stress_free && !hypotheses.polyconvex);
    assert_eq!(norm(&law.gradient(&tensor::zero::<f64, 3>()).1), 0.0);
    let one = tensor::diagonal::<f64, 3>(1.0);
    let at = |d: f64| law.polyconvex_value(&one, &one, d);
    assert!(at(3.0) > 0.5 * (at(2.0) + at(4.0)));
    assert!(law.value(&diagonal::<3>(&[9.0; 3])) < -100.0);
}
