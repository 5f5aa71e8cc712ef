//! The imports of a crate, read from its sources: which file uses which items of which other file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree, Visibility};

/// Longest chain of re-exports that is followed.
const LONGEST_CHAIN: usize = 16;

type ModulePath = Vec<String>;

/// The modules of a crate and the paths that they name.
#[derive(Debug, Default)]
pub(super) struct Crate {
    modules: BTreeMap<ModulePath, Module>,
    references: Vec<Reference>,
}

#[derive(Debug, Default)]
struct Module {
    /// Relative to `src`.
    file: String,
    items: BTreeSet<String>,
    /// Names that `use` brings into scope, with their paths.
    names: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    is_test: bool,
}

#[derive(Debug)]
struct Reference {
    module: ModulePath,
    path: Vec<String>,
    is_reexport: bool,
}

/// The items of one file that another one uses.
pub(super) type Imports = BTreeMap<(String, String), BTreeSet<String>>;

impl Crate {
    /// Reads all files below a crate's `src`.
    pub(super) fn read(src: &Path) -> Self {
        let mut sources = Vec::new();
        read_sources(src, src, &mut sources);
        Self::of(&sources)
    }

    /// Files by path relative to `src`, with their text.
    pub(super) fn of(sources: &[(String, String)]) -> Self {
        let mut found = Self::default();
        for (file, text) in sources.iter().filter(|(file, _)| file != "main.rs") {
            let parsed = syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"));
            let mut reader = Reader {
                found: &mut found,
                file,
                module: module_of(file),
            };
            reader.begin_module();
            reader.visit_file(&parsed);
        }
        found
    }

    /// Returns the items that each file uses of others, outside tests. Items that `mod.rs` and `lib.rs` pass on count where they
    /// are defined.
    pub(super) fn imports(&self) -> Imports {
        let mut imports = Imports::new();
        for reference in &self.references {
            let from = &self.modules[&reference.module];
            let is_facade = from.file.ends_with("mod.rs") || from.file == "lib.rs";
            if reference.is_reexport && is_facade || self.is_test(&reference.module) {
                continue;
            }
            if let Some((file, item)) = self.resolve(&reference.module, &reference.path, 0)
                && file != from.file
            {
                let key = (from.file.clone(), file);
                imports.entry(key).or_default().insert(item);
            }
        }
        imports
    }

    /// Other crates that are named outside tests: file and crate.
    pub(super) fn crates(&self) -> BTreeSet<(String, String)> {
        let used = self.references.iter().filter(|r| !self.is_test(&r.module));
        used.filter(|r| r.path.len() > 1 && r.path[0].starts_with("tipwatch_"))
            .map(|reference| {
                let file = self.modules[&reference.module].file.clone();
                (file, reference.path[0].clone())
            })
            .collect()
    }

    fn is_test(&self, module: &[String]) -> bool {
        let of = |length| self.modules.get(&module[..length]);
        (0..=module.len()).any(|length| of(length).is_some_and(|module| module.is_test))
    }

    /// Returns file and name of the item that a path names; `None` for items outside the crate, and for modules themselves.
    fn resolve(&self, base: &[String], path: &[String], depth: usize) -> Option<(String, String)> {
        let (mut current, mut rest) = self.start(base, path, depth)?;
        while let Some((name, after)) = rest.split_first() {
            let below = [current.as_slice(), std::slice::from_ref(name)].concat();
            if !self.modules.contains_key(&below) {
                break;
            }
            (current, rest) = (below, after.to_vec());
        }
        let name = rest.first()?;
        let module = &self.modules[&current];
        if depth > LONGEST_CHAIN {
            return None;
        }
        // before the names that are brought in: a file passes its macros on under their own names
        if module.items.contains(name) {
            return Some((module.file.clone(), name.clone()));
        }
        if let Some(target) = module.names.get(name) {
            let whole = [target.as_slice(), &rest[1..]].concat();
            // a name that is brought in under itself is another crate's
            return (whole != rest || !base.starts_with(&current))
                .then(|| self.resolve(&current, &whole, depth + 1))?;
        }
        let mut own = module
            .globs
            .iter()
            .filter(|glob| self.is_own(&current, glob));
        own.find_map(|glob| {
            let whole = [glob.as_slice(), &rest].concat();
            self.resolve(&current, &whole, depth + 1)
        })
    }

    /// Whether a path used in this module leads into its own crate.
    fn is_own(&self, base: &[String], path: &[String]) -> bool {
        let Some(first) = path.first() else {
            return false;
        };
        let module = &self.modules[base];
        ["crate", "self", "super"].contains(&first.as_str())
            || module.names.contains_key(first)
            || module.items.contains(first)
            || self.modules.contains_key(&[base, &path[..1]].concat())
    }

    /// Returns the module that a path starts in, and the rest of the path.
    fn start(
        &self,
        base: &[String],
        path: &[String],
        depth: usize,
    ) -> Option<(ModulePath, Vec<String>)> {
        let mut current = base.to_vec();
        let mut rest = path;
        loop {
            match rest.first()?.as_str() {
                "crate" => current.clear(),
                "self" => {}
                "super" => drop(current.pop()?),
                _ => break,
            }
            rest = &rest[1..];
        }
        if rest.len() == path.len() {
            let is_known = self.is_own(base, rest) || !self.modules[base].globs.is_empty();
            // a name that a function's own scope or another crate gives
            if !is_known || depth > LONGEST_CHAIN {
                return None;
            }
        }
        Some((current, rest.to_vec()))
    }
}

