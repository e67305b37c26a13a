#version 460
#extension GL_GOOGLE_include_directive : require
// Every medium with a closed form on the device: what tests/render/trace/media_device_test.cpp asks.
#include "world/media/every_medium.shared.h"

struct Question {
  vec3 half_extent;
  float scale_height;
  vec3 normal;
  uint kind;
  vec3 origin;
  float t0;
  vec3 direction;
  float t1;
};

layout(local_size_x = 64) in;
layout(binding = 0, std430) readonly buffer Questions { Question questions[]; };
layout(binding = 1, std430) writeonly buffer Answers { float answers[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= questions.length()) return;
  const Question q = questions[i];
  const MediumShape shape = MediumShape(q.half_extent, q.normal, q.scale_height);
  const float depth = medium_depth(q.kind, shape, q.origin, q.direction, q.t0, q.t1);
  answers[4 * i] = medium_density(q.kind, shape, q.origin);
  answers[4 * i + 1] = depth;
  answers[4 * i + 2] = medium_reach(q.kind, shape, q.origin, q.direction, q.t0, q.t1, 0.5 * depth);
  answers[4 * i + 3] = beer_lambert(0.25, depth) + opacity(0.25 * depth) + mean_transmittance(depth);
}
