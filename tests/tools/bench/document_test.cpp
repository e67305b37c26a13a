#include "tools/bench/document.h"

#include <algorithm>
#include <fstream>
#include <set>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "tests/tools/command.h"
#include "tools/bench/bench_verb.h"

namespace tools {

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = LOAM_SOURCE_DIR;

Machine machine(const std::string& cpu) {
  Machine m;
  m.cpu = cpu, m.cores = 2, m.date = "2026-01-02T03:04:05Z";
  return m;
}

RowResult row(const std::string& name, double value, const std::string& unit) {
  RowResult r;
  r.suite = "suite", r.name = name, r.unit = unit, r.value = spread_of({value});
  return r;
}

Registry registry_of(const std::vector<RowResult>& rows) {
  Registry registry;
  registry.begin_member("suite");
  for (const RowResult& r : rows) registry.add(Bench{.name = r.name, .what = "a row", .unit = r.unit});
  return registry;
}

/// Results of two machines: rows, and a subject with two methods.
class Document : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<RowResult> rows{row("save", 270.4, "ms"), row("edit", 4.25, "us"), row("memory", 0.2719, "B/m^3")};
    rows[0].rivals = {{"SQLite", spread_of({15.96})}}, rows[0].reach = Reach{600, "a guess"}, rows[0].met = true;
    rows[1].reach = Reach{2, "a guess"}, rows[1].met = false, rows[1].counters = {{"leaves", 123456}};
    ASSERT_TRUE(keep_rows(results(), machine("one"), {}, registry_of(rows), rows).ok());
    rows[0].value = spread_of({2000});
    ASSERT_TRUE(keep_rows(results(), machine("two"), {}, registry_of(rows), rows).ok());
    SubjectResult subject;
    subject.name = "subject", subject.metrics = {"distance (m)", "share (relative)"};
    for (const char* setting : {"coarse@1", "fine@1", "fine@2"}) {
      PointResult p;
      p.method = std::string(setting, std::string(setting).find('@')), p.setting = setting;
      p.errors = {spread_of({p.method == "fine" ? 0.0123 : 1.5}), spread_of({0.25})}, p.ms = spread_of({0.05});
      subject.points.push_back(p);
    }
    ASSERT_TRUE(keep_subject(results(), machine("one"), {}, subject).ok());
  }
  fs::path results() { return folder_ / "results"; }
  Result<DocumentResult> written(const std::string& text) {
    auto kept = KeptResults::read(results());
    EXPECT_TRUE(kept.ok());
    return document(text, "page.md", *kept);
  }
  std::string text(const std::string& markdown) {
    auto result = written(markdown);
    EXPECT_TRUE(result.ok()) << result.error().message;
    return result.ok() ? result->text : "";
  }
  std::string fault(const std::string& markdown) {
    auto result = written(markdown);
    EXPECT_FALSE(result.ok());
    return result.ok() ? "" : result.error().message;
  }
  world::TemporaryFolder folder_;
};

const std::string kOn = "<!-- bench on one-2-cores -->\n";

}  // namespace

TEST_F(Document, TablesAndWordsGetTheirNumbersAndTheRestIsLeft) {
  const std::string page = kOn +
                           "# Page\n\n"
                           "<!-- bench | {value} | {rival} | {reach} | {counter leaves suite/edit} leaves -->\n"
                           "| what | row | Loam | beside it | aim | work |\n"
                           "|---|---|---|---|---|---|\n"
                           "| a save \\| a copy | **`suite/save`** | 1 s | | | |\n"
                           "| both | `suite/save`, `edit` | | | | |\n"
                           "\nA save takes <!-- bench {value suite/save} -->9 s<!-- -->, there "
                           "<!-- bench {two-2-cores: value suite/save} -->?<!-- -->.\n";
  const std::string expected =
      kOn +
      "# Page\n\n"
      "<!-- bench | {value} | {rival} | {reach} | {counter leaves suite/edit} leaves -->\n"
      "| what | row | Loam | beside it | aim | work |\n"
      "|---|---|---|---|---|---|\n"
      "| a save \\| a copy | **`suite/save`** | 270 ms | SQLite: 16 ms | 600 ms | 123,456 leaves |\n"
      "| both | `suite/save`, `edit` | 270 ms, 4.25 µs | SQLite: 16 ms | 600 ms; 2 µs, missed | 123,456 leaves |\n"
      "\nA save takes <!-- bench {value suite/save} -->270 ms<!-- -->, there "
      "<!-- bench {two-2-cores: value suite/save} -->2 s<!-- -->.\n";
  EXPECT_EQ(text(page), expected);
  EXPECT_EQ(written(expected)->changes.size(), 0u) << "what is written once stays";
}

