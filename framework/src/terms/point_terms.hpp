#pragma once
/// The point terms of a scene (perikit/model/point_term.hpp) as one term of the body: what they do to the points that this rank owns.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/model/point_term.hpp"
#include "terms/term.hpp"

namespace perikit {

/// A part with what the scene says of it.
struct PointTermPart {
  std::shared_ptr<const PointTerm> term;
  std::string name, set;
  /// out <- the constants at a place and a time. Throws InputError.
  std::function<void(const Point& x, double time, double* out)> constants;
  bool constants_vary_in_space = false, constants_vary_in_time = false;

  bool depends_on_time() const noexcept { return constants_vary_in_time || term->traits().time; }
};

class PointTerms final : public Term, public SampledTerm, public DrivenTerm {
 public:
  /// last_time: constants are asked for there, too, before the run begins. The body must outlive it.
  PointTerms(const Body& body, std::vector<PointTermPart> parts, double last_time);

  std::int64_t forces(const Configuration& at, const Region& region, const ForceSum& sum) override;
  std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) override;
  void report(ModelReport& report) const override;
  std::string_view inadmissible() const noexcept override { return "a term that is not finite, or refuses it"; }
  bool constant_tangent() const noexcept override;

  SampledTerm* sampled() noexcept override { return this; }
  std::int64_t sample(const Configuration& at, PointSamples& samples) override;
  std::int64_t forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) override;

  DrivenTerm* driven() noexcept override { return this; }
  bool driven(Drive drive) const noexcept override;
  std::int64_t driven_forces(const Configuration& at, Drive drive, const ForceSum& sum) override;
  bool conservative() const noexcept override;
  bool needs_velocity() const noexcept override;

 private:
  /// A part at the points of its set, which stand one after the other in arrays.
  struct Placed {
    PointTermPart part;
    TermTraits traits;
    std::vector<std::int32_t> points;  ///< owned, by internal index, ascending
    std::vector<std::size_t> first;    ///< of each block of points that one thread takes, and their number
    Field positions;
    std::size_t constant_stride = 0;
    AlignedVector<double> constants;
    double time = 0;                   ///< of the constants

    bool driven(Drive drive) const noexcept;
  };
  /// What is wanted of an evaluation.
  struct Wanted {
    ConstFieldView w = {};
    FieldView force = {}, Kw = {};
    double* density = nullptr;
    std::span<GroupEnergy> energies = {};
  };

  void place(PointTermPart part);
  void renew_constants(Placed& placed, double time) const;
  /// Adds what is wanted; returns as Term::forces does.
  std::int64_t evaluate(const Configuration& at, const std::uint8_t* only, const Wanted& wanted);
  std::int64_t evaluate(const Configuration& at, const std::uint8_t* only, Placed& placed, const Wanted& wanted);

  const Body& body_;
  std::vector<Placed> placed_;
};

}  // namespace perikit
