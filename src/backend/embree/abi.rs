//! The Embree 4.4 binary interface of `vendor-headers/embree4_abi.h`, and the compile-time proof
//! that the embree4-sys items used by [`ffi`](super::ffi) agree with it.

#[allow(
    unsafe_code,
    missing_docs,
    unreachable_pub,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    dead_code
)]
mod bindings {
    include!(concat!(env!("OUT_DIR"), "/embree4_abi.rs"));
}

pub(super) use bindings::*;

/// Same size, alignment and field offsets.
macro_rules! same_layout {
    ($($name:ident { $($field:ident)* })*) => {
        $(const _: () = {
            use core::mem::{align_of, offset_of, size_of};
            assert!(size_of::<embree4_sys::$name>() == size_of::<$name>());
            assert!(align_of::<embree4_sys::$name>() == align_of::<$name>());
            $(assert!(offset_of!(embree4_sys::$name, $field) == offset_of!($name, $field));)*
        };)*
    };
}

same_layout! {
    RTCRay { org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags }
    RTCRay4 { org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags }
    RTCRay8 { org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags }
    RTCRay16 { org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags }
    RTCOccludedArguments { flags feature_mask context filter occluded }
    RTCIntersectArguments { flags feature_mask context filter intersect }
    RTCBounds { lower_x lower_y lower_z align0 upper_x upper_y upper_z align1 }
}

// Why rtcIntersect1 is called with our struct: embree4-sys's lacks instPrimID, which Embree writes.
const _: () = {
    use core::mem::{offset_of, size_of};
    assert!(size_of::<embree4_sys::RTCRayHit>() < size_of::<RTCRayHit>());
    assert!(offset_of!(embree4_sys::RTCRayHit, hit) == offset_of!(RTCRayHit, hit));
    assert!(offset_of!(RTCHit, instPrimID) == 32 && size_of::<RTCHit>() == 48);
};

macro_rules! same_value {
    ($($theirs:expr => $ours:ident,)*) => {
        $(const _: () = assert!($theirs as u32 == $ours);)*
    };
}

use embree4_sys::{
    RTCBufferType, RTCBuildQuality, RTCDeviceProperty, RTCFeatureFlags, RTCFormat, RTCGeometryType,
    RTCRayQueryFlags, RTCSceneFlags,
};

same_value! {
    embree4_sys::RTC_INVALID_GEOMETRY_ID => SATO_INVALID_ID,
    RTCFormat::UINT3 => SATO_FORMAT_UINT3,
    RTCFormat::FLOAT3 => SATO_FORMAT_FLOAT3,
    RTCBufferType::INDEX => SATO_BUFFER_TYPE_INDEX,
    RTCBufferType::VERTEX => SATO_BUFFER_TYPE_VERTEX,
    RTCGeometryType::TRIANGLE => SATO_GEOMETRY_TYPE_TRIANGLE,
    RTCBuildQuality::LOW => SATO_BUILD_QUALITY_LOW,
    RTCBuildQuality::MEDIUM => SATO_BUILD_QUALITY_MEDIUM,
    RTCBuildQuality::HIGH => SATO_BUILD_QUALITY_HIGH,
    RTCBuildQuality::REFIT => SATO_BUILD_QUALITY_REFIT,
    RTCSceneFlags::NONE.0 => SATO_SCENE_FLAG_NONE,
    RTCSceneFlags::DYNAMIC.0 => SATO_SCENE_FLAG_DYNAMIC,
    RTCSceneFlags::ROBUST.0 => SATO_SCENE_FLAG_ROBUST,
    RTCRayQueryFlags::INCOHERENT.0 => SATO_RAY_QUERY_FLAG_INCOHERENT,
    RTCRayQueryFlags::COHERENT.0 => SATO_RAY_QUERY_FLAG_COHERENT,
    RTCFeatureFlags::RTC_FEATURE_FLAG_ALL.0 => SATO_FEATURE_FLAG_ALL,
    RTCDeviceProperty::VERSION_MAJOR => SATO_DEVICE_PROPERTY_VERSION_MAJOR,
    RTCDeviceProperty::VERSION_MINOR => SATO_DEVICE_PROPERTY_VERSION_MINOR,
    RTCDeviceProperty::VERSION_PATCH => SATO_DEVICE_PROPERTY_VERSION_PATCH,
    RTCDeviceProperty::NATIVE_RAY4_SUPPORTED => SATO_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED,
    RTCDeviceProperty::NATIVE_RAY8_SUPPORTED => SATO_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED,
    RTCDeviceProperty::NATIVE_RAY16_SUPPORTED => SATO_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED,
    RTCDeviceProperty::TASKING_SYSTEM => SATO_DEVICE_PROPERTY_TASKING_SYSTEM,
}
