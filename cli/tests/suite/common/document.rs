//! Documents in Markdown whose commands are run as a reader would run them.

use super::Place;

/// A fenced block of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// What follows the opening fence, such as `sh`.
    pub info: String,
    pub lines: Vec<String>,
}

/// All fenced blocks, in order.
pub fn blocks(text: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut open: Option<Block> = None;
    for line in text.lines() {
        match (line.trim_end().strip_prefix("```"), &mut open) {
            (Some(info), None) => {
                open = Some(Block {
                    info: info.trim().to_owned(),
                    lines: Vec::new(),
                });
            }
            (Some(_), Some(_)) => found.extend(open.take()),
            (None, Some(block)) => block.lines.push(line.to_owned()),
            (None, None) => {}
        }
    }
    assert_eq!(open, None, "a block is not closed");
    found
}

/// The commands of a block.
pub fn commands(block: &Block) -> impl Iterator<Item = &str> {
    let lines = block.lines.iter().map(|line| line.trim());
    lines.filter(|line| !line.is_empty())
}

/// The arguments of a call of the program; none for a command that is none.
pub fn arguments(command: &str) -> Option<Vec<&str>> {
    let program = ["shapespace ", "cargo run --release -- "];
    let rest = program.iter().find_map(|p| command.strip_prefix(p))?;
    Some(rest.split_whitespace().collect())
}

/// The arguments of a call as the program gets them from the shell.
///
/// # Panics
/// If the command is no call of the program, or a pattern in it matches no file.
pub fn words(place: &Place, command: &str) -> Vec<String> {
    let Some(arguments) = arguments(command) else {
        panic!("this test does not know how to run `{command}`");
    };
    let words = arguments.into_iter();
    words.flat_map(|word| expanded(place, word)).collect()
}

/// `folder/*.ending` as the shell expands it; a word in quotes without them.
fn expanded(place: &Place, word: &str) -> Vec<String> {
    if let Some(quoted) = word.strip_prefix('\'') {
        return vec![quoted.trim_end_matches('\'').to_owned()];
    }
    let Some((folder, ending)) = word.split_once("/*") else {
        return vec![word.to_owned()];
    };
    let entries = std::fs::read_dir(place.path(folder)).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(ending))
        .map(|name| format!("{folder}/{name}"))
        .collect();
    names.sort();
    assert!(!names.is_empty(), "nothing matches {word}");
    names
}

#[test]
fn blocks_and_words_are_found() {
    let text = "a\n```sh\nx y\n\nz\n```\n```text\n  out\n```\n";
    let found = blocks(text);
    assert_eq!(found.len(), 2);
    assert_eq!((&*found[0].info, &*found[1].info), ("sh", "text"));
    assert_eq!(commands(&found[0]).collect::<Vec<_>>(), ["x y", "z"]);
    assert_eq!(found[1].lines, ["  out"]);
    assert_eq!(arguments("shapespace a b"), Some(vec!["a", "b"]));
    assert_eq!(arguments("rm -r x"), None);
    let place = Place::new();
    for name in ["b.png", "a.png", "c.npy"] {
        place.write(name, b"");
    }
    assert_eq!(
        words(&place, "shapespace 'x*' ./*.png"),
        ["x*", "./a.png", "./b.png"]
    );
}
