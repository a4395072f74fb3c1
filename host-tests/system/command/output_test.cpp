#include "tools/probebox/cli/output.hpp"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {
namespace {

using support::contentOf;
using testing::HasSubstr;

TEST(OutputFile, ReplacesNoFileThatIsMadeMeanwhile) {
  const RuntimeDirectory directory;
  const auto file = directory.file("table.csv");
  std::ostringstream standard;
  for (const bool force : {false, true}) {
    auto output = Output::open(file, force, standard);
    ASSERT_TRUE(output);
    EXPECT_TRUE(output->write("new"));
    std::ofstream{file} << "precious";
    EXPECT_EQ(output->finish(), force);
    if (!force) {
      EXPECT_THAT(output->failure(), HasSubstr("table.csv"));
    }
    EXPECT_EQ(contentOf(file), force ? "new" : "precious");
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator{directory.path()}, {}), 1) << "no part is left";
}

TEST(OutputFile, IsWrittenWhereALinkLeads) {
  const RuntimeDirectory directory;
  std::ostringstream standard;
  for (const auto appears : {Output::Appears::when_whole, Output::Appears::as_it_grows}) {
    const auto name = std::to_string(static_cast<int>(appears));
    const auto link = directory.file("link-" + name), file = directory.file("file-" + name);
    std::filesystem::create_symlink(file, link);
    auto output = Output::open(link, false, standard, appears);
    ASSERT_TRUE(output) << output.error().what;
    EXPECT_TRUE(output->write("new") && output->finish());
    EXPECT_EQ(contentOf(file), "new");
    EXPECT_TRUE(std::filesystem::is_symlink(link));
  }
}

TEST(OutputFile, IsRefusedInAFolderThatIsGone) {
  const RuntimeDirectory directory;
  const auto recording = directory.file("scan.pbx"), gone = directory.file("gone");
  std::ofstream{recording} << probebox({"pack", "-", "-"}, "sample,x\n5,1\n6,1\n").out;
  const auto before = std::filesystem::current_path();
  std::filesystem::create_directory(gone);
  std::filesystem::current_path(gone);
  std::filesystem::remove(gone);
  const auto exported = probebox({"export", recording, "-o", "x.csv"});
  std::filesystem::current_path(before);
  EXPECT_EQ(exported.status, 2);
  EXPECT_THAT(exported.err, testing::AllOf(HasSubstr("x.csv"), HasSubstr("No such")));
}

}  // namespace
}  // namespace probebox::command
