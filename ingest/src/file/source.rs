//! Location of the files of a log: on this computer, or in a bucket or on a server.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use tipwatch_storage::{Entry, ErrorKind, Folder, Location, Object};

use super::{
    content::{self, Content},
    format::Format,
    log_file::LogFile,
    read_options::ReadOptions,
};
use crate::message::{Error, Losses};

/// Reads files and folders of one log.
pub(crate) struct Source {
    remote: Option<Remote>,
    options: ReadOptions,
}

#[derive(Default)]
struct Remote {
    /// Opened to learn their content; read later.
    objects: RefCell<BTreeMap<PathBuf, Arc<Object>>>,
    folders: RefCell<BTreeMap<PathBuf, Listed>>,
}

#[derive(Clone, Default)]
struct Listed {
    files: Vec<(PathBuf, u64)>,
    folders: Vec<PathBuf>,
}

impl Source {
    /// Returns the source of the files at a path, and the path by which messages name it.
    pub(crate) fn of(path: &Path, options: &ReadOptions) -> Result<(Self, PathBuf), Error> {
        let location = Location::of(path)?;
        let source = Self {
            remote: location.is_remote().then(Remote::default),
            options: options.clone(),
        };
        Ok((source, location.path().to_path_buf()))
    }

    /// Returns the settings for reading the log, beyond what the log states.
    pub(crate) fn options(&self) -> &ReadOptions {
        &self.options
    }

    /// Whether the files are in a bucket or on a server.
    pub(crate) fn is_remote(&self) -> bool {
        self.remote.is_some()
    }

    /// Whether a path is a folder; an error if nothing exists there.
    pub(crate) fn is_folder(&self, path: &Path) -> Result<bool, Error> {
        let Some(remote) = &self.remote else {
            return Ok(std::fs::metadata(path).map_err(Error::io(path))?.is_dir());
        };
        match remote.object(path) {
            Ok(_) => Ok(false),
            Err(Error::Storage(error)) if error.kind == ErrorKind::NotFound => {
                let listed = remote.listed(path);
                match listed {
                    Ok(listed) if !(listed.files.is_empty() && listed.folders.is_empty()) => {
                        Ok(true)
                    }
                    _ => Err(error.into()),
                }
            }
            Err(error) => Err(error),
        }
    }

    pub(crate) fn is_file(&self, path: &Path) -> bool {
        match &self.remote {
            None => path.is_file(),
            Some(remote) => remote.file(path).is_some(),
        }
    }

    /// The length of a file; zero if it is unknown.
    pub(crate) fn bytes(&self, path: &Path) -> u64 {
        match &self.remote {
            None => std::fs::metadata(path).map_or(0, |metadata| metadata.len()),
            Some(remote) => {
                let opened = remote
                    .objects
                    .borrow()
                    .get(path)
                    .map(|object| object.size());
                opened.or_else(|| remote.file(path)).unwrap_or(0)
            }
        }
    }

    /// The files and folders directly in a folder.
    pub(crate) fn children(&self, folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Error> {
        if let Some(remote) = &self.remote {
            let listed = remote.listed(folder)?;
            let files = listed.files.into_iter().map(|(path, _)| path);
            return Ok((files.collect(), listed.folders));
        }
        let (mut files, mut folders) = (Vec::new(), Vec::new());
        for entry in std::fs::read_dir(folder).map_err(Error::io(folder))? {
            let path = entry.map_err(Error::io(folder))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.is_file() {
                files.push(path);
            }
        }
        Ok((files, folders))
    }

    /// A small file as a whole.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, Error> {
        let Some(remote) = &self.remote else {
            return std::fs::read(path).map_err(Error::io(path));
        };
        let object = remote.object(path)?;
        let mut bytes = vec![0; object.size() as usize];
        object.read_at(0, &mut bytes)?;
        Ok(bytes)
    }

    /// Classifies a file by its first bytes.
    pub(crate) fn content_of(&self, path: &Path) -> Result<Content, Error> {
        match &self.remote {
            None => content::of_file(path, &self.options.table),
            Some(remote) => content::of_object(remote.object(path)?.as_ref(), &self.options.table),
        }
    }

    /// The format of a file; an error if it has no reader.
    pub(crate) fn format_of(&self, path: &Path) -> Result<Format, Error> {
        self.content_of(path)?.format(path)
    }

    /// Opens a file, decompressing or recoding it if needed.
    pub(crate) fn open(&self, path: &Path, losses: &mut Losses) -> Result<LogFile, Error> {
        let content = self.content_of(path)?;
        let file = match &self.remote {
            None => LogFile::plain(path),
            Some(remote) => LogFile::remote(path, remote.object(path)?),
        };
        let Content::Log {
            is_packed,
            recoding,
            ..
        } = content
        else {
            return Ok(file);
        };
        let file = match is_packed {
            true => file.unpacked(losses)?,
            false => file,
        };
        match recoding {
            Some(recoding) => file.recoded(recoding, losses),
            None => Ok(file),
        }
    }
}

impl Remote {
    fn object(&self, path: &Path) -> Result<Arc<Object>, Error> {
        if let Some(object) = self.objects.borrow().get(path) {
            return Ok(Arc::clone(object));
        }
        let object = Arc::new(Object::open(&Location::of(path)?)?);
        let mut objects = self.objects.borrow_mut();
        objects.insert(path.to_path_buf(), Arc::clone(&object));
        Ok(object)
    }

    /// The length of a file in its folder's listing.
    fn file(&self, path: &Path) -> Option<u64> {
        let listed = self.listed(path.parent()?).ok()?;
        let found = listed.files.into_iter().find(|(file, _)| file == path);
        found.map(|(_, bytes)| bytes)
    }

    fn listed(&self, path: &Path) -> Result<Listed, Error> {
        if let Some(listed) = self.folders.borrow().get(path) {
            return Ok(listed.clone());
        }
        let folder = Folder::open(&Location::of(path)?)?;
        let (entries, folders) = folder.children("")?;
        let path_of = |key: &str| -> Result<PathBuf, Error> {
            Ok(folder.location().join(key)?.path().to_path_buf())
        };
        let file = |entry: Entry| Ok((path_of(&entry.key)?, entry.bytes));
        let listed = Listed {
            files: entries
                .into_iter()
                .map(file)
                .collect::<Result<_, Error>>()?,
            folders: folders
                .iter()
                .map(|key| path_of(key))
                .collect::<Result<_, Error>>()?,
        };
        let mut known = self.folders.borrow_mut();
        known.insert(path.to_path_buf(), listed.clone());
        Ok(listed)
    }
}
