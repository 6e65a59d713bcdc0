#pragma once
/// Eigen, where its matrices have no fixed small size. Its kernels for AVX-512 begin with registers that the compiler's own header
/// leaves undefined on purpose (_mm512_undefined_pd), which g++ 12 takes for values that were forgotten (GCC bug 105593).

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <Eigen/Dense>
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
