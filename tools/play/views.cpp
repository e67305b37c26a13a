#include "tools/play/views.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include "tools/play/hud.h"
#include "world/gen/generator.h"

namespace tools {

namespace {

constexpr ImGuiWindowFlags kPlain = ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings;

void centre(float width, float height, float w, float h) {
  ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(w, width - 20), std::min(h, height - 20)});
}

bool contains_text(const std::string& text, const std::string& search) {
  const auto lower = [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); };
  const auto same = [&](char a, char b) { return lower(a) == lower(b == ' ' ? '_' : b); };
  return std::search(text.begin(), text.end(), search.begin(), search.end(), same) != text.end();
}

}  // namespace

// ---- blocks ----

std::string_view category_of(const world::Block& block, const world::BlockShapes& shapes, world::BlockId id) {
  if (std::max({block.emission.r, block.emission.g, block.emission.b}) > 0) return "Light";
  if (block.phase == world::Phase::liquid || block.phase == world::Phase::gas) return "Fluids";
  if (block.name.starts_with("glass") || block.name.ends_with("ice")) return "Glass";
  if (block.phase == world::Phase::granular) return "Loose";
  if (shapes.shape[id] && shapes.shape[id]->boxes.empty()) return "Plants";
  if (block.bsdf == "coverage" || block.name.find("leaves") != std::string::npos) return "Plants";
  if (block.ignition) return "Wood and wool";
  for (const char* made : {"brick", "concrete", "terracotta", "plaster", "roof", "asphalt"})
    if (block.name.starts_with(made)) return "Built";
  if (block.bsdf != "lambert" || block.name.ends_with("_block")) return "Metal and gems";
  return "Ground";
}

void PaletteView::open() {
  search_.clear();
  focus_ = true;
}

