#include "tools/bench/report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "world/base/text.h"

namespace tools {

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

namespace {

Json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json();
}

Json spread_json(const Spread& s) {
  return {{"median", number_or_null(s.median)}, {"q1", number_or_null(s.q1)},       {"q3", number_or_null(s.q3)},
          {"min", number_or_null(s.minimum)},   {"max", number_or_null(s.maximum)}, {"count", s.count}};
}

Json header_json(const Machine& machine, const RunOptions& options) {
  Json json;
  json["machine"] = machine_json(machine);
  json["commit"] = build_commit();
  json["quick"] = options.quick;
  json["seed"] = options.seed;
  return json;
}

std::string threads_text(int threads) { return threads == 1 ? "a core" : fmt::format("{} threads", threads); }

/// In the row's unit.
Json reach_json(const RowResult& r) {
  if (!r.reach) return {};
  if (!r.reach->times_rival) return r.reach->value;
  if (r.rivals.empty()) return {};
  const double rival = r.rivals[0].value.median;
  return number_or_null(r.better == Better::higher ? rival * r.reach->value : rival / r.reach->value);
}

Json row_json(const RowResult& r) {
  const bool rival = !r.rivals.empty();
  Json json = {{"suite", r.suite},
               {"name", r.name},
               {"value", number_or_null(r.error.empty() ? r.value.median : NAN)},
               {"unit", r.unit},
               {"better", r.better == Better::higher ? "higher" : "lower"},
               {"rival", rival ? Json(r.rivals[0].name) : Json()},
               {"rival_value", rival ? number_or_null(r.rivals[0].value.median) : Json()},
               {"ratio", r.ratio ? number_or_null(r.ratio->median) : Json()},
               {"reach", reach_json(r)},
               {"met", r.met ? Json(*r.met) : Json()},
               {"what", r.what},
               {"threads", r.threads},
               {"clock", r.thread_clock ? "thread" : "wall"},
               {"ours", r.ours},
               {"spread", spread_json(r.value)},
               {"ratio_spread", r.ratio ? spread_json(*r.ratio) : Json()},
               {"calls", r.calls},
               {"cpu_ms", number_or_null(r.cpu_ms)},
               {"reach_times_rival", r.reach && r.reach->times_rival ? Json(r.reach->value) : Json()},
               {"reach_origin", r.reach ? Json(r.reach->origin) : Json()},
               {"limit", r.limit ? Json(r.limit->value) : Json()},
               {"limit_origin", r.limit ? Json(r.limit->origin) : Json()},
               {"error", r.error.empty() ? Json() : Json(r.error)}};
  json["rivals"] = Json::array();
  for (const ContenderResult& c : r.rivals)
    json["rivals"].push_back({{"name", c.name}, {"spread", spread_json(c.value)}});
  json["counters"] = Json::object();
  for (const auto& [name, value] : r.counters) json["counters"][name] = number_or_null(value);
  return json;
}

Json subject_json(const SubjectResult& s) {
  Json json = {{"name", s.name},
               {"question", s.question},
               {"reference", s.reference},
               {"metric", s.metrics.empty() ? "" : s.metrics[0]},
               {"metrics", s.metrics},
               {"work_unit", s.work_unit},
               {"noise_floor", s.noise_floor},
               {"threads", s.threads},
               {"error", s.error.empty() ? Json() : Json(s.error)}};
  json["points"] = Json::array();
  for (const PointResult& p : s.points) {
    Json errors = Json::array();
    for (const Spread& e : p.errors) errors.push_back(spread_json(e));
    json["points"].push_back({{"setting", p.setting},
                              {"error", p.errors.empty() ? Json() : number_or_null(p.errors[0].median)},
                              {"bias", number_or_null(p.bias)},
                              {"work", number_or_null(p.work)},
                              {"ms", number_or_null(p.ms.median)},
                              {"spread", number_or_null(p.ms.iqr())},
                              {"method", p.method},
                              {"problem", p.problem},
                              {"knob", p.knob},
                              {"errors", errors},
                              {"ms_spread", spread_json(p.ms)},
                              {"default", p.is_default},
                              {"reference", p.is_reference},
                              {"failed", p.failed},
                              {"noise_floor", p.noise_floor},
                              {"below_floor", p.below_floor},
                              {"front", p.front},
                              {"default_on_front", p.default_on_front ? Json(*p.default_on_front) : Json()},
                              {"command", p.command}});
  }
  json["slopes"] = Json::array();
  for (const SlopeResult& slope : s.slopes)
    json["slopes"].push_back({{"method", slope.method},
                              {"expected", slope.expected},
                              {"fitted", number_or_null(slope.fitted)},
                              {"met", slope.met}});
  json["biases"] = Json::array();
  for (const BiasResult& bias : s.biases)
    json["biases"].push_back(
        {{"method", bias.method}, {"limit", bias.limit}, {"bias", number_or_null(bias.bias)}, {"met", bias.met}});
  return json;
}

}  // namespace

