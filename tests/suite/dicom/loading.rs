//! DICOM as assets: an archive, a list of names and a DICOMDIR, as an app on the web loads them.

use std::{io::Write, path::Path};

use bevy::{asset::AssetPath, prelude::*};
use bevy_contextual_ao::{
    prelude::*,
    volume::dicom::{DicomReadSettings, read_dicom},
};
use contextual_ao_kit::random::Random;

use super::{
    properties::read,
    scan::Scan,
    written::{Field, Syntax, file, text},
};
use crate::{headless::Headless, scene::IMAGE, small_files::Scratch};

/// A zip archive, with files as they are and deflated in turn.
fn zip(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (index, (name, bytes)) in files.iter().enumerate() {
        let deflated = index % 2 == 1;
        let stored = if deflated {
            let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        } else {
            bytes.clone()
        };
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        let mut common = vec![20, 0, 0, 0, if deflated { 8 } else { 0 }, 0, 0, 0, 0x21, 0];
        common.extend(crc.sum().to_le_bytes());
        common.extend((stored.len() as u32).to_le_bytes());
        common.extend((bytes.len() as u32).to_le_bytes());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        let start = archive.len() as u32;
        archive.extend(b"PK\x03\x04");
        archive.extend(&common);
        archive.extend(name.as_bytes());
        archive.extend(stored);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend(start.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, length, count) = (archive.len() as u32, directory.len() as u32, files.len() as u16);
    archive.extend(directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend(count.to_le_bytes());
    archive.extend(count.to_le_bytes());
    archive.extend(length.to_le_bytes());
    archive.extend(start.to_le_bytes());
    archive.extend([0, 0]);
    archive
}

/// Writes a scan as files, an archive, a list and a DICOMDIR.
fn write(scratch: &Scratch, scan: &Scan) {
    std::fs::create_dir_all(scratch.0.join("IMAGES")).unwrap();
    let mut files: Vec<_> = (0..scan.size.z).map(|z| (format!("IMAGES/I{z}"), scan.slice(z, z))).collect();
    files.extend(scan.others().into_iter().map(|(name, bytes)| (format!("IMAGES/{name}"), bytes)));
    for (name, bytes) in &files {
        scratch.write(name, bytes);
    }
    scratch.write("scan.zip", &zip(&files));
    let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
    scratch.write("scan.dcmlist", format!("# A scan\n{}\n", names.join("\n")).as_bytes());
    // A DICOMDIR spells names in capitals, with folders apart.
    let record = |(name, _): &(String, Vec<u8>)| {
        vec![text(0x0004_1500, "CS", &name.to_uppercase().replace('/', "\\"))]
    };
    let records = Field::Items(0x0004_1220, files.iter().map(record).collect());
    let class = text(0x0002_0002, "UI", "1.2.840.10008.1.3.10");
    scratch.write("DICOMDIR", &file(Syntax::Explicit, vec![class, records], &[], 1));
    scratch.write("frames.dcm", &scan.multi_frame(&[1, 0]));
}

/// Loads a volume, and its first look if the name has an ending: Bevy finds loaders of labels by it.
fn load(app: &mut Headless, path: &Path) -> (Volume, Option<TransferFunction>) {
    let path = AssetPath::from_path_buf(path.to_owned());
    let assets = app.app.world().resource::<AssetServer>().clone();
    let look: Option<Handle<TransferFunction>> = path
        .get_full_extension()
        .is_some()
        .then(|| assets.load(path.clone().with_label("transfer_function")));
    let handle: Handle<Volume> = assets
        .load_builder()
        .with_settings(|settings: &mut DicomReadSettings| settings.halvings = 0)
        .load(path.clone());
    let came = app.frames_until(|headless| {
        let state = assets.load_state(&handle);
        assert!(!state.is_failed(), "{path}: {state:?}");
        let world = headless.app.world();
        let looks = world.resource::<Assets<TransferFunction>>();
        world.resource::<Assets<Volume>>().get(&handle).is_some()
            && look.as_ref().is_none_or(|look| looks.get(look).is_some())
    });
    assert!(came, "{path} does not load");
    let world = app.app.world();
    let looks = world.resource::<Assets<TransferFunction>>();
    let look = look.map(|look| looks.get(&look).expect("it is loaded").clone());
    (world.resource::<Assets<Volume>>().get(&handle).expect("it is loaded").clone(), look)
}

#[test]
fn archives_lists_and_directories_load_as_the_folder_does() {
    let scratch = Scratch::new("dicom_assets");
    let mut random = Random(41);
    let mut scan = Scan::random(&mut random);
    scan.size.z = 2;
    scan.rescale.truncate(2);
    scan.values.truncate(scan.size.element_product() as usize);
    write(&scratch, &scan);
    let listed = read_dicom(&[scratch.0.join("IMAGES")]).unwrap();
    let expected = read(&listed.series[0].volumes[0]);
    scan.check(&expected, 1e-9, |at| scan.in_units(at));
    let mut app = Headless::new(IMAGE, |_| {});
    for name in ["scan.zip", "scan.dcmlist", "DICOMDIR", "frames.dcm"] {
        let path = scratch.0.join(name);
        let (volume, look) = load(&mut app, &path);
        assert_eq!(volume, expected, "{name}");
        assert!(look.is_none_or(|look| look.validate().is_ok()), "{name}");
        let listed = read_dicom(&[&path]);
        if name != "scan.dcmlist" {
            assert_eq!(read(&listed.unwrap().series[0].volumes[0]), expected, "{name}");
        }
    }
}
