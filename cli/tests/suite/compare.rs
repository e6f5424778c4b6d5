//! `compare` from files to files.

use crate::common::{Place, Results, arrays, npy_f64, picture_size, succeeded};

const NODES: usize = 33;
const SHAPES: usize = 8;

const WIDE: f64 = 0.8;
const TALL: f64 = 1.25;
const ROUND: f64 = 1.0;

/// Writes ellipses: every second one of the first ratio of its half axes, the others of the second, of growing sizes.
fn ellipses(place: &Place, ratios: [f64; 2]) -> Vec<String> {
    let h = 1.0 / (NODES - 1) as f64;
    let mut names = Vec::new();
    for k in 0..SHAPES {
        let size = 0.26 + 0.01 * (k / 2) as f64;
        let tall = ratios[k % 2];
        let value = |node: usize| {
            let (x, y) = (
                (node % NODES) as f64 * h - 0.5,
                (node / NODES) as f64 * h - 0.5,
            );
            (0.5 + (size - (x * tall).hypot(y / tall)) / (4.0 * h)).clamp(0.0, 1.0)
        };
        let values: Vec<f64> = (0..NODES * NODES).map(value).collect();
        names.push(format!("ellipse_{k}.npy"));
        place.write(&names[k], &npy_f64(&[NODES, NODES], &values));
    }
    names
}

fn compare(
    place: &Place,
    result: &str,
    table: &str,
    output: &str,
    more: &[&str],
) -> (Results, String) {
    let fixed = [
        "compare",
        result,
        "--groups",
        table,
        "-o",
        output,
        "--allow-doubtful",
    ];
    let run = place.run(&[&fixed[..], &["--permutations", "499"], more].concat());
    let text = succeeded(&run);
    (Results::read(&place.path(output)), text)
}

