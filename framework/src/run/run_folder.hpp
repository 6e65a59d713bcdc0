#pragma once
/// What a run finds in its folder, and may do to it.

#include "run/output_folder.hpp"
#include "run/simulation.hpp"

namespace perikit {

/// Whether the run ends with this step.
bool ended(const OutputProgress& run, std::int64_t step, double time);

/// What a run that does not go on does to the one whose results the folder holds; empty where it holds none.
std::string earlier_run(const std::filesystem::path& folder);

OutputFolder::Use use_of_folder(const Scene& scene, const std::filesystem::path& folder, bool force);

}  // namespace perikit
