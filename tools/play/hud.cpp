#include "tools/play/hud.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <imgui.h>

#include "render/image/display.h"
#include "sim/matter/thermal.h"
#include "world/base/text.h"

namespace tools {

using world::Vec3d;
using world::VoxelPos;
using world::WorldPoint;

void FrameTimes::add(double ms) {
  ms_[next_] = ms;
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
}

double FrameTimes::percentile(double share) const {
  if (count_ == 0) return 0;
  std::vector<double> sorted(ms_.begin(), ms_.begin() + static_cast<std::ptrdiff_t>(count_));
  const auto at = static_cast<size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(count_ - 1) + 0.5);
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(at), sorted.end());
  return sorted[at];
}

std::vector<float> FrameTimes::values() const {
  std::vector<float> all;
  for (size_t i = 0; i < count_; ++i) all.push_back(static_cast<float>(ms_[(next_ + kKept - count_ + i) % kKept]));
  return all;
}

double FrameTimes::sum_ms() const {
  double sum = 0;
  for (size_t i = 0; i < count_; ++i) sum += ms_[i];
  return sum;
}

bool project(const render::Camera& camera, int width, int height, const WorldPoint& point, float& x, float& y) {
  const render::PixelRays rays(camera, width, height);
  const Vec3d to = point - camera.position;
  const double depth = glm::dot(to, rays.forward);
  if (depth < 0.02) return false;
  x = static_cast<float>((glm::dot(to, rays.right) / depth / rays.tan_half_x + 1) / 2 * width);
  y = static_cast<float>((1 - glm::dot(to, rays.up) / depth / rays.tan_half_y) / 2 * height);
  return true;
}

std::array<float, 3> swatch_of(const world::Block& block) {
  std::array<float, 3> rgb{block.albedo.r, block.albedo.g, block.albedo.b};
  const float most = std::max({block.emission.r, block.emission.g, block.emission.b});
  if (most > 0) rgb = {block.emission.r / most, block.emission.g / most, block.emission.b / most};
  const float passes = std::max({block.transmission.r, block.transmission.g, block.transmission.b});
  if (most <= 0 && passes > 0.3f) rgb = {block.transmission.r, block.transmission.g, block.transmission.b};
  if (block.phase == world::Phase::liquid && most <= 0) {
    // What is left of white light after 2 m.
    rgb = {std::exp(-2 * block.absorption.r), std::exp(-2 * block.absorption.g), std::exp(-2 * block.absorption.b)};
  }
  for (float& c : rgb) c = render::srgb_from_linear(c);
  return rgb;
}

std::string title_of(const std::string& name) {
  std::string title = name;
  std::replace(title.begin(), title.end(), '_', ' ');
  if (!title.empty()) title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  return title;
}

namespace {

ImU32 colour(const std::array<float, 3>& rgb, float alpha = 1) {
  return ImGui::ColorConvertFloat4ToU32({rgb[0], rgb[1], rgb[2], alpha});
}

/// The edges of a box that belong to a face which looks at the camera.
void draw_box(const render::Camera& camera, const WorldPoint& low, const Vec3d& size, float width, float height,
              ImU32 tint, float thickness) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const Vec3d eye = camera.position - low;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      const int b = (axis + 1) % 3, c = (axis + 2) % 3;
      const bool high_b = corner & 1, high_c = corner & 2;
      const bool sees_b = high_b ? eye[b] > size[b] : eye[b] < 0, sees_c = high_c ? eye[c] > size[c] : eye[c] < 0;
      if (!sees_b && !sees_c) continue;
      Vec3d from(0);
      from[b] = high_b ? size[b] : 0, from[c] = high_c ? size[c] : 0;
      Vec3d to = from;
      to[axis] = size[axis];
      ImVec2 p, q;
      const int w = static_cast<int>(width), h = static_cast<int>(height);
      if (!project(camera, w, h, low + from, p.x, p.y) || !project(camera, w, h, low + to, q.x, q.y)) continue;
      list->AddLine(p, q, IM_COL32(255, 255, 255, 90), thickness + 1.5f);
      list->AddLine(p, q, tint, thickness);
    }
}

void text_with_shadow(ImDrawList* list, ImVec2 at, ImU32 tint, const std::string& text) {
  list->AddText({at.x + 1, at.y + 1}, IM_COL32(0, 0, 0, 200), text.c_str());
  list->AddText(at, tint, text.c_str());
}

}  // namespace