#[test]
fn groups_of_modes_and_of_distances_are_told_apart() {
    let place = Place::new();
    let names = ellipses(&place, [WIDE, TALL]);
    let masks: Vec<&str> = names.iter().map(String::as_str).collect();
    let average = [
        "average",
        "-o",
        "average",
        "--grid",
        "33",
        "--allow-doubtful",
        "--align",
        "none",
    ];
    succeeded(&place.run(&[&average[..], &masks].concat()));
    succeeded(&place.run(&["pca", "average", "-o", "modes", "--allow-doubtful"]));
    // In another order than the result, with a line of another shape, and spaces.
    let mut table = "file, group, size, remark\nother.npy, wide, 3, x\n".to_owned();
    for k in (0..SHAPES).rev() {
        let group = if k % 2 == 0 { "wide" } else { "tall" };
        let line = format!("ellipse_{k}.npy, {group}, {}, ellipse\n", 26 + k / 2);
        table.push_str(&line);
    }
    place.write("groups.csv", table.as_bytes());
    let (found, text) = compare(&place, "modes", "groups.csv", "compared", &[]);
    assert_eq!(found.json["groups"][0]["name"], "wide");
    assert_eq!(found.number("/groups/1/n_shapes"), 4.0);
    assert_eq!(found.number("/ignored_lines"), 1.0);
    // Two of the seventy divisions in halves are that of the shapes; four standard errors of 500.
    let p = found.number("/scores/p_value_overall");
    assert!((p - 2.0 / 70.0).abs() < 0.03, "{p}");
    assert!(found.number("/scores/p_value_family_wise/0") < 0.07);
    assert_eq!(found.number("/classification/balanced_accuracy"), 1.0);
    assert!(found.number("/boundary/different_share") > 0.5);
    // The half axes of the wide and of the tall ones differ by size * (1.25 - 0.8), about .124. Modes are
    // the linear response to the stresses, which falls short of such deformations by a tenth.
    let difference = found.number("/boundary/largest_difference");
    assert!((difference / 0.124 - 1.0).abs() < 0.2, "{difference}");
    // The size is the covariate, whose order the groups do not know.
    assert_eq!(found.json["covariates"].as_array().unwrap().len(), 1);
    assert_eq!(found.number("/covariates/0/least"), 26.0);
    let of_modes = found.numbers("/covariates/0/p_value_family_wise");
    assert!(of_modes.iter().any(|p| *p < 0.05), "{of_modes:?}");
    let volume = |name: &str| -> f64 {
        let cells = (NODES - 1) as f64;
        let distances = found.array(name).1.into_iter();
        distances.map(|d| (0.5 + cells * d).clamp(0.0, 1.0)).sum()
    };
    // Areas as the squares of 26 and 29; of the linear response an eighth of the growth is missing.
    let ratio = volume("predicted_002.npy") / volume("predicted_000.npy");
    assert!(
        (ratio / (29.0f64 / 26.0).powi(2) - 1.0).abs() < 0.05,
        "{ratio}"
    );
    assert!((volume("mean_000.npy") / volume("mean_001.npy") - 1.0).abs() < 0.05);
    for word in [
        "Comparison of 2 groups",
        "all modes",
        "left out",
        "size",
        "verdict",
    ] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    for name in ["compare.png", "scores.png"] {
        assert!(picture_size(&found.path(name))[0] > 500, "{name}");
    }
    for (name, rows) in [
        ("shapes.csv", SHAPES),
        ("modes.csv", found.number("/n_modes") as usize),
    ] {
        let text = std::fs::read_to_string(found.path(name)).unwrap();
        assert_eq!(text.lines().count(), rows + 1, "{name}");
    }
    assert!(found.path("boundary.csv").is_file() && found.path("report.html").is_file());

    let (again, _) = compare(&place, "modes", "groups.csv", "again", &["--threads", "1"]);
    assert_eq!(arrays(&found), arrays(&again));
    assert_eq!(found.json["scores"], again.json["scores"]);

    // Modes of little variance do not hide the difference.
    let (all, _) = compare(&place, "modes", "groups.csv", "all", &["--modes", "7"]);
    assert!(all.number("/scores/p_value_overall") < 0.07);

    // A column with a cell that is no number is named; separators and the case of titles are what they are.
    let rows = (0..8).map(|i| {
        let [group, age] = [
            if i < 4 { "a" } else { "b" },
            if i == 2 { "NA" } else { "7" },
        ];
        format!("ellipse_{i};{group};{age};{i};{i},5;tall\n")
    });
    let table = format!(
        "file;Group;age;height;weight;look\n{}",
        rows.collect::<String>()
    );
    place.write("spaced.csv", table.as_bytes());
    let (gaps, text) = compare(&place, "modes", "spaced.csv", "gaps", &[]);
    assert_eq!(gaps.json["covariates_left_out"][0]["name"], "age");
    assert_eq!(gaps.json["covariates"][0]["name"], "height");
    for reason in [
        "'NA' of 'ellipse_2' is not a number",
        "'0,5' of 'ellipse_0' has a comma",
        "it has no numbers",
    ] {
        assert!(text.contains(reason), "{reason}: {text}");
    }
    // Groups that are no groups.
    place.write("halves.csv", b"file,group\nellipse_0,a\nellipse_1,a\nellipse_2,b\nellipse_3,b\nellipse_4,b\nellipse_5,b\nellipse_6,a\nellipse_7,a\n");
    let (none, _) = compare(&place, "modes", "halves.csv", "none", &[]);
    assert!(none.number("/scores/p_value_overall") > 0.3);

    let distances = [
        "distances",
        "-o",
        "distances",
        "--grid",
        "33",
        "-K",
        "2",
        "--allow-doubtful",
    ];
    // Wide and tall ones differ by a rotation, which no distance sees.
    ellipses(&place, [WIDE, ROUND]);
    succeeded(&place.run(&[&distances[..], &masks[..5], &["--align", "none"]].concat()));
    let (found, _) = compare(&place, "distances", "groups.csv", "by_distance", &[]);
    // One of the ten divisions of five shapes into three and two.
    assert!((found.number("/distances/p_value") - 0.1).abs() < 0.06);
    assert_eq!(found.json["doubts"][0]["what"], "group_sizes");
    // Distances have no modes.
    let with_modes = [
        "compare",
        "distances",
        "--groups",
        "groups.csv",
        "--modes",
        "2",
        "-o",
        "out",
    ];
    let run = place.run(&with_modes);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--modes"));
    // Nor are there fifty of eight shapes.
    let more = [
        "compare",
        "modes",
        "--groups",
        "groups.csv",
        "--modes",
        "50",
    ];
    let run = place.run(&[&more[..], &["-o", "out"]].concat());
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--modes"));
}

