#include "tools/report/sheet.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "well_formed.hpp"

namespace probebox::report {
namespace {

using testing::HasSubstr;
using testing::Not;
using Verdict = SheetRow::Verdict;

Sheet sheet(Verdict second) {
  return {.title = "Factory sheet",
          .box = "sim <PB-1>",
          .when = "2026-11-26T08:00:00Z",
          .by = "Ada",
          .where = "usb:PB-1",
          .rows = {{"clock", "master clock", "locked", "locked", Verdict::passed},
                   {"edges", "edges", "3 lost", "none", second},
                   {"exposure", "exposure", "", "", Verdict::not_told}}};
}

TEST(FactorySheet, PassesOnlyWhereNoLineFails) {
  EXPECT_EQ(sheet(Verdict::passed).failed(), 0U);
  EXPECT_EQ(sheet(Verdict::failed).failed(), 1U);
  const auto good = sheetPage(sheet(Verdict::passed), "1.2.3");
  EXPECT_THAT(good, HasSubstr("<div class=\"verdict pass\"><p>PASSED</p>"));
  EXPECT_THAT(good, Not(HasSubstr("FAILED")));
  const auto bad = sheetPage(sheet(Verdict::failed), "1.2.3");
  EXPECT_THAT(bad, testing::AllOf(HasSubstr("FAILED: 1"), HasSubstr("3 lines")));
  EXPECT_THAT(bad, HasSubstr("<td>3 lost</td><td>none</td><td><strong>FAILED</strong></td>"));
}

TEST(FactorySheet, IsADocumentThatNamesTheBoxAndWhatItDoesNotTell) {
  const auto page = sheetPage(sheet(Verdict::no_limit), "1.2.3");
  EXPECT_EQ(WellFormed::objectionTo(page), "");
  EXPECT_THAT(page, testing::AllOf(HasSubstr("sim &lt;PB-1&gt;"), HasSubstr("2026-11-26T08:00:00Z"), HasSubstr("Ada"),
                                   HasSubstr("usb:PB-1")));
  EXPECT_THAT(page, HasSubstr("<td>not told by this box</td>"));
  EXPECT_THAT(page, HasSubstr("<td>no limit</td>"));
}

}  // namespace
}  // namespace probebox::report
