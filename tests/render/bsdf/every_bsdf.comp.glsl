#version 460
#extension GL_GOOGLE_include_directive : require
// Every member on the device: what tests/render/bsdf/device_test.cpp asks, one question an invocation.
#include "render/bsdf/every_bsdf.shared.h"

struct Question {
  BsdfParameters parameters;
  vec3 wi;
  uint bsdf;
  vec3 wo;
  float reserved0;
  vec3 n;
  float reserved1;
  vec3 u;
  float reserved2;
};

#include "tests/render/gpu/questions.glsl.h"
void put(BsdfSample drawn) {
  put(drawn.direction);
  put(drawn.weight);
  put(drawn.pdf);
  put(drawn.impulse ? 1.0 : 0.0);
}
void put(Impulses impulses) {
  put(float(impulses.count));
  for (int i = 0; i < 2; ++i) {
    put(impulses.impulse[i].direction);
    put(impulses.impulse[i].magnitude);
  }
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= questions.length()) return;
  const Question q = questions[i];
  at = 52 * i;
  put(bsdf_finite_density(q.bsdf, q.parameters, q.wi, q.wo, q.n));
  put(bsdf_pdf(q.bsdf, q.parameters, q.wi, q.wo, q.n));
  put(bsdf_probability_in(q.bsdf, q.parameters, q.wo, q.n));
  put(bsdf_probability_out(q.bsdf, q.parameters, q.wi, q.n));
  put(bsdf_incoming_impulses(q.bsdf, q.parameters, q.wo, q.n));
  put(bsdf_outgoing_impulses(q.bsdf, q.parameters, q.wi, q.n));
  put(bsdf_scatter_in(q.bsdf, q.parameters, q.wo, q.n, q.u));
  put(bsdf_scatter_out(q.bsdf, q.parameters, q.wi, q.n, q.u));
}
