//! Sample types of files from other programs, and the conversion of their bytes to numbers.

/// The sample type of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SampleType {
    /// False or true, one byte.
    Bool,
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 64 bits.
    U64,
    /// Signed, 64 bits.
    I64,
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits.
    F64,
}

impl SampleType {
    /// The value of white if the type defines it: 1, 255, 65,535; `None` for ids, signed numbers and floating point.
    ///
    /// ```
    /// # use stereology_grid::SampleType;
    /// assert_eq!(SampleType::U16.white(), Some(65_535.0));
    /// assert_eq!(SampleType::F32.white(), None);
    /// ```
    #[must_use]
    pub fn white(self) -> Option<f32> {
        match self {
            Self::Bool => Some(1.0),
            Self::U8 => Some(255.0),
            Self::U16 => Some(65_535.0),
            _ => None,
        }
    }

    /// The type of a NumPy descriptor, and whether it is big-endian.
    pub(crate) fn of_npy(descr: &str) -> Option<(Self, bool)> {
        let (order, kind) = descr.split_at_checked(1)?;
        let kind = match kind {
            "b1" => Self::Bool,
            "u1" => Self::U8,
            "i1" => Self::I8,
            "u2" => Self::U16,
            "i2" => Self::I16,
            "u4" => Self::U32,
            "i4" => Self::I32,
            "u8" => Self::U64,
            "i8" => Self::I64,
            "f4" => Self::F32,
            "f8" => Self::F64,
            _ => return None,
        };
        match order {
            "<" | "|" | "=" => Some((kind, false)),
            ">" => Some((kind, true)),
            _ => None,
        }
    }

    /// The type of an NRRD type name.
    pub(crate) fn of_nrrd(name: &str) -> Option<Self> {
        Some(match name {
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Self::U8,
            "signed char" | "int8" | "int8_t" => Self::I8,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Self::U16,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Self::I16,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Self::U32,
            "int" | "signed int" | "int32" | "int32_t" => Self::I32,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Self::U64,
            "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => Self::I64,
            "float" => Self::F32,
            "double" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes per sample.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The samples as the nearest single-precision numbers; a remainder shorter than a sample is ignored.
    #[allow(clippy::cast_possible_truncation, reason = "the nearest f32 is the result")]
    pub(crate) fn decode(self, bytes: &[u8], big_endian: bool) -> Vec<f32> {
        macro_rules! each {
            ($type:ty, $n:literal) => {
                bytes
                    .chunks_exact($n)
                    .map(|chunk| {
                        let mut sample = [0; $n];
                        sample.copy_from_slice(chunk);
                        (if big_endian {
                            <$type>::from_be_bytes(sample)
                        } else {
                            <$type>::from_le_bytes(sample)
                        }) as f32
                    })
                    .collect()
            };
        }
        match self {
            Self::Bool => bytes.iter().map(|&b| f32::from(u8::from(b != 0))).collect(),
            Self::U8 => bytes.iter().map(|&b| f32::from(b)).collect(),
            Self::I8 => each!(i8, 1),
            Self::U16 => each!(u16, 2),
            Self::I16 => each!(i16, 2),
            Self::U32 => each!(u32, 4),
            Self::I32 => each!(i32, 4),
            Self::U64 => each!(u64, 8),
            Self::I64 => each!(i64, 8),
            Self::F32 => each!(f32, 4),
            Self::F64 => each!(f64, 8),
        }
    }
}
