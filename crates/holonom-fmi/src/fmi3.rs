//! The functions of FMI 3.0.
//!
//! # Safety
//! Pointers are those that the standard demands: lists as long as is said, words that end with a
//! zero, instances and states of this library that were not freed; one call at a time for an
//! instance. Null is refused.

use crate::handle::{CallAnswer, Handle, Log, CallStatus, absent, null, refused};
use crate::pointers::{free, kept, list, list_mut, of, put, words};
use holonom_fmu::{Instance, SavedState};
use std::ffi::{CString, c_char, c_void};

type InstanceId = *mut c_void;
type Fmi3State = *mut c_void;
type LogMessage = Option<unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char)>;

pub(crate) fn with(instance: InstanceId, call: impl FnOnce(&mut Handle) -> CallAnswer) -> i32 {
    // SAFETY: the instance is one of this library.
    match unsafe { of::<Handle>(instance) } {
        Some(handle) => handle.call(call) as i32,
        None => CallStatus::Error as i32,
    }
}

fn logger(environment: *mut c_void, log: LogMessage) -> Log {
    Box::new(move |status, category, message| {
        let (Some(log), Ok(category)) = (log, CString::new(category)) else { return };
        let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
        // SAFETY: the callback of the tool, which lives as long as the instance.
        unsafe { log(environment, status as i32, category.as_ptr(), message.as_ptr()) }
    })
}

