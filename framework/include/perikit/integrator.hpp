#pragma once
/// What an integrator needs: its interface, the problem that it runs, parameters, and PERIKIT_PLUGIN.
#include "perikit/plugin/abi.hpp"
#include "perikit/problem/integrator.hpp"
#include "perikit/problem/problem.hpp"
