#pragma once
/// The C symbols that every perikit library exports. They are read and compared before any C++ object crosses the boundary.
///
///   int         perikit_abi_version()     equals PERIKIT_ABI_VERSION
///   const char* perikit_build_id()        compiler, C++ library ABI, level of the processor, SIMD width, hash of the public headers: see PERIKIT_BUILD_ID
///   void        perikit_register(void*)   called with a perikit::Registrar*
///
/// PERIKIT_PLUGIN(registrar) { registrar.material({...}, ...); } writes all three.

#include "perikit/core/simd.hpp"
#include "perikit/plugin/headers_id.hpp"
#include "perikit/plugin/part.hpp"

/// Raised whenever a released public class changes its layout or its virtual functions. Between releases the hash in the build id
/// keeps libraries of other headers out.
#define PERIKIT_ABI_VERSION 4

#define PERIKIT_STRINGIFY_(x) #x
#define PERIKIT_STRINGIFY(x) PERIKIT_STRINGIFY_(x)

/// The level of the architecture that this is compiled for. Program and parts must be of one level: they share packs of numbers and inline
/// functions, and of a mixture nobody has tested anything.
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#define PERIKIT_ARCHITECTURE "x86-64-v4"
#elif defined(__AVX2__) && defined(__BMI__) && defined(__BMI2__) && defined(__F16C__) && defined(__FMA__) && defined(__LZCNT__) && defined(__MOVBE__)
#define PERIKIT_ARCHITECTURE "x86-64-v3"
#elif defined(__SSE4_2__) && defined(__SSSE3__) && defined(__POPCNT__)
#define PERIKIT_ARCHITECTURE "x86-64-v2"
#elif defined(__x86_64__)
#define PERIKIT_ARCHITECTURE "x86-64"
#elif defined(__aarch64__)
#define PERIKIT_ARCHITECTURE "armv" PERIKIT_STRINGIFY(__ARM_ARCH) "-a"
#else
#define PERIKIT_ARCHITECTURE "unknown"
#endif
#if defined(PERIKIT_NATIVE)
#define PERIKIT_LEVEL "native-" PERIKIT_ARCHITECTURE   // for one processor
#else
#define PERIKIT_LEVEL PERIKIT_ARCHITECTURE
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define PERIKIT_SIMD_ID "simd512"
#elif defined(__AVX__)
#define PERIKIT_SIMD_ID "simd256"
#else
#define PERIKIT_SIMD_ID "simd128"
#endif

#if defined(__GLIBCXX__)
#define PERIKIT_STDLIB_ID "libstdc++-cxx11abi" PERIKIT_STRINGIFY(_GLIBCXX_USE_CXX11_ABI)
#else
#define PERIKIT_STDLIB_ID "other-stdlib"
#endif

#if defined(__clang__)
#define PERIKIT_COMPILER_ID "clang" PERIKIT_STRINGIFY(__clang_major__)
#else
#define PERIKIT_COMPILER_ID "gcc" PERIKIT_STRINGIFY(__GNUC__)
#endif

#define PERIKIT_TOOLCHAIN_ID PERIKIT_COMPILER_ID " " PERIKIT_STDLIB_ID " " PERIKIT_LEVEL " " PERIKIT_SIMD_ID
/// As in "gcc12 libstdc++-cxx11abi1 x86-64-v4 simd512 headers-0123456789ab".
#define PERIKIT_BUILD_ID PERIKIT_TOOLCHAIN_ID " headers-" PERIKIT_HEADERS_ID

#define PERIKIT_EXPORT extern "C" __attribute__((visibility("default")))

#define PERIKIT_PLUGIN(registrar)                                                                             \
  static void perikit_register_parts(::perikit::Registrar& registrar);                                       \
  PERIKIT_EXPORT int perikit_abi_version() { return PERIKIT_ABI_VERSION; }                                    \
  PERIKIT_EXPORT const char* perikit_build_id() { return PERIKIT_BUILD_ID; }                                  \
  PERIKIT_EXPORT void perikit_register(void* opaque) {                                                        \
    perikit_register_parts(*static_cast<::perikit::Registrar*>(opaque));                                      \
  }                                                                                                           \
  static void perikit_register_parts(::perikit::Registrar& registrar)
