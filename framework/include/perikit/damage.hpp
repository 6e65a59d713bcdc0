#pragma once
/// What a damage criterion needs: its interface, parameters, and PERIKIT_PLUGIN.
#include "perikit/model/damage.hpp"
#include "perikit/plugin/abi.hpp"
