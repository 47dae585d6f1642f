//! List of the public functions, methods and constructors of the library, parsed from its sources, for comparison with the
//! calls of the drivers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use syn::{Attribute, ImplItem, Item, ItemImpl, TraitItem, Type, UseTree, Visibility};

/// Path of a module, which begins with the name of its crate.
type Module = Vec<String>;
/// Public functions by module and name of their definition: public path, and true if their documentation has a section on
/// panics.
type Found = BTreeMap<Module, (String, bool)>;

/// Items of one module. Those with `#[doc(hidden)]` are for other crates of the workspace, and no part of the interface.
#[derive(Default)]
struct Scope {
    /// Public functions; true if their documentation has a section on panics.
    functions: BTreeMap<String, bool>,
    /// Public types and traits with their public methods.
    types: BTreeMap<String, BTreeMap<String, bool>>,
    /// Private types.
    private: BTreeSet<String>,
    /// Child modules; true if public.
    modules: BTreeMap<String, bool>,
    /// Public re-exports: name and path; `*` for a glob.
    exports: Vec<(String, Vec<String>)>,
    /// Public re-exports that are hidden: a facade may name their items.
    hidden: Vec<(String, Vec<String>)>,
    /// Methods in `impl` blocks, with their type, which may be defined in another module.
    methods: Vec<(String, String, bool)>,
}

/// Returns the functions that a user of the library in `root` can call, by public path; true for those with a section
/// "# Panics". Re-exports of the crates in `crates` are followed.
pub fn public_functions(root: &Path) -> BTreeMap<String, bool> {
    let mut scopes = BTreeMap::new();
    let library = vec!["motorfit".to_owned()];
    load(&root.join("src/lib.rs"), &root.join("src"), library.clone(), &mut scopes);
    for folder in std::fs::read_dir(root.join("crates")).into_iter().flatten().map(|entry| entry.unwrap().path()) {
        let name = folder.file_name().unwrap().to_str().unwrap().replace('-', "_");
        let source = folder.join("src");
        load(&source.join("lib.rs"), &source, vec![format!("motorfit_{name}")], &mut scopes);
    }
    attach_methods(&mut scopes);
    let mut found = BTreeMap::new();
    reach(&scopes, &library, "", &mut found);
    found.into_values().collect()
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// Returns true for code of unit tests.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let meta = &attribute.meta;
        meta.path().is_ident("cfg") && meta.require_list().is_ok_and(|list| list.tokens.to_string() == "test")
    })
}

/// Returns true for items that only other crates of the workspace use.
fn is_hidden(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let meta = &attribute.meta;
        meta.path().is_ident("doc") && meta.require_list().is_ok_and(|list| list.tokens.to_string() == "hidden")
    })
}

/// Returns true for items that are left out.
fn is_left_out(attributes: &[Attribute]) -> bool {
    is_test(attributes) || is_hidden(attributes)
}

fn documents_panics(attributes: &[Attribute]) -> bool {
    let is_heading = |attribute: &Attribute| {
        attribute.meta.require_name_value().is_ok_and(|doc| {
            let text = match &doc.value {
                syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) => text.value(),
                _ => String::new(),
            };
            text.trim() == "# Panics"
        })
    };
    attributes.iter().any(is_heading)
}

fn load(file: &Path, folder: &Path, module: Module, scopes: &mut BTreeMap<Module, Scope>) {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let items = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display())).items;
    fill(&items, folder, module, scopes);
}

