#pragma once
/// The XDMF sidecar: names the datasets of reference.h5 and of the frame files for ParaView, VisIt and meshio.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace perikit {

struct XdmfField {
  std::string name;
  int width = 1;  ///< 1, 3 or 9
};

/// One frame: `file` is relative to the folder of the sidecar.
std::string xdmf_grid(const std::string& file, double time, std::size_t points, std::span<const XdmfField> fields);

/// The whole sidecar around the grids of all frames.
std::string xdmf_document(const std::string& title, const std::string& version, std::span<const std::string> grids);

}  // namespace perikit
