#pragma once
/// Symmetric d x d shape tensors K and their inverses, stored as xx | xx yy xy | xx yy zz xy xz yz.

namespace perikit {

constexpr int symmetric_components(int d) noexcept { return d * (d + 1) / 2; }

/// Position of entry (a, b) in the storage above.
constexpr int symmetric_index(int d, int a, int b) noexcept {
  if (a == b) return a;
  return d == 2 ? 2 : 2 + a + b;
}

/// Limits lie a hair below round numbers: what is left of the families of lattices is often exactly a tenth or a twentieth of them, and rounding must not choose.
constexpr double hair_below(double limit) { return limit * (1 - 1e-9); }

/// K is singular when its eigenvalues spread by more than this: the family spans no volume up to rounding of the positions.
inline constexpr double singular_ratio = 1e-8;
/// Parts and domains of bonds are ill conditioned when the eigenvalues of K spread by more than this (they lie almost in a plane or
/// on a line, 30 times as long as thick): their gradients magnify noise as much.
inline constexpr double poor_ratio = hair_below(1e-3);

/// A part is also ill conditioned when its eigenvalues spread by more than this times those of its whole family: a needle in a
/// family that is none. Near the surfaces of clouds such parts are stiffer than all others and set the stable step. The parts of
/// lattices, also one layer below a surface and at a horizon of five spacings, spread by less.
inline constexpr double part_ratio = hair_below(0.05);

/// The same of domains of bonds, which lie ahead of their point and are leaner than parts: those of a lattice, the smallest ones of half a horizon
/// too, spread by less.
inline constexpr double domain_ratio = hair_below(0.02);

/// Smallest eigenvalue of K over the largest one; 0 where K is zero.
double eigenvalue_ratio(int d, const double* K);

/// Inverse of K by its eigen-decomposition; zero, and false, where K is singular. condition: ratio of its eigenvalues.
bool invert_shape(int d, const double* K, double* inverse, double* condition = nullptr);

/// What broken bonds leave of the shape tensor of a whole family, in its weakest direction: the smallest eigenvalue of K relative to
/// `whole`, in [0, 1]. 0 where either is singular.
double shape_support(int d, const double* K, const double* whole);

/// A point whose family is left with less support than this is a fragment: it loses its other bonds too. The family of a corner keeps 1/4 in
/// a plane and 1/8 in space; with less there is no continuum around the point whose gradient its few bonds could measure.
inline constexpr double least_support = hair_below(0.1);
/// A fragment that failed bonds have left with less of its uncut shape tensor than this (shape_support) has no gradient: its bonds lie almost on a line,
/// and would magnify what they see ten to a thousand times, as long as they fade or for good where they may not fail. With more it keeps its gradient
/// while they fade: in nearly incompressible bodies what jumps costs more than it held.
inline constexpr double needle_support = hair_below(0.01);

}  // namespace perikit
