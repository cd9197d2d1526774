//! Large files, written past the page cache.
//!
//! A file that is larger than what memory has to spare goes through the page cache for nothing: its
//! pages are taken, filled, written and given back, by the processor. Here the file is cut into
//! blocks. Pieces come in any order and are copied to the blocks that they touch; a block whose
//! bytes have all come is written by a thread that does nothing else, straight from its memory.
//! Callers wait while too many blocks are waiting, so that memory stays bounded whatever the disk
//! does.

use rustc_hash::FxHashMap;
use rustix::fs::{FallocateFlags, OFlags, fallocate};
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Bytes of a block: enough for a disk to work at full speed. Quarters of it reach half the speed.
const BLOCK: usize = 1 << 23;
/// Memory and lengths of direct writes are multiples of this, which no disk's sector exceeds.
const ALIGNMENT: usize = 4096;
/// Threads that write: one block is on its way while the next is handed over.
const WRITERS: usize = 2;
/// Blocks that wait to be written, at most.
const WAITING: usize = 2;

/// A file written directly by blocks.
#[derive(Debug)]
pub(super) struct DirectWriter {
    shared: Arc<Shared>,
    /// Blocks of which bytes are missing, by number.
    open: Mutex<FxHashMap<u64, Arc<Mutex<Block>>>>,
    queue: Option<SyncSender<Job>>,
    writers: Vec<JoinHandle<()>>,
}

/// What callers and writers share.
#[derive(Debug)]
struct Shared {
    direct: File,
    /// For a file system that opens files for direct writes, but does not take them.
    plain: File,
    length: u64,
    idle: Mutex<Vec<Memory>>,
    failure: Mutex<Option<io::Error>>,
}

/// A block to be written, by number.
type Job = (u64, Arc<Mutex<Block>>);

/// A part of the file.
#[derive(Debug)]
struct Block {
    memory: Memory,
    missing: usize,
}

/// Room for a block at an aligned address.
#[derive(Debug, Default)]
struct Memory {
    bytes: Vec<u8>,
    first: usize,
}

impl Memory {
    fn for_a_block() -> Self {
        let bytes = vec![0; BLOCK + ALIGNMENT];
        let first = bytes.as_ptr().align_offset(ALIGNMENT);
        Self { bytes, first }
    }

    fn bytes(&mut self) -> &mut [u8] {
        &mut self.bytes[self.first..][..BLOCK]
    }
}

/// Whatever a panicking thread has left.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl DirectWriter {
    /// Sets `length` bytes aside for `file`, where its file system can.
    ///
    /// Without room set aside a direct write takes the file for itself until it is done, and the
    /// writers wait for each other.
    ///
    /// # Errors
    /// When the disk has not so much room.
    pub(super) fn set_aside(file: &File, length: u64) -> io::Result<()> {
        match fallocate(file, FallocateFlags::empty(), 0, length.max(1)) {
            Err(rustix::io::Errno::NOSPC) => Err(rustix::io::Errno::NOSPC.into()),
            // Where a file system can't, writing will tell.
            Ok(()) | Err(_) => Ok(()),
        }
    }

    /// A writer of `length` bytes into `file`, if its file system takes direct writes.
    pub(super) fn new(file: &File, length: u64) -> Option<Self> {
        let flags = i32::try_from(OFlags::DIRECT.bits()).ok()?;
        let own = format!("/proc/self/fd/{}", file.as_raw_fd());
        let direct = File::options().write(true).custom_flags(flags).open(own).ok()?;
        Self::through(direct, file.try_clone().ok()?, length)
    }

    /// A writer through two handles of one file.
    fn through(direct: File, plain: File, length: u64) -> Option<Self> {
        let (queue, jobs) = sync_channel(WAITING);
        let jobs = Arc::new(Mutex::new(jobs));
        let (idle, failure) = (Mutex::default(), Mutex::default());
        let shared = Arc::new(Shared { direct, plain, length, idle, failure });
        let mut writer = Self {
            shared: Arc::clone(&shared),
            open: Mutex::default(),
            queue: Some(queue),
            writers: Vec::new(),
        };
        for _ in 0..WRITERS {
            let (shared, jobs) = (Arc::clone(&shared), Arc::clone(&jobs));
            let builder = std::thread::Builder::new().name("writer".into());
            writer.writers.push(builder.spawn(move || shared.write_blocks(&jobs)).ok()?);
        }
        Some(writer)
    }

    /// Takes the `bytes` of the file from `offset` on; no byte comes twice.
    ///
    /// # Errors
    /// Any failure of writing, also of bytes taken before.
    pub(super) fn write_all_at(&self, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
        self.shared.check()?;
        while !bytes.is_empty() {
            let number = offset / BLOCK as u64;
            let within = (offset % BLOCK as u64) as usize;
            let (here, after) = bytes.split_at(bytes.len().min(BLOCK - within));
            let block = Arc::clone(
                lock(&self.open).entry(number).or_insert_with(|| self.shared.block(number)),
            );
            let mut content = lock(&block);
            content.memory.bytes()[within..][..here.len()].copy_from_slice(here);
            content.missing -= here.len();
            let is_whole = content.missing == 0;
            drop(content);
            if is_whole {
                lock(&self.open).remove(&number);
                let queue = self.queue.as_ref().expect("it is taken by closing only");
                // Writers go on after failures, which the next call reports; they end by panic only.
                queue.send((number, block)).map_err(|_| panicked())?;
            }
            (bytes, offset) = (after, offset + here.len() as u64);
        }
        Ok(())
    }

    /// Waits until everything is written.
    ///
    /// # Errors
    /// Any failure of writing.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.close();
        self.shared.check()?;
        // The last block was written whole.
        self.shared.plain.set_len(self.shared.length)
    }

    fn close(&mut self) {
        self.queue = None;
        for writer in self.writers.drain(..) {
            if writer.join().is_err() {
                lock(&self.shared.failure).get_or_insert_with(panicked);
            }
        }
    }
}

