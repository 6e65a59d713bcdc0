#pragma once
/// Everything that a plugin needs.
#include "perikit/body/influence.hpp"
#include "perikit/model/damage.hpp"
#include "perikit/model/kinematics.hpp"
#include "perikit/model/material.hpp"
#include "perikit/model/stabilization.hpp"
#include "perikit/plugin/abi.hpp"
#include "perikit/problem/integrator.hpp"
#include "perikit/problem/problem.hpp"
