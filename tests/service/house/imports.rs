//! The uses among the modules of `src`: every path of every file, whatever the form of its `use`, resolved to the file that it leads to.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A file as the path of its module: `["job", "engine"]`.
pub type Module = Vec<String>;

/// The modules that each module uses, beside tests.
pub struct Imports {
    pub uses: BTreeMap<Module, BTreeSet<Module>>,
}

/// The paths that a file uses, and those that it renames or re-exports.
#[derive(Default)]
struct Said {
    uses: Vec<Vec<String>>,
    /// The names that a `use` brings into the file, with their paths.
    names: BTreeMap<String, Vec<String>>,
    /// The names of a `pub use`, with their paths.
    handed_on: BTreeMap<String, Vec<String>>,
}

impl Imports {
    /// The uses of all files below `src`.
    pub fn of(src: &Path) -> Self {
        let mut said = BTreeMap::new();
        for path in super::files(src, "rs") {
            let module = module(path.strip_prefix(src).unwrap());
            if !["lib", "main"].contains(&module[0].as_str()) {
                let text = std::fs::read_to_string(&path).unwrap();
                let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                let mut of_file = Said::default();
                of_file.read(tokens);
                said.insert(module, of_file);
            }
        }
        let resolve = |module: &Module| {
            let of_file = &said[module];
            let paths = of_file.uses.iter().chain(of_file.names.values());
            let absolute = paths.filter_map(|path| absolute(module, path, &said));
            let found = absolute.filter_map(|path| resolve(path, &said)).filter(|other| other != module);
            (module.clone(), found.collect())
        };
        Self { uses: said.keys().map(resolve).collect() }
    }

    /// Circles: modules of one folder that use each other, directly or not, with all that is below them. It is no circle if a folder's own file
    /// uses files in the folder, or the other way round.
    pub fn circles(&self) -> Vec<Vec<String>> {
        let folders: BTreeSet<&[String]> = self.uses.keys().flat_map(|m| (0..m.len()).map(|n| &m[..n])).collect();
        folders.into_iter().flat_map(|folder| self.circles_in(folder)).collect()
    }

    fn circles_in(&self, folder: &[String]) -> Vec<Vec<String>> {
        let child = |m: &Module| m.starts_with(folder).then(|| m.get(folder.len()).cloned()).flatten();
        let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (from, all) in &self.uses {
            let Some(from) = child(from) else { continue };
            let others = all.iter().filter_map(child).filter(|to| *to != from);
            edges.entry(from.clone()).or_default().extend(others);
        }
        let reach = |from: &String| {
            let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
            while let Some(at) = next.pop() {
                next.extend(edges.get(at).into_iter().flatten().filter(|to| seen.insert((*to).clone())));
            }
            seen
        };
        let in_circle: Vec<String> = edges.keys().filter(|m| reach(m).contains(*m)).cloned().collect();
        let whole = |m: &String| folder.iter().chain([m]).cloned().collect::<Vec<_>>().join("::");
        if in_circle.is_empty() { Vec::new() } else { vec![in_circle.iter().map(whole).collect()] }
    }
}

/// `job/engine.rs` as `["job", "engine"]`, `job/mod.rs` as `["job"]`.
fn module(file: &Path) -> Module {
    let parts = file.with_extension("");
    let mut parts: Module = parts.iter().map(|p| p.to_str().unwrap().to_owned()).collect();
    if parts.last().is_some_and(|last| last == "mod") {
        parts.pop();
    }
    parts
}

/// A path from the root of the crate; `None` for a path that leads out of it.
fn absolute(module: &Module, path: &[String], said: &BTreeMap<Module, Said>) -> Option<Vec<String>> {
    let supers = path.iter().take_while(|part| *part == "super").count();
    let below = |base: &[String], rest: &[String]| Some([base, rest].concat());
    match path[0].as_str() {
        "crate" => below(&[], &path[1..]),
        "self" => below(module, &path[1..]),
        _ if supers > 0 => below(&module[..module.len().checked_sub(supers)?], &path[supers..]),
        first => {
            if let Some(names) = said[module].names.get(first).filter(|whole| **whole != path) {
                let whole = [names, &path[1..]].concat();
                return (names[0] != path[0]).then(|| absolute(module, &whole, said)).flatten();
            }
            let child = [module.as_slice(), &[first.to_owned()]].concat();
            if said.contains_key(&child) { below(module, path) } else { None }
        }
    }
}

/// The file that a path from the root leads to, through all re-exports of its last part.
fn resolve(path: Vec<String>, said: &BTreeMap<Module, Said>) -> Option<Module> {
    let length = (1..=path.len()).rev().find(|n| said.contains_key(&path[..*n]))?;
    let (module, rest) = (path[..length].to_vec(), &path[length..]);
    let further = rest.first().and_then(|name| said[&module].handed_on.get(name));
    let next = further.and_then(|to| absolute(&module, &[to, &rest[1..]].concat(), said)).filter(|next| *next != path);
    next.and_then(|next| resolve(next, said)).or(Some(module))
}

impl Said {
    /// Reads a file's tokens. Comments and texts are no tokens of paths.
    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let word = |i: usize| tokens.get(i).map(ToString::to_string).unwrap_or_default();
        let mut at = 0;
        while at < tokens.len() {
            if word(at) == "mod" && word(at + 1) == "tests" {
                at += 3;
            } else if word(at) == "use" {
                let end = (at..tokens.len()).find(|i| word(*i) == ";").unwrap_or(tokens.len());
                let public = at > 0 && (word(at - 1) == "pub" || (at > 1 && word(at - 2) == "pub"));
                self.read_use(&tokens[at + 1..end], Vec::new(), public);
                at = end + 1;
            } else if let TokenTree::Group(group) = &tokens[at] {
                self.read(group.stream());
                at += 1;
            } else {
                at += self.read_path(&tokens[at..]);
            }
        }
    }

    /// Reads a path such as `film::Film::new`, and returns the number of its tokens.
    fn read_path(&mut self, tokens: &[TokenTree]) -> usize {
        let mut path = Vec::new();
        let mut at = 0;
        while let Some(TokenTree::Ident(ident)) = tokens.get(at) {
            path.push(ident.to_string());
            let colon = |i: usize| tokens.get(i).is_some_and(|t| t.to_string() == ":");
            if !(colon(at + 1) && colon(at + 2)) {
                at += 1;
                break;
            }
            at += 3;
        }
        if path.len() > 1 {
            self.uses.push(path);
        }
        at.max(1)
    }

    /// Reads the tree of a `use`.
    fn read_use(&mut self, tokens: &[TokenTree], before: Vec<String>, public: bool) {
        for branch in tokens.split(|t| t.to_string() == ",") {
            let mut path = before.clone();
            let mut name = None;
            let mut tokens = branch.iter();
            while let Some(token) = tokens.next() {
                match token {
                    TokenTree::Ident(ident) if *ident == "as" => name = tokens.next().map(ToString::to_string),
                    TokenTree::Ident(ident) => path.push(ident.to_string()),
                    TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                        let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                        self.read_use(&inner, std::mem::take(&mut path), public);
                    }
                    _ => {}
                }
            }
            if path.last().is_some_and(|last| last == "self") && path.len() > 1 {
                path.pop();
            }
            if let Some(last) = path.last().cloned() {
                let name = name.unwrap_or(last);
                if public {
                    self.handed_on.insert(name, path)
                } else {
                    self.names.insert(name, path)
                };
            }
        }
    }
}
