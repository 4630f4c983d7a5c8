//! Series of DICOM files in the window: dropped, listed, clicked, refused.

use std::path::Path;

use bevy::{math::UVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, volume::dicom::read_dicom};
use bevy_egui::egui::{
    Context, Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, epaint::ClippedShape, vec2,
};
use contextual_ao_kit::dicom::{Choice, picture};

use super::{
    Window,
    carve::dicom::{
        OpenVolume, Reading, SeriesList,
        panel::{self, Textures},
    },
};
use crate::{dicom::study, needs::shared_volumes, small_files::Scratch};

/// The folder's name holds a patient's, too.
const FOLDER: &str = "Doe^John";

/// The list in a panel of its own.
#[derive(Default)]
struct Panel {
    context: Context,
    textures: Textures,
}

impl Panel {
    /// Shows the list: its texts with their places, and what was clicked.
    fn show(&mut self, window: &Window, events: Vec<Event>) -> (Vec<(String, Rect)>, Option<Choice>) {
        let list = window.list();
        let chosen = window.headless.app.world().resource::<Reading>().chosen(list, window.shown());
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(320.0, 4000.0));
        let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
        let mut clicked = None;
        let output = self.context.run_ui(input, |ui| {
            clicked = clicked.or(panel::show(ui, list, chosen, &mut self.textures));
        });
        (texts(&output.shapes), clicked)
    }

    fn all_text(&mut self, window: &Window) -> String {
        let texts = self.show(window, Vec::new()).0;
        texts.into_iter().map(|(text, _)| text).collect::<Vec<_>>().join("\n")
    }

    /// Clicks the first text with these words, and opens what the panel asks for.
    fn click(&mut self, window: &mut Window, words: &str) {
        let texts = self.show(window, Vec::new()).0;
        let Some((_, place)) = texts.iter().find(|(text, _)| text.contains(words)) else {
            panic!("{words:?} is not in {texts:?}");
        };
        let pos = place.center();
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.show(window, vec![Event::PointerMoved(pos), button(true)]);
        if let (_, Some(choice)) = self.show(window, vec![button(false)]) {
            window.headless.app.world_mut().trigger(OpenVolume(choice));
        }
    }
}

fn texts(shapes: &[ClippedShape]) -> Vec<(String, Rect)> {
    fn collect(shape: &Shape, into: &mut Vec<(String, Rect)>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, into)),
            Shape::Text(text) => into.push((text.galley.text().into(), shape.visual_bounding_rect())),
            _ => (),
        }
    }
    let mut texts = Vec::new();
    shapes.iter().for_each(|shape| collect(&shape.shape, &mut texts));
    texts
}

impl Window {
    fn list(&self) -> &SeriesList {
        self.headless.app.world().resource()
    }

    /// A window on which the folder of a study was dropped, with a list of it.
    fn with_study(name: &str) -> Self {
        let mut window = Self::new(name, None);
        study::write(&window.folder.join(FOLDER));
        window.drop_file(FOLDER);
        window.until(|window| window.list().found.is_some());
        window
    }

    /// Whether the first volume is shown.
    fn is_at_its_start(&mut self) -> bool {
        self.size() == UVec3::splat(8) && self.shown().name == "first.nrrd"
    }

    /// Dimensions of the volume in the scene.
    fn size(&mut self) -> UVec3 {
        let world = self.headless.app.world_mut();
        let mut entities = world.query::<&Volume3d>();
        let volume = entities.single(world).expect("one volume").0.clone();
        world.resource::<Assets<Volume>>().get(&volume).expect("it has been read").dimensions()
    }
}

#[test]
fn a_dropped_folder_lists_its_series_and_a_click_shows_one() {
    let mut window = Window::with_study("series");
    let mut panel = Panel::default();
    let text = panel.all_text(&window);
    for words in [
        "CT series 7",
        "3 slices, 12 x 8 x 3 voxels of 1 x 2 x 3 mm",
        "MR series 7",
        "echo time 5: 4 slices, 6 x 5 x 4 voxels",
        "echo time 9: 4 slices",
        "1 file: a localizer",
        "1 file: not a DICOM file",
        "1 file: no picture (SR)",
        "2 files: pixels of 12 bits, packed, cannot be read",
    ] {
        assert!(text.contains(words), "{words:?} is not in {text}");
    }
    // There are several volumes: none is opened unasked.
    assert!(window.is_at_its_start());
    panel.click(&mut window, "echo time 9");
    window.until(|window| window.shown().name == "MR series 7, echo time 9");
    window.headless.frames(2);
    assert_eq!(window.size(), UVec3::new(6, 5, 4));
    panel.click(&mut window, "CT series 7");
    window.headless.frames(5);
    assert_eq!(window.size(), UVec3::new(6, 5, 4), "the name is no button");
    panel.click(&mut window, "12 x 8 x 3");
    window.until(|window| window.shown().name == "CT series 7");
    window.headless.frames(2);
    let function = window.content().1;
    assert_eq!(window.size(), UVec3::new(12, 8, 3));
    // The first look of the files is what is drawn with.
    let listed = read_dicom(&[window.folder.join(FOLDER)]).unwrap();
    let volume = &listed.series.iter().find(|series| series.modality == "CT").unwrap().volumes[0];
    assert_eq!(function, volume.first_look(&crate::dicom::read(volume)));
}

