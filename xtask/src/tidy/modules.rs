//! The modules of a crate, and the names by which their files refer to others.
//!
//! Only imports are parsed: `mod` and `use` items, and paths in the code. Macros are not expanded,
//! and modules inside a file are treated as part of it.

use std::collections::{BTreeMap, BTreeSet};
use std::iter::Peekable;
use std::path::{Path, PathBuf};

use super::code::{blanked, without_tests};

/// Maximal number of re-exports that are followed.
const MOST_HOPS: usize = 16;
/// Keywords that define the name after them.
const DEFINING: [&str; 8] = [
    "fn", "struct", "enum", "trait", "type", "const", "static", "union",
];

/// A module as a path from the root of its crate, which is the empty one.
pub type ModulePath = Vec<String>;

/// A name that a `use` item imports.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Import {
    /// The path of the item; for a glob, that of the module.
    path: Vec<String>,
    /// The name in the importing module; `None` for a glob.
    name: Option<String>,
    /// Whether other modules can import it from here.
    public: bool,
}

/// A module with a file of its own.
#[derive(Debug, Default)]
pub struct Module {
    /// The file.
    pub file: PathBuf,
    children: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in the code, outside of imports.
    paths: BTreeSet<Vec<String>>,
    /// Words in the code, outside of imports.
    words: BTreeSet<String>,
    defined: BTreeSet<String>,
}

/// All modules of a crate.
#[derive(Debug, Default)]
pub struct Tree(pub BTreeMap<ModulePath, Module>);

impl Tree {
    /// Reads a crate from its root file; `read` returns the text of a file, or `None` if there is
    /// no such file.
    pub fn read(root: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Self {
        let mut tree = Self::default();
        let folder = root.parent().unwrap_or(root);
        tree.add(&[], root, folder, read);
        tree
    }

    /// Adds the module of a file, and its submodules, whose files are in a folder.
    fn add(
        &mut self,
        path: &[String],
        file: &Path,
        folder: &Path,
        read: &dyn Fn(&Path) -> Option<String>,
    ) {
        let Some(text) = read(file) else { return };
        let mut module = Module::parsed(&without_tests(&blanked(&text)));
        module.file = file.into();
        let children = module.children.clone();
        self.0.insert(path.to_vec(), module);
        for child in children {
            let inside = folder.join(&child);
            let beside = folder.join(format!("{child}.rs"));
            let nested = inside.join("mod.rs");
            let file = if read(&beside).is_some() {
                beside
            } else {
                nested
            };
            let path = [path, &[child]].concat();
            self.add(&path, &file, &inside, read);
        }
    }

    /// The modules whose items a module names, with these names. Re-exports are ignored.
    pub fn named_by(&self, from: &ModulePath) -> BTreeMap<ModulePath, BTreeSet<String>> {
        let module = &self.0[from];
        let imported = module.imports.iter().filter(|import| {
            let used = import.name.as_ref().map(|name| module.words.contains(name));
            !import.public || used == Some(true)
        });
        let paths = imported.map(|import| &import.path).chain(&module.paths);
        let mut named = BTreeMap::<_, BTreeSet<_>>::new();
        for path in paths {
            if let Some(owner) = self.owner(from, path, MOST_HOPS).filter(|o| o != from) {
                let last = path.last().cloned().unwrap_or_default();
                named.entry(owner).or_default().insert(last);
            }
        }
        named
    }

    /// The module that defines the item of a path in a module; `None` if it is not in this crate.
    /// Re-exports are followed.
    fn owner(&self, from: &ModulePath, path: &[String], hops: usize) -> Option<ModulePath> {
        let mut at = from.clone();
        for (i, segment) in path.iter().enumerate() {
            match segment.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ if self.0[&at].children.contains(segment) => at.push(segment.clone()),
                _ => return self.found(&at, &path[i..], i == 0, hops),
            }
            if !self.0.contains_key(&at) {
                return None;
            }
        }
        Some(at)
    }

    /// The module that defines the item of a path that does not begin with a module.
    fn found(
        &self,
        at: &ModulePath,
        path: &[String],
        first: bool,
        hops: usize,
    ) -> Option<ModulePath> {
        let hops = hops.checked_sub(1)?;
        let (name, rest) = path.split_first()?;
        let module = &self.0[at];
        let mut imports = module.imports.iter();
        if let Some(import) = imports.find(|import| import.name.as_ref() == Some(name)) {
            return self.owner(at, &[&import.path, rest].concat(), hops);
        }
        if first {
            return None;
        }
        let globs = module.imports.iter().filter(|i| i.name.is_none());
        for glob in globs.filter(|_| !module.defined.contains(name)) {
            let inside = [&glob.path, path].concat();
            let owner = self.owner(at, &inside, hops);
            let defines = |owner: &ModulePath| self.0[owner].defined.contains(name);
            if let Some(owner) = owner.filter(defines) {
                return Some(owner);
            }
        }
        Some(at.clone())
    }
}

