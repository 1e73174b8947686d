//! Prepared light as a stream of bytes: plain numbers as they lie in memory, between a header and a checksum.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};

use blake3::{Hash, Hasher};
use bytemuck::{NoUninit, Pod, bytes_of, bytes_of_mut, cast_slice, cast_slice_mut};

/// What every file starts with.
const MAGIC: [u8; 8] = *b"LMTRNSPT";

/// To be raised when the order or the shape of what is written changes.
pub(crate) const FORMAT_VERSION: u32 = 2;

/// Pieces from this size on are hashed on all cores.
const LARGE: usize = 1 << 18;

/// What can be written and read back to the bit.
pub(crate) trait Flat: Sized {
    /// Writes it.
    fn write(&self, out: &mut Writer) -> io::Result<()>;
    /// Reads what [`Flat::write`] wrote.
    fn read(input: &mut Reader) -> io::Result<Self>;
}

/// Writes numbers and hashes them on the way.
pub(crate) struct Writer<'a> {
    out: &'a mut dyn Write,
    hasher: Hasher,
}

impl<'a> Writer<'a> {
    /// Starts with the header of a file that holds the light of a key.
    pub(crate) fn new(out: &'a mut dyn Write, key: &Hash) -> io::Result<Self> {
        let mut writer = Self { out, hasher: Hasher::new() };
        writer.bytes(&MAGIC)?;
        writer.value(&FORMAT_VERSION)?;
        writer.bytes(key.as_bytes())?;
        Ok(writer)
    }

    /// Ends with the checksum of all that was written.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.out.write_all(self.hasher.finalize().as_bytes())
    }

    /// A number or an array of numbers.
    pub(crate) fn value<T: NoUninit>(&mut self, value: &T) -> io::Result<()> {
        self.bytes(bytes_of(value))
    }

    /// A list of numbers, with its length before it.
    pub(crate) fn slice<T: NoUninit>(&mut self, values: &[T]) -> io::Result<()> {
        self.value(&(values.len() as u64))?;
        self.bytes(cast_slice(values))
    }

    fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        hash(&mut self.hasher, bytes);
        self.out.write_all(bytes)
    }
}

/// Reads what a [`Writer`] wrote.
pub(crate) struct Reader {
    input: BufReader<File>,
    hasher: Hasher,
    /// Bytes before the checksum.
    left: u64,
}

impl Reader {
    /// Reads the header.
    pub(crate) fn new(file: File, key: &Hash) -> io::Result<Self> {
        let left = file.metadata()?.len().saturating_sub(blake3::OUT_LEN as u64);
        let mut reader = Self { input: BufReader::new(file), hasher: Hasher::new(), left };
        let expected = (MAGIC, FORMAT_VERSION, *key.as_bytes());
        if (reader.value()?, reader.value()?, reader.value()?) != expected {
            return Err(io::Error::other("it holds something else"));
        }
        Ok(reader)
    }

    /// Checks that all was read, and read as it was written.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        let mut checksum = [0; blake3::OUT_LEN];
        self.input.read_exact(&mut checksum)?;
        if self.left > 0 || self.hasher.finalize() != checksum {
            return Err(io::Error::other("its checksum is wrong"));
        }
        Ok(())
    }

    /// A number or an array of numbers.
    pub(crate) fn value<T: Pod>(&mut self) -> io::Result<T> {
        let mut value = T::zeroed();
        self.bytes(bytes_of_mut(&mut value))?;
        Ok(value)
    }

    /// A list of numbers.
    pub(crate) fn vec<T: Pod>(&mut self) -> io::Result<Vec<T>> {
        let len: u64 = self.value()?;
        // Before memory is asked for: a damaged length must not ask for all of it.
        self.check(len.saturating_mul(size_of::<T>() as u64))?;
        let mut values = vec![T::zeroed(); len as usize];
        self.bytes(cast_slice_mut(&mut values))?;
        Ok(values)
    }

    /// Checks that a list of at least as many bytes as its length can follow.
    pub(crate) fn count(&mut self) -> io::Result<usize> {
        let len: u64 = self.value()?;
        self.check(len)?;
        Ok(len as usize)
    }

    fn check(&self, bytes: u64) -> io::Result<()> {
        if bytes > self.left { Err(io::Error::other("it is cut short")) } else { Ok(()) }
    }

    fn bytes(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.check(bytes.len() as u64)?;
        self.input.read_exact(bytes)?;
        self.left -= bytes.len() as u64;
        hash(&mut self.hasher, bytes);
        Ok(())
    }
}

fn hash(hasher: &mut Hasher, bytes: &[u8]) {
    if bytes.len() < LARGE {
        hasher.update(bytes)
    } else {
        hasher.update_rayon(bytes)
    };
}

impl<T: Flat> Flat for Vec<T> {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&(self.len() as u64))?;
        self.iter().try_for_each(|item| item.write(out))
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        (0..input.count()?).map(|_| T::read(input)).collect()
    }
}

impl<T: Flat> Flat for Option<T> {
    fn write(&self, out: &mut Writer) -> io::Result<()> {
        out.value(&u32::from(self.is_some()))?;
        self.as_ref().map_or(Ok(()), |item| item.write(out))
    }

    fn read(input: &mut Reader) -> io::Result<Self> {
        Ok(if input.value::<u32>()? != 0 { Some(T::read(input)?) } else { None })
    }
}
