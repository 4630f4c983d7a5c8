//! Errors of each setting's occlusion and image after a carver moved. They are taken against very many rays, and
//! against the method's own definition.

use bevy::prelude::*;
use bevy_contextual_ao::{occlusion::MethodSettings, prelude::*, render::VolumeTexture};
use contextual_ao_kit::{chart::rms, fit::Fit};

use super::{
    brightness::image_fit,
    definitions::Definitions,
    methods::{Own, Setting},
    shot::{STEPS, Shot, objects, shot, shots, step_shot},
};
use crate::{directions::max_rays, stage::Stage};

/// Root mean square errors of a setting, of a range from 0 to 1.
#[derive(Clone, Default)]
pub struct Errors {
    pub voxels: Option<Fit>,
    pub image: Option<Fit>,
    pub own_definition: String,
    pub own_voxels: Option<f64>,
    pub own_image: Option<f64>,
}

/// Finds the errors of settings in one scene.
pub struct Accuracy {
    /// Shots of very many rays, with light from all around: one per step of the carver, the last step first.
    truths: Vec<Shot>,
    /// Shot of very many rays with light from above, and that light.
    sky: Option<(Sky, Shot)>,
    /// Shots of very many rays with the view samples of [`Quality::Reference`], as `truths`.
    finely_drawn: Option<Vec<Shot>>,
    true_rays: OcclusionRays,
    definitions: Definitions,
    /// Pixels that show the object, as `truths`.
    objects: Vec<Vec<bool>>,
    /// Light through the whole volume, once it is known.
    whole_volume: Option<Vec<f64>>,
    /// Images of methods with their best settings.
    better: Vec<(AmbientOcclusion, Shot)>,
    /// Errors found before: dense and contextual occlusion are the same.
    known: Vec<(AmbientOcclusion, Errors)>,
}

impl Accuracy {
    /// Casts very many rays. The intensities are those that the carver leaves at its start.
    pub fn new(stage: &mut Stage, intensities: Vec<u16>) -> Result<Self, String> {
        let true_rays = max_rays(stage);
        let rays = OcclusionRays { pattern: RayPattern::Fibonacci(true_rays), ..stage.rays() };
        let occlusion = AmbientOcclusion::by(rays);
        let true_step_mm = rays.step_length_mm(&stage.scene.geometry);
        // The first frame computes everything: it takes many times as long as all other frames.
        let objects = objects(stage)?;
        stage.carve(STEPS - 1);
        let mut truths = vec![shot(stage, &occlusion)?];
        for step in (0..STEPS - 1).rev() {
            truths.insert(0, step_shot(stage, step));
        }
        let opacities = stage.headless.voxels(stage.scene.volume, VolumeTexture::Opacities);
        // Of a voxel, not of a step.
        let voxel_mm = stage.scene.geometry.spacing_mm.min_element();
        let steps = voxel_mm / true_step_mm;
        let opacities = opacities.into_iter().map(|byte| of_voxel(byte, steps)).collect();
        let known = (0..).zip(&truths[0].occlusion).filter_map(|(index, value)| value.map(|_| index));
        let definitions = Definitions::new(opacities, intensities, stage.scene.geometry, known.collect());
        Ok(Self {
            truths,
            sky: None,
            finely_drawn: None,
            true_rays: rays,
            definitions,
            objects,
            whole_volume: None,
            better: Vec::new(),
            known: Vec::new(),
        })
    }

    /// Image of very many rays, RGBA, with the carver at its start.
    pub fn true_image(&self) -> &[u8] {
        &self.truths[0].image
    }

    /// Errors of a setting.
    pub fn of(&mut self, stage: &mut Stage, setting: &Setting) -> Result<Errors, String> {
        if setting.is_solid() {
            return Ok(Errors::default());
        }
        if let Some(quality) = setting.view_samples {
            return self.of_preset(stage, &setting.occlusion, quality);
        }
        if let Some((_, errors)) = self.known.iter().find(|(occlusion, _)| *occlusion == setting.occlusion) {
            return Ok(errors.clone());
        }
        let found = shots(stage, &setting.occlusion, setting.frames_of_motion())?;
        let mut errors = Errors::default();
        if setting.occlusion.sky == Sky::default() {
            errors.voxels = voxels_fit(&found, &self.truths);
            errors.image = self.image_fit(&found, &self.truths);
        } else {
            self.find_under_sky(stage, setting.occlusion.sky)?;
            let truth = self.sky.as_ref().map(|(_, shot)| shot);
            errors.voxels = voxels_fit(&found[..1], truth);
            errors.image = self.image_fit(&found[..1], truth);
        }
        errors.voxels = errors.voxels.filter(|_| setting.has_voxels());
        self.add_own(stage, setting, &found, &mut errors)?;
        self.known.push((setting.occlusion.clone(), errors.clone()));
        Ok(errors)
    }

    /// Errors of a preset, whose view samples count as well.
    fn of_preset(
        &mut self,
        stage: &mut Stage,
        occlusion: &AmbientOcclusion,
        quality: Quality,
    ) -> Result<Errors, String> {
        let truths = match self.finely_drawn.take() {
            Some(truths) => truths,
            None => {
                stage.set_view_samples(Some(Quality::Reference));
                shots(stage, &AmbientOcclusion::by(self.true_rays), 0)?
            }
        };
        stage.set_view_samples(Some(quality));
        let found = shots(stage, occlusion, 0)?;
        stage.set_view_samples(None);
        let (voxels, image) = (voxels_fit(&found, &truths), self.image_fit(&found, &truths));
        self.finely_drawn = Some(truths);
        Ok(Errors { voxels, image, ..default() })
    }

