//! Figures of the CAO paper (Titov, Kersten-Oertel, Drouin: Computers & Graphics 2024), tables 2 to 6.

/// A scene of the paper. Arrays of four values are for 6, 14, 26 and 54 rays.
pub struct Published {
    /// The scene's name.
    pub name: &'static str,
    /// Voxels along x, y and z.
    pub resolution: [u32; 3],
    /// Samples per ray.
    pub steps: u32,
    /// Voxels recalculated in a carve frame, percent.
    pub recast_percent: f64,
    /// Frames per second without occlusion.
    pub solid_fps: f64,
    /// Frames per second of LAO.
    pub lao_fps: [f64; 4],
    /// Frames per second of CAO.
    pub cao_fps: [f64; 4],
    /// Frames per second of CAO with a second clipping mesh.
    pub two_meshes_fps: [f64; 4],
    /// Root mean square of a voxel's error against 512 rays, 0 to 1.
    pub voxel_rms: [f64; 4],
    /// Root mean square of a pixel's error against 512 rays, 0 to 255.
    pub pixel_rms: [f64; 4],
}

/// The paper's scenes, in its order.
pub const PUBLISHED: [Published; 3] = [
    Published {
        name: "Engine",
        resolution: [256, 256, 110],
        steps: 20,
        recast_percent: 14.94,
        solid_fps: 272.846,
        lao_fps: [111.549, 67.910, 42.831, 22.543],
        cao_fps: [184.902, 155.245, 126.378, 85.363],
        two_meshes_fps: [158.508, 132.542, 107.000, 71.936],
        voxel_rms: [0.03907, 0.01203, 9.759e-3, 6.937e-3],
        pixel_rms: [11.771, 2.755, 1.936, 1.032],
    },
    Published {
        name: "Beetle",
        resolution: [416, 416, 247],
        steps: 40,
        recast_percent: 20.24,
        solid_fps: 128.288,
        lao_fps: [15.497, 7.509, 4.192, 2.012],
        cao_fps: [42.581, 25.581, 16.063, 8.526],
        two_meshes_fps: [37.690, 23.097, 14.150, 7.487],
        voxel_rms: [0.01746, 8.765e-3, 5.144e-3, 3.438e-3],
        pixel_rms: [4.485, 1.950, 1.072, 0.848],
    },
    Published {
        name: "Skeleton",
        resolution: [512, 512, 512],
        steps: 50,
        recast_percent: 16.13,
        solid_fps: 95.142,
        lao_fps: [4.316, 2.020, 1.107, 0.529],
        cao_fps: [17.514, 9.594, 5.729, 2.825],
        two_meshes_fps: [15.717, 8.800, 5.173, 2.527],
        voxel_rms: [0.02520, 0.01205, 7.910e-3, 5.208e-3],
        pixel_rms: [5.292, 1.603, 1.134, 0.956],
    },
];
