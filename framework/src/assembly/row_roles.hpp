#pragma once
/// Which block rows a rank has something to do with.

#include <cstdint>
#include <vector>

#include "assembly/block_rows.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// Block rows, ascending; on one rank each list has all of them.
struct RowRoles {
  RowRoles(const BlockRows& rows, const Laws& laws);
  std::vector<std::int32_t> own;       ///< of points that no other rank owns
  std::vector<std::int32_t> complete;  ///< of points whose forces are complete here (Body::complete)
  std::vector<std::int32_t> felt;      ///< these, and what forces on them come from: points that see one of them
};

}  // namespace perikit
