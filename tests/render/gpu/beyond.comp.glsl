#version 460
#extension GL_GOOGLE_include_directive : require
// A read where it is told to, also where the buffer has ended: what HardCaseR15 asks.
struct Question {
  uint place;
};

#include "tests/render/gpu/questions.glsl.h"

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= questions.length()) return;
  at = i;
  put(float(questions[questions[i].place].place));
}