/// Collects the items of a module and loads its child modules, whose files are in `folder`.
fn fill(items: &[Item], folder: &Path, module: Module, scopes: &mut BTreeMap<Module, Scope>) {
    let mut scope = Scope::default();
    for item in items {
        gather(item, &mut scope);
        let Item::Mod(child) = item else { continue };
        if is_test(&child.attrs) {
            continue;
        }
        let name = child.ident.to_string();
        let path = child.attrs.iter().find(|a| a.path().is_ident("path"));
        assert!(path.is_none(), "{name} has a path of its own");
        scope.modules.insert(name.clone(), is_public(&child.vis) && !is_hidden(&child.attrs));
        let inner = [&module[..], std::slice::from_ref(&name)].concat();
        if let Some((_, items)) = &child.content {
            fill(items, &folder.join(&name), inner, scopes);
            continue;
        }
        let [flat, deep] = [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")];
        let next = if flat.exists() { flat } else { deep };
        load(&next, &folder.join(&name), inner, scopes);
    }
    scopes.insert(module, scope);
}

fn gather(item: &Item, scope: &mut Scope) {
    match item {
        Item::Fn(f) if is_public(&f.vis) && !is_left_out(&f.attrs) => {
            scope.functions.insert(f.sig.ident.to_string(), documents_panics(&f.attrs));
        }
        Item::Struct(s) => of_type(is_public(&s.vis) && !is_hidden(&s.attrs), &s.ident, scope),
        Item::Enum(e) => of_type(is_public(&e.vis) && !is_hidden(&e.attrs), &e.ident, scope),
        Item::Trait(t) if is_public(&t.vis) && !is_hidden(&t.attrs) => {
            let methods = t.items.iter().filter_map(|item| match item {
                TraitItem::Fn(f) if !is_hidden(&f.attrs) => Some((f.sig.ident.to_string(), documents_panics(&f.attrs))),
                _ => None,
            });
            scope.types.entry(t.ident.to_string()).or_default().extend(methods);
        }
        Item::Impl(block) if !is_left_out(&block.attrs) => of_impl(block, scope),
        Item::Use(u) if is_public(&u.vis) => {
            let all = if is_hidden(&u.attrs) { &mut scope.hidden } else { &mut scope.exports };
            exports(&u.tree, &mut Vec::new(), all);
        }
        Item::Macro(m) => of_macro(m, scope),
        _ => {}
    }
}

fn of_type(is_public: bool, name: &syn::Ident, scope: &mut Scope) {
    if is_public {
        scope.types.entry(name.to_string()).or_default();
    } else {
        scope.private.insert(name.to_string());
    }
}

/// Collects the public methods of a type, and its conversions by `FromStr`, `TryFrom` and `From`.
fn of_impl(block: &ItemImpl, scope: &mut Scope) {
    let Type::Path(path) = &*block.self_ty else { return };
    let Some(name) = path.path.segments.last().map(|segment| segment.ident.to_string()) else { return };
    let of_trait = block.trait_.as_ref().and_then(|(_, path, _)| path.segments.last());
    let wanted = of_trait.is_none_or(|t| ["FromStr", "TryFrom", "From"].contains(&&*t.ident.to_string()));
    for item in &block.items {
        let ImplItem::Fn(f) = item else { continue };
        if wanted && (of_trait.is_some() || is_public(&f.vis)) && !is_left_out(&f.attrs) {
            scope.methods.push((name.clone(), f.sig.ident.to_string(), documents_panics(&f.attrs)));
        }
    }
}

/// Collects the methods that macros define: those of `named!` for enums with names, and those of the macros listed here.
fn of_macro(item: &syn::ItemMacro, scope: &mut Scope) {
    let tokens = item.mac.tokens.to_string();
    let words: Vec<&str> =
        tokens.split(|c: char| !(c.is_alphanumeric() || "_$".contains(c))).filter(|w| !w.is_empty()).collect();
    let is_table = item.mac.path.is_ident("named");
    if !(is_table || item.mac.path.is_ident("macro_rules")) {
        return;
    }
    let mut last = None;
    for at in 0..words.len() {
        match (&words[at..], last) {
            (["pub", "enum" | "struct", name, ..], _) if !name.starts_with('$') => {
                last = Some(*name);
                let methods = scope.types.entry((*name).to_owned()).or_default();
                methods.extend(["name", "named"].iter().filter(|_| is_table).map(|name| ((*name).to_owned(), false)));
            }
            (["enum" | "struct", name, ..], _) => drop(scope.private.insert((*name).to_owned())),
            (["pub", "fn", name, ..] | ["pub", "const", "fn", name, ..], Some(of)) if !is_table => {
                scope.methods.push((of.to_owned(), (*name).to_owned(), false));
            }
            _ => {}
        }
    }
}

fn exports(tree: &UseTree, path: &mut Vec<String>, all: &mut Vec<(String, Vec<String>)>) {
    match tree {
        UseTree::Path(next) => {
            path.push(next.ident.to_string());
            exports(&next.tree, path, all);
            path.pop();
        }
        UseTree::Name(name) if name.ident == "self" => {
            all.push((path.last().cloned().unwrap_or_default(), path.clone()));
        }
        UseTree::Name(name) => {
            all.push((name.ident.to_string(), [&path[..], &[name.ident.to_string()]].concat()));
        }
        UseTree::Rename(name) => {
            all.push((name.rename.to_string(), [&path[..], &[name.ident.to_string()]].concat()));
        }
        UseTree::Glob(_) => all.push(("*".to_owned(), path.clone())),
        UseTree::Group(group) => group.items.iter().for_each(|tree| exports(tree, path, all)),
    }
}

/// Assigns methods to their types: the one of the same module, or else the nearest of that name.
fn attach_methods(scopes: &mut BTreeMap<Module, Scope>) {
    let methods = |(module, scope): (&Module, &Scope)| -> Vec<_> {
        scope.methods.iter().map(|of| (module.clone(), of.clone())).collect()
    };
    let all: Vec<(Module, (String, String, bool))> = scopes.iter().flat_map(methods).collect();
    for (module, (ty, method, panics)) in all {
        let common = |m: &Module| m.iter().zip(&module).take_while(|(a, b)| a == b).count();
        let near = |m: &Module| (*m == module, common(m), std::cmp::Reverse(m.len()));
        let homes = scopes.iter().filter(|(_, scope)| scope.types.contains_key(&ty) || scope.private.contains(&ty));
        let home = homes.map(|(m, _)| m).max_by_key(|m| near(m)).cloned();
        let home = home.unwrap_or_else(|| panic!("{ty}, which has {method}, is defined nowhere"));
        if let Some(methods) = scopes.get_mut(&home).and_then(|scope| scope.types.get_mut(&ty)) {
            methods.insert(method, panics);
        }
    }
}

/// Resolves a path relative to a module to the module and name of its definition.
fn resolve(scopes: &BTreeMap<Module, Scope>, from: &[String], path: &[String]) -> Option<Module> {
    let absolute = match path.first()?.as_str() {
        "crate" => [&from[..1], &path[1..]].concat(),
        "self" => [from, &path[1..]].concat(),
        "super" => return resolve(scopes, &from[..from.len() - 1], &path[1..]),
        first if scopes[from].modules.contains_key(first) => [from, path].concat(),
        _ if scopes.contains_key(&path[..1]) => path.to_vec(),
        _ => [from, path].concat(),
    };
    Some(absolute)
}

/// Collects the public functions of a module, by definition; the first path found is kept.
fn reach(scopes: &BTreeMap<Module, Scope>, module: &[String], prefix: &str, found: &mut Found) {
    let scope = &scopes[module];
    let names = scope.functions.keys().chain(scope.types.keys());
    names.for_each(|name| item(scopes, module, name, prefix, name, found));
    for (name, path) in &scope.exports {
        let Some(target) = resolve(scopes, module, path) else { continue };
        let Some((last, home)) = target.split_last() else { continue };
        // A private module may have the name of a function beside it.
        let is_public = scopes.get(home).is_some_and(|scope| scope.modules.get(last) == Some(&true));
        if name == "*" && scopes.contains_key(&target) {
            reach(scopes, &target, prefix, found);
        } else if scopes.contains_key(&target) && is_public {
            reach(scopes, &target, &format!("{prefix}{name}::"), found);
        }
        item(scopes, home, last, prefix, name, found);
    }
    for (name, _) in scope.modules.iter().filter(|(_, public)| **public) {
        let inner = [module, std::slice::from_ref(name)].concat();
        reach(scopes, &inner, &format!("{prefix}{name}::"), found);
    }
}

/// Collects one name of a module: a function, a type with its methods, or a re-export.
#[expect(clippy::too_many_arguments, reason = "what a walk carries with it")]
fn item(scopes: &BTreeMap<Module, Scope>, home: &[String], name: &str, prefix: &str, shown: &str, found: &mut Found) {
    let Some(scope) = scopes.get(home) else { return };
    let id = |more: &[&str]| -> Module { home.iter().cloned().chain(more.iter().map(|s| (*s).to_owned())).collect() };
    if let Some(panics) = scope.functions.get(name) {
        found.entry(id(&[name])).or_insert_with(|| (format!("{prefix}{shown}"), *panics));
    }
    for (method, panics) in scope.types.get(name).into_iter().flatten() {
        found.entry(id(&[name, method])).or_insert_with(|| (format!("{prefix}{shown}::{method}"), *panics));
    }
    for (exported, path) in scope.exports.iter().chain(&scope.hidden).filter(|(exported, _)| exported == name) {
        let target = resolve(scopes, home, path).filter(|t| *t != id(&[exported]));
        if let Some((last, home)) = target.as_ref().and_then(|target| target.split_last()) {
            item(scopes, home, last, prefix, shown, found);
        }
    }
}
