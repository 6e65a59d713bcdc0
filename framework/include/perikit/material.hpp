#pragma once
/// What a material needs: the interface of laws, parameters, and PERIKIT_PLUGIN. Most laws are written with perikit/sdk/law_material.hpp.
#include "perikit/model/material.hpp"
#include "perikit/plugin/abi.hpp"
