/* The parts of the Embree 4.4 binary interface that sato relies on, in our own words.
 *
 * build.rs runs bindgen over this file. src/backend/embree/abi.rs holds every struct and constant
 * that is used through the embree4-sys crate against it at compile time; what that crate gets wrong
 * for Embree 4.4 is declared here and called from here:
 *
 *  - Embree 4.4 may report error 7, which the crate's Rust enum RTCError (0 to 6) cannot hold. All
 *    error codes below are plain integers.
 *  - Since instance arrays came (RTC_GEOMETRY_INSTANCE_ARRAY, on by default), a hit also has a field
 *    instPrimID. The crate's RTCHit ends before it, so rtcIntersect1 would write past the crate's
 *    RTCRayHit. Older Embree 4 leaves that tail of ours untouched.
 *
 * No includes: a libclang without its own headers can read this.
 */
#ifndef SATO_EMBREE4_ABI_H
#define SATO_EMBREE4_ABI_H

#define SATO_ALIGNED(bytes) __attribute__((aligned(bytes)))

/* Handles are pointers to things that only Embree knows. */
typedef void *SatoHandle;

/* Rays. tfar becomes -infinity where something is in the way. */

struct SATO_ALIGNED(16) RTCRay {
  float org_x, org_y, org_z, tnear;
  float dir_x, dir_y, dir_z, time;
  float tfar;
  unsigned mask, id, flags;
};

#define SATO_RAY_PACKET(width, alignment)                             \
  struct SATO_ALIGNED(alignment) RTCRay##width {                      \
    float org_x[width], org_y[width], org_z[width], tnear[width];     \
    float dir_x[width], dir_y[width], dir_z[width], time[width];      \
    float tfar[width];                                                \
    unsigned mask[width], id[width], flags[width];                    \
  }

SATO_RAY_PACKET(4, 16);
SATO_RAY_PACKET(8, 32);
SATO_RAY_PACKET(16, 64);

/* Hits, for one level of instances. */

struct SATO_ALIGNED(16) RTCHit {
  float Ng_x, Ng_y, Ng_z;
  float u, v;
  unsigned primID, geomID;
  unsigned instID[1];
  unsigned instPrimID[1];
};

struct RTCRayHit {
  struct RTCRay ray;
  struct RTCHit hit;
};

/* Query arguments. The callbacks are never set here. */

struct RTCIntersectArguments {
  unsigned flags;
  unsigned feature_mask;
  void *context;
  void (*filter)(const void *arguments);
  void (*intersect)(const void *arguments);
};

struct RTCOccludedArguments {
  unsigned flags;
  unsigned feature_mask;
  void *context;
  void (*filter)(const void *arguments);
  void (*occluded)(const void *arguments);
};

/* Boxes. */

struct SATO_ALIGNED(16) RTCBounds {
  float lower_x, lower_y, lower_z, align0;
  float upper_x, upper_y, upper_z, align1;
};

/* Constants. */

enum {
  SATO_INVALID_ID = 0xffffffffu,

  SATO_ERROR_NONE = 0,
  SATO_ERROR_UNKNOWN = 1,
  SATO_ERROR_INVALID_ARGUMENT = 2,
  SATO_ERROR_INVALID_OPERATION = 3,
  SATO_ERROR_OUT_OF_MEMORY = 4,
  SATO_ERROR_UNSUPPORTED_CPU = 5,
  SATO_ERROR_CANCELLED = 6,
  SATO_ERROR_LEVEL_ZERO_RAYTRACING_SUPPORT_MISSING = 7,

  SATO_FORMAT_UINT3 = 0x5003,
  SATO_FORMAT_FLOAT3 = 0x9003,

  SATO_BUFFER_TYPE_INDEX = 0,
  SATO_BUFFER_TYPE_VERTEX = 1,

  SATO_GEOMETRY_TYPE_TRIANGLE = 0,

  SATO_BUILD_QUALITY_LOW = 0,
  SATO_BUILD_QUALITY_MEDIUM = 1,
  SATO_BUILD_QUALITY_HIGH = 2,
  SATO_BUILD_QUALITY_REFIT = 3,

  SATO_SCENE_FLAG_NONE = 0,
  SATO_SCENE_FLAG_DYNAMIC = 1 << 0,
  SATO_SCENE_FLAG_ROBUST = 1 << 2,

  SATO_RAY_QUERY_FLAG_INCOHERENT = 0,
  SATO_RAY_QUERY_FLAG_COHERENT = 1 << 16,

  SATO_FEATURE_FLAG_ALL = 0xffffffffu,

  SATO_DEVICE_PROPERTY_VERSION_MAJOR = 1,
  SATO_DEVICE_PROPERTY_VERSION_MINOR = 2,
  SATO_DEVICE_PROPERTY_VERSION_PATCH = 3,
  SATO_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED = 32,
  SATO_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED = 33,
  SATO_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED = 34,
  SATO_DEVICE_PROPERTY_TASKING_SYSTEM = 128
};

/* Calls whose embree4-sys declarations do not fit Embree 4.4. */

int rtcGetDeviceError(SatoHandle device);

typedef void (*SatoErrorFunction)(void *user, int code, const char *text);
void rtcSetDeviceErrorFunction(SatoHandle device, SatoErrorFunction report, void *user);

void rtcIntersect1(SatoHandle scene, struct RTCRayHit *rayhit, struct RTCIntersectArguments *args);

#endif
