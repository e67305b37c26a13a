/// What lies over the picture: the cross, the outline, the hotbar, and what there is to say of world and pictures.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tools/play/game.h"

namespace tools {

enum class StatisticsMode { brief, full, off };

/// Times of the last frames, of the window and of pictures.
class FrameTimes {
 public:
  static constexpr size_t kKept = 240;
  void add(double ms);
  /// The time that this share of the frames was not above: 0.5 the median; 0 where there are none.
  double percentile(double share) const;
  size_t count() const { return count_; }
  /// Oldest first.
  std::vector<float> values() const;
  double sum_ms() const;

 private:
  std::array<double, kKept> ms_{};
  size_t count_ = 0, next_ = 0;
};

struct HudNumbers {
  FrameTimes frames, pictures;
  Picture last;          // without its pixels
  std::string shown_by;  // the window's device
  double picture_latency_ms = 0;
};

/// Where a point appears in a picture of this size; false where it lies behind the eye.
bool project(const render::Camera& camera, int width, int height, const world::WorldPoint& point, float& x, float& y);

/// The colour that a block shows in palettes: of its light where it shines, else its albedo.
std::array<float, 3> swatch_of(const world::Block& block);
/// "oak_planks" -> "Oak planks".
std::string title_of(const std::string& block_name);

// With ImGui, between its NewFrame and Render; pixels of the window.
/// `camera` is that of the picture that is shown.
void draw_outline(const Game& game, const render::Camera& camera, float width, float height);
void draw_hud(const Game& game, const Bindings& bindings, float width, float height, float scale);
void draw_messages(const Game& game, float width, float height, float scale);
void draw_statistics(const Game& game, const HudNumbers& numbers, StatisticsMode mode, float scale);

}  // namespace tools
