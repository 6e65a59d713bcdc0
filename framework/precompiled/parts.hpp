#pragma once
/// Precompiled for parts, solvers and program: what most of their files read. Each file still names what it uses; the preset `dev` builds
/// without this one.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "perikit/damage.hpp"
#include "perikit/influence.hpp"
#include "perikit/integrator.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/sdk/law_material.hpp"
#include "perikit/stabilization.hpp"
#include "perikit/term.hpp"