void draw_outline(const Game& game, const render::Camera& camera, float width, float height) {
  const Pick& target = game.target();
  if (target.hit) {
    constexpr double kOut = 0.002;  // beside the face, so that lines don't sink into it
    const WorldPoint low = WorldPoint{target.voxel, Vec3d(0)} + (Vec3d(target.low) - kOut);
    draw_box(camera, low, Vec3d(target.high) - Vec3d(target.low) + 2 * kOut, width, height, IM_COL32(0, 0, 0, 220),
             1.5f);
  }
  if (const world::VoxelBox box = game.brush_bounds(); !box.empty())
    draw_box(camera, WorldPoint{box.min, Vec3d(0)},
             Vec3d(box.max.x - box.min.x + 1, box.max.y - box.min.y + 1, box.max.z - box.min.z + 1), width, height,
             IM_COL32(255, 200, 40, 255), 2);
  if (game.third_person) {
    const WalkState& p = game.state().now;
    const WorldPoint foot = game.eye() + Vec3d(-sim::kPlayerWidth / 2, -p.eye_height, -sim::kPlayerWidth / 2);
    draw_box(camera, foot,
             Vec3d(sim::kPlayerWidth, p.crouches ? sim::kCrouchedHeight : sim::kPlayerHeight, sim::kPlayerWidth), width,
             height, IM_COL32(90, 190, 255, 255), 2);
  }
}

void draw_hud(const Game& game, const Bindings& bindings, float width, float height, float scale) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  // The cross: dark under light, to be seen on snow and at night.
  const float cx = std::floor(width / 2) + 0.5f, cy = std::floor(height / 2) + 0.5f, arm = 8 * scale;
  for (const auto& [tint, thickness] :
       {std::pair{IM_COL32(0, 0, 0, 160), 3.5f}, {IM_COL32(255, 255, 255, 230), 1.5f}}) {
    list->AddLine({cx - arm, cy}, {cx + arm, cy}, tint, thickness);
    list->AddLine({cx, cy - arm}, {cx, cy + arm}, tint, thickness);
  }
  // What is in hand.
  const float size = 44 * scale, gap = 4 * scale;
  const float left = (width - kSlots * size - (kSlots - 1) * gap) / 2, top = height - size - 10 * scale;
  for (int i = 0; i < kSlots; ++i) {
    const float x = left + static_cast<float>(i) * (size + gap);
    const world::Block& block = game.palette()[game.slots()[static_cast<size_t>(i)]];
    list->AddRectFilled({x, top}, {x + size, top + size}, IM_COL32(10, 12, 16, 150), 4 * scale);
    const float pad = 8 * scale;
    const ImVec2 a{x + pad, top + pad}, b{x + size - pad, top + size - pad};
    list->AddRectFilled(a, b, colour(swatch_of(block)), 3 * scale);
    list->AddRect(a, b, IM_COL32(0, 0, 0, 120), 3 * scale);
    const bool held = i == game.slot();
    list->AddRect({x, top}, {x + size, top + size}, held ? IM_COL32(255, 255, 255, 255) : IM_COL32(255, 255, 255, 60),
                  4 * scale, 0, held ? 2.5f * scale : 1);
    text_with_shadow(list, {x + 3 * scale, top + 1 * scale}, IM_COL32(255, 255, 255, 200), std::to_string(i + 1));
  }
  const std::string name = title_of(game.palette()[game.in_hand()].name);
  const ImVec2 extent = ImGui::CalcTextSize(name.c_str());
  text_with_shadow(list, {(width - extent.x) / 2, top - extent.y - 6 * scale}, IM_COL32_WHITE, name);
  if (game.brush != BrushKind::single) {
    const std::string brush = "Brush: " + game.brush_text();
    const ImVec2 brush_extent = ImGui::CalcTextSize(brush.c_str());
    text_with_shadow(list, {(width - brush_extent.x) / 2, top - 2 * extent.y - 10 * scale},
                     IM_COL32(255, 220, 110, 255), brush);
  }
  // Time and how much moves: the first thing that is asked of a world that is a simulation.
  const PlayState& s = game.state();
  std::string time = s.paused ? "Paused" : s.speed_eighths == 8 ? "" : fmt::format("{:g}x", s.speed_eighths / 8.0);
  if (const float hours = game.picture.knobs.time_of_day; hours >= 0) {
    const int minutes = static_cast<int>(hours * 60 + 0.01f) % 1440;
    time = fmt::format("{:02d}:{:02d}{}{}", minutes / 60, minutes % 60, time.empty() ? "" : "   ", time);
  }
  if (s.paused)
    time += fmt::format("   {}: go on   {} and {}: a tick", bindings.text(Action::pause),
                        bindings.text(Action::tick_back), bindings.text(Action::tick_forward));
  if (!time.empty()) {
    const ImVec2 e = ImGui::CalcTextSize(time.c_str());
    text_with_shadow(list, {(width - e.x) / 2, 12 * scale}, IM_COL32(255, 220, 110, 255), time);
  }
  std::vector<std::string> lines;
  lines.push_back(s.settled ? "All is at rest" : fmt::format("{} leaves awake", world::with_thousands(s.awake_leaves)));
  for (const sim::LedgerRow& row : s.ledger) {
    const auto block = game.palette().find(row.substance);
    if (row.is_heat || !block || game.palette()[*block].phase == world::Phase::solid) continue;
    if (game.palette()[*block].phase == world::Phase::granular && row.in == 0 && row.out == 0) continue;
    lines.push_back(fmt::format("{} {:.3f} m3{}", title_of(row.substance),
                                static_cast<double>(row.now) / sim::kFullVoxel, row.exact() ? "" : " (NOT BALANCED)"));
    if (lines.size() > 5) break;
  }
  if (s.now.flies) lines.push_back(s.now.passes ? "Flies through blocks" : "Flies");
  float y = top + size;
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    const ImVec2 e = ImGui::CalcTextSize(line->c_str());
    y -= e.y + 2 * scale;
    text_with_shadow(list, {width - e.x - 12 * scale, y}, IM_COL32(225, 232, 240, 230), *line);
  }
}

