//! Random scans: a grid in any place, of any format, with files of its own.

use bevy::math::{DAffine3, DMat3, DVec3, UVec3};
use bevy_contextual_ao::volume::Volume;
use contextual_ao_kit::random::Random;

use super::written::{Field, Syntax, file, numbers, short, text};

/// A scan. Lengths are mm in DICOM's axes.
#[derive(Clone, Debug)]
pub struct Scan {
    pub size: UVec3,
    pub spacing: [f64; 2],
    pub axes: [DVec3; 2],
    pub origin: DVec3,
    pub step: DVec3,
    pub bits_allocated: u32,
    pub bits_stored: u32,
    pub high_bit: u32,
    pub signed: bool,
    /// Slope and intercept of each slice.
    pub rescale: Vec<[f64; 2]>,
    /// The numbers, x fastest.
    pub values: Vec<i64>,
    pub syntax: Syntax,
    pub modality: &'static str,
    pub photometric: &'static str,
    pub padding: Option<i64>,
    pub echo_ms: f64,
    /// More fields of every file.
    pub more: Vec<Field>,
}

impl Scan {
    pub fn random(random: &mut Random) -> Self {
        let size = UVec3::from_array([7, 6, 6].map(|most| 2 + random.below(most) as u32));
        let rotation = random.rotation(std::f32::consts::PI).as_dquat().normalize();
        let [along, down, normal] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rotation * axis);
        let length = |random: &mut Random| 0.3 + f64::from(random.share()) * 3.0;
        let spacing = [length(random), length(random)];
        let step = length(random);
        // A gantry is tilted by up to about 30 degrees.
        let [tilt, aside] =
            [(); 2].map(|()| if random.flip() { 0.6 * f64::from(random.signed()) } else { 0.0 });
        let bits_allocated = random.pick(&[8, 16, 16]);
        let bits_stored = bits_allocated - random.below(5) as u32;
        let high_bit = bits_stored - 1 + random.below((bits_allocated - bits_stored) as usize + 1) as u32;
        let signed = random.flip();
        let lowest = if signed { -(1i64 << (bits_stored - 1)) } else { 0 };
        let count = size.element_product() as usize;
        let values = (0..count).map(|_| lowest + random.below(1 << bits_stored) as i64).collect();
        let rescale = [1.0 + f64::from(random.share()), f64::from(random.signed()) * 1000.0];
        Self {
            size,
            spacing,
            axes: [along, down],
            origin: random.point().as_dvec3() * 200.0,
            step: step * (normal + tilt * down + aside * along),
            bits_allocated,
            bits_stored,
            high_bit,
            signed,
            rescale: vec![rescale; size.z as usize],
            values,
            syntax: random.pick(&Syntax::ALL),
            modality: random.pick(&["CT", "MR"]),
            photometric: "MONOCHROME2",
            padding: None,
            echo_ms: 5.0,
            more: Vec::new(),
        }
    }

    /// Voxel index to the patient's millimetres, RAS+.
    pub fn grid_to_patient(&self) -> DAffine3 {
        let ras = |v: DVec3| DVec3::new(-v.x, -v.y, v.z);
        let [along, down] = self.axes;
        let matrix =
            DMat3::from_cols(ras(along * self.spacing[0]), ras(down * self.spacing[1]), ras(self.step));
        DAffine3::from_mat3_translation(matrix, ras(self.origin))
    }

    pub fn value(&self, at: UVec3) -> i64 {
        let [x, y, z] = at.to_array().map(|index| index as usize);
        let [width, height, _] = self.size.to_array().map(|size| size as usize);
        self.values[(z * height + y) * width + x]
    }

    pub fn in_units(&self, at: UVec3) -> f64 {
        let [slope, intercept] = self.rescale[at.z as usize];
        slope * self.value(at) as f64 + intercept
    }

    pub fn voxels(&self) -> impl Iterator<Item = UVec3> + use<> {
        let size = self.size;
        (0..size.element_product())
            .map(move |index| UVec3::new(index % size.x, index / size.x % size.y, index / size.x / size.y))
    }

    fn bytes_per_pixel(&self) -> usize {
        self.bits_allocated as usize / 8
    }

    fn pixels(&self, z: u32) -> Vec<u8> {
        let pixels = (self.size.x * self.size.y) as usize;
        let slice = &self.values[z as usize * pixels..][..pixels];
        let low = self.high_bit + 1 - self.bits_stored;
        let mask = (1u64 << self.bits_stored) - 1;
        let word =
            |value: &i64| ((*value as u64 & mask) << low).to_le_bytes()[..self.bytes_per_pixel()].to_vec();
        slice.iter().flat_map(word).collect()
    }

    /// Fields that all of the scan's slices have.
    fn common(&self) -> Vec<Field> {
        let mut fields = vec![
            text(0x0008_0016, "UI", "1.2.840.10008.5.1.4.1.1.2"),
            text(0x0008_0060, "CS", self.modality),
            text(0x0008_0008, "CS", "ORIGINAL\\PRIMARY\\AXIAL"),
            // None of these must ever be kept.
            text(0x0010_0010, "PN", "Secret^Name"),
            text(0x0010_0030, "DA", "19010203"),
            text(0x0020_000e, "UI", "1.2.3"),
            text(0x0020_0011, "IS", "7"),
            text(0x0020_0052, "UI", "1.2.4"),
            short(0x0028_0002, 1),
            text(0x0028_0004, "CS", self.photometric),
            short(0x0028_0010, self.size.y as u16),
            short(0x0028_0011, self.size.x as u16),
            short(0x0028_0100, self.bits_allocated as u16),
            short(0x0028_0101, self.bits_stored as u16),
            short(0x0028_0102, self.high_bit as u16),
            short(0x0028_0103, u16::from(self.signed)),
            // A sequence that is skipped, with a picture of its own.
            Field::Items(0x0088_0200, vec![vec![short(0x0028_0010, 1)], vec![short(0x0028_0011, 1)]]),
        ];
        fields.extend(self.more.iter().cloned());
        if let Some(padding) = self.padding {
            let representation = if self.signed { "SS" } else { "US" };
            fields.push(Field::Value(0x0028_0120, representation, (padding as u16).to_le_bytes().to_vec()));
        }
        fields
    }

    fn place(&self, z: u32) -> [Field; 1] {
        [numbers(0x0020_0032, &(self.origin + self.step * f64::from(z)).to_array())]
    }

    fn orientation(&self) -> [Field; 1] {
        let [along, down] = self.axes.map(|axis| axis.to_array());
        [numbers(0x0020_0037, &[along, down].concat())]
    }

    fn spacing(&self) -> [Field; 2] {
        let [along, down] = self.spacing;
        // A thickness that is no distance.
        [numbers(0x0018_0050, &[99.0]), numbers(0x0028_0030, &[down, along])]
    }

    fn rescale(&self, z: u32) -> [Field; 2] {
        let [slope, intercept] = self.rescale[z as usize];
        [numbers(0x0028_1052, &[intercept]), numbers(0x0028_1053, &[slope])]
    }

    /// The file of a slice; its identifier ends in `number`.
    pub fn slice(&self, z: u32, number: u32) -> Vec<u8> {
        let mut fields = self.common();
        fields.push(text(0x0008_0018, "UI", &format!("1.2.5.{number}")));
        // Numbers that run against the slices.
        fields.push(text(0x0020_0013, "IS", &(1000 - number).to_string()));
        fields.push(numbers(0x0018_0081, &[self.echo_ms]));
        fields.extend(self.place(z));
        fields.extend(self.orientation());
        fields.extend(self.spacing());
        fields.extend(self.rescale(z));
        file(self.syntax, fields, &[self.pixels(z)], self.bytes_per_pixel())
    }

    /// All slices in one enhanced file, in this order.
    pub fn multi_frame(&self, order: &[u32]) -> Vec<u8> {
        let mut fields = self.common();
        fields.push(text(0x0008_0018, "UI", "1.2.6"));
        fields.push(text(0x0028_0008, "IS", &order.len().to_string()));
        let group = |tag, fields: &[Field]| Field::Items(tag, vec![fields.to_vec()]);
        let shared = vec![group(0x0020_9116, &self.orientation()), group(0x0028_9110, &self.spacing())];
        let own = |&z: &u32| vec![group(0x0020_9113, &self.place(z)), group(0x0028_9145, &self.rescale(z))];
        fields.push(Field::Items(0x5200_9229, vec![shared]));
        fields.push(Field::Items(0x5200_9230, order.iter().map(own).collect()));
        let frames: Vec<_> = order.iter().map(|&z| self.pixels(z)).collect();
        file(self.syntax, fields, &frames, self.bytes_per_pixel())
    }

    /// A picture across the slices, a report and a text, which are no slices.
    pub fn others(&self) -> Vec<(String, Vec<u8>)> {
        let mut localizer = self.common();
        localizer.retain(|field| !matches!(field, Field::Value(0x0008_0008, ..)));
        localizer.push(text(0x0008_0008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER"));
        localizer.push(text(0x0008_0018, "UI", "1.2.7"));
        localizer.extend(self.place(0));
        localizer.extend(self.orientation());
        let report =
            vec![text(0x0008_0016, "UI", "1.2.840.10008.5.1.4.1.1.88.11"), text(0x0008_0060, "CS", "SR")];
        vec![
            ("localizer".into(), file(self.syntax, localizer, &[self.pixels(0)], self.bytes_per_pixel())),
            ("report".into(), file(Syntax::Explicit, report, &[], 1)),
            ("notes.txt".into(), b"no DICOM".to_vec()),
        ]
    }

    /// Checks a volume's grid, and its values against those in `units`.
    pub fn check(&self, volume: &Volume, tolerance: f64, units: impl Fn(UVec3) -> f64) {
        assert_eq!(volume.dimensions(), self.size, "{self:?}");
        // The positions' decimals are written out; what remains is the rounding of doubles.
        let (found, expected) = (volume.grid_to_patient(), self.grid_to_patient());
        assert!(found.abs_diff_eq(expected, 1e-10), "{found:?}, not {expected:?}: {self:?}");
        for at in self.voxels() {
            let (found, expected) = (volume.value_at(at).unwrap(), units(at));
            assert!((found - expected).abs() <= tolerance, "{at}: {found}, not {expected}: {self:?}");
        }
    }
}
