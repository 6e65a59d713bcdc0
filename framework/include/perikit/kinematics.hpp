#pragma once
/// What a kinematics needs: its four interfaces, parameters, and PERIKIT_PLUGIN.
#include "perikit/model/kinematics.hpp"
#include "perikit/plugin/abi.hpp"
