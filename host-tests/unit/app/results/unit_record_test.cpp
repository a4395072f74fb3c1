#include "firmware/app/results/unit_record.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/support/file_content.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using testing::HasSubstr;

std::string unitToml(const std::string& serial_number) {
  return "[unit]\nserial_number = \"" + serial_number +
         "\"\nvendor = \"V\"\nmodel = \"M\"\nboard = \"sim\"\n[usb]\nvendor_id = 1\nproduct_id = 2\n";
}

class UnitRecordTest : public testing::Test {
 protected:
  UnitRecord open() const { return UnitRecord{path_}; }

  const support::TemporaryFolder folder_{support::inMemory()};
  const std::string path_{folder_.file("unit")};
};

TEST_F(UnitRecordTest, IsWrittenOnceAndUsedFromTheNextStartOn) {
  {
    auto record = open();
    EXPECT_FALSE(record.locked());
    const auto written = record.write(unitToml("A1"), "sim");
    ASSERT_TRUE(written.ok()) << written.error().what;
    EXPECT_EQ(record.unit()->serial_number, "A1");
    EXPECT_FALSE(record.inUse());
    const auto again = record.write(unitToml("A2"), "sim");
    ASSERT_FALSE(again.ok());
    EXPECT_THAT(again.error().what, testing::AllOf(HasSubstr("as A1"), HasSubstr("remove " + path_ + " as root")));
  }
  auto record = open();
  EXPECT_TRUE(record.locked());
  ASSERT_TRUE(record.inUse());
  EXPECT_EQ(record.inUse()->serial_number, "A1");
  EXPECT_FALSE(record.write(unitToml("A1"), "sim").ok()) << "not even with the same text";
  EXPECT_EQ(record.problem(), "");
}

TEST_F(UnitRecordTest, KeepsNothingOfWhatItRefuses) {
  auto record = open();
  EXPECT_THAT(record.write(unitToml("A1"), "raspberry-pi").error().what, HasSubstr("unit.board"));
  EXPECT_THAT(record.write("[unit]\n", "sim").error().what, HasSubstr("missing key"));
  EXPECT_THAT(record.write("", "sim").error().what, HasSubstr("missing key"));
  EXPECT_THAT(record.write(unitToml("A1") + std::string(UnitRecord::kMostBytes, '#'), "sim").error().what,
              HasSubstr("shorten it"));
  EXPECT_FALSE(record.locked());
  EXPECT_TRUE(record.write(unitToml("A1"), "sim").ok());
}

TEST_F(UnitRecordTest, OfTheLargestSizeHasRoom) {
  auto text = unitToml("A1");
  text += std::string(UnitRecord::kMostBytes - text.size(), '#');
  EXPECT_TRUE(open().write(text, "sim").ok());
  EXPECT_TRUE(open().inUse());
}

TEST_F(UnitRecordTest, IsLookedAtBesideTheDaemon) {
  ASSERT_TRUE(UnitRecord::peek(path_).ok());
  EXPECT_FALSE(UnitRecord::peek(path_).value());
  EXPECT_FALSE(std::filesystem::exists(path_)) << "who looks makes nothing";
  auto record = open();
  EXPECT_FALSE(UnitRecord::peek(path_).value());
  ASSERT_TRUE(record.write(unitToml("A1"), "sim").ok());
  EXPECT_EQ(UnitRecord::peek(path_).value()->serial_number, "A1");
  const auto before = support::contentOf(path_);
  std::ofstream{path_, std::ios::binary | std::ios::trunc} << "garbage";
  const auto damaged = UnitRecord::peek(path_);
  ASSERT_FALSE(damaged.ok());
  EXPECT_THAT(damaged.error().what, HasSubstr("is damaged"));
  EXPECT_EQ(support::contentOf(path_), "garbage") << "who looks puts nothing aside";
}

TEST_F(UnitRecordTest, ThatIsLostIsSaidUntilTheBoxIsProvisionedAgain) {
  ASSERT_TRUE(open().write(unitToml("A1"), "sim").ok());
  std::ofstream{path_, std::ios::binary | std::ios::trunc} << "garbage";
  for (int start = 0; start < 3; ++start) {
    const auto record = open();
    EXPECT_THAT(record.problem(), HasSubstr("is lost")) << "start " << start;
    EXPECT_FALSE(record.inUse());
    EXPECT_FALSE(record.locked());
    EXPECT_THAT(UnitRecord::peek(path_).error().what, HasSubstr("lost"));
  }
  ASSERT_TRUE(open().write(unitToml("A2"), "sim").ok());
  EXPECT_EQ(open().problem(), "");
  EXPECT_EQ(open().inUse()->serial_number, "A2");
}

// Firmware that is older or stricter than the one that wrote it.
TEST_F(UnitRecordTest, ThatIsNotUnderstoodStaysLockedAndIsSaid) {
  {
    auto file = store::TwinFile::open(path_, UnitRecord::kMostBytes, {});
    ASSERT_TRUE(file.write(unitToml("A1") + "[later]\n"));
  }
  auto record = open();
  EXPECT_FALSE(record.inUse());
  EXPECT_THAT(record.problem(), HasSubstr("not understood"));
  EXPECT_THAT(record.write(unitToml("A2"), "sim").error().what, HasSubstr("once"));
}

}  // namespace
}  // namespace probebox::app
