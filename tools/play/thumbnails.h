/// Small pictures of the shipped scenes, for the menu: drawn by the ray caster behind it, and kept in
/// $XDG_CACHE_HOME/loam/thumbnails until the program changes.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "render/image/image.h"

namespace tools {

constexpr int kThumbnailWidth = 224, kThumbnailHeight = 126;

class Thumbnails {
 public:
  Thumbnails();   // begins at once
  ~Thumbnails();  // ends after the scene at hand
  struct Made {
    std::string scene;
    render::Image8 image;
  };
  /// Those that were made since the last call.
  std::vector<Made> take();
  /// While a game is played, the processor is its own.
  void pause(bool paused) { paused_ = paused; }

 private:
  void run();
  std::mutex mutex_;
  std::vector<Made> made_;
  std::atomic<bool> stop_{false}, paused_{false};
  std::thread thread_;
};

}  // namespace tools