/// What is left to say of a thread that broke our own rules.
fn panicked() -> io::Error {
    io::Error::other("a thread that writes has panicked")
}

impl Drop for DirectWriter {
    fn drop(&mut self) {
        self.close();
    }
}

impl Shared {
    /// An empty block.
    fn block(&self, number: u64) -> Arc<Mutex<Block>> {
        let memory = lock(&self.idle).pop().unwrap_or_else(Memory::for_a_block);
        let missing = (self.length - number * BLOCK as u64).min(BLOCK as u64) as usize;
        Arc::new(Mutex::new(Block { memory, missing }))
    }

    /// Writes blocks until no more come.
    fn write_blocks(&self, jobs: &Mutex<Receiver<Job>>) {
        loop {
            let job = lock(jobs).recv();
            let Ok((number, block)) = job else { return };
            let mut memory = std::mem::take(&mut lock(&block).memory);
            let offset = number * BLOCK as u64;
            let length = (self.length - offset).min(BLOCK as u64) as usize;
            let bytes = &memory.bytes()[..length.next_multiple_of(ALIGNMENT)];
            let written = match self.direct.write_all_at(bytes, offset) {
                Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                    self.plain.write_all_at(bytes, offset)
                }
                written => written,
            };
            if let Err(error) = written {
                lock(&self.failure).get_or_insert(error);
            }
            lock(&self.idle).push(memory);
        }
    }

    /// The first failure of a writer.
    fn check(&self) -> io::Result<()> {
        lock(&self.failure).as_ref().map_or(Ok(()), |error| {
            let code = error.raw_os_error();
            Err(code.map_or_else(|| error.kind().into(), io::Error::from_raw_os_error))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Seek};

    /// Writes bytes in pieces of many lengths, the later half first, and returns what is there.
    fn written(length: usize, make: impl Fn(&File, u64) -> DirectWriter) -> (Vec<u8>, Vec<u8>) {
        let bytes: Vec<u8> = (0..length).map(|i| ((i * i) >> 7) as u8).collect();
        let mut file = tempfile::tempfile().unwrap();
        file.set_len(length as u64).unwrap();
        let writer = make(&file, length as u64);
        let (low, high) = bytes.split_at(length / 2);
        std::thread::scope(|scope| {
            for (half, first, piece) in [(high, length / 2, 99_991), (low, 0, 300_007)] {
                let writer = &writer;
                scope.spawn(move || {
                    for (n, piece_bytes) in half.chunks(piece).enumerate() {
                        writer.write_all_at(piece_bytes, (first + n * piece) as u64).unwrap();
                    }
                });
            }
        });
        writer.finish().unwrap();
        let mut there = Vec::new();
        file.rewind().unwrap();
        file.read_to_end(&mut there).unwrap();
        (there, bytes)
    }

    #[test]
    fn pieces_in_any_order_make_the_file() {
        for length in [1, 4096, BLOCK, 3 * BLOCK + 1, 8 * BLOCK + 5000] {
            let through = |file: &File, length| {
                let clone = || file.try_clone().unwrap();
                DirectWriter::through(clone(), clone(), length).unwrap()
            };
            let (there, bytes) = written(length, through);
            assert!(there == bytes, "{length} bytes");
        }
    }

    #[test]
    fn a_file_system_without_direct_writes_is_told_or_served() {
        let file = tempfile::tempfile().unwrap();
        if DirectWriter::new(&file, 1).is_none() {
            return;
        }
        let direct = |file: &File, length| DirectWriter::new(file, length).unwrap();
        let (there, bytes) = written(2 * BLOCK + 77, direct);
        assert!(there == bytes);
    }

    #[test]
    fn a_failing_disk_is_reported() {
        // Handles that are open for reading only take no bytes.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, b"").unwrap();
        let open = || File::open(&path).unwrap();
        let writer = DirectWriter::through(open(), open(), 2 * BLOCK as u64).unwrap();
        writer.write_all_at(&vec![0; BLOCK], 0).unwrap();
        assert!(writer.finish().is_err());
    }
}