void draw_messages(const Game& game, float width, float height, float scale) {
  ImDrawList* list = ImGui::GetForegroundDrawList();
  float y = height - 90 * scale;
  for (auto message = game.messages().rbegin(); message != game.messages().rend(); ++message) {
    const float most = width - 28 * scale, line = ImGui::GetTextLineHeight();
    const ImVec2 e = ImGui::CalcTextSize(message->text.c_str(), nullptr, false, most);
    y -= e.y - line;  // its last line stands where a single one would
    list->AddRectFilled({8 * scale, y - 3 * scale}, {20 * scale + e.x, y + e.y + 3 * scale}, IM_COL32(10, 12, 16, 190),
                        4);
    list->AddText(nullptr, 0, {14 * scale, y}, IM_COL32(255, 255, 255, 255), message->text.c_str(), nullptr, most);
    y -= line + 8 * scale;
  }
}

namespace {

void draw_graph(const FrameTimes& times, float scale) {
  const std::vector<float> values = times.values();
  const ImVec2 at = ImGui::GetCursorScreenPos(), size{300 * scale, 60 * scale};
  ImGui::Dummy(size);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + size.x, at.y + size.y}, IM_COL32(0, 0, 0, 120));
  const float most = std::max(40.0f, values.empty() ? 0.0f : *std::max_element(values.begin(), values.end()));
  for (const float ms : {16.7f, 33.3f}) {
    const float y = at.y + size.y * (1 - ms / most);
    list->AddLine({at.x, y}, {at.x + size.x, y}, IM_COL32(255, 255, 255, 50));
  }
  const float step = size.x / static_cast<float>(FrameTimes::kKept);
  for (size_t i = 0; i < values.size(); ++i) {
    const float h = size.y * std::min(1.0f, values[i] / most);
    const auto rgb = cividis(values[i] / 50);
    const float x = at.x + static_cast<float>(i) * step;
    list->AddRectFilled({x, at.y + size.y - h}, {x + std::max(1.0f, step), at.y + size.y},
                        IM_COL32(rgb[0], rgb[1], rgb[2], 255));
  }
}

void draw_passes(const render::FrameReport& report) {
  if (!ImGui::BeginTable("passes", 4, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) return;
  for (const char* head : {"pass", "ms", "draws", "sent"}) ImGui::TableSetupColumn(head);
  ImGui::TableHeadersRow();
  for (const render::PassReport& pass : report.passes) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn(), ImGui::TextUnformatted(pass.name.c_str());
    ImGui::TableNextColumn(), ImGui::Text("%.2f", pass.ms);
    ImGui::TableNextColumn(), ImGui::Text("%s", pass.draws ? world::with_thousands(pass.draws).c_str() : "");
    ImGui::TableNextColumn(),
        ImGui::Text("%s", pass.bytes ? world::bytes_text(static_cast<double>(pass.bytes)).c_str() : "");
  }
  ImGui::EndTable();
}

