//! The platform of a library, and whether it is the one that a unit needs.

use crate::{VERSION, Version};

/// What the library says of itself: exporter and library have to be of one version, and a panic
/// must not end the process of the tool.
#[must_use]
pub fn mark(unwinds: bool) -> String {
    let panic = if unwinds { UNWINDS } else { ABORTS };
    format!("{MARK}{VERSION} {panic}")
}

/// The beginning of the mark.
pub const MARK: &str = "holonom functional mock-up unit library ";
/// The end of the mark of a library that survives a panic.
pub const UNWINDS: &str = "unwinds;";
/// The end of the mark of one that does not.
pub const ABORTS: &str = "aborts;";

/// Operating system and processor of a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    system: OperatingSystem,
    arm: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OperatingSystem {
    Linux,
    Windows,
    Darwin,
}

/// Why a file is not the library of a unit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LibraryError {
    /// Neither ELF nor PE nor Mach-O of a known processor.
    #[error("it is no library for Linux, Windows or macOS on x86-64 or ARM64")]
    Foreign,
    /// FMI 2.0 has no name for the platform.
    #[error("FMI 2.0 has no folder for libraries of {0}")]
    NoFolder(&'static str),
    /// It has no mark.
    #[error("it is not the library of holonom's functional mock-up units")]
    NoMark,
    /// Its mark has another version.
    #[error("it is of version {found}, and this is version {VERSION}")]
    OtherVersion {
        /// Its version.
        found: String,
    },
    /// It was built to abort.
    #[error("it was built to end the process at a panic, and would take the simulation tool along")]
    Aborts,
}

impl Platform {
    /// That of the bytes of a library.
    ///
    /// # Errors
    /// [`LibraryError`], also for a library that is not that of units of this version.
    pub fn of(library: &[u8]) -> Result<Self, LibraryError> {
        let platform = Self::by_header(library).ok_or(LibraryError::Foreign)?;
        let mut other = None;
        for at in memchr::memmem::find_iter(library, MARK) {
            let rest = &library[at + MARK.len()..];
            let length = rest.iter().take(64).position(|byte| *byte == b';');
            let words = length.map(|end| String::from_utf8_lossy(&rest[..=end]).into_owned());
            match words.as_deref().and_then(|words| words.split_once(' ')) {
                Some((VERSION, UNWINDS)) => return Ok(platform),
                Some((VERSION, ABORTS)) => return Err(LibraryError::Aborts),
                Some((found, UNWINDS | ABORTS)) => other = Some(found.to_owned()),
                _ => {}
            }
        }
        Err(other.map_or(LibraryError::NoMark, |found| LibraryError::OtherVersion { found }))
    }

    fn by_header(library: &[u8]) -> Option<Self> {
        let half = |at: usize| Some(u16::from_le_bytes(library.get(at..at + 2)?.try_into().ok()?));
        let word = |at: usize| Some(u32::from_le_bytes(library.get(at..at + 4)?.try_into().ok()?));
        if library.starts_with(b"\x7fELF") {
            let arm = match half(18)? {
                0x3e => false,
                0xb7 => true,
                _ => return None,
            };
            return Some(Self { system: OperatingSystem::Linux, arm });
        }
        if library.starts_with(b"MZ") {
            let header = usize::try_from(word(0x3c)?).ok()?;
            let is_image = library.get(header..header + 4)? == b"PE\0\0";
            let arm = match half(header + 4)? {
                0x8664 => false,
                0xaa64 => true,
                _ => return None,
            };
            return is_image.then_some(Self { system: OperatingSystem::Windows, arm });
        }
        if word(0)? == 0xfeed_facf {
            let arm = match word(4)? {
                0x0100_0007 => false,
                0x0100_000c => true,
                _ => return None,
            };
            return Some(Self { system: OperatingSystem::Darwin, arm });
        }
        None
    }