std::optional<world::BlockId> PaletteView::draw(const Game& game, float scale, bool& wants_close) {
  const world::BlockPalette& palette = game.palette();
  if (!shapes_ || shapes_->shape.size() != palette.size()) {
    auto made = world::block_shapes(palette);
    if (!made) return std::nullopt;
    shapes_ = std::move(*made);
  }
  const ImGuiIO& io = ImGui::GetIO();
  centre(io.DisplaySize.x, io.DisplaySize.y, 640 * scale, 500 * scale);
  bool open = true;
  std::optional<world::BlockId> chosen;
  ImGui::Begin("Blocks", &open, kPlain | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  if (focus_) ImGui::SetKeyboardFocusHere();
  focus_ = false;
  ImGui::SetNextItemWidth(-1);
  const bool entered = ImGui::InputTextWithHint("##search", "search: oak, lamp, red ...", &search_,
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  static constexpr const char* kCategories[] = {"All",   "Ground", "Built", "Wood and wool",  "Glass",
                                                "Light", "Fluids", "Loose", "Metal and gems", "Plants"};
  for (size_t i = 0; i < std::size(kCategories); ++i) {
    if (i > 0) ImGui::SameLine();
    const bool on = category_ == kCategories[i];
    if (on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
    if (ImGui::SmallButton(kCategories[i])) category_ = kCategories[i];
    if (on) ImGui::PopStyleColor();
  }
  ImGui::Separator();
  ImGui::BeginChild("all", {}, false, ImGuiWindowFlags_NavFlattened);
  const float size = 46 * scale;
  const int across = std::max(1, static_cast<int>(ImGui::GetContentRegionAvail().x / (size + 6 * scale)));
  int shown = 0;
  for (size_t n = 1; n < palette.size(); ++n) {
    const auto id = static_cast<world::BlockId>(n);
    const world::Block& block = palette[id];
    if (!search_.empty() && !contains_text(block.name, search_)) continue;
    if (upright_form(palette, *shapes_, id) != id) continue;  // the hand turns it to the wall
    const std::string_view category = category_of(block, *shapes_, id);
    if (search_.empty() && category_ != "All" && category != category_) continue;
    if (shown++ % across != 0) ImGui::SameLine(0, 6 * scale);
    const std::array<float, 3> rgb = swatch_of(block);
    ImGui::PushID(static_cast<int>(n));
    const bool clicked =
        ImGui::ColorButton(block.name.c_str(), {rgb[0], rgb[1], rgb[2], 1},
                           ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop, {size, size});
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s\n%s, %s", title_of(block.name).c_str(), std::string(category).c_str(),
                        std::string(world::phase_name(block.phase)).c_str());
    ImGui::PopID();
    if (clicked || (entered && shown == 1)) chosen = id;
  }
  if (shown == 0) ImGui::TextUnformatted("No block is called so.");
  ImGui::EndChild();
  ImGui::End();
  wants_close = !open || chosen.has_value();
  return chosen;
}

// ---- commands ----

void ConsoleView::open() {
  line_ = "/";
  focus_ = true;
  at_ = -1;
}

void ConsoleView::print(const std::string& line) {
  output_.push_back(line);
  ++printed_;
  if (output_.size() > 200) output_.erase(output_.begin());
}

int ConsoleView::callback(ImGuiInputTextCallbackData* data) {
  auto* view = static_cast<ConsoleView*>(data->UserData);
  const auto replace = [&](const std::string& line) {
    data->DeleteChars(0, data->BufTextLen);
    data->InsertChars(0, line.c_str());
  };
  if (data->EventFlag == ImGuiInputTextFlags_CallbackCompletion) {
    const std::string line(data->Buf, static_cast<size_t>(data->BufTextLen));
    replace(common_beginning(complete_command(line, *view->words_), line));
  } else if (data->EventFlag == ImGuiInputTextFlags_CallbackHistory && !view->history_.empty()) {
    const int n = static_cast<int>(view->history_.size());
    view->at_ = data->EventKey == ImGuiKey_UpArrow ? (view->at_ < 0 ? n - 1 : std::max(0, view->at_ - 1))
                                                   : (view->at_ < 0 ? -1 : view->at_ + 1);
    if (view->at_ >= n) view->at_ = -1;
    replace(view->at_ < 0 ? "/" : view->history_[static_cast<size_t>(view->at_)]);
  }
  return 0;
}

std::optional<std::string> ConsoleView::draw(const ConsoleWords& words, float height, float scale, bool& wants_close) {
  words_ = &words;
  std::optional<std::string> entered;
  ImGui::SetNextWindowPos({8 * scale, height - 8 * scale}, ImGuiCond_Always, {0, 1});
  ImGui::SetNextWindowSize({720 * scale, 260 * scale});
  ImGui::SetNextWindowBgAlpha(0.85f);
  ImGui::Begin("console", nullptr,
               kPlain | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  ImGui::BeginChild("lines", {0, -2.4f * ImGui::GetFrameHeightWithSpacing()});
  for (const std::string& line : output_) ImGui::TextWrapped("%s", line.c_str());
  ImGui::SetScrollHereY(1);
  ImGui::EndChild();
  // How it may go on.
  std::string hints;
  const std::vector<std::string> ways = complete_command(line_, words);
  for (size_t i = 0; i < ways.size() && hints.size() < 100; ++i) {
    const size_t space = ways[i].rfind(' ');
    hints += (i ? "  " : "") + (space == std::string::npos ? ways[i] : ways[i].substr(space + 1));
  }
  if (ways.empty())
    for (const CommandRow& row : command_rows())
      if (line_.starts_with("/" + std::string(row.name)))
        hints = std::string(row.name) + " " + std::string(row.arguments);
  ImGui::TextDisabled("%s", hints.c_str());
  if (focus_) ImGui::SetKeyboardFocusHere();
  ImGui::SetNextItemWidth(-1);
  if (ImGui::InputText("##line", &line_,
                       ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_CallbackCompletion |
                           ImGuiInputTextFlags_CallbackHistory | ImGuiInputTextFlags_CallbackAlways,
                       callback, this)) {
    if (line_.size() > 1) {
      history_.push_back(line_);
      print(line_);
      entered = line_;
    } else {
      wants_close = true;
    }
    line_ = "/";
    focus_ = true;
    at_ = -1;
  } else {
    focus_ = false;
  }
  ImGui::End();
  return entered;
}

// ---- menus ----

namespace {

bool wide_button(const char* text, float scale) { return ImGui::Button(text, {240 * scale, 34 * scale}); }

std::string stem_of(const std::string& path) { return std::filesystem::path(path).stem().string(); }

}  // namespace

MenuChoice MenuView::draw_start(const std::vector<SceneEntry>& scenes, PlaySettings& settings, float width,
                                float height, float scale) {
  MenuChoice choice;
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({width, height});
  ImGui::Begin(
      "start", nullptr,
      kPlain | ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::BeginChild("left", {260 * scale, 0}, false, ImGuiWindowFlags_NavFlattened);
  ImGui::SetWindowFontScale(2.2f);
  ImGui::TextUnformatted("Loam");
  ImGui::SetWindowFontScale(1);
  ImGui::TextDisabled("voxel worlds that run and shine");
  ImGui::Dummy({0, 10 * scale});
  std::error_code ignored;
  if (!settings.last_world.empty() && std::filesystem::exists(settings.last_world, ignored))
    if (wide_button(("Continue " + stem_of(settings.last_world)).c_str(), scale))
      choice.play = WorldChoice{.scene = settings.last_world, .generator = {}, .name = {}};
  if (wide_button("Scenes", scale)) page_ = Page::start;
  if (wide_button("New world", scale)) page_ = Page::new_world;
  if (wide_button("Settings and keys", scale)) page_ = Page::settings;
  if (wide_button("Help", scale)) choice.help = true;
  if (wide_button("Quit", scale)) choice.quit = true;
  ImGui::Dummy({0, 10 * scale});
  if (!settings.recent.empty()) ImGui::TextDisabled("Played last");
  for (const std::string& path : settings.recent) {
    if (!std::filesystem::exists(path, ignored)) continue;
    if (ImGui::Selectable(stem_of(path).c_str())) choice.play = WorldChoice{.scene = path, .generator = {}, .name = {}};
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", path.c_str());
  }
  ImGui::Dummy({0, 10 * scale});
  ImGui::PushTextWrapPos(250 * scale);
  ImGui::TextDisabled(
      "Drop a file on this window to play it: .loam, .vox, .mca, .schem, .vdb, .hgt, .obj, ... or a picture taken with "
      "F2.");
  ImGui::PopTextWrapPos();
  ImGui::EndChild();
  ImGui::SameLine(0, 20 * scale);
  ImGui::BeginChild("right", {}, false, ImGuiWindowFlags_NavFlattened);
  if (page_ == Page::settings) {
    draw_settings(settings, scale);
  } else if (page_ == Page::new_world) {
    ImGui::TextUnformatted("A new world");
    ImGui::Separator();
    ImGui::SetNextItemWidth(260 * scale);
    ImGui::InputText("name", &new_world_.name);
    ImGui::SetNextItemWidth(260 * scale);
    if (ImGui::BeginCombo("generator", new_world_.generator.c_str())) {
      for (const world::GeneratorInfo& info : world::generators())
        if (ImGui::Selectable((info.name + ": " + info.what).c_str(), info.name == new_world_.generator))
          new_world_.generator = info.name;
      ImGui::EndCombo();
    }
    for (const world::GeneratorInfo& info : world::generators())
      if (info.name == new_world_.generator) ImGui::TextDisabled("%s", info.what.c_str());
    int seed = static_cast<int>(new_world_.seed);
    ImGui::SetNextItemWidth(260 * scale);
    if (ImGui::InputInt("seed: another number, another land", &seed))
      new_world_.seed = static_cast<uint64_t>(std::max(0, seed));
    int size[3] = {new_world_.size.x, new_world_.size.y, new_world_.size.z};
    ImGui::SetNextItemWidth(260 * scale);
    if (ImGui::InputInt3("size in metres: x, height, z", size))
      for (int a = 0; a < 3; ++a) new_world_.size[a] = std::clamp(size[a], 16, 2048);
    ImGui::Dummy({0, 8 * scale});
    if (wide_button("Make it", scale)) choice.play = new_world_;
  } else {
    const float w = 224 * scale, h = 126 * scale;
    const int across = std::max(1, static_cast<int>(ImGui::GetContentRegionAvail().x / (w + 12 * scale)));
    for (size_t i = 0; i < scenes.size(); ++i) {
      if (static_cast<int>(i) % across != 0) ImGui::SameLine(0, 12 * scale);
      ImGui::PushID(static_cast<int>(i));
      ImGui::BeginGroup();
      const ImVec2 at = ImGui::GetCursorScreenPos();
      const bool clicked = ImGui::InvisibleButton("scene", {w, h + 2 * ImGui::GetTextLineHeight()});
      const bool hovered = ImGui::IsItemHovered();
      ImDrawList* list = ImGui::GetWindowDrawList();
      if (scenes[i].texture)
        list->AddImage(scenes[i].texture, at, {at.x + w, at.y + h});
      else
        list->AddRectFilled(at, {at.x + w, at.y + h}, IM_COL32(40, 46, 56, 255));
      list->AddRect(at, {at.x + w, at.y + h}, hovered ? IM_COL32(255, 255, 255, 255) : IM_COL32(255, 255, 255, 50), 0,
                    0, hovered ? 2.0f : 1.0f);
      list->AddText({at.x, at.y + h + 2}, IM_COL32_WHITE, title_of(scenes[i].name).c_str());
      if (hovered) {
        ImGui::BeginTooltip();
        ImGui::PushTextWrapPos(360 * scale);
        ImGui::TextUnformatted(scenes[i].what.c_str());
        ImGui::PopTextWrapPos();
        ImGui::EndTooltip();
      }
      ImGui::EndGroup();
      ImGui::PopID();
      if (clicked) choice.play = WorldChoice{.scene = scenes[i].name, .generator = {}, .name = {}};
    }
  }
  ImGui::EndChild();
  ImGui::End();
  return choice;
}

MenuChoice MenuView::draw_pause(PlaySettings& settings, const Game& game, float width, float height, float scale) {
  MenuChoice choice;
  const bool wide = page_ == Page::settings;
  centre(width, height, (wide ? 640 : 280) * scale, (wide ? 560 : 330) * scale);
  ImGui::Begin(game.name().c_str(), nullptr, kPlain | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  if (wide) {
    if (ImGui::Button("Back")) page_ = Page::start;
    draw_settings(settings, scale);
  } else {
    choice.resume = wide_button("Go on playing", scale);
    if (!game.path().empty()) choice.save = wide_button("Save", scale);
    if (wide_button("Settings and keys", scale)) page_ = Page::settings;
    choice.help = wide_button("Help", scale);
    choice.leave = wide_button("Save and go to the menu", scale);
    choice.quit = wide_button("Save and quit", scale);
    ImGui::PushTextWrapPos();
    ImGui::TextDisabled("%s", game.path().empty() ? "This world has no file." : game.path().c_str());
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
  return choice;
}

MenuChoice MenuView::draw_unsaved(const std::string& world, const std::string& why, float width, float height,
                                  float scale) {
  MenuChoice choice;
  centre(width, height, 420 * scale, 300 * scale);
  ImGui::Begin((world + " is not saved").c_str(), nullptr,
               kPlain | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  ImGui::PushTextWrapPos();
  ImGui::TextUnformatted(("It could not be saved: " + why + ".").c_str());
  ImGui::TextUnformatted("What was done since the last save is in memory alone. Make room, then try again.");
  ImGui::PopTextWrapPos();
  ImGui::Separator();
  choice.save = wide_button("Try again", scale);
  choice.resume = wide_button("Go on playing", scale);
  choice.lose = wide_button("Leave and lose it", scale);
  ImGui::End();
  return choice;
}

bool MenuView::draw_settings(PlaySettings& s, float scale) {
  bool changed = false;
  ImGui::PushItemWidth(240 * scale);
  const auto slider = [&](const char* name, double& value, float low, float high, const char* format) {
    float v = static_cast<float>(value);
    if (ImGui::SliderFloat(name, &v, low, high, format, ImGuiSliderFlags_AlwaysClamp))
      value = static_cast<double>(v), changed = true;
  };
  slider("mouse speed", s.mouse_speed, 0.1f, 5, "%.2f");
  changed |= ImGui::Checkbox("mouse up looks down", &s.invert_mouse);
  slider("angle of view", s.fov_deg, 45, 120, "%.0f degrees");
  slider("size of this interface", s.ui_scale, 0.5f, 3, "%.2f");
  bool automatic = s.picture_scale <= 0;
  if (ImGui::Checkbox("as many pixels as can be drawn 30 times a second", &automatic))
    s.picture_scale = automatic ? 0 : 1, changed = true;
  if (!automatic) slider("pixels of the picture", s.picture_scale, 0.1f, 1, "%.2f of the window's");
  changed |= ImGui::Checkbox("wait for the display (no tearing)", &s.vertical_sync);
  slider("save by itself every", s.autosave_s, 0, 600, "%.0f s");
  slider("a day takes (0: the sun stands still)", s.day_minutes, 0, 120, "%.0f minutes");
  ImGui::PopItemWidth();
  ImGui::Separator();
  return draw_keys(s) || changed;
}

bool MenuView::draw_keys(PlaySettings& s) {
  bool changed = false;
  for (const Bindings::Conflict& c : s.bindings.conflicts())
    ImGui::TextColored({1, 0.75f, 0.3f, 1}, "%s does two things: %s, and %s", key_name(c.key).c_str(),
                       std::string(row_of(c.a).what).c_str(), std::string(row_of(c.b).what).c_str());
  ImGui::BeginChild("keys", {}, false, ImGuiWindowFlags_NavFlattened);
  if (ImGui::BeginTable("keys", 3, ImGuiTableFlags_RowBg | ImGuiTableFlags_SizingStretchProp)) {
    for (const ActionRow& row : action_rows()) {
      ImGui::TableNextRow();
      ImGui::PushID(static_cast<int>(row.action));
      ImGui::TableNextColumn();
      ImGui::TextWrapped("%s", std::string(row.what).c_str());
      ImGui::TableNextColumn();
      const bool waits = waiting_ == row.action;
      if (ImGui::Button(waits ? "press a key ..." : s.bindings.text(row.action).c_str(), {-1, 0}))
        waiting_ = waits ? std::nullopt : std::optional(row.action);
      ImGui::TableNextColumn();
      if (ImGui::SmallButton("as usual")) s.bindings.reset(row.action), changed = true;
      ImGui::PopID();
    }
    ImGui::EndTable();
  }
  ImGui::EndChild();
  return changed;
}

constexpr const char* kGamepadHelp =
    "Gamepad: the left stick walks (pressed: runs), the right one looks (pressed: takes the block), A jumps, B "
    "crouches "
    "and closes, X undoes, Y opens all blocks, triggers place and break, bumpers choose, start opens the menu; in "
    "menus "
    "the cross moves and A chooses.";

bool draw_help(const Bindings& bindings, float width, float height, float scale) {
  centre(width, height, 1100 * scale, 710 * scale);
  bool open = true;
  ImGui::Begin("How to play", &open, kPlain | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  ImGui::TextWrapped(
      "Walk with %s %s %s %s, jump with %s; press it twice to fly. The mouse looks round: the left button breaks, the "
      "right one places what is in hand, the middle one takes what is there. %s opens all blocks, 1 to 9 and the wheel "
      "choose. %s undoes anything, with all that followed from it. %s lets go of the mouse.",
      bindings.text(Action::forward).c_str(), bindings.text(Action::left).c_str(), bindings.text(Action::back).c_str(),
      bindings.text(Action::right).c_str(), bindings.text(Action::jump).c_str(), bindings.text(Action::palette).c_str(),
      bindings.text(Action::undo).c_str(), bindings.text(Action::menu).c_str());
  ImGui::Separator();
  static constexpr std::pair<const char*, const char*> kGroups[] = {
      {"move", "Move"}, {"build", "Build"}, {"time", "Time"}, {"view", "See"}, {"world", "World"}};
  if (ImGui::BeginTable("groups", 2, ImGuiTableFlags_SizingStretchSame)) {
    ImGui::TableNextColumn();
    for (const auto& [group, title] : kGroups) {
      if (std::strcmp(group, "time") == 0) ImGui::TableNextColumn();
      ImGui::TextColored({0.55f, 0.8f, 1, 1}, "%s", title);
      for (const ActionRow& row : action_rows()) {
        if (row.group != group || (row.action > Action::slot_1 && row.action <= Action::slot_9)) continue;
        ImGui::Text("%s", row.action == Action::slot_1 ? "1 to 9" : bindings.text(row.action).c_str());
        ImGui::SameLine(180 * scale);
        ImGui::TextWrapped(
            "%s", row.action == Action::slot_1 ? "what is in hand; the wheel too" : std::string(row.what).c_str());
      }
      ImGui::Spacing();
    }
    ImGui::EndTable();
  }
  ImGui::TextWrapped("%s", kGamepadHelp);
  if (ImGui::Button("Play", {160 * scale, 32 * scale})) open = false;
  ImGui::SameLine();
  ImGui::TextDisabled("%s shows this again", bindings.text(Action::help).c_str());
  ImGui::End();
  return !open;
}

}  // namespace tools
