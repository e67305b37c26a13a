#version 460
#extension GL_GOOGLE_include_directive : require
// Every member on the device: what tests/render/luminaires/device_test.cpp asks, one question an invocation.
#include "world/luminaires/every_luminaire.shared.h"

struct Question {
  Emitter emitter;
  vec3 receiver;
  uint kind;
  vec3 direction;
  float reserved;
  vec2 u, v;
};

#include "tests/render/gpu/questions.glsl.h"

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= questions.length()) return;
  const Question q = questions[i];
  at = 16 * i;
  const EmitterSample drawn = luminaire_sample(q.kind, q.emitter, q.receiver, q.u);
  put(drawn.direction);
  put(drawn.distance);
  put(drawn.biradiance);
  put(drawn.pdf);
  const EmitterHit hit = luminaire_meet(q.kind, q.emitter, q.receiver, q.direction);
  put(hit.distance);
  put(hit.radiance);
  put(hit.pdf);
  const EmitterPhoton photon = luminaire_emit(q.kind, q.emitter, q.u, q.v, q.receiver, 2.0);
  put(photon.origin);
  put(photon.direction);
  put(photon.power);
}
