//! Opens volumes and transfer functions, and keeps errors. The current file stays until the new file is there: a file
//! that cannot be read changes nothing.

use bevy::{
    asset::{AssetLoadError, AssetPath, LoadState, UntypedAssetId},
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::VolumeReadSettings};
use contextual_ao_kit::{budget::explain, files::FileOptions};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    content::Content,
    dropping::{CannotOpen, FileKind, OpenDicom, OpenFile},
    shown::{FunctionSource, Opened, Shown},
};

const DEFAULT_VOLUME: &str = "head_phantom.nrrd";
const DEFAULT_TRANSFER_FUNCTION: &str = "head_phantom.tf.ron";

pub struct LoadingPlugin;

impl Plugin for LoadingPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Shown>()
            .init_resource::<Opening>()
            .add_systems(Startup, open_first)
            .add_systems(Update, (show_opened, own_function).chain())
            .add_observer(open_dropped)
            .add_observer(show)
            .add_observer(note_refusal)
            .add_observer(describe)
            .add_observer(note_failure);
    }
}

/// Asks to show a volume that was read, in place of the current one.
#[derive(Event)]
pub struct Show(pub Opened);

/// Files that are being read.
#[derive(Resource, Default)]
pub struct Opening {
    volume: Option<Handle<Volume>>,
    function: Option<Handle<TransferFunction>>,
}

impl Opening {
    /// Whether anything is being read.
    pub fn is_busy(&self) -> bool {
        self.volume.is_some() || self.function.is_some()
    }
}

/// Spawns the volume of the command line.
fn open_first(
    mut commands: Commands,
    options: Res<FileOptions>,
    assets: Res<AssetServer>,
    mut shown: ResMut<Shown>,
) {
    let file = options.file.as_deref();
    let component = options.component;
    let choose = move |settings: &mut VolumeReadSettings| settings.component = component;
    let volume = match file {
        Some(file) if FileKind::of(file) == Ok(FileKind::Dicom) => {
            let (paths, series) = (vec![file.to_owned()], options.series);
            commands.trigger(OpenDicom { paths, series, component });
            Handle::default()
        }
        Some(file) => {
            shown.name = name_of(file);
            assets.load_builder().with_settings(choose).load(outside_assets(file))
        }
        None => {
            shown.name = DEFAULT_VOLUME.into();
            assets.load(DEFAULT_VOLUME)
        }
    };
    shown.opened = Opened { volume: volume.clone(), name: shown.name.clone(), ..default() };
    let mut bundle = VolumeBundle::new(volume);
    if let Some(function) = &options.transfer_function {
        shown.function = FunctionSource::File;
        bundle = bundle.with_transfer_function(assets.load(outside_assets(function)));
    } else if let Some(preset) = options.preset {
        shown.function = FunctionSource::Preset(preset);
    } else if file.is_none() {
        bundle = bundle.with_transfer_function(assets.load(DEFAULT_TRANSFER_FUNCTION));
    }
    // Carvers inside of the volume can be taken, too.
    commands.spawn((bundle, Pickable { should_block_lower: false, is_hoverable: true }));
}

/// Asset path of a file given relative to the working directory.
fn outside_assets(file: &Path) -> AssetPath<'static> {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| PathBuf::from(file));
    AssetPath::from_path_buf(absolute)
}

fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Begins to read a file.
fn open_dropped(
    open: On<OpenFile>,
    assets: Res<AssetServer>,
    mut opening: ResMut<Opening>,
    mut shown: ResMut<Shown>,
) {
    shown.errors.clear();
    let path = outside_assets(&open.path);
    match open.kind {
        FileKind::Volume => opening.volume = Some(assets.load(path)),
        FileKind::TransferFunction => opening.function = Some(assets.load(path)),
        FileKind::Dicom => (),
    }
}

/// Shows a volume that was read. A file that is being read comes too late.
fn show(
    show: On<Show>,
    mut opening: ResMut<Opening>,
    mut shown: ResMut<Shown>,
    mut entities: Query<(&mut Volume3d, &mut VolumeTransferFunction)>,
) -> Result {
    let (mut volume, mut function) = entities.single_mut()?;
    opening.volume = None;
    shown.before = Some(shown.put(show.0.clone(), &mut volume, &mut function));
    Ok(())
}