/// `pca` draws groups as `compare` does, and nothing else depends on them.
#[test]
fn modes_are_drawn_with_their_groups() {
    let place = Place::new();
    let names = ellipses(&place, [WIDE, TALL]);
    let masks: Vec<&str> = names.iter().map(String::as_str).collect();
    let average = [
        "average", "--grid", "17", "--align", "none", "-o", "average",
    ];
    succeeded(&place.compute(&[&average[..], &masks].concat()));
    let line = |k: usize| {
        let (shape, half) = (["wide", "tall"][k % 2], ["first", "last"][k / 4]);
        format!("ellipse_{k}.npy,{half},{shape}\n")
    };
    let lines: String = (0..SHAPES).map(line).collect();
    let table = format!("file,half,group\nother.npy,x,y\n{lines}");
    place.write("groups.csv", table.as_bytes());
    let analysed = |out: &str, options: &[&str]| {
        let command = [&["pca", "average", "-o", out], options].concat();
        succeeded(&place.compute(&command));
        Results::read(&place.path(out))
    };
    let map = |results: &Results| std::fs::read(results.path("scores.png")).unwrap();
    let plain = analysed("plain", &[]);
    let grouped = analysed("grouped", &["--groups", "groups.csv"]);
    // By default `compare` leaves out modes of little variance.
    let modes = plain.number("/n_modes").to_string();
    let all = ["--modes", &modes];
    let (compared, _) = compare(&place, "plain", "groups.csv", "compared", &all);
    assert!(map(&grouped) == map(&compared) && map(&grouped) != map(&plain));
    assert_eq!(arrays(&grouped), arrays(&plain));
    for key in ["scores", "outliers", "doubts"] {
        assert_eq!(grouped.json[key], plain.json[key], "{key}");
    }
    assert!(plain.json["groups"].is_null());
    assert_eq!(grouped.json["parameters"]["groups"], "groups.csv");
    assert_eq!(grouped.json["groups"][0]["name"], "wide");
    assert_eq!(grouped.number("/groups/1/n_shapes"), 4.0);
    assert_eq!(grouped.json["group_of_shape"][7], "tall");
    assert_eq!(grouped.number("/ignored_lines"), 1.0);
    let scores = std::fs::read_to_string(grouped.path("scores.csv")).unwrap();
    let column = scores.lines().map(|line| line.rsplit(',').next().unwrap());
    let [named, first, second] = column.take(3).collect::<Vec<_>>()[..] else {
        panic!("{scores}");
    };
    assert_eq!([named, first, second], ["group", "wide", "tall"]);
    // From the directory of the result, wherever that is read.
    let again = analysed("again", &["--config", "grouped/config.toml"]);
    assert!(map(&again) == map(&grouped));
    assert_eq!(again.json["groups"], grouped.json["groups"]);
    let other = analysed("other", &["--groups", "groups.csv", "--column", "half"]);
    assert_eq!(other.json["groups"][1]["name"], "last");
    assert!(map(&other) != map(&grouped));

    place.write("short.csv", b"file,group\nellipse_0,a\nellipse_1,b\n");
    let cases: [(&[&str], &str); 5] = [
        (&["--column", "half"], "name its table with --groups"),
        (&["--groups", "none.csv"], "'none.csv'"),
        (
            &["--groups", "groups.csv", "--column", "age"],
            "no column 'age'",
        ),
        (&["--groups", "short.csv"], "no line for 6 shapes"),
        (&["--groups", "prefix"], "two groups"),
    ];
    for (options, words) in cases {
        let run = place.run(&[&["pca", "average", "-o", "refused"], options].concat());
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{options:?}: {text}");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(words), "no '{words}' in: {text}");
        assert!(!place.path("refused").exists());
    }
}

