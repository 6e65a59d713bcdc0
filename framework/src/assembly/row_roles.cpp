#include "assembly/row_roles.hpp"

#include <numeric>

#include "spaces/lattice/work_of_groups.hpp"

namespace perikit {

RowRoles::RowRoles(const BlockRows& rows, const Laws& laws) {
  const Body& body = rows.body();
  if (!body.part()) {
    own.resize(rows.size());
    std::iota(own.begin(), own.end(), 0);
    felt = complete = own;
    return;
  }
  std::vector<std::uint8_t> here(body.stride(), 0);
  for (const std::int32_t p : body.complete()) here[static_cast<std::size_t>(p)] = 1;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (body.owns(rows.point(r))) own.push_back(static_cast<std::int32_t>(r));
    if (here[rows.point(r)]) complete.push_back(static_cast<std::int32_t>(r));
  }
  if (const LatticeFamilies* lattice = rows.families().lattice()) {
    here = affects_owned_points(*lattice);
  } else {
    for (const std::int32_t r : complete)
      for (const std::int32_t j : rows.neighbours(static_cast<std::size_t>(r))) here[rows.point(static_cast<std::size_t>(j))] = 1;
  }
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (here[rows.point(r)] && !(laws.has_incomplete_points() && laws.incomplete(rows.point(r)))) felt.push_back(static_cast<std::int32_t>(r));
}

}  // namespace perikit