fn read_sources(src: &Path, folder: &Path, sources: &mut Vec<(String, String)>) {
    let entries =
        std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            read_sources(src, &path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let name = path.strip_prefix(src).unwrap().to_string_lossy().into();
            sources.push((name, std::fs::read_to_string(&path).unwrap()));
        }
    }
}

fn module_of(file: &str) -> ModulePath {
    let path = file.trim_end_matches(".rs").trim_end_matches("/mod");
    match path {
        "lib" | "mod" => Vec::new(),
        path => path.split('/').map(String::from).collect(),
    }
}

/// Collects the items that a file defines, and those that it names.
struct Reader<'a> {
    found: &'a mut Crate,
    file: &'a str,
    module: ModulePath,
}

impl Reader<'_> {
    /// The module may be known already from the `mod` that declares it.
    fn begin_module(&mut self) {
        let module = self.found.modules.entry(self.module.clone()).or_default();
        module.file = self.file.into();
    }

    fn here(&mut self) -> &mut Module {
        self.found.modules.entry(self.module.clone()).or_default()
    }

    fn refer(&mut self, path: Vec<String>, is_reexport: bool) {
        self.found.references.push(Reference {
            module: self.module.clone(),
            path,
            is_reexport,
        });
    }

    fn import(&mut self, tree: &UseTree, before: &[String], is_reexport: bool) {
        let with = |name: &syn::Ident| {
            let mut path = before.to_vec();
            if name != "self" || path.is_empty() {
                path.push(name.to_string());
            }
            path
        };
        match tree {
            UseTree::Path(path) => self.import(&path.tree, &with(&path.ident), is_reexport),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, before, is_reexport);
                }
            }
            UseTree::Glob(_) => self.here().globs.push(before.to_vec()),
            UseTree::Name(name) => self.bring(with(&name.ident), None, is_reexport),
            UseTree::Rename(name) => {
                self.bring(
                    with(&name.ident),
                    Some(name.rename.to_string()),
                    is_reexport,
                );
            }
        }
    }

    fn bring(&mut self, path: Vec<String>, alias: Option<String>, is_reexport: bool) {
        let name = alias.or_else(|| path.last().cloned());
        if let Some(name) = name {
            self.here().names.insert(name, path.clone());
        }
        self.refer(path, is_reexport);
    }

    /// Paths in the arguments of a macro, which are not parsed.
    fn scan(&mut self, tokens: &proc_macro2::TokenStream) {
        use proc_macro2::TokenTree;
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        let trees = tokens.clone().into_iter().map(Some);
        for tree in trees.chain([None]) {
            match &tree {
                Some(TokenTree::Punct(punct)) if punct.as_char() == ':' && !path.is_empty() => {
                    colons += 1;
                    continue;
                }
                Some(TokenTree::Ident(ident)) if colons == 2 => {
                    path.push(ident.to_string());
                    colons = 0;
                    continue;
                }
                Some(TokenTree::Group(group)) => self.scan(&group.stream()),
                _ => {}
            }
            if !path.is_empty() {
                self.refer(std::mem::take(&mut path), false);
            }
            colons = 0;
            if let Some(TokenTree::Ident(ident)) = &tree {
                path.push(ident.to_string());
            }
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let (attributes, name) = about(item);
        if is_test(attributes) {
            if let Item::Mod(module) = item {
                let below = [self.module.clone(), vec![module.ident.to_string()]].concat();
                self.found.modules.entry(below).or_default().is_test = true;
            }
            return;
        }
        if let Some(name) = name {
            self.here().items.insert(name);
        }
        match item {
            Item::Mod(module) if module.content.is_some() => {
                self.module.push(module.ident.to_string());
                self.begin_module();
                visit::visit_item(self, item);
                self.module.pop();
            }
            Item::Mod(_) => {}
            _ => visit::visit_item(self, item),
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_reexport = !matches!(item.vis, Visibility::Inherited);
        self.import(&item.tree, &[], is_reexport);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments = path
            .segments
            .iter()
            .map(|segment| segment.ident.to_string());
        self.refer(segments.collect(), false);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.scan(&item.tokens);
        visit::visit_macro(self, item);
    }

    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_attribute(&mut self, _: &'ast Attribute) {}
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("cfg") => {
            let mut tokens = list.tokens.clone().into_iter();
            tokens.any(|token| token.to_string() == "test")
        }
        meta => meta.path().is_ident("test"),
    })
}

/// Attributes of an item, and the name that it defines in its module.
fn about(item: &Item) -> (&[Attribute], Option<String>) {
    match item {
        Item::Const(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Enum(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Fn(item) => (&item.attrs, Some(item.sig.ident.to_string())),
        Item::Impl(item) => (&item.attrs, None),
        Item::Macro(item) => (&item.attrs, item.ident.as_ref().map(ToString::to_string)),
        Item::Mod(item) => (&item.attrs, None),
        Item::Static(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Struct(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Trait(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Type(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Union(item) => (&item.attrs, Some(item.ident.to_string())),
        Item::Use(item) => (&item.attrs, None),
        _ => (&[], None),
    }
}