#[test]
fn tables_that_cannot_be_used_are_refused() {
    let place = Place::new();
    let names = ellipses(&place, [WIDE, TALL]);
    let masks = [&*names[0], &names[1], &names[2]];
    let average = [
        "average",
        "-o",
        "average",
        "--grid",
        "17",
        "--allow-doubtful",
    ];
    succeeded(&place.run(&[&average[..], &masks].concat()));
    succeeded(&place.run(&["pca", "average", "-o", "modes", "--allow-doubtful"]));
    let cases: [(&str, &[&str]); 10] = [
        ("file,kind\nellipse_0,a\n", &["no column 'group'", "kind"]),
        (
            "file,group\nellipse_0,a\nellipse_1,b\n",
            &["ellipse_2", "1 shape of"],
        ),
        (
            "file,group\nellipse_0,a\nellipse_1,a\nellipse_2,a\n",
            &["two groups"],
        ),
        (
            "file,group\nellipse_0,a\nellipse_1,b\nellipse_2,c\n",
            &["3 shapes in 3 groups"],
        ),
        ("file,group\nellipse_0,a\nellipse_0,b\n", &["two lines"]),
        ("file,group\nellipse_0,\n", &["no group"]),
        ("file,group\nellipse_0,a,b\n", &["line 2", "3 cells"]),
        ("", &["it is empty"]),
        ("sep=;\nfile;group\n", &["sep=", "leave this line out"]),
        ("file,group,age,age\n", &["two columns 'age'"]),
    ];
    for (table, words) in cases {
        place.write("groups.csv", table.as_bytes());
        let run = place.run(&["compare", "modes", "--groups", "groups.csv", "-o", "out"]);
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{table}: {text}");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in words {
            assert!(text.contains(word), "no '{word}' in: {text}");
        }
        assert!(!place.path("out").exists());
    }
    // Lines of blanks are none, and `group` goes before `class`.
    let table = "file,class,group\nellipse_0,a,b\n  \nellipse_1,a,b\n,,\nellipse_2,a,c\n";
    place.write("both.csv", table.as_bytes());
    let both = ["compare", "modes", "--groups", "both.csv", "-o", "both"];
    succeeded(&place.compute(&both));
    let named = &Results::read(&place.path("both")).json["groups"];
    assert_eq!(named.as_array().map(Vec::len), Some(2), "{named}");
    // Covariates that were asked for.
    for (ages, words) in [
        (["7", "7", "7"], &["groups.csv", "'age'", "equal"][..]),
        (
            ["7", "NaN", "8"],
            &["'groups.csv', line 3", "'NaN' of 'ellipse_1'", "finite"],
        ),
        (
            ["7", "", "8"],
            &["'groups.csv', line 3", "'ellipse_1'", "empty"],
        ),
    ] {
        let [a, b, c] = ages;
        let table = format!("file,group,age\nellipse_0,a,{a}\nellipse_1,a,{b}\nellipse_2,b,{c}\n");
        place.write("groups.csv", table.as_bytes());
        let run = place.run(&[
            "compare",
            "modes",
            "--groups",
            "groups.csv",
            "--covariates",
            "age",
            "-o",
            "out",
        ]);
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{ages:?}: {text}");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in words {
            assert!(text.contains(word), "no '{word}' in: {text}");
        }
    }
    place.write("latin.csv", b"file,group\nellipse_0,gro\xdfe\n");
    let run = place.run(&["compare", "modes", "--groups", "latin.csv", "-o", "out"]);
    let text = String::from_utf8_lossy(&run.stderr);
    assert!(text.contains("UTF-8"), "{text}");
    let both = ["compare", "modes", "--groups", "both.csv"];
    let prefix = ["compare", "modes", "--groups", "prefix"];
    for arguments in [
        &["compare", "average", "--groups", "groups.csv", "-o", "out"][..],
        &[&both[..], &["--covariates", "group", "-o", "out"]].concat(),
        &[&prefix[..], &["--column", "age", "-o", "out"]].concat(),
        &["compare", "modes", "--groups", "missing.csv", "-o", "out"],
        &["compare", "modes", "-o", "out"],
        &[
            "compare",
            "modes",
            "--groups",
            "groups.csv",
            "--permutations",
            "5",
            "-o",
            "out",
        ],
    ] {
        let run = place.run(arguments);
        assert_eq!(run.status.code(), Some(2), "{arguments:?}");
    }
}
