//! Lists, words and results behind pointers of the tool. Null stands for an empty list.

use std::ffi::{CStr, c_char};

/// The list of `count` values.
///
/// # Safety
/// A pointer that is not null has so many values.
pub unsafe fn list<'a, T>(values: *const T, count: usize) -> Option<&'a [T]> {
    match (values.is_null(), count) {
        (_, 0) => Some(&[]),
        (true, _) => None,
        // SAFETY: as promised.
        (false, _) => Some(unsafe { std::slice::from_raw_parts(values, count) }),
    }
}

/// The list of `count` values that are written.
///
/// # Safety
/// A pointer that is not null has so many values, which nothing else reads or writes meanwhile.
pub unsafe fn list_mut<'a, T>(values: *mut T, count: usize) -> Option<&'a mut [T]> {
    match (values.is_null(), count) {
        (_, 0) => Some(&mut []),
        (true, _) => None,
        // SAFETY: as promised.
        (false, _) => Some(unsafe { std::slice::from_raw_parts_mut(values, count) }),
    }
}

/// Words; letters that are not UTF-8 are replaced.
///
/// # Safety
/// A pointer that is not null ends with a zero.
pub unsafe fn words(words: *const c_char) -> Option<String> {
    if words.is_null() {
        return None;
    }
    // SAFETY: as promised.
    Some(unsafe { CStr::from_ptr(words) }.to_string_lossy().into_owned())
}

/// Writes a result where it is wanted.
///
/// # Safety
/// A pointer that is not null can be written.
pub unsafe fn put<T>(place: *mut T, value: T) {
    if !place.is_null() {
        // SAFETY: as promised.
        unsafe { place.write(value) }
    }
}

/// The value behind a pointer, to be used by one call at a time.
///
/// # Safety
/// A pointer that is not null is that of a [`Box`] of this type that was not freed.
pub unsafe fn of<'a, T>(place: *mut std::ffi::c_void) -> Option<&'a mut T> {
    // SAFETY: as promised.
    unsafe { place.cast::<T>().as_mut() }
}

/// A value that lives until it is freed.
pub fn kept<T>(value: T) -> *mut std::ffi::c_void {
    Box::into_raw(Box::new(value)).cast()
}

/// Frees a value.
///
/// # Safety
/// A pointer that is not null comes from [`kept`] with this type, and is not used any more.
pub unsafe fn free<T>(place: *mut std::ffi::c_void) {
    if !place.is_null() {
        // SAFETY: as promised.
        drop(unsafe { Box::from_raw(place.cast::<T>()) });
    }
}
