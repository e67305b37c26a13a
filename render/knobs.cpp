#include "render/knobs.h"

namespace render {

const world::KnobTable<RenderKnobs>& render_knobs() {
  static const world::KnobTable<RenderKnobs> table = [] {
    world::KnobTable<RenderKnobs> t;
#define KNOB(name, type, fast, usual, exact, unit, what) \
  t.add<type>(#name, &RenderKnobs::name, fast, usual, exact, unit, what);
#include "render/knobs.def"
#undef KNOB
    return t;
  }();
  return table;
}

}  // namespace render
