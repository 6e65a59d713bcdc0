#pragma once
/// Bodies, scenes and random fields that the contract suites share.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "model/formulation.hpp"
#include "plugin/registry.hpp"
#include "run/simulation.hpp"

namespace perikit::contract {

/// The registry of the suite, and the parts to test (all known ones, or those of the command line).
struct Subject {
  Registry registry;
  std::vector<std::pair<Kind, std::string>> parts;
  bool third_party = false;  ///< parts of a library that is not of this build
};
Subject& subject();

/// Every part to test of one kind with each of its example tables (at least one run a part).
struct Example {
  std::string part;
  std::string table;   ///< TOML keys without `type`
  std::string stabilization = {};   ///< of a kinematics: its inline table, or empty
  bool keeps_angular_momentum = true;
};
std::vector<Example> examples(Kind kind);
/// By how much more than rounding what is compared of two bodies may differ: factors on the bonds of pair laws are found by iterations, to about 1e-12.
double of_iterations(const Example& example);
/// Examples of kinematics, and `conventional` with every example of the stabilizations to test.
std::vector<Example> kinematics_examples();

/// What a test body looks like. Spacing is 1 unless scaled.
struct BodyOptions {
  int dimension = 3;
  bool cloud = false;       ///< jittered
  bool consistent = false;  ///< [family]
  bool crack = false;       ///< about a tenth of the bonds cut
  bool tongues = false;     ///< rods and (3D) a flange of one layer of points, whose families have no gradient
  bool two_materials = false;
  std::string influence = "gaussian";
  std::string material = "type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
  double scale = 1.0;         ///< of all lengths
  double modulus = 1.0;       ///< of all moduli
  int cells = 0;              ///< along the longest axis; 0: small
  bool skip = true, share = true;   ///< [run]
  double horizon_ratio = 2.515;
  std::string plane = "strain";
  std::string integrator = "type = \"evaluate\"";
  std::string sets;           ///< further lines of [sets]
  std::string conditions;     ///< further sections: initial, boundaries, loads
};

/// Scene text for a kinematics (its table, `type` included).
std::string scene_text(const BodyOptions& options, const std::string& kinematics);
std::unique_ptr<Simulation> build(const std::string& text);
std::string kinematics_table(const Example& example);

/// The kinematics of an example, taken apart.
Formulation formulation_of(const Example& example);

/// A kinematics on a body.
struct Case {
  Example example;
  BodyOptions body;
  std::string label() const;
  /// Whether the part declares its forces as -dE/du.
  bool conservative() const;
};
/// Every kinematics in every space, on lattices and clouds, intact and cracked.
std::vector<Case> cases();
/// The bodies with tongues, in the plane and in space.
std::vector<BodyOptions> bodies_with_tongues();
/// Both.
std::vector<Case> cases_and_tongues();

/// Uniform in [-1, 1).
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1.0p-52 - 1.0; }

 private:
  std::mt19937_64 engine_;
};

/// field(x) at every live point; other entries untouched.
void set_field(const Body& body, FieldView field, const std::function<Point(const Point&)>& value);
/// A smooth, finite deformation with noise on top, admissible everywhere: noise times the spacing.
void deform(const Body& body, FieldView u, std::uint64_t seed, double noise);
/// The same with every direction longer.
void stretch_at_random(const Body& body, FieldView u, std::uint64_t seed);
/// From displacements of all points, images too, to those of a problem with images.
void to_problem(const BodyProblem& problem, FieldView u);
/// Forces at u, over memory full of NaN: whatever a kernel forgets to write shows. The energy -> *energy where wanted.
/// Throws where u is inadmissible.
Field force_of(BodyProblem& problem, ConstFieldView u, double* energy = nullptr);
double energy_of(BodyProblem& problem, ConstFieldView u);
/// u + h w.
Field shifted(const BodyProblem& problem, ConstFieldView u, ConstFieldView w, double h);
Field random_direction(const BodyProblem& problem, std::uint64_t seed);
/// How far forces and tangents at u are from derivatives, by differences of fourth order along random directions of two seeds: far below what is tolerated,
/// with a rounding error of about 1e-12 of the energy. Outputs are poisoned: whatever a kernel forgets to write shows.
struct Derivatives {
  double force;      ///< |dE/dw + f w| over the largest force times the number of points
  double tangent;    ///< |d(-f v)/dw - v K w| over that of K w
  double asymmetry;  ///< |w K v - v K w|, likewise
  Field w, Kw;       ///< the first direction, and the tangent action along it
};
Derivatives derivatives_at(BodyProblem& problem, ConstFieldView u, std::uint64_t seed, double h);
/// Sum over live points and components of a b.
double dot(const Body& body, ConstFieldView a, ConstFieldView b);
/// Largest |a - b| of a component over live points.
double difference(const Body& body, ConstFieldView a, ConstFieldView b);
/// Largest |component| over live points.
double largest(const Body& body, ConstFieldView a);

}  // namespace perikit::contract