#[test]
fn no_text_names_the_patient() {
    let mut window = Window::with_study("series_privacy");
    let mut panel = Panel::default();
    let mut seen = panel.all_text(&window);
    panel.click(&mut window, "12 x 8 x 3");
    window.until(|window| window.shown().name == "CT series 7");
    seen += &panel.all_text(&window);
    // A file that is gone makes an error.
    std::fs::remove_dir_all(window.folder.join(FOLDER)).unwrap();
    panel.click(&mut window, "echo time 5");
    window.until(|window| !window.shown().errors.is_empty());
    seen += &window.shown().errors.join("\n");
    // So does a damaged archive.
    std::fs::write(window.folder.join("Doe.zip"), b"PK\x03\x04 and no more").unwrap();
    window.drop_file("Doe.zip");
    window.until(|window| window.shown().errors.concat().contains("archive"));
    let shown = window.shown();
    seen += &[shown.errors.join("\n"), shown.opened.warnings.join("\n"), shown.name.clone()].join("\n");
    for secret in ["Doe", "John", "Secret", "1901", window.folder.to_str().unwrap()] {
        assert!(!seen.contains(secret), "{secret:?} is in {seen}");
    }
}

#[test]
fn a_volume_alone_is_opened_at_once() {
    let mut window = Window::new("series_alone", None);
    let scan = study::scan(5, UVec3::new(7, 6, 3), "MR");
    std::fs::write(window.folder.join("Doe.dcm"), scan.multi_frame(&[2, 0, 1])).unwrap();
    window.drop_file("Doe.dcm");
    window.until(|window| window.shown().name == "MR series 7");
    window.headless.frames(2);
    assert_eq!(window.size(), UVec3::new(7, 6, 3));
    // The list stays, with its volume marked.
    let reading = window.headless.app.world().resource::<Reading>();
    let chosen = reading.chosen(window.list(), window.shown());
    assert_eq!(chosen, Some(Choice { series: 0, volume: 0 }));
}

#[test]
fn what_cannot_be_shown_is_named_and_changes_nothing() {
    let mut window = Window::with_study("series_refused");
    let mut panel = Panel::default();
    // A folder without slices.
    std::fs::create_dir(window.folder.join("empty")).unwrap();
    std::fs::write(window.folder.join("empty/notes.txt"), "no DICOM").unwrap();
    window.drop_file("empty");
    window.until(|window| window.shown().errors == ["no volume: 1 file: not a DICOM file"]);
    assert!(panel.all_text(&window).contains("1 file: not a DICOM file"));
    // A volume beyond the budget has its reason in the list.
    window.headless.app.insert_resource(VolumeBudget { max_bytes: 1000, halves: false });
    window.drop_file(FOLDER);
    window.until(|window| window.list().found.as_ref().is_some_and(|found| found.entries.len() == 2));
    assert!(panel.all_text(&window).contains("max_bytes allows 1 MiB"));
    panel.click(&mut window, "12 x 8 x 3");
    window.headless.frames(5);
    assert!(window.is_at_its_start());
}

#[test]
fn pictures_are_the_middle_slice_in_the_files_window() {
    // Twelve columns of 1 mm and eight rows of 2 mm: the picture is higher than wide.
    let scratch = Scratch::new("series_pictures");
    let mut scan = study::scan(6, UVec3::new(12, 8, 3), "CT");
    // The left half is black in the middle slice, the right half white.
    scan.values = scan.voxels().map(|at| if at.z == 1 && at.x >= 6 { 1200 } else { 900 }).collect();
    let field = |tag, value: f64| crate::dicom::written::numbers(tag, &[value]);
    scan.more = vec![field(0x0028_1050, 0.0), field(0x0028_1051, 100.0)];
    (0..3).for_each(|z| drop(scratch.write(&z.to_string(), &scan.slice(z, z))));
    let listed = read_dicom(&[&scratch.0]).unwrap();
    let made = picture(&listed.series[0].volumes[0], 64).unwrap();
    assert_eq!(made.dimensions(), (48, 64));
    assert_eq!([[2, 30], [45, 30]].map(|[x, y]| made.get_pixel(x, y).0[0]), [0, 255]);
}

#[test]
fn every_real_series_has_a_picture() {
    let Some(folder) = shared_volumes() else { return };
    let listed = read_dicom(&[Path::new(&folder).join("dicom")]).unwrap();
    for series in &listed.series {
        let made = picture(&series.volumes[0], 32).unwrap_or_else(|error| panic!("{series}: {error}"));
        let brightest = made.pixels().map(|pixel| pixel.0[0]).max();
        assert!(made.width().max(made.height()) == 32 && brightest > Some(100), "{series}");
    }
}
