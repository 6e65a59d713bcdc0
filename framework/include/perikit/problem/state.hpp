#pragma once
/// The state of a run: everything that changes from step to step, but for bonds and the history of materials.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "perikit/body/points.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

class ByteReader;
class ByteWriter;

/// Totals over all bodies [J]; external_work is what boundaries and loads have put in. dissipated: by bonds that failed, by laws and by
/// terms; the part of the latter two is dissipated_by_laws.
struct Energies {
  double strain = 0, kinetic = 0, external_work = 0, dissipated = 0, dissipated_by_laws = 0;
};

/// Fields have `dimension` components unless it says otherwise, and `stride` points per component; dead points (padding) hold zero
/// and stay zero. Every run variable of an integrator is declared here, so that snapshots hold it and a run goes on bitwise.
class State {
 public:
  /// Their bodies must outlive the state. Everything is zero at first.
  explicit State(Points points);
  State(State&&) = default;

  double time = 0;          ///< [s], or the load parameter in [0, 1]
  std::int64_t step = 0;
  Energies energies;

  FieldView displacement() noexcept { return displacement_; }
  ConstFieldView displacement() const noexcept { return displacement_; }
  /// [N] on each point, of the last evaluation.
  FieldView internal_force() noexcept { return internal_force_; }
  FieldView velocity() { return declare("velocity"); }              ///< allocated on first use; at full steps where a sample was asked for
  FieldView external_force() { return declare("external_force"); }  ///< [N]; allocated on first use

  /// A further field, zero at first. Views of it stay valid.
  FieldView declare(const std::string& name) { return declare(name, displacement_.components); }
  FieldView declare(const std::string& name, int components);
  /// Further numbers, zero at first. To be asked for with the same count each time.
  std::span<double> declare_numbers(const std::string& name, std::size_t count);

  std::size_t bytes() const noexcept;
  /// Of all ranks, by rank 0 alone. All ranks must call it.
  void write(ByteWriter& out) const;
  /// Bytes that rank 0 then writes.
  std::uint64_t written() const noexcept;
  /// What was declared but not written becomes zero. Throws InputError where the bytes cannot be those of a state of the whole
  /// body.
  void read(ByteReader& in);
  // The same of this rank alone.
  void write_here(ByteWriter& out) const;
  void read_here(ByteReader& in);

 private:
  void write_numbers(ByteWriter& out) const;
  void read_numbers(ByteReader& in);
  FieldView declared_like(ByteReader& in);

  Points points_;
  std::map<std::string, Field> fields_;
  std::map<std::string, std::vector<double>> numbers_;
  FieldView displacement_, internal_force_;
};

}  // namespace perikit
