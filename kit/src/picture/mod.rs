//! Pictures of analytic scenes in double precision: the truth that the renderer's pictures are judged against.
//!
//! Nothing here uses code of the renderer. What a picture should show is stated once more, from its definition:
//!
//! - [`field`]: solids as signed distances, and the values that a scanner finds in them.
//! - [`truth`]: the volume rendering integral along the ray through a pixel's centre.
//! - [`occlusion`]: equation 2 at the sample point, not at voxels.
//! - [`scenes`]: the scenes, and the same scenes for the renderer.
//!
//! Lengths are in mm from the volume's centre, in volume space.

pub mod color;
pub mod edge;
pub mod field;
pub mod occlusion;
pub mod scenes;
pub mod solid;
pub mod truth;
