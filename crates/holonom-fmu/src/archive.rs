//! The file of a unit: an archive of description, resources, libraries and documentation.

use crate::description::{Version, describe};
use crate::interface::Interface;
use crate::library::{LibraryError, Platform};
use crate::resources::Resources;
use holonom::Model;
use std::io::{self, Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// A unit before it is written.
#[derive(Debug)]
pub struct Unit {
    version: Version,
    interface: Interface,
    files: Vec<(String, Vec<u8>)>,
    platforms: Vec<&'static str>,
}

impl Unit {
    /// That of a model, without a library.
    ///
    /// # Errors
    /// None but those of memory.
    pub fn new(
        version: Version,
        model: &Model,
        interface: Interface,
        resources: &Resources,
    ) -> io::Result<Self> {
        let token = resources.token(&interface);
        let description = describe(version, model, &interface, &token)?;
        let mut files = vec![("modelDescription.xml".to_owned(), description.into_bytes())];
        let own = resources.files()?.into_iter();
        files.extend(own.map(|(path, bytes)| (format!("resources/{path}"), bytes)));
        Ok(Self { version, interface, files, platforms: Vec::new() })
    }

    /// The version of the standard that it follows.
    #[must_use]
    pub fn version(&self) -> Version {
        self.version
    }

    /// Its variables.
    #[must_use]
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The platforms that it has libraries for.
    #[must_use]
    pub fn platforms(&self) -> &[&'static str] {
        &self.platforms
    }

    /// Adds a library.
    ///
    /// # Errors
    /// [`LibraryError`].
    pub fn add_library(&mut self, bytes: Vec<u8>) -> Result<(), LibraryError> {
        let platform = Platform::of(&bytes)?;
        let path = platform.path(self.version)?;
        self.files.retain(|(own, _)| *own != path);
        self.files.push((path, bytes));
        if !self.platforms.contains(&platform.name()) {
            self.platforms.push(platform.name());
        }
        Ok(())
    }

    /// Adds a file of the documentation or a picture.
    pub fn add_file(&mut self, path: impl Into<String>, bytes: Vec<u8>) {
        self.files.push((path.into(), bytes));
    }

    /// The archive.
    ///
    /// # Errors
    /// None but those of memory.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        for (path, bytes) in &self.files {
            archive.start_file(path.as_str(), options)?;
            archive.write_all(bytes)?;
        }
        Ok(archive.finish()?.into_inner())
    }
}
