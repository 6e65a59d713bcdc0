#pragma once
#include <string>

namespace perikit {

/// What a return flag of KINSol means, as part of a sentence.
std::string kinsol_flag_meaning(int flag);

}  // namespace perikit