std::string number_text(double value) {
  if (std::isnan(value)) return "failed";
  if (!std::isfinite(value)) return value > 0 ? "infinite" : "-infinite";
  const double size = std::abs(value);
  if (size >= 10000 && size < 1e15)
    return (value < 0 ? "-" : "") + world::with_thousands(static_cast<unsigned long long>(std::llround(size)));
  return fmt::format("{:.4g}", value);
}

std::string reach_text(const std::optional<Reach>& reach, Better better) {
  if (!reach) return "";
  if (reach->times_rival) return ">= " + number_text(reach->value) + "x rival";
  return (better == Better::higher ? ">= " : "<= ") + number_text(reach->value);
}

std::string table_text(const std::vector<std::vector<std::string>>& rows) {
  std::vector<size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  const auto is_number = [](const std::string& cell) {
    return !cell.empty() && (std::isdigit(static_cast<unsigned char>(cell[0])) || cell[0] == '-') &&
           std::count(cell.begin(), cell.end(), ' ') <= 1;  // a number and its unit
  };
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      const std::string padding(widths[i] - row[i].size(), ' ');
      line += (i ? "  " : "") + (is_number(row[i]) ? padding + row[i] : row[i] + padding);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

Json machine_json(const Machine& m) {
  return {{"cpu", m.cpu},           {"cores", m.cores},       {"simd", m.simd},    {"memory_bytes", m.memory_bytes},
          {"kernel", m.kernel},     {"compiler", m.compiler}, {"flags", m.flags},  {"governor", m.governor},
          {"load_average", m.load}, {"date", m.date},         {"device", m.device}};
}

Json run_json(const Machine& machine, const RunOptions& options, const std::vector<RowResult>& rows) {
  Json json = header_json(machine, options);
  json["rows"] = Json::array();
  for (const RowResult& row : rows) json["rows"].push_back(row_json(row));
  return json;
}

Json pareto_json(const Machine& machine, const RunOptions& options, const std::vector<SubjectResult>& subjects) {
  Json json = header_json(machine, options);
  json["subjects"] = Json::array();
  for (const SubjectResult& subject : subjects) json["subjects"].push_back(subject_json(subject));
  return json;
}

namespace {

double double_of(const Json& json) { return json.is_number() ? json.get<double>() : NAN; }
std::optional<double> number_of(const Json& json) {
  return json.is_number() ? std::optional(json.get<double>()) : std::nullopt;
}
Spread spread_from_json(const Json& json) {
  Spread s;
  s.median = double_of(json.at("median")), s.q1 = double_of(json.at("q1")), s.q3 = double_of(json.at("q3"));
  return s;
}

PointResult point_from_json(const Json& json) {
  PointResult p;
  p.setting = json.at("setting"), p.method = json.at("method"), p.problem = json.at("problem");
  p.knob = double_of(json.at("knob")), p.bias = double_of(json.at("bias")), p.work = double_of(json.at("work"));
  for (const Json& error : json.at("errors")) p.errors.push_back(spread_from_json(error));
  p.ms = spread_from_json(json.at("ms_spread"));
  p.is_default = json.at("default"), p.is_reference = json.value("reference", false), p.failed = json.at("failed");
  p.noise_floor = double_of(json.at("noise_floor")), p.below_floor = json.at("below_floor"), p.front = json.at("front");
  if (const Json& on_front = json.at("default_on_front"); on_front.is_boolean()) p.default_on_front = on_front;
  return p;
}

std::string machine_words(const Json& head) {
  const Json& m = head.at("machine");
  return fmt::format("{}, {} cores, {}, Vulkan on {}, {}, {}, SIMD {}, commit {}, load {:.1f}",
                     m.at("cpu").get<std::string>(), m.at("cores").get<int>(),
                     world::bytes_text(double_of(m.at("memory_bytes"))), m.at("device").get<std::string>(),
                     m.at("kernel").get<std::string>(), m.at("compiler").get<std::string>(),
                     m.at("simd").empty() ? "none" : m.at("simd")[0].get<std::string>(),
                     head.at("commit").get<std::string>(), double_of(m.at("load_average")));
}

}  // namespace

world::Result<SubjectResult> subject_from_json(const Json& json) {
  try {
    SubjectResult s;
    s.name = json.at("name"), s.question = json.at("question"), s.reference = json.at("reference");
    s.metrics = json.at("metrics").get<std::vector<std::string>>(), s.work_unit = json.at("work_unit");
    s.noise_floor = double_of(json.at("noise_floor")), s.threads = json.at("threads");
    if (json.at("error").is_string()) s.error = json.at("error");
    for (const Json& point : json.at("points")) s.points.push_back(point_from_json(point));
    for (const Json& slope : json.at("slopes"))
      s.slopes.push_back(
          {slope.at("method"), slope.at("expected"), number_of(slope.at("fitted")), slope.at("met").get<bool>()});
    for (const Json& bias : json.at("biases"))
      s.biases.push_back({bias.at("method"), bias.at("limit"), double_of(bias.at("bias")), bias.at("met").get<bool>()});
    return s;
  } catch (const Json::exception& e) {
    return world::input_error(fmt::format("no subject of `loam bench pareto`: {}", e.what()));
  }
}

std::string machine_text(const Machine& m) {
  std::string text = machine_words(header_json(m, {})) + "\n";
  if (m.load > m.cores)
    text +=
        fmt::format("the machine was busy (load {:.1f} on {} cores): wall times are upper bounds\n", m.load, m.cores);
  return text;
}

std::string machine_line(const Json& head) {
  const Json& m = head.at("machine");
  return fmt::format("{}, flags {}, {}{}", machine_words(head), m.at("flags").get<std::string>(),
                     m.at("date").get<std::string>(), head.value("quick", false) ? ", quick run" : "");
}

std::string run_text(const std::vector<RowResult>& rows) {
  std::vector<std::vector<std::string>> table{
      {"benchmark", "median", "q1", "q3", "unit", "on", "rival", "rival's", "ratio", "reach", "met"}};
  std::string notes;
  for (const RowResult& r : rows) {
    const std::string name = r.suite + "/" + r.name;
    if (!r.error.empty()) {
      table.push_back({name, r.no_device ? "no device" : "FAILED"});
      notes += name + ": " + r.error + "\n";
      continue;
    }
    const bool rival = !r.rivals.empty();
    table.push_back({name, number_text(r.value.median), number_text(r.value.q1), number_text(r.value.q3), r.unit,
                     threads_text(r.threads), rival ? r.rivals[0].name : "",
                     rival ? number_text(r.rivals[0].value.median) : "", r.ratio ? number_text(r.ratio->median) : "",
                     reach_text(r.reach, r.better), r.met ? (*r.met ? "yes" : "NO") : ""});
    for (size_t i = 1; i < r.rivals.size(); ++i)
      notes += fmt::format("{}: {} {} {}\n", name, r.rivals[i].name, number_text(r.rivals[i].value.median), r.unit);
    if (r.limit)
      notes += fmt::format("{}: at most {} {} ({})\n", name, number_text(r.limit->value), r.unit, r.limit->origin);
    if (!r.thread_clock && r.cpu_ms > 0)
      notes += fmt::format("{}: {} ms of processor time a call, all threads\n", name, number_text(r.cpu_ms));
    for (const auto& [counter, value] : r.counters)
      notes += fmt::format("{}: {} {}\n", name, counter, number_text(value));
  }
  return table_text(table) + (notes.empty() ? "" : "\n" + notes);
}

std::string pareto_text(const SubjectResult& s) {
  std::string text = fmt::format("{}: {}\nreference: {}\n", s.name, s.question, s.reference);
  if (!s.error.empty()) return text + "FAILED: " + s.error + "\n";
  std::vector<std::vector<std::string>> table{{"setting"}};
  for (const std::string& metric : s.metrics) table[0].push_back(metric);
  for (const char* head : {"bias", "work", "ms", "IQR", "front", "default"}) table[0].push_back(head);
  for (const PointResult& p : s.points) {
    std::vector<std::string> row{p.setting};
    for (const Spread& e : p.errors) row.push_back(number_text(e.median));
    row.insert(row.end(), {number_text(p.bias), number_text(p.work), number_text(p.ms.median), number_text(p.ms.iqr()),
                           p.failed         ? "failed"
                           : p.below_floor  ? "below floor"
                           : p.is_reference ? "reference"
                           : p.front        ? "yes"
                                            : "",
                           p.is_default ? (p.default_on_front.value_or(true) ? "yes" : "OFF the front") : ""});
    table.push_back(std::move(row));
  }
  text += table_text(table);
  text += fmt::format("work counts {}; ms of one call on {}\n", s.work_unit, threads_text(s.threads));
  for (const SlopeResult& slope : s.slopes)
    text += fmt::format("slope of {}: {}, expected {:.2f} +- 0.1: {}\n", slope.method,
                        slope.fitted ? fmt::format("{:.3f}", *slope.fitted) : "none", slope.expected,
                        slope.met ? "met" : "NOT MET");
  return text;
}

std::string pareto_csv(const SubjectResult& s) {
  std::string text = "subject,method,setting,problem,knob";
  for (const std::string& metric : s.metrics) text += "," + metric;
  text += ",bias,work_" + s.work_unit + ",ms,ms_q1,ms_q3,ms_min,failed,below_floor,front,default\n";
  for (const PointResult& p : s.points) {
    text += fmt::format("{},{},{},{},{:.17g}", s.name, p.method, p.setting, p.problem, p.knob);
    for (const Spread& e : p.errors) text += fmt::format(",{:.17g}", e.median);
    text += fmt::format(",{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:d},{:d},{:d},{:d}\n", p.bias, p.work,
                        p.ms.median, p.ms.q1, p.ms.q3, p.ms.minimum, p.failed, p.below_floor, p.front, p.is_default);
  }
  return text;
}

}  // namespace tools
