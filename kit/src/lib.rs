//! Code shared by examples, tests and `measure`. It has an app without a window, files and scenes from command-line options,
//! series of DICOM as text and pictures, small scenes, and meshes with a known inside. It also has stability figures, the true pictures of
//! analytic scenes, the data of charts, and reports.

pub mod budget;
pub mod carver;
pub mod chart;
pub mod device;
pub mod dicom;
pub mod digits;
pub mod files;
pub mod fit;
pub mod font;
pub mod framing;
pub mod headless;
pub mod inside;
pub mod mode;
pub mod outlines;
pub mod picture;
pub mod random;
pub mod reach;
pub mod report;
pub mod scene;
pub mod shapes;
pub mod small_scene;
pub mod stability;
