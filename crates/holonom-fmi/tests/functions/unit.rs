//! A unit in a folder, and an instance of it by the functions of either version.

use holonom::model::ModelText;
use holonom::{Model, Override};
use holonom_fmi::{fmi2, fmi3};
use holonom_fmu::{Causality, Interface, Resources, UnitRequest, VariableRole, Version};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::PathBuf;
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicUsize, Ordering};

pub(crate) const OK: i32 = 0;
pub(crate) const WARNING: i32 = 1;
pub(crate) const DISCARD: i32 = 2;
pub(crate) const ERROR: i32 = 3;

/// The resources of a unit in a folder of their own.
pub(crate) struct Unit {
    pub(crate) folder: PathBuf,
    pub(crate) token: String,
    pub(crate) interface: Interface,
    pub(crate) model: Model,
}

pub(crate) fn shipped() -> Vec<(String, String)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../holonom-cli/models");
    let mut found: Vec<(String, String)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|own| own == "toml"))
        .map(|path| {
            let mut text = std::fs::read_to_string(&path).unwrap();
            if path.with_extension("csv").exists() {
                text = text.replace("file = \"", &format!("file = \"{folder}/"));
            }
            (path.file_stem().unwrap().to_string_lossy().into_owned(), text)
        })
        .collect();
    found.sort();
    assert!(found.len() > 40);
    found
}

impl Unit {
    pub(crate) fn new(text: &str, set: &[(&str, &str)], inputs: &[&str], keys: &[&str]) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("größe {number}"));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let text = ModelText::from_text(&folder.join("model.toml"), text);
        Self::in_folder(folder, &text, set, inputs, keys)
    }

    /// The unit of a text that was read, in a folder.
    pub(crate) fn in_folder(
        folder: PathBuf,
        text: &ModelText,
        set: &[(&str, &str)],
        inputs: &[&str],
        keys: &[&str],
    ) -> Self {
        let overrides: Vec<Override> = set.iter().map(|(k, v)| Override::new(*k, *v)).collect();
        let model = text.model(&overrides).unwrap();
        let owned = |list: &[&str]| list.iter().map(|own| (*own).to_owned()).collect();
        let request = UnitRequest { inputs: owned(inputs), parameters: owned(keys) };
        let resources = Resources::new(text, overrides, &model, request).unwrap();
        let (_, interface) = resources.interface().unwrap();
        for (path, bytes) in resources.files().unwrap() {
            let path = folder.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
        let token = resources.token(&interface);
        Self { folder, token, interface, model }
    }

    pub(crate) fn reference(&self, name: &str) -> u32 {
        let place = self.interface.variables.iter().position(|own| own.name == name);
        place.unwrap_or_else(|| panic!("no variable {name}")) as u32
    }

    /// References and columns of the outputs that are columns of `sensors.csv`.
    pub(crate) fn columns(&self) -> Vec<(u32, usize)> {
        let outputs = self.interface.of_causality(Causality::Output);
        let column = |(k, own): (usize, &holonom_fmu::Variable)| match own.quantity {
            VariableRole::Column(column) => Some((k as u32, column)),
            _ => None,
        };
        outputs.filter_map(column).collect()
    }

    pub(crate) fn instance(&self, version: Version) -> Instance {
        Instance::try_new(&self.folder, &self.token, version).unwrap()
    }

    /// An instance that is initialized at the time 0.
    pub(crate) fn begun(&self, version: Version) -> Instance {
        let own = self.instance(version);
        assert_eq!(own.initialize(0.0), OK, "{}", own.said());
        own
    }
}

/// An instance by the C functions.
pub(crate) struct Instance {
    pub(crate) version: Version,
    pub(crate) id: *mut c_void,
    said: Box<RefCell<Vec<String>>>,
}

/// One call at a time, on any thread.
unsafe impl Send for Instance {}

unsafe extern "C" fn hear3(
    environment: *mut c_void,
    status: i32,
    category: *const c_char,
    message: *const c_char,
) {
    let said = unsafe { environment.cast::<RefCell<Vec<String>>>().as_ref() }.unwrap();
    let words = |own| unsafe { CStr::from_ptr(own) }.to_string_lossy().into_owned();
    said.borrow_mut().push(format!("{status} {}: {}", words(category), words(message)));
}

impl Instance {
    pub(crate) fn try_new(
        folder: &std::path::Path,
        token: &str,
        version: Version,
    ) -> Result<Self, String> {
        let said: Box<RefCell<Vec<String>>> = Box::default();
        let environment = std::ptr::from_ref(&*said).cast_mut().cast::<c_void>();
        let (name, token) = (c"unit", CString::new(token).unwrap());
        let path = folder.display().to_string();
        let id = match version {
            Version::Fmi3 => {
                let path = CString::new(path).unwrap();
                unsafe {
                    fmi3::fmi3InstantiateCoSimulation(
                        name.as_ptr(),
                        token.as_ptr(),
                        path.as_ptr(),
                        false,
                        true,
                        false,
                        false,
                        null(),
                        0,
                        environment,
                        Some(hear3),
                        null(),
                    )
                }
            }
            Version::Fmi2 => {
                let escaped = path.replace(' ', "%20").replace('ö', "%C3%B6");
                let address = CString::new(format!("file://{escaped}")).unwrap();
                // a variadic function cannot be defined here: FMPy hears the messages of FMI 2.0
                let functions = fmi2::CallbackFunctions {
                    logger: None,
                    allocateMemory: null(),
                    freeMemory: null(),
                    stepFinished: null(),
                    componentEnvironment: environment,
                };
                unsafe {
                    fmi2::fmi2Instantiate(
                        name.as_ptr(),
                        1,
                        token.as_ptr(),
                        address.as_ptr(),
                        &raw const functions,
                        0,
                        0,
                    )
                }
            }
        };
        if id.is_null() {
            return Err(said.borrow().join("\n"));
        }
        Ok(Self { version, id, said })
    }

