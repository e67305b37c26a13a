/// loam bench list | run | pareto | absent | stability | compare | document: how fast, how small, and how accuracy is
/// paid for with time.
#include <memory>

#include "tools/bench/bench_verb.h"
#include "tools/verb.h"

namespace tools {

namespace {

struct BenchArguments {
  BenchRequest request;
  std::string before, after;
  DocumentRequest document;
};

}  // namespace

void add_bench_verb(CommandLine& command) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App* bench = command.verb("bench", "benchmarks: list, run, pareto, absent, stability, compare, document");
  bench->require_subcommand(1);
  const auto common = [&](CLI::App* app) {
    app->add_flag("--json", arguments->request.json, "one JSON object on stdout");
    app->add_flag("--quick", arguments->request.quick, "less work and fewer repetitions");
    app->add_option("--seed", arguments->request.seed, "of the order of the runs, and of stochastic methods");
  };

  CLI::App* list = bench->add_subcommand("list", "what can be measured");
  list->add_flag("--json", arguments->request.json, "one JSON object on stdout");

  CLI::App* run = bench->add_subcommand("run", "measure suites against their rivals and reaches");
  run->add_option("SUITE", arguments->request.names, "suites or suite/benchmark (default: all)");
  common(run);
  const auto keep = [&](CLI::App* app) {
    app->add_option("--keep", arguments->request.keep_folder,
                    "folder for results that stay, as tools/bench/results: a file a suite or subject, by machine");
  };
  keep(run);

  CLI::App* pareto = bench->add_subcommand("pareto", "accuracy against time, against a reference");
  pareto->add_option("SUBJECT,--subject", arguments->request.names, "subjects (default: all)");
  pareto->add_option("--plot", arguments->request.plot_folder, "folder for an SVG and a CSV of each subject");
  pareto->add_option("--report", arguments->request.report_folder,
                     "folder for report.html (plots, tables, pictures, commands), accuracy.md, CSV and JSON");
  common(pareto);
  keep(pareto);

  CLI::App* compare = bench->add_subcommand("compare", "what changed for sure between two results of `run --json`");
  compare->add_option("A", arguments->before, "the earlier result, or a folder of kept ones")->required();
  compare->add_option("B", arguments->after, "the later result")->required();
  compare->add_flag("--json", arguments->request.json, "one JSON object on stdout");

  CLI::App* absent = bench->add_subcommand("absent", "what effects cost that a scene doesn't call for");
  absent->add_option("EFFECT", arguments->request.names, "effects (default: all)");
  common(absent);

  CLI::App* stability = bench->add_subcommand("stability", "hard cases of numbers, their bounds and how far they are");
  stability->add_option("CASE", arguments->request.names, "hard cases by their names (default: all)");
  common(stability);

  CLI::App* document = bench->add_subcommand(
      "document", "writes the numbers of a Markdown file from kept results, and the tables of accuracy.md beside them");
  document->add_option("FILE", arguments->document.file, "Markdown with marks, as README.md (tools/bench/document.h)")
      ->required();
  document->add_option("--results", arguments->document.results,
                       "folder that --keep wrote (default: tools/bench/results beside FILE)");
  document->add_flag("--check", arguments->document.check, "changes nothing; exit 1 if a number would move");
  document->add_flag("--json", arguments->document.json, "one JSON object on stdout");

  command.action(bench, [=]() -> Result<int> {
    if (document->parsed()) return bench_document(arguments->document);
    if (absent->parsed()) return bench_absent(arguments->request);
    if (stability->parsed()) return bench_stability(arguments->request);
    if (compare->parsed()) return bench_compare(arguments->before, arguments->after, arguments->request.json);
    const Registry registry = all_benchmarks();
    if (list->parsed()) return bench_list(registry, arguments->request.json);
    if (pareto->parsed()) return bench_pareto(registry, arguments->request);
    return bench_run(registry, arguments->request);
  });
}

}  // namespace tools
