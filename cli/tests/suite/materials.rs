//! Materials by their coefficients: power laws with exponents, a share or coefficients.

use crate::average::averaged;
use crate::common::{Place, arrays, draw, drawn};

/// `P = a1 p d^(p/2-1)` and `Q = a2 q d^(q/2-1)` in the plane, for the exponents and coefficients below.
const PARTS: [f64; 2] = [0.1 * 4.0 * 2.0, 0.2 * 2.0];
const EXPONENTS: &str = "4,2,2,3";
const COEFFICIENTS: &str = "0.1,0.2,0.9";

/// The moduli that follow from coefficients are in the record, and with them and the share of the first
/// term the same average is computed; so it is with the configuration beside the result.
#[test]
fn a_law_is_stated_by_its_coefficients() {
    let place = Place::new();
    let inputs = drawn(&place, "blobs", "2", "33");
    let law = ["--law", "power_two_term", "--exponents", EXPONENTS];
    // Few iterations, before rounding errors have grown.
    let common = ["--grid", "17", "--align", "none", "--max-iterations", "3"];
    let coefficients = [&common[..], &law, &["--coefficients", COEFFICIENTS]].concat();
    let found = averaged(&place, &inputs, &coefficients, "coefficients");
    let [lambda, mu] = ["lambda", "mu"].map(|key| found.number(&format!("/parameters/{key}")));
    assert!((mu - PARTS.iter().sum::<f64>()).abs() < 1e-12, "{mu}");
    assert_eq!(found.numbers("/parameters/coefficients"), [0.1, 0.2, 0.9]);
    // lambda = P (p-2)/d + Q ((q-2)(d-1)^2/d + 2 (d-2)) + a3 s (s+r) - r (P + (d-1) Q).
    let by_formula = PARTS[0] + 0.9 * 3.0 * 5.0 - 2.0 * (PARTS[0] + PARTS[1]);
    assert!((lambda - by_formula).abs() < 1e-12, "{lambda}");

    let share = (PARTS[0] / mu).to_string();
    let (lambda, mu) = (lambda.to_string(), mu.to_string());
    let moduli = ["--lambda", &lambda, "--mu", &mu, "--norm-share", &share];
    let stated = averaged(
        &place,
        &inputs,
        &[&common[..], &law, &moduli].concat(),
        "moduli",
    );
    for (a, b) in found
        .numbers("/energy/elastic")
        .iter()
        .zip(stated.numbers("/energy/elastic"))
    {
        // The coefficients differ by rounding only.
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
    // Another law would be told apart by this.
    let plain = [&common[..], &["--law", "power_two_term"], &moduli[..4]].concat();
    let other = averaged(&place, &inputs, &plain, "other");
    let [a, b] = [&found, &other].map(|results| results.number("/energy/elastic/0"));
    assert!((a / b - 1.0).abs() > 1e-4, "{a} {b}");

    let config = place.path("coefficients/config.toml").display().to_string();
    let repeated = place.run(&[
        "average",
        "--config",
        &config,
        "-o",
        "repeated",
        "--allow-doubtful",
    ]);
    let printed = crate::common::succeeded(&repeated);
    let line = printed.lines().find(|line| line.starts_with("  law "));
    // lambda = 0.8 + 13.5 - 2 (0.8 + 0.4), by the formula above.
    let expected = "  law          power_two_term, lambda 11.9, mu 1.2, exponents 4,2,2,3, coefficients 0.1,0.2,0.9";
    assert_eq!(line, Some(expected), "{printed}");
    let repeated = crate::common::Results::read(&place.path("repeated"));
    assert_eq!(arrays(&found), arrays(&repeated));
}

/// The terminal states the moduli of a path.
#[test]
fn the_moduli_of_a_path_are_printed() {
    let place = Place::new();
    for (name, radius) in [("a.npy", "0.2"), ("b.npy", "0.22")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "17"]);
    }
    let options = [
        "a.npy", "b.npy", "-K", "2", "--lambda", "0.1", "--mu", "2.5",
    ];
    let run = place.compute(&[&["geodesic", "-o", "out"], &options[..]].concat());
    let printed = crate::common::succeeded(&run);
    let line = "\n  law          logdet, lambda 0.1, mu 2.5\n";
    assert!(printed.contains(line), "{printed}");
}

/// What does not go together is refused before anything is computed.
#[test]
fn options_of_other_laws_are_refused() {
    let place = Place::new();
    let inputs = drawn(&place, "blobs", "2", "33");
    let refused = |options: &[&str], said: &str| {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        let run = place.run(&[&["average", "-o", "out"], &inputs[..], options].concat());
        let text = String::from_utf8_lossy(&run.stderr).into_owned();
        let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(run.status.code(), Some(2), "{text}");
        assert!(text.contains(said), "{options:?}: {text}");
    };
    refused(
        &["--exponents", "4,4,2,9"],
        "logdet has no option exponents",
    );
    refused(
        &["--law", "power", "--coefficients", COEFFICIENTS],
        "choose the law power_two_term",
    );
    refused(
        &["--law", "power", "--exponents", "4,4,2"],
        "give four exponents",
    );
    refused(
        &["--law", "power", "--exponents", "4,1,2,9"],
        "must be at least 2",
    );
    refused(
        &["--law", "power_two_term", "--coefficients", "0,0,1"],
        "must be positive",
    );
    // Their energies are negative for slight expansions.
    for (coefficients, least) in [("1,1,1", "at least 2"), ("0.1,0.1,0.19999", "at least 0.2")] {
        let options = ["--law", "power_two_term", "--coefficients", coefficients];
        refused(&options, least);
    }
    let both = ["--coefficients", COEFFICIENTS, "--norm-share", "0.5"];
    refused(
        &[&["--law", "power_two_term"], &both[..]].concat(),
        "left out",
    );
}