    /// What it has said since it was asked last.
    pub(crate) fn said(&self) -> String {
        self.said.borrow_mut().drain(..).collect::<Vec<_>>().join("\n")
    }

    pub(crate) fn enter(&self, start: f64) -> i32 {
        match self.version {
            Version::Fmi3 => {
                fmi3::fmi3EnterInitializationMode(self.id, false, 0.0, start, false, 0.0)
            }
            Version::Fmi2 => match fmi2::fmi2SetupExperiment(self.id, 0, 0.0, start, 0, 0.0) {
                OK => fmi2::fmi2EnterInitializationMode(self.id),
                refused => refused,
            },
        }
    }

    pub(crate) fn exit(&self) -> i32 {
        match self.version {
            Version::Fmi3 => fmi3::fmi3ExitInitializationMode(self.id),
            Version::Fmi2 => fmi2::fmi2ExitInitializationMode(self.id),
        }
    }

    pub(crate) fn initialize(&self, start: f64) -> i32 {
        match self.enter(start) {
            OK => self.exit(),
            refused => refused,
        }
    }

    pub(crate) fn set(&self, reference: u32, value: f64) -> i32 {
        let (vr, values) = ([reference], [value]);
        unsafe {
            match self.version {
                Version::Fmi3 => fmi3::fmi3SetFloat64(self.id, vr.as_ptr(), 1, values.as_ptr(), 1),
                Version::Fmi2 => fmi2::fmi2SetReal(self.id, vr.as_ptr(), 1, values.as_ptr()),
            }
        }
    }

    pub(crate) fn try_get(&self, references: &[u32]) -> Result<Vec<f64>, i32> {
        let n = references.len();
        let mut values = vec![f64::NAN; n];
        let (vr, out) = (references.as_ptr(), values.as_mut_ptr());
        let status = unsafe {
            match self.version {
                Version::Fmi3 => fmi3::fmi3GetFloat64(self.id, vr, n, out, n),
                Version::Fmi2 => fmi2::fmi2GetReal(self.id, vr, n, out),
            }
        };
        if status == OK { Ok(values) } else { Err(status) }
    }

    pub(crate) fn get(&self, references: &[u32]) -> Vec<f64> {
        self.try_get(references).unwrap_or_else(|status| panic!("{status}: {}", self.said()))
    }

    /// The status of a step, and the time reached.
    pub(crate) fn step(&self, t: f64, h: f64) -> (i32, f64) {
        let mut reached = f64::NAN;
        let status = match self.version {
            Version::Fmi3 => {
                let (mut event, mut end, mut early) = (true, true, true);
                let status = unsafe {
                    fmi3::fmi3DoStep(
                        self.id,
                        t,
                        h,
                        true,
                        &mut event,
                        &mut end,
                        &mut early,
                        &mut reached,
                    )
                };
                assert!(!event && !early);
                status
            }
            Version::Fmi2 => {
                let status = fmi2::fmi2DoStep(self.id, t, h, 1);
                unsafe { fmi2::fmi2GetRealStatus(self.id, 2, &mut reached) };
                status
            }
        };
        (status, reached)
    }

    pub(crate) fn terminate(&self) -> i32 {
        match self.version {
            Version::Fmi3 => fmi3::fmi3Terminate(self.id),
            Version::Fmi2 => fmi2::fmi2Terminate(self.id),
        }
    }

    pub(crate) fn reset(&self) -> i32 {
        match self.version {
            Version::Fmi3 => fmi3::fmi3Reset(self.id),
            Version::Fmi2 => fmi2::fmi2Reset(self.id),
        }
    }

    pub(crate) fn state(&self) -> *mut c_void {
        let mut state = null_mut();
        let status = unsafe { fmi3::fmi3GetFMUState(self.id, &mut state) };
        assert_eq!(status, OK, "{}", self.said());
        state
    }

    pub(crate) fn resume(&self, state: *mut c_void) -> i32 {
        unsafe { fmi3::fmi3SetFMUState(self.id, state) }
    }

    pub(crate) fn free(&self, mut state: *mut c_void) {
        assert_eq!(unsafe { fmi3::fmi3FreeFMUState(self.id, &mut state) }, OK);
        assert!(state.is_null());
    }

    pub(crate) fn bytes(&self, state: *mut c_void) -> Vec<u8> {
        let mut size = 0;
        unsafe {
            assert_eq!(fmi3::fmi3SerializedFMUStateSize(self.id, state, &mut size), OK);
            let mut bytes = vec![0; size];
            assert_eq!(fmi3::fmi3SerializeFMUState(self.id, state, bytes.as_mut_ptr(), size), OK);
            bytes
        }
    }

    pub(crate) fn state_of(&self, bytes: &[u8]) -> Result<*mut c_void, String> {
        let mut state = null_mut();
        let status = unsafe {
            fmi3::fmi3DeserializeFMUState(self.id, bytes.as_ptr(), bytes.len(), &mut state)
        };
        if status == OK { Ok(state) } else { Err(self.said()) }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        unsafe { fmi3::fmi3FreeInstance(self.id) }
    }
}
