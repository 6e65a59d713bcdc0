#pragma once

namespace perikit {

/// A <- its nearest positive semidefinite matrix: negative eigenvalues become zero. A: symmetric, n x n. Untouched where there are none.
void make_semidefinite(double* A, int n);

}  // namespace perikit
