//! Skull and neck spine.
//!
//! All functions take a position mirrored to x >= 0: the bones are symmetric.

use super::jaw::{dental_arch, mandible};
use super::sdf::{
    at, capsule, ellipse, ellipsoid, noise, ramp, smooth_cut, smooth_intersection, smooth_union, sphere, tube,
};
use bevy::math::{Vec2, Vec3};

/// Distance to the part of the brain case that holds the cerebrum.
pub(super) fn upper_cavity(q: Vec3) -> f32 {
    let vault = ellipsoid(q, at(0.0, -12.0, 44.0), at(60.0, 76.0, 60.0));
    let vault = smooth_intersection(vault, 27.0 - q.z, 14.0);
    let temporal = ellipsoid(q, at(34.0, 3.0, 17.0), at(23.0, 31.0, 24.0));
    smooth_union(vault, temporal, 8.0)
}

/// Distance to the part of the brain case that holds the cerebellum.
pub(super) fn lower_cavity(q: Vec3) -> f32 {
    ellipsoid(q, at(0.0, -50.0, 7.0), at(46.0, 34.0, 29.0))
}

/// Distance to the inside of the brain case.
pub(super) fn cavity(q: Vec3) -> f32 {
    let d = smooth_union(upper_cavity(q), lower_cavity(q), 8.0);
    let stem = ellipsoid(q, at(0.0, -20.0, 12.0), at(16.0, 16.0, 24.0));
    smooth_union(d, stem, 8.0)
}

/// Distance to the canal of the spinal cord, which starts with the foramen magnum.
pub(super) fn spinal_canal(q: Vec3) -> f32 {
    tube(
        q,
        &[
            (at(0.0, -38.0, -8.0), 14.0),
            (at(0.0, -38.0, -28.0), 13.0),
            (at(0.0, -38.0, -44.0), 8.5),
            (at(0.0, -38.0, -140.0), 8.0),
        ],
    )
}

/// Distance to the bones, taken as solid. The brain case, at distance `cavity`, is hollowed out later.
pub(super) fn bone(q: Vec3, cavity: f32) -> f32 {
    if cavity < 0.0 {
        // Inside the brain case: only the distance to the shell's inner side can matter.
        return cavity - 6.0;
    }
    if q.z > 50.0 {
        return shell(q, cavity);
    }
    let solid = smooth_union(shell(q, cavity), skull_base(q), 4.0);
    let solid = smooth_union(solid, upper_face(q), 6.0);
    let d = smooth_cut(solid, orbit(q), 3.0);
    let d = smooth_cut(d, nasal_cavity(q), 2.0);
    let d = smooth_cut(d, sinuses(q) - 0.5, 1.0);
    let d = d.max(-capsule(q, (at(80.0, -15.0, -7.0), 4.0), (at(46.0, -10.0, -11.0), 3.5)));
    // The brain case stays closed above the eyes and the nose.
    let d = d.min(cavity - 2.4);
    d.min(septum(q)).min(mandible(q)).min(vertebrae(q))
}

/// Brain case: thick at the back, thin at the temples, with sutures.
fn shell(q: Vec3, cavity: f32) -> f32 {
    let occiput = 2.0 * ramp(-50.0, -90.0, q.y);
    let temple = 2.0 * ramp(42.0, 58.0, q.x) * ramp(45.0, 20.0, q.z);
    let thickness = 6.2 + occiput - temple + 0.7 * noise(q / 24.0, 11);
    cavity - thickness + suture(q)
}

/// Depth of the sutures' grooves on the vault.
fn suture(q: Vec3) -> f32 {
    if q.z < 30.0 {
        return 0.0;
    }
    let wiggle = 2.2 * noise(q / 5.0, 21);
    let coronal = (q.y - 22.0 + 0.25 * q.x + wiggle).abs();
    let sagittal = if q.y < 22.0 && q.y > -70.0 { (q.x + wiggle).abs() } else { f32::MAX };
    let lambdoid = (q.y + 70.0 - 0.45 * q.x + 0.4 * (q.z - 60.0) + wiggle).abs();
    let nearest = coronal.min(sagittal).min(lambdoid);
    1.1 * ramp(1.7, 0.3, nearest) * ramp(30.0, 45.0, q.z)
}

/// Sphenoid and petrous bones, mastoids and pterygoid plates.
fn skull_base(q: Vec3) -> f32 {
    let sphenoid = ellipsoid(q, at(0.0, 10.0, 6.0), at(26.0, 26.0, 17.0));
    let petrous = capsule(q, (at(18.0, -12.0, -4.0), 8.0), (at(55.0, -16.0, -9.0), 9.0));
    let mastoid = capsule(q, (at(54.0, -24.0, -12.0), 9.0), (at(52.0, -21.0, -32.0), 6.5));
    let condyle = capsule(q, (at(15.0, -30.0, -24.0), 6.0), (at(14.0, -34.0, -33.0), 5.0));
    let plate = capsule(q, (at(13.0, 16.0, -8.0), 4.0), (at(14.0, 18.0, -38.0), 3.0));
    [petrous, mastoid, condyle, plate].into_iter().fold(sphenoid, |d, part| smooth_union(d, part, 5.0))
}

