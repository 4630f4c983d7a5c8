//! Rooms import only from earlier rooms, and no files import each other in a circle. All `use` lines and WGSL imports
//! of the sources are read.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{Item, UseTree, Visibility};

use crate::headless::project_folder;

/// The rooms; each imports only from earlier ones. A folder is a room, and so is a file beside folders. Methods do
/// not import each other.
const ROOMS: &[&[&str]] = &[
    &["volume"],
    &["clip"],
    &["occlusion"],
    &["bundle"],
    &["picking"],
    &["hands"],
    &["diagnostics"],
    &["render::gpu"],
    &["render::extract"],
    &["render::windows"],
    &["render::carvers"],
    &["render::volumes"],
    &["render::clipping"],
    &["render::views"],
    &["render::methods"],
    &[
        "render::methods::rays",
        "render::methods::sweeping",
        "render::methods::filtering",
        "render::methods::summed_area",
        "render::methods::screen_space",
        "render::methods::directional",
    ],
    &["render::plan"],
    &["render::encode"],
    &["render"],
    &["drawing"],
    &["gizmos"],
    &["plugin"],
    &[""],
];

/// A file, by its module's path within the crate: `a::b` is `a/b.rs`, `a/b/mod.rs` or `a/b.wgsl`.
type Module = String;

/// Files that each file imports from.
type Imports = BTreeMap<Module, BTreeSet<Module>>;

/// The place of a module's room in [`ROOMS`], and the room.
fn room_of(module: &str) -> (usize, &'static str) {
    let holds =
        |room: &str| module == room || module.strip_prefix(room).is_some_and(|rest| rest.starts_with("::"));
    let rooms =
        ROOMS.iter().enumerate().flat_map(|(rank, rooms)| rooms.iter().map(move |room| (rank, *room)));
    let found =
        rooms.filter(|(_, room)| room.is_empty() && module.is_empty() || !room.is_empty() && holds(room));
    found.max_by_key(|(_, room)| room.len()).unwrap_or_else(|| panic!("`{module}` is in no room"))
}

/// Faults of the imports.
fn faults(imports: &Imports) -> Vec<String> {
    let mut faults = Vec::new();
    for (from, to) in imports.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to))) {
        let (own, other) = (room_of(from), room_of(to));
        if own.1 != other.1 && own.0 <= other.0 {
            faults.push(format!("`{from}` imports `{to}`, which comes later"));
        }
    }
    let mut done = BTreeSet::new();
    for module in imports.keys() {
        find_circle(module, imports, &mut Vec::new(), &mut done, &mut faults);
    }
    faults
}

fn find_circle<'a>(
    module: &'a Module,
    imports: &'a Imports,
    path: &mut Vec<&'a Module>,
    done: &mut BTreeSet<&'a Module>,
    faults: &mut Vec<String>,
) {
    if let Some(begin) = path.iter().position(|before| *before == module) {
        faults.push(format!("a circle: {:?}", &path[begin..]));
    } else if !done.contains(module) {
        path.push(module);
        for next in imports.get(module).into_iter().flatten() {
            find_circle(next, imports, path, done, faults);
        }
        path.pop();
        done.insert(module);
    }
}

/// All files with an ending under `src`, with their modules.
fn files(ending: &str) -> Vec<(Module, PathBuf)> {
    let root = project_folder().join("src");
    let (mut folders, mut found) = (vec![root.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of sources") {
            let path = entry.expect("a source").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == ending) {
                found.push((module_of(&path, &root), path));
            }
        }
    }
    assert!(found.len() > 30, "there are {} sources", found.len());
    found
}

fn module_of(path: &Path, root: &Path) -> Module {
    let path = path.strip_prefix(root).expect("a file in it").with_extension("");
    let mut parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    if parts.last().is_some_and(|name| name == "mod" || name == "lib") {
        parts.pop();
    }
    parts.join("::")
}

/// A `use` line of a file, outside of its tests: its path, and whether others can import through it.
struct Use {
    is_public: bool,
    path: Vec<String>,
}

fn uses(path: &Path) -> Vec<Use> {
    let text = fs::read_to_string(path).expect("a text");
    let file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut found = Vec::new();
    for item in &file.items {
        if let Item::Use(item) = item {
            let is_public = !matches!(item.vis, Visibility::Inherited);
            let mut paths = Vec::new();
            flatten(&item.tree, &mut Vec::new(), &mut paths);
            found.extend(paths.into_iter().map(|path| Use { is_public, path }));
        }
    }
    found
}

fn flatten(tree: &UseTree, before: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    match tree {
        UseTree::Path(path) => {
            before.push(path.ident.to_string());
            flatten(&path.tree, before, found);
            before.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|item| flatten(item, before, found)),
        UseTree::Name(name) => found.push([before.as_slice(), &[name.ident.to_string()]].concat()),
        UseTree::Rename(name) => found.push([before.as_slice(), &[name.ident.to_string()]].concat()),
        UseTree::Glob(_) => found.push(before.clone()),
    }
}

