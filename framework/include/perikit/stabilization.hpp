#pragma once
/// What a stabilization needs: its interface, parameters, and PERIKIT_PLUGIN.
#include "perikit/model/stabilization.hpp"
#include "perikit/plugin/abi.hpp"
