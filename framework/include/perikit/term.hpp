#pragma once
/// What a term needs: the interface of terms at points, parameters, and PERIKIT_PLUGIN. Most terms are written with perikit/sdk/law_term.hpp.
#include "perikit/model/point_term.hpp"
#include "perikit/plugin/abi.hpp"