void draw_matter(const PlayState& s) {
  if (!ImGui::BeginTable("matter", 3, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) return;
  for (const char* head : {"effect", "ms so far", "leaves visited"}) ImGui::TableSetupColumn(head);
  ImGui::TableHeadersRow();
  for (const sim::EffectReport& effect : s.effects) {
    if (!effect.called_for) continue;
    ImGui::TableNextRow();
    ImGui::TableNextColumn(), ImGui::TextUnformatted(effect.name.c_str());
    ImGui::TableNextColumn(), ImGui::Text("%.1f", effect.ms);
    ImGui::TableNextColumn(), ImGui::TextUnformatted(world::with_thousands(effect.leaves_visited).c_str());
  }
  ImGui::EndTable();
}

}  // namespace

void draw_statistics(const Game& game, const HudNumbers& n, StatisticsMode mode, float scale) {
  if (mode == StatisticsMode::off) return;
  ImGui::SetNextWindowPos({8 * scale, 8 * scale});
  ImGui::SetNextWindowBgAlpha(0.6f);
  ImGui::Begin("statistics", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoSavedSettings);
  const PlayState& s = game.state();
  const double seconds = n.frames.sum_ms() / 1000;
  ImGui::Text("%.0f frames/s, pictures %.1f ms (1 %% above %.1f)",
              seconds > 0 ? static_cast<double>(n.frames.count()) / seconds : 0, n.pictures.percentile(0.5),
              n.pictures.percentile(0.99));
  const WorldPoint& p = s.now.foot;
  ImGui::Text("%s %dx%d, %s faces", n.last.backend.c_str(), n.last.width, n.last.height,
              world::with_thousands(n.last.report.faces_drawn).c_str());
  ImGui::Text("at %.1f %.1f %.1f, tick %llu", p.voxel.x + p.fraction.x, p.voxel.y + p.fraction.y,
              p.voxel.z + p.fraction.z, static_cast<unsigned long long>(s.tick));
  if (mode == StatisticsMode::full) {
    ImGui::TextUnformatted(n.last.report.device.c_str());
    ImGui::Text("shown by %s", n.shown_by.c_str());
    draw_graph(n.pictures, scale);
    ImGui::Text("pictures: half in %.1f ms, 95 %% in %.1f, 99 %% in %.1f; light %.2f, world %.2f, display %.2f",
                n.pictures.percentile(0.5), n.pictures.percentile(0.95), n.pictures.percentile(0.99), n.last.light_ms,
                n.last.mirror_ms, n.last.display_ms);
    draw_passes(n.last.report);
    if (n.last.difference)
      ImGui::Text("the two differ: FLIP %.4f, PSNR %.1f dB, %.2f %% of pixels within 1/255", n.last.difference->flip,
                  n.last.difference->psnr, 100 * n.last.difference->fraction_within_1);
    ImGui::Separator();
    ImGui::Text("matter: %.2f ms the last tick, %s leaves awake, %llu ticks dropped", s.matter_ms,
                world::with_thousands(s.awake_leaves).c_str(), static_cast<unsigned long long>(s.dropped_ticks));
    draw_matter(s);
    ImGui::Text("memory: blocks %s, twice; matter %s; light %s; history %s",
                world::bytes_text(static_cast<double>(s.store_bytes)).c_str(),
                world::bytes_text(static_cast<double>(s.matter_bytes)).c_str(),
                world::bytes_text(static_cast<double>(n.last.light_bytes)).c_str(),
                world::bytes_text(static_cast<double>(s.history_bytes)).c_str());
    for (const world::LayerInfo& layer : s.layers)
      ImGui::Text("  layer %s: %s", layer.name.c_str(), world::bytes_text(static_cast<double>(layer.bytes)).c_str());
    if (game.target().hit) {
      const Pick& t = game.target();
      const world::Block& b = game.palette()[t.block];
      ImGui::Separator();
      ImGui::Text("%s at %d %d %d, %s, hardness %.1f, %.0f kg/m3", title_of(b.name).c_str(), t.voxel.x, t.voxel.y,
                  t.voxel.z, std::string(world::phase_name(b.phase)).c_str(), static_cast<double>(b.hardness),
                  static_cast<double>(b.density.value));
    }
  }
  ImGui::End();
}

}  // namespace tools