fn note_refusal(refused: On<CannotOpen>, mut shown: ResMut<Shown>) {
    error!("{}", refused.0);
    shown.errors = vec![refused.0.clone()];
}

/// Shows files once they have been read.
fn show_opened(
    assets: Res<AssetServer>,
    mut opening: ResMut<Opening>,
    mut shown: ResMut<Shown>,
    mut entities: Query<(&mut Volume3d, &mut VolumeTransferFunction)>,
) {
    // Untouched components must not count as changed.
    if !opening.is_busy() {
        return;
    }
    let Ok((mut volume, mut function)) = entities.single_mut() else {
        return;
    };
    if let Some(new) =
        opening.volume.take_if(|new| is_read(&assets, new.id(), VolumeFailure::Volume, &mut shown))
        && new != volume.0
        && assets.is_loaded(&new)
    {
        let name = assets.get_path(new.id()).map(|path| name_of(path.path())).unwrap_or_default();
        let new = Opened { volume: new, name, ..default() };
        shown.before = Some(shown.put(new, &mut volume, &mut function));
    }
    if let Some(new) = opening
        .function
        .take_if(|new| is_read(&assets, new.id(), VolumeFailure::TransferFunction, &mut shown))
        && assets.is_loaded(&new)
    {
        shown.function = FunctionSource::File;
        function.0 = new;
    }
}

/// Whether a file has been read, or could not be read; keeps the reason.
fn is_read(
    assets: &AssetServer,
    id: impl Into<UntypedAssetId>,
    reason: fn(Arc<AssetLoadError>) -> VolumeFailure,
    shown: &mut Shown,
) -> bool {
    match assets.get_load_state(id) {
        Some(LoadState::Loaded) => true,
        Some(LoadState::Failed(error)) => {
            shown.note(explain(&reason(error)));
            true
        }
        _ => false,
    }
}

/// Describes a volume that is shown. The volume before is not needed any more.
fn describe(
    loaded: On<VolumeLoaded>,
    volumes: Res<Assets<Volume>>,
    entities: Query<&Volume3d>,
    mut shown: ResMut<Shown>,
) {
    let Ok(handle) = entities.get(loaded.entity) else {
        return;
    };
    shown.content = volumes.get(&handle.0).map(Content::of);
    shown.name = shown.opened.name.clone();
    shown.before = None;
}

/// Keeps the reason of a failure. A volume that cannot be shown leaves its place to the volume before. A volume
/// without its transfer function gets the automatic function.
fn note_failure(
    failed: On<VolumeFailed>,
    assets: Res<AssetServer>,
    mut entities: Query<(&mut Volume3d, &mut VolumeTransferFunction)>,
    mut shown: ResMut<Shown>,
) {
    shown.note(explain(&failed.reason));
    let Ok((mut volume, mut function)) = entities.get_mut(failed.entity) else {
        return;
    };
    if let Some(LoadState::Failed(_)) = assets.get_load_state(&function.0) {
        function.0 = Handle::default();
        shown.function = FunctionSource::Volume;
    } else if let Some(before) = shown.before.take() {
        shown.put(before, &mut volume, &mut function);
    }
}

/// Replaces transfer functions of a file, or of nobody, by functions that can be edited.
fn own_function(
    assets: Res<AssetServer>,
    volumes: Res<Assets<Volume>>,
    shown: Res<Shown>,
    mut functions: ResMut<Assets<TransferFunction>>,
    mut entities: Query<(&Volume3d, &mut VolumeTransferFunction)>,
) {
    for (volume, mut function) in &mut entities {
        let own = if function.0 == Handle::default() {
            volumes.get(&volume.0).map(|volume| match shown.function {
                FunctionSource::Preset(preset) => preset.transfer_function(volume),
                FunctionSource::Volume | FunctionSource::File => {
                    let first_look = shown.opened.first_look.clone();
                    first_look.unwrap_or_else(|| TransferFunction::for_volume(volume))
                }
            })
        } else if assets.is_managed(function.id()) {
            functions.get(&function.0).cloned()
        } else {
            None
        };
        if let Some(own) = own {
            function.0 = functions.add(own);
        }
    }
}