/// Brow, maxilla, nasal bones and the cheek bones with their arches.
fn upper_face(q: Vec3) -> f32 {
    let maxilla = ellipsoid(q, at(0.0, 40.0, -18.0), at(35.0, 29.0, 23.0));
    let brow = tube(
        q,
        &[
            (at(0.0, 66.0, 28.0), 7.0),
            (at(20.0, 64.5, 29.0), 6.5),
            (at(38.0, 56.0, 28.0), 5.5),
            (at(47.0, 45.0, 18.0), 5.6),
            (at(48.0, 42.0, 2.0), 6.0),
            (at(44.0, 47.0, -10.0), 8.0),
        ],
    );
    let lower_rim = capsule(q, (at(44.0, 47.0, -10.0), 8.0), (at(22.0, 60.0, -9.0), 5.5));
    let nasal_bone =
        tube(q, &[(at(0.0, 63.0, 24.0), 8.0), (at(0.0, 69.0, 13.0), 6.5), (at(0.0, 74.0, 3.0), 5.0)]);
    let frontal_process = capsule(q, (at(9.0, 66.0, 12.0), 4.0), (at(17.0, 63.0, -20.0), 5.0));
    let arch = tube(
        q,
        &[
            (at(46.0, 43.0, -10.0), 6.5),
            (at(57.0, 26.0, -10.0), 4.2),
            (at(62.0, 10.0, -8.0), 3.6),
            (at(59.0, -10.0, -7.0), 4.0),
        ],
    );
    let cheek = capsule(q, (at(20.0, 58.0, -22.0), 7.0), (at(40.0, 48.0, -14.0), 8.0));
    let ethmoid = ellipsoid(q, at(0.0, 46.0, 6.0), at(15.0, 25.0, 20.0));
    let alveolus = dental_arch(q, 5.5, -43.0, -30.0);
    [brow, lower_rim, nasal_bone, frontal_process, arch, cheek, ethmoid, alveolus]
        .into_iter()
        .fold(maxilla, |d, part| smooth_union(d, part, 4.0))
}

/// Distance to the eye socket, a cone that narrows backwards and towards the middle.
pub(super) fn orbit(q: Vec3) -> f32 {
    let cone = capsule(q, (at(30.0, 58.0, 10.0), 15.5), (at(19.0, 26.0, 12.0), 5.0));
    let mouth = capsule(q, (at(29.0, 60.0, 10.0), 15.0), (at(33.0, 80.0, 9.5), 17.0));
    smooth_union(cone, mouth, 4.0)
}

/// Distance to the nasal cavity, which opens forwards in the pear-shaped aperture.
pub(super) fn nasal_cavity(q: Vec3) -> f32 {
    let aperture = smooth_union(
        ellipsoid(q, at(0.0, 70.0, -19.0), at(11.5, 22.0, 10.5)),
        capsule(q, (at(0.0, 82.0, -14.0), 9.0), (at(0.0, 72.0, -3.0), 4.5)),
        8.0,
    );
    let inside = ellipsoid(q, at(0.0, 36.0, -13.0), at(13.0, 36.0, 18.0));
    smooth_union(aperture, inside, 4.0)
}

/// Distance to the air-filled sinuses of cheeks and forehead.
pub(super) fn sinuses(q: Vec3) -> f32 {
    let maxillary = ellipsoid(q, at(25.0, 42.0, -17.0), at(8.5, 14.0, 11.0));
    let frontal = ellipsoid(q, at(8.5, 65.5, 29.5), at(5.5, 3.0, 3.5));
    let sphenoid = ellipsoid(q, at(7.0, 16.0, 8.0), at(5.5, 10.0, 8.0));
    maxillary.min(frontal).min(sphenoid)
}

/// Bony wall between the nostrils.
fn septum(q: Vec3) -> f32 {
    (q.x - 1.5).max(nasal_cavity(q)).max(q.y - 66.0)
}

/// Neck vertebrae: body, arch around the canal and processes.
fn vertebrae(q: Vec3) -> f32 {
    if q.z > 0.0 {
        // The vertebrae are out of reach.
        return 38.0;
    }
    const PITCH: f32 = 17.0;
    let level = q.z + 45.0;
    let z = level - (level / PITCH + 0.5).floor().min(0.0) * PITCH;
    let flat = Vec2::new(q.x, q.y);
    let rounded = |outline: f32, half: f32| smooth_intersection(outline, z.abs() - half, 3.0);
    let body = rounded(ellipse(flat - Vec2::new(0.0, -19.0), Vec2::new(15.0, 11.0)), 6.6);
    let ring = rounded((flat.distance(Vec2::new(0.0, -38.0)) - 11.5).abs() - 3.0, 5.0);
    let local = at(q.x, q.y, z);
    let spine = capsule(local, (at(0.0, -50.0, 0.0), 3.6), (at(0.0, -67.0, -4.0), 3.6));
    let transverse = capsule(local, (at(13.0, -28.0, 0.0), 4.6), (at(27.0, -30.0, -2.0), 3.4));
    let head = sphere(local, at(15.0, -38.0, 0.0), 6.0);
    [ring, spine, transverse, head].into_iter().fold(body, |d, part| smooth_union(d, part, 3.0))
}
