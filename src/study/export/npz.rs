//! Arrays as NPZ, the files of NumPy: `numpy.load` reads them, and so do MATLAB, Julia and R with their packages.
//!
//! An NPZ file is a ZIP archive, here without compression, of one NPY file for each array (format version 1.0).

use crate::error::{Error, Result};
use crate::study::{Column, Table, Values};

/// A named array with values in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    name: String,
    /// Type in NumPy notation: "<f8", "<i8", "<U12".
    kind: String,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Array {
    /// Real numbers.
    pub fn reals(name: impl Into<String>, shape: &[usize], values: &[f64]) -> Self {
        debug_assert_eq!(values.len(), shape.iter().product::<usize>());
        Self {
            name: name.into(),
            kind: "<f8".to_owned(),
            shape: shape.to_vec(),
            bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }

    /// Whole numbers.
    pub fn integers(name: impl Into<String>, values: &[i64]) -> Self {
        Self {
            name: name.into(),
            kind: "<i8".to_owned(),
            shape: vec![values.len()],
            bytes: values.iter().flat_map(|n| n.to_le_bytes()).collect(),
        }
    }

    /// Words, padded to the length of the longest.
    pub fn words<W: AsRef<str>>(name: impl Into<String>, values: &[W]) -> Self {
        let letters = |word: &W| word.as_ref().chars().count();
        let longest = values.iter().map(letters).max().unwrap_or(0).max(1);
        let filled = values.iter().flat_map(|word| {
            let letters = word.as_ref().chars().map(u32::from);
            letters.chain(std::iter::repeat(0)).take(longest)
        });
        Self {
            name: name.into(),
            kind: format!("<U{longest}"),
            shape: vec![values.len()],
            bytes: filled.flat_map(u32::to_le_bytes).collect(),
        }
    }

    /// NPY file of the array.
    fn npy(&self) -> Vec<u8> {
        let shape: String = self.shape.iter().map(|n| format!("{n},")).collect();
        let kind = &self.kind;
        let mut header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        // The values begin at a multiple of 64 bytes; ten bytes precede the header.
        let blanks = 63 - (10 + header.len()) % 64;
        header.extend(std::iter::repeat_n(' ', blanks));
        header.push('\n');
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        // The header has one line, far below 2^16 bytes.
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.as_bytes());
        file.extend(&self.bytes);
        file
    }
}

impl Table {
    /// Columns as arrays: reals with NaN for missing values; integers if none is missing, otherwise reals; words.
    pub fn arrays(&self) -> Vec<Array> {
        let array = |column: &Column| {
            let name = column.name.as_ref();
            match &column.values {
                Values::Reals(list) => Array::reals(name, &[list.len()], list),
                Values::Words(list) => Array::words(name, list),
                Values::Integers(list) => {
                    match list.iter().copied().collect::<Option<Vec<i64>>>() {
                        Some(whole) => Array::integers(name, &whole),
                        None => {
                            let reals = list.iter().map(|n| n.map_or(f64::NAN, |n| n as f64));
                            Array::reals(name, &[list.len()], &reals.collect::<Vec<_>>())
                        }
                    }
                }
            }
        };
        self.columns.iter().map(array).collect()
    }
}

/// NPZ file of the arrays, reproducible to the byte.
///
/// # Errors
/// A file of more than 2^32 bytes, or 2^16 arrays, the limits of the archive format.
///
/// ```
/// use snaprod::study::export::{Array, npz};
/// let file = npz(&[Array::reals("t", &[3], &[0.0, 0.5, 1.0])])?;
/// assert!(file.starts_with(b"PK"));
/// # Ok::<(), snaprod::Error>(())
/// ```
pub fn npz(arrays: &[Array]) -> Result<Vec<u8>> {
    let large =
        || Error::domain("an NPZ file has no place for more than 4 GiB; ask for fewer samples");
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for array in arrays {
        let name = format!("{}.npy", array.name);
        let file = array.npy();
        let size = u32::try_from(file.len()).map_err(|_| large())?;
        let start = u32::try_from(archive.len()).map_err(|_| large())?;
        // Version 2.0, names in UTF-8, stored, midnight of 1980-01-01.
        let mut common = Vec::new();
        for part in [20_u16, 1 << 11, 0, 0, 0x21] {
            common.extend(part.to_le_bytes());
        }
        for part in [crc32(&file), size, size] {
            common.extend(part.to_le_bytes());
        }
        let letters = u16::try_from(name.len()).map_err(|_| large())?;
        common.extend(letters.to_le_bytes());
        // No extra field.
        common.extend([0; 2]);
        archive.extend(b"PK\x03\x04");
        archive.extend(&common);
        archive.extend(name.as_bytes());
        archive.extend(&file);
        directory.extend(b"PK\x01\x02");
        directory.extend(20_u16.to_le_bytes());
        directory.extend(&common);
        // No comment, the first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(start.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let count = u16::try_from(arrays.len()).map_err(|_| large())?;
    let start = u32::try_from(archive.len()).map_err(|_| large())?;
    let size = u32::try_from(directory.len()).map_err(|_| large())?;
    archive.extend(directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend([count, count].map(u16::to_le_bytes).concat());
    archive.extend([size, start].map(u32::to_le_bytes).concat());
    archive.extend([0; 2]);
    Ok(archive)
}

/// The check sum of ZIP: the remainder by the polynomial 0xedb88320, reflected.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let mut rest = i as u32;
            let mut bit = 0;
            while bit < 8 {
                rest = (rest >> 1) ^ if rest & 1 == 1 { 0xedb8_8320 } else { 0 };
                bit += 1;
            }
            table[i] = rest;
            i += 1;
        }
        table
    };
    let step = |sum: u32, byte: &u8| (sum >> 8) ^ TABLE[((sum ^ u32::from(*byte)) & 0xff) as usize];
    !bytes.iter().fold(!0, step)
}
