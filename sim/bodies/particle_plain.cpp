// The particles of a block one after the other: what particle_move.cpp does many at a time.
#include "sim/bodies/particle_contacts.h"

namespace sim {

void move_particles_plain(ParticleBlock& block, const ParticleMotion& motion, const ParticleTerrain& terrain) {
  ParticleProbe probe(terrain);
  for (int i = 0; i < block.count; ++i) {
    int32_t way[3];
    bool enters = false;
    for (int a = 0; a < 3; ++a) {
      float& v = block.velocity[a][i];
      way[a] = rounded_way(motion.way_by_velocity * v + motion.way[a]);
      v = motion.kept * v + motion.gained[a];
      enters |= (block.at[a][i] ^ (block.at[a][i] + way[a])) >> kParticleFixedLog2 != 0;
    }
    if (enters)
      go_by_axes(block, i, way, motion, probe);
    else
      for (int a = 0; a < 3; ++a) block.at[a][i] += way[a];
  }
}

}  // namespace sim