TEST_F(Document, PointsOfSubjectsAreFoundByMethodAndKnob) {
  EXPECT_EQ(text(kOn + "<!-- bench | {error subject/*@1} | {error 2 subject/*@1} | {ms subject/*@1} -->\n"
                       "| method | far | share | time |\n|---|---|---|---|\n| `coarse` | | | |\n| `fine` | | | |\n"),
            kOn +
                "<!-- bench | {error subject/*@1} | {error 2 subject/*@1} | {ms subject/*@1} -->\n"
                "| method | far | share | time |\n|---|---|---|---|\n| `coarse` | 1.5 m | 0.25 | 50 µs |\n"
                "| `fine` | 12 mm | 0.25 | 50 µs |\n");
  EXPECT_NE(text(kOn + "It is <!-- bench {error subject/coarse} -->x<!-- --> off.").find(">1.5 m<"), std::string::npos)
      << "the only setting of a method needs no knob";
  EXPECT_NE(fault(kOn + "It is <!-- bench {error subject/fine} -->x<!-- --> off.").find("2 settings"),
            std::string::npos);
}

TEST_F(Document, ABadMarkIsOneErrorWithFileLineAndWhatWasExpected) {
  const auto expect = [&](const std::string& markdown, const std::string& holds) {
    const std::string message = fault(kOn + markdown);
    EXPECT_EQ(message.rfind("page.md:2: ", 0), 0u) << message;
    EXPECT_NE(message.find(holds), std::string::npos) << message;
  };
  expect("A <!-- bench {value suite/sav} -->1<!-- -->", "no row \"suite/sav\", did you mean \"suite/save\"?");
  expect("A <!-- bench {mean suite/save} -->1<!-- -->", "no field \"mean\"; known: value");
  expect("A <!-- bench {rival MySQL suite/save} -->1<!-- -->", "no rival \"MySQL\"");
  expect("A <!-- bench {counter leafs suite/edit} -->1<!-- -->", "did you mean \"leaves\"?");
  expect("A <!-- bench {error 3 subject/coarse} -->1<!-- -->", "2 errors");
  expect("A <!-- bench {value suite/save} -->1", "<!-- -->");
  expect("A <!-- bench suite/save -->1<!-- -->", "{FIELD}");
  expect("A <!-- bench {value suite/save -->1<!-- -->", "brace");
  expect("A <!-- bench {three-2-cores: value suite/save} -->1<!-- -->", "three-2-cores");
  expect("<!-- bench {value suite/save} -->1<!-- -->", "begins a line");
  expect("<!-- bench on three-2-cores -->", "one-2-cores, two-2-cores");
  expect("<!-- bench | {value} -->\nno table", "table");
  EXPECT_NE(fault(kOn + "<!-- bench | {value} -->\n| row | Loam |\n|---|---|\n| save | |\n").find("page.md:5: "),
            std::string::npos);
  EXPECT_NE(fault("A <!-- bench {value suite/save} -->1<!-- -->").find("page.md:1: no machine"), std::string::npos);
}

TEST_F(Document, FencedCodeHoldsNoMarks) {
  const std::string page = "```\nA <!-- bench {value nothing/here} -->1<!-- -->\n```\n";
  EXPECT_EQ(text(page), page);
}

TEST_F(Document, KeptResultsAreResultsThatCompareReads) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(*bench_compare(results() / "one-2-cores", results() / "one-2-cores", false), 0);
  EXPECT_EQ(*bench_compare(results() / "one-2-cores" / "suite.json", results() / "one-2-cores" / "suite.json", false),
            0);
  EXPECT_EQ(*bench_compare(results() / "one-2-cores", results() / "two-2-cores", false), 1)
      << "the subject is gone there";
  const std::string shown = testing::internal::GetCapturedStdout();
  EXPECT_NE(shown.find("subject/fine@1 error: gone"), std::string::npos) << shown;
}

