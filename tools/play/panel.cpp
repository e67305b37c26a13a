#include "tools/play/panel.h"

#include <algorithm>

#include <fmt/format.h>
#include <imgui.h>

namespace tools {

namespace {

const std::vector<world::KnobRow<render::RenderKnobs>>& rows() { return render::render_knobs().rows(); }

std::string shown(const std::string& value) { return value == "1e+09" ? "all" : value; }

}  // namespace

/// What each knob could be: its rungs, and what it is now.
std::vector<KnobPanel::Cell> KnobPanel::cells(const render::RenderKnobs& now) const {
  std::vector<Cell> all;
  for (const auto& row : rows()) {
    if (is_of_moment(row.name)) continue;
    std::vector<std::string> values = row.choices;
    if (values.empty()) values = {row.fast, row.usual, row.exact, row.get(now)};
    for (size_t i = 0; i < values.size(); ++i)
      if (std::find(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i), values[i]) ==
          values.begin() + static_cast<std::ptrdiff_t>(i))
        all.push_back({row.name, values[i]});
  }
  return all;
}

std::optional<PictureSettings> KnobPanel::next_to_measure(const PictureRequest& request) {
  asked_.reset();
  if (request.mode != ViewMode::single) return std::nullopt;
  if (request.settings.backend != backend_) known_.clear(), backend_ = request.settings.backend, next_ = 0;
  const std::vector<Cell> all = cells(request.settings.knobs);
  if (all.empty()) return std::nullopt;
  const Cell cell = all[next_++ % all.size()];
  PictureSettings settings = request.settings;
  if (!render::render_knobs().set(settings.knobs, cell.knob, cell.value).ok()) return std::nullopt;
  asked_ = cell;
  return settings;
}

void KnobPanel::took(const Picture& picture) {
  now_ms_ = now_ms_ > 0 ? now_ms_ * 0.8 + picture.report.ms * 0.2 : picture.report.ms;
  if (!picture.measured || !asked_) return;
  known_[{asked_->knob, asked_->value}] = {picture.measured->ms, picture.measured->difference.flip, true};
  now_error_ = picture.measured->now.flip;
}

std::vector<MeasuredKnob> KnobPanel::measured(const render::RenderKnobs& now) const {
  std::vector<MeasuredKnob> all;
  for (const auto& row : rows()) {
    MeasuredKnob knob{row.name, row.get(now), {}};
    for (const auto& [key, known] : known_)
      if (key.first == row.name && known.measured) knob.settings.push_back({key.second, known.ms, known.error});
    if (knob.settings.size() > 1) all.push_back(std::move(knob));
  }
  return all;
}

bool KnobPanel::draw(Game& game, const HudNumbers&, PlaySettings& settings, float scale) {
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos({io.DisplaySize.x - 8 * scale, 8 * scale}, ImGuiCond_Always, {1, 0});
  ImGui::SetNextWindowSize({std::min(620 * scale, io.DisplaySize.x - 16), io.DisplaySize.y - 90 * scale});
  ImGui::SetNextWindowBgAlpha(0.88f);
  bool open = true;
  ImGui::Begin("What each option costs", &open,
               ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove);
  ImGui::Text("%s: %.1f ms a picture, FLIP %.4f from the same at its most exact", game.picture.backend.c_str(), now_ms_,
              now_error_);
  for (const render::BackendInfo& info : render::backends()) {
    if (ImGui::RadioButton(info.name.c_str(), game.picture.backend == info.name)) game.picture.backend = info.name;
    ImGui::SameLine();
  }
  for (const auto& [name, accuracy] : {std::pair{"fast", world::Accuracy::fast},
                                       {"usual", world::Accuracy::usual},
                                       {"exact", world::Accuracy::exact}}) {
    if (ImGui::Button(name)) game.set_accuracy(accuracy);
    ImGui::SameLine();
  }
  for (const double budget : {16.0, 33.0}) {
    if (ImGui::Button(fmt::format("fit {:.0f} ms", budget).c_str())) {
      const SettingsPlan fit = plan_settings(measured(game.picture.knobs), now_ms_, budget);
      for (const auto& [knob, value] : fit.changes)
        (void)render::render_knobs().set(game.picture.knobs, knob, value).ok();
      fitted_ = fmt::format("{} knobs set; {:.1f} ms expected{}", fit.changes.size(), fit.ms,
                            fit.fits ? "" : ": less can't be had");
    }
    ImGui::SameLine();
  }
  if (ImGui::Button("keep")) {
    settings.knobs.clear();
    for (const auto& row : rows())
      if (!is_of_moment(row.name) && row.get(game.picture.knobs) != row.usual)
        settings.knobs[row.name] = row.get(game.picture.knobs);
    fitted_ = "kept for all worlds";
  }
  if (!fitted_.empty()) ImGui::TextDisabled("%s", fitted_.c_str());
  ImGui::BeginChild("rows", {}, false, ImGuiWindowFlags_NavFlattened);
  if (ImGui::BeginTable("knobs", 3, ImGuiTableFlags_RowBg | ImGuiTableFlags_SizingFixedFit)) {
    ImGui::TableSetupColumn("knob");
    ImGui::TableSetupColumn("is");
    ImGui::TableSetupColumn("could be: ms, FLIP error", ImGuiTableColumnFlags_WidthStretch);
    ImGui::TableHeadersRow();
    const std::vector<Cell> all = cells(game.picture.knobs);
    for (const auto& row : rows()) {
      if (is_of_moment(row.name)) continue;
      ImGui::TableNextRow();
      ImGui::PushID(row.name.c_str());
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(row.name.c_str());
      if (ImGui::IsItemHovered()) {
        ImGui::BeginTooltip();
        ImGui::PushTextWrapPos(420 * scale);
        ImGui::TextUnformatted(row.what.c_str());
        ImGui::PopTextWrapPos();
        ImGui::EndTooltip();
      }
      ImGui::TableNextColumn();
      const std::string now = row.get(game.picture.knobs);
      ImGui::Text("%s %s", shown(now).c_str(), row.unit.c_str());
      ImGui::TableNextColumn();
      bool first = true;
      for (const Cell& cell : all) {
        if (cell.knob != row.name) continue;
        if (!first && ImGui::GetContentRegionAvail().x > 0) ImGui::SameLine();
        first = false;
        const auto known = known_.find({cell.knob, cell.value});
        const bool is_known = known != known_.end();
        const std::string text =
            is_known ? fmt::format("{}  {:.1f}  {:.3f}", shown(cell.value), known->second.ms, known->second.error)
                     : shown(cell.value) + "  ...";
        const bool on = cell.value == now;
        if (on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
        if (!first && ImGui::GetContentRegionAvail().x < ImGui::CalcTextSize(text.c_str()).x + 10) ImGui::NewLine();
        if (ImGui::SmallButton(text.c_str()))
          (void)render::render_knobs().set(game.picture.knobs, cell.knob, cell.value).ok();
        if (on) ImGui::PopStyleColor();
      }
      ImGui::PopID();
    }
    ImGui::EndTable();
  }
  ImGui::EndChild();
  ImGui::End();
  return !open;
}

}  // namespace tools
