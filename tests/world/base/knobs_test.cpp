#include "world/base/knobs.h"

#include <array>

#include <gtest/gtest.h>

namespace world {
namespace {

enum class Shape { cube, ball };
constexpr auto knob_choices(Shape) { return std::array<std::string_view, 2>{"cube", "ball"}; }

struct Knobs {
  float size = 2;
  int steps = 8;
  bool smooth = true;
  Shape shape = Shape::cube;
};

KnobTable<Knobs> table() {
  KnobTable<Knobs> t;
  t.add<float>("size", &Knobs::size, 1.0f, 2.0f, 0.1f, "m", "how large");
  t.add<int>("steps", &Knobs::steps, 4, 8, 64, "", "how often");
  t.add<bool>("smooth", &Knobs::smooth, false, true, true, "", "rounds edges");
  t.add<Shape>("shape", &Knobs::shape, Shape::cube, Shape::cube, Shape::ball, "", "what it is");
  return t;
}

std::string error_of(std::string_view name, std::string_view value) {
  Knobs knobs;
  const Status status = table().set(knobs, name, value);
  if (status.ok()) return "";
  EXPECT_EQ(status.error().kind, ErrorKind::usage);
  return status.error().message;
}

TEST(Knobs, EachTypeIsReadFromText) {
  Knobs knobs;
  EXPECT_TRUE(table().set(knobs, "size", "-0.25").ok());
  EXPECT_TRUE(table().set(knobs, "steps", "1e3").ok());
  EXPECT_TRUE(table().set(knobs, "smooth", "off").ok());
  EXPECT_TRUE(table().set(knobs, "shape", "ball").ok());
  EXPECT_EQ(knobs.size, -0.25f);
  EXPECT_EQ(knobs.steps, 1000);
  EXPECT_FALSE(knobs.smooth);
  EXPECT_EQ(knobs.shape, Shape::ball);
}

TEST(Knobs, AnUnknownNameIsRefusedWithTheNearestOne) {
  EXPECT_EQ(error_of("step", "3"),
            "unknown knob \"step\" (did you mean \"steps\"?); the knobs are: size steps smooth shape");
  EXPECT_EQ(error_of("qqqqqq", "3"), "unknown knob \"qqqqqq\"; the knobs are: size steps smooth shape");
}

TEST(Knobs, ABadValueIsRefusedAndChangesNothing) {
  EXPECT_EQ(error_of("size", "wide"), "knob size: \"wide\" is not a finite number");
  EXPECT_EQ(error_of("size", "1m"), "knob size: \"1m\" is not a finite number");
  EXPECT_EQ(error_of("size", ""), "knob size: \"\" is not a finite number");
  EXPECT_EQ(error_of("size", "nan"), "knob size: \"nan\" is not a finite number");
  EXPECT_EQ(error_of("size", "inf"), "knob size: \"inf\" is not a finite number");
  EXPECT_EQ(error_of("steps", "2.5"), "knob steps: \"2.5\" is not a whole number");
  EXPECT_EQ(error_of("steps", "3000000000"), "knob steps: 3000000000 is outside [-2147483648, 2147483647]");
  EXPECT_EQ(error_of("size", "1e300"), "knob size: 1e300 is outside [-3.4028235e+38, 3.4028235e+38]");
  EXPECT_EQ(error_of("smooth", "maybe"), "knob smooth: \"maybe\" is none of its settings: true false");
  EXPECT_EQ(error_of("shape", "Ball"), "knob shape: \"Ball\" is none of its settings: cube ball");
  Knobs knobs;
  EXPECT_FALSE(table().set(knobs, "steps", "1e99").ok());
  EXPECT_EQ(knobs.steps, 8);
}

TEST(Knobs, PresetsAreTheRowsColumns) {
  const Knobs fast = table().preset(Accuracy::fast), exact = table().preset(Accuracy::exact);
  EXPECT_EQ(fast.size, 1.0f);
  EXPECT_EQ(fast.steps, 4);
  EXPECT_FALSE(fast.smooth);
  EXPECT_EQ(exact.size, 0.1f);  // through text and back without loss
  EXPECT_EQ(exact.shape, Shape::ball);
  EXPECT_EQ(*accuracy_from_name("fast"), Accuracy::fast);
  EXPECT_EQ(*accuracy_from_name("exact"), Accuracy::exact);
  EXPECT_EQ(accuracy_from_name("best").error().message, "unknown accuracy \"best\": use fast, usual or exact");
}

TEST(Knobs, WhatIsPrintedIsReadBackUnchanged) {
  const KnobTable<Knobs> t = table();
  Knobs knobs{0.1f, -5, false, Shape::ball}, copy;
  for (const auto& row : t.rows()) EXPECT_TRUE(row.set(copy, row.get(knobs)).ok()) << row.name;
  EXPECT_EQ(copy.size, 0.1f);
  EXPECT_EQ(copy.steps, -5);
  EXPECT_FALSE(copy.smooth);
  EXPECT_EQ(copy.shape, Shape::ball);
}

}  // namespace
}  // namespace world
