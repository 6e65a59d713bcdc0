#pragma once
/// Precompiled for the library: what most of its files read. Each file still names what it uses; the preset `dev` builds without this one.

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

#include "perikit/body/body.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"
#include "perikit/problem/integrator.hpp"
#include "plugin/registry.hpp"
#include "terms/terms.hpp"
