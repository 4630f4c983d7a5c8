//! The fields that the reader keeps. All others are skipped, and with them all that names a patient.

/// Group and element of a field.
pub(super) type Tag = u32;

macro_rules! tags {
    ($($name:ident $spelling:literal = $value:literal,)*) => {
        $(pub(super) const $name: Tag = $value;)*

        /// All fields that are kept.
        const KEPT: &[Tag] = &[$($name),*];

        /// The standard's name of a field, for errors.
        pub(super) fn name(tag: Tag) -> &'static str {
            match tag {
                $($name => $spelling,)*
                _ => "a field",
            }
        }
    };
}

tags! {
    MEDIA_STORAGE_SOP_CLASS_UID "MediaStorageSOPClassUID" = 0x0002_0002,
    TRANSFER_SYNTAX_UID "TransferSyntaxUID" = 0x0002_0010,
    DIRECTORY_RECORD_SEQUENCE "DirectoryRecordSequence" = 0x0004_1220,
    REFERENCED_FILE_ID "ReferencedFileID" = 0x0004_1500,
    REFERENCED_SOP_INSTANCE_UID_IN_FILE "ReferencedSOPInstanceUIDInFile" = 0x0004_1511,
    IMAGE_TYPE "ImageType" = 0x0008_0008,
    SOP_CLASS_UID "SOPClassUID" = 0x0008_0016,
    SOP_INSTANCE_UID "SOPInstanceUID" = 0x0008_0018,
    SERIES_DATE "SeriesDate" = 0x0008_0021,
    SERIES_TIME "SeriesTime" = 0x0008_0031,
    ACQUISITION_DATE "AcquisitionDate" = 0x0008_0022,
    ACQUISITION_TIME "AcquisitionTime" = 0x0008_0032,
    MODALITY "Modality" = 0x0008_0060,
    FRAME_TYPE "FrameType" = 0x0008_9007,
    SLICE_THICKNESS "SliceThickness" = 0x0018_0050,
    RADIOPHARMACEUTICAL_START_TIME "RadiopharmaceuticalStartTime" = 0x0018_1072,
    RADIONUCLIDE_TOTAL_DOSE "RadionuclideTotalDose" = 0x0018_1074,
    RADIONUCLIDE_HALF_LIFE "RadionuclideHalfLife" = 0x0018_1075,
    RADIOPHARMACEUTICAL_START_DATE_TIME "RadiopharmaceuticalStartDateTime" = 0x0018_1078,
    ECHO_TIME "EchoTime" = 0x0018_0081,
    ECHO_NUMBERS "EchoNumbers" = 0x0018_0086,
    TRIGGER_TIME "TriggerTime" = 0x0018_1060,
    IMAGER_PIXEL_SPACING "ImagerPixelSpacing" = 0x0018_1164,
    DIFFUSION_GRADIENT_DIRECTION_SEQUENCE "DiffusionGradientDirectionSequence" = 0x0018_9076,
    EFFECTIVE_ECHO_TIME "EffectiveEchoTime" = 0x0018_9082,
    DIFFUSION_BVALUE "DiffusionBValue" = 0x0018_9087,
    DIFFUSION_GRADIENT_ORIENTATION "DiffusionGradientOrientation" = 0x0018_9089,
    MR_ECHO_SEQUENCE "MREchoSequence" = 0x0018_9114,
    MR_DIFFUSION_SEQUENCE "MRDiffusionSequence" = 0x0018_9117,
    CARDIAC_SYNCHRONIZATION_SEQUENCE "CardiacSynchronizationSequence" = 0x0018_9118,
    NOMINAL_CARDIAC_TRIGGER_DELAY_TIME "NominalCardiacTriggerDelayTime" = 0x0020_9153,
    FRAME_ACQUISITION_NUMBER "FrameAcquisitionNumber" = 0x0020_9156,
    NOMINAL_PERCENTAGE_OF_CARDIAC_PHASE "NominalPercentageOfCardiacPhase" = 0x0020_9241,
    PATIENT_WEIGHT "PatientWeight" = 0x0010_1030,
    SERIES_INSTANCE_UID "SeriesInstanceUID" = 0x0020_000e,
    SERIES_NUMBER "SeriesNumber" = 0x0020_0011,
    ACQUISITION_NUMBER "AcquisitionNumber" = 0x0020_0012,
    INSTANCE_NUMBER "InstanceNumber" = 0x0020_0013,
    IMAGE_POSITION_PATIENT "ImagePositionPatient" = 0x0020_0032,
    IMAGE_ORIENTATION_PATIENT "ImageOrientationPatient" = 0x0020_0037,
    FRAME_OF_REFERENCE_UID "FrameOfReferenceUID" = 0x0020_0052,
    TEMPORAL_POSITION_IDENTIFIER "TemporalPositionIdentifier" = 0x0020_0100,
    STACK_ID "StackID" = 0x0020_9056,
    FRAME_CONTENT_SEQUENCE "FrameContentSequence" = 0x0020_9111,
    PLANE_POSITION_SEQUENCE "PlanePositionSequence" = 0x0020_9113,
    PLANE_ORIENTATION_SEQUENCE "PlaneOrientationSequence" = 0x0020_9116,
    TEMPORAL_POSITION_INDEX "TemporalPositionIndex" = 0x0020_9128,
    SAMPLES_PER_PIXEL "SamplesPerPixel" = 0x0028_0002,
    PHOTOMETRIC_INTERPRETATION "PhotometricInterpretation" = 0x0028_0004,
    NUMBER_OF_FRAMES "NumberOfFrames" = 0x0028_0008,
    ROWS "Rows" = 0x0028_0010,
    COLUMNS "Columns" = 0x0028_0011,
    PIXEL_SPACING "PixelSpacing" = 0x0028_0030,
    CORRECTED_IMAGE "CorrectedImage" = 0x0028_0051,
    BITS_ALLOCATED "BitsAllocated" = 0x0028_0100,
    BITS_STORED "BitsStored" = 0x0028_0101,
    HIGH_BIT "HighBit" = 0x0028_0102,
    PIXEL_REPRESENTATION "PixelRepresentation" = 0x0028_0103,
    PIXEL_PADDING_VALUE "PixelPaddingValue" = 0x0028_0120,
    PIXEL_PADDING_RANGE_LIMIT "PixelPaddingRangeLimit" = 0x0028_0121,
    WINDOW_CENTER "WindowCenter" = 0x0028_1050,
    WINDOW_WIDTH "WindowWidth" = 0x0028_1051,
    RESCALE_INTERCEPT "RescaleIntercept" = 0x0028_1052,
    RESCALE_SLOPE "RescaleSlope" = 0x0028_1053,
    RESCALE_TYPE "RescaleType" = 0x0028_1054,
    MODALITY_LUT_SEQUENCE "ModalityLUTSequence" = 0x0028_3000,
    PIXEL_MEASURES_SEQUENCE "PixelMeasuresSequence" = 0x0028_9110,
    FRAME_VOI_LUT_SEQUENCE "FrameVOILUTSequence" = 0x0028_9132,
    PIXEL_VALUE_TRANSFORMATION_SEQUENCE "PixelValueTransformationSequence" = 0x0028_9145,
    MR_IMAGE_FRAME_TYPE_SEQUENCE "MRImageFrameTypeSequence" = 0x0018_9226,
    CT_IMAGE_FRAME_TYPE_SEQUENCE "CTImageFrameTypeSequence" = 0x0018_9329,
    PET_FRAME_TYPE_SEQUENCE "PetFrameTypeSequence" = 0x0018_9751,
    RADIOPHARMACEUTICAL_INFORMATION_SEQUENCE "RadiopharmaceuticalInformationSequence" = 0x0054_0016,
    UNITS "Units" = 0x0054_1001,
    DECAY_CORRECTION "DecayCorrection" = 0x0054_1102,
    SHARED_FUNCTIONAL_GROUPS_SEQUENCE "SharedFunctionalGroupsSequence" = 0x5200_9229,
    PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE "PerFrameFunctionalGroupsSequence" = 0x5200_9230,
    FLOAT_PIXEL_DATA "FloatPixelData" = 0x7fe0_0008,
    DOUBLE_FLOAT_PIXEL_DATA "DoubleFloatPixelData" = 0x7fe0_0009,
    PIXEL_DATA "PixelData" = 0x7fe0_0010,
}

/// Whether a field is kept.
pub(super) fn is_kept(tag: Tag) -> bool {
    KEPT.contains(&tag)
}

/// Whether a kept field is a sequence: files with implicit value representations do not say so.
pub(super) fn is_sequence(tag: Tag) -> bool {
    is_kept(tag) && name(tag).ends_with("Sequence")
}