TEST_F(Document, ASubjectsTablesAreThoseOfTheMachineThatMeasuredItLast) {
  SubjectResult subject;
  subject.name = "subject", subject.metrics = {"distance (m)"};
  PointResult p;
  p.method = "later", p.setting = "later@1", p.errors = {spread_of({0.75})}, p.ms = spread_of({4}), p.front = true;
  subject.points.push_back(p);
  subject.slopes.push_back({"later", -0.5, -0.46, true});
  Machine later = machine("two");
  later.date = "2026-01-03T00:00:00Z";
  ASSERT_TRUE(keep_subject(results(), later, {}, subject).ok());
  const auto kept = KeptResults::read(results());
  ASSERT_TRUE(kept.ok());
  const auto subjects = kept->subjects();
  ASSERT_TRUE(subjects.ok()) << subjects.error().message;
  ASSERT_EQ(subjects->size(), 1u);
  const std::string text = accuracy_markdown("a command", *subjects);
  for (const char* part : {"| later@1 | 0.75 | 0 | 0 | 4 | 0 | front |", "slope of later: -0.460", "two, 2 cores"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("one, 2 cores"), std::string::npos) << text;
}

TEST_F(Document, ASubjectThatLacksWhatItsTablesReadIsOneSentence) {
  const fs::path file = results() / "one-2-cores" / "pareto" / "subject.json";
  std::string text = slurp(file);
  const size_t errors = text.find("\"errors\"");
  ASSERT_NE(errors, std::string::npos);
  std::ofstream(file) << text.replace(errors, 8, "\"other\"");
  const auto kept = KeptResults::read(results());
  ASSERT_TRUE(kept.ok());
  const auto subjects = kept->subjects();
  ASSERT_FALSE(subjects.ok());
  EXPECT_NE(subjects.error().message.find("subject is no subject of `loam bench pareto`"), std::string::npos)
      << subjects.error().message;
}

TEST_F(Document, ASuiteIsNotKeptInPart) {
  const std::vector<RowResult> rows{row("save", 1, "ms"), row("edit", 1, "us")};
  const Status kept = keep_rows(results(), machine("one"), {}, registry_of(rows), {rows[0]});
  ASSERT_FALSE(kept.ok());
  EXPECT_NE(kept.error().message.find("1 of 2 rows"), std::string::npos) << kept.error().message;
}

namespace {

Result<DocumentResult> readme(std::string text) {
  auto kept = KeptResults::read(kRoot / "tools" / "bench" / "results");
  EXPECT_TRUE(kept.ok()) << kept.error().message;
  if (text.empty()) text = slurp(kRoot / "README.md");
  return document(text, "README.md", *kept);
}

}  // namespace

TEST(Readme, ItsNumbersAreThoseOfTheKeptResults) {
  const auto result = readme({});
  ASSERT_TRUE(result.ok()) << result.error().message;
  for (const DocumentChange& c : result->changes)
    ADD_FAILURE() << "README.md:" << c.line << ": " << c.row << ": \"" << c.before << "\", measured \"" << c.after
                  << "\"; run `loam bench document README.md`";
  EXPECT_GT(result->rows.size(), 200u);
}

TEST(Readme, ItsTablesOfAccuracyAreThoseOfTheKeptSubjects) {
  DocumentRequest request;
  request.file = kRoot / "README.md", request.check = true;
  testing::internal::CaptureStdout();
  const auto checked = bench_document(request);
  const std::string shown = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(checked.ok()) << checked.error().message;
  EXPECT_EQ(shown.find("accuracy.md"), std::string::npos) << shown;
}

TEST(Readme, ANumberThatIsTypedIsFound) {
  std::string text = slurp(kRoot / "README.md");
  const size_t cell = text.find(" frames/s |");
  ASSERT_NE(cell, std::string::npos);
  text.insert(cell, "9");
  const auto result = readme(text);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->changes.size(), 1u);
}

TEST(Readme, EachRowAndSubjectThatItNamesCanBeMeasured) {
  const auto result = readme({});
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Registry registry = all_benchmarks();
  std::set<std::string> rows, subjects;
  for (const auto& [suite, bench] : registry.rows()) rows.insert(suite + "/" + bench.name);
  for (const Subject& subject : registry.subjects()) subjects.insert(subject.name);
  for (const std::string& name : result->rows)
    EXPECT_TRUE(rows.count(name) || subjects.count(name.substr(0, name.find('/')))) << name;
}

TEST_F(Command, DocumentWritesOrChecksAndNamesWhatMoved) {
  std::string page = slurp(kRoot / "README.md");
  const std::string right = page;
  const size_t cell = page.find(" frames/s |");
  ASSERT_NE(cell, std::string::npos);
  page.insert(cell, "9");
  write("page.md", page);
  const std::string arguments =
      "bench document " + path("page.md") + " --results '" + (kRoot / "tools/bench/results").string() + "'";
  const Outcome check = run(arguments + " --check");
  EXPECT_EQ(check.code, 1) << check.error;
  EXPECT_NE(check.out.find("page.md:"), std::string::npos) << check.out;
  EXPECT_EQ(slurp(folder_ / "page.md"), page) << "a check writes nothing";
  EXPECT_EQ(run(arguments).code, 0);
  EXPECT_EQ(slurp(folder_ / "page.md"), right);
  EXPECT_EQ(run(arguments + " --check").code, 0);
  write("page.md", "<!-- bench on nowhere -->\n");
  expect_one_sentence(run(arguments), 3, "page.md:1: ");
  expect_one_sentence(run("bench document " + path("none.md") + " --results " + path(".")), 3, "none.md");
}

}  // namespace tools
