//! Embree's error codes in words.

use super::abi;
use std::ffi::c_int;

/// One line for an error code, which may be newer than we are, and what Embree says about it.
pub(super) fn error_text(code: c_int, text: &str) -> String {
    let name = match code as u32 {
        abi::SATO_ERROR_INVALID_ARGUMENT => "invalid argument",
        abi::SATO_ERROR_INVALID_OPERATION => "invalid operation",
        abi::SATO_ERROR_OUT_OF_MEMORY => "out of memory",
        abi::SATO_ERROR_UNSUPPORTED_CPU => "unsupported CPU",
        abi::SATO_ERROR_CANCELLED => "cancelled",
        abi::SATO_ERROR_LEVEL_ZERO_RAYTRACING_SUPPORT_MISSING => "no GPU ray-tracing support",
        _ => "unknown error",
    };
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let colon = if text.is_empty() { "" } else { ": " };
    format!("Embree: {name} (code {code}){colon}{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_even_if_embree_is_newer_than_we_are() {
        assert_eq!(error_text(4, "bad\nalloc"), "Embree: out of memory (code 4): bad alloc");
        assert!(error_text(7, "").starts_with("Embree: no GPU"));
        assert_eq!(error_text(99, ""), "Embree: unknown error (code 99)");
    }
}
