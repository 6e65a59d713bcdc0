#include "problem/surroundings/surroundings.hpp"

#include <tuple>

#include "core/ranks/dependent_arrival.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

namespace {

/// Images follow their sources, some of which are ghosts.
class Extension final : public DependentArrival {
 public:
  Extension(Arrival& ghosts, const ImageMap& images, FieldView u) : DependentArrival(&ghosts), images_(images), u_(u) {}

 private:
  void put() override { images_.extend(u_); }

  const ImageMap& images_;
  FieldView u_;
};

void copy_to(ConstFieldView u, Field& memory) {
  if (memory.size() == 0) memory = Field(u.components, u.stride, field_margin);
  copy(u, memory);
}

}  // namespace

Surroundings::Surroundings(const Partition* partition, const ImageMap* images, int dimension) : images_(images) {
  if (partition) ghosts_.emplace(*partition, dimension);
}

void Surroundings::share(FieldView field) {
  if (ghosts_) ghosts_->forward(field);
}

Seen Surroundings::seen(ConstFieldView u, Field& memory) {
  if (!images_) return shared(u);
  copy_to(u, memory);
  if (ghosts_) ghosts_->forward(memory);
  images_->extend(memory);
  return {memory, nullptr};
}

Seen Surroundings::shared(ConstFieldView field) {
  if (ghosts_) ghosts_->forward(Seen::writable(field));
  return {field, ghosts()};
}

EvaluationStatus Surroundings::extending(const Configuration& at, Field& memory,
                                         const std::function<EvaluationStatus(const Configuration&)>& evaluate) {
  copy_to(at.unfinished(), memory);
  ghosts_->start(memory);
  Extension extension(*ghosts_, *images_, memory);
  return evaluate(at.seen_as(memory).arriving(extension));
}

void Surroundings::settle(FieldView force) const {
  if (images_) images_->fold(force);
  if (ghosts_) ghosts_->clear(force);
}

void Surroundings::agree(EvaluationStatus& status) const {
  if (!ghosts_ || communicator().size() == 1 || communicator().largest(status.ok() ? 0.0 : 1.0) == 0) return;
  std::vector<std::byte> mine;
  if (!status.ok()) {
    ByteWriter out;
    out.value(status.point);
    out.value(status.step_factor);
    out.bytes(status.description.data(), status.description.size());
    mine = out.take();
  }
  std::vector<std::byte> first;
  std::tuple<double, std::int64_t> least;   // an inadmissible point before all laws
  for (const std::vector<std::byte>& of_rank : communicator().gather(mine)) {
    if (of_rank.empty()) continue;
    ByteReader in(of_rank);
    const auto point = in.value<std::int64_t>();
    const auto factor = in.value<double>();
    const std::tuple rank{factor < 1 ? factor : 0.0, point};
    if (!first.empty() && rank >= least) continue;
    least = rank;
    first = of_rank;
  }
  communicator().broadcast(first);
  ByteReader in(first);
  status.point = in.value<std::int64_t>();
  status.step_factor = in.value<double>();
  status.description.assign(first.size() - sizeof status.point - sizeof status.step_factor, ' ');
  in.bytes(status.description.data(), status.description.size());
}

void Surroundings::finish(FieldView force, EvaluationStatus& status) const {
  agree(status);
  if (status.ok()) settle(force);
}

}  // namespace perikit