/// The file that a path leads to, and the rest of the path; `None` for other crates.
fn target(from: &str, path: &[String], modules: &BTreeSet<Module>) -> Option<(Module, Vec<String>)> {
    let own: Vec<String> =
        if from.is_empty() { vec![] } else { from.split("::").map(String::from).collect() };
    let supers = path.iter().take_while(|part| *part == "super").count();
    let full = match path.first().map(String::as_str) {
        Some("crate") => path[1..].to_vec(),
        Some("self") => [own, path[1..].to_vec()].concat(),
        Some("super") => [own[..own.len() - supers].to_vec(), path[supers..].to_vec()].concat(),
        Some(first) => {
            let child = [own.clone(), vec![first.to_string()]].concat();
            if !modules.contains(&child.join("::")) {
                return None;
            }
            [own, path.to_vec()].concat()
        }
        None => return None,
    };
    let depth = (0..=full.len()).rev().find(|&depth| modules.contains(&full[..depth].join("::")))?;
    Some((full[..depth].join("::"), full[depth..].to_vec()))
}

fn rust_imports() -> Imports {
    let files = files("rs");
    let modules: BTreeSet<_> = files.iter().map(|(module, _)| module.clone()).collect();
    let uses: Vec<_> = files.iter().map(|(module, path)| (module, uses(path))).collect();
    // Origin of each item that a file only hands on.
    let mut handed_on = BTreeMap::new();
    for (module, uses) in &uses {
        for Use { path, .. } in uses.iter().filter(|line| line.is_public) {
            if let (Some((from, _)), Some(name)) = (target(module, path, &modules), path.last()) {
                handed_on.insert(((*module).clone(), name.clone()), from);
            }
        }
    }
    let mut imports = Imports::new();
    for (module, uses) in uses.iter().filter(|(module, _)| !module.ends_with("agreement")) {
        for line in uses {
            let Some((mut to, rest)) = target(module, &line.path, &modules) else {
                continue;
            };
            while let Some(from) = rest.first().and_then(|name| handed_on.get(&(to.clone(), name.clone()))) {
                to = from.clone();
            }
            // A folder's `mod.rs` wires up the files of the folder.
            let is_inside = module.is_empty() || to.starts_with(&format!("{module}::"));
            if to != **module && !is_inside {
                imports.entry((*module).clone()).or_default().insert(to);
            }
        }
    }
    imports
}

fn shader_imports() -> Imports {
    let texts: Vec<_> = files("wgsl")
        .into_iter()
        .map(|(module, path)| (module, fs::read_to_string(path).expect("a text")))
        .collect();
    let name_of = |text: &str| {
        let (_, rest) = text.split_once("#define_import_path bevy_contextual_ao::")?;
        rest.lines().next().map(|name| name.trim().to_string())
    };
    let libraries: BTreeMap<_, _> =
        texts.iter().filter_map(|(module, text)| Some((name_of(text)?, module.clone()))).collect();
    let mut imports = Imports::new();
    for (module, text) in &texts {
        for import in text.split("#import bevy_contextual_ao::").skip(1) {
            // `a::{b, c}`, or `{a::{b, c}, d::e}` over several lines.
            let end = if import.starts_with('{') { import.find("\n}") } else { import.find('\n') };
            let names = import[..end.unwrap_or(import.len())].split(['{', '}', ',', ' ', '\n']);
            let names = names.filter_map(|name| name.split("::").next());
            let found = names.filter_map(|name| libraries.get(name)).filter(|other| *other != module);
            imports.entry(module.clone()).or_default().extend(found.cloned());
        }
    }
    imports
}

#[test]
fn rooms_import_only_from_those_before_them() {
    let imports = rust_imports();
    // Imports are found, including those through a folder's `mod.rs`.
    assert!(imports["render::extract"].contains("render::gpu::frame"));
    assert!(imports["render::extract"].contains("occlusion::settings"));
    assert_eq!(faults(&imports), Vec::<String>::new());
}

#[test]
fn shaders_import_only_from_rooms_before_theirs() {
    let imports = shader_imports();
    assert!(imports["drawing::ambient_light"].contains("render::methods::sweeping::octants"));
    assert!(imports["render::clipping::clip"].contains("render::volumes::clip_pass"));
    assert_eq!(faults(&imports), Vec::<String>::new());
}

#[test]
fn faults_are_found() {
    let imports = |pairs: &[(&str, &str)]| {
        let mut imports = Imports::new();
        for (from, to) in pairs {
            imports.entry((*from).into()).or_default().insert((*to).into());
        }
        imports
    };
    assert!(faults(&imports(&[("render::plan", "render::methods::registry")])).is_empty());
    let other_way = [("render::methods::registry", "render::plan")];
    let neighbours = [("render::methods::rays::cast", "render::methods::directional::slices")];
    let circle = [("volume::fit", "volume::events"), ("volume::events", "volume::fit")];
    for wrong in [&other_way[..], &neighbours, &circle] {
        assert_eq!(faults(&imports(wrong)).len(), 1, "{wrong:?}");
    }
}
