#include "spaces/find_laminates.hpp"

#include <numeric>

#include "core/per_thread.hpp"
#include "spaces/evaluation_points.hpp"

namespace perikit {

namespace {

/// One evaluation point that was looked at: a laminate, or none (its share is negative).
struct Seen {
  std::int64_t number;
  LaminatePoint point;
};

/// Values at the points of one interface, by InterfaceValue, and their gradients at points, D components each.
struct Values {
  Field value, gradient;
};

template <int D>
class LaminateSearch {
 public:
  LaminateSearch(const SpaceParts& parts, const EvaluationSpace& space, const GroupMarks& marks, Laminates& laminates)
      : parts_(parts), space_(space), body_(parts.families.body()), marks_(marks), laminates_(laminates) {
    readers_.prepare([&] { return std::make_unique<EvaluationPoints<D>>(parts); });
  }

  std::size_t find() {
    const Interfaces& interfaces = laminates_.interfaces();
    std::vector<std::vector<Seen>> seen(marks_.size());
    std::vector<std::size_t> parallel(marks_.size(), 0);
    for (std::size_t k = 0; k < interfaces.all.size(); ++k) {
      const Values values = values_of(k);
      over_points(marks_, [&](std::size_t p) { look(k, p, values, seen[p / padding], parallel[p / padding]); });
    }
    for (const std::vector<Seen>& of_group : seen)
      for (const Seen& point : of_group) laminates_.clear(point.number);
    for (const std::vector<Seen>& of_group : seen)
      for (const Seen& point : of_group)
        if (point.point.share >= 0) laminates_.set(point.number, point.point);
    return std::accumulate(parallel.begin(), parallel.end(), std::size_t{0});
  }

 private:
  template <class Visit>
  void over_points(const GroupMarks& marks, Visit&& visit) {
    parallel_for(marks.size(), [&](std::size_t group) {
      for (std::size_t p = group * padding; p < (group + 1) * padding && marks[group] != 0; ++p)
        if (marked(marks, p) && body_.alive(p)) visit(p);
    });
  }

  Values values_of(std::size_t k) {
    Values values{body_.make_field(interface_values), Field()};
    for (const std::int32_t index : body_.internal())
      for (int v = 0; v < interface_values; ++v) {
        const auto p = static_cast<std::size_t>(index);
        values.value.component(v)[p] = interface_value(laminates_.interfaces(), k, p, static_cast<InterfaceValue>(v));
      }
    if (!parts_.formulation.bond) return values;
    values.gradient = Field(1, interface_values * D * body_.stride());
    over_points(parts_.families.around(marks_), [&](std::size_t p) {
      EvaluationPoints<D>& points = readers_.mine();
      points.read(p);
      for (int v = 0; v < interface_values; ++v) {
        double H[D];
        points.sum(points.own(), [&](std::size_t at) { return values.value.component(v)[at]; }, H);
        std::copy_n(H, D, values.gradient.data() + (p * interface_values + static_cast<std::size_t>(v)) * D);
      }
    });
    return values;
  }

  /// The evaluation points of p at interface k.
  void look(std::size_t k, std::size_t p, const Values& values, std::vector<Seen>& seen, std::size_t& parallel) {
    const auto owner = static_cast<std::int32_t>(p);
    if (!space_.evaluates(p) || laminates_.interfaces().all[k].find(owner) < 0) return;
    EvaluationPoints<D>& points = readers_.mine();
    points.read(p);
    for (int q = 0; q < points.points(); ++q) {
      const std::int32_t far = points.far(q);
      if (points.weight(q) == 0 || (far >= 0 && far < owner && parts_.bonds_once())) continue;
      Seen one{space_.number_of(owner, far, q).point, {}};
      one.point.share = -1;
      if (one.number < 0) continue;
      double gradient[interface_values][3] = {};
      bool sees_both = true;
      for (int v = 0; v < interface_values && sees_both; ++v) {
        double H[D];
        points.gradient_of(
            q, [&](std::size_t at) { return values.value.component(v)[at]; },
            [&](std::size_t at) { return values.gradient.data() + (at * interface_values + static_cast<std::size_t>(v)) * D; }, H);
        std::copy_n(H, D, gradient[v]);
        sees_both = static_cast<InterfaceValue>(v) == InterfaceValue::others || sees(D, gradient[v]);
      }
      if (sees_both && find_laminate(D, gradient, one.point)) {
        set_points(laminates_.interfaces(), k, owner, one.point);
      } else {
        one.point.share = -1;
        parallel += sees_both;
      }
      seen.push_back(one);
    }
  }

  const SpaceParts& parts_;
  const EvaluationSpace& space_;
  const Body& body_;
  const GroupMarks& marks_;
  Laminates& laminates_;
  PerThread<EvaluationPoints<D>> readers_;
};

}  // namespace

template <int D>
std::size_t find_laminates(const SpaceParts& parts, const EvaluationSpace& space, const GroupMarks& marks, Laminates& laminates) {
  return LaminateSearch<D>(parts, space, marks, laminates).find();
}

template std::size_t find_laminates<1>(const SpaceParts&, const EvaluationSpace&, const GroupMarks&, Laminates&);
template std::size_t find_laminates<2>(const SpaceParts&, const EvaluationSpace&, const GroupMarks&, Laminates&);
template std::size_t find_laminates<3>(const SpaceParts&, const EvaluationSpace&, const GroupMarks&, Laminates&);

}  // namespace perikit