impl Module {
    /// Reads code without comments and strings.
    fn parsed(code: &str) -> Self {
        let mut module = Self::default();
        let mut tokens = tokens(code).into_iter().peekable();
        let mut previous = Token::Other(';');
        let mut public = false;
        while let Some(token) = tokens.next() {
            match token {
                Token::Word("use") => {
                    import_tree(&mut tokens, &[], public, &mut module.imports);
                }
                Token::Word("mod") => {
                    if let Some(Token::Word(name)) = tokens.next()
                        && tokens.peek() == Some(&Token::Other(';'))
                    {
                        module.children.insert(name.into());
                    }
                }
                Token::Word(word) => module.word(word, previous, &mut tokens),
                _ => {}
            }
            public = match token {
                Token::Word("pub") => true,
                // The restriction after `pub`: `(crate)`, `(in path)`.
                Token::Other('(' | ')') | Token::Word("crate" | "super" | "self" | "in") => public,
                _ => false,
            };
            previous = token;
        }
        module
    }

    /// Reads a word of the code, and the path that begins with it.
    fn word<'a>(
        &mut self,
        word: &'a str,
        previous: Token<'a>,
        tokens: &mut Peekable<impl Iterator<Item = Token<'a>>>,
    ) {
        if let Token::Word(defining) = previous
            && DEFINING.contains(&defining)
        {
            self.defined.insert(word.into());
        }
        let mut path = vec![word.to_owned()];
        while tokens.peek() == Some(&Token::Colons) {
            tokens.next();
            let Some(&Token::Word(next)) = tokens.peek() else {
                break;
            };
            tokens.next();
            path.push(next.into());
        }
        self.words.insert(word.into());
        // The continuation of another expression, as in `<T as Law>::Output`, is not looked up.
        if path.len() > 1 && previous != Token::Colons {
            self.paths.insert(path);
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Token<'a> {
    Word(&'a str),
    /// `::`
    Colons,
    Other(char),
}

fn tokens(code: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let length = if is_word(first) {
            let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            found.push(Token::Word(&rest[..end]));
            end
        } else if rest.starts_with("::") {
            found.push(Token::Colons);
            2
        } else {
            found.push(Token::Other(first));
            first.len_utf8()
        };
        rest = rest[length..].trim_start();
    }
    found
}

/// Reads what follows `use`, or one branch of it in braces, up to the end.
fn import_tree<'a>(
    tokens: &mut Peekable<impl Iterator<Item = Token<'a>>>,
    prefix: &[String],
    public: bool,
    imports: &mut Vec<Import>,
) {
    let mut path = prefix.to_vec();
    let mut name = None;
    // A path that begins with `::` leads to another crate.
    let foreign = tokens.peek() == Some(&Token::Colons);
    while let Some(&token) = tokens.peek() {
        if matches!(token, Token::Other(',' | '}' | ';')) {
            break;
        }
        tokens.next();
        match token {
            Token::Word("as") => {
                if let Some(Token::Word(alias)) = tokens.next() {
                    name = Some(alias.to_owned());
                }
            }
            // Inside braces `self` is the module before them.
            Token::Word("self") if !path.is_empty() => {}
            Token::Word(word) => path.push(word.to_owned()),
            Token::Other('*') => {
                let name = None;
                return imports.push(Import { path, name, public });
            }
            Token::Other('{') => return branches(tokens, &path, public, imports),
            _ => {}
        }
    }
    let name = name.or_else(|| path.last().cloned());
    if name.is_some() && !foreign {
        imports.push(Import { path, name, public });
    }
}

/// Reads the branches of an import after an opening brace, with the closing one.
fn branches<'a>(
    tokens: &mut Peekable<impl Iterator<Item = Token<'a>>>,
    prefix: &[String],
    public: bool,
    imports: &mut Vec<Import>,
) {
    loop {
        if tokens.peek() != Some(&Token::Other('}')) {
            import_tree(tokens, prefix, public, imports);
        }
        match tokens.next() {
            Some(Token::Other(',')) => {}
            _ => return,
        }
    }
}
