#include "firmware/app/wiring/start_folder.hpp"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <string>

#include "board/describe/parse.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using testing::HasSubstr;

class StartFolder : public testing::Test {
 protected:
  support::TemporaryFolder parent;
  const std::filesystem::path folder = parent.path() / "start-folder" / "probebox";
};

std::string textOf(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  return text.str();
}

TEST_F(StartFolder, HoldsDescriptionsThatTheDaemonTakes) {
  ASSERT_FALSE(writeStartingDescriptions(folder));
  const auto descriptions = board::loadDirectory(folder);
  ASSERT_TRUE(descriptions) << descriptions.error().what;
  const auto refused = validate(Options{}, *descriptions);
  EXPECT_FALSE(refused) << refused->what;
  // A real box: nothing in it is emulated.
  EXPECT_FALSE(descriptions->world);
}

TEST_F(StartFolder, MarksWhatItsOwnerHasToChange) {
  ASSERT_FALSE(writeStartingDescriptions(folder));
  for (const auto* file : {"box.toml", "machine.toml", "probe.toml"})
    EXPECT_THAT(textOf(folder / file), HasSubstr("# <-")) << file;
}

TEST_F(StartFolder, OverwritesNothing) {
  std::filesystem::create_directories(folder);
  std::ofstream{folder / "probe.toml"} << "mine";
  const auto refused = writeStartingDescriptions(folder);
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->what, testing::AllOf(HasSubstr("probe.toml"), HasSubstr("already")));
  EXPECT_EQ(textOf(folder / "probe.toml"), "mine");
  EXPECT_FALSE(std::filesystem::exists(folder / "box.toml"));
}

TEST_F(StartFolder, IsNamedWhereItCannotBeMade) {
  std::filesystem::create_directories(folder.parent_path());
  std::ofstream{folder} << "a file";
  const auto refused = writeStartingDescriptions(folder / "below");
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->what, HasSubstr((folder / "below").string()));
  const auto too_long = writeStartingDescriptions(std::string(300, 'a'));
  ASSERT_TRUE(too_long);
  EXPECT_THAT(too_long->what, testing::AllOf(HasSubstr("box.toml"), HasSubstr("too long")));
}

}  // namespace
}  // namespace probebox::app
