//! The functions of FMI 2.0.
//!
//! # Safety
//! As of [`crate::fmi3`].

use crate::fmi3::{self, with};
use crate::handle::{CallAnswer, Handle, Log, CallStatus, absent, refused};
use crate::pointers::{kept, put, words};
use holonom_fmu::{Instance, Phase};
use std::ffi::{CString, c_char, c_int, c_void};

type Fmi2Component = *mut c_void;
type Fmi2State = *mut c_void;
type Logger = Option<
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...),
>;

/// Functions of the tool.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct CallbackFunctions {
    pub logger: Logger,
    pub allocateMemory: *const c_void,
    pub freeMemory: *const c_void,
    pub stepFinished: *const c_void,
    pub componentEnvironment: *mut c_void,
}

fn logger(name: CString, environment: *mut c_void, log: Logger) -> Log {
    Box::new(move |status, category, message| {
        let (Some(log), Ok(category)) = (log, CString::new(category)) else { return };
        let message = CString::new(message.replace('\0', " ").replace('%', "%%")).unwrap_or_default();
        let (category, message) = (category.as_ptr(), message.as_ptr());
        // SAFETY: the callback of the tool. It may take the message for a format, or for words.
        unsafe { log(environment, name.as_ptr(), status as c_int, category, message) }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    c: Fmi2Component,
    loggingOn: c_int,
    _nCategories: usize,
    _categories: *const *const c_char,
) -> i32 {
    with(c, |handle| {
        handle.set_verbose(loggingOn != 0);
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instanceName: *const c_char,
    fmuType: c_int,
    fmuGUID: *const c_char,
    fmuResourceLocation: *const c_char,
    functions: *const CallbackFunctions,
    _visible: c_int,
    loggingOn: c_int,
) -> Fmi2Component {
    // SAFETY: words and functions of the tool.
    let (name, guid, address, functions) = unsafe {
        (words(instanceName), words(fmuGUID), words(fmuResourceLocation), functions.as_ref())
    };
    let name = CString::new(name.unwrap_or_default()).unwrap_or_default();
    let (log, environment) =
        functions.map_or((None, std::ptr::null_mut()), |f| (f.logger, f.componentEnvironment));
    let make = move || {
        if fmuType != 1 {
            return Err("the unit is one of co-simulation, not of model exchange".to_owned());
        }
        let address = address.ok_or("the address of the resources is missing")?;
        let guid = guid.ok_or("the GUID is missing")?;
        Instance::new(&holonom_fmu::resources::folder_of_address(&address), &guid)
    };
    match Handle::new(make, logger(name, environment, log), loggingOn != 0) {
        Some(handle) => kept(handle),
        None => std::ptr::null_mut(),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: Fmi2Component) {
    // SAFETY: an instance of this library, which the tool does not use any more.
    unsafe { fmi3::fmi3FreeInstance(c) }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    c: Fmi2Component,
    _toleranceDefined: c_int,
    _tolerance: f64,
    startTime: f64,
    _stopTimeDefined: c_int,
    _stopTime: f64,
) -> i32 {
    with(c, |handle| {
        if handle.instance.phase() != Phase::Instantiated {
            return Err(refused("set up experiment: the instance is initialized already"));
        }
        handle.start = startTime;
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(c: Fmi2Component) -> i32 {
    with(c, |handle| handle.instance.enter_initialization(handle.start).map(|()| CallStatus::Ok))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2ExitInitializationMode(c: Fmi2Component) -> i32 {
    fmi3::fmi3ExitInitializationMode(c)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2Terminate(c: Fmi2Component) -> i32 {
    fmi3::fmi3Terminate(c)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2Reset(c: Fmi2Component) -> i32 {
    fmi3::fmi3Reset(c)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    c: Fmi2Component,
    vr: *const u32,
    nvr: usize,
    value: *mut f64,
) -> i32 {
    // SAFETY: lists of the tool.
    unsafe { fmi3::fmi3GetFloat64(c, vr, nvr, value, nvr) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    c: Fmi2Component,
    vr: *const u32,
    nvr: usize,
    value: *const f64,
) -> i32 {
    // SAFETY: lists of the tool.
    unsafe { fmi3::fmi3SetFloat64(c, vr, nvr, value, nvr) }
}

/// Getters and setters of types that no variable has: an empty list is right.
macro_rules! other_types {
    ($($get:ident $set:ident $type:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $get(c: Fmi2Component, _vr: *const u32, nvr: usize, _value: *mut $type) -> i32 {
            with(c, |_| none_of_type(stringify!($get), nvr))
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $set(c: Fmi2Component, _vr: *const u32, nvr: usize, _value: *const $type) -> i32 {
            with(c, |_| none_of_type(stringify!($set), nvr))
        }
    )*};
}

fn none_of_type(function: &str, count: usize) -> CallAnswer {
    if count == 0 {
        return Ok(CallStatus::Ok);
    }
    Err(refused(format!("{function}: all variables of the unit are of the type Real")))
}

other_types! {
    fmi2GetInteger fmi2SetInteger c_int;
    fmi2GetBoolean fmi2SetBoolean c_int;
    fmi2GetString fmi2SetString *const c_char;
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: Fmi2Component, FMUstate: *mut Fmi2State) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3GetFMUState(c, FMUstate) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: Fmi2Component, FMUstate: Fmi2State) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3SetFMUState(c, FMUstate) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: Fmi2Component, FMUstate: *mut Fmi2State) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3FreeFMUState(c, FMUstate) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    c: Fmi2Component,
    FMUstate: Fmi2State,
    size: *mut usize,
) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3SerializedFMUStateSize(c, FMUstate, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: Fmi2Component,
    FMUstate: Fmi2State,
    serializedState: *mut u8,
    size: usize,
) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3SerializeFMUState(c, FMUstate, serializedState, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: Fmi2Component,
    serializedState: *const u8,
    size: usize,
    FMUstate: *mut Fmi2State,
) -> i32 {
    // SAFETY: as there.
    unsafe { fmi3::fmi3DeserializeFMUState(c, serializedState, size, FMUstate) }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(
    c: Fmi2Component,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: c_int,
) -> i32 {
    with(c, |handle| {
        let found = handle.instance.step(currentCommunicationPoint, communicationStepSize);
        handle.is_ended = found.as_ref().is_ok_and(|stepped| stepped.is_ended);
        let warning = found?.warning.map(|words| handle.warn(&words));
        if handle.is_ended {
            return Ok(CallStatus::Discard); // what FMI 2.0 says of a unit that ends the simulation
        }
        Ok(warning.unwrap_or(CallStatus::Ok))
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2CancelStep(c: Fmi2Component) -> i32 {
    with(c, |_| absent("fmi2CancelStep"))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: Fmi2Component, s: c_int, value: *mut f64) -> i32 {
    with(c, |handle| match s {
        LAST_SUCCESSFUL_TIME => {
            // SAFETY: the place of a result.
            unsafe { put(value, handle.instance.time()) }
            Ok(CallStatus::Ok)
        }
        _ => absent("fmi2GetRealStatus"),
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: Fmi2Component, s: c_int, value: *mut c_int) -> i32 {
    with(c, |handle| match s {
        TERMINATED => {
            // SAFETY: the place of a result.
            unsafe { put(value, c_int::from(handle.is_ended)) }
            Ok(CallStatus::Ok)
        }
        _ => absent("fmi2GetBooleanStatus"),
    })
}

/// Kinds of status.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

/// Functions of what the unit does not have: they refuse.
macro_rules! absent_functions {
    ($($name:ident($($type:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(c: Fmi2Component $(, _: $type)*) -> i32 {
            with(c, |_| absent(stringify!($name)))
        }
    )*};
}

absent_functions! {
    fmi2GetDirectionalDerivative(*const u32, usize, *const u32, usize, *const f64, *mut f64);
    fmi2SetRealInputDerivatives(*const u32, usize, *const c_int, *const f64);
    fmi2GetRealOutputDerivatives(*const u32, usize, *const c_int, *mut f64);
    fmi2GetStatus(c_int, *mut c_int);
    fmi2GetIntegerStatus(c_int, *mut c_int);
    fmi2GetStringStatus(c_int, *mut *const c_char);
    fmi2EnterEventMode();
    fmi2NewDiscreteStates(*mut c_void);
    fmi2EnterContinuousTimeMode();
    fmi2CompletedIntegratorStep(c_int, *mut c_int, *mut c_int);
    fmi2SetTime(f64);
    fmi2SetContinuousStates(*const f64, usize);
    fmi2GetDerivatives(*mut f64, usize);
    fmi2GetEventIndicators(*mut f64, usize);
    fmi2GetContinuousStates(*mut f64, usize);
    fmi2GetNominalsOfContinuousStates(*mut f64, usize);
}
