#pragma once
/// Derivatives by differences, which exact ones are compared with.

namespace perikit::test {

/// f'(0) by central differences of order four: exact to rounding for polynomials up to degree 4, such as the energy of Saint Venant-Kirchhoff along a
/// line of displacements.
template <class Function>
auto slope_of(const Function& f, double h) {
  using Value = decltype(f(h));   // of expressions of Eigen, too
  return Value((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h));
}

}  // namespace perikit::test