    /// Its name, as FMI 3.0 names the folder.
    #[must_use]
    pub fn name(self) -> &'static str {
        match (self.system, self.arm) {
            (OperatingSystem::Linux, false) => "x86_64-linux",
            (OperatingSystem::Linux, true) => "aarch64-linux",
            (OperatingSystem::Windows, false) => "x86_64-windows",
            (OperatingSystem::Windows, true) => "aarch64-windows",
            (OperatingSystem::Darwin, false) => "x86_64-darwin",
            (OperatingSystem::Darwin, true) => "aarch64-darwin",
        }
    }

    /// The path of the library in a unit.
    ///
    /// # Errors
    /// [`LibraryError::NoFolder`].
    pub fn path(self, version: Version) -> Result<String, LibraryError> {
        let folder = match (version, self.system, self.arm) {
            (Version::Fmi3, ..) => self.name(),
            (Version::Fmi2, OperatingSystem::Linux, false) => "linux64",
            (Version::Fmi2, OperatingSystem::Windows, false) => "win64",
            (Version::Fmi2, OperatingSystem::Darwin, false) => "darwin64",
            (Version::Fmi2, ..) => return Err(LibraryError::NoFolder(self.name())),
        };
        let suffix = match self.system {
            OperatingSystem::Linux => "so",
            OperatingSystem::Windows => "dll",
            OperatingSystem::Darwin => "dylib",
        };
        Ok(format!("binaries/{folder}/{}.{suffix}", crate::MODEL_IDENTIFIER))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elf(machine: u8, mark: &str) -> Vec<u8> {
        let mut bytes = b"\x7fELF".to_vec();
        bytes.resize(18, 0);
        bytes.extend([machine, 0]);
        bytes.extend(mark.as_bytes());
        bytes
    }

    #[test]
    fn the_folder_follows_from_the_header_of_a_library() {
        let linux = Platform::of(&elf(0x3e, &mark(true))).unwrap();
        assert_eq!(linux.path(Version::Fmi3).unwrap(), "binaries/x86_64-linux/holonom.so");
        assert_eq!(linux.path(Version::Fmi2).unwrap(), "binaries/linux64/holonom.so");
        let arm = Platform::of(&elf(0xb7, &mark(true))).unwrap();
        assert_eq!(arm.path(Version::Fmi3).unwrap(), "binaries/aarch64-linux/holonom.so");
        assert_eq!(arm.path(Version::Fmi2), Err(LibraryError::NoFolder("aarch64-linux")));
        let mut windows = vec![0; 0x40];
        windows[..2].copy_from_slice(b"MZ");
        windows[0x3c] = 0x40;
        windows.extend(b"PE\0\0\x64\x86");
        windows.extend(mark(true).as_bytes());
        let windows = Platform::of(&windows).unwrap();
        assert_eq!(windows.path(Version::Fmi2).unwrap(), "binaries/win64/holonom.dll");
        let mut mac = vec![0xcf, 0xfa, 0xed, 0xfe, 0x0c, 0, 0, 1];
        mac.extend(mark(true).as_bytes());
        let path = Platform::of(&mac).unwrap().path(Version::Fmi3);
        assert_eq!(path.unwrap(), "binaries/aarch64-darwin/holonom.dylib");
    }

    #[test]
    fn other_libraries_are_refused_by_what_they_are() {
        assert_eq!(Platform::of(b"#!/bin/sh"), Err(LibraryError::Foreign));
        assert_eq!(Platform::of(&elf(0x28, &mark(true))), Err(LibraryError::Foreign));
        assert_eq!(Platform::of(&elf(0x3e, "")), Err(LibraryError::NoMark));
        assert_eq!(Platform::of(&elf(0x3e, &mark(false))), Err(LibraryError::Aborts));
        let other = format!("{MARK}0.0.1 {UNWINDS}");
        let found = "0.0.1".to_owned();
        assert_eq!(Platform::of(&elf(0x3e, &other)), Err(LibraryError::OtherVersion { found }));
    }
}
