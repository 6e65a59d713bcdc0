#pragma once
#include <filesystem>

#include "study/study.hpp"

namespace perikit {

/// The picture that the study asks for. Rows without numbers (or, on a logarithmic axis, positive numbers) are left out.
/// Throws RunError where none is left or gnuplot fails.
void draw(const StudyTable& table, const std::filesystem::path& picture);

}  // namespace perikit
