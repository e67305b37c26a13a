/* Makes a *.shared.h file compile as C++ (GLM) and as GLSL, so that what both sides need is written once.
 *
 *   #ifndef LOAM_NAME_SHARED_H      include guards, since GLSL knows no #pragma once
 *   #define LOAM_NAME_SHARED_H
 *   #include "world/base/shared.h"
 *   SHARED_NAMESPACE(world)
 *   SHARED uint twice(uint x) { return 2u * x; }
 *   SHARED_CONST float kHalf = 0.5;
 *   SHARED_NAMESPACE_END
 *   #endif
 *
 * In GLSL: #extension GL_GOOGLE_include_directive : require, and -I the root of the repository.
 * Inside the namespace C++ sees GLSL's type names and functions through `using namespace glsl`.
 * SHARED_IN(Record) is how a function takes a record: by reference in C++. SHARED_INIT(value) after a member of a
 * record is what C++ starts it with; GLSL, which has no such thing, starts with anything. */
#ifndef LOAM_SHARED_H
#define LOAM_SHARED_H

#ifdef __cplusplus

#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace glsl {
using uint = uint32_t;
using glm::abs, glm::acos, glm::asin, glm::atan, glm::ceil, glm::clamp, glm::cos, glm::cross, glm::dot, glm::exp,
    glm::exp2, glm::floor, glm::fract, glm::length, glm::log, glm::log2, glm::max, glm::min, glm::mix, glm::normalize,
    glm::pow, glm::sign, glm::sin, glm::sqrt, glm::tan;
using glm::ivec2, glm::ivec3, glm::ivec4, glm::uvec2, glm::uvec3, glm::uvec4, glm::vec2, glm::vec3, glm::vec4;
}  // namespace glsl

#define SHARED_NAMESPACE(name) \
  namespace name {             \
  namespace shared {           \
  using namespace glsl;
#define SHARED_NAMESPACE_END \
  }                          \
  }
#define SHARED inline
#define SHARED_CONST inline constexpr
#define SHARED_IN(Record) const Record&
#define SHARED_INIT(value) = value

#else

#define SHARED_NAMESPACE(name)
#define SHARED_NAMESPACE_END
#define SHARED
#define SHARED_CONST const
#define SHARED_IN(Record) Record
#define SHARED_INIT(value)

#endif
#endif