fn refuse_instance(environment: *mut c_void, log: LogMessage, words: &str) -> InstanceId {
    let log = logger(environment, log);
    Handle::new(|| Err(words.to_owned()), log, false);
    std::ptr::null_mut()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    instance: InstanceId,
    loggingOn: bool,
    _nCategories: usize,
    _categories: *const *const c_char,
) -> i32 {
    with(instance, |handle| {
        handle.set_verbose(loggingOn);
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _instanceName: *const c_char,
    _instantiationToken: *const c_char,
    _resourcePath: *const c_char,
    _visible: bool,
    _loggingOn: bool,
    instanceEnvironment: *mut c_void,
    logMessage: LogMessage,
) -> InstanceId {
    let words = "the unit is one of co-simulation, not of model exchange";
    refuse_instance(instanceEnvironment, logMessage, words)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _instanceName: *const c_char,
    _instantiationToken: *const c_char,
    _resourcePath: *const c_char,
    _visible: bool,
    _loggingOn: bool,
    instanceEnvironment: *mut c_void,
    logMessage: LogMessage,
    _clockUpdate: *const c_void,
    _lockPreemption: *const c_void,
    _unlockPreemption: *const c_void,
) -> InstanceId {
    let words = "the unit is one of co-simulation, not of scheduled execution";
    refuse_instance(instanceEnvironment, logMessage, words)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    _visible: bool,
    loggingOn: bool,
    eventModeUsed: bool,
    _earlyReturnAllowed: bool,
    _requiredIntermediateVariables: *const u32,
    nRequiredIntermediateVariables: usize,
    instanceEnvironment: *mut c_void,
    logMessage: LogMessage,
    _intermediateUpdate: *const c_void,
) -> InstanceId {
    // SAFETY: words of the tool.
    let (token, path) = unsafe { (words(instantiationToken), words(resourcePath)) };
    let make = move || {
        if eventModeUsed || nRequiredIntermediateVariables > 0 {
            return Err("the unit has neither an event mode nor intermediate variables".to_owned());
        }
        let path = path.ok_or("the path of the resources is missing")?;
        let token = token.ok_or("the instantiation token is missing")?;
        let path = match path.starts_with("file:") {
            true => holonom_fmu::resources::folder_of_address(&path),
            false => path.into(),
        };
        Instance::new(&path, &token)
    };
    match Handle::new(make, logger(instanceEnvironment, logMessage), loggingOn) {
        Some(handle) => kept(handle),
        None => std::ptr::null_mut(),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: InstanceId) {
    // SAFETY: an instance of this library, which the tool does not use any more.
    unsafe { free::<Handle>(instance) }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    instance: InstanceId,
    _toleranceDefined: bool,
    _tolerance: f64,
    startTime: f64,
    _stopTimeDefined: bool,
    _stopTime: f64,
) -> i32 {
    with(instance, |handle| {
        handle.instance.enter_initialization(startTime)?;
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3ExitInitializationMode(instance: InstanceId) -> i32 {
    with(instance, |handle| {
        let warnings = handle.instance.exit_initialization()?;
        for words in &warnings {
            handle.warn(words);
        }
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Terminate(instance: InstanceId) -> i32 {
    with(instance, |handle| handle.instance.terminate().map(|()| CallStatus::Ok))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Reset(instance: InstanceId) -> i32 {
    with(instance, |handle| {
        handle.instance.reset();
        (handle.is_ended, handle.start) = (false, 0.0);
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: InstanceId,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut f64,
    nValues: usize,
) -> i32 {
    with(instance, |handle| {
        // SAFETY: lists of the tool.
        let (references, values) =
            unsafe { (list(valueReferences, nValueReferences), list_mut(values, nValues)) };
        let (references, values) = references.zip(values).ok_or_else(null)?;
        same_count(references, values)?;
        handle.instance.get(references, values).map(|()| CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: InstanceId,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const f64,
    nValues: usize,
) -> i32 {
    with(instance, |handle| {
        // SAFETY: lists of the tool.
        let (references, values) =
            unsafe { (list(valueReferences, nValueReferences), list(values, nValues)) };
        let (references, values) = references.zip(values).ok_or_else(null)?;
        same_count(references, values)?;
        handle.instance.set(references, values).map(|()| CallStatus::Ok)
    })
}

fn same_count(references: &[u32], values: &[f64]) -> Result<(), holonom_fmu::UnitRefusal> {
    let (n, m) = (references.len(), values.len());
    if n == m {
        return Ok(());
    }
    Err(refused(format!("{n} value references and {m} values: each variable has one value")))
}

/// Getters and setters of types that no variable has: an empty list is right.
macro_rules! other_types {
    ($($get:ident $set:ident $type:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $get(
            instance: InstanceId,
            _valueReferences: *const u32,
            nValueReferences: usize,
            _values: *mut $type,
            _nValues: usize,
        ) -> i32 {
            with(instance, |_| none_of_type(stringify!($get), nValueReferences))
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $set(
            instance: InstanceId,
            _valueReferences: *const u32,
            nValueReferences: usize,
            _values: *const $type,
            _nValues: usize,
        ) -> i32 {
            with(instance, |_| none_of_type(stringify!($set), nValueReferences))
        }
    )*};
}

fn none_of_type(function: &str, count: usize) -> CallAnswer {
    if count == 0 {
        return Ok(CallStatus::Ok);
    }
    Err(refused(format!("{function}: all variables of the unit are of the type Float64")))
}

other_types! {
    fmi3GetFloat32 fmi3SetFloat32 f32;
    fmi3GetInt8 fmi3SetInt8 i8;
    fmi3GetUInt8 fmi3SetUInt8 u8;
    fmi3GetInt16 fmi3SetInt16 i16;
    fmi3GetUInt16 fmi3SetUInt16 u16;
    fmi3GetInt32 fmi3SetInt32 i32;
    fmi3GetUInt32 fmi3SetUInt32 u32;
    fmi3GetInt64 fmi3SetInt64 i64;
    fmi3GetUInt64 fmi3SetUInt64 u64;
    fmi3GetBoolean fmi3SetBoolean bool;
    fmi3GetString fmi3SetString *const c_char;
}

/// Functions of what the unit does not have: they refuse.
macro_rules! absent_functions {
    ($($name:ident($($type:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(instance: InstanceId $(, _: $type)*) -> i32 {
            with(instance, |_| absent(stringify!($name)))
        }
    )*};
}

absent_functions! {
    fmi3GetBinary(*const u32, usize, *mut usize, *mut *const u8, usize);
    fmi3SetBinary(*const u32, usize, *const usize, *const *const u8, usize);
    fmi3GetClock(*const u32, usize, *mut bool);
    fmi3SetClock(*const u32, usize, *const bool);
    fmi3EnterEventMode();
    fmi3GetNumberOfVariableDependencies(u32, *mut usize);
    fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut i32, usize);
    fmi3GetDirectionalDerivative(*const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize);
    fmi3GetAdjointDerivative(*const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3GetIntervalDecimal(*const u32, usize, *mut f64, *mut i32);
    fmi3GetIntervalFraction(*const u32, usize, *mut u64, *mut u64, *mut i32);
    fmi3GetShiftDecimal(*const u32, usize, *mut f64);
    fmi3GetShiftFraction(*const u32, usize, *mut u64, *mut u64);
    fmi3SetIntervalDecimal(*const u32, usize, *const f64);
    fmi3SetIntervalFraction(*const u32, usize, *const u64, *const u64);
    fmi3SetShiftDecimal(*const u32, usize, *const f64);
    fmi3SetShiftFraction(*const u32, usize, *const u64, *const u64);
    fmi3EvaluateDiscreteStates();
    fmi3UpdateDiscreteStates(*mut bool, *mut bool, *mut bool, *mut bool, *mut bool, *mut f64);
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool);
    fmi3SetTime(f64);
    fmi3SetContinuousStates(*const f64, usize);
    fmi3GetContinuousStateDerivatives(*mut f64, usize);
    fmi3GetEventIndicators(*mut f64, usize);
    fmi3GetContinuousStates(*mut f64, usize);
    fmi3GetNominalsOfContinuousStates(*mut f64, usize);
    fmi3GetNumberOfEventIndicators(*mut usize);
    fmi3GetNumberOfContinuousStates(*mut usize);
    fmi3EnterStepMode();
    fmi3GetOutputDerivatives(*const u32, usize, *const i32, *mut f64, usize);
    fmi3ActivateModelPartition(u32, f64);
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: InstanceId, FMUState: *mut Fmi3State) -> i32 {
    with(instance, |handle| {
        // SAFETY: the place of a state, null or of this library.
        let place = unsafe { FMUState.as_mut() }.ok_or_else(null)?;
        let state = handle.instance.state()?;
        // SAFETY: as before.
        match unsafe { of::<SavedState>(*place) } {
            Some(known) => *known = state,
            None => *place = kept(state),
        }
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: InstanceId, FMUState: Fmi3State) -> i32 {
    with(instance, |handle| {
        // SAFETY: a state of this library.
        let state = unsafe { of::<SavedState>(FMUState) }.ok_or_else(null)?;
        handle.instance.resume(state)?;
        handle.is_ended = false;
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: InstanceId, FMUState: *mut Fmi3State) -> i32 {
    with(instance, |_| {
        // SAFETY: the place of a state of this library, which the tool does not use any more.
        if let Some(place) = unsafe { FMUState.as_mut() } {
            // SAFETY: as before.
            unsafe { free::<SavedState>(*place) }
            *place = std::ptr::null_mut();
        }
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    instance: InstanceId,
    FMUState: Fmi3State,
    size: *mut usize,
) -> i32 {
    with(instance, |handle| {
        // SAFETY: a state of this library.
        let state = unsafe { of::<SavedState>(FMUState) }.ok_or_else(null)?;
        let bytes = handle.instance.bytes_of(state)?;
        // SAFETY: the place of a number.
        unsafe { put(size, bytes.len()) }
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    instance: InstanceId,
    FMUState: Fmi3State,
    serializedState: *mut u8,
    size: usize,
) -> i32 {
    with(instance, |handle| {
        // SAFETY: a state of this library, a list of the tool.
        let (state, out) = unsafe { (of::<SavedState>(FMUState), list_mut(serializedState, size)) };
        let (state, out) = state.zip(out).ok_or_else(null)?;
        let bytes = handle.instance.bytes_of(state)?;
        if out.len() < bytes.len() {
            let needed = bytes.len();
            return Err(refused(format!("the state takes {needed} bytes, and there are {size}")));
        }
        out[..bytes.len()].copy_from_slice(&bytes);
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    instance: InstanceId,
    serializedState: *const u8,
    size: usize,
    FMUState: *mut Fmi3State,
) -> i32 {
    with(instance, |handle| {
        // SAFETY: a list of the tool, the place of a state.
        let (bytes, place) = unsafe { (list(serializedState, size), FMUState.as_mut()) };
        let (bytes, place) = bytes.zip(place).ok_or_else(null)?;
        *place = kept(handle.instance.state_of(bytes)?);
        Ok(CallStatus::Ok)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: InstanceId,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: bool,
    eventHandlingNeeded: *mut bool,
    terminateSimulation: *mut bool,
    earlyReturn: *mut bool,
    lastSuccessfulTime: *mut f64,
) -> i32 {
    with(instance, |handle| {
        let found = handle.instance.step(currentCommunicationPoint, communicationStepSize);
        handle.is_ended = found.as_ref().is_ok_and(|stepped| stepped.is_ended);
        // SAFETY: places of results.
        unsafe {
            put(eventHandlingNeeded, false);
            put(terminateSimulation, handle.is_ended);
            put(earlyReturn, false);
            put(lastSuccessfulTime, handle.instance.time());
        }
        Ok(found?.warning.map_or(CallStatus::Ok, |words| handle.warn(&words)))
    })
}