    /// Casts very many rays with another light.
    fn find_under_sky(&mut self, stage: &mut Stage, sky: Sky) -> Result<(), String> {
        if self.sky.as_ref().is_none_or(|(known, _)| *known != sky) {
            let occlusion = AmbientOcclusion { sky, ..AmbientOcclusion::by(self.true_rays) };
            stage.carve(0);
            self.sky = Some((sky, shot(stage, &occlusion)?));
        }
        Ok(())
    }

    /// Errors of pictures, RGBA, of the frames after steps of the carver.
    pub fn fit_of_pictures(&self, pictures: &[Vec<u8>]) -> Option<Fit> {
        self.fit(pictures.iter(), self.truths.iter().map(|truth| &truth.image))
    }

    fn image_fit<'a>(&self, found: &[Shot], truth: impl IntoIterator<Item = &'a Shot>) -> Option<Fit> {
        self.fit(found.iter().map(|shot| &shot.image), truth.into_iter().map(|shot| &shot.image))
    }

    /// Errors over the colours of the object's pixels of all frames.
    fn fit<'a>(
        &self,
        found: impl Iterator<Item = &'a Vec<u8>>,
        truth: impl Iterator<Item = &'a Vec<u8>>,
    ) -> Option<Fit> {
        let frames = found.zip(truth).zip(&self.objects);
        image_fit(frames.flat_map(|((found, truth), object)| {
            let bytes = found.iter().zip(truth).enumerate();
            let of_object = bytes.filter(|(byte, _)| byte % 4 != 3 && object[byte / 4]);
            of_object.map(|(_, (&found, &truth))| [found, truth])
        }))
    }

    fn add_own(
        &mut self,
        stage: &mut Stage,
        setting: &Setting,
        found: &[Shot],
        errors: &mut Errors,
    ) -> Result<(), String> {
        match &setting.own {
            Own::Rays => {}
            Own::AllRays => {
                if let Some(&rays) = setting.occlusion.method.rays() {
                    let all = shots(stage, &AmbientOcclusion::by(rays), 0)?;
                    errors.own_definition = format!("{} in the same frame", rays.pattern);
                    errors.own_voxels = voxels_fit(found, &all).map(|fit| fit.rms);
                    errors.own_image = self.image_fit(found, &all).map(|fit| fit.rms);
                }
            }
            Own::NotDenser => {
                if let OcclusionMethod::Filtering(filtering) = setting.occlusion.method {
                    errors.own_definition = "share of voxels not denser".to_owned();
                    errors.own_voxels =
                        self.defined_error(&found[0], &self.definitions.not_denser(filtering));
                }
            }
            Own::WholeVolume => {
                if let OcclusionMethod::Sweeping(sweeping) = setting.occlusion.method {
                    errors.own_definition = format!("light through all; gamma {}", sweeping.gamma);
                    let light = self.whole_volume.take().unwrap_or_else(|| self.definitions.whole_volume());
                    let power = 1.0 / f64::from(sweeping.gamma);
                    let defined: Vec<f64> = light.iter().map(|light| light.powf(power)).collect();
                    self.whole_volume = Some(light);
                    errors.own_voxels = self.defined_error(&found[0], &defined);
                }
            }
            Own::Better(method) => {
                let better = AmbientOcclusion { method: method.clone(), ..setting.occlusion.clone() };
                errors.own_definition = "most samples".to_owned();
                let index = self.better_shot(stage, &better)?;
                errors.own_image = self.image_fit(&found[..1], [&self.better[index].1]).map(|fit| fit.rms);
            }
        }
        Ok(())
    }

    /// Number of the shot with the best settings. It may take very long, and several settings have the same best
    /// settings.
    fn better_shot(&mut self, stage: &mut Stage, better: &AmbientOcclusion) -> Result<usize, String> {
        let known = self.better.iter().position(|(occlusion, _)| occlusion == better);
        let index = match known {
            Some(index) => index,
            None => {
                stage.carve(0);
                self.better.push((better.clone(), shot(stage, better)?));
                self.better.len() - 1
            }
        };
        Ok(index)
    }

    /// Error against values of the voxels that were evaluated.
    fn defined_error(&self, found: &Shot, defined: &[f64]) -> Option<f64> {
        let pairs = self.definitions.voxels.iter().zip(defined);
        rms(pairs.filter_map(|(&voxel, defined)| Some(f64::from(found.occlusion[voxel]?) - defined))).0
    }
}

/// Errors over the voxels of all frames that the true images read.
fn voxels_fit<'a>(found: &[Shot], truth: impl IntoIterator<Item = &'a Shot>) -> Option<Fit> {
    let pairs =
        found.iter().zip(truth).flat_map(|(found, truth)| found.occlusion.iter().zip(&truth.occlusion));
    let fit = Fit::of(pairs.filter_map(|(found, truth)| Some([f64::from((*found)?), f64::from((*truth)?)])));
    (fit.count > 0).then_some(fit)
}

/// Opacity of a voxel, of so many steps, from that of a step. Both are bytes.
fn of_voxel(opacity: u8, steps: f64) -> u8 {
    let clear = 1.0 - f64::from(opacity) / 255.0;
    (255.0 * (1.0 - clear.powf(steps))).round() as u8
}
