#pragma once
#include "model/formulation.hpp"

namespace perikit {

/// What an object of any class is, as pointers and map, without its traits. Throws std::invalid_argument as make_formulation does.
Formulation kinematics_class(const Kinematics& kinematics);

}  // namespace perikit
