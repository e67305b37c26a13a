#version 460
#extension GL_GOOGLE_include_directive : require
// The device's own functions: what HardCaseR17 asks, one function of one or two numbers an invocation.
struct Question {
  uint function;
  float x, y;
};

#include "tests/render/gpu/questions.glsl.h"

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= questions.length()) return;
  const float x = questions[i].x, y = questions[i].y;
  at = i;
  switch (questions[i].function) {
    case 0u: put(x / y); break;
    case 1u: put(inversesqrt(x)); break;
    case 2u: put(sqrt(x)); break;
    case 3u: put(exp(x)); break;
    case 4u: put(exp2(x)); break;
    case 5u: put(log(x)); break;
    case 6u: put(log2(x)); break;
    case 7u: put(pow(x, y)); break;
    case 8u: put(sin(x)); break;
    case 9u: put(cos(x)); break;
    default: put(0.0);
  }
}
