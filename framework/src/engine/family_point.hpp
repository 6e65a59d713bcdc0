#pragma once
#include "perikit/body/body.hpp"
#include "perikit/engine/laws.hpp"
#include "perikit/model/family_point.hpp"

namespace perikit {

inline FamilyPoint family_point(const Body& body, const Laws& laws, std::size_t p) {
  return {body.space(), body.section(), body.horizon(), laws.moduli(p)};
}

}  // namespace perikit
