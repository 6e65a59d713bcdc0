#pragma once
/// What an influence function needs: its interface, parameters, and PERIKIT_PLUGIN.
#include "perikit/body/influence.hpp"
#include "perikit/plugin/abi.hpp"
