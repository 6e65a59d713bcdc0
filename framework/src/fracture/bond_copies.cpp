#include "fracture/bond_copies.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/each_once.hpp"
#include "families/cloud/cloud_families.hpp"

namespace perikit {

namespace {

bool same(const SymmetryOperation& a, const SymmetryOperation& b, double near) noexcept {
  if (a.sign != b.sign || a.mirrors != b.mirrors) return false;
  for (std::size_t c = 0; c < 3; ++c)
    if (std::abs(a.shift[c] - b.shift[c]) > near) return false;
  return true;
}

/// a^-1 b. Each mirror is its own inverse, so that two equal ones in a row are none.
SymmetryOperation between(const SymmetryOperation& a, const SymmetryOperation& b) {
  SymmetryOperation operation;
  for (std::size_t c = 0; c < 3; ++c) {
    operation.sign[c] = static_cast<std::int8_t>(a.sign[c] * b.sign[c]);
    operation.shift[c] = a.sign[c] * (b.shift[c] - a.shift[c]);
  }
  operation.mirrors.assign(a.mirrors.rbegin(), a.mirrors.rend());
  for (const char mirror : b.mirrors) {
    if (!operation.mirrors.empty() && operation.mirrors.back() == mirror) operation.mirrors.pop_back();
    else operation.mirrors.push_back(mirror);
  }
  return operation;
}

/// The number of an operation in a list, to which it is appended where it is new.
std::size_t number_in(std::vector<SymmetryOperation>& all, const SymmetryOperation& operation, double near) {
  const auto at = std::ranges::find_if(all, [&](const SymmetryOperation& other) { return same(other, operation, near); });
  const auto number = static_cast<std::size_t>(at - all.begin());
  if (at == all.end()) all.push_back(operation);
  return number;
}

}  // namespace

BondCopies::BondCopies(const Families& families, const Images& images)
    : families_(families),
      source_(families.body().stride()),
      operation_(families.body().stride(), 0),
      first_(families.body().stride(), -1),
      number_(families.body().stride(), -1) {
  const Body& body = families.body();
  const double near = 1e-6 * body.spacing();
  for (std::size_t p = 0; p < source_.size(); ++p) source_[p] = static_cast<std::int32_t>(p);
  std::vector<SymmetryOperation> all(1), relations;
  std::map<std::int32_t, std::vector<std::int32_t>> of_source;
  const std::size_t real = body.points() - images.size();
  for (std::size_t k = 0; k < images.size(); ++k) {
    const std::int32_t image = body.internal()[real + k], source = body.internal()[static_cast<std::size_t>(images.source[k])];
    const auto at = static_cast<std::size_t>(image);
    images_.push_back(image);
    source_[at] = source;
    number_[at] = static_cast<std::int32_t>(k);
    operation_[at] = static_cast<std::uint16_t>(number_in(all, images.operation[k], near));
    of_source[source].push_back(image);
    const std::array<std::int8_t, 3>& s = images.sign[k];
    const double of_all = images.operation[k].of_stress;
    stress_.push_back({of_all, of_all, of_all, of_all * s[0] * s[1], of_all * s[0] * s[2], of_all * s[1] * s[2]});
  }
  for (auto& [source, of] : of_source) {
    first_[static_cast<std::size_t>(source)] = static_cast<std::int32_t>(orbits_.size());
    orbits_.push_back(static_cast<std::int32_t>(of.size() + 1));
    orbits_.push_back(source);
    std::ranges::sort(of);
    orbits_.insert(orbits_.end(), of.begin(), of.end());
  }
  operations_ = all.size();
  for (const SymmetryOperation& a : all)
    for (const SymmetryOperation& b : all) relations_.push_back(static_cast<int>(number_in(relations, between(a, b), near)));
}

std::span<const std::int32_t> BondCopies::orbit(std::int32_t source) const noexcept {
  const std::int32_t first = first_[static_cast<std::size_t>(source)];
  if (first < 0) return {&source_[static_cast<std::size_t>(source)], 1};
  const auto at = static_cast<std::size_t>(first);
  return {orbits_.data() + at + 1, static_cast<std::size_t>(orbits_[at])};
}

/// Of points as far from each other as two that have a bond.
bool BondCopies::joined(std::int32_t p, std::int32_t q) const noexcept {
  const CloudFamilies* const cloud = families_.cloud();
  return !cloud || std::ranges::binary_search(cloud->neighbours(static_cast<std::size_t>(p)), q);
}

void BondCopies::find(std::int32_t point, std::int32_t far, std::vector<Copy>& copies) const {
  copies.clear();
  const std::int32_t p = source_[static_cast<std::size_t>(point)], q = source_[static_cast<std::size_t>(far)];
  const int here = relation(point, far), back = relation(far, point);
  const auto ends = [&](std::int32_t a, std::int32_t b) { return (image(a) ? 0 : 1) + (image(b) ? 0 : 1); };
  for (const std::int32_t a : orbit(p))
    for (const std::int32_t b : orbit(q)) {
      const int of = relation(a, b);
      // Of a bond between a point and its own image either end may be the copy of the first one: the one that is no image is.
      const bool copy = of == here && !(p == q && here == back && std::pair(image(b), b) < std::pair(image(a), a));
      if (!copy || a == b || !joined(a, b)) continue;
      copies.push_back({a, b, ends(a, b)});
    }
}

const BondCopies::Copy& BondCopies::first(std::span<const Copy> copies) noexcept {
  const Copy* best = copies.data();
  for (const Copy& copy : copies)
    if (copy.real_ends > best->real_ends || (copy.real_ends == best->real_ends && copy.bond() < best->bond())) best = &copy;
  return *best;
}

bool BondCopies::decides(std::span<const Copy> copies) const noexcept {
  if (copies.empty()) return false;
  const Copy& one = first(copies);
  std::int32_t real = -1;  // the lowest end that is no image
  for (const std::int32_t end : {one.bond().far, one.bond().point})
    if (!image(end)) real = end;
  return real >= 0 && families_.body().owns(static_cast<std::size_t>(real));
}

bool BondCopies::decides(BondId bond) const {
  std::vector<Copy> copies;
  find(bond.point, bond.far, copies);
  return decides(copies);
}

void BondCopies::add_copies(std::vector<BondId>& bonds) const {
  std::vector<Copy> copies;
  const std::size_t named = bonds.size();
  for (std::size_t k = 0; k < named; ++k) {
    find(bonds[k].point, bonds[k].far, copies);
    for (const Copy& copy : copies)
      if (copy.bond() != bonds[k]) bonds.push_back(copy.bond());
  }
  keep_each_once(bonds);
}

std::vector<BondChange> BondCopies::with_copies(std::span<const BondChange> changes) const {
  std::vector<BondChange> all;
  std::vector<Copy> copies;
  for (const BondChange& change : changes) {
    find(change.bond.point, change.bond.far, copies);
    for (const Copy& copy : copies) all.push_back({copy.bond(), change.integrity});
  }
  keep_each_once(all, &BondChange::bond);
  return all;
}

void BondCopies::add_copies(GroupMarks& marks) const {
  for (const std::int32_t image : images_)
    if (marked(marks, static_cast<std::size_t>(image))) mark(marks, static_cast<std::size_t>(source_[static_cast<std::size_t>(image)]));
  for (const std::int32_t image : images_)
    if (marked(marks, static_cast<std::size_t>(source_[static_cast<std::size_t>(image)]))) mark(marks, static_cast<std::size_t>(image));
}

void BondCopies::turn_stress(std::int32_t p, double* stress) const noexcept {
  const std::int32_t k = number_[static_cast<std::size_t>(p)];
  for (std::size_t c = 0; c < 6 && k >= 0; ++c) stress[c] *= stress_[static_cast<std::size_t>(k)][c];
}

}  // namespace perikit
