//! Numbers of a whole log, in memory or in a temporary file.

use std::io;

use bytemuck::Pod;

use crate::base::scratch_file::ScratchFile;

/// Numbers that are appended, then read in pieces from several threads.
#[derive(Debug)]
pub(super) enum Column<T> {
    /// In memory.
    Memory(Vec<T>),
    /// In a temporary file.
    File(ScratchFile),
}

impl<T> Default for Column<T> {
    fn default() -> Self {
        Self::Memory(Vec::new())
    }
}

impl<T: Pod> Column<T> {
    /// The numbers, if they are in memory.
    pub(super) fn in_memory(&self) -> Option<&[T]> {
        match self {
            Self::Memory(numbers) => Some(numbers),
            Self::File(_) => None,
        }
    }

    /// Reserves memory for so many more numbers, if it is available and they are in memory.
    pub(super) fn reserve(&mut self, numbers: usize) {
        if let Self::Memory(column) = self {
            // else it grows as numbers come
            let _ = column.try_reserve_exact(numbers);
        }
    }

    /// # Errors
    /// The temporary file cannot be written.
    pub(super) fn append(&mut self, numbers: &[T]) -> io::Result<()> {
        match self {
            Self::Memory(column) => {
                column.extend_from_slice(numbers);
                Ok(())
            }
            Self::File(file) => file.append(bytemuck::cast_slice(numbers)),
        }
    }

    /// Moves the numbers to a temporary file, and those appended from now on.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn move_to_file(&mut self) -> io::Result<()> {
        if let Self::Memory(numbers) = self {
            let mut file = ScratchFile::new()?;
            file.append(bytemuck::cast_slice(numbers))?;
            *self = Self::File(file);
        }
        Ok(())
    }

    /// Reads consecutive numbers, from the one with index `first` on. There must be as many.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn read(&self, first: usize, into: &mut [T]) -> io::Result<()> {
        match self {
            Self::Memory(numbers) => {
                let numbers = numbers.get(first..).and_then(|rest| rest.get(..into.len()));
                into.copy_from_slice(numbers.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
            Self::File(file) => {
                let from = (first * size_of::<T>()) as u64;
                file.read_at(bytemuck::cast_slice_mut(into), from)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_the_same_in_memory_and_in_a_file() {
        let numbers: Vec<f64> = (0..1000).map(|k| f64::from(k).sin()).collect();
        let mut memory = Column::Memory(numbers[..600].to_vec());
        let mut file = Column::default();
        file.append(&numbers[..300]).unwrap();
        file.move_to_file().unwrap();
        file.append(&numbers[300..600]).unwrap();
        for column in [&mut memory, &mut file] {
            column.append(&numbers[600..]).unwrap();
            let mut found = [0.0; 700];
            column.read(250, &mut found).unwrap();
            assert_eq!(found, numbers[250..950]);
            assert!(column.read(301, &mut found).is_err());
        }
        assert!(memory.in_memory().is_some() && file.in_memory().is_none());
    }
}
