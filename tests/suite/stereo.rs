//! Two eyes as XR crates draw them: two cameras on two layers of a texture, with frusta beside the middle, and with poses
//! that change in the render world before views are prepared.

mod late_poses;
mod looks;
mod rig;
mod warning;
mod work;
