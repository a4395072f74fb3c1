#include "firmware/metrology/dataset/subject.hpp"

#include <array>
#include <gtest/gtest.h>

namespace probebox {
namespace {

TEST(Subjects, ArePrintedAsTheyAreParsed) {
  constexpr std::array kNames{
      "delay",           "delay-x",        "delay-xz",          "delay-oblique",     "delay-joints",
      "centreline",      "centreline-2",   "centreline-slide",  "centreline-stylus", "centreline-stylus-2",
      "stylus-offset-3", "spindle-offset", "spindle-tilt",      "head-pivot",        "table-pivot",
      "swivel-b",        "rotary-c",       "tool-99",           "assembly-4",        "setter",
      "check",           "screw-x",        "screw-reference-z", "sensor-head-5",     "pre-travel",
      "pre-travel-2"};
  for (const auto* name : kNames) {
    const auto subject = parseSubject(name);
    ASSERT_TRUE(subject) << name;
    EXPECT_EQ(text(*subject), name);
    EXPECT_TRUE(isAbout(name, subject->kind));
  }
}

TEST(Subjects, HaveVariants) {
  for (const auto* name : {"delay", "delay-xy", "delay-oblique", "delay-joints"})
    EXPECT_TRUE(isAboutKindOf(name, SubjectKind::delay)) << name;
  for (const auto* name :
       {"centreline", "centreline-slide", "centreline-stylus", "centreline-2", "centreline-stylus-2"})
    EXPECT_TRUE(isAboutKindOf(name, SubjectKind::centreline)) << name;
  EXPECT_TRUE(isAboutKindOf("delay-joints", SubjectKind::delay_joints));
  EXPECT_FALSE(isAboutKindOf("delay", SubjectKind::delay_joints));
  EXPECT_FALSE(isAboutKindOf("screw-reference-x", SubjectKind::screw));
  EXPECT_FALSE(isAboutKindOf("centreline-by-steps", SubjectKind::centreline));
}

TEST(Subjects, AreNoMethodsAndHaveOneSpelling) {
  for (const auto* name : {"",
                           "delay-",
                           "centreline-1",
                           "centreline-3",
                           "centreline-slide-2",
                           "delay-yx",
                           "delay-xyz",
                           "delay-plates",
                           "delay-in-out",
                           "tool-setter",
                           "tool-",
                           "tool-04",
                           "tool--4",
                           "screw",
                           "screw-xy",
                           "screw-calibration",
                           "rotary-axis-errors",
                           "rotary-d",
                           "swivel-error",
                           "sensor-head-calibration",
                           "pre-travel-",
                           "pre-travel-0",
                           "c-axis-alignment",
                           "sphere-fit",
                           "Delay"})
    EXPECT_FALSE(parseSubject(name)) << name;
}

TEST(Subjects, TellTheirAxesAndNumbers) {
  EXPECT_EQ(parseSubject("rotary-c")->axis(), 2U);
  EXPECT_EQ(parseSubject("screw-y"), aboutAxis(SubjectKind::screw, 1));
  const auto some = *parseSubject("delay-xz");
  EXPECT_TRUE(some.has(0) && !some.has(1) && some.has(2));
  EXPECT_EQ(parseSubject("delay")->of, kAllAxes);
  EXPECT_EQ(parseSubject("tool-12"), (Subject{SubjectKind::tool, 12}));
  EXPECT_FALSE(parseSubject("tool-12", SubjectKind::assembly));
}

}  // namespace
}  // namespace probebox
